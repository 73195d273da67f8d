//! Arms: RAVEN-II as its control software knows it, and any serial arm as a rigid-body model.
//!
//! - RAVEN-II: forward kinematics, [`inverse`] kinematics, cable transmission, encoders, amplifiers, gravity feed-forward, and
//!   the units in which `raven_state` publishes all of it. Equations: `raven2-plant.md` (sections named at each function) and
//!   `ravenstate.md`; every constant comes from the embedded `models/raven2-plant.toml`, none is typed here.
//! - [`serial`]: kinematics and dynamics of any serial arm without allocation; [`urdf`] reads and writes such arms;
//!   [`Raven2::rigid_body`] is RAVEN-II as one.
//!
//! Pure mathematics in SI units (rad, m, s, N·m): no files, no clock, no state. Published units (µm, degrees, joint 3 in
//! m × 57.29578) appear in [`published`] only.
//!
//! ```
//! use arm::{Raven2, Side};
//! let gold = Raven2::nominal().arm(Side::Gold);
//! let motors = gold.transmission.motors(gold.limits.home());
//! let joints = gold.transmission.joints(&motors);
//! let tip_m = gold.kinematics.tip(&joints).translation.vector;
//! assert!((tip_m.x + 0.077947).abs() < 1e-6);
//! ```
//!
//! ```
//! use arm::serial::Workspace;
//! use arm::{Raven2, Side};
//! let arm = Raven2::nominal().rigid_body(Side::Gold);
//! let mut ws = Workspace::new(&arm);
//! let (mut m, mut bias) = ([0.0; 9], [0.0; 3]);
//! arm.mass_matrix_and_bias(&mut ws, &[0.5, 1.5, 0.4], &[0.1, 0.0, 0.0], &mut m, &mut bias);
//! assert!((m[8] - 0.407).abs() < 1e-12);
//! ```
#![deny(missing_docs)]
#![forbid(unsafe_code)]

pub mod actuation;
pub mod gravity;
pub mod inverse;
pub mod kinematics;
pub mod limits;
pub mod plant;
pub mod published;
pub mod sensing;
pub mod serial;
pub mod transmission;
pub mod urdf;

mod model;
mod rigid_body;
mod side;

pub use model::{Arm, Raven2};
pub use rigid_body::RIGID_JOINTS;
pub use side::{Side, Tool};

/// Joints of an arm, and motors: 1 shoulder, 2 elbow, 3 insertion, 4 tool roll, 5 wrist, 6 grasp 1, 7 grasp 2.
pub const JOINTS: usize = 7;

/// One number per joint, in joint order: positions in rad, joint 3 in m; speeds in rad/s, joint 3 in m/s.
pub type Joints = [f64; JOINTS];

/// One number per motor, in joint order: angles in rad of the motor shaft before the gearbox, speeds in rad/s, torques in
/// N·m after the gearbox, at the capstan.
pub type Motors = [f64; JOINTS];
