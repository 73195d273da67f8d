//! Memory of the recent motion: where each reported joint stands within plays of several widths.
//!
//! What a cable hangs back by depends on where the joint came from. A play operator of half width r keeps just that: it follows
//! its input only where the input leaves [y - r, y + r], so x - y tells direction and distance since the last turn.

use ravenpose_wire::FEATURES;

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
/// Numbers that a memory adds to the inputs.
pub const MEMORY: usize = PER_JOINT * PLAYS.len();

/// All plays of one arm, fed with every state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    held: Option<[f64; MEMORY]>,
}

/// Feature and half width of each play, in the unit of the feature.
fn plays() -> impl Iterator<Item = (usize, f64)> {
    PLAYS.iter().flat_map(|(slot, widths)| widths.iter().map(move |width| (JPOS + slot, width.to_degrees())))
}

impl Memory {
    /// The plays follow one more state; its 118 features.
    pub fn follow(&mut self, features: &[f32; FEATURES]) {
        let mut all = plays().map(|(feature, _)| f64::from(features[feature]));
        let held = self.held.get_or_insert_with(|| std::array::from_fn(|_| all.next().unwrap_or_default()));
        for (held, (feature, width)) in held.iter_mut().zip(plays()) {
            let x = f64::from(features[feature]);
            // Not clamp, which panics on NaN.
            *held = held.max(x - width).min(x + width);
        }
    }

    /// Where the newest state stands within each play, x - y, in the unit of the features.
    pub fn places(&self, features: &[f32; FEATURES]) -> [f32; MEMORY] {
        let mut out = [0.0; MEMORY];
        if let Some(held) = &self.held {
            for ((out, held), (feature, _)) in out.iter_mut().zip(held).zip(plays()) {
                *out = (f64::from(features[feature]) - held) as f32;
            }
        }
        out
    }
}

/// Names of the numbers that a memory adds.
pub fn names() -> Vec<String> {
    PLAYS.iter().flat_map(|(slot, widths)| widths.iter().map(move |width| format!("play(jpos[{slot}], {width})"))).collect()
}

/// Feature and half width of each play in the feature's unit: `ravenpose.memory` of a card, for whoever runs the model.
pub fn property() -> String {
    plays().map(|(feature, width)| format!("{feature}:{width}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(joint_1_deg: f32) -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        features[JPOS] = joint_1_deg;
        features
    }

    #[test]
    fn a_play_tells_from_which_side_a_joint_came() {
        let width = plays().next().expect("play").1 as f32;
        for (way, place) in [([1.0, 5.0, 4.7], -width), ([5.0, 1.0, 1.3], width)] {
            let mut memory = Memory::default();
            for step in way {
                memory.follow(&at(step));
            }
            // 0.3 degrees back is more than twice 0.086 degrees, so it has crossed to the other flank.
            let found = memory.places(&at(way[2]))[0];
            assert!((found - place).abs() < 1e-6, "{found} {place}");
        }
        let mut memory = Memory::default();
        memory.follow(&at(3.0));
        assert_eq!(memory.places(&at(3.0)), [0.0; MEMORY]);
    }
}
