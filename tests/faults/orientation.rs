//! The orientation beside the position: turned by what its own model says, slewed, dropped and bounded as the position is.

use crate::world::{Bench, MS, TURN_HUGE, TURN_NAN, model, state, turning};
use nalgebra::{Matrix3, Rotation3, Vector3};
use ravenpose::correction::{ArmModel, Estimator, Model, Pace};
use ravenpose::cycle::{ArmModels, Cycle, Limits};
use ravenpose::guard::{Allowed, Domain, Guard};
use ravenpose_wire::{ArmPose, ArmStatus, CorrectedPose, FEATURES, RavenState, flag};

const VALID: u32 = ArmStatus::Valid as u32;
const FALLBACK: u32 = ArmStatus::Fallback as u32;

/// A tip that points somewhere.
fn turn(state: &mut RavenState, by: Vector3<f64>) {
    let matrix = Rotation3::new(by).into_inner();
    for arm in 0..2 {
        for place in 0..9 {
            state.ori[arm * 9 + place] = matrix[(place / 3, place % 3)] as f32;
        }
    }
    state.seal(state.sequence);
}

fn matrix(row_major: &[f32; 9]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| f64::from(row_major[3 * row + column]))
}

/// Is the orientation RAVEN's own?
pub(crate) fn is_raw(arm: &ArmPose) -> bool {
    arm.rotation_deg == [0.0; 3]
        && arm.corrected_orientation.map(f32::to_bits) == arm.orientation.map(f32::to_bits)
        && arm.rotation_bound95_deg.iter().all(|bound| bound.is_nan())
}

#[test]
fn the_orientation_is_turned_by_the_published_rotation_which_is_the_models_answer_in_the_end() {
    let mut bench = Bench::new();
    let mut before = Vector3::zeros();
    let mut recovered = 0;
    for step in 0..1000_u32 {
        let mut state = bench.next_state();
        turn(&mut state, Vector3::new(0.3, -1.2, 0.002 * f64::from(step)));
        let pose = bench.run(&[state]).expect("answered");
        let arm = &pose.arm[0];
        if arm.status != VALID {
            assert!(is_raw(arm), "{arm:?}");
            continue;
        }
        assert_eq!((arm.model_id, arm.orientation_model_id), (0x0123_4567_89ab_cdef, 0xfedc_ba98_7654_3210));
        let rotation = Vector3::from(arm.rotation_deg);
        let expected = Rotation3::new(rotation.map(f64::to_radians)) * matrix(&arm.orientation);
        assert!((matrix(&arm.corrected_orientation) - expected).amax() < 1e-6);
        // What the fake network says of this state, and by how much the bound is wider while it is not there.
        let x = f64::from(state.pos[0]) / 10_000.0;
        let answer = Vector3::new(2.0 * x.sin(), 1.5 * x.cos(), 0.5);
        let wider: [f64; 3] = std::array::from_fn(|axis| arm.rotation_bound95_deg[axis] - [0.3, 0.4, 0.5][axis]);
        for axis in 0..3 {
            assert!((wider[axis] - (answer - rotation)[axis].abs()).abs() < 1e-4, "{wider:?}, {:?}", answer - rotation);
        }
        let pace = Limits::default().orientation;
        if arm.flags & flag::RECOVERING == 0 {
            recovered += 1;
            assert!((answer - rotation).norm() < 1e-4, "{rotation:?} of {answer:?}");
        } else {
            assert!((rotation - before).norm() <= pace.recover * (1.0 + 1e-9));
        }
        before = rotation;
    }
    assert!(recovered > 300, "{recovered}");
}

#[test]
fn a_doubtful_answer_about_either_drops_both() {
    for (fault, reason) in [(TURN_NAN, flag::OUTPUT_NOT_FINITE), (TURN_HUGE, flag::OUTPUT_BEYOND_BOUND)] {
        let mut bench = Bench::new();
        assert!(bench.settle().arm[1].rotation_deg != [0.0; 3]);
        let mut state = bench.next_state();
        state.dac_val[8] = fault;
        let pose = bench.run(&[state]).expect("answered");
        let (gold, green) = (&pose.arm[0], &pose.arm[1]);
        assert_eq!((gold.status, gold.flags), (VALID, 0), "the other arm's is another model");
        assert_eq!((green.status, green.flags & reason), (FALLBACK, reason));
        assert!(is_raw(green) && green.correction_um == [0.0; 3] && green.flags & flag::RESET != 0, "{green:?}");
        // Back by the same hundred good states.
        let hold = (0..).take_while(|_| bench.good().arm[1].status != VALID).take(200).count();
        assert_eq!(hold, 100);
    }
}

#[test]
fn a_rotation_on_its_way_back_does_not_hold_the_position_back() {
    let mut bench = Bench::new();
    // Rotations return more slowly than positions here.
    let limits = Limits { orientation: Pace { recover: 0.001, ..Limits::default().orientation }, ..Limits::default() };
    bench.cycle = crate::world::cycle(limits);
    let there = (0..2000).map(|_| bench.good().arm[0]).find(|arm| arm.status == VALID && arm.bound95_um == [300.0, 400.0, 500.0]);
    let before = there.expect("the position has arrived");
    assert_eq!(before.flags, flag::RECOVERING, "the rotation has not");
    let mut state = bench.next_state();
    state.pos[0] = -15_000;
    let pose = bench.run(&[state]).expect("answered");
    let step = (Vector3::from(pose.arm[0].correction_um) - Vector3::from(before.correction_um)).norm();
    assert!((step - limits.position.rate).abs() < 1e-6, "{step}");
    assert_eq!(pose.arm[0].flags, flag::RECOVERING | flag::RATE_LIMITED);
}

#[test]
fn a_rotation_that_jumps_is_rate_limited_and_flagged() {
    let mut bench = Bench::new();
    let before = bench.settle().arm[0];
    let mut state = bench.next_state();
    state.pos[0] = -15_000;
    let arm = bench.run(&[state]).expect("answered").arm[0];
    let step = (Vector3::from(arm.rotation_deg) - Vector3::from(before.rotation_deg)).norm();
    assert!((step - Limits::default().orientation.rate).abs() < 1e-9, "{step}");
    assert_eq!((arm.status, arm.flags), (VALID, flag::RATE_LIMITED));
}

/// An estimator that says of itself what it is told to.
#[derive(Clone, Copy, Default)]
struct Says {
    unsettled: bool,
    unweighed: bool,
    load: Option<f32>,
}

impl Estimator for Says {
    fn is_settled(&self) -> bool {
        !self.unsettled
    }

    fn has_weighed(&self) -> bool {
        !self.unweighed
    }

    fn load_score(&self) -> Option<f32> {
        self.load
    }

    fn run(&mut self, _features: &[f32; FEATURES], error: &mut [f32; 3]) {
        *error = [0.0, 0.0, 0.001];
    }
}

/// What the arm says in the end if only the orientation's model has this to say.
fn said(says: Says, allowed: Allowed, domain: Option<Domain>) -> ArmPose {
    let model = |estimator, allowed, guard| {
        let (bound95, bound95_unsettled) = ([1.0; 3], [2.0; 3]);
        ArmModel::Loaded(Box::new(Model {
            estimator,
            guard,
            allowed,
            id: 1,
            bound: 8.0,
            bound95,
            bound95_unsettled,
            untrained: false,
        }))
    };
    let position = model(Says::default(), Allowed::default(), Guard::new(None));
    last_of(ArmModels { position, orientation: model(says, allowed, Guard::new(domain)) }, false, 300).arm[0]
}

#[test]
fn what_only_the_model_of_the_orientation_finds_is_said_of_the_arm() {
    let fine = said(Says::default(), Allowed::default(), None);
    assert_eq!((fine.status, fine.flags, fine.bound95_um, fine.rotation_bound95_deg), (VALID, 0, [1.0; 3], [1.0; 3]));
    let unsettled = said(Says { unsettled: true, ..Says::default() }, Allowed::default(), None);
    assert_eq!((unsettled.status, unsettled.flags), (VALID, flag::MEMORY_UNSETTLED));
    assert_eq!((unsettled.bound95_um, unsettled.rotation_bound95_deg), ([1.0; 3], [2.0; 3]));
    let unweighed = said(Says { unweighed: true, ..Says::default() }, Allowed::default(), None);
    assert_eq!((unweighed.status, unweighed.flags), (VALID, flag::LOAD_UNWEIGHED));
    let loaded = said(Says { load: Some(1.5), ..Says::default() }, Allowed::default(), None);
    assert_eq!((loaded.status, loaded.flags, loaded.domain_score), (FALLBACK, flag::OUT_OF_DOMAIN | flag::UNSEEN_LOAD, 1.5));
    let elsewhere = said(Says::default(), Allowed { runlevels: vec![7], boards: Vec::new() }, None);
    assert_eq!((elsewhere.status, elsewhere.flags), (FALLBACK, flag::STATE_NOT_ALLOWED));
    let all = |value: f32| [value; FEATURES];
    let domain = Domain { min: all(f32::MIN), max: all(f32::MIN), center: all(0.0), weight: all(0.0), limit: 1.0 };
    let outside = said(Says::default(), Allowed::default(), Some(domain));
    assert_eq!((outside.status, outside.flags), (FALLBACK, flag::OUT_OF_RANGE));
}

fn last_of<E: Estimator>(models: ArmModels<E>, allow_untrained: bool, cycles: u64) -> CorrectedPose {
    let mut cycle = Cycle::new(Limits::default(), [models, ArmModels::from(ArmModel::None)], allow_untrained, 0);
    let mut pose = CorrectedPose::new();
    for step in 1..=cycles {
        let now = (1000 + step as i64) * MS;
        cycle.offer(&state(7, step, step, now), now);
        assert!(cycle.step(now, &mut (), &mut pose));
        cycle.finish(now + 40_000, false, &mut pose);
    }
    pose
}

#[test]
fn without_a_model_of_it_the_orientation_is_passed_through_and_says_so() {
    let arm = last_of(model().into(), false, 500).arm[0];
    assert_eq!((arm.status, arm.flags, arm.orientation_model_id), (VALID, 0, 0));
    assert!(is_raw(&arm) && arm.correction_um != [0.0; 3], "{arm:?}");
}

#[test]
fn a_refused_or_untrained_model_of_the_orientation_ends_the_correction() {
    let refused = last_of(ArmModels { position: model(), orientation: ArmModel::Rejected }, false, 200).arm[0];
    assert_eq!((refused.status, refused.flags), (FALLBACK, flag::MODEL_REJECTED));
    let untrained = || {
        let ArmModel::Loaded(mut loaded) = turning() else { panic!("a model") };
        loaded.untrained = true;
        ArmModels { position: model(), orientation: ArmModel::Loaded(loaded) }
    };
    let refused = last_of(untrained(), false, 200).arm[0];
    assert_eq!((refused.status, refused.flags), (FALLBACK, flag::UNTRAINED));
    let allowed = last_of(untrained(), true, 500).arm[0];
    assert_eq!((allowed.status, allowed.flags), (VALID, flag::UNTRAINED_ALLOWED));
}
