//! What an estimator with a memory is told to follow and to forget, and what the pose says meanwhile.

use crate::world::{MS, state};
use ravenpose::correction::{ArmModel, Estimator, Model, Pace};
use ravenpose::cycle::{Cycle, Limits};
use ravenpose::guard::{Allowed, Domain, Guard};
use ravenpose_wire::{ArmStatus, CorrectedPose, FEATURES, RavenState, flag};

/// States after which it is settled.
const SETTLES_AFTER: u32 = 300;
/// Feature of the first joint, and the most that the model has seen of it, degrees.
const JPOS: usize = 56;
const JPOS_MAX: f32 = 50.0;

/// Answers with the number of states that it followed since it forgot, in µm, on the z axis.
#[derive(Default)]
struct Counts {
    followed: u32,
    time_ns: i64,
}

impl Estimator for Counts {
    fn remembers(&self) -> bool {
        true
    }

    fn follow(&mut self, _features: &[f32; FEATURES], time_ns: i64) {
        assert!(time_ns > self.time_ns, "no state twice, none out of order");
        self.time_ns = time_ns;
        self.followed += 1;
    }

    fn forget(&mut self) {
        self.followed = 0;
    }

    fn is_settled(&self) -> bool {
        self.followed >= SETTLES_AFTER
    }

    fn run(&mut self, _features: &[f32; FEATURES], error: &mut [f32; 3]) {
        *error = [0.0, 0.0, self.followed as f32 * 1e-3];
    }
}

/// Anything, but for the first joint.
fn domain() -> Domain {
    let (mut min, mut max) = ([f32::MIN; FEATURES], [f32::MAX; FEATURES]);
    (min[JPOS], max[JPOS]) = (0.0, JPOS_MAX);
    Domain { min, max, center: [0.0; FEATURES], weight: [0.0; FEATURES], limit: 1.0 }
}

struct Bench {
    cycle: Cycle<Counts>,
    pose: CorrectedPose,
    step: u64,
    now: i64,
    source: u64,
}

impl Bench {
    fn new() -> Self {
        let model = |connected: bool| {
            let model = Model {
                estimator: Counts::default(),
                guard: Guard::new(Some(domain())),
                allowed: Allowed::default(),
                id: 1,
                bound: 8_000.0,
                bound95: [300.0, 400.0, 500.0],
                bound95_unsettled: [800.0, 900.0, 1000.0],
                untrained: false,
            };
            if connected { ArmModel::Loaded(Box::new(model)) } else { ArmModel::None }
        };
        // Fast enough that a correction is the estimator's own answer.
        let limits = Limits { position: Pace { recover: 1e6, rate: 1e6, envelope: 15_000.0 }, ..Limits::default() };
        let cycle = Cycle::new(limits, [model(true), model(false)], false, 0);
        Self { cycle, pose: CorrectedPose::new(), step: 0, now: 1_000 * MS, source: 7 }
    }

    fn next_state(&mut self) -> RavenState {
        self.now += MS;
        self.step += 1;
        state(self.source, self.step, self.step, self.now)
    }

    fn offer(&mut self, state: &RavenState) {
        self.cycle.offer(state, self.now);
    }

    fn answer(&mut self) -> CorrectedPose {
        assert!(self.cycle.step(self.now, &mut (), &mut self.pose));
        self.cycle.finish(self.now + 40_000, false, &mut self.pose);
        self.pose
    }

    fn good(&mut self) -> CorrectedPose {
        let state = self.next_state();
        self.offer(&state);
        self.answer()
    }

    /// Good cycles until the correction is back; how many states the estimator has followed then.
    fn followed(&mut self) -> u32 {
        for _ in 0..2000 {
            let pose = self.good();
            if pose.arm[0].status == ArmStatus::Valid as u32 {
                return pose.arm[0].correction_um[2].round() as u32;
            }
        }
        panic!("never valid: {:?}", self.pose.arm[0]);
    }
}

#[test]
fn every_state_of_a_good_run_is_followed_those_before_the_first_correction_too() {
    assert_eq!(Bench::new().followed(), 101);
}

#[test]
fn states_that_newer_ones_overtake_are_followed() {
    let mut bench = Bench::new();
    let before = bench.followed();
    for _ in 0..4 {
        let state = bench.next_state();
        bench.offer(&state);
    }
    let pose = bench.answer();
    assert_eq!((pose.skipped, pose.arm[0].correction_um[2].round() as u32), (3, before + 4));
}

#[test]
fn a_state_that_no_robot_can_have_is_not_followed_and_one_outside_the_training_is() {
    let mut bench = Bench::new();
    let mut before = bench.followed();
    for (jpos, reason, bad) in
        [(f32::NAN, flag::INPUT_NOT_FINITE, 0), (170.0, flag::INPUT_IMPOSSIBLE, 0), (JPOS_MAX + 1.0, flag::OUT_OF_RANGE, 1)]
    {
        let mut state = bench.next_state();
        state.jpos[0] = jpos;
        state.seal(bench.step);
        bench.offer(&state);
        let arm = bench.answer().arm[0];
        assert_eq!((arm.status, arm.flags & reason), (ArmStatus::Fallback as u32, reason));
        // A hundred good ones before the correction returns, and the one that it returns with.
        let after = bench.followed();
        assert_eq!(after, before + bad + 101, "{jpos}");
        before = after;
    }
}

#[test]
fn while_encoders_stand_still_nothing_is_followed_and_what_was_is_forgotten() {
    // A short one too, though what followed before it was found and after it leave no gap of 20 ms.
    stand_still(60);
    stand_still(30);
}

fn stand_still(states: u32) {
    let mut bench = Bench::new();
    let _ = bench.followed();
    let frozen = bench.next_state();
    let mut refused = 0;
    for count in 0..states {
        let mut state = bench.next_state();
        // They stand dead, and the motor reports its speed on.
        state.enc_vals = frozen.enc_vals;
        state.mvel[0] = 900.0;
        state.seal(bench.step);
        bench.offer(&state);
        // Every third is overtaken by the next.
        if count % 3 != 0 || count < 30 {
            refused += u32::from(bench.answer().arm[0].flags & flag::INPUT_FROZEN != 0);
        }
    }
    assert!(refused >= states / 2 - 6, "{refused}");
    assert_eq!(bench.followed(), 101);
}

#[test]
fn another_source_and_a_disconnection_end_it() {
    let mut bench = Bench::new();
    let _ = bench.followed();
    bench.source = 8;
    // The first of the new source is followed, though it is answered with the raw pose.
    assert_eq!(bench.followed(), 102);
    let mut state = bench.next_state();
    state.arms = 2;
    state.seal(bench.step);
    bench.offer(&state);
    assert_eq!(bench.answer().arm[0].status, ArmStatus::Absent as u32);
    assert_eq!(bench.followed(), 101);
    // The same in a state that a newer one overtakes: nobody is told, but the memory is gone.
    let mut away = bench.next_state();
    away.arms = 2;
    away.seal(bench.step);
    bench.offer(&away);
    let back = bench.next_state();
    bench.offer(&back);
    let arm = bench.answer().arm[0];
    assert_eq!((arm.status, arm.correction_um[2].round() as u32), (ArmStatus::Valid as u32, 1));
}

#[test]
fn until_it_is_settled_the_pose_says_so_with_a_bound_of_its_own() {
    let mut bench = Bench::new();
    let _ = bench.followed();
    for followed in 102..SETTLES_AFTER {
        let arm = bench.good().arm[0];
        assert_eq!((arm.status, arm.flags), (ArmStatus::Valid as u32, flag::MEMORY_UNSETTLED), "{followed}");
        assert_eq!(arm.bound95_um, [800.0, 900.0, 1000.0]);
    }
    let arm = bench.good().arm[0];
    assert_eq!((arm.flags, arm.bound95_um), (0, [300.0, 400.0, 500.0]));
}

#[test]
fn a_fallback_says_nothing_of_the_memory() {
    let mut bench = Bench::new();
    let _ = bench.followed();
    let state = bench.next_state();
    bench.offer(&state);
    assert!(bench.cycle.step(bench.now, &mut (), &mut bench.pose));
    assert_ne!(bench.pose.arm[0].flags & flag::MEMORY_UNSETTLED, 0);
    // It was valid, until the answer came too late.
    bench.cycle.finish(bench.now + 6 * MS, false, &mut bench.pose);
    let arm = bench.pose.arm[0];
    assert_eq!((arm.status, arm.flags & flag::MEMORY_UNSETTLED), (ArmStatus::Fallback as u32, 0));
}
