//! Arms from URDF in motion: their plant, their sensors, their controller, where they are sent.

mod build;
mod commands;
mod sensors;
mod servo;
mod simulation;

pub(crate) use build::{bent, build, middle};
pub use commands::{ranges, speeds, trajectory};
pub(crate) use sensors::{Seen, Sensors, is_timed};
pub(crate) use servo::Servo;
pub use servo::default_gains;
pub use simulation::{ArmCycle, ArmSimulation};
