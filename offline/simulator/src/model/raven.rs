//! A RAVEN-II: the nominal plant, numbers that differ from it, named physics on top, and what homing leaves to chance.

use arm::{JOINTS, RIGID_JOINTS, Raven2, Side};

use super::drive_model::{Connection, DriveModel};
use super::effect::Names;
use super::{ControllerModel, ControllerNumbers, Effect, RobotError, RobotModel};
use crate::plant::{Dragged, DriveNumbers};

/// A RAVEN-II robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Nominal plant with the numbers that differ.
    pub raven: Raven2,
    /// Those numbers, as `[plant]` of a robot file has them.
    pub(super) changes: toml::Table,
    /// A cable law other than the plant's, joints 1 to 3.
    pub cables: Option<Pretension>,
    /// Joint friction of joints 1 to 3 that holds at rest, with the travel over which it turns, rad, rad, m; none: the smoothed
    /// sign of the plant file, which creeps.
    pub presliding: Option<[f64; 3]>,
    /// Tool cables that motor 3 drags along; none: they follow it freely.
    pub tool_cables: Option<Dragged>,
    /// Standard deviation of the offset that each homing leaves, rad and m.
    pub homing_offset_sd: [f64; JOINTS],
    /// Named physics on top.
    pub effects: Vec<Effect>,
}

/// Pretensioned cables, joints 1 to 3; see [`crate::plant::CableLaw::Pretensioned`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pretension {
    /// Stiffness of one side at no tension, N/m.
    pub stiffness_n_m: [f64; 3],
    /// Stretch over which it stiffens by e, m.
    pub stiffening_length_m: [f64; 3],
    /// Tension of either side at rest, N.
    pub pretension_n: [f64; 3],
}

/// Joints in the order of contracts.md, as robot files may name them.
const JOINT_NAMES: [&str; JOINTS] = ["shoulder", "elbow", "insertion", "tool_roll", "wrist", "grasp_1", "grasp_2"];
/// Links of the kinematic chain.
const LINKS: usize = 6;

pub(super) fn names() -> Names {
    Names { joints: JOINT_NAMES.map(str::to_owned).to_vec(), links: (1..=LINKS).map(|link| format!("link{link}")).collect() }
}

impl Robot {
    /// The nominal robot.
    pub fn nominal() -> Self {
        Self::of(Raven2::nominal().clone())
    }

    /// A robot that is worn as the paper's was: `models/raven2-worn.toml`.
    ///
    /// # Panics
    /// If the file that was embedded at build time is not a robot; a test reads it.
    pub fn worn() -> Self {
        match Self::from_toml(include_str!("../../../../models/raven2-worn.toml")) {
            Ok(robot) => robot,
            Err(error) => panic!("models/raven2-worn.toml, embedded at build time, is not a robot: {error}"),
        }
    }

    pub(super) fn of(raven: Raven2) -> Self {
        Self {
            name: raven.plant().name.clone(),
            raven,
            changes: toml::Table::new(),
            cables: None,
            presliding: None,
            tool_cables: None,
            homing_offset_sd: [0.0; JOINTS],
            effects: Vec::new(),
        }
    }

    /// A RAVEN-II from the text of a plant file or a robot file.
    ///
    /// # Errors
    /// [`RobotError`]: one line with the place and what is wrong.
    pub fn from_toml(text: &str) -> Result<Self, RobotError> {
        let found = RobotModel::from_toml(text, None)?;
        found.into_raven().ok_or_else(|| RobotError::Kind {
            key: "base",
            found: "urdf".to_owned(),
            expected: "`raven2-nominal`: only a RAVEN-II will do here",
        })
    }

    /// Drives of joints 1 to 3 as [`DriveModel`]s: everything at the motor's shaft.
    pub(super) fn drives(&self, side: Side) -> Vec<DriveModel> {
        (0..RIGID_JOINTS).map(|joint| self.drive(joint, &crate::robot_plant::base_drive(self, side, joint))).collect()
    }

    fn drive(&self, joint: usize, numbers: &DriveNumbers) -> DriveModel {
        let (plant, gear) = (self.raven.plant(), numbers.gear);
        let cable = numbers.cable.at(0.0);
        let area = numbers.radius_m * numbers.radius_m;
        DriveModel {
            connection: Connection::Cable,
            reduction: numbers.ratio,
            offset: 0.0,
            rotor_inertia_kg_m2: numbers.inertia / gear,
            torque_constant_nm_a: Some(plant.motor.torque_constant_nm_a[joint]),
            counts_per_a: Some(f64::from(plant.motor.dac_per_amp[joint])),
            counts_max: Some(f64::from(plant.motor.dac_limit[joint])),
            sign: numbers.torque_per_count_nm.signum(),
            torque_max_nm: None,
            encoder_counts_per_rev: Some(f64::from(plant.sampling.encoder_counts_per_rev)),
            motor_coulomb_nm: numbers.motor.coulomb / gear,
            motor_viscous_nm_s: numbers.motor.viscous / gear,
            motor_sign_width_rad_s: numbers.motor.width,
            joint_coulomb: numbers.joint.coulomb,
            joint_viscous: numbers.joint.viscous,
            joint_sign_width: numbers.joint.width,
            presliding: self.presliding.map(|presliding| presliding[joint]),
            stiffness: area * cable.stiffness_n_m,
            damping: area * cable.damping_ns_m,
            radius_m: numbers.radius_m,
            home: numbers.home,
            torque_ref_nm: numbers.torque_ref_nm / gear,
        }
    }

    /// Gains at the shaft.
    pub(super) fn controller(&self, side: Side) -> ControllerModel {
        let plant = self.raven.plant();
        let (control, gear) = (&plant.control, plant.transmission.gear_big);
        let kd = if side == Side::Gold { &control.kd_gold } else { &control.kd_green };
        let joints = (0..RIGID_JOINTS).map(|i| ControllerNumbers {
            kp: control.kp[i] / gear,
            ki: control.ki[i] / gear,
            kd: kd[i] / gear,
            velocity_share: 0.0,
            gravity_share: f64::from(u8::from(control.gravity_feedforward)),
        });
        let delay_cycles = plant.sampling.measurement_delay_cycles;
        ControllerModel { period_s: plant.sampling.period_s, delay_cycles, joints: joints.collect() }
    }
}
