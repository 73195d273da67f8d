//! One drive of a robot as its file has it: numbers by name, everything of the motor at the motor's shaft.

use arm::serial::{Body, JointKind};
use arm::urdf;

use crate::plant::{Between, CableLaw, DriveNumbers, Passive, Rubbing};

/// What stands between a motor and its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Connection {
    /// Nothing that gives way. An effect of a cable (stretch, backlash, hysteresis, creep) on such a joint makes a stiff cable of it.
    #[default]
    Rigid,
    /// A cable of a stiffness: motor and joint move apart.
    Cable,
    /// There is no motor: a force, or a torque, acts on the joint itself. Effects of a cable act on the spring to the ground.
    Force,
}

impl Connection {
    /// Words of robot files.
    pub const NAMES: [(&'static str, Self); 3] = [("rigid", Self::Rigid), ("cable", Self::Cable), ("force", Self::Force)];

    /// Its word.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, connection)| *connection == self).map_or("", |(name, _)| name)
    }
}

/// One drive. Joint units are rad, N·m for turning and m, N for sliding joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveModel {
    /// What stands between motor and joint.
    pub connection: Connection,
    /// Motor rad per joint unit; 1 where a force acts on the joint itself.
    pub reduction: f64,
    /// Joint position where the motor stands at 0.
    pub offset: f64,
    /// kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Torque at the shaft per current, N·m/A, where known.
    pub torque_constant_nm_a: Option<f64>,
    /// Command counts per ampere, where known.
    pub counts_per_a: Option<f64>,
    /// Largest command, counts.
    pub counts_max: Option<f64>,
    /// Sign of the torque for a positive command.
    pub sign: f64,
    /// Largest torque at the shaft, N·m (a force on the joint itself: N or N·m).
    pub torque_max_nm: Option<f64>,
    /// Steps of the motor's encoder per turn; none: the controller sees the angle and the speed as they are.
    pub encoder_counts_per_rev: Option<f64>,
    /// Coulomb friction of the motor, N·m at the shaft.
    pub motor_coulomb_nm: f64,
    /// Viscous friction of the motor, N·m per rad/s.
    pub motor_viscous_nm_s: f64,
    /// Speed over which the sign of the motor's friction is smoothed, rad/s.
    pub motor_sign_width_rad_s: f64,
    /// Coulomb friction of the joint, N·m or N.
    pub joint_coulomb: f64,
    /// Viscous friction of the joint, per rad/s or m/s.
    pub joint_viscous: f64,
    /// Speed over which the sign of the joint's friction is smoothed, rad/s or m/s.
    pub joint_sign_width: f64,
    /// Travel over which the joint's friction turns if it holds at rest, rad or m; none: the smoothed sign, which creeps.
    pub presliding: Option<f64>,
    /// Stiffness of the cable, N·m/rad or N/m at the joint.
    pub stiffness: f64,
    /// Damping of the cable, N·m·s/rad or N·s/m.
    pub damping: f64,
    /// Cable stretch per deflection, m per rad (sliding joints: 1): only for a stretch that stiffens.
    pub radius_m: f64,
    /// Position at which a wrong transmission ratio has no effect, rad or m.
    pub home: f64,
    /// Torque at the shaft under which the motor warms up by one unit of heating, N·m.
    pub torque_ref_nm: f64,
}

/// Smoothing of the sign of friction where a file says nothing: that of RAVEN-II's plant (raven2-plant.md, section 7).
const SIGN_WIDTH: (f64, f64, f64) = (1.0, 0.01, 0.002);

impl DriveModel {
    /// What a URDF says of a joint: a rigid transmission with its reduction, the joint's friction, no rotor inertia.
    pub(super) fn of_urdf(drive: &urdf::Drive, body: &Body) -> Self {
        let prismatic = body.joint.kind == JointKind::Prismatic;
        let effort = body.joint.limits.effort;
        // A tenth of the largest effort warms a motor (assumed), of an unknown one 1 N·m or N.
        let warming = if effort.is_finite() { 0.1 * effort } else { 1.0 };
        Self {
            connection: Connection::Rigid,
            reduction: drive.reduction,
            offset: drive.offset,
            rotor_inertia_kg_m2: 0.0,
            torque_constant_nm_a: None,
            counts_per_a: None,
            counts_max: None,
            sign: 1.0,
            torque_max_nm: None,
            encoder_counts_per_rev: None,
            motor_coulomb_nm: 0.0,
            motor_viscous_nm_s: 0.0,
            motor_sign_width_rad_s: SIGN_WIDTH.0,
            joint_coulomb: drive.friction,
            joint_viscous: drive.damping,
            joint_sign_width: if prismatic { SIGN_WIDTH.2 } else { SIGN_WIDTH.1 },
            presliding: None,
            stiffness: 0.0,
            damping: 0.0,
            radius_m: 1.0,
            home: 0.0,
            torque_ref_nm: warming / drive.reduction.abs(),
        }
    }

    /// Torque at the shaft of one command count, N·m; 0 where unknown.
    pub fn torque_per_count_nm(&self) -> f64 {
        match (self.torque_constant_nm_a, self.counts_per_a) {
            (Some(constant), Some(counts)) => self.sign * constant / counts,
            _ => 0.0,
        }
    }

    /// As the plant has it, the shaft for a capstan.
    pub fn numbers(&self, passive: Passive) -> DriveNumbers {
        let ratio = if self.connection == Connection::Force { 1.0 } else { self.reduction };
        let area = self.radius_m * self.radius_m;
        let (between, stiffness, damping) = match self.connection {
            Connection::Cable => (Between::Cable, self.stiffness, self.damping),
            Connection::Rigid => (Between::Rigid, 0.0, 0.0),
            Connection::Force => (Between::Rigid, passive.stiffness, passive.damping),
        };
        let passive = if self.connection == Connection::Force { Passive { rest: passive.rest, ..Passive::NONE } } else { passive };
        DriveNumbers {
            ratio,
            gear: 1.0,
            inertia: self.rotor_inertia_kg_m2,
            radius_m: self.radius_m,
            cable: CableLaw::Linear { k_n_m: stiffness / area, d_ns_m: damping / area },
            motor: Rubbing { coulomb: self.motor_coulomb_nm, viscous: self.motor_viscous_nm_s, width: self.motor_sign_width_rad_s },
            joint: Rubbing { coulomb: self.joint_coulomb, viscous: self.joint_viscous, width: self.joint_sign_width },
            home: self.home,
            torque_ref_nm: self.torque_ref_nm,
            torque_per_count_nm: self.torque_per_count_nm(),
            between,
            passive,
        }
    }
}
