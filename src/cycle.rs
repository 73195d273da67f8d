//! One period of the service as a function of (state, messages, time).
//!
//! No clock, no shared memory, no allocation here: the simulator in `tests/` runs hours of faults through it from a seed. The rules
//! are those of `docs/flags.md`: anything doubtful yields the raw pose with correction zero in the same cycle and a flag that says
//! why; the correction comes back after 100 good cycles in a row, slewed.

use crate::correction::{ArmModel, Corrector, Estimator, Judgement, Pace, Quantity};
use crate::frozen::{DEGRADED_AFTER, FROZEN_AFTER, FrozenWatch};
use nalgebra::{Matrix3, Rotation3, Vector3};
use ravenpose_wire::{
    AHEAD_MAX_NS, ARMS, ArmPose, ArmStatus, CorrectedPose, FALLBACK_REASONS, FEATURES, RavenState, features, flag,
};

/// Models: of the position and of the orientation of each arm.
const PLACES: usize = 2 * ARMS;
/// Of so many pieces of a model that are kept warm one is the features and the guard, the others are of its weights.
const WARM_ROUNDS: usize = 16;
/// A larger gap in the sequence is a restart of the source, not a loss.
const GAP_MAX: u64 = 10_000;

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
    /// How corrections of the position move, µm.
    pub position: Pace,
    /// How those of the orientation move, degrees.
    pub orientation: Pace,
    /// Late answers in a row that reduce trust.
    pub late_degraded: u32,
    /// Late answers in a row that end it.
    pub late_fallback: u32,
}

impl Limits {
    /// Age of the state of a message, ns, at which its readers may no longer use it before they have the next one: [`Limits::stale_ns`] less the
    /// way to them.
    fn outlived_ns(&self) -> i64 {
        self.stale_ns - (self.stale_ns - self.period_ns) / 16
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            period_ns: 1_000_000,
            stale_ns: 5_000_000,
            budget_ns: 500_000,
            good_cycles: 100,
            position: Pace { recover: 10.0, rate: 100.0, envelope: 15_000.0 },
            orientation: Pace { recover: 0.02, rate: 0.2, envelope: 30.0 },
            late_degraded: 3,
            late_fallback: 10,
        }
    }
}

/// What an arm is corrected with.
pub struct ArmModels<E> {
    /// Where its tip is. Without it nothing is corrected.
    pub position: ArmModel<E>,
    /// How its tip is turned; [`ArmModel::None`] passes the orientation through.
    pub orientation: ArmModel<E>,
}

impl<E> From<ArmModel<E>> for ArmModels<E> {
    /// The position alone.
    fn from(position: ArmModel<E>) -> Self {
        Self { position, orientation: ArmModel::None }
    }
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
    position: Corrector<E>,
    orientation: Corrector<E>,
    frozen: FrozenWatch,
    /// Did the newest judged state show encoders that stand still?
    is_frozen: bool,
    hold: u32,
    /// Why the hold began, kept while it lasts.
    hold_flags: u32,
    valid: bool,
    /// Was the last message of it valid? An answer that falls back before it is sent was not.
    shown_valid: bool,
    /// Source time of that message, ns.
    shown_ns: i64,
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
    pub fn new(limits: Limits, models: [impl Into<ArmModels<E>>; ARMS], allow_untrained: bool, standing_flags: u32) -> Self {
        let arms = models.map(Into::into).map(|models| Arm {
            position: Corrector::new(Quantity::Position, models.position),
            orientation: Corrector::new(Quantity::Orientation, models.orientation),
            frozen: FrozenWatch::default(),
            is_frozen: false,
            hold: limits.good_cycles,
            hold_flags: 0,
            valid: false,
            shown_valid: false,
            shown_ns: 0,
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
        if state.admit().is_err() || !(0..=now_ns.saturating_add(AHEAD_MAX_NS)).contains(&state.source_time_ns) {
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

    /// While nothing has arrived: keeps warm what answers the connected arms, one piece of one model per call. Changes no answer. Returns
    /// whether that completes a round: so many pieces of each.
    pub fn keep_warm(&mut self) -> bool {
        let mut completes = false;
        for _ in 0..PLACES {
            let (round, place) = (self.warm / PLACES, self.warm % PLACES);
            self.warm = (self.warm + 1) % (PLACES * WARM_ROUNDS);
            completes |= self.warm == 0;
            if self.warm_place(round, place) {
                break;
            }
        }
        completes
    }

    /// One piece of what answers a place; `false` where nothing does.
    fn warm_place(&mut self, round: usize, place: usize) -> bool {
        let index = place % ARMS;
        let arm = &mut self.arms[index];
        let corrector = if place < ARMS { &mut arm.position } else { &mut arm.orientation };
        let Some(model) = corrector.loaded_mut() else { return false };
        if self.newest.connected() & (1 << index) == 0 {
            return false;
        }
        if round == 0 {
            features::extract(&self.newest, index, &mut self.features);
            // The verdict was given when the state came; what counts is that its code and ranges are read.
            std::hint::black_box(model.guard.check(&self.features));
        } else {
            model.estimator.keep_warm();
        }
        true
    }

    fn begin_source(&mut self) {
        count(&mut self.counters.sources);
        self.new_source = true;
    }

    /// A state that a newer one overtakes is not answered, but where the joints and encoders were is remembered.
    fn remember_overtaken(&mut self) {
        for (index, arm) in self.arms.iter_mut().enumerate() {
            if self.newest.connected() & (1 << index) == 0 {
                arm.forget();
                continue;
            }
            arm.watch_encoders(&self.newest, index);
            if !arm.position.remembers() && !arm.orientation.remembers() {
                continue;
            }
            features::extract(&self.newest, index, &mut self.features);
            for corrector in [&mut arm.position, &mut arm.orientation] {
                corrector.remember(&self.newest, &self.features, arm.is_frozen);
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
                Judgement { reasons: common | reasons, information, score: -1.0 }
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
                arm.shown_valid = false;
                continue;
            }
            if took_ns > self.limits.budget_ns {
                out.flags |= flag::LATE;
                if self.late_in_row >= self.limits.late_degraded {
                    out.flags |= flag::DEGRADED;
                }
            }
            // Whoever holds the last message has gone back to the raw pose by himself: what he sees next is a step.
            let outlived = arm.shown_valid && now_ns.saturating_sub(arm.shown_ns) >= self.limits.outlived_ns();
            let reasons = if outlived { reasons | flag::INPUT_STALE } else { reasons };
            if reasons != 0 {
                arm.fall_back(reasons, &self.limits, out);
            }
            (arm.shown_valid, arm.shown_ns) = (out.status == ArmStatus::Valid as u32, pose.source_time_ns);
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

impl<E: Estimator> Arm<E> {
    fn forget(&mut self) {
        self.position.forget();
        self.orientation.forget();
    }

    /// Reasons and information that hold whatever the state is: those of the models.
    fn standing(&self, allow_untrained: bool) -> (u32, u32) {
        let (position, orientation) = (self.position.standing(allow_untrained), self.orientation.standing(allow_untrained));
        (position.0 | orientation.0, position.1 | orientation.1)
    }

    /// For how many cycles an encoder has stood still although its motor moves.
    fn watch_encoders(&mut self, state: &RavenState, index: usize) -> u32 {
        let still = self.frozen.observe(state, index);
        self.is_frozen = still >= FROZEN_AFTER;
        if self.is_frozen {
            // What was followed since the encoders froze did not move either: the way since then is unseen, however short the rest of it.
            self.forget();
        }
        still
    }

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
        let mut judged = Judgement { reasons: common | reasons, information, score: -1.0 };
        match self.watch_encoders(state, index) {
            FROZEN_AFTER.. => judged.reasons |= flag::INPUT_FROZEN,
            DEGRADED_AFTER.. => judged.information |= flag::DEGRADED,
            _ => {}
        }
        self.position.admit(state, index, features, &mut judged);
        self.orientation.admit(state, index, features, &mut judged);
        if judged.reasons == 0 {
            self.position.answer(features, &limits.position, &mut judged);
            self.orientation.answer(features, &limits.orientation, &mut judged);
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
        out.model_id = self.position.id();
        out.orientation_model_id = self.orientation.id();
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
        self.correct(limits, out);
        out.corrected_position_um = (raw + self.position.correction()).into();
    }

    /// Moves the corrections towards the networks' answers, no faster than allowed.
    fn correct(&mut self, limits: &Limits, out: &mut ArmPose) {
        if !self.valid {
            self.valid = true;
            self.ever_valid = true;
            self.hold_flags = 0;
            self.position.begin();
            self.orientation.begin();
        }
        out.flags |= self.position.approach(&limits.position) | self.orientation.approach(&limits.orientation);
        let (position, orientation) = (self.position.bound95(), self.orientation.bound95());
        out.flags |= position.1 | orientation.1;
        out.status = ArmStatus::Valid as u32;
        out.reset_count = self.reset_count;
        out.hold_cycles = 0;
        out.correction_um = (*self.position.correction()).into();
        out.bound95_um = position.0;
        out.rotation_deg = (*self.orientation.correction()).into();
        out.rotation_bound95_deg = orientation.0;
        out.corrected_orientation = turned(&out.orientation, self.orientation.correction());
    }

    /// Drops to the raw pose at once; the only step that is announced instead of slewed.
    fn fall_back(&mut self, reasons: u32, limits: &Limits, out: &mut ArmPose) {
        debug_assert!(reasons & FALLBACK_REASONS == reasons);
        let announced = self.drop_if_shown();
        self.drop_to_zero();
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

    /// Ends what was valid, and counts the step that this is for whoever read the last message.
    fn drop_if_shown(&mut self) -> bool {
        let is_step = std::mem::take(&mut self.valid) && self.shown_valid;
        self.reset_count = self.reset_count.wrapping_add(u32::from(is_step));
        is_step
    }

    fn drop_to_zero(&mut self) {
        self.position.drop_to_zero();
        self.orientation.drop_to_zero();
    }

    fn show_raw(&self, flags: u32, out: &mut ArmPose) {
        out.status = if self.ever_valid || self.hold_flags != 0 { ArmStatus::Fallback } else { ArmStatus::Starting } as u32;
        out.flags |= flags;
        out.reset_count = self.reset_count;
        out.hold_cycles = self.hold;
        out.correction_um = [0.0; 3];
        out.corrected_position_um = out.raw_position_um;
        out.bound95_um = [f64::NAN; 3];
        out.rotation_deg = [0.0; 3];
        out.corrected_orientation = out.orientation;
        out.rotation_bound95_deg = [f64::NAN; 3];
    }

    fn disconnect(&mut self, limits: &Limits) -> ArmPose {
        let flags = if self.drop_if_shown() { flag::RESET } else { 0 };
        self.drop_to_zero();
        self.hold = limits.good_cycles;
        self.frozen.reset();
        self.forget();
        ArmPose { flags, reset_count: self.reset_count, ..ArmPose::ABSENT }
    }
}

fn count(counter: &mut u64) {
    *counter = counter.wrapping_add(1);
}

/// exp(rotation) · orientation, row-major; bit for bit the same where the rotation, degrees, is zero.
fn turned(orientation: &[f32; 9], rotation_deg: &Vector3<f64>) -> [f32; 9] {
    if *rotation_deg == Vector3::zeros() {
        return *orientation;
    }
    let by = Rotation3::new(rotation_deg.map(f64::to_radians));
    let turned = by * Matrix3::from_fn(|row, column| f64::from(orientation[3 * row + column]));
    std::array::from_fn(|place| turned[(place / 3, place % 3)] as f32)
}
