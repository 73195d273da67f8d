//! Effects whose size is still open, and what a draw needs to know of the motion.

use crate::arm::Arm;
use crate::effect::Effect;
use crate::run::Signals;
use crate::sensors::Noise;
use crate::severity::{Channel, Place};

/// How a parameter follows the size of the effect.
#[derive(Clone, Copy, Debug)]
pub enum Growth {
    /// `base * size`.
    Times(f64),
    /// `1 + base * size`.
    Factor(f64),
    /// `base / size`.
    Over(f64),
    /// `exp(base * size)`, a factor that never turns negative.
    Power(f64),
}

/// An effect whose size is still open. Size 1 is about severity 1.
#[derive(Clone, Debug)]
pub struct Draft {
    /// Everything but the growing parameters.
    pub effect: Effect,
    /// Parameters (or details) that grow.
    pub growing: Vec<(&'static str, bool, Growth)>,
    /// Largest size that a real robot could have.
    pub largest: f64,
    /// Where it shows.
    pub place: Place,
}

impl Draft {
    /// The effect at a size.
    pub fn sized(&self, size: f64) -> Effect {
        let mut effect = self.effect.clone();
        for &(name, is_parameter, growth) in &self.growing {
            let value = match growth {
                Growth::Times(base) => base * size,
                Growth::Factor(base) => 1.0 + base * size,
                Growth::Over(base) => base / size,
                Growth::Power(base) => (base * size).exp(),
            };
            let into = if is_parameter { &mut effect.parameters } else { &mut effect.details };
            into.insert(name.to_owned(), value);
        }
        effect
    }
}

/// What a draw needs to know of the motion: the simulation's own signals, both runs.
pub struct Scene<'a> {
    /// The arm as it is.
    pub arm: &'a Arm,
    /// Runs without effect.
    pub runs: &'a [Signals],
    /// Noise of the recordings.
    pub noise: &'a Noise,
}

impl Scene<'_> {
    /// Values of one joint's signal over all runs.
    pub(crate) fn over<'s>(&'s self, signal: impl Fn(&'s Signals, usize) -> f64 + 's) -> impl Iterator<Item = f64> + 's {
        let lead = Signals::lead();
        let of_run = move |run: &'s Signals| (lead..run.tip.len()).map(move |k| (run, k));
        self.runs.iter().flat_map(of_run).map(move |(run, k)| signal(run, k))
    }

    pub(crate) fn rms<'s>(&'s self, signal: impl Fn(&'s Signals, usize) -> f64 + 's) -> f64 {
        let (count, sum) = self.over(signal).fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value * value));
        f64::sqrt(sum / f64::max(count, 1.0))
    }

    /// RMS load of a cable, N m or N.
    pub(crate) fn load(&self, j: usize) -> f64 {
        self.rms(|run, k| run.load[k][j])
    }

    /// RMS speed of a joint, rad/s or m/s.
    pub(crate) fn speed(&self, j: usize) -> f64 {
        self.rms(|run, k| run.motor_speed[k][j]) / self.arm.drives[j].ratio
    }

    /// Smallest and largest value.
    pub(crate) fn range<'s>(&'s self, signal: impl Fn(&'s Signals, usize) -> f64 + 's) -> [f64; 2] {
        self.over(signal).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    }

    /// Share of the time in which the cable pulls the rarer way.
    pub fn crossing(&self, j: usize) -> f64 {
        let (count, positive) =
            self.over(|run, k| run.load[k][j]).fold((0.0, 0.0), |(n, p), load| (n + 1.0, p + f64::from(load > 0.0)));
        f64::min(positive / count, 1.0 - positive / count)
    }

    /// Torque noise with the encoders' rattle, joint side.
    pub(crate) fn torque_noise(&self, j: usize) -> f64 {
        1.7 * self.noise.torque_nm * self.arm.drives[j].noise * self.arm.drives[j].ratio
    }

    /// Joint encoder noise.
    pub(crate) fn joint_noise(&self, j: usize) -> f64 {
        self.noise.joint(self.arm.joints[j].motion)
    }
}

pub(crate) fn times(name: &'static str, base: f64) -> (&'static str, bool, Growth) {
    (name, true, Growth::Times(base))
}

pub(crate) fn place(channel: Channel, joint: Option<usize>) -> Place {
    Place { channel, joint, signal: None }
}

pub(crate) fn draft(
    mut effect: Effect,
    growing: Vec<(&'static str, bool, Growth)>,
    largest: f64,
    place: Place,
    extra: &[(&str, f64)],
) -> Draft {
    effect.details.extend(extra.iter().map(|(name, value)| ((*name).to_owned(), *value)));
    Draft { effect, growing, largest, place }
}
