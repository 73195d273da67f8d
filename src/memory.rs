//! Where each joint came from: the plays in front of a network that has a memory.
//!
//! Cables hang back by what they last did. A play of half width r keeps just that about one feature x: its position y stays until x
//! leaves [y - r, y + r], so the place x - y tells the direction and the way since the last turn. Where y was before the first state
//! nobody knows, but for y in [x - r, x + r]. The two ends of that interval are followed beside it: once x has moved through 2 r they are
//! one, and y is what it would be whatever came before. Until that is so of each play the memory is not settled.

use crate::guard::Guard;
use ravenpose_wire::{FEATURES, flag};

pub use ravenpose_importer::Play;

/// After so long without a state that could be followed the memory begins anew. A shoulder that turns and comes back within it moves
/// by at most a T^2 / 8 = 0.9 mrad, less than its narrowest half width (1.5 mrad): a = 18 rad/s^2 is what the motor gives without load
/// (`raven2-plant.toml`: 2500/2730 A times 0.0603 N m/A over 2.847e-4/12.25 kg m^2, through 135). Two periods of the slowest controller.
const UNSEEN_NS: i64 = 20_000_000;

#[derive(Clone)]
struct Held {
    input: usize,
    half_width: f32,
    /// Position of the play, y; none before the first number.
    at: Option<f32>,
    /// Where it would be had it begun at either end of what is possible.
    ends: [f32; 2],
}

impl Held {
    fn follow(&mut self, x: f32) {
        let (lower, upper) = (x - self.half_width, x + self.half_width);
        let pushed = |y: f32| {
            if y < lower {
                lower
            } else if y > upper {
                upper
            } else {
                y
            }
        };
        match &mut self.at {
            Some(at) => {
                *at = pushed(*at);
                self.ends = self.ends.map(pushed);
            }
            None if x.is_finite() => {
                self.at = Some(x);
                self.ends = [lower, upper];
            }
            None => {}
        }
    }
}

/// The plays of one arm. Float32 throughout, as the file's own graph computes them.
#[derive(Clone)]
pub struct Memory {
    plays: Box<[Held]>,
    /// Time of the state that was followed last, ns.
    followed_ns: i64,
}

impl Memory {
    /// A memory that has seen nothing. A play on an input beyond the features, which the importer refuses, holds still.
    pub fn new(plays: &[Play]) -> Self {
        let held = |play: &Play| Held { input: play.input, half_width: play.half_width, at: None, ends: [0.0; 2] };
        Self { plays: plays.iter().map(held).collect(), followed_ns: i64::MIN }
    }

    /// Number of plays.
    pub fn len(&self) -> usize {
        self.plays.len()
    }

    /// Is there nothing to remember?
    pub fn is_empty(&self) -> bool {
        self.plays.is_empty()
    }

    /// Takes in one more state's features, of a time that rises. Call it for every state that [`may_follow`] lets through; NaN leaves a
    /// play where it is. After a gap of more than 20 ms it begins anew: the arm may have moved unseen.
    pub fn follow(&mut self, features: &[f32; FEATURES], time_ns: i64) {
        if time_ns.saturating_sub(self.followed_ns) > UNSEEN_NS {
            self.forget();
        }
        self.followed_ns = time_ns;
        for play in &mut self.plays {
            if let Some(&x) = features.get(play.input) {
                play.follow(x);
            }
        }
    }

    /// Writes where `features` stands within each play, x - y in the feature's unit; 0 before the first state. What `out` lacks is left.
    pub fn places(&self, features: &[f32; FEATURES], out: &mut [f32]) {
        for (out, play) in out.iter_mut().zip(&self.plays) {
            let x = features.get(play.input).copied().unwrap_or_default();
            *out = play.at.map_or(0.0, |at| x - at);
        }
    }

    /// Begins anew.
    pub fn forget(&mut self) {
        for play in &mut self.plays {
            play.at = None;
        }
    }

    /// Does every play depend on nothing before the first state any more?
    pub fn is_settled(&self) -> bool {
        self.plays.iter().all(|play| play.at.is_some() && play.ends[0] == play.ends[1])
    }
}

/// Whether a state with these reasons of [`flag`] tells where the joints are: its numbers can be the robot's, and it moves if they do.
pub fn may_follow(reasons: u32) -> bool {
    reasons & (flag::INPUT_NOT_FINITE | flag::INPUT_IMPOSSIBLE | flag::INPUT_FROZEN) == 0
}

/// The same of a recorded state, for which nobody watches the encoders.
pub fn may_follow_recorded(possible: &Guard, features: &[f32; FEATURES]) -> bool {
    may_follow(possible.check(features).reasons)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn memory() -> Memory {
        Memory::new(&[Play { input: 56, half_width: 0.5 }, Play { input: 57, half_width: 2.0 }])
    }

    fn features(first: f32, second: f32) -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        (features[56], features[57]) = (first, second);
        features
    }

    /// One state per millisecond; where the last stands.
    fn follow(memory: &mut Memory, steps: &[(f32, f32)]) -> [f32; 2] {
        let mut places = [f32::NAN; 2];
        for (first, second) in steps {
            let time_ns = memory.followed_ns.max(0) + MS;
            memory.follow(&features(*first, *second), time_ns);
            memory.places(&features(*first, *second), &mut places);
        }
        places
    }

    #[test]
    fn a_play_tells_from_which_side_a_joint_came() {
        let mut memory = memory();
        assert_eq!(follow(&mut memory, &[(3.0, 10.0)]), [0.0, 0.0]);
        assert!(!memory.is_settled());
        assert_eq!(follow(&mut memory, &[(5.0, 15.0)]), [0.5, 2.0]);
        assert!(memory.is_settled());
        assert_eq!(follow(&mut memory, &[(4.75, 14.0)]), [0.25, 1.0]);
        assert_eq!(follow(&mut memory, &[(4.0, 10.0)]), [-0.5, -2.0]);
    }

    /// The heart of it: settled means that where the play was before the first state makes no difference, wherever that was.
    #[test]
    fn once_settled_it_does_not_matter_where_it_began() {
        let mut seed = 9_u64;
        let mut share = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f32 / (1 << 24) as f32
        };
        let mut settled = 0;
        for _ in 0..300 {
            let ways: Vec<(f32, f32, f32)> = (0..3).map(|_| (2.0 * share(), 0.02 + 0.05 * share(), 6.3 * share())).collect();
            let x = |k: usize| ways.iter().map(|(size, speed, phase)| size * (k as f32 * speed + phase).sin()).sum::<f32>();
            let start = 2.0 * share() - 1.0;
            let mut memory = Memory::new(&[Play { input: 56, half_width: 1.0 }]);
            let mut other = x(0) + start;
            for k in 0..200 {
                memory.follow(&features(x(k), 0.0), k as i64 * MS);
                other = other.max(x(k) - 1.0).min(x(k) + 1.0);
                if memory.is_settled() {
                    settled += 1;
                    assert_eq!(memory.plays[0].at, Some(other), "begun {start} off, step {k}");
                }
            }
        }
        assert!(settled > 10_000, "{settled}");
    }

    #[test]
    fn it_is_settled_when_each_joint_has_moved_through_its_play_and_not_before() {
        let mut memory = memory();
        let _ = follow(&mut memory, &[(0.0, 0.0), (3.0, 3.9)]);
        assert!(!memory.is_settled(), "the second has moved by less than twice its half width");
        let _ = follow(&mut memory, &[(3.0, 4.1)]);
        assert!(memory.is_settled());
        memory.forget();
        assert!(!memory.is_settled());
        assert_eq!(follow(&mut memory, &[(8.0, -4.0)]), [0.0, 0.0]);
    }

    #[test]
    fn a_gap_of_more_than_20_ms_begins_it_anew() {
        for (gap_ms, kept) in [(20, true), (21, false)] {
            let mut memory = memory();
            let before = follow(&mut memory, &[(0.0, 0.0), (3.0, 5.0)]);
            memory.follow(&features(3.0, 5.0), memory.followed_ns + gap_ms * MS);
            let mut places = [f32::NAN; 2];
            memory.places(&features(3.0, 5.0), &mut places);
            assert_eq!((places, memory.is_settled()), if kept { (before, true) } else { ([0.0; 2], false) });
        }
    }

    #[test]
    fn nan_moves_nothing_whether_it_comes_first_or_later() {
        let mut memory = memory();
        memory.follow(&[f32::NAN; FEATURES], 0);
        assert!(!memory.is_settled());
        let before = follow(&mut memory, &[(0.0, 0.0), (3.0, 5.0)]);
        assert_eq!(before, [0.5, 2.0]);
        memory.follow(&[f32::NAN; FEATURES], memory.followed_ns + MS);
        assert_eq!(follow(&mut memory, &[(3.0, 5.0)]), before);
    }
}
