//! The top: what was compared, the answer in words, the figures that matter.

use super::tags::{around, text};
use crate::text::{as_given, before_and_after, beside_noise, capital, duration, headlines_unbroken, percent, probability};
use crate::{Level, Physics, Report, RunRole, Status};

/// What was compared, the answer's mark and its sentences.
pub(super) fn head(report: &Report) -> String {
    let simulator = match &report.inputs.simulator.version {
        Some(version) => format!("{} {version}", report.inputs.simulator.name),
        None => report.inputs.simulator.name.clone(),
    };
    let date = report.created.split('T').next().unwrap_or_default();
    let mut out = text("p", "kicker", &format!("Gap report \u{b7} {} against {simulator} \u{b7} {date}", report.inputs.robot.name));
    let (class, mark) = chip(report);
    out += &text("p", &format!("chip {class}"), &mark);
    let mut sentences = headlines_unbroken(report).into_iter();
    out += &text("h1", "", &sentences.next().unwrap_or_default());
    // Without a verdict the box with the failures follows and says why.
    let said_below = report.status == Status::InsufficientData && report.quality(Level::Fail).next().is_some();
    for sentence in sentences.filter(|_| !said_below) {
        out += &text("p", "lead", &sentence);
    }
    if report.told().any(|verdict| !verdict.parameters.is_empty()) {
        out += &text("p", "fine", "Brackets hold the 95 % interval. Values are those at the joint, not at the motor.");
    }
    around("header", "", &out)
}

/// Class and words of the mark; a sign besides the colour.
fn chip(report: &Report) -> (&'static str, String) {
    match report.status {
        Status::InsufficientData => ("fail", "\u{2715} Not enough data".to_owned()),
        Status::NoMismatch => ("good", "\u{2713} No mismatch".to_owned()),
        Status::Explained => ("good", "\u{2713} Mismatch found and explained".to_owned()),
        Status::PartlyExplained => ("bad", "\u{25b2} Mismatch found, explained in part".to_owned()),
        Status::Unmodelled => ("bad", "\u{25b2} Mismatch found, not explained".to_owned()),
    }
}

/// The figures that matter, on tiles.
pub(super) fn tiles(report: &Report) -> String {
    if report.status == Status::InsufficientData {
        return String::new();
    }
    let mut tiles: Vec<Tile> = Vec::new();
    let first = report.told().next();
    let together = report.remaining.fit.iter().flatten().next();
    if let Some(fit) = together.or_else(|| first.and_then(|verdict| verdict.fit.first())) {
        if let Some(gone) = fit.removed_fraction {
            tiles.push(Tile::new("Removable error gone", percent(gone), "on held-out runs"));
        }
        let ([before, after], floor) = before_and_after(fit);
        let floor = floor.map_or_else(String::new, |floor| format!("noise alone {floor}"));
        tiles.push(Tile::new(&capital(&fit.quantity), format!("{before} \u{2192} {after}"), &floor));
    } else if let Some(worst) = report.mismatch.excess_rms.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b))) {
        let name = format!("Largest beyond noise{}", worst.joint.as_ref().map_or_else(String::new, |joint| format!(", {joint}")));
        let ([value, floor], missed) = beside_noise(worst);
        let of_model = missed.map_or_else(String::new, |missed| format!(", the model\u{2019}s own error {missed}"));
        tiles.push(Tile::new(&name, value, &format!("noise alone {floor}{of_model}")));
    }
    let mut resolution = report.told().filter(|verdict| verdict.physics == Physics::None).flat_map(|verdict| &verdict.evidence);
    if let Some(effect) = resolution.find_map(|test| test.effect.as_ref()) {
        tiles.push(Tile::new("Visible from", as_given(effect.value, &effect.unit), "less would not show"));
    }
    if let Some(verdict) = first {
        let set = verdict.set_probability.filter(|set| *set > verdict.probability);
        let set = set.map_or_else(String::new, |set| format!("{} with look-alikes", probability(set)));
        tiles.push(Tile::new("Confidence", probability(verdict.probability), &set));
    }
    tiles.push(Tile::new("Held out", held_out(report), "not used for fitting"));
    around("dl", "tiles", &tiles.iter().map(Tile::html).collect::<String>())
}

/// `2 of 5 runs`, or of a split run `9.6 s of 30 s`.
fn held_out(report: &Report) -> String {
    let runs = &report.inputs.runs;
    if runs.iter().any(|run| run.role == RunRole::HeldOut) {
        return format!("{} of {} runs", report.held_out().count(), runs.len());
    }
    let stretches = runs.iter().filter_map(|run| run.held_out_interval.as_ref());
    let held_out: f64 = stretches.map(|stretch| stretch.end_s - stretch.start_s).sum();
    let all: f64 = runs.iter().map(|run| run.duration_s).sum();
    if held_out > 0.0 { format!("{} of {}", duration(held_out), duration(all)) } else { "nothing".to_owned() }
}

/// A name, a figure, and what to compare it with.
struct Tile {
    name: String,
    value: String,
    beside: String,
}

impl Tile {
    fn new(name: &str, value: String, beside: &str) -> Self {
        Self { name: name.to_owned(), value, beside: beside.to_owned() }
    }

    fn html(&self) -> String {
        let beside = if self.beside.is_empty() { String::new() } else { text("dd", "beside", &self.beside) };
        around("div", "", &(text("dt", "", &self.name) + &text("dd", "", &self.value) + &beside))
    }
}

fn ratio(excess: &crate::ExcessRms) -> f64 {
    excess.value / excess.noise_floor
}
