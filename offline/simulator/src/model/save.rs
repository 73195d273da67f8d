//! Robots as text: what [`RobotModel::from_toml`] reads as the same robot again.

use std::fmt::Write as _;
use std::path::Path;

use super::controller_model::GAINS;
use super::effect::{Bound, Effect};
use super::fields::FIELDS;
use super::robot_model::Kind;
use super::urdf_robot::STEP_S;
use super::{Connection, ControllerModel, Robot, RobotError, RobotModel, UrdfRobot};
use crate::physics::{Channel, Value};
use crate::plant::Passive;

impl RobotModel {
    /// The robot as a file that stands for itself: a URDF is in it.
    pub fn to_toml(&self) -> String {
        text(self)
    }

    /// Writes [`Self::to_toml`] to a file, whole or not at all.
    ///
    /// # Errors
    /// [`RobotError::File`].
    pub fn save(&self, path: &Path) -> Result<(), RobotError> {
        let failed = |error: std::io::Error| RobotError::File { what: format!("{}: cannot be written: {error}", path.display()) };
        outputs::write(path, self.to_toml().as_bytes()).map_err(failed)
    }
}

fn text(model: &RobotModel) -> String {
    let mut out = String::from("schema = \"ravenpose-robot/1\"\n");
    let _ = writeln!(out, "name = {}", quoted(model.name()));
    match &model.kind {
        Kind::Raven(robot) => raven(&mut out, robot),
        Kind::Urdf(robot) => urdf(&mut out, robot),
    }
    let (joints, links) = (model.joint_names(), model.link_names());
    for site in &model.payload_sites {
        let _ = writeln!(out, "\n[[payload_site]]\nlink = {}", quoted(&links[site.link]));
        let _ = writeln!(out, "position_m = {}", array(&site.position_m));
        if let Some(name) = &site.name {
            let _ = writeln!(out, "name = {}", quoted(name));
        }
    }
    if !model.columns.is_empty() {
        out.push_str("\n[columns]\n");
        for column in &model.columns {
            let _ = if (column.scale - 1.0).abs() < f64::EPSILON {
                writeln!(out, "{} = {}", key(&column.name), quoted(&column.source))
            } else {
                writeln!(out, "{} = {{ column = {}, scale = {:?} }}", key(&column.name), quoted(&column.source), column.scale)
            };
        }
    }
    for (k, (key, list)) in model.model_error.known().enumerate() {
        out.push_str(if k == 0 { "\n[model_error]\n" } else { "" });
        let _ = writeln!(out, "{key} = {}", array(list));
    }
    for effect in model.effects() {
        push_effect(&mut out, effect, &joints, &links);
    }
    out
}

fn raven(out: &mut String, robot: &Robot) {
    out.push_str("base = \"raven2-nominal\"\n");
    if !robot.changes.is_empty() {
        let plant = toml::Table::from_iter([("plant".to_owned(), toml::Value::Table(robot.changes.clone()))]);
        let _ = write!(out, "\n{plant}");
    }
    if let Some(cables) = &robot.cables {
        let _ = writeln!(out, "\n[cable]\nstiffness_n_m = {}", array(&cables.stiffness_n_m));
        let _ = writeln!(out, "stiffening_length_m = {}", array(&cables.stiffening_length_m));
        let _ = writeln!(out, "pretension_n = {}", array(&cables.pretension_n));
    }
    homing(out, &robot.homing_offset_sd);
    if let Some(presliding) = &robot.presliding {
        let _ = writeln!(out, "\n[stiction]\npresliding = {}", array(presliding));
    }
    if let Some(dragged) = &robot.tool_cables {
        let _ =
            writeln!(out, "\n[tool_cables]\nstiffness_nm_rad = {:?}\nlevel_nm = {:?}", dragged.stiffness_nm_rad, dragged.level_nm);
        let _ = writeln!(out, "v_s_rad_s = {:?}\nmemory_s = {:?}", dragged.v_s_rad_s, dragged.memory_s);
    }
}

fn urdf(out: &mut String, robot: &UrdfRobot) {
    out.push_str("base = \"urdf\"\n");
    if let Some(tip) = &robot.tip {
        let _ = writeln!(out, "tip = {}", quoted(tip));
    }
    let _ = writeln!(out, "gravity_m_s2 = {}", array(&robot.gravity_m_s2));
    let _ = writeln!(out, "urdf_xml = {}", long(&robot.urdf));
    let bodies = robot.loaded.arm.bodies();
    for (joint, body) in bodies.iter().enumerate() {
        drive(out, robot, joint, &key(&body.joint.name));
    }
    for (passive, body) in robot.passive.iter().zip(bodies).filter(|(passive, _)| **passive != Passive::NONE) {
        let _ = writeln!(out, "\n[passive.{}]", key(&body.joint.name));
        for (name, value) in [("stiffness", passive.stiffness), ("damping", passive.damping), ("rest", passive.rest)] {
            let _ = writeln!(out, "{name} = {value:?}");
        }
    }
    let straight = robot.coupling.iter().enumerate().all(|(i, row)| row.iter().enumerate().all(|(j, c)| i == j || *c == 0.0));
    if !straight {
        let rows: Vec<String> = robot.coupling.iter().map(|row| array(row)).collect();
        let _ = writeln!(out, "\n[coupling]\nmatrix = [{}]", rows.join(", "));
    }
    if let Some(model) = &robot.controller {
        controller(out, model);
    }
    for (inertia, body) in robot.inertias.iter().zip(bodies) {
        let Some(inertia) = inertia else { continue };
        let rows: Vec<String> =
            inertia.inertia_com_kg_m2.row_iter().map(|row| array(&row.iter().copied().collect::<Vec<_>>())).collect();
        let _ = writeln!(out, "\n[inertial.{}]\nmass_kg = {:?}", key(&body.name), inertia.mass_kg);
        let _ = writeln!(out, "com_m = {}\ninertia_com_kg_m2 = [{}]", array(inertia.com_m.as_slice()), rows.join(", "));
    }
    homing(out, &robot.homing_offset_sd);
    if robot.step_s != STEP_S {
        let _ = writeln!(out, "\n[integrator]\nstep_s = {:?}", robot.step_s);
    }
}

/// What differs from the URDF's own.
fn drive(out: &mut String, robot: &UrdfRobot, joint: usize, name: &str) {
    let (given, bare) = (&robot.drives[joint], robot.drive_of_urdf(joint));
    if *given == bare {
        return;
    }
    let _ = writeln!(out, "\n[drive.{name}]");
    if given.connection != Connection::Rigid {
        let _ = writeln!(out, "connection = \"{}\"", given.connection.name());
    }
    for field in FIELDS {
        match (field.get)(given) {
            Some(value) if (field.get)(&bare) != Some(value) => {
                let _ = writeln!(out, "{} = {value:?}", field.name);
            }
            _ => {}
        }
    }
}

fn controller(out: &mut String, model: &ControllerModel) {
    let _ = writeln!(out, "\n[controller]\nperiod_s = {:?}\ndelay_cycles = {}", model.period_s, model.delay_cycles);
    for (name, get, _) in GAINS {
        let _ = writeln!(out, "{name} = {}", array(&model.joints.iter().map(get).collect::<Vec<_>>()));
    }
}

fn homing(out: &mut String, offset_sd: &[f64]) {
    if offset_sd.iter().any(|sd| *sd != 0.0) {
        let _ = writeln!(out, "\n[homing]\noffset_sd = {}", array(offset_sd));
    }
}

fn push_effect(out: &mut String, effect: &Effect, joints: &[String], links: &[String]) {
    let _ = writeln!(out, "\n[[effect]]\nphysics = \"{}\"", effect.physics.name());
    match effect.bound {
        Bound::Joint(joint) => drop(writeln!(out, "joint = {}", quoted(&joints[joint]))),
        Bound::Motor(joint) => drop(writeln!(out, "motor = {}", quoted(&joints[joint]))),
        Bound::Pair(driven, driver) => {
            let _ = writeln!(out, "joint = {}\ndriven_by = {}", quoted(&joints[driven]), quoted(&joints[driver]));
        }
        Bound::Link(link) => drop(writeln!(out, "link = {}", quoted(&links[link]))),
        Bound::Channel(channel) => {
            let name = Channel::NAMES.iter().find(|(_, known)| *known == channel).map_or("", |(name, _)| name);
            let _ = writeln!(out, "channel = \"{name}\"");
        }
        Bound::Robot => {}
    }
    for (name, time_s) in [("from_s", effect.from_s), ("to_s", effect.to_s)] {
        if time_s.is_finite() {
            let _ = writeln!(out, "{name} = {time_s:?}");
        }
    }
    let value = |value: &Value| match value {
        Value::Number(number) => format!("{number:?}"),
        Value::Vector(numbers) => array(numbers),
    };
    let parameters: Vec<String> =
        effect.physics.parameters().0.iter().map(|(name, found)| format!("{name} = {}", value(found))).collect();
    let _ = writeln!(out, "parameters = {{ {} }}", parameters.join(", "));
    if let Some(source) = &effect.source {
        let _ = writeln!(out, "source = {}", quoted(source));
    }
}

fn array(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", "))
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A name as a key: bare where TOML allows it.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-');
    if bare { name.to_owned() } else { quoted_key(name) }
}

/// Always with escapes: a key has one line.
fn quoted_key(name: &str) -> String {
    let mut out = String::from('"');
    for c in name.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => drop(write!(out, "\\u{:04X}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Lines as they are, where TOML allows it.
fn long(text: &str) -> String {
    let plain = !text.contains("'''") && !text.ends_with('\'') && text.chars().all(|c| !c.is_control() || c == '\n' || c == '\t');
    if plain { format!("'''\n{text}'''") } else { quoted(text) }
}
