//! Any robot, and what all robots have in common.

use std::path::Path;

use arm::serial::{JointKind, SerialArm};
use arm::{RIGID_JOINTS, Side};
use serde::Deserialize;

use super::error::syntax;
use super::{
    ControllerModel, DriveModel, Effect, MappedColumn, ModelError, Robot, RobotError, UrdfRobot, columns, model_error, raven,
    raven_file, urdf_file,
};
use crate::plant::{Passive, Plant, PlantError};
use crate::{any_arm, robot_plant};

const SCHEMA: &str = "ravenpose-robot/1";

/// Where a payload may hang: nothing is there, it is where an identification looks.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadSite {
    /// Link, from 0; one past the last is the tool.
    pub link: usize,
    /// In the frame of that link, m.
    pub position_m: [f64; 3],
    /// What to call it.
    pub name: Option<String>,
}

/// Any robot. Joints and links count from 0 here and from 1 in files.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotModel {
    pub(super) kind: Kind,
    /// The arm of a RAVEN-II.
    pub(super) side: Side,
    /// Where payloads may hang.
    pub payload_sites: Vec<PayloadSite>,
    /// Names of columns in its recordings that are not those of tidy CSV.
    pub columns: Vec<MappedColumn>,
    /// How far it is off what it was learnt from.
    pub model_error: ModelError,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Raven(Box<Robot>),
    Urdf(Box<UrdfRobot>),
}

#[derive(Deserialize)]
struct Header {
    schema: Option<String>,
    base: Option<String>,
}

impl RobotModel {
    /// By name (`raven2-nominal`, `raven2-worn`) or from a robot file, plant file or URDF (`.urdf`, or text that begins as XML).
    ///
    /// # Errors
    /// [`RobotError`]: one line with file, place, what is wrong and what would do.
    pub fn load(path_or_name: &str) -> Result<Self, RobotError> {
        match path_or_name {
            "raven2-nominal" => return Ok(Self::raven(Robot::nominal(), Side::Gold)),
            "raven2-worn" => return Ok(Self::raven(Robot::worn(), Side::Gold)),
            _ => {}
        }
        let path = Path::new(path_or_name);
        let text = std::fs::read_to_string(path).map_err(|error| RobotError::File {
            what: format!("{path_or_name}: cannot be read ({error}); give a robot file, a URDF, raven2-nominal or raven2-worn"),
        })?;
        let is_urdf =
            path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("urdf")) || text.trim_start().starts_with('<');
        let found = if is_urdf { Self::from_urdf(&text) } else { Self::from_toml(&text, path.parent()) };
        found.map_err(|error| RobotError::File { what: format!("{path_or_name}: {error}") })
    }

    /// From the text of a robot file or plant file; `folder` is where a relative path in it starts.
    ///
    /// # Errors
    /// [`RobotError`]: one line with the place and what is wrong.
    pub fn from_toml(text: &str, folder: Option<&Path>) -> Result<Self, RobotError> {
        let header: Header = toml::from_str(text).map_err(|error| syntax(&error, text))?;
        match header.schema.as_deref() {
            Some(SCHEMA) => {}
            Some(arm::plant::SCHEMA) => return Ok(Self::raven(raven_file::plant(text)?, Side::Gold)),
            other => {
                let found = other.unwrap_or("missing").to_owned();
                return Err(RobotError::Kind { key: "schema", found, expected: "`ravenpose-robot/1` or `raven2-plant/1`" });
            }
        }
        let (kind, payload_sites) = match header.base.as_deref() {
            Some("raven2-nominal") => {
                let (robot, sites) = raven_file::robot(text)?;
                (Kind::Raven(Box::new(robot)), sites)
            }
            Some("urdf") => {
                let (robot, sites) = urdf_file::robot(text, folder)?;
                (Kind::Urdf(Box::new(robot)), sites)
            }
            other => {
                let found = other.unwrap_or("missing").to_owned();
                return Err(RobotError::Kind { key: "base", found, expected: "`raven2-nominal` or `urdf`" });
            }
        };
        let model = Self::of(kind);
        let model_error = model_error::read(text, model.joint_count())?;
        Ok(Self { payload_sites, columns: columns::read(text)?, model_error, ..model })
    }

    /// From the text of a URDF: rigid transmissions, no rotors.
    ///
    /// # Errors
    /// [`RobotError`]: one line with the place and what is wrong.
    pub fn from_urdf(text: &str) -> Result<Self, RobotError> {
        Ok(Self::of(Kind::Urdf(Box::new(UrdfRobot::new(text, None, None, "")?))))
    }

    /// One arm of a RAVEN-II.
    pub fn raven(robot: Robot, side: Side) -> Self {
        Self { side, ..Self::of(Kind::Raven(Box::new(robot))) }
    }

    fn of(kind: Kind) -> Self {
        Self { kind, side: Side::Gold, payload_sites: Vec::new(), columns: Vec::new(), model_error: ModelError::default() }
    }

    /// The same robot, its other arm. A robot from a URDF has one arm only.
    #[must_use]
    pub fn with_side(mut self, side: Side) -> Self {
        self.side = side;
        self
    }

    /// The arm of a RAVEN-II that is meant.
    pub fn side(&self) -> Side {
        self.side
    }

    /// The RAVEN-II, if it is one.
    pub fn as_raven(&self) -> Option<&Robot> {
        if let Kind::Raven(robot) = &self.kind { Some(robot) } else { None }
    }

    /// The robot from a URDF, if it is one.
    pub fn as_urdf(&self) -> Option<&UrdfRobot> {
        if let Kind::Urdf(robot) = &self.kind { Some(robot) } else { None }
    }

    /// The RAVEN-II, if it is one.
    pub fn into_raven(self) -> Option<Robot> {
        if let Kind::Raven(robot) = self.kind { Some(*robot) } else { None }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        match &self.kind {
            Kind::Raven(robot) => &robot.name,
            Kind::Urdf(robot) => &robot.name,
        }
    }

    /// Another name.
    pub fn set_name(&mut self, name: &str) {
        match &mut self.kind {
            Kind::Raven(robot) => name.clone_into(&mut robot.name),
            Kind::Urdf(robot) => name.clone_into(&mut robot.name),
        }
    }

    /// Joints that have dynamics: all, of a RAVEN-II the three that position.
    pub fn joint_count(&self) -> usize {
        match &self.kind {
            Kind::Raven(_) => RIGID_JOINTS,
            Kind::Urdf(robot) => robot.joint_count(),
        }
    }

    /// Names of all joints, also of a RAVEN-II's tool.
    pub fn joint_names(&self) -> Vec<String> {
        match &self.kind {
            Kind::Raven(_) => raven::names().joints,
            Kind::Urdf(robot) => robot.names().joints,
        }
    }

    /// Names of the links, the tool in the last place where it has a name of its own.
    pub fn link_names(&self) -> Vec<String> {
        match &self.kind {
            Kind::Raven(_) => raven::names().links,
            Kind::Urdf(robot) => robot.names().links,
        }
    }

    /// How the joints move, all of them.
    pub fn joint_kinds(&self) -> Vec<JointKind> {
        match &self.kind {
            Kind::Raven(_) => {
                let kind = |joint| if joint == 2 { JointKind::Prismatic } else { JointKind::Revolute };
                (0..arm::JOINTS).map(kind).collect()
            }
            Kind::Urdf(robot) => robot.loaded.arm.bodies().iter().map(|body| body.joint.kind).collect(),
        }
    }

    /// Kinematics and inertia as the nominal model has them, without effects.
    pub fn arm(&self) -> SerialArm {
        match &self.kind {
            Kind::Raven(robot) => robot.raven.rigid_body(self.side),
            Kind::Urdf(robot) => robot.arm(),
        }
    }

    /// Drives of the joints that have dynamics, everything of the motor at its shaft.
    pub fn drives(&self) -> Vec<DriveModel> {
        match &self.kind {
            Kind::Raven(robot) => robot.drives(self.side),
            Kind::Urdf(robot) => robot.drives.clone(),
        }
    }

    /// Springs and dampers from the joints to the ground.
    pub fn passive(&self) -> Vec<Passive> {
        match &self.kind {
            Kind::Raven(_) => vec![Passive::NONE; RIGID_JOINTS],
            Kind::Urdf(robot) => robot.passive.clone(),
        }
    }

    /// `C`: what joint `j` adds to the position that motor `i` sees, in joint units, ones on the diagonal.
    pub fn coupling(&self) -> Vec<Vec<f64>> {
        match &self.kind {
            Kind::Raven(robot) => {
                let table = &robot.raven.plant().transmission;
                vec![vec![1.0, 0.0, 0.0], vec![table.coupling_01, 1.0, 0.0], vec![table.coupling_02, table.coupling_12, 1.0]]
            }
            Kind::Urdf(robot) => robot.coupling.clone(),
        }
    }

    /// `A` of `m = A (q - offset)`: motor rad per joint unit, reductions times coupling.
    pub fn motor_from_joint(&self) -> Vec<Vec<f64>> {
        let scale = |(row, drive): (Vec<f64>, DriveModel)| row.into_iter().map(|c| c * drive.reduction).collect();
        self.coupling().into_iter().zip(self.drives()).map(scale).collect()
    }

    /// Gains, where known. Of a RAVEN-II those of the control software, whose own gravity model they leave out: its
    /// closed loop runs with that software, not with these.
    pub fn controller(&self) -> Option<ControllerModel> {
        match &self.kind {
            Kind::Raven(robot) => Some(robot.controller(self.side)),
            Kind::Urdf(robot) => robot.controller.clone(),
        }
    }

    /// Named physics on top.
    pub fn effects(&self) -> &[Effect] {
        match &self.kind {
            Kind::Raven(robot) => &robot.effects,
            Kind::Urdf(robot) => &robot.effects,
        }
    }

    /// Named physics on top, to be added to or taken from.
    pub fn effects_mut(&mut self) -> &mut Vec<Effect> {
        match &mut self.kind {
            Kind::Raven(robot) => &mut robot.effects,
            Kind::Urdf(robot) => &mut robot.effects,
        }
    }

    /// What was assumed in reading it, one line each.
    pub fn notes(&self) -> &[String] {
        match &self.kind {
            Kind::Raven(_) => &[],
            Kind::Urdf(robot) => robot.notes(),
        }
    }

    /// The plant of the joints that have dynamics, with all effects, homed perfectly. For a RAVEN-II torques are those at the
    /// capstan, for others those at the shaft.
    ///
    /// # Errors
    /// [`PlantError`] for effects that cannot be where they are.
    pub fn plant(&self) -> Result<Plant, PlantError> {
        match &self.kind {
            Kind::Raven(robot) => Ok(robot_plant::build(robot, self.side, &[0.0; arm::JOINTS])?.0),
            Kind::Urdf(robot) => any_arm::build(robot, &[0.0; crate::plant::JOINTS_MAX]),
        }
    }
}
