//! What robot files of every base have in common, as TOML has it.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::effect::{Given, Names, Which, index};
use super::error::line_of;
use super::{Effect, PayloadSite, RobotError};
use crate::physics::{Parameters, Physics, Value};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EffectTable {
    physics: String,
    joint: Option<Which>,
    motor: Option<Which>,
    driven_by: Option<Which>,
    link: Option<Which>,
    channel: Option<String>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    #[serde(default)]
    parameters: BTreeMap<String, ValueTable>,
    source: Option<String>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum ValueTable {
    Number(f64),
    Vector(Vec<f64>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SiteTable {
    link: Which,
    position_m: [f64; 3],
    name: Option<String>,
}

pub(super) fn effects(tables: &[Spanned<EffectTable>], names: &Names, text: &str) -> Result<Vec<Effect>, RobotError> {
    let one = |(at, table): (usize, &Spanned<EffectTable>)| {
        let line = line_of(text, table.span().start);
        effect(table.get_ref(), names).map_err(|what| RobotError::Effect {
            line,
            number: at + 1,
            physics: table.get_ref().physics.escape_debug().to_string(),
            what,
        })
    };
    let all: Vec<Effect> = tables.iter().enumerate().map(one).collect::<Result<_, _>>()?;
    for (at, effect) in all.iter().enumerate() {
        if all[..at].iter().any(|other| exclude_each_other(other, effect)) {
            return Err(RobotError::Effect {
                line: line_of(text, tables[at].span().start),
                number: at + 1,
                physics: effect.physics.name().to_owned(),
                what: "stands there already; a joint has one hysteresis at a time and a channel one delay: make one of them"
                    .to_owned(),
            });
        }
    }
    Ok(all)
}

/// Of these the plant has room for one in a place.
fn exclude_each_other(a: &Effect, b: &Effect) -> bool {
    a.bound == b.bound
        && match (a.physics, b.physics) {
            (Physics::CableHysteresis(_), Physics::CableHysteresis(_)) => a.from_s < b.to_s && b.from_s < a.to_s,
            (Physics::MeasurementDelay(_), Physics::MeasurementDelay(_)) => true,
            _ => false,
        }
}

fn effect(table: &EffectTable, names: &Names) -> Result<Effect, String> {
    let values = table.parameters.iter().map(|(name, value)| {
        let value = match value {
            ValueTable::Number(number) => Value::Number(*number),
            ValueTable::Vector(numbers) => Value::Vector(numbers.clone()),
        };
        (name.clone(), value)
    });
    let given = Given {
        joint: table.joint.clone(),
        motor: table.motor.clone(),
        driven_by: table.driven_by.clone(),
        link: table.link.clone(),
        channel: table.channel.clone(),
        from_s: table.from_s,
        to_s: table.to_s,
        source: table.source.clone(),
    };
    Effect::given(&table.physics, &Parameters(values.collect()), &given, names)
}

pub(super) fn sites(tables: &[Spanned<SiteTable>], names: &Names, text: &str) -> Result<Vec<PayloadSite>, RobotError> {
    let one = |site: &Spanned<SiteTable>| {
        let refuse = |what: String| value(line_of(text, site.span().start), "payload_site", what);
        let table = site.get_ref();
        let link = index("link", Some(&table.link), &names.links).map_err(refuse)?;
        if !table.position_m.iter().all(|length| length.is_finite()) {
            return Err(refuse("needs a finite `position_m`".to_owned()));
        }
        Ok(PayloadSite { link, position_m: table.position_m, name: table.name.clone() })
    };
    tables.iter().map(one).collect()
}

pub(super) fn value(line: usize, key: impl Into<String>, what: impl Into<String>) -> RobotError {
    RobotError::Value { line, key: key.into(), what: what.into() }
}

/// Numbers of 0 or more?
pub(super) fn not_negative(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite() && *value >= 0.0)
}

/// Numbers above 0?
pub(super) fn positive(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite() && *value > 0.0)
}
