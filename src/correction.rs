//! What one model does for one arm: may it be asked in this state, what does it answer, and how far the correction has followed that.
//!
//! The same for the tip's position and for its orientation. Numbers are in the unit of the message: µm, and degrees of a rotation vector
//! in the axes of frame 0.

use crate::guard::{Allowed, Guard};
use crate::memory::may_follow;
use nalgebra::Vector3;
use ravenpose_wire::{FEATURES, RavenState, flag};

/// What of the tip a model corrects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// Where it is: the network answers in mm, messages are in µm.
    #[default]
    Position,
    /// How it is turned: the network and messages have degrees.
    Orientation,
}

impl Quantity {
    /// Their names.
    pub const NAMES: [&str; 2] = ["position", "orientation"];

    /// `position`.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Of a name; none for another word.
    pub fn of_name(name: &str) -> Option<Self> {
        [Self::Position, Self::Orientation].into_iter().find(|quantity| quantity.name() == name)
    }

    /// Of the network's unit in the message's.
    pub const fn per_output(self) -> f64 {
        match self {
            Self::Position => 1000.0,
            Self::Orientation => 1.0,
        }
    }

    /// The network's unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Position => "mm",
            Self::Orientation => "deg",
        }
    }

    /// A thousandth of it.
    pub const fn thousandth(self) -> &'static str {
        match self {
            Self::Position => "um",
            Self::Orientation => "mdeg",
        }
    }

    /// Key of the configuration: how far smaller weights may be off, in thousandths.
    pub const fn deviation_key(self) -> &'static str {
        match self {
            Self::Position => "weights_deviation_um",
            Self::Orientation => "weights_deviation_mdeg",
        }
    }
}

/// How fast a correction may move and how long it may be, in the unit of the message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Largest change per cycle while it comes back from zero.
    pub recover: f64,
    /// Largest change per cycle after that.
    pub rate: f64,
    /// Longest correction that is believed (Euclidean).
    pub envelope: f64,
}

/// What evaluates the network: 118 features to the error of a position in mm, or of an orientation in degrees. Nothing here may allocate,
/// block or panic.
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

    /// How far the motors' friction is from what this was trained with: above 1 it is beyond. None where it does not matter.
    fn friction_score(&self) -> Option<f32> {
        None
    }

    /// Has it seen enough motion to tell? Until then a load may be there.
    fn has_weighed(&self) -> bool {
        true
    }

    /// Evaluates the features that it followed last; where it followed none, as one that has seen these alone.
    fn run(&mut self, features: &[f32; FEATURES], error: &mut [f32; 3]);

    /// Does a microsecond's worth of what makes the next run fast; changes no result.
    fn keep_warm(&mut self) {}
}

/// A model as the cycle uses it.
#[derive(Clone)]
pub struct Model<E> {
    /// The network.
    pub estimator: E,
    /// Admission of its inputs.
    pub guard: Guard,
    /// The states that it may be used with at all.
    pub allowed: Allowed,
    /// First eight bytes of the file's SHA-256.
    pub id: u64,
    /// Longest correction that the model stands for (Euclidean).
    pub bound: f64,
    /// Stated 95 % half width per axis; NaN if it states none.
    pub bound95: [f64; 3],
    /// The same while the estimator is not settled.
    pub bound95_unsettled: [f64; 3],
    /// Marked untrained?
    pub untrained: bool,
}

/// What a quantity of an arm is corrected with.
pub enum ArmModel<E> {
    /// Nothing is configured.
    None,
    /// The configured model was refused and the configuration allows to go on.
    Rejected,
    /// A loaded model.
    Loaded(Box<Model<E>>),
}

/// What one arm's inputs and outputs came to, before the history is considered.
pub(crate) struct Judgement {
    pub(crate) reasons: u32,
    pub(crate) information: u32,
    pub(crate) score: f32,
}

/// A model and the correction that follows its answers.
pub(crate) struct Corrector<E> {
    quantity: Quantity,
    model: ArmModel<E>,
    /// What the network said of the state that was judged last.
    target: Vector3<f64>,
    correction: Vector3<f64>,
    /// On its way back from zero?
    recovering: bool,
}

impl<E: Estimator> Corrector<E> {
    pub(crate) fn new(quantity: Quantity, model: ArmModel<E>) -> Self {
        Self { quantity, model, target: Vector3::zeros(), correction: Vector3::zeros(), recovering: false }
    }

    /// What is to be added.
    pub(crate) fn correction(&self) -> &Vector3<f64> {
        &self.correction
    }

    /// Nothing is to be added from now on.
    pub(crate) fn drop_to_zero(&mut self) {
        self.correction = Vector3::zeros();
        self.recovering = false;
    }

    /// Corrections begin: from zero.
    pub(crate) fn begin(&mut self) {
        self.recovering = true;
    }

    fn loaded(&self) -> Option<&Model<E>> {
        match &self.model {
            ArmModel::Loaded(model) => Some(model),
            _ => None,
        }
    }

    pub(crate) fn loaded_mut(&mut self) -> Option<&mut Model<E>> {
        match &mut self.model {
            ArmModel::Loaded(model) => Some(model),
            _ => None,
        }
    }

    /// First eight bytes of the model's hash; 0 without one.
    pub(crate) fn id(&self) -> u64 {
        self.loaded().map_or(0, |model| model.id)
    }

    /// Reasons and information that hold whatever the state is: those of the model.
    pub(crate) fn standing(&self, allow_untrained: bool) -> (u32, u32) {
        match &self.model {
            ArmModel::None if self.quantity == Quantity::Position => (flag::NO_MODEL, 0),
            ArmModel::None => (0, 0),
            ArmModel::Rejected => (flag::MODEL_REJECTED, 0),
            ArmModel::Loaded(model) if !model.untrained => (0, 0),
            ArmModel::Loaded(_) if allow_untrained => (0, flag::UNTRAINED_ALLOWED),
            ArmModel::Loaded(_) => (flag::UNTRAINED, 0),
        }
    }

    /// May the model be asked in this state? The estimator follows what can be followed, asked or not.
    #[expect(clippy::neg_cmp_op_on_partial_ord, reason = "written so that NaN fails")]
    pub(crate) fn admit(&mut self, state: &RavenState, index: usize, features: &[f32; FEATURES], judged: &mut Judgement) {
        let Some(model) = self.loaded_mut() else { return };
        let verdict = model.guard.check(features);
        judged.reasons |= verdict.reasons;
        judged.score = judged.score.max(verdict.score);
        let allowed = model.allowed.allows(state, index);
        if !allowed {
            judged.reasons |= flag::STATE_NOT_ALLOWED;
        }
        if !may_follow(judged.reasons) {
            return;
        }
        model.estimator.follow(features, state.source_time_ns);
        if allowed && verdict.reasons == 0 {
            model.estimator.weigh(features, state.source_time_ns);
        }
        let torque = [(model.estimator.load_score(), flag::UNSEEN_LOAD), (model.estimator.friction_score(), flag::UNSEEN_FRICTION)];
        for (score, unseen) in torque.into_iter().filter_map(|(score, unseen)| Some((score?, unseen))) {
            judged.score = judged.score.max(score);
            if !(score <= 1.0) {
                judged.reasons |= flag::OUT_OF_DOMAIN;
                judged.information |= unseen;
            }
        }
    }

    /// Asks the model about a state that was admitted.
    #[expect(clippy::neg_cmp_op_on_partial_ord, reason = "written so that NaN fails")]
    pub(crate) fn answer(&mut self, features: &[f32; FEATURES], pace: &Pace, judged: &mut Judgement) {
        let per_output = self.quantity.per_output();
        let Some(model) = self.loaded_mut() else { return };
        let mut error = [0.0_f32; 3];
        model.estimator.run(features, &mut error);
        let target = Vector3::from(error.map(f64::from)) * per_output;
        if !error.iter().all(|value| value.is_finite()) {
            judged.reasons |= flag::OUTPUT_NOT_FINITE;
        } else if !(target.norm() <= model.bound.min(pace.envelope)) {
            judged.reasons |= flag::OUTPUT_BEYOND_BOUND;
        }
        self.target = target;
    }

    /// Moves the correction towards the model's answer, no faster than allowed. What to know of that.
    pub(crate) fn approach(&mut self, pace: &Pace) -> u32 {
        let (step_max, held_back) =
            if self.recovering { (pace.recover, flag::RECOVERING) } else { (pace.rate, flag::RATE_LIMITED) };
        let missing = self.target - self.correction;
        let distance = missing.norm();
        if distance <= step_max {
            self.correction = self.target;
            self.recovering = false;
            return 0;
        }
        self.correction += missing * (step_max / distance);
        held_back
    }

    /// The stated 95 % half widths, wider by what the correction still misses; NaN where none is stated. And what else to know of it.
    pub(crate) fn bound95(&self) -> ([f64; 3], u32) {
        let Some(model) = self.loaded() else { return ([f64::NAN; 3], 0) };
        let mut information = 0;
        let mut stated = model.bound95;
        if !model.estimator.is_settled() {
            information |= flag::MEMORY_UNSETTLED;
            stated = model.bound95_unsettled;
        }
        if !model.estimator.has_weighed() {
            information |= flag::LOAD_UNWEIGHED;
        }
        let missing = self.target - self.correction;
        (std::array::from_fn(|axis| stated[axis] + missing[axis].abs()), information)
    }

    /// A state that was overtaken: not answered, but where the joints were is remembered.
    pub(crate) fn remember(&mut self, state: &RavenState, features: &[f32; FEATURES], is_frozen: bool) {
        let Some(model) = self.loaded_mut() else { return };
        if model.estimator.remembers() && !is_frozen && may_follow(model.guard.check(features).reasons) {
            model.estimator.follow(features, state.source_time_ns);
        }
    }

    /// Does the estimator's answer depend on the states before?
    pub(crate) fn remembers(&self) -> bool {
        self.loaded().is_some_and(|model| model.estimator.remembers())
    }

    /// What the estimator remembers is of another source, or of before a disconnection.
    pub(crate) fn forget(&mut self) {
        if let Some(model) = self.loaded_mut() {
            model.estimator.forget();
        }
    }
}
