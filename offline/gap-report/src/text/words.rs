//! The report for a terminal.

use super::headline::{headlines_unbroken, plain_spaces, quality_headline};
use super::joints::{capital, joints, listed};
use super::number::{as_given, before_and_after, beside_noise, percent, probability};
use super::region::region;
use crate::{ABSENT, Experiment, Fit, Level, Metric, Physics, Report, Space, Status, Verdict};

/// Characters per line.
const WIDTH: usize = 100;
/// Lines at most.
const LINES_MAX: usize = 15;
/// Checks, effects or figures of one kind at most; the page has them all.
const MOST: usize = 3;

/// The report in at most 15 lines of plain text: the answer first, then what is wrong with the data, how much better the
/// corrected simulation fits, what the answer may be confused with, and the experiment that would decide.
pub fn words(report: &Report) -> String {
    let mut lines = Vec::new();
    let sentences = headlines_unbroken(report);
    for sentence in sentences.iter().take(MOST + 1) {
        lines.extend(wrapped(sentence, ""));
    }
    if sentences.len() > MOST + 1 {
        lines.push(format!("And {} more: see report.html.", sentences.len() - MOST - 1));
    }
    let mut rest: Vec<(&str, String)> = Vec::new();
    // Without a verdict the first failure is the answer already.
    let told = usize::from(report.status == Status::InsufficientData);
    rest.extend(report.quality(Level::Fail).skip(told).take(MOST).map(|check| ("Put right first", quality_headline(check))));
    rest.extend(fits(report).into_iter().map(|line| ("Held-out runs", line)));
    let places = report.told().filter_map(|verdict| region(&verdict.location.workspace_region));
    rest.extend(places.take(MOST).map(|place| ("Mostly where", place)));
    if report.status == Status::NoMismatch {
        rest.extend(agreement(report).map(|line| ("Resolution", line)));
    }
    rest.extend(report.told().filter(|verdict| verdict.physics.is_named()).filter_map(doubt).map(|line| ("Not excluded", line)));
    rest.extend(report.told().filter_map(|verdict| verdict.suggested_experiment.as_ref()).map(|e| ("Would decide", experiment(e))));
    rest.extend(left_over(report).map(|line| ("Left over", line)));
    rest.extend(report.quality(Level::Warn).take(MOST).map(|check| ("Keep in mind", quality_headline(check))));
    for (name, text) in rest {
        let block = wrapped(&text, &format!("  {:<17}", format!("{name}:")));
        if lines.len() + block.len() <= LINES_MAX {
            lines.extend(block);
        }
    }
    plain_spaces(&lines.join("\n")) + "\n"
}

/// The figures that tell most: of every told verdict its first, or of all together.
fn fits(report: &Report) -> Vec<String> {
    let together = report.remaining.fit.iter().flatten();
    let single = report.told().filter_map(|verdict| verdict.fit.first());
    let fits: Vec<&Fit> =
        if report.told().count() > 1 { together.chain(single).collect() } else { single.chain(together).collect() };
    fits.into_iter().take(MOST).map(improvement).collect()
}

/// `force insertion 13.4 to 3.10 N RMS, noise alone 2.70 N: 99 % of the removable error is gone`.
fn improvement(fit: &Fit) -> String {
    let metric = plain_metric(fit.metric);
    let ([before, after], floor) = before_and_after(fit);
    let floor = floor.map_or_else(String::new, |floor| format!(", noise alone {floor}"));
    let gone =
        fit.removed_fraction.map_or_else(String::new, |share| format!(": {} of the removable error gone", percent(share.min(1.0))));
    // What is driven by what was recorded says so itself, and is in no loop.
    let space = if fit.space == Space::ClosedLoop && !fit.quantity.contains("driven by") { " in the loop" } else { "" };
    if fit.extra.get(ABSENT).is_some() {
        return format!("{} off by {before} {metric}{floor}: nothing of it is there", fit.quantity);
    }
    format!("{}{space} {before} \u{2192} {after} {metric}{floor}{gone}", fit.quantity)
}

/// A figure as people call it.
pub(crate) fn plain_metric(metric: Metric) -> &'static str {
    match metric {
        Metric::Rms => "RMS",
        Metric::Mae => "mean error",
        Metric::Max => "at most",
        Metric::Nrms => "relative RMS",
        Metric::R2 => "R\u{b2}",
        Metric::LogLikelihoodPerSample => "log likelihood per sample",
    }
}

/// What a verdict may be instead, with the reason.
fn doubt(verdict: &Verdict) -> Option<String> {
    let first = verdict.confusable_with.first()?;
    let names: Vec<&str> = verdict.confusable_with.iter().map(|other| other.physics.plain()).collect();
    let at = if verdict.location.joint.is_empty() { String::new() } else { format!(" at {}", joints(&verdict.location.joint)) };
    let sure = format!("{} sure of {}", probability(verdict.probability), verdict.physics.plain());
    let set = verdict.set_probability.map_or_else(String::new, |set| format!(", {} of one of these", probability(set)));
    Some(format!("{}{at}: {} ({sure}{set})", capital(&listed(&names, "or")), first.reason))
}

fn experiment(experiment: &Experiment) -> String {
    let how_long = experiment.duration_s.map_or_else(String::new, |s| format!(" ({})", super::number::duration(s)));
    format!("{}{how_long}", experiment.steps.join("; "))
}

/// How large an effect would have been seen, or how far above noise the residuals are.
fn agreement(report: &Report) -> Option<String> {
    let mut tests = report.told().flat_map(|verdict| &verdict.evidence);
    if let Some(effect) = tests.find_map(|test| test.effect.as_ref()) {
        return Some(format!("an effect of {} would have been seen", as_given(effect.value, &effect.unit)));
    }
    let worst = report.mismatch.excess_rms.iter().max_by(|a, b| (a.value / a.noise_floor).total_cmp(&(b.value / b.noise_floor)))?;
    let ([value, floor], missed) = beside_noise(worst);
    let of_model = missed.map_or_else(String::new, |missed| {
        format!("; there the model that was learnt from the simulation misses {missed} of the simulation itself")
    });
    Some(format!("largest difference beyond noise {value}, noise alone {floor}{of_model}"))
}

fn left_over(report: &Report) -> Option<String> {
    let depends = report.remaining.depends_on.as_deref().filter(|names| !names.is_empty())?;
    let depends: Vec<String> = depends.iter().map(|name| name.replace('_', " ")).collect();
    let share = report.remaining.explained_share.map_or_else(String::new, |share| format!("{} explained; ", percent(share)));
    Some(format!("{share}the rest goes with {}", listed(&depends, "and")))
}

/// Says whether a report names anything.
pub(crate) fn names_something(report: &Report) -> bool {
    report.told().any(|verdict| verdict.physics != Physics::None)
}

/// Text in lines, the first after `before`, the others below its end.
fn wrapped(text: &str, before: &str) -> Vec<String> {
    let indent = " ".repeat(if before.is_empty() { 2 } else { before.chars().count() });
    let mut lines = vec![before.to_owned()];
    let mut fresh = true;
    // No break inside a number with its unit: only plain spaces separate words here.
    for word in text.split([' ', '\n']).filter(|word| !word.is_empty()) {
        let last = lines.last_mut().filter(|line| fresh || line.chars().count() + 1 + word.chars().count() <= WIDTH);
        if let Some(line) = last {
            if !fresh {
                line.push(' ');
            }
            line.push_str(word);
        } else {
            lines.push(format!("{indent}{word}"));
        }
        fresh = false;
    }
    lines
}
