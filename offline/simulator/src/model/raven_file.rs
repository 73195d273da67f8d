//! Robot files of a RAVEN-II, read strictly.

use arm::plant::PlantError;
use arm::{JOINTS, Raven2};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{line_of, syntax};
use super::tables::{EffectTable, SiteTable, effects, not_negative, positive, sites, value};
use super::{PayloadSite, Pretension, Robot, RobotError, raven};
use crate::plant::Dragged;

/// Shortest memory that steps of a fraction of a millisecond can follow, s.
const MEMORY_LEAST_S: f64 = 1e-3;

const NOMINAL: &str = include_str!("../../../../models/raven2-plant.toml");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    #[serde(rename = "schema")]
    _schema: String,
    name: String,
    #[serde(rename = "base")]
    _base: String,
    #[serde(default)]
    plant: toml::Table,
    cable: Option<Spanned<CableTable>>,
    homing: Option<Spanned<HomingTable>>,
    stiction: Option<Spanned<StictionTable>>,
    tool_cables: Option<Spanned<ToolCablesTable>>,
    #[serde(default, rename = "columns")]
    _columns: toml::Table,
    #[serde(default, rename = "model_error")]
    _model_error: toml::Table,
    #[serde(default, rename = "payload_site")]
    sites: Vec<Spanned<SiteTable>>,
    #[serde(default, rename = "effect")]
    effects: Vec<Spanned<EffectTable>>,
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
struct ToolCablesTable {
    stiffness_nm_rad: f64,
    level_nm: f64,
    v_s_rad_s: f64,
    memory_s: f64,
}

/// A plant file: the nominal robot with the numbers that differ.
pub(super) fn plant(text: &str) -> Result<Robot, RobotError> {
    let name = Raven2::from_toml(text)?.plant().name.clone();
    let given: toml::Table = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    let changes = difference(&nominal_table()?, given);
    Ok(Robot { name, ..changed(changes)? })
}

pub(super) fn robot(text: &str) -> Result<(Robot, Vec<PayloadSite>), RobotError> {
    let file: RobotFile = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    known_keys(text)?;
    let mut robot = changed(file.plant)?;
    robot.name = file.name;
    robot.cables = file.cable.as_ref().map(|table| pretension(table, text)).transpose()?;
    if let Some(homing) = file.homing {
        require(
            not_negative(&homing.get_ref().offset_sd),
            &homing,
            text,
            "homing.offset_sd",
            "must hold numbers of 0 or more, rad and m",
        )?;
        robot.homing_offset_sd = homing.get_ref().offset_sd;
    }
    if let Some(stiction) = file.stiction {
        let presliding = stiction.get_ref().presliding;
        require(positive(&presliding), &stiction, text, "stiction.presliding", "must hold numbers above 0, rad, rad and m")?;
        robot.presliding = Some(presliding);
    }
    if let Some(table) = file.tool_cables {
        let ToolCablesTable { stiffness_nm_rad, level_nm, v_s_rad_s, memory_s } = *table.get_ref();
        let numbers = [stiffness_nm_rad, level_nm, v_s_rad_s, memory_s];
        require(
            positive(&numbers),
            &table,
            text,
            "tool_cables",
            "must hold numbers above 0, N m/rad, N m, rad/s and s at motor 3",
        )?;
        require(
            memory_s >= MEMORY_LEAST_S,
            &table,
            text,
            "tool_cables.memory_s",
            "must be 0.001 or more, s: steps are no shorter",
        )?;
        robot.tool_cables = Some(Dragged { stiffness_nm_rad, level_nm, v_s_rad_s, memory_s });
    }
    let names = raven::names();
    robot.effects = effects(&file.effects, &names, text)?;
    Ok((robot, sites(&file.sites, &names, text)?))
}

/// The nominal robot with other numbers in its plant file.
pub(super) fn changed(changes: toml::Table) -> Result<Robot, RobotError> {
    let mut plant = nominal_table()?;
    merge(&mut plant, changes.clone());
    let raven = Raven2::from_toml(&plant.to_string())?;
    is_simulated(raven.plant())?;
    Ok(Robot { changes, ..Robot::of(raven) })
}

/// Refuses what the simulator would quietly take for something else.
fn is_simulated(plant: &arm::plant::Plant) -> Result<(), PlantError> {
    let (sampling, method) = (&plant.sampling, plant.integrator.method.as_str());
    let filters = ["none", sampling.alternative_filter.kind.as_str()];
    for (good, key, what) in [
        (sampling.period_s == 1e-3, "sampling.period_s", "must be 0.001: the simulated controller has no other"),
        (
            sampling.measurement_delay_cycles == 1,
            "sampling.measurement_delay_cycles",
            "must be 1: the simulated controller has no other",
        ),
        (
            filters.contains(&sampling.velocity_filter.as_str()),
            "sampling.velocity_filter",
            "must be \"none\" or alternative_filter.kind",
        ),
        (["rk4", "ros2"].contains(&method), "integrator.method", "must be \"rk4\" or \"ros2\""),
    ] {
        if !good {
            return Err(PlantError::Value { key: key.to_owned(), what });
        }
    }
    Ok(())
}

/// Refuses keys of `[plant]` that the plant file does not have, in the line in which they stand.
fn known_keys(text: &str) -> Result<(), RobotError> {
    let spans = DeTable::parse(text).map_err(|error| syntax(&error, text))?;
    let Some(DeValue::Table(plant)) = spans.get_ref().get("plant").map(Spanned::get_ref) else { return Ok(()) };
    known_keys_in(plant, &nominal_table()?, "plant", text)
}

fn known_keys_in(given: &DeTable<'_>, known: &toml::Table, path: &str, text: &str) -> Result<(), RobotError> {
    for (key, entry) in given {
        let name = key.get_ref();
        match (known.get(name.as_ref()), entry.get_ref()) {
            (None, _) => {
                let known = known.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
                let what = format!("unknown field `{}`, there is {known}", name.escape_debug());
                return Err(value(line_of(text, key.span().start), format!("{path}:"), what));
            }
            (Some(toml::Value::Table(known)), DeValue::Table(given)) => {
                known_keys_in(given, known, &format!("{path}.{name}"), text)?;
            }
            _ => {}
        }
    }
    Ok(())
}

fn nominal_table() -> Result<toml::Table, RobotError> {
    toml::from_str(NOMINAL).map_err(|error| syntax(&error, NOMINAL))
}

fn pretension(table: &Spanned<CableTable>, text: &str) -> Result<Pretension, RobotError> {
    let CableTable { stiffness_n_m, stiffening_length_m, pretension_n } = *table.get_ref();
    require(positive(&stiffness_n_m), table, text, "cable.stiffness_n_m", "must hold numbers above 0")?;
    require(positive(&stiffening_length_m), table, text, "cable.stiffening_length_m", "must hold numbers above 0")?;
    require(not_negative(&pretension_n), table, text, "cable.pretension_n", "must hold numbers of 0 or more")?;
    Ok(Pretension { stiffness_n_m, stiffening_length_m, pretension_n })
}

fn require<T>(good: bool, at: &Spanned<T>, text: &str, key: &str, what: &str) -> Result<(), RobotError> {
    if good { Ok(()) } else { Err(value(line_of(text, at.span().start), key, what)) }
}

/// Tables are merged key by key, everything else is replaced; unknown keys are refused afterwards by the plant's own parser.
pub(super) fn merge(into: &mut toml::Table, from: toml::Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

/// What of `given` differs from `nominal`.
fn difference(nominal: &toml::Table, given: toml::Table) -> toml::Table {
    let mut out = toml::Table::new();
    for (key, value) in given {
        match (nominal.get(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => {
                let inner = difference(old, new);
                if !inner.is_empty() {
                    out.insert(key, toml::Value::Table(inner));
                }
            }
            (Some(old), new) if *old == new => {}
            (_, value) => {
                out.insert(key, value);
            }
        }
    }
    out
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
    fn tool_cables_are_read_written_and_refused_without_a_size() {
        let rest = "[tool_cables]\nstiffness_nm_rad = 0.02\nlevel_nm = 0.06\nv_s_rad_s = 4.0\nmemory_s = 0.05\n";
        let robot = Robot::from_toml(&format!("{HEAD}{rest}")).expect("robot");
        assert_eq!(robot.tool_cables, Some(Dragged { stiffness_nm_rad: 0.02, level_nm: 0.06, v_s_rad_s: 4.0, memory_s: 0.05 }));
        let saved = crate::RobotModel::raven(robot.clone(), arm::Side::Gold).to_toml();
        assert_eq!(Robot::from_toml(&saved).expect("saved"), robot);
        assert!(refused(&rest.replace("0.06", "0.0")).contains("tool_cables"));
        assert!(refused("[tool_cables]\nlevel_nm = 0.06\n").contains("missing field"));
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
        let twice = |effect: &str| refused(&format!("[[effect]]\n{effect}\n[[effect]]\n{effect}\n"));
        for effect in [
            "physics = \"cable_hysteresis\"\njoint = 2\nparameters = { a = 0.5, k = 1000.0, z_m = 0.001 }",
            "physics = \"measurement_delay\"\nchannel = \"motor\"\nparameters = { d = 0.002 }",
        ] {
            assert!(twice(effect).contains("effect 2") && twice(effect).contains("stands there already"), "{}", twice(effect));
        }
    }

    #[test]
    fn what_the_simulator_would_divide_by_or_does_not_have_is_refused() {
        for (table, key, what) in [
            ("integrator]\nsubstep_s = 0.0", "integrator.substep_s", "must be positive"),
            ("integrator]\nmethod = \"euler\"", "integrator.method", "must be \"rk4\" or \"ros2\""),
            ("friction]\njoint_v_s = [0.01, 0.0, 0.002]", "friction.joint_v_s", "must be positive"),
            ("friction]\njoint_viscous = [0.005, -0.002, 0.005]", "friction.joint_viscous", "must be 0 or more"),
            ("cable]\njoint_radius_m = [0.0, 0.1, 1.0]", "cable.joint_radius_m", "must be positive"),
            ("motor]\ninertia_capstan = [0.0, 1e-4, 1e-4]", "motor.inertia_capstan", "must be positive"),
            ("sampling]\nperiod_s = 0.002", "sampling.period_s", "must be 0.001"),
            ("sampling]\nmeasurement_delay_cycles = 2", "sampling.measurement_delay_cycles", "must be 1"),
            ("sampling]\nvelocity_filter = \"kalman\"", "sampling.velocity_filter", "must be \"none\" or"),
        ] {
            let said = refused(&format!("[plant.{table}\n"));
            assert!(said.contains(key) && said.contains(what), "{table}: {said}");
        }
        let memory = "[tool_cables]\nstiffness_nm_rad = 0.02\nlevel_nm = 0.06\nv_s_rad_s = 4.0\nmemory_s = 0.0001\n";
        assert!(refused(memory).contains("tool_cables.memory_s"), "{}", refused(memory));
    }
}
