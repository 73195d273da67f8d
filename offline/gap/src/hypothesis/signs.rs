//! Signs of the motion of joints, as friction turns round with it. What was made last is kept: most laws of friction are tried with the same.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use crate::motion::Motion;

/// Where friction is.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub joint: usize,
    /// Behind the cable, or before it.
    pub at_link: bool,
    /// The largest speed over which a sign may turn there.
    pub widest: f64,
}

/// How a sign turns round.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Turn {
    /// Over a speed, the shape.
    BySpeed,
    /// Over a presliding travel; shape: that travel, and the time in which the vibration of such bristles settles (LuGre: `z + t zd`).
    ByTravel,
}

/// Which sign it is: joint, side, and what rounds it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sign(usize, bool, Turn, [f64; 2]);

impl Sign {
    /// Of a place, turning so, with the numbers that round it.
    pub(super) fn new(place: Place, turn: Turn, shape: &[f64]) -> Self {
        let rounded = match turn {
            Turn::BySpeed => [shape[0].min(place.widest), 0.0],
            Turn::ByTravel => [shape[0].max(1e-12), shape[1]],
        };
        Self(place.joint, place.at_link, turn, rounded)
    }

    /// At every sample of a motion.
    pub(super) fn of(self, motion: &Motion) -> Vec<f64> {
        let Self(joint, at_link, turn, [over, settling_s]) = self;
        match turn {
            Turn::BySpeed => motion.quick(joint, at_link).iter().map(|v| (v / over).tanh()).collect(),
            Turn::ByTravel => motion.bristle(joint, at_link, over, settling_s),
        }
    }
}

/// The signs that were made last.
pub(super) struct Signs {
    /// Smoothed as everything is, at the grid.
    pub smooth: Recent<Vec<f64>>,
    /// At every sample of each run.
    pub samples: Recent<Vec<Vec<f64>>>,
}

impl Default for Signs {
    fn default() -> Self {
        // The latter are as long as the recording, and of use to what is refined at the moment only.
        Self { smooth: Recent::new(32), samples: Recent::new(2) }
    }
}

/// What was made last, so many of them at most.
pub(super) struct Recent<T> {
    most: usize,
    held: Mutex<VecDeque<(Sign, Arc<T>)>>,
}

impl<T> Recent<T> {
    fn new(most: usize) -> Self {
        Self { most, held: Mutex::new(VecDeque::new()) }
    }

    /// That of a sign, made if it is not there: by whoever asks, so that nobody waits while it is made.
    pub(super) fn get(&self, sign: Sign, make: impl FnOnce() -> T) -> Arc<T> {
        let held = || self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let there = held().iter().find(|(other, _)| *other == sign).map(|(_, value)| value.clone());
        there.unwrap_or_else(|| {
            let made = Arc::new(make());
            let mut held = held();
            // Another thread may have made it meanwhile.
            held.retain(|(other, _)| *other != sign);
            held.truncate(self.most - 1);
            held.push_front((sign, made.clone()));
            made
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_kept_and_the_others_made_again() {
        let recent = Recent::new(2);
        let sign = |speed: f64| Sign(0, false, Turn::BySpeed, [speed, 0.0]);
        let asked = |speed: f64| {
            let mut made = false;
            let value = recent.get(sign(speed), || {
                made = true;
                speed
            });
            assert_eq!(*value, speed);
            made
        };
        assert_eq!(
            [asked(1.0), asked(2.0), asked(1.0), asked(3.0), asked(2.0), asked(1.0)],
            [true, true, false, true, false, true]
        );
    }
}
