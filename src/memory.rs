//! Where each joint came from: the plays in front of a network that has a memory.
//!
//! Cables hang back by what they last did. A play of half width r keeps just that about one feature x: its position y stays until x
//! leaves [y - r, y + r], so the place x - y tells the direction and the way since the last turn. Once x has pushed y along, y depends
//! on nothing before: a state that was missed costs nothing then, and a play that began at the wrong place is right from there on.
//! Until that has happened to each of them the memory is not settled.

pub use ravenpose_importer::Play;
use ravenpose_wire::FEATURES;

struct Held {
    input: usize,
    half_width: f32,
    /// Position of the play, y.
    at: f32,
    /// Pushed along since it began.
    pushed: bool,
}

/// The plays of one arm. Float32 throughout, as the file's own graph computes them.
pub struct Memory {
    plays: Box<[Held]>,
    /// Plays that were not pushed along yet.
    unsettled: usize,
    begun: bool,
}

impl Memory {
    /// A memory that has seen nothing. Plays on inputs beyond the features are an error of the importer and hold still.
    pub fn new(plays: &[Play]) -> Self {
        let held = |play: &Play| Held { input: play.input, half_width: play.half_width, at: 0.0, pushed: false };
        Self { plays: plays.iter().map(held).collect(), unsettled: plays.len(), begun: false }
    }

    /// Number of plays.
    pub fn len(&self) -> usize {
        self.plays.len()
    }

    /// Is there nothing to remember?
    pub fn is_empty(&self) -> bool {
        self.plays.is_empty()
    }

    /// Takes in one more state's features. Call it for every state, in order; NaN leaves a play where it is.
    pub fn follow(&mut self, features: &[f32; FEATURES]) {
        for play in &mut self.plays {
            let Some(&x) = features.get(play.input) else { continue };
            if !self.begun {
                play.at = x;
            }
            let (lower, upper) = (x - play.half_width, x + play.half_width);
            if play.at < lower || play.at > upper {
                self.unsettled -= usize::from(!play.pushed);
                play.pushed = true;
                play.at = if play.at < lower { lower } else { upper };
            }
        }
        self.begun = true;
    }

    /// Writes where `features` stands within each play, x - y in the feature's unit; 0 before the first state. What `out` lacks is left.
    pub fn places(&self, features: &[f32; FEATURES], out: &mut [f32]) {
        for (out, play) in out.iter_mut().zip(&self.plays) {
            let x = features.get(play.input).copied().unwrap_or_default();
            *out = if self.begun { x - play.at } else { 0.0 };
        }
    }

    /// Begins anew: the arm may have moved unseen.
    pub fn forget(&mut self) {
        for play in &mut self.plays {
            play.pushed = false;
        }
        self.unsettled = self.plays.len();
        self.begun = false;
    }

    /// Does every play depend on nothing before the first state any more?
    pub fn is_settled(&self) -> bool {
        self.unsettled == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Memory {
        Memory::new(&[Play { input: 56, half_width: 0.5 }, Play { input: 57, half_width: 2.0 }])
    }

    fn follow(memory: &mut Memory, steps: &[(f32, f32)]) -> [f32; 2] {
        let (mut features, mut places) = ([0.0; FEATURES], [f32::NAN; 2]);
        for (first, second) in steps {
            (features[56], features[57]) = (*first, *second);
            memory.follow(&features);
        }
        memory.places(&features, &mut places);
        places
    }

    #[test]
    fn a_play_tells_from_which_side_a_joint_came() {
        let mut memory = memory();
        assert_eq!(follow(&mut memory, &[(3.0, 10.0)]), [0.0, 0.0]);
        assert!(!memory.is_settled());
        assert_eq!(follow(&mut memory, &[(5.0, 13.0)]), [0.5, 2.0]);
        assert!(memory.is_settled());
        assert_eq!(follow(&mut memory, &[(4.75, 12.0)]), [0.25, 1.0]);
        assert_eq!(follow(&mut memory, &[(4.0, 8.0)]), [-0.5, -2.0]);
    }

    #[test]
    fn once_pushed_along_it_does_not_matter_what_was_missed() {
        let way: Vec<(f32, f32)> = (0..4000).map(|k| 0.01 * k as f32).map(|t| (5.0 * t.sin(), 9.0 * (0.7 * t).cos())).collect();
        let (mut whole, mut late) = (memory(), memory());
        let _ = follow(&mut whole, &way[..2000]);
        let _ = follow(&mut late, &way[1000..1003]);
        // It sees every seventh state only, and began in between.
        for k in 2000..4000 {
            let expected = follow(&mut whole, &way[k..=k]);
            let found = if k % 7 == 0 { follow(&mut late, &way[k..=k]) } else { expected };
            if late.is_settled() && k > 2500 {
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() < 0.08, "{k}: {found} {expected}");
                }
            }
        }
        assert!(late.is_settled());
    }

    #[test]
    fn it_is_settled_when_the_widest_play_was_pushed_and_not_before() {
        let mut memory = memory();
        let _ = follow(&mut memory, &[(0.0, 0.0), (3.0, 1.5)]);
        assert!(!memory.is_settled(), "the second has moved by less than its half width");
        let _ = follow(&mut memory, &[(3.0, 2.5)]);
        assert!(memory.is_settled());
        memory.forget();
        assert!(!memory.is_settled());
        assert_eq!(follow(&mut memory, &[(8.0, -4.0)]), [0.0, 0.0]);
    }

    #[test]
    fn nan_moves_nothing() {
        let mut memory = memory();
        let before = follow(&mut memory, &[(0.0, 0.0), (3.0, 5.0)]);
        memory.follow(&[f32::NAN; FEATURES]);
        assert_eq!(follow(&mut memory, &[(3.0, 5.0)]), before);
    }
}
