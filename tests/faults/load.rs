//! What the pose says while the estimator sees a load that the model was not trained with.

use crate::world::{MS, state};
use ravenpose::correction::{ArmModel, Estimator, Model, Pace};
use ravenpose::cycle::{Cycle, Limits};
use ravenpose::guard::{Allowed, Domain, Guard};
use ravenpose_wire::{ArmPose, ArmStatus, CorrectedPose, FEATURES, flag};

/// Feature of the first torque: as large as the load that [`Scale`] sees.
const TAU: usize = 40;
/// The most of it that the model has seen.
const TAU_MAX: f32 = 10.0;

/// Corrects by 1 mm along z, and takes the first torque for the load's score, the second, if it is not 0, for the friction's.
struct Scale(f32, Option<f32>);

impl Estimator for Scale {
    fn weigh(&mut self, features: &[f32; FEATURES], _time_ns: i64) {
        self.0 = features[TAU];
        self.1 = (features[TAU + 1] != 0.0).then_some(features[TAU + 1]);
    }

    fn load_score(&self) -> Option<f32> {
        Some(self.0)
    }

    fn friction_score(&self) -> Option<f32> {
        self.1
    }

    /// Of no load at all it is never sure.
    fn has_weighed(&self) -> bool {
        self.0 > 0.0
    }

    fn run(&mut self, _features: &[f32; FEATURES], error: &mut [f32; 3]) {
        *error = [0.0, 0.0, 1.0];
    }
}

struct Bench {
    cycle: Cycle<Scale>,
    pose: CorrectedPose,
    step: u64,
    friction: f32,
}

impl Bench {
    fn new() -> Self {
        let all = |value: f32| [value; FEATURES];
        let mut domain = Domain { min: all(f32::MIN), max: all(f32::MAX), center: all(0.0), weight: all(0.0), limit: 1.0 };
        domain.max[TAU] = TAU_MAX;
        let model = Model {
            estimator: Scale(0.0, None),
            guard: Guard::new(Some(domain)),
            allowed: Allowed { runlevels: vec![3], boards: Vec::new() },
            id: 1,
            bound: 8_000.0,
            bound95: [300.0; 3],
            bound95_unsettled: [f64::NAN; 3],
            untrained: false,
        };
        let limits = Limits { position: Pace { recover: 1e6, rate: 1e6, envelope: 15_000.0 }, ..Limits::default() };
        let cycle = Cycle::new(limits, [ArmModel::Loaded(Box::new(model)), ArmModel::None], false, 0);
        Self { cycle, pose: CorrectedPose::new(), step: 0, friction: 0.0 }
    }

    /// The last of so many poses with this load, and with the pedal down or up.
    fn carry_at(&mut self, load: f32, states: u64, runlevel: i32) -> ArmPose {
        for _ in 0..states {
            self.step += 1;
            let now = (1_000 + self.step as i64) * MS;
            let mut state = state(7, self.step, self.step, now);
            (state.tau[0], state.tau[1]) = (load, self.friction);
            state.runlevel = runlevel;
            state.seal(self.step);
            self.cycle.offer(&state, now);
            assert!(self.cycle.step(now, &mut (), &mut self.pose));
            self.cycle.finish(now + 40_000, false, &mut self.pose);
        }
        self.pose.arm[0]
    }

    fn carry(&mut self, load: f32, states: u64) -> ArmPose {
        self.carry_at(load, states, 3)
    }
}

#[test]
fn an_unseen_load_is_out_of_domain_at_once_and_the_correction_returns_when_it_is_gone() {
    let mut bench = Bench::new();
    let before = bench.carry(0.9, 150);
    assert_eq!((before.status, before.flags, before.domain_score), (ArmStatus::Valid as u32, 0, 0.9));
    assert_eq!(before.correction_um, [0.0, 0.0, 1000.0]);
    let loaded = bench.carry(1.1, 1);
    let wanted = flag::OUT_OF_DOMAIN | flag::UNSEEN_LOAD | flag::RESET;
    assert_eq!((loaded.status, loaded.flags, loaded.domain_score), (ArmStatus::Fallback as u32, wanted, 1.1));
    assert_eq!((loaded.correction_um, loaded.corrected_position_um), ([0.0; 3], loaded.raw_position_um));
    assert!(loaded.bound95_um.iter().all(|bound| bound.is_nan()));
    // Still carried: still said, and nothing is counted down.
    let later = bench.carry(1.1, 200);
    assert_eq!((later.flags, later.hold_cycles), (flag::OUT_OF_DOMAIN | flag::UNSEEN_LOAD, 100));
    let gone = bench.carry(0.5, 100);
    assert_eq!((gone.status, gone.flags), (ArmStatus::Fallback as u32, flag::SETTLING));
    assert_eq!(bench.carry(0.5, 1).correction_um, [0.0, 0.0, 1000.0]);
}

#[test]
fn an_unseen_friction_is_out_of_domain_too_and_said_by_its_own_name() {
    let mut bench = Bench::new();
    bench.friction = 0.9;
    let before = bench.carry(0.2, 150);
    assert_eq!((before.status, before.flags, before.domain_score), (ArmStatus::Valid as u32, 0, 0.9));
    bench.friction = 1.2;
    let worn = bench.carry(0.2, 1);
    let wanted = flag::OUT_OF_DOMAIN | flag::UNSEEN_FRICTION | flag::RESET;
    assert_eq!((worn.status, worn.flags, worn.domain_score), (ArmStatus::Fallback as u32, wanted, 1.2));
    assert_eq!((worn.correction_um, worn.corrected_position_um), ([0.0; 3], worn.raw_position_um));
    let both = bench.carry(1.5, 1);
    assert_eq!(both.flags, flag::OUT_OF_DOMAIN | flag::UNSEEN_LOAD | flag::UNSEEN_FRICTION);
    assert_eq!(both.domain_score, 1.5);
}

#[test]
fn what_cannot_be_followed_says_nothing_about_the_load() {
    let mut bench = Bench::new();
    let _ = bench.carry(0.2, 150);
    let broken = bench.carry(f32::NAN, 1);
    assert_eq!((broken.flags & flag::UNSEEN_LOAD, broken.flags & flag::INPUT_NOT_FINITE), (0, flag::INPUT_NOT_FINITE));
    assert_eq!(broken.domain_score, -1.0);
}

#[test]
fn with_the_pedal_up_nothing_is_weighed_nor_corrected() {
    let mut bench = Bench::new();
    let _ = bench.carry(0.2, 150);
    let up = bench.carry_at(5.0, 10, 2);
    assert_eq!((up.status, up.flags), (ArmStatus::Fallback as u32, flag::STATE_NOT_ALLOWED));
    assert_eq!((up.correction_um, up.domain_score), ([0.0; 3], 0.2));
    assert_eq!(bench.carry(0.2, 101).status, ArmStatus::Valid as u32);
}

#[test]
fn what_lies_outside_the_training_is_not_weighed() {
    let mut bench = Bench::new();
    let _ = bench.carry(0.2, 150);
    let pushed = bench.carry(TAU_MAX + 1.0, 1);
    assert_eq!((pushed.flags & !flag::RESET, pushed.domain_score), (flag::OUT_OF_RANGE, 0.2));
}

#[test]
fn until_it_has_weighed_a_valid_pose_says_so_and_a_raw_one_does_not() {
    let mut bench = Bench::new();
    let early = bench.carry(0.0, 150);
    assert_eq!((early.status, early.flags), (ArmStatus::Valid as u32, flag::LOAD_UNWEIGHED));
    assert_eq!(bench.carry_at(0.0, 1, 2).flags & flag::LOAD_UNWEIGHED, 0);
    assert_eq!(bench.carry(0.5, 150).flags, 0);
}
