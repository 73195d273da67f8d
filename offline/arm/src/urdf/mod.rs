//! Arms from URDF text, and back: one serial chain with its transmissions.
//!
//! [`load`] reads links, joints and `<transmission>`s, merges fixed joints into the moving links, and gives a
//! [`SerialArm`]. Its base frame is the link at which the moving chain starts, so that a fixed mount between the root and
//! that link sets the direction of gravity and nothing else. What a serial arm cannot represent is refused by name and
//! line; what is merely doubtful is loaded and listed in [`UrdfArm::notes`].
//!
//! The reader is strict on purpose: a number that does not parse, an attribute that is missing where no default exists, or
//! a link that is named twice is an error with its line. It stands on `roxmltree`. `urdf-rs` 0.10 was tried and left: it
//! drops words that are no numbers (`xyz="0 0 1.o 2"` reads as 0 0 2), ends the process by stack overflow on 200 000 nested
//! elements, gives no lines, has no transmissions, and an absent `<inertial>` or `<limit>` looks like zeros. The independent
//! second reader is Pinocchio's, in a test.

mod chain;
mod document;
mod element;
mod error;
mod text;
mod transmission;

use nalgebra::{IsometryMatrix3, Vector3};

use crate::serial::SerialArm;

pub use error::UrdfError;
pub use text::save;

/// Standard gravity as the plant has it, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// What the text does not say.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Gravity in the root link, m/s²: along -z unless told otherwise.
    pub gravity_in_root_m_s2: Vector3<f64>,
    /// The link at the end of the chain. Needed where the arm branches; joints beside the chain then stand at 0 for ever.
    pub tip: Option<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self { gravity_in_root_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2), tip: None }
    }
}

/// What stands between a joint and its motor, and the joint's `<dynamics>`.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Name of the transmission, if there is one.
    pub transmission: Option<String>,
    /// Name of the actuator, if there is one.
    pub actuator: Option<String>,
    /// Motor position per joint position: rad per rad, prismatic rad per m. Torque at the motor times this is the joint's.
    pub reduction: f64,
    /// Joint position where the motor stands at 0: `joint = motor / reduction + offset`.
    pub offset: f64,
    /// Viscous friction of `<dynamics damping>`, N·m·s/rad or N·s/m.
    pub damping: f64,
    /// Coulomb friction of `<dynamics friction>`, N·m or N.
    pub friction: f64,
}

/// An arm with what else its URDF says.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfArm {
    /// Kinematics and inertia. Its tools are the frames fixed to the last link, the tip first.
    pub arm: SerialArm,
    /// One per joint.
    pub drives: Vec<Drive>,
    /// The root link.
    pub root: String,
    /// Pose of the arm's base frame in the root link.
    pub base_in_root: IsometryMatrix3<f64>,
    /// What was assumed, one line each.
    pub notes: Vec<String>,
}

/// Reads an arm from the text of a URDF file, gravity along -z of the root link.
///
/// # Errors
/// [`UrdfError`] with the line, the element and the remedy.
pub fn load(text: &str) -> Result<UrdfArm, UrdfError> {
    load_with(text, &Options::default())
}

/// Reads an arm from the text of a URDF file.
///
/// # Errors
/// [`UrdfError`] with the line, the element and the remedy.
pub fn load_with(text: &str, options: &Options) -> Result<UrdfArm, UrdfError> {
    let robot = document::read(text)?;
    chain::arm(&robot, options)
}
