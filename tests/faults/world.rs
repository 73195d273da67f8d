//! A plausible robot for the pure cycle: states that move within all limits, and an estimator with faults on demand.

use ravenpose::correction::{ArmModel, Estimator, Model};
use ravenpose::cycle::{ArmModels, Cycle, Limits};
use ravenpose::guard::{Allowed, Guard};
use ravenpose_wire::{CorrectedPose, FEATURES, RavenState};

pub(crate) const MS: i64 = 1_000_000;
/// `dac_val` of joint slot 0 that makes the estimator misbehave.
pub(crate) const OUT_NAN: i32 = 771;
pub(crate) const OUT_INFINITE: i32 = 772;
pub(crate) const OUT_HUGE: i32 = 773;
/// The same of the one that corrects the orientation.
pub(crate) const TURN_NAN: i32 = 774;
pub(crate) const TURN_HUGE: i32 = 775;
/// Largest correction of the test models, µm and degrees.
pub(crate) const BOUND_DEG: f64 = 8.0;
pub(crate) const BOUND_UM: f64 = 8_000.0;

/// A state of both arms at sample `step`, sent at `time_ns`.
pub(crate) fn state(source: u64, sequence: u64, step: u64, time_ns: i64) -> RavenState {
    let mut state = RavenState::new();
    let t = step as f64 * 1e-3;
    state.source_id = source;
    state.source_time_ns = time_ns;
    state.arms = 3;
    state.runlevel = 3;
    state.type_ = [49, 22];
    state.dt_nsec = 1_000_000;
    for arm in 0..2 {
        let s = (t * (1.0 + arm as f64)).sin();
        for axis in 0..3 {
            state.pos[arm * 3 + axis] = (20_000.0 * s + 1000.0 * axis as f64) as i32;
            state.ori[arm * 9 + axis * 4] = 1.0;
        }
        let at = arm * 8;
        state.jpos[at] = 30.0 + 10.0 * s as f32;
        state.jpos[at + 1] = 90.0;
        state.jpos[at + 2] = 22.9;
        state.jpos_d[at..at + 3].copy_from_slice(&[30.0, 90.0, 22.9]);
        for slot in [0, 1, 2, 4, 5, 6, 7] {
            // Encoders that move fast: 40 counts per cycle at least, so that a stop shows in spite of a few lost states.
            state.enc_vals[at + slot] = (step as i32 % 20_000) * (40 + slot as i32);
            state.mpos[at + slot] = state.enc_vals[at + slot] as f32 * 0.09;
        }
    }
    state.seal(sequence);
    state
}

/// Smooth and bounded in the state, with faults on demand; counts its runs.
#[derive(Default)]
pub(crate) struct Fake {
    pub runs: u64,
    /// Is it the one that corrects the orientation?
    pub turns: bool,
}

impl Estimator for Fake {
    fn run(&mut self, features: &[f32; FEATURES], error: &mut [f32; 3]) {
        self.runs += 1;
        let x = features[0] / 10_000.0;
        *error = [2.0 * x.sin(), 1.5 * x.cos(), 0.5];
        match features[32] as i32 {
            TURN_NAN if self.turns => error[0] = f32::NAN,
            TURN_HUGE if self.turns => error[2] = -8.5,
            _ if self.turns => {}
            OUT_NAN => error[1] = f32::NAN,
            OUT_INFINITE => error[2] = f32::INFINITY,
            OUT_HUGE => error[0] = 8.5,
            _ => {}
        }
    }
}

pub(crate) fn model() -> ArmModel<Fake> {
    model_of(Fake::default(), 0x0123_4567_89ab_cdef, BOUND_UM, [300.0, 400.0, 500.0])
}

pub(crate) fn turning() -> ArmModel<Fake> {
    model_of(Fake { turns: true, ..Fake::default() }, 0xfedc_ba98_7654_3210, BOUND_DEG, [0.3, 0.4, 0.5])
}

/// A model that is asked whatever a robot can do.
pub(crate) fn model_of<E>(estimator: E, id: u64, bound: f64, bound95: [f64; 3]) -> ArmModel<E> {
    let (guard, allowed, bound95_unsettled) = (Guard::new(None), Allowed::default(), [f64::NAN; 3]);
    ArmModel::Loaded(Box::new(Model { estimator, guard, allowed, id, bound, bound95, bound95_unsettled, untrained: false }))
}

/// Both arms with both models.
pub(crate) fn cycle(limits: Limits) -> Cycle<Fake> {
    let both = || ArmModels { position: model(), orientation: turning() };
    Cycle::new(limits, [both(), both()], false, 0)
}

/// The pure cycle with a clock in its hand: one call per period.
pub(crate) struct Bench {
    pub cycle: Cycle<Fake>,
    pub pose: CorrectedPose,
    pub now: i64,
    pub step: u64,
    /// Time that the next cycle takes.
    pub took: i64,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self { cycle: cycle(Limits::default()), pose: CorrectedPose::new(), now: 1_000 * MS, step: 0, took: 40_000 }
    }

    /// The next regular state, with sequence number = step.
    pub(crate) fn next_state(&mut self) -> RavenState {
        self.now += MS;
        self.step += 1;
        state(7, self.step, self.step, self.now)
    }

    /// Offers `messages` and runs one cycle; returns the pose if one is published.
    pub(crate) fn run(&mut self, messages: &[RavenState]) -> Option<CorrectedPose> {
        for message in messages {
            self.cycle.offer(message, self.now);
        }
        if !self.cycle.step(self.now, &mut (), &mut self.pose) {
            return None;
        }
        self.cycle.finish(self.now + self.took, false, &mut self.pose);
        Some(self.pose)
    }

    /// One regular cycle.
    pub(crate) fn good(&mut self) -> CorrectedPose {
        let state = self.next_state();
        self.run(&[state]).expect("a fresh state is answered")
    }

    /// Good cycles until the correction is complete.
    pub(crate) fn settle(&mut self) -> CorrectedPose {
        for _ in 0..2000 {
            let pose = self.good();
            if pose.arm.iter().all(|arm| arm.status == 2 && arm.flags == 0) {
                return pose;
            }
        }
        panic!("never valid: {:?}", self.pose.arm);
    }
}
