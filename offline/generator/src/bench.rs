//! Brings an effect to the size that is asked for, by playing it with and without.

use crate::draft::draw;
use crate::effect::{ALWAYS, Effect, NEVER};
use crate::order::{Sealed, Wanted};
use crate::random::Random;
use crate::run::{Robot, Signals, play};
use crate::scene::{Draft, Scene};
use crate::sensors::record;
use crate::severity::{Channel, ratio};
use crate::trajectory::Trajectory;

/// Where effects are brought to their size.
pub(crate) struct Bench<'a> {
    /// Exact encoders.
    pub(crate) exact: Robot<'a>,
    /// Commands of the first run.
    pub(crate) trajectory: &'a Trajectory,
    /// What draws need to know.
    pub(crate) scene: Scene<'a>,
    /// First run of a null recording.
    pub(crate) null: &'a Signals,
    /// The same without noise and steps.
    pub(crate) clean: &'a Signals,
    /// Duration of a run, s.
    pub(crate) seconds: f64,
    /// Number of runs.
    pub(crate) runs: usize,
}

impl Bench<'_> {
    /// The effect at its size, at the first joint of a drawn order where that size can be reached.
    pub(crate) fn fit(&self, wanted: &Wanted, random: &mut Random) -> Result<Sealed, String> {
        let size = self.scene.arm.size();
        if let Some(joint) = wanted.joint {
            if !(1..=size).contains(&joint) {
                return Err(format!("joint {joint} of an arm with {size}"));
            }
            return self.fit_at(joint - 1, wanted, random);
        }
        let mut best: Option<Sealed> = None;
        for joint in self.joints_for(&wanted.physics, random) {
            let sealed = self.fit_at(joint, wanted, random)?;
            let reached = sealed.severity >= 0.8 * wanted.severity.unwrap_or(0.0);
            if reached || best.as_ref().is_none_or(|best| sealed.severity > best.severity) {
                best = Some(sealed);
            }
            if reached {
                break;
            }
        }
        best.ok_or_else(|| "an arm without joints".into())
    }

    fn fit_at(&self, joint: usize, wanted: &Wanted, random: &mut Random) -> Result<Sealed, String> {
        let arm = self.scene.arm;
        let mut draft =
            draw(&wanted.physics, joint, &self.scene, random).ok_or_else(|| format!("no physics `{}`", wanted.physics))?;
        draft.effect.interval = wanted.interval.or(draft.effect.interval);
        // A drive's inertia is as it is all the time.
        let lasts = draft.growing.iter().any(|(name, ..)| *name == "rotor_factor");
        if wanted.onset && !lasts && draft.effect.interval.is_none() {
            draft.effect.interval = Some(interval(self.seconds, random));
        }
        if wanted.by_run && self.runs < 2 {
            return Err("an effect by run asks for two runs at least".into());
        }
        if wanted.by_run && !lasts {
            // What is there for a while by its nature is so in each run.
            let is_passing = draft.effect.interval.is_some();
            draft.effect.intervals = intervals(is_passing, self.runs, self.seconds, random);
        }
        if !wanted.intervals.is_empty() {
            if wanted.intervals.len() != self.runs {
                return Err(format!("{} intervals for {} runs", wanted.intervals.len(), self.runs));
            }
            draft.effect.intervals.clone_from(&wanted.intervals);
        }
        if let Some(signal) = &wanted.signal {
            draft.effect.signal = Some(signal.clone());
            draft.place.signal = Some(signal.clone());
        }
        let measure = |effect: &Effect| {
            let effects = &[effect.in_run(effect.first_run())];
            let with = record(&play(&self.exact, effects, self.trajectory), arm, effects, None);
            ratio(&with, self.clean, self.null, self.clean, arm, &draft.place)
        };
        let (effect, (severity, shown_at)) = if wanted.parameters.is_empty() && wanted.details.is_empty() {
            search(&draft, wanted.severity.unwrap_or(1.0), &measure)
        } else {
            let mut effect = draft.sized(1.0);
            effect.parameters.extend(wanted.parameters.clone());
            effect.details.extend(wanted.details.clone());
            let reached = measure(&effect);
            (effect, reached)
        };
        let joint_name = |joint: usize| arm.joints[joint].name.clone();
        Ok(Sealed {
            joint_name: effect.joint.map(|joint| joint_name(joint - 1)),
            shown_at: matches!(draft.place.channel, Channel::JointTorque | Channel::Transmission).then(|| joint_name(shown_at)),
            units: crate::units::of(&effect, arm),
            channel: draft.place.channel,
            severity_wanted: wanted.severity,
            severity,
            effect,
        })
    }

    /// Joints to try, in random order; play needs a load that changes sign.
    fn joints_for(&self, physics: &str, random: &mut Random) -> Vec<usize> {
        let mut joints: Vec<usize> = (0..self.scene.arm.size()).collect();
        for last in (1..joints.len()).rev() {
            joints.swap(last, random.index(last + 1));
        }
        if physics == "backlash" {
            let crossing = |j: usize| self.scene.crossing(j).min(0.1);
            joints.sort_by(|&a, &b| crossing(b).total_cmp(&crossing(a)));
            joints.truncate(1 + joints.iter().skip(1).filter(|&&j| crossing(j) >= 0.1).count());
        }
        joints
    }
}

/// Finds the size at which the severity is the wanted one.
fn search(draft: &Draft, wanted: f64, measure: &dyn Fn(&Effect) -> (f64, usize)) -> (Effect, (f64, usize)) {
    let mut size = wanted.min(draft.largest);
    let mut best: Option<(f64, Effect, (f64, usize))> = None;
    for _ in 0..6 {
        let effect = draft.sized(size);
        let reached = measure(&effect);
        let miss = (reached.0.max(1e-9) / wanted).ln().abs();
        if best.as_ref().is_none_or(|(least, ..)| miss < *least) {
            best = Some((miss, effect, reached));
        }
        if miss < 0.1 || (size >= draft.largest && reached.0 < wanted) {
            break;
        }
        size = (size * (wanted / reached.0.max(1e-9)).clamp(0.02, 20.0)).min(draft.largest);
    }
    best.map_or_else(|| (draft.sized(size), (0.0, 0)), |(_, effect, reached)| (effect, reached))
}

/// One interval for each run: another one in each; in the last run only; in all but the last; or in whole runs and not in others.
fn intervals(is_passing: bool, runs: usize, seconds: f64, random: &mut Random) -> Vec<[f64; 2]> {
    let last = runs - 1;
    match random.index(if is_passing { 3 } else { 4 }) {
        0 => (0..runs).map(|_| interval(seconds, random)).collect(),
        1 => (0..runs).map(|run| if run == last { interval(seconds, random) } else { NEVER }).collect(),
        2 => (0..runs).map(|run| if run == last { NEVER } else { interval(seconds, random) }).collect(),
        _ => {
            let (there, absent) = (random.index(runs), 1 + random.index(last.max(1)));
            let absent = (there + absent) % runs;
            let is_there = |run| run == there || (run != absent && random.index(2) == 0);
            (0..runs).map(is_there).map(|is_there| if is_there { ALWAYS } else { NEVER }).collect()
        }
    }
}

/// Comes, goes, or both, with at least a fifth of the run on either side of each edge.
fn interval(seconds: f64, random: &mut Random) -> [f64; 2] {
    let on = random.uniform(0.25, 0.5) * seconds;
    let off = random.uniform(0.65, 0.8) * seconds;
    match random.index(3) {
        0 => [on, 10.0 * seconds],
        1 => [-10.0 * seconds, random.uniform(0.4, 0.75) * seconds],
        _ => [on, off],
    }
}
