//! One section per effect: how it shows, what its correction gains, its parameters, what it may be confused with.

use super::fits::fit;
use super::tags::{HALF_PX, around, figure, list, section, table, text};
use crate::figures::{before_after, channel_title, signature, spectrum};
use crate::text::{
    Estimate, capital, duration, joints, listed, names_something, parameter_name, percent, probability, region, short, with_unit,
};
use crate::{Confusable, Evidence, Experiment, Identifiable, Parameter, Physics, Pictures, Report, Verdict};

/// All effects.
pub(super) fn effects(report: &Report, pictures: &Pictures) -> String {
    if !names_something(report) {
        return String::new();
    }
    let told: Vec<&Verdict> = report.told().collect();
    let several = told.len() > 1;
    told.iter().map(|verdict| effect(report, verdict, pictures, several)).collect()
}

fn effect(report: &Report, verdict: &Verdict, pictures: &Pictures, several: bool) -> String {
    let at = joints(&verdict.location.joint);
    let at = if verdict.location.joint.is_empty() { String::new() } else { format!(", {}", at.trim_start_matches("the ")) };
    let number = if several { format!("{}. ", verdict.effect) } else { String::new() };
    let heading = format!("{number}{}{at}", capital(verdict.physics.plain()));
    let mut out = place(verdict);
    let shows = pictures.signatures.iter().filter(|picture| picture.effect == verdict.effect);
    let shows: String = shows.map(|picture| figure(|width| signature(picture, width), HALF_PX)).collect();
    let held_out = pictures.before_after.iter().filter(|picture| picture.effect == Some(verdict.effect));
    let held_out: String = held_out.map(run_before_after).collect();
    let spectra = pictures.spectra.iter().filter(|picture| picture.effect == Some(verdict.effect));
    let spectra: String = spectra.map(|picture| figure(|width| spectrum(picture, width), HALF_PX)).collect();
    out += &columns(&[shows, held_out, spectra]);
    let fits: String = verdict.fit.iter().map(fit).collect();
    let fits = if fits.is_empty() { fits } else { text("h3", "", &judged_on(verdict)) + &fits };
    let parameters = parameters(&verdict.physics, &verdict.parameters);
    let parameters = if parameters.is_empty() { parameters } else { text("h3", "", "How much") + &parameters };
    out += &columns(&[fits, parameters]);
    if !verdict.physics.is_named() {
        out += &list("ul", verdict.evidence.iter().map(claim));
    }
    out += &doubts(report, verdict);
    section(&heading, &out)
}

fn run_before_after(picture: &crate::BeforeAfter) -> String {
    // Both widths hold as many figures.
    let count = before_after(picture, HALF_PX).len();
    (0..count).map(|i| figure(|width| before_after(picture, width).swap_remove(i), HALF_PX)).collect()
}

/// What a test shows, with its figure: all there is to say on what has no name.
fn claim(test: &Evidence) -> String {
    format!("{} ({}: {} {}).", capital(&test.claim), test.test, short(test.statistic), test.statistic_name)
}

/// `On held-out data (run-04, run-05)`.
fn judged_on(verdict: &Verdict) -> String {
    let mut runs: Vec<&str> = verdict.fit.iter().flat_map(|fit| &fit.on).map(String::as_str).collect();
    runs.sort_unstable();
    runs.dedup();
    let part = if runs.len() > 6 { format!("{} runs", runs.len()) } else { runs.join(", ") };
    format!("On held-out data ({part})")
}

/// Side by side where there is room; one alone keeps its half.
fn columns(parts: &[String]) -> String {
    let parts: Vec<String> = parts.iter().filter(|part| !part.is_empty()).map(|part| around("div", "", part)).collect();
    if parts.is_empty() { String::new() } else { around("div", "pair", &parts.concat()) }
}

/// Where it shows, in sentences.
fn place(verdict: &Verdict) -> String {
    let location = &verdict.location;
    let mut said: Vec<String> = Vec::new();
    if let Some(share) = location.energy_share {
        let channel = channel_title(location.channel).to_lowercase();
        said.push(format!("{} of the error above noise in {channel} is here.", percent(share)));
    }
    for regime in &location.regime {
        let share = regime.energy_share.map_or_else(String::new, |share| format!(" ({} of it)", percent(share)));
        said.push(format!("{}{share}.", capital(&regime.condition)));
    }
    said.extend(region(&location.workspace_region).map(|place| format!("Mostly where {place}.")));
    for stretch in &location.time_intervals {
        said.push(format!("In {}, from {:.1} to {:.1}\u{a0}s.", stretch.run, stretch.start_s, stretch.end_s));
    }
    text("p", "", &said.join(" "))
}

/// Values with their intervals; what is the same for all is left out.
fn parameters(physics: &Physics, parameters: &[Parameter]) -> String {
    let again = parameters.iter().any(|parameter| parameter.output_error_value.is_some());
    let sure = parameters.iter().all(|parameter| determined(parameter) == "yes");
    let row = |parameter: &Parameter| {
        let estimate = Estimate::new(parameter.value, parameter.ci95, parameter.true_unit());
        let by_loop = parameter.output_error_value.map_or_else(String::new, |value| with_unit(value, parameter.true_unit()));
        let name = match parameter.along() {
            Some([along, _]) => format!("shift along {along} ({})", parameter.name),
            None => parameter_name(physics, &parameter.name),
        };
        let mut row = vec![name, estimate.plain(), estimate.interval()];
        row.extend(again.then_some(by_loop));
        row.extend((!sure).then(|| determined(parameter)));
        row
    };
    let mut header = vec!["", "Value", "95 % interval"];
    header.extend(again.then_some("In the loop"));
    header.extend((!sure).then_some("Determined"));
    table(1, &header, parameters.iter().map(row).collect())
}

/// Do the data say it?
fn determined(parameter: &Parameter) -> String {
    let known = match parameter.identifiable {
        Identifiable::Yes => "yes",
        Identifiable::Weak => "roughly",
        Identifiable::No => "no",
    };
    let limit = if parameter.at_bound == Some(true) { ", at a limit" } else { "" };
    format!("{known}{limit}")
}

/// What it may be instead, and what would decide.
fn doubts(report: &Report, verdict: &Verdict) -> String {
    let mut out = String::new();
    if !verdict.confusable_with.is_empty() {
        let lines = verdict.confusable_with.iter().map(|other| doubt(report, verdict, other));
        let sure = match verdict.set_probability {
            Some(set) => format!(
                "These runs cannot exclude the following. {} is {} likely; it or one of these {}.",
                capital(verdict.physics.plain()),
                probability(verdict.probability),
                probability(set)
            ),
            None => "These runs cannot exclude the following.".to_owned(),
        };
        out += &(text("h3", "", "What it could be instead") + &text("p", "", &sure) + &list("ul", lines));
    }
    out + &verdict.suggested_experiment.as_ref().map_or_else(String::new, experiment)
}

fn doubt(report: &Report, verdict: &Verdict, other: &Confusable) -> String {
    let competing = |candidate: &&Verdict| candidate.effect == verdict.effect && candidate.physics == other.physics;
    let likely = report.verdicts.iter().find(competing).map(|candidate| format!(" ({})", probability(candidate.probability)));
    let by = other.separated_by.as_ref().map_or_else(String::new, |by| format!(". To tell them apart: {by}"));
    format!("{}{}: {}{by}.", capital(other.physics.plain()), likely.unwrap_or_default(), other.reason)
}

fn experiment(experiment: &Experiment) -> String {
    let time = experiment.duration_s.map_or_else(String::new, |s| format!(", {}", duration(s)));
    let mut out = text("h3", "", &format!("The experiment that would decide{time}"));
    out += &text("p", "", &format!("To {}:", experiment.goal.trim_start_matches("to ").trim_end_matches('.')));
    out += &list("ol", &experiment.steps);
    if let Some(equipment) = experiment.extra_equipment.as_deref().filter(|equipment| !equipment.is_empty()) {
        out += &text("p", "", &format!("Needed: {}.", listed(equipment, "and")));
    }
    if let Some(warning) = &experiment.warning {
        out += &text("p", "notice", warning);
    }
    let mut fine: Vec<String> = Vec::new();
    if experiment.limits_checked == Some(true) {
        fine.push("Within the limits of joints and motors.".to_owned());
    }
    if let Some(gain) = experiment.expected_gain_nats {
        fine.push(format!("Expected evidence: {} nats (6 are plenty).", short(gain)));
    }
    if let Some(file) = experiment.trajectory.as_ref().and_then(|trajectory| trajectory.file.as_ref()) {
        fine.push(format!("Motion: {file}."));
    }
    around("div", "card", &(out + &text("p", "fine", &fine.join(" "))))
}

/// All corrections together, and what they leave.
pub(super) fn left_over(report: &Report, pictures: &Pictures) -> String {
    let mut out = String::new();
    let remaining = &report.remaining;
    if let Some(share) = remaining.explained_share {
        out += &text("p", "", &format!("{} of what can be explained at all is explained.", percent(share)));
    }
    if let Some(depends) = remaining.depends_on.as_deref().filter(|depends| !depends.is_empty()) {
        let depends: Vec<String> = depends.iter().map(|name| name.replace('_', " ")).collect();
        out += &text("p", "", &format!("What is left goes with {}.", listed(&depends, "and")));
    }
    let together: String = pictures.before_after.iter().filter(|picture| picture.effect.is_none()).map(run_before_after).collect();
    let spectra = pictures.spectra.iter().filter(|picture| picture.effect.is_none());
    let spectra: String = spectra.map(|picture| figure(|width| spectrum(picture, width), HALF_PX)).collect();
    out += &columns(&[together, spectra]);
    out += &remaining.fit.iter().flatten().map(fit).collect::<String>();
    section("All corrections together", &out)
}

/// What competes with the verdicts, in numbers.
pub(super) fn alternatives(report: &Report) -> String {
    let one = |verdict: &Verdict| {
        let heading = format!("{}: {}", capital(verdict.physics.plain()), probability(verdict.probability));
        text("h3", "", &heading) + &parameters(&verdict.physics, &verdict.parameters)
    };
    report.verdicts.iter().filter(|verdict| !verdict.is_primary()).map(one).collect()
}
