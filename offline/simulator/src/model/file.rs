//! Robot files, read strictly.

use std::collections::BTreeMap;

use arm::plant::SCHEMA as PLANT_SCHEMA;
use arm::{JOINTS, Raven2};
use serde::Deserialize;

use super::effect::Given;
use super::{Effect, Pretension, Robot, RobotError};
use crate::physics::{Parameters, Value};

const SCHEMA: &str = "ravenpose-robot/1";
const NOMINAL: &str = include_str!("../../../../models/raven2-plant.toml");

#[derive(Deserialize)]
struct Header {
    schema: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    #[serde(rename = "schema")]
    _schema: String,
    name: String,
    base: String,
    #[serde(default)]
    plant: toml::Table,
    cable: Option<CableTable>,
    homing: Option<HomingTable>,
    stiction: Option<StictionTable>,
    #[serde(default, rename = "effect")]
    effects: Vec<EffectTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CableTable {
    stiffness_n_m: [f64; 3],
    stiffening_length_m: [f64; 3],
    pretension_n: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HomingTable {
    offset_sd: [f64; JOINTS],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StictionTable {
    presliding: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectTable {
    physics: String,
    joint: Option<usize>,
    driven_by: Option<usize>,
    link: Option<usize>,
    channel: Option<String>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    #[serde(default)]
    parameters: BTreeMap<String, ValueTable>,
    /// Where the size comes from: for readers of the file.
    #[serde(rename = "source")]
    _source: Option<String>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum ValueTable {
    Number(f64),
    Vector(Vec<f64>),
}

pub(super) fn parse(text: &str) -> Result<Robot, RobotError> {
    let header: Header = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    match header.schema.as_deref() {
        Some(SCHEMA) => robot(text),
        Some(PLANT_SCHEMA) => Ok(Robot::of(Raven2::from_toml(text)?)),
        other => Err(RobotError::Kind {
            key: "schema",
            found: other.unwrap_or("missing").to_owned(),
            expected: "`ravenpose-robot/1` or `raven2-plant/1`",
        }),
    }
}

fn robot(text: &str) -> Result<Robot, RobotError> {
    let file: RobotFile = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    if file.base != "raven2-nominal" {
        return Err(RobotError::Kind { key: "base", found: file.base, expected: "`raven2-nominal`" });
    }
    let mut plant: toml::Table = toml::from_str(NOMINAL).map_err(|error| syntax(&error, NOMINAL))?;
    merge(&mut plant, file.plant);
    let mut robot = Robot::of(Raven2::from_toml(&plant.to_string())?);
    robot.name = file.name;
    robot.cables = file.cable.as_ref().map(pretension).transpose()?;
    if let Some(homing) = file.homing {
        let good = homing.offset_sd.iter().all(|sd| sd.is_finite() && *sd >= 0.0);
        require(good, "homing.offset_sd", "must hold numbers of 0 or more, rad and m")?;
        robot.homing_offset_sd = homing.offset_sd;
    }
    if let Some(stiction) = file.stiction {
        let good = stiction.presliding.iter().all(|travel| travel.is_finite() && *travel > 0.0);
        require(good, "stiction.presliding", "must hold numbers above 0, rad, rad and m")?;
        robot.presliding = Some(stiction.presliding);
    }
    robot.effects = file.effects.iter().enumerate().map(|(i, table)| effect(i + 1, table)).collect::<Result<_, _>>()?;
    Ok(robot)
}

fn pretension(table: &CableTable) -> Result<Pretension, RobotError> {
    let positive = |values: &[f64; 3]| values.iter().all(|value| value.is_finite() && *value > 0.0);
    require(positive(&table.stiffness_n_m), "cable.stiffness_n_m", "must hold numbers above 0")?;
    require(positive(&table.stiffening_length_m), "cable.stiffening_length_m", "must hold numbers above 0")?;
    let good = table.pretension_n.iter().all(|tension| tension.is_finite() && *tension >= 0.0);
    require(good, "cable.pretension_n", "must hold numbers of 0 or more")?;
    Ok(Pretension {
        stiffness_n_m: table.stiffness_n_m,
        stiffening_length_m: table.stiffening_length_m,
        pretension_n: table.pretension_n,
    })
}

fn require(good: bool, key: &'static str, what: &'static str) -> Result<(), RobotError> {
    if good { Ok(()) } else { Err(RobotError::Value { key, what }) }
}

fn effect(number: usize, table: &EffectTable) -> Result<Effect, RobotError> {
    let values = table.parameters.iter().map(|(name, value)| {
        let value = match value {
            ValueTable::Number(number) => Value::Number(*number),
            ValueTable::Vector(numbers) => Value::Vector(numbers.clone()),
        };
        (name.clone(), value)
    });
    let given = Given {
        joint: table.joint,
        driven_by: table.driven_by,
        link: table.link,
        channel: table.channel.clone(),
        from_s: table.from_s,
        to_s: table.to_s,
    };
    Effect::given(&table.physics, &Parameters(values.collect()), &given).map_err(|what| RobotError::Effect {
        number,
        physics: table.physics.escape_debug().to_string(),
        what,
    })
}

/// Tables are merged key by key, everything else is replaced; unknown keys are refused afterwards by the plant's own parser.
fn merge(into: &mut toml::Table, from: toml::Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

fn syntax(error: &toml::de::Error, text: &str) -> RobotError {
    let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
    RobotError::Syntax { line, what: error.message().replace('\n', ", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Bound;
    use crate::physics::Physics;

    const HEAD: &str = "schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"raven2-nominal\"\n";

    fn refused(rest: &str) -> String {
        let text = Robot::from_toml(&format!("{HEAD}{rest}")).expect_err(rest).to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    }

    #[test]
    fn a_plant_file_is_a_robot_without_effects() {
        assert_eq!(Robot::from_toml(NOMINAL).expect("nominal"), Robot::nominal());
    }

    #[test]
    fn numbers_of_the_plant_can_be_changed_one_by_one() {
        let robot = Robot::from_toml(&format!("{HEAD}[plant.cable]\nke_n = [1e5, 2e5, 3e5]\n")).expect("robot");
        assert_eq!(robot.raven.plant().cable.ke_n, [1e5, 2e5, 3e5]);
        assert_eq!(robot.raven.plant().cable.be_ns_m, Robot::nominal().raven.plant().cable.be_ns_m);
        assert!(refused("[plant.cable]\nke = [1e5, 2e5, 3e5]\n").contains("unknown field `ke`"));
    }

    #[test]
    fn effects_have_their_place_and_their_time() {
        let rest = "[[effect]]\nphysics = \"payload\"\nfrom_s = 5.5\nparameters = { m_p = 0.25, c_z = -0.4 }\n\
                    [[effect]]\nphysics = \"joint_coupling\"\njoint = 2\ndriven_by = 1\nparameters = { c_ij = 0.02 }\n";
        let robot = Robot::from_toml(&format!("{HEAD}{rest}")).expect("robot");
        assert!(matches!(robot.effects[0].physics, Physics::Payload(payload) if payload.mass_kg == 0.25));
        assert_eq!((robot.effects[0].from_s, robot.effects[0].to_s), (5.5, f64::INFINITY));
        assert_eq!(robot.effects[1].bound, Bound::Pair(1, 0));
    }

    #[test]
    fn what_means_nothing_is_refused_with_its_number_and_a_remedy() {
        let effect = |rest: &str| refused(&format!("[[effect]]\n{rest}\n"));
        assert!(effect("physics = \"dust\"").contains("effect 1 (dust): no such physics; the vocabulary has coulomb_friction"));
        assert!(effect("physics = \"backlash\"\njoint = 3").contains("needs the parameter `b` (rad|m)"));
        assert!(effect("physics = \"backlash\"\nparameters = { b = 0.1 }").contains("needs `joint` = 1 to 7"));
        assert!(effect("physics = \"backlash\"\njoint = 8\nparameters = { b = 0.1 }").contains("`joint` is 8"));
        assert!(effect("physics = \"backlash\"\njoint = 1\nparameters = { b = -0.1 }").contains("`b` is -0.1"));
        assert!(
            effect("physics = \"backlash\"\njoint = 1\nparameters = { width = 0.1 }").contains("no parameter `width`; it has b")
        );
        assert!(effect("physics = \"payload\"\njoint = 1\nparameters = { m_p = 0.1 }").contains("takes no `joint`"));
        assert!(effect("physics = \"measurement_delay\"\nchannel = \"ear\"\nparameters = { d = 0.1 }").contains("must be one of"));
        assert!(effect("physics = \"payload\"\nfrom_s = 2.0\nto_s = 1.0\nparameters = { m_p = 0.1 }").contains("before to_s"));
        assert!(refused("[homing]\noffset_sd = [0, 0, -1, 0, 0, 0, 0]\n").contains("homing.offset_sd"));
        assert!(refused("colour = 1\n").contains("line 4: unknown field `colour`"));
    }
}
