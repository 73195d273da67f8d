//! Keys beyond the schema: any that begin with `x_`.

use std::collections::BTreeMap;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

/// Further keys of an object; all begin with `x_`, others are refused when a report is read.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Extra(BTreeMap<String, Value>);

impl Extra {
    /// Sets a key; `x_` is put before it where it is missing.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) {
        let key = if key.starts_with("x_") { key.to_owned() } else { format!("x_{key}") };
        self.0.insert(key, value.into());
    }

    /// The value of a key with its `x_`.
    pub fn get(&self, key: &str) -> Option<&Value> {
        self.0.get(key)
    }

    /// Keys and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value))
    }
}

impl<'de> Deserialize<'de> for Extra {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let keys = BTreeMap::<String, Value>::deserialize(deserializer)?;
        match keys.keys().find(|key| !key.starts_with("x_")) {
            Some(key) => Err(D::Error::custom(format!("unknown key `{key}`: keys beyond the schema begin with x_"))),
            None => Ok(Self(keys)),
        }
    }
}
