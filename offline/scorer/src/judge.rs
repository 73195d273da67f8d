//! One report against one truth.

use crate::report::{Report, Verdict};
use crate::truth::{Effect, Truth};
use crate::vocabulary::{Measure, measures};
use serde::Serialize;

/// How a parameter was met.
#[derive(Clone, Debug, Serialize)]
pub struct Parameter {
    /// Its name, or the names of a vector.
    pub name: String,
    /// Distance from the truth relative to its size.
    pub error: f64,
    /// The stated interval holds the truth; for a vector, in all parts.
    pub covered: bool,
    /// The tool itself called it not identifiable.
    pub disowned: bool,
}

/// A primary verdict with its stated probability, for calibration.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Claim {
    /// As stated.
    pub probability: f64,
    /// As it turned out.
    pub right: bool,
}

/// What one case says about the tool.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Identifier.
    pub case: String,
    /// Block of the matrix.
    pub block: String,
    /// Severity it counts under; 0 for a null case.
    pub level: f64,
    /// Noise scale.
    pub noise: f64,
    /// Kind of arm.
    pub robot: String,
    /// Law of dry friction.
    pub dry_law: String,
    /// Row of the confusion matrix; of a pair, both names.
    pub truth: Vec<String>,
    /// First name, `none`, `unmodelled`, or `no report`.
    pub answer: String,
    /// Status of the report.
    pub status: String,
    /// A mismatch was seen.
    pub detected: bool,
    /// First name right.
    pub top: bool,
    /// First name right and no further one named than there are effects.
    pub alone: bool,
    /// Truth within the first set.
    pub in_set: bool,
    /// Names in the first set.
    pub set_size: usize,
    /// Joint of the first verdict right; none for effects that have no joint.
    pub joint: Option<bool>,
    /// Share of a pair's names found in distinct first places, 0, 1 or 2.
    pub named: usize,
    /// Share of a pair's names found in distinct sets.
    pub named_in_set: usize,
    /// Parameters, where name and joint are right.
    pub parameters: Vec<Parameter>,
    /// Share of the mismatch removed on held-out data, where the name is right.
    pub removed: Option<f64>,
    /// Overlap of the stated with the true stretch of time, for effects that come or go and are rightly named.
    pub overlap: Option<f64>,
    /// Stated probabilities.
    pub claims: Vec<Claim>,
    /// Time the tool says it took, s.
    pub seconds: Option<f64>,
}

/// Answer and status of a case without a report.
pub const NO_REPORT: &str = "no report";

/// Judges a case; no report counts as the answer [`NO_REPORT`].
pub fn judge(truth: &Truth, report: Option<&Report>) -> Judged {
    let silent = Report::default();
    let answered = report.unwrap_or(&silent);
    let primaries = answered.primaries();
    let first = primaries.first().copied();
    let answer = match (report, first) {
        (None, _) => NO_REPORT,
        (_, Some(verdict)) => verdict.physics.as_str(),
        // That there are too few data is not that there is nothing.
        (Some(report), None) if report.status == "insufficient_data" => "insufficient_data",
        (_, None) => "none",
    };
    let named: Vec<&Verdict> =
        primaries.iter().copied().filter(|verdict| !["none", "unmodelled"].contains(&verdict.physics.as_str())).collect();
    let row = truth.row();
    // of a pair, the first verdict is held against the effect that it names
    let meant = truth.effects.iter().find(|effect| effect.physics == answer);
    let top = answer == row || meant.is_some();
    let effect = meant.or(truth.effects.first());
    let joint = effect.and_then(|effect| joint_right(truth, effect, first));
    let matched = meant.zip(first);
    let placed = matched.filter(|_| joint != Some(false));
    Judged {
        case: truth.case.clone(),
        block: truth.block.clone(),
        level: truth.level(),
        noise: truth.noise,
        robot: truth.robot.clone(),
        dry_law: truth.dry_law.clone(),
        truth: if truth.effects.len() < 2 {
            vec![row.to_owned()]
        } else {
            truth.effects.iter().map(|effect| effect.physics.clone()).collect()
        },
        answer: answer.to_owned(),
        status: if report.is_some() { answered.status.clone() } else { NO_REPORT.into() },
        detected: answered.mismatch.detected,
        top,
        alone: top && named.len() <= truth.effects.len(),
        in_set: first.is_some_and(|verdict| {
            let set = verdict.set();
            set.contains(&row) || truth.effects.iter().any(|effect| set.contains(&effect.physics.as_str()))
        }),
        set_size: first.map_or(0, |verdict| verdict.set().len()),
        joint,
        named: pair(truth, &named, &|verdict, effect| verdict.physics == effect.physics),
        named_in_set: pair(truth, &named, &|verdict, effect| verdict.set().contains(&effect.physics.as_str())),
        parameters: placed.map_or_else(Vec::new, |(effect, verdict)| parameters(effect, verdict)),
        removed: matched.and_then(|(_, verdict)| verdict.removed()),
        overlap: matched.and_then(|(effect, verdict)| overlap(effect, verdict, answered)),
        claims: claims(truth, &primaries),
        seconds: report.map(|report| report.timing.total_s),
    }
}

/// Whether the verdict names the joint of the effect and no other; of a coupling the one that is moved and the one that moves it.
fn joint_right(truth: &Truth, effect: &Effect, verdict: Option<&Verdict>) -> Option<bool> {
    let name = effect.joint_name.as_deref()?;
    let Some(verdict) = verdict else { return Some(false) };
    let said = &verdict.location.joint;
    if let Some(mover) = truth.mover(effect).filter(|_| verdict.physics == effect.physics) {
        // Who is dragged along by whom.
        return Some(said.len() == 2 && said[0] == name && &said[1] == mover);
    }
    let most = if verdict.physics == "joint_coupling" { 2 } else { 1 };
    // the geometry between two joints may be put down to either of them
    let next = effect.joint.and_then(|joint| truth.joints.get(joint)).filter(|_| effect.physics == "link_geometry");
    Some(said.len() <= most && said.iter().any(|joint| joint == name || Some(joint) == next))
}

/// Largest number of effects that can be given to distinct verdicts.
fn pair(truth: &Truth, verdicts: &[&Verdict], fits: &dyn Fn(&Verdict, &Effect) -> bool) -> usize {
    fn place(effects: &[Effect], verdicts: &[&Verdict], used: usize, fits: &dyn Fn(&Verdict, &Effect) -> bool) -> usize {
        let Some((effect, rest)) = effects.split_first() else { return 0 };
        let without = place(rest, verdicts, used, fits);
        let free = |k: &usize| used & (1 << k) == 0 && fits(verdicts[*k], effect);
        (0..verdicts.len()).filter(free).map(|k| 1 + place(rest, verdicts, used | (1 << k), fits)).fold(without, usize::max)
    }
    place(&truth.effects, verdicts, 0, fits)
}

fn parameters(effect: &Effect, verdict: &Verdict) -> Vec<Parameter> {
    measures(&effect.physics).iter().filter_map(|measure| parameter(measure, effect, verdict)).collect()
}

fn parameter(measure: &Measure, effect: &Effect, verdict: &Verdict) -> Option<Parameter> {
    let (mut off, mut size, mut covered, mut disowned) = (0.0, 0.0, true, false);
    for name in measure.names {
        let truth = effect.parameters.get(*name)?;
        let Some(said) = verdict.parameters.iter().find(|parameter| &parameter.name == name) else {
            if !measure.told_by_silence {
                return None;
            }
            off += (measure.neutral - truth).powi(2);
            size += (truth - measure.neutral).powi(2);
            covered = false;
            continue;
        };
        off += (said.value - truth).powi(2);
        size += (truth - measure.neutral).powi(2);
        covered &= said.ci95[0] <= *truth && *truth <= said.ci95[1];
        disowned |= said.identifiable == "no";
    }
    (size > 0.0).then(|| Parameter { name: measure.names.join(" "), error: (off / size).sqrt(), covered, disowned })
}

/// Intersection over union, averaged over the runs; 1 of a run that the effect is not in and that none is told of.
fn overlap(effect: &Effect, verdict: &Verdict, report: &Report) -> Option<f64> {
    if effect.intervals.is_empty() && effect.interval.is_none() {
        return None;
    }
    let said = &verdict.location.time_intervals;
    let runs = &report.inputs.runs;
    let mut sum = 0.0;
    for (index, run) in runs.iter().enumerate() {
        let [start, end] = effect.intervals.get(index).copied().or(effect.interval)?;
        let truth = [start.clamp(0.0, run.duration_s), end.clamp(0.0, run.duration_s)];
        let mut stretches: Vec<[f64; 2]> = said.iter().filter(|s| s.run == run.id).map(|s| [s.start_s, s.end_s]).collect();
        if said.is_empty() {
            stretches.push([0.0, run.duration_s]);
        }
        stretches.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut common, mut length, mut reached) = (0.0, 0.0, 0.0f64);
        for [from, to] in stretches {
            let from = from.max(reached);
            if to > from {
                length += to - from;
                common += (to.min(truth[1]) - from.max(truth[0])).max(0.0);
                reached = to;
            }
        }
        let either = truth[1] - truth[0] + length - common;
        sum += if either > 0.0 { common / either } else { 1.0 };
    }
    (!runs.is_empty()).then(|| sum / runs.len() as f64)
}

/// Each primary verdict: right if it names one of the effects, `none` of a null, or `unmodelled` of one outside the library.
fn claims(truth: &Truth, primaries: &[&Verdict]) -> Vec<Claim> {
    let right = |verdict: &Verdict| match verdict.physics.as_str() {
        "none" => truth.effects.is_empty(),
        "unmodelled" => truth.effects.iter().any(Effect::is_outside),
        name => {
            truth.effects.iter().any(|effect| effect.physics == name && joint_right(truth, effect, Some(verdict)) != Some(false))
        }
    };
    primaries.iter().map(|verdict| Claim { probability: verdict.probability, right: right(verdict) }).collect()
}
