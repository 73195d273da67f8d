//! Parameters of an effect by name, read strictly: an unknown name, a missing one and an impossible number are refused.

use std::collections::BTreeMap;

/// A number, or a few of them.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// One number.
    Number(f64),
    /// A vector.
    Vector(Vec<f64>),
}

/// What a parameter is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name as in the vocabulary.
    pub name: &'static str,
    /// Unit as in the vocabulary; where it has two forms, revolute joints take the first, prismatic ones the second.
    pub unit: &'static str,
    /// Value where the file does not give it; none: must be given.
    pub default: Option<f64>,
    /// Smallest and largest value that means anything.
    pub range: (f64, f64),
}

impl Parameter {
    /// A parameter that must be given.
    pub(crate) const fn needed(name: &'static str, unit: &'static str, range: (f64, f64)) -> Self {
        Self { name, unit, default: None, range }
    }

    /// A parameter that may be left out.
    pub(crate) const fn optional(name: &'static str, unit: &'static str, default: f64, range: (f64, f64)) -> Self {
        Self { name, unit, default: Some(default), range }
    }
}

/// Any finite number.
pub(crate) const ANY: (f64, f64) = (f64::MIN, f64::MAX);
/// Any number from 0.
pub(crate) const NOT_NEGATIVE: (f64, f64) = (0.0, f64::MAX);
/// Any number above 0.
pub(crate) const POSITIVE: (f64, f64) = (f64::MIN_POSITIVE, f64::MAX);
/// A time that steps of a fraction of a millisecond can follow.
pub(crate) const LASTING_S: (f64, f64) = (1e-3, f64::MAX);

/// Why parameters were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// No such parameter.
    #[error("has no parameter `{name}`; it has {known}")]
    Unknown {
        /// As given.
        name: String,
        /// Names with units.
        known: String,
    },
    /// Left out.
    #[error("needs the parameter `{name}` ({unit})")]
    Missing {
        /// Its name.
        name: &'static str,
        /// Its unit.
        unit: &'static str,
    },
    /// Not a number that means anything.
    #[error("parameter `{name}` is {found}, must be {expected} ({unit})")]
    Range {
        /// Its name.
        name: &'static str,
        /// As given.
        found: String,
        /// What would do.
        expected: String,
        /// Its unit.
        unit: &'static str,
    },
}

/// Values by name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Parameters(pub BTreeMap<String, Value>);

impl Parameters {
    /// From pairs of name and number.
    pub fn of(pairs: &[(&str, f64)]) -> Self {
        Self(pairs.iter().map(|(name, value)| ((*name).to_owned(), Value::Number(*value))).collect())
    }

    /// Refuses names that are neither in `known` nor one of the vectors in `vectors`.
    pub(crate) fn only(&self, known: &'static [Parameter], vectors: &'static [Parameter]) -> Result<(), ParameterError> {
        let all = || known.iter().chain(vectors);
        match self.0.keys().find(|name| all().all(|parameter| parameter.name != name.as_str())) {
            None => Ok(()),
            Some(name) => Err(ParameterError::Unknown {
                name: name.clone(),
                known: all().map(|parameter| format!("{} ({})", parameter.name, parameter.unit)).collect::<Vec<_>>().join(", "),
            }),
        }
    }

    /// The numbers of `known`, in its order.
    pub(crate) fn numbers<const N: usize>(&self, known: &'static [Parameter; N]) -> Result<[f64; N], ParameterError> {
        self.only(known, &[])?;
        let mut values = [0.0; N];
        for (value, parameter) in values.iter_mut().zip(known) {
            *value = self.number(parameter)?;
        }
        Ok(values)
    }

    /// One number.
    pub(crate) fn number(&self, parameter: &'static Parameter) -> Result<f64, ParameterError> {
        let (low, high) = parameter.range;
        match (self.0.get(parameter.name), parameter.default) {
            (Some(Value::Number(value)), _) if value.is_finite() && (low..=high).contains(value) => Ok(*value),
            (Some(value), _) => Err(out_of_range(parameter, value)),
            (None, Some(default)) => Ok(default),
            (None, None) => Err(ParameterError::Missing { name: parameter.name, unit: parameter.unit }),
        }
    }

    /// A vector of `N` finite numbers.
    pub(crate) fn vector<const N: usize>(&self, parameter: &'static Parameter) -> Result<[f64; N], ParameterError> {
        let Some(value) = self.0.get(parameter.name) else {
            return Err(ParameterError::Missing { name: parameter.name, unit: parameter.unit });
        };
        let refused = || ParameterError::Range {
            name: parameter.name,
            found: shown(value),
            expected: format!("{N} finite numbers"),
            unit: parameter.unit,
        };
        match value {
            Value::Vector(numbers) if numbers.iter().all(|number| number.is_finite()) => {
                numbers.as_slice().try_into().map_err(|_| refused())
            }
            _ => Err(refused()),
        }
    }
}

fn out_of_range(parameter: &'static Parameter, value: &Value) -> ParameterError {
    let expected = match parameter.range {
        ANY => "one finite number".to_owned(),
        NOT_NEGATIVE => "one number of 0 or more".to_owned(),
        POSITIVE => "one number above 0".to_owned(),
        LASTING_S => "one number of 0.001 or more".to_owned(),
        (low, high) => format!("one number from {low} to {high}"),
    };
    ParameterError::Range { name: parameter.name, found: shown(value), expected, unit: parameter.unit }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::Vector(numbers) => format!("{numbers:?}"),
    }
}
