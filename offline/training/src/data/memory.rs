//! Which plays a model of a RAVEN-II has in front of its network; how they work is the service's own (`ravenpose::memory`).

use ravenpose::memory::Play;
use std::ops::Range;

/// First feature of `jpos`.
const JPOS: usize = 56;
/// Plays per joint.
const PER_JOINT: usize = 3;
/// Slots of joints 1 to 7, and half widths of the plays, rad (joint 3: m): half the backlash that is plausible, and four and
/// twenty times that; published as degrees in every slot, joint 3 included.
const PLAYS: [(usize, [f64; PER_JOINT]); 7] = [
    (0, [1.5e-3, 6e-3, 30e-3]),
    (1, [2e-3, 8e-3, 40e-3]),
    (2, [4.5e-4, 2e-3, 10e-3]),
    (4, [0.02, 0.08, 0.3]),
    (5, [0.05, 0.1, 0.3]),
    (6, [0.04, 0.1, 0.3]),
    (7, [0.04, 0.1, 0.3]),
];

/// Ages of a memory, s, for which its worth is told apart while it has not settled.
pub const AGES_S: [Range<f64>; 4] = [0.0..1.0, 1.0..2.0, 2.0..4.0, 4.0..8.0];

/// All plays, in the unit of the features.
pub fn plays() -> Vec<Play> {
    let of = |(slot, widths): &(usize, [f64; PER_JOINT])| {
        let input = JPOS + slot;
        widths.map(|width| Play { input, half_width: width.to_degrees() as f32 })
    };
    PLAYS.iter().flat_map(of).collect()
}

/// Names of the numbers that plays add to the inputs.
pub fn names(plays: &[Play]) -> Vec<String> {
    let name = |play: &Play| format!("play({}, {})", ravenpose_wire::features::name(play.input), play.half_width);
    plays.iter().map(name).collect()
}
