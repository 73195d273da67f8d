//! The robot as the engine sees it: a serial arm, its drives and its transmission, nothing about any recording.

use arm::serial::SerialArm;
use nalgebra::DMatrix;

/// What one drive is believed to be, on the joint's side of the gearbox.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveNominal {
    /// Rotor inertia at the joint, kg·m² (prismatic: kg); NaN where it is not known.
    pub rotor_inertia: f64,
    /// Coulomb friction, N·m or N.
    pub coulomb: f64,
    /// Viscous friction, N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Series stiffness between motor and joint, N·m/rad or N/m; infinite for a rigid one.
    pub stiffness: f64,
}

impl Default for DriveNominal {
    fn default() -> Self {
        Self { rotor_inertia: f64::NAN, coulomb: 0.0, viscous: 0.0, stiffness: f64::INFINITY }
    }
}

/// A place where a weight may hang.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadSite {
    /// Index of the link.
    pub link: usize,
    /// In the link's frame, m.
    pub position_m: [f64; 3],
}

/// An arm with its drives.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Kinematics and inertia.
    pub arm: SerialArm,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Does the joint slide?
    pub prismatic: Vec<bool>,
    /// Motor positions from joint positions, N×N: `m = A q` (gap-design.md, section 2).
    pub motor_from_joint: DMatrix<f64>,
    /// One per joint.
    pub drives: Vec<DriveNominal>,
    /// Candidate places of a payload beside the last link.
    pub payload_sites: Vec<PayloadSite>,
}

impl Robot {
    /// A robot from its URDF.
    ///
    /// # Errors
    /// What the URDF reader says.
    pub fn from_urdf(text: &str) -> Result<Self, arm::urdf::UrdfError> {
        let loaded = arm::urdf::load(text)?;
        let n = loaded.arm.joint_count();
        let drives = loaded
            .drives
            .iter()
            .map(|drive| DriveNominal { coulomb: drive.friction, viscous: drive.damping, ..DriveNominal::default() })
            .collect();
        let motor_from_joint = DMatrix::from_fn(n, n, |i, j| if i == j { loaded.drives[i].reduction } else { 0.0 });
        Ok(Self {
            name: loaded.arm.name().to_owned(),
            joints: loaded.arm.bodies().iter().map(|body| body.joint.name.clone()).collect(),
            prismatic: loaded.arm.bodies().iter().map(|body| body.joint.kind.is_prismatic()).collect(),
            arm: loaded.arm,
            motor_from_joint,
            drives,
            payload_sites: Vec::new(),
        })
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Unit of a joint's position.
    pub fn position_unit(&self, joint: usize) -> &'static str {
        if self.prismatic[joint] { "m" } else { "rad" }
    }

    /// Unit of a joint's effort.
    pub fn effort_unit(&self, joint: usize) -> &'static str {
        if self.prismatic[joint] { "N" } else { "N.m" }
    }
}
