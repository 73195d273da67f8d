//! One period of the service as a function of (state, messages, time).
//!
//! No clock, no shared memory, no allocation here: the simulator in `tests/` runs hours of faults through it from a seed. The rules
//! are those of `docs/flags.md`: anything doubtful yields the raw pose with correction zero in the same cycle and a flag that says
//! why; the correction comes back after 100 good cycles in a row, slewed.

use crate::frozen::{DEGRADED_AFTER, FROZEN_AFTER, FrozenWatch};
use crate::guard::{Allowed, Guard};
use crate::memory::may_follow;
use nalgebra::Vector3;
use ravenpose_wire::{ARMS, ArmPose, ArmStatus, CorrectedPose, FALLBACK_REASONS, FEATURES, RavenState, features, flag};

/// Micrometres per millimetre: the network answers in mm, messages are in µm.
const UM_PER_MM: f64 = 1000.0;
/// A source time this far ahead of our clock is not a time of this machine's `CLOCK_MONOTONIC`.
const FUTURE_NS: i64 = 1_000_000;
/// Of so many pieces of an arm that are kept warm one is the features and the guard, the others are of its weights.
const WARM_ROUNDS: usize = 16;
/// A larger gap in the sequence is a restart of the source, not a loss.
const GAP_MAX: u64 = 10_000;

/// What evaluates the network: 118 features to a position error in mm. Nothing here may allocate, block or panic.
pub trait Estimator {
    /// Does its answer depend on the states before?
    fn remembers(&self) -> bool {
        false
    }

    /// Takes in a state of a time that rises, ns; it is the newest from now on.
    fn follow(&mut self, _features: &[f32; FEATURES], _time_ns: i64) {}

    /// Forgets all states: the arm may have moved unseen.
    fn forget(&mut self) {}

    /// Has it seen enough of the motion?
    fn is_settled(&self) -> bool {
        true
    }

    /// Takes in the features that it followed last, of a state in which the motors hold the arm: what do they hold?
    fn weigh(&mut self, _features: &[f32; FEATURES], _time_ns: i64) {}

    /// What the arm seems to carry over what it may carry for this to be trusted: above 1 it may not. None where nobody looks.
    fn load_score(&self) -> Option<f32> {
        None
    }

    /// Has it seen enough motion to tell? Until then a load may be there.
    fn has_weighed(&self) -> bool {
        true
    }

    /// Evaluates the features that it followed last; where it followed none, as one that has seen these alone.
    fn run(&mut self, features: &[f32; FEATURES], error_mm: &mut [f32; 3]);

    /// Does a microsecond's worth of what makes the next run fast; changes no result.
    fn keep_warm(&mut self) {}
}

/// Limits of the cycle; see `docs/configuration.md`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Nominal period of the states, ns.
    pub period_ns: i64,
    /// Age at which a state may no longer be corrected, ns.
    pub stale_ns: i64,
    /// Time from taking a state to handing the answer over, ns.
    pub budget_ns: i64,
    /// Good cycles before a correction returns.
    pub good_cycles: u32,
    /// Slew of a returning correction, µm per cycle.
    pub recover_um: f64,
    /// Largest change of a correction, µm per cycle.
    pub rate_um: f64,
    /// Largest correction that is believed, µm (Euclidean).
    pub envelope_um: f64,
    /// Late answers in a row that reduce trust.
    pub late_degraded: u32,
    /// Late answers in a row that end it.
    pub late_fallback: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            period_ns: 1_000_000,
            stale_ns: 5_000_000,
            budget_ns: 500_000,
            good_cycles: 100,
            recover_um: 10.0,
            rate_um: 100.0,
            envelope_um: 15_000.0,
            late_degraded: 3,
            late_fallback: 10,
        }
    }
}

/// A model as the cycle uses it.
pub struct Model<E> {
    /// The network.
    pub estimator: E,
    /// Admission of its inputs.
    pub guard: Guard,
    /// The states that it may be used with at all.
    pub allowed: Allowed,
    /// First eight bytes of the file's SHA-256.
    pub id: u64,
    /// Largest correction that the model stands for, µm (Euclidean).
    pub bound_um: f64,
    /// Stated 95 % half width per axis, µm; NaN if it states none.
    pub bound95_um: [f64; 3],
    /// The same while the estimator is not settled.
    pub bound95_unsettled_um: [f64; 3],
    /// Marked untrained?
    pub untrained: bool,
}

/// What an arm is corrected with.
pub enum ArmModel<E> {
    /// Nothing is configured for this arm.
    None,
    /// The configured model was refused and the configuration allows to go on.
    Rejected,
    /// A loaded model.
    Loaded(Box<Model<E>>),
}

/// Counters of everything that happened since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Cycles, idle ones included.
    pub cycles: u64,
    /// Distinct states taken in.
    pub accepted: u64,
    /// States that never arrived.
    pub lost: u64,
    /// States overtaken by a newer one within a cycle.
    pub skipped: u64,
    /// States that arrived again.
    pub duplicates: u64,
    /// States older than one already taken.
    pub out_of_order: u64,
    /// Messages of another layout, torn, or from the future.
    pub refused: u64,
    /// Times that the source was restarted.
    pub sources: u64,
    /// Answers beyond the budget.
    pub late: u64,
    /// Cycles beyond the period.
    pub overruns: u64,
    /// Messages published.
    pub published: u64,
}

/// Marks the moments inside a cycle; the real loop reads a clock, the simulator counts.
pub trait Stopwatch {
    /// The features are ready.
    fn features_done(&mut self) {}
    /// The network has answered.
    fn inference_done(&mut self) {}
}

/// A stopwatch that nobody reads.
impl Stopwatch for () {}

struct Arm<E> {
    model: ArmModel<E>,
    frozen: FrozenWatch,
    /// Did the newest judged state show encoders that stand still?
    is_frozen: bool,
    correction_um: Vector3<f64>,
    hold: u32,
    /// Why the hold began, kept while it lasts.
    hold_flags: u32,
    recovering: bool,
    valid: bool,
    ever_valid: bool,
    reset_count: u32,
}

/// The state of the service between cycles.
pub struct Cycle<E> {
    limits: Limits,
    allow_untrained: bool,
    /// Flags on every message: what this machine cannot guarantee.
    standing_flags: u32,
    arms: [Arm<E>; ARMS],
    newest: RavenState,
    have_state: bool,
    pending: bool,
    new_source: bool,
    saw_duplicate: bool,
    late_in_row: u32,
    counters: Counters,
    first_sequence: u64,
    features: [f32; FEATURES],
    /// Which piece [`Cycle::keep_warm`] does next.
    warm: usize,
}

impl<E: Estimator> Cycle<E> {
    /// A cycle that has seen nothing yet.
    pub fn new(limits: Limits, models: [ArmModel<E>; ARMS], allow_untrained: bool, standing_flags: u32) -> Self {
        let arms = models.map(|model| Arm {
            model,
            frozen: FrozenWatch::default(),
            is_frozen: false,
            correction_um: Vector3::zeros(),
            hold: limits.good_cycles,
            hold_flags: 0,
            recovering: false,
            valid: false,
            ever_valid: false,
            reset_count: 0,
        });
        Self {
            limits,
            allow_untrained,
            standing_flags,
            arms,
            newest: RavenState::new(),
            have_state: false,
            pending: false,
            new_source: false,
            saw_duplicate: false,
            late_in_row: 0,
            counters: Counters::default(),
            first_sequence: 0,
            features: [0.0; FEATURES],
            warm: 0,
        }
    }

    /// Starts this run's numbers above those of any earlier run on this machine: the sequence from the clock in µs (it rises by about
    /// one per ms), the reset counts from the clock in ms. So a restart is seen as an announced step, and numbers never fall.
    pub fn begin_at(&mut self, now_ns: i64) {
        self.first_sequence = (now_ns.max(0) / 1000) as u64;
        for arm in &mut self.arms {
            arm.reset_count = (now_ns.max(0) / 1_000_000) as u32;
        }
    }

    /// What happened so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The newest state taken in, if any.
    pub fn newest(&self) -> Option<&RavenState> {
        self.have_state.then_some(&self.newest)
    }

    /// Starts the counters near the end of their range (tests of wrap-around).
    pub fn preset_counters(&mut self, counters: Counters) {
        self.counters = counters;
    }

    /// Takes in a message from the link. Call for each waiting one, oldest first, then [`Cycle::step`].
    pub fn offer(&mut self, state: &RavenState, now_ns: i64) {
        // Copied first, judged afterwards: whoever still writes to the shared message cannot change what was judged.
        let state = *state;
        // `CLOCK_MONOTONIC` is never negative; refusing what is keeps every later difference of times in range.
        if state.admit().is_err() || !(0..=now_ns.saturating_add(FUTURE_NS)).contains(&state.source_time_ns) {
            count(&mut self.counters.refused);
            return;
        }
        if self.have_state {
            let last = &self.newest;
            let newer = state.source_time_ns > last.source_time_ns;
            if state.source_id != last.source_id {
                if !newer {
                    count(&mut self.counters.out_of_order);
                    return;
                }
                self.begin_source();
            } else if state.sequence == last.sequence {
                count(&mut self.counters.duplicates);
                self.saw_duplicate = true;
                return;
            } else if state.sequence < last.sequence {
                if !newer {
                    count(&mut self.counters.out_of_order);
                    return;
                }
                self.begin_source();
            } else if state.source_time_ns < last.source_time_ns {
                // A later number with an earlier time: one of the two is wrong.
                count(&mut self.counters.refused);
                return;
            } else {
                let missing = state.sequence - last.sequence - 1;
                if missing > GAP_MAX {
                    self.begin_source();
                } else if missing > 0 {
                    self.counters.lost = self.counters.lost.wrapping_add(missing);
                }
            }
        }
        if self.pending {
            count(&mut self.counters.skipped);
            self.remember_overtaken();
        }
        count(&mut self.counters.accepted);
        self.newest = state;
        self.have_state = true;
        self.pending = true;
    }

    /// While nothing has arrived: keeps warm what answers the connected arms, one piece of one arm per call. Changes no answer.
    pub fn keep_warm(&mut self) {
        let (round, index) = (self.warm / ARMS, self.warm % ARMS);
        self.warm = (self.warm + 1) % (ARMS * WARM_ROUNDS);
        let ArmModel::Loaded(model) = &mut self.arms[index].model else { return };
        if self.newest.connected() & (1 << index) == 0 {
            return;
        }
        if round == 0 {
            features::extract(&self.newest, index, &mut self.features);
            // The verdict was given when the state came; what counts is that its code and ranges are read.
            std::hint::black_box(model.guard.check(&self.features));
        } else {
            model.estimator.keep_warm();
        }
    }

    fn begin_source(&mut self) {
        count(&mut self.counters.sources);
        self.new_source = true;
    }

    /// A state that a newer one overtakes is not answered, but where the joints were is remembered.
    fn remember_overtaken(&mut self) {
        for (index, arm) in self.arms.iter_mut().enumerate() {
            let ArmModel::Loaded(model) = &mut arm.model else { continue };
            if !model.estimator.remembers() {
                continue;
            }
            if self.newest.connected() & (1 << index) == 0 {
                model.estimator.forget();
                continue;
            }
            features::extract(&self.newest, index, &mut self.features);
            if !arm.is_frozen && may_follow(model.guard.check(&self.features).reasons) {
                model.estimator.follow(&self.features, self.newest.source_time_ns);
            }
        }
    }

    /// Answers the newest state, or the lack of one. Returns whether `pose` is to be published after [`Cycle::finish`].
    pub fn step(&mut self, now_ns: i64, stopwatch: &mut impl Stopwatch, pose: &mut CorrectedPose) -> bool {
        count(&mut self.counters.cycles);
        if !self.have_state {
            return false;
        }
        let age_ns = now_ns.saturating_sub(self.newest.source_time_ns);
        let stale = age_ns >= self.limits.stale_ns;
        if !self.pending && !stale {
            return false;
        }
        self.fill_header(now_ns, pose);
        let answered = std::mem::take(&mut self.pending);
        let mut common = if stale { flag::INPUT_STALE } else { 0 };
        if std::mem::take(&mut self.new_source) {
            common |= flag::NEW_SOURCE;
        }
        if self.late_in_row >= self.limits.late_fallback {
            common |= flag::BUDGET_EXCEEDED;
        }
        let mut information = self.standing_flags;
        if std::mem::take(&mut self.saw_duplicate) {
            information |= flag::SAW_DUPLICATE;
        }
        if self.late_in_row >= self.limits.late_degraded {
            information |= flag::DEGRADED;
        }
        let connected = self.newest.connected();
        pose.arms = connected;
        for index in 0..ARMS {
            if connected & (1 << index) == 0 {
                pose.arm[index] = self.arms[index].disconnect(&self.limits);
                continue;
            }
            let arm = &mut self.arms[index];
            if common & flag::NEW_SOURCE != 0 {
                arm.frozen.reset();
                arm.forget();
            }
            // A repeated message says only that the input is stale: its numbers were judged when they were new.
            let judged = if answered {
                features::extract(&self.newest, index, &mut self.features);
                stopwatch.features_done();
                let judged = arm.judge(&self.newest, index, &self.features, self.allow_untrained, &self.limits, common);
                stopwatch.inference_done();
                judged
            } else {
                let (reasons, information) = arm.standing(self.allow_untrained);
                Judgement { reasons: common | reasons, information, score: -1.0, target_um: Vector3::zeros() }
            };
            arm.advance(&judged, information, &self.newest, index, &self.limits, &mut pose.arm[index]);
        }
        true
    }

    fn fill_header(&self, now_ns: i64, pose: &mut CorrectedPose) {
        pose.source_id = self.newest.source_id;
        pose.source_sequence = self.newest.sequence;
        pose.source_time_ns = self.newest.source_time_ns;
        pose.start_time_ns = now_ns;
        pose.runlevel = self.newest.runlevel;
        pose.cycles = self.counters.cycles;
        pose.lost = self.counters.lost;
        pose.skipped = self.counters.skipped;
        pose.duplicates = self.counters.duplicates;
        pose.out_of_order = self.counters.out_of_order;
        pose.refused = self.counters.refused;
    }

    /// Completes a message of [`Cycle::step`] just before it is handed over: judges the time it took, and seals it.
    pub fn finish(&mut self, now_ns: i64, stopping: bool, pose: &mut CorrectedPose) {
        let took_ns = now_ns.saturating_sub(pose.start_time_ns);
        let mut reasons = 0;
        if took_ns > self.limits.budget_ns {
            count(&mut self.counters.late);
            self.late_in_row = self.late_in_row.saturating_add(1);
            if self.late_in_row >= self.limits.late_fallback {
                reasons |= flag::BUDGET_EXCEEDED;
            }
        } else {
            self.late_in_row = 0;
        }
        if took_ns > self.limits.period_ns {
            count(&mut self.counters.overruns);
        }
        if now_ns.saturating_sub(pose.source_time_ns) >= self.limits.stale_ns {
            // It was fresh when it was taken; whatever held the cycle up since has made it stale.
            reasons |= flag::INPUT_STALE;
        }
        if stopping {
            reasons |= flag::STOPPING;
        }
        for (arm, out) in self.arms.iter_mut().zip(&mut pose.arm) {
            if out.status == ArmStatus::Absent as u32 {
                continue;
            }
            if took_ns > self.limits.budget_ns {
                out.flags |= flag::LATE;
                if self.late_in_row >= self.limits.late_degraded {
                    out.flags |= flag::DEGRADED;
                }
            }
            if reasons != 0 {
                arm.fall_back(reasons, &self.limits, out);
            }
        }
        pose.late = self.counters.late;
        pose.overruns = self.counters.overruns;
        pose.publish_time_ns = now_ns;
        self.counters.published = self.counters.published.wrapping_add(1);
        pose.seal(self.first_sequence.wrapping_add(self.counters.published));
    }

    /// Composes the last message of a stopping service from the newest state; `false` if there never was one.
    pub fn stop(&mut self, now_ns: i64, pose: &mut CorrectedPose) -> bool {
        if !self.have_state {
            return false;
        }
        if !self.step(now_ns, &mut (), pose) {
            // Nothing new and not stale: repeat the last state, as fallback.
            self.fill_header(now_ns, pose);
            for arm in &mut pose.arm {
                arm.flags &= self.standing_flags;
            }
        }
        self.finish(now_ns, true, pose);
        true
    }
}

/// What one arm's inputs and output came to, before the history is considered.
struct Judgement {
    reasons: u32,
    information: u32,
    score: f32,
    target_um: Vector3<f64>,
}

impl<E: Estimator> Arm<E> {
    /// What the estimator remembers is of another source, or of before a disconnection.
    fn forget(&mut self) {
        if let ArmModel::Loaded(model) = &mut self.model {
            model.estimator.forget();
        }
    }

    /// Reasons and information that hold whatever the state is: those of the model.
    fn standing(&self, allow_untrained: bool) -> (u32, u32) {
        match &self.model {
            ArmModel::None => (flag::NO_MODEL, 0),
            ArmModel::Rejected => (flag::MODEL_REJECTED, 0),
            ArmModel::Loaded(model) if !model.untrained => (0, 0),
            ArmModel::Loaded(_) if allow_untrained => (0, flag::UNTRAINED_ALLOWED),
            ArmModel::Loaded(_) => (flag::UNTRAINED, 0),
        }
    }

    #[expect(clippy::neg_cmp_op_on_partial_ord, reason = "written so that NaN fails")]
    fn judge(
        &mut self,
        state: &RavenState,
        index: usize,
        features: &[f32; FEATURES],
        allow_untrained: bool,
        limits: &Limits,
        common: u32,
    ) -> Judgement {
        let (reasons, information) = self.standing(allow_untrained);
        let mut judged = Judgement { reasons: common | reasons, information, score: -1.0, target_um: Vector3::zeros() };
        let still = self.frozen.observe(state, index);
        self.is_frozen = still >= FROZEN_AFTER;
        match still {
            FROZEN_AFTER.. => judged.reasons |= flag::INPUT_FROZEN,
            DEGRADED_AFTER.. => judged.information |= flag::DEGRADED,
            _ => {}
        }
        let ArmModel::Loaded(model) = &mut self.model else { return judged };
        let verdict = model.guard.check(features);
        judged.reasons |= verdict.reasons;
        judged.score = verdict.score;
        let allowed = model.allowed.allows(state, index);
        if !allowed {
            judged.reasons |= flag::STATE_NOT_ALLOWED;
        }
        if may_follow(judged.reasons) {
            model.estimator.follow(features, state.source_time_ns);
            if allowed && verdict.reasons == 0 {
                model.estimator.weigh(features, state.source_time_ns);
            }
            if let Some(load) = model.estimator.load_score() {
                judged.score = judged.score.max(load);
                if !(load <= 1.0) {
                    judged.reasons |= flag::OUT_OF_DOMAIN;
                    judged.information |= flag::UNSEEN_LOAD;
                }
            }
        }
        if judged.reasons != 0 {
            return judged;
        }
        let mut error_mm = [0.0_f32; 3];
        model.estimator.run(features, &mut error_mm);
        judged.target_um = Vector3::from(error_mm.map(f64::from)) * UM_PER_MM;
        if !error_mm.iter().all(|value| value.is_finite()) {
            judged.reasons |= flag::OUTPUT_NOT_FINITE;
        } else if !(judged.target_um.norm() <= model.bound_um.min(limits.envelope_um)) {
            judged.reasons |= flag::OUTPUT_BEYOND_BOUND;
        }
        judged
    }

    fn advance(
        &mut self,
        judged: &Judgement,
        information: u32,
        state: &RavenState,
        index: usize,
        limits: &Limits,
        out: &mut ArmPose,
    ) {
        let raw = Vector3::from_fn(|axis, _| f64::from(state.pos[index * 3 + axis]));
        out.raw_position_um = raw.into();
        out.orientation.copy_from_slice(&state.ori[index * 9..index * 9 + 9]);
        out.domain_score = judged.score;
        out.model_id = match &self.model {
            ArmModel::Loaded(model) => model.id,
            _ => 0,
        };
        out.flags = information | judged.information;
        if judged.reasons != 0 {
            self.fall_back(judged.reasons, limits, out);
            return;
        }
        if self.hold > 0 {
            self.hold -= 1;
            self.show_raw(flag::SETTLING | self.hold_flags, out);
            return;
        }
        self.correct(judged.target_um, limits, out);
        let corrected = raw + self.correction_um;
        out.corrected_position_um = corrected.into();
    }

    /// Moves the correction towards the network's answer, no faster than allowed.
    fn correct(&mut self, target_um: Vector3<f64>, limits: &Limits, out: &mut ArmPose) {
        if !self.valid {
            self.valid = true;
            self.ever_valid = true;
            self.hold_flags = 0;
            self.recovering = true;
        }
        let step_max = if self.recovering { limits.recover_um } else { limits.rate_um };
        let missing = target_um - self.correction_um;
        let distance = missing.norm();
        if distance <= step_max {
            self.correction_um = target_um;
            self.recovering = false;
        } else {
            self.correction_um += missing * (step_max / distance);
            out.flags |= if self.recovering { flag::RECOVERING } else { flag::RATE_LIMITED };
        }
        let still_missing = target_um - self.correction_um;
        let stated = match &self.model {
            ArmModel::Loaded(model) if model.estimator.is_settled() => model.bound95_um,
            ArmModel::Loaded(model) => {
                out.flags |= flag::MEMORY_UNSETTLED;
                model.bound95_unsettled_um
            }
            _ => [f64::NAN; 3],
        };
        if let ArmModel::Loaded(model) = &self.model
            && !model.estimator.has_weighed()
        {
            out.flags |= flag::LOAD_UNWEIGHED;
        }
        out.status = ArmStatus::Valid as u32;
        out.reset_count = self.reset_count;
        out.hold_cycles = 0;
        out.correction_um = self.correction_um.into();
        out.bound95_um = std::array::from_fn(|axis| stated[axis] + still_missing[axis].abs());
    }

    /// Drops to the raw pose at once; the only step that is announced instead of slewed.
    fn fall_back(&mut self, reasons: u32, limits: &Limits, out: &mut ArmPose) {
        debug_assert!(reasons & FALLBACK_REASONS == reasons);
        let announced = self.valid;
        if self.valid {
            self.reset_count = self.reset_count.wrapping_add(1);
        }
        self.valid = false;
        self.recovering = false;
        self.correction_um = Vector3::zeros();
        self.hold = limits.good_cycles;
        self.hold_flags |= reasons & flag::NEW_SOURCE;
        out.flags &= !(flag::RECOVERING | flag::RATE_LIMITED | flag::SETTLING | flag::MEMORY_UNSETTLED | flag::LOAD_UNWEIGHED);
        self.show_raw(reasons | self.hold_flags, out);
        if announced {
            out.flags |= flag::RESET;
        }
        // Before the first valid answer a reason is still a reason; `starting` means only that nothing is wrong.
        out.status = ArmStatus::Fallback as u32;
    }

    fn show_raw(&self, flags: u32, out: &mut ArmPose) {
        out.status = if self.ever_valid || self.hold_flags != 0 { ArmStatus::Fallback } else { ArmStatus::Starting } as u32;
        out.flags |= flags;
        out.reset_count = self.reset_count;
        out.hold_cycles = self.hold;
        out.correction_um = [0.0; 3];
        out.corrected_position_um = out.raw_position_um;
        out.bound95_um = [f64::NAN; 3];
    }

    fn disconnect(&mut self, limits: &Limits) -> ArmPose {
        let mut flags = 0;
        if self.valid {
            self.reset_count = self.reset_count.wrapping_add(1);
            flags = flag::RESET;
        }
        self.valid = false;
        self.recovering = false;
        self.correction_um = Vector3::zeros();
        self.hold = limits.good_cycles;
        self.frozen.reset();
        self.forget();
        ArmPose { flags, reset_count: self.reset_count, ..ArmPose::ABSENT }
    }
}

fn count(counter: &mut u64) {
    *counter = counter.wrapping_add(1);
}
