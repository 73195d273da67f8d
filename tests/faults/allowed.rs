//! F16: another arm, another run level. No correction in a state that the model's card does not allow.

use crate::world::{Fake, MS, cycle, model, state};
use ravenpose::correction::ArmModel;
use ravenpose::cycle::{Cycle, Limits};
use ravenpose::guard::Allowed;
use ravenpose_wire::{ArmStatus, CorrectedPose, RavenState, flag};

/// Both arms connected, the first with board 49, the second with board 22.
fn sample(step: u64, runlevel: i32, boards: [i32; 2]) -> RavenState {
    let mut state = state(7, step, step, (1_000 + step as i64) * MS);
    state.arms = 3;
    state.runlevel = runlevel;
    state.type_ = boards;
    state.seal(step);
    state
}

/// Models of these boards that want the pedal down.
fn models(boards: [i32; 2]) -> Cycle<Fake> {
    let models = boards.map(|board| {
        let ArmModel::Loaded(mut loaded) = model() else { panic!("a model") };
        loaded.allowed = Allowed { runlevels: vec![3], boards: vec![board] };
        ArmModel::Loaded(loaded)
    });
    Cycle::new(Limits::default(), models, false, 0)
}

/// Status and reason of both arms after so many such states.
fn after(cycle: &mut Cycle<Fake>, step: &mut u64, states: u64, runlevel: i32, boards: [i32; 2]) -> [(u32, u32); 2] {
    let mut pose = CorrectedPose::new();
    for _ in 0..states {
        *step += 1;
        let now = (1_000 + *step as i64) * MS;
        cycle.offer(&sample(*step, runlevel, boards), now);
        assert!(cycle.step(now, &mut (), &mut pose));
        cycle.finish(now + 40_000, false, &mut pose);
        for arm in &pose.arm {
            let is_raw = arm.correction_um == [0.0; 3] && arm.corrected_position_um == arm.raw_position_um;
            assert!(is_raw || arm.status == ArmStatus::Valid as u32);
        }
    }
    pose.arm.map(|arm| (arm.status, arm.flags & flag::STATE_NOT_ALLOWED))
}

const VALID: (u32, u32) = (ArmStatus::Valid as u32, 0);
const REFUSED: (u32, u32) = (ArmStatus::Fallback as u32, flag::STATE_NOT_ALLOWED);

#[test]
fn there_is_no_correction_in_a_run_level_that_the_model_does_not_know() {
    let (mut cycle, mut step) = (models([49, 22]), 0);
    assert_eq!(after(&mut cycle, &mut step, 150, 3, [49, 22]), [VALID; 2]);
    for runlevel in [0, 1, 2, -1, 4] {
        assert_eq!(after(&mut cycle, &mut step, 1, runlevel, [49, 22]), [REFUSED; 2]);
        assert_eq!(after(&mut cycle, &mut step, 120, runlevel, [49, 22]), [REFUSED; 2]);
        // Pedal down again: a hundred good states, then the correction.
        assert_eq!(after(&mut cycle, &mut step, 100, 3, [49, 22])[0].0, ArmStatus::Fallback as u32);
        assert_eq!(after(&mut cycle, &mut step, 1, 3, [49, 22]), [VALID; 2]);
    }
}

#[test]
fn a_model_is_not_used_for_another_arm() {
    let (mut cycle, mut step) = (models([49, 22]), 0);
    assert_eq!(after(&mut cycle, &mut step, 150, 3, [22, 49]), [REFUSED; 2]);
    assert_eq!(after(&mut cycle, &mut step, 150, 3, [33, 22]), [REFUSED, VALID]);
    assert_eq!(after(&mut cycle, &mut step, 150, 3, [0, 22]), [REFUSED, VALID]);
}

#[test]
fn empty_lists_allow_all() {
    let (mut cycle, mut step) = (cycle(Limits::default()), 0);
    for runlevel in 0..4 {
        assert_eq!(after(&mut cycle, &mut step, 150, runlevel, [5, 6]), [VALID; 2]);
    }
}
