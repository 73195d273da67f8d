//! Arms from URDF in motion: their plant, their controller, their sensors.

mod build;

pub(crate) use build::{bent, build, middle};
