//! The effects of motors, sensors, surroundings, and those outside the library.

use crate::draft::{Draft, Growth, Scene};
use crate::effect::Effect;
use crate::random::Random;

/// The rest of the physics; see `draft::draw`.
pub fn rest(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let _ = (physics, j, scene, random, Growth::Times(0.0), Effect::default());
    None
}
