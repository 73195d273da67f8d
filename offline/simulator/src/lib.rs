//! RAVEN-II in software: motors, cables, links, named physics, the controller, and the motion that it is asked for. Fixed
//! step, deterministic, one thread per run.
//!
//! - [`model`]: a robot as a file says it is; [`Robot::nominal`] and [`Robot::worn`] ship.
//! - [`physics`]: the 22 components of the vocabulary, one module each.
//! - [`plant`]: joints 1 to 3 with their cables; time steps.
//! - [`controller`]: the control software of an arm.
//! - [`simulation`]: an arm and its controller, cycle by cycle.
//! - [`trajectory`]: where it is commanded to go.
//! - [`production`]: whole runs as full states with their truth.
//! - [`replay`]: amplifier commands of a recording played into the plant.
//!
//! ```
//! use simulator::{Command, Robot, Simulation};
//! use arm::Side;
//! let home = *arm::Raven2::nominal().arm(Side::Gold).limits.home();
//! let mut robot = Simulation::new(&Robot::nominal(), Side::Gold, 1, &home).expect("a robot");
//! let cycle = robot.tick(&Command::Joints(home));
//! let error = cycle.truth.joints[2] - cycle.reported.joints[2];
//! assert!(error.abs() < 1e-3, "the nominal plant stretches by fractions of a millimetre");
//! ```
#![deny(missing_docs)]
#![forbid(unsafe_code)]
#![allow(clippy::needless_range_loop, reason = "joints index several vectors and matrices at once, as in the equations")]

pub mod any_arm;
pub mod controller;
pub mod model;
pub mod physics;
pub mod plant;
pub mod production;
pub mod replay;
pub mod resimulate;
pub mod simulation;
pub mod trajectory;

mod delay;
mod random;
mod robot_plant;
mod tool_axes;

pub use model::{Effect, Robot, RobotError, RobotModel};
pub use random::Random;
pub use simulation::{Command, CycleOfArm, Simulation, TruthSample};
