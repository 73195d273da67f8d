//! The frame update algorithm: which circles count, which are suspended and why, and when they come back.
//!
//! A circle is one ball in one camera. It is suspended when it is not found, moves further than the ball can, has less than a quarter
//! of its border in the ball's colour, or contradicts the others. It comes back after five consistent frames (the paper's rule), or at
//! once where enough circles that were never in doubt confirm it. Bounds on motion widen with each lost frame and narrow again.

use crate::outcome::{Suspended, View};
use nalgebra::{Isometry3, Translation3};

/// Consistent frames after which a suspended circle counts again.
pub const RETURN_FRAMES: u32 = 5;
/// Circles beyond doubt that confirm a returning one: ten equations for the six unknowns of a pose.
const CONFIRMING: usize = 5;
/// Circles that confirm one another when none was beyond doubt, as in the first frame and after lost ones.
const FRESH: usize = 8;

/// Bounds on motion between frames, px: least, and most before everything is searched anew.
const NEAR_PX: [f64; 2] = [6.0, 30.0];
/// Bounds after many lost frames, px: of one that is measured they are those of the widest guided search.
const LOST_PX: f64 = 1.4 * NEAR_PX[1];

/// State of a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It counts.
    Effective,
    /// It does not; so many consistent frames since.
    Suspended(Suspended, u32),
}

/// States of all circles of a recording so far, and where the end effector was.
#[derive(Debug, Clone)]
pub struct Ledger {
    /// By ball and camera.
    pub states: [Vec<State>; 3],
    /// Must a returning circle always wait (paper), or do others confirm it?
    pub always_wait: bool,
    last: Vec<(f64, Isometry3<f64>)>,
    near_px: f64,
}

impl Ledger {
    /// At the beginning everything may count.
    pub fn new(cameras: usize, always_wait: bool) -> Self {
        let states = std::array::from_fn(|_| vec![State::Effective; cameras]);
        Self { states, always_wait, last: Vec::new(), near_px: NEAR_PX[1] }
    }

    /// Where the end effector should be now, and to how many pixels; `None` when the bounds have become too wide to say.
    pub fn expected(&self, t_s: f64) -> Option<(Isometry3<f64>, f64)> {
        let (at_s, last) = self.last.last()?;
        if self.near_px > NEAR_PX[1] {
            return None;
        }
        let pose = match self.last.iter().rev().nth(1) {
            Some((before_s, before)) if at_s > before_s => {
                let ahead = ((t_s - at_s) / (at_s - before_s)).clamp(0.0, 3.0);
                let turn = (last.rotation * before.rotation.inverse()).powf(ahead);
                let shift = (last.translation.vector - before.translation.vector) * ahead;
                Isometry3::from_parts(Translation3::from(last.translation.vector + shift), turn * last.rotation)
            }
            _ => *last,
        };
        Some((pose, self.near_px))
    }

    /// Circles among the effective ones that have to wait, by ball and camera.
    pub fn waiting(&self, views: &[Vec<View>; 3]) -> Vec<(usize, usize)> {
        let mut beyond_doubt = 0;
        let mut returning = Vec::new();
        let mut all = 0;
        for (ball, own) in views.iter().enumerate() {
            for (camera, view) in own.iter().enumerate() {
                if !matches!(view, View::Effective(_)) {
                    continue;
                }
                all += 1;
                match self.states[ball][camera] {
                    State::Effective => beyond_doubt += 1,
                    State::Suspended(_, frames) if frames + 1 >= RETURN_FRAMES => beyond_doubt += 1,
                    State::Suspended(..) => returning.push((ball, camera)),
                }
            }
        }
        let confirmed = !self.always_wait && (beyond_doubt >= CONFIRMING || all >= FRESH);
        if confirmed { Vec::new() } else { returning }
    }

    /// Takes a measured frame into account; waiting circles are marked in `views` as returning.
    pub fn measured(&mut self, t_s: f64, pose: &Isometry3<f64>, views: &[Vec<View>; 3]) {
        for (ball, own) in views.iter().enumerate() {
            for (camera, view) in own.iter().enumerate() {
                let state = &mut self.states[ball][camera];
                *state = match (view, *state) {
                    (View::Effective(_), _) => State::Effective,
                    (View::Suspended(Suspended::Returning), State::Suspended(reason, frames)) => {
                        State::Suspended(reason, frames + 1)
                    }
                    (View::Suspended(reason), _) => State::Suspended(*reason, 0),
                };
            }
        }
        self.last.push((t_s, *pose));
        if self.last.len() > 2 {
            self.last.remove(0);
        }
        self.near_px = (0.7 * self.near_px).max(NEAR_PX[0]);
    }

    /// Takes a lost frame into account: what was consistent before has to be so again, but for the circles without which it would not have
    /// been lost, by ball and camera; and bounds widen.
    pub fn lost(&mut self, waiting: &[(usize, usize)]) {
        for (ball, states) in self.states.iter_mut().enumerate() {
            for (camera, state) in states.iter_mut().enumerate() {
                if let State::Suspended(_, frames) = state {
                    *frames = if waiting.contains(&(ball, camera)) { *frames + 1 } else { 0 };
                }
            }
        }
        // Once everything is searched anew, wider bounds say no more; the first frame that is found brings them back.
        self.near_px = (1.6 * self.near_px).min(LOST_PX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_however_many_lost_frames_the_first_that_is_measured_guides_the_next() {
        for lost in [4, 30, 2000] {
            let (mut ledger, nothing) = (Ledger::new(0, false), [vec![], vec![], vec![]]);
            ledger.measured(0.0, &Isometry3::identity(), &nothing);
            (0..lost).for_each(|_| ledger.lost(&[]));
            assert!(ledger.expected(60.0).is_none(), "{lost}: everything is searched anew");
            ledger.measured(60.0, &Isometry3::identity(), &nothing);
            let (_, within_px) = ledger.expected(60.03).expect("bounds");
            assert!(within_px <= NEAR_PX[1], "{lost}: {within_px}");
        }
    }

    #[test]
    fn circles_without_which_frames_are_lost_come_back_like_others() {
        let mut ledger = Ledger::new(2, false);
        ledger.states = std::array::from_fn(|_| vec![State::Suspended(Suspended::NoImage, 0); 2]);
        let all: Vec<(usize, usize)> = (0..3).flat_map(|ball| [(ball, 0), (ball, 1)]).collect();
        (1..RETURN_FRAMES).for_each(|_| ledger.lost(&all));
        assert!(
            ledger.states.iter().flatten().all(|state| matches!(state, State::Suspended(_, frames) if frames + 1 == RETURN_FRAMES))
        );
        // What is missing once begins anew.
        ledger.lost(&all[..5]);
        assert_eq!(ledger.states[2][1], State::Suspended(Suspended::NoImage, 0));
    }
}
