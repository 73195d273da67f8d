//! Robot files with `base = "urdf"`, read strictly.

use std::collections::BTreeMap;
use std::path::Path;

use arm::serial::LinkInertia;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::controller_model::{ControllerModel, ControllerNumbers, GAINS};
use super::drive_model::Connection;
use super::effect::{Which, index};
use super::error::{line_of, syntax};
use super::fields::FIELDS;
use super::tables::{EffectTable, SiteTable, effects, not_negative, positive, sites, value};
use super::urdf_robot::UrdfRobot;
use super::{PayloadSite, RobotError};
use crate::plant::Passive;

/// A table per joint or link.
type Named<T> = BTreeMap<Spanned<String>, T>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UrdfFile {
    #[serde(rename = "schema")]
    _schema: String,
    name: String,
    #[serde(rename = "base")]
    _base: String,
    urdf: Option<Spanned<String>>,
    urdf_xml: Option<Spanned<String>>,
    tip: Option<String>,
    gravity_m_s2: Option<[f64; 3]>,
    #[serde(default)]
    drive: Named<BTreeMap<Spanned<String>, Entry>>,
    #[serde(default)]
    passive: Named<PassiveTable>,
    coupling: Option<Spanned<CouplingTable>>,
    controller: Option<Spanned<ControllerTable>>,
    #[serde(default)]
    inertial: Named<InertialTable>,
    homing: Option<Spanned<HomingTable>>,
    integrator: Option<Spanned<IntegratorTable>>,
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
#[serde(untagged)]
enum Entry {
    Number(f64),
    Word(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PassiveTable {
    #[serde(default)]
    stiffness: f64,
    #[serde(default)]
    damping: f64,
    #[serde(default)]
    rest: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingTable {
    matrix: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControllerTable {
    period_s: Option<f64>,
    delay_cycles: Option<u32>,
    kp: Vec<f64>,
    ki: Option<Vec<f64>>,
    kd: Option<Vec<f64>>,
    velocity_share: Option<Vec<f64>>,
    gravity_share: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InertialTable {
    mass_kg: f64,
    com_m: [f64; 3],
    inertia_com_kg_m2: [[f64; 3]; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HomingTable {
    offset_sd: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct IntegratorTable {
    step_s: f64,
}

/// `folder` is where a relative `urdf` starts from.
pub(super) fn robot(text: &str, folder: Option<&Path>) -> Result<(UrdfRobot, Vec<PayloadSite>), RobotError> {
    let file: UrdfFile = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    let mut robot = source(&file, text, folder)?;
    robot.name.clone_from(&file.name);
    let reader = Reader { text, joints: robot.names().joints, links: robot.names().links };
    for (key, table) in &file.drive {
        let joint = reader.joint("drive", key)?;
        reader.drive(&mut robot, joint, key, table)?;
    }
    for (key, table) in &file.passive {
        let joint = reader.joint("passive", key)?;
        let good = not_negative(&[table.stiffness, table.damping]) && table.rest.is_finite();
        reader.require(good, key, "passive", "needs a stiffness and damping of 0 or more and a finite rest")?;
        robot.passive[joint] = Passive { stiffness: table.stiffness, damping: table.damping, rest: table.rest };
    }
    for (key, table) in &file.inertial {
        let link = reader.link(key)?;
        robot.inertias[link] = Some(reader.inertia(key, table)?);
    }
    reader.rest(&file, &mut robot)?;
    robot.effects = effects(&file.effects, &robot.names(), text)?;
    let sites = sites(&file.sites, &robot.names(), text)?;
    Ok((robot, sites))
}

fn source(file: &UrdfFile, text: &str, folder: Option<&Path>) -> Result<UrdfRobot, RobotError> {
    let make = |xml: &str, place: &str| UrdfRobot::new(xml, file.tip.as_deref(), file.gravity_m_s2, place);
    if file.gravity_m_s2.is_some_and(|gravity| !gravity.iter().all(|value| value.is_finite())) {
        return Err(value(1, "gravity_m_s2", "must hold finite numbers, m/s2 in the root link"));
    }
    match (&file.urdf, &file.urdf_xml) {
        (None, Some(xml)) => make(xml.get_ref(), &format!("line {}: urdf_xml: ", line_of(text, xml.span().start))),
        (Some(path), None) => {
            let line = line_of(text, path.span().start);
            let Some(folder) = folder else {
                return Err(value(line, "urdf", "is a path, and this text has no folder; put the URDF into urdf_xml"));
            };
            let path = folder.join(path.get_ref());
            let xml = std::fs::read_to_string(&path).map_err(|error| {
                value(line, "urdf", format!("{}: cannot be read ({error}); the path starts at the robot file", path.display()))
            })?;
            make(&xml, &format!("{}: ", path.display()))
        }
        _ => Err(value(1, "urdf", "or urdf_xml must be given with base = \"urdf\", and not both")),
    }
}

struct Reader<'a> {
    text: &'a str,
    joints: Vec<String>,
    links: Vec<String>,
}

impl Reader<'_> {
    fn refuse(&self, byte: usize, key: impl Into<String>, what: impl Into<String>) -> RobotError {
        value(line_of(self.text, byte), key, what)
    }

    fn require(&self, good: bool, key: &Spanned<String>, table: &str, what: &str) -> Result<(), RobotError> {
        if good { Ok(()) } else { Err(self.refuse(key.span().start, format!("{table}.{}", key.get_ref()), what)) }
    }

    /// The joint that a table is named after, by name or by number from 1.
    fn joint(&self, table: &str, key: &Spanned<String>) -> Result<usize, RobotError> {
        self.place(table, "joint", key, &self.joints)
    }

    fn link(&self, key: &Spanned<String>) -> Result<usize, RobotError> {
        self.place("inertial", "link", key, &self.links[..self.joints.len()])
    }

    fn place(&self, table: &str, what: &str, key: &Spanned<String>, names: &[String]) -> Result<usize, RobotError> {
        let name = key.get_ref();
        let which = match name.parse() {
            Ok(number) if !names.contains(name) => Which::Number(number),
            _ => Which::Name(name.clone()),
        };
        index(what, Some(&which), names).map_err(|what| self.refuse(key.span().start, format!("{table}.{name}:"), what))
    }

    fn drive(
        &self,
        robot: &mut UrdfRobot,
        joint: usize,
        table: &Spanned<String>,
        entries: &BTreeMap<Spanned<String>, Entry>,
    ) -> Result<(), RobotError> {
        let drive = &mut robot.drives[joint];
        let (reduction, mut referenced) = (drive.reduction.abs(), false);
        let mut connection = None;
        for (key, entry) in entries {
            let name = key.get_ref().as_str();
            let refuse = |what: String| self.refuse(key.span().start, format!("drive.{}.{name}", table.get_ref()), what);
            if name == "connection" {
                let words = Connection::NAMES.map(|(word, _)| word).join(", ");
                let found = match entry {
                    Entry::Word(word) => Connection::NAMES.iter().find(|(known, _)| known == word),
                    Entry::Number(_) => None,
                };
                connection = Some(found.ok_or_else(|| refuse(format!("must be one of the words {words}")))?.1);
                continue;
            }
            referenced |= name == "torque_ref_nm";
            let Some(field) = FIELDS.iter().find(|field| field.name == name) else {
                let known: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
                return Err(refuse(format!("is not known; a drive has connection, {}", known.join(", "))));
            };
            match entry {
                Entry::Number(number) if field.range.has(*number) => (field.set)(drive, *number),
                _ => return Err(refuse(format!("must be {}", field.range.words()))),
            }
        }
        let elastic = if drive.stiffness > 0.0 { Connection::Cable } else { Connection::Rigid };
        drive.connection = connection.unwrap_or(elastic);
        if drive.connection == Connection::Force {
            drive.reduction = 1.0;
        }
        if !referenced {
            // At the shaft; what is known of it is at the joint.
            drive.torque_ref_nm *= reduction / drive.reduction.abs();
        }
        let refuse = |what: &str| Err(self.refuse(table.span().start, format!("drive.{}", table.get_ref()), what));
        if drive.connection == Connection::Cable && !(drive.stiffness > 0.0 && drive.rotor_inertia_kg_m2 > 0.0) {
            return refuse("is a cable: needs a stiffness and a rotor_inertia_kg_m2 above 0");
        }
        if drive.connection != Connection::Cable && drive.stiffness > 0.0 {
            return refuse("has a stiffness but no cable; leave it out, or write connection = \"cable\"");
        }
        Ok(())
    }

    fn inertia(&self, key: &Spanned<String>, table: &InertialTable) -> Result<LinkInertia, RobotError> {
        let [x, y, z] = table.inertia_com_kg_m2;
        let inertia = Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]);
        let finite = table.com_m.iter().chain(inertia.iter()).all(|number| number.is_finite());
        self.require(finite && not_negative(&[table.mass_kg]), key, "inertial", "needs finite numbers and a mass of 0 or more")?;
        self.require(inertia == inertia.transpose(), key, "inertial", "needs a symmetric inertia_com_kg_m2")?;
        Ok(LinkInertia { mass_kg: table.mass_kg, com_m: Vector3::from(table.com_m), inertia_com_kg_m2: inertia })
    }

    fn rest(&self, file: &UrdfFile, robot: &mut UrdfRobot) -> Result<(), RobotError> {
        let n = self.joints.len();
        if let Some(coupling) = &file.coupling {
            let matrix = &coupling.get_ref().matrix;
            let good = matrix.len() == n
                && matrix.iter().enumerate().all(|(i, row)| row.len() == n && row[i] == 1.0 && row.iter().all(|c| c.is_finite()));
            if !good {
                let what = format!("must have {n} rows of {n} numbers, in joint units, with ones on the diagonal");
                return Err(self.refuse(coupling.span().start, "coupling.matrix", what));
            }
            robot.coupling.clone_from(matrix);
        }
        if let Some(homing) = &file.homing {
            let sd = &homing.get_ref().offset_sd;
            if sd.len() != n || !not_negative(sd) {
                let what = format!("must hold {n} numbers of 0 or more, rad or m");
                return Err(self.refuse(homing.span().start, "homing.offset_sd", what));
            }
            robot.homing_offset_sd.clone_from(sd);
        }
        if let Some(integrator) = &file.integrator {
            let step_s = integrator.get_ref().step_s;
            if !positive(&[step_s]) || step_s > 0.01 {
                return Err(self.refuse(integrator.span().start, "integrator.step_s", "must be above 0 and 0.01 at most"));
            }
            robot.step_s = step_s;
        }
        if let Some(controller) = &file.controller {
            robot.controller = Some(self.controller(controller)?);
        }
        Ok(())
    }

    fn controller(&self, given: &Spanned<ControllerTable>) -> Result<ControllerModel, RobotError> {
        let (n, table) = (self.joints.len(), given.get_ref());
        let refuse = |key: &str, what: String| self.refuse(given.span().start, format!("controller.{key}"), what);
        let mut joints = vec![ControllerNumbers::default(); n];
        let arrays =
            [Some(&table.kp), table.ki.as_ref(), table.kd.as_ref(), table.velocity_share.as_ref(), table.gravity_share.as_ref()];
        for (array, (name, _, set)) in arrays.into_iter().zip(GAINS) {
            let Some(array) = array else { continue };
            if array.len() != n || !array.iter().all(|gain| gain.is_finite()) {
                return Err(refuse(name, format!("must hold {n} finite numbers")));
            }
            joints.iter_mut().zip(array).for_each(|(gains, value)| set(gains, *value));
        }
        let period_s = table.period_s.unwrap_or(1e-3);
        if !positive(&[period_s]) || period_s > 0.1 {
            return Err(refuse("period_s", "must be above 0 and 0.1 at most".to_owned()));
        }
        let delay_cycles = table.delay_cycles.unwrap_or(0);
        if delay_cycles > 100 {
            return Err(refuse("delay_cycles", "must be 100 at most".to_owned()));
        }
        Ok(ControllerModel { period_s, delay_cycles, joints })
    }
}
