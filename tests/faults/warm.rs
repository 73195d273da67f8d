//! What is kept warm while nothing arrives.

use crate::world::{self, BOUND_UM, MS};
use ravenpose::correction::{ArmModel, Estimator};
use ravenpose::cycle::{Cycle, Limits};
use ravenpose_wire::{CorrectedPose, FEATURES};
use std::cell::Cell;
use std::rc::Rc;

/// Counts how often it is kept warm.
struct Counting(Rc<Cell<u32>>);

impl Estimator for Counting {
    fn run(&mut self, _features: &[f32; FEATURES], error: &mut [f32; 3]) {
        *error = [0.0; 3];
    }

    fn keep_warm(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

fn counted(kept: &Rc<Cell<u32>>) -> ArmModel<Counting> {
    world::model_of(Counting(kept.clone()), 1, BOUND_UM, [300.0, 400.0, 500.0])
}

/// Rounds completed in so many calls, after a state of these arms.
fn rounds(models: [ArmModel<Counting>; 2], arms: u32, calls: u32) -> u32 {
    let mut cycle = Cycle::new(Limits::default(), models, false, 0);
    let mut state = world::state(7, 1, 1, MS);
    state.arms = arms;
    cycle.offer(&state, MS);
    assert!(cycle.step(MS, &mut (), &mut CorrectedPose::new()));
    (0..calls).map(|_| u32::from(cycle.keep_warm())).sum()
}

#[test]
fn a_round_is_fifteen_pieces_of_weights_of_each_model_that_answers() {
    let (gold, green) = (Rc::new(Cell::new(0)), Rc::new(Cell::new(0)));
    // A round is complete when the next one begins.
    assert_eq!(rounds([counted(&gold), ArmModel::None], 3, 161), 10, "no call is spent on what is not there");
    assert_eq!(gold.take(), 150);
    assert_eq!(rounds([counted(&gold), counted(&green)], 3, 321), 10);
    assert_eq!((gold.take(), green.take()), (150, 150));
    assert_eq!(rounds([counted(&gold), counted(&green)], 2, 161), 10, "an arm that is not connected has no part in it");
    assert_eq!((gold.take(), green.take()), (0, 150));
    assert_ne!(rounds([ArmModel::None, ArmModel::Rejected], 3, 161), 0, "without a model the way out is kept warm all the same");
}
