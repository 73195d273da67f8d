//! One case: what is asked for, how its files are made, what is sealed.

use crate::draft::{Draft, Scene, draw};
use crate::effect::Effect;
use crate::random::Random;
use crate::robots::{self, Pair};
use crate::run::{Robot, Signals, play};
use crate::sensors::{Noise, record};
use crate::severity::{Channel, ratio};
use crate::trajectory::{self, Excitation, Trajectory};
use crate::{seal, table, urdf};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// An effect that is asked for.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wanted {
    /// Name of the vocabulary, or `outside:NAME`.
    pub physics: String,
    /// Joint counted from 1; drawn where the physics can show if absent.
    pub joint: Option<usize>,
    /// Wanted severity; ignored where parameters are given.
    pub severity: Option<f64>,
    /// Exact parameters instead of drawn ones.
    pub parameters: BTreeMap<String, f64>,
    /// Further exact values by the generator's own names.
    pub details: BTreeMap<String, f64>,
    /// Delayed signal.
    pub signal: Option<String>,
    /// Exact interval, s.
    pub interval: Option<[f64; 2]>,
    /// The effect comes or goes inside the runs, at drawn times.
    pub onset: bool,
}

/// Arm of a case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The arm of data/gap-examples.
    #[default]
    Raven,
    /// Any other, drawn at random.
    Variant,
}

/// A case that is asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Order {
    /// Everything random follows from it and `label`.
    pub seed: u64,
    /// Tells cases of one seed apart.
    pub label: String,
    /// Block of the matrix.
    pub block: String,
    /// None for a null case.
    pub effects: Vec<Wanted>,
    /// Noise of the examples times this.
    pub noise: f64,
    /// What the operator does.
    pub excitation: Excitation,
    /// Which arm.
    pub robot: Kind,
    /// Duration of a run, s.
    pub seconds: f64,
    /// Number of runs.
    pub runs: usize,
}

impl Default for Order {
    fn default() -> Self {
        Self {
            seed: 0,
            label: String::new(),
            block: "single".into(),
            effects: Vec::new(),
            noise: 1.0,
            excitation: Excitation::Teleoperation,
            robot: Kind::Raven,
            seconds: 12.0,
            runs: 2,
        }
    }
}

/// A sealed effect.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sealed {
    /// What it is.
    #[serde(flatten)]
    pub effect: Effect,
    /// Name of the joint in the URDF.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_name: Option<String>,
    /// Joint at which its severity was measured, for channels that have joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shown_at: Option<String>,
    /// Unit of every parameter.
    pub units: BTreeMap<String, String>,
    /// Channel in which its severity was measured.
    pub channel: Channel,
    /// Severity that was asked for.
    pub severity_wanted: Option<f64>,
    /// Severity that was reached, on the first run.
    pub severity: f64,
}

/// A sealed truth.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Truth {
    /// Form of this file.
    pub schema: String,
    /// Identifier of the case.
    pub case: String,
    /// Block of the matrix.
    pub block: String,
    /// Empty for a null case.
    pub effects: Vec<Sealed>,
    /// Severity that was asked for; 0 for a null case.
    pub severity: f64,
    /// Noise of the examples times this.
    pub noise: f64,
    /// Seed of the set.
    pub seed: u64,
    /// Kind of commands.
    pub excitation: Excitation,
    /// Kind of arm.
    pub robot: Kind,
    /// Joint names, from the base outward.
    pub joints: Vec<String>,
    /// `smooth` or `bristle`.
    pub dry_law: String,
    /// SHA-256 of every file of the case.
    pub files: BTreeMap<String, String>,
    /// Keeps the hash from being guessed.
    pub salt: String,
}

/// A finished case in memory.
pub struct Case {
    /// What happened.
    pub truth: Truth,
    /// Name and bytes of every file.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl Order {
    /// Opaque identifier: twelve hexadecimal digits.
    pub fn id(&self) -> String {
        self.random("id").hex(6)
    }

    fn random(&self, purpose: &str) -> Random {
        Random::new(self.seed, &format!("{}/{purpose}", self.label))
    }

    fn pair(&self) -> Pair {
        let mut random = self.random("robot");
        match self.robot {
            Kind::Raven => robots::raven(&mut random),
            Kind::Variant => robots::variant(&mut random),
        }
    }

    /// Plays the case.
    pub fn make(&self) -> Result<Case, String> {
        let pair = self.pair();
        let noise = Noise::scaled(self.noise);
        let trajectories: Vec<Trajectory> = (0..self.runs)
            .map(|run| trajectory::draw(&pair.truth, self.seconds, self.excitation, &mut self.random(&format!("run {run}"))))
            .collect();
        let robot = |stepped| Robot { truth: &pair.truth, model: &pair.model, stepped };
        let sims: Vec<Signals> = trajectories.iter().map(|trajectory| play(&robot(false), &[], trajectory)).collect();
        let (exact, stepped) = (robot(false), robot(true));
        let bench = Bench { order: self, exact, trajectory: &trajectories[0], scene: Scene { arm: &pair.truth, runs: &sims, noise: &noise } };
        let null = record(&play(&stepped, &[], &trajectories[0]), &pair.truth, &[], Some((&noise, &mut self.random("noise 0"))));
        let clean = record(&sims[0], &pair.truth, &[], None);
        let effects: Vec<Sealed> = self
            .effects
            .iter()
            .enumerate()
            .map(|(index, wanted)| bench.fit(wanted, &null, &clean, &mut self.random(&format!("effect {index}"))))
            .collect::<Result<_, _>>()?;
        let plain: Vec<Effect> = effects.iter().map(|sealed| sealed.effect.clone()).collect();

        let mut files = BTreeMap::from([("robot.urdf".to_owned(), urdf::text(&pair.model).into_bytes())]);
        for (run, trajectory) in trajectories.iter().enumerate() {
            let seen = record(&play(&stepped, &plain, trajectory), &pair.truth, &plain, Some((&noise, &mut self.random(&format!("noise {run}")))));
            let sim = record(&sims[run], &pair.truth, &[], None);
            let write = |signals, recording| table::csv_gz(signals, &pair.model, recording).map_err(|error| error.to_string());
            files.insert(format!("real_{}.csv.gz", run + 1), write(&seen, true)?);
            files.insert(format!("sim_{}.csv.gz", run + 1), write(&sim, false)?);
        }
        let truth = Truth {
            schema: "ravenpose-truth-1".into(),
            case: self.id(),
            block: self.block.clone(),
            severity: self.effects.iter().filter_map(|wanted| wanted.severity).fold(0.0, f64::max),
            effects,
            noise: self.noise,
            seed: self.seed,
            excitation: self.excitation,
            robot: self.robot,
            joints: pair.model.joints.iter().map(|joint| joint.name.clone()).collect(),
            dry_law: match pair.truth.dry_law {
                crate::arm::DryLaw::Smooth(_) => "smooth".into(),
                crate::arm::DryLaw::Bristle(_) => "bristle".into(),
            },
            files: files.iter().map(|(name, bytes)| (name.clone(), seal::sha256(bytes))).collect(),
            salt: self.random("salt").hex(16),
        };
        Ok(Case { truth, files })
    }

    /// True if the case stands whole under `out`.
    pub fn is_done(&self, out: &Path) -> bool {
        let id = self.id();
        out.join("cases").join(&id).is_dir() && out.join("sealed").join(format!("{id}.json")).is_file()
    }

    /// Plays the case and writes it under `out`: the truth first, so that no case ever stands without one.
    pub fn write(&self, out: &Path) -> Result<(), String> {
        let case = self.make()?;
        let trouble = |error: std::io::Error| error.to_string();
        let id = &case.truth.case;
        let (folder, part) = (out.join("cases").join(id), out.join("cases").join(format!(".{id}.part")));
        std::fs::create_dir_all(&part).map_err(trouble)?;
        for (name, bytes) in &case.files {
            seal::write_undated(&part.join(name), bytes).map_err(trouble)?;
        }
        let sealed = out.join("sealed");
        std::fs::create_dir_all(&sealed).map_err(trouble)?;
        seal::write_whole(&sealed.join(format!("{id}.json")), seal::canonical(&case.truth).as_bytes()).map_err(trouble)?;
        if folder.exists() {
            std::fs::remove_dir_all(&folder).map_err(trouble)?;
        }
        std::fs::rename(&part, &folder).map_err(trouble)
    }
}

/// Where effects are brought to their size.
struct Bench<'a> {
    order: &'a Order,
    exact: Robot<'a>,
    trajectory: &'a Trajectory,
    scene: Scene<'a>,
}

impl Bench<'_> {
    /// The effect at its size, at the first joint of a drawn order where that size can be reached.
    fn fit(&self, wanted: &Wanted, null: &Signals, clean: &Signals, random: &mut Random) -> Result<Sealed, String> {
        let size = self.scene.arm.size();
        if let Some(joint) = wanted.joint {
            if !(1..=size).contains(&joint) {
                return Err(format!("joint {joint} of an arm with {size}"));
            }
            return self.fit_at(joint - 1, wanted, null, clean, random);
        }
        let mut best: Option<Sealed> = None;
        for joint in self.joints_for(&wanted.physics, random) {
            let sealed = self.fit_at(joint, wanted, null, clean, random)?;
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

    fn fit_at(&self, joint: usize, wanted: &Wanted, null: &Signals, clean: &Signals, random: &mut Random) -> Result<Sealed, String> {
        let arm = self.scene.arm;
        let mut draft = draw(&wanted.physics, joint, &self.scene, random).ok_or_else(|| format!("no physics `{}`", wanted.physics))?;
        draft.effect.interval = wanted.interval.or(draft.effect.interval);
        if wanted.onset && draft.effect.interval.is_none() {
            draft.effect.interval = Some(interval(self.order.seconds, random));
        }
        if let Some(signal) = &wanted.signal {
            draft.effect.signal = Some(signal.clone());
            draft.place.signal = Some(signal.clone());
        }
        let measure = |effect: &Effect| {
            let effects = std::slice::from_ref(effect);
            let with = record(&play(&self.exact, effects, self.trajectory), arm, effects, None);
            ratio(&with, clean, null, clean, arm, &draft.place)
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
