//! The top: what was compared, the answer in words, the figures that matter.

use super::tags::{around, text};
use crate::text::{as_given, joined, percent, probability, short, written};
use crate::{Fit, Level, Report, Status, headlines};

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
    let mut sentences = headlines(report).into_iter();
    out += &text("h1", "", &sentences.next().unwrap_or_default());
    for sentence in sentences {
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
    let mut tiles: Vec<(String, String)> = Vec::new();
    let first = report.told().next();
    let together = report.remaining.fit.iter().flatten().next();
    if let Some(fit) = together.or_else(|| first.and_then(|verdict| verdict.fit.first())) {
        if let Some(gone) = fit.removed_fraction {
            tiles.push(("of the removable error gone".to_owned(), percent(gone)));
        }
        tiles.push((format!("{}, held-out runs", fit.quantity), change(fit)));
        if let Some(floor) = fit.noise_floor {
            tiles.push(("noise alone".to_owned(), as_given(floor, &fit.unit)));
        }
    } else if let Some(worst) = report.mismatch.excess_rms.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b))) {
        let place = worst.joint.as_deref().unwrap_or("largest");
        tiles.push((format!("difference, {place}"), as_given(worst.value, &worst.unit)));
        tiles.push(("noise alone".to_owned(), as_given(worst.noise_floor, &worst.unit)));
    }
    if let Some(verdict) = first {
        tiles.push(("sure of the first cause".to_owned(), probability(verdict.probability)));
    }
    let failures = report.quality(Level::Fail).count();
    if failures > 0 {
        tiles.push(("checks of the data failed".to_owned(), failures.to_string()));
    }
    tiles.push(("runs held out of all".to_owned(), format!("{} of {}", report.held_out().count(), report.inputs.runs.len())));
    let tile = |(name, value): &(String, String)| around("div", "", &(text("dt", "", name) + &text("dd", "", value)));
    around("dl", "tiles", &tiles.iter().map(tile).collect::<String>())
}

fn ratio(excess: &crate::ExcessRms) -> f64 {
    excess.value / excess.noise_floor
}

/// `13.4 → 3.10 N`.
fn change(fit: &Fit) -> String {
    joined(&format!("{} \u{2192} {}", short(fit.before), short(fit.after)), &written(&fit.unit))
}
