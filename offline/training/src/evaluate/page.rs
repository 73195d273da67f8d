//! The report as one self-contained page.

use super::{FEW, Interval, Method, Report, Rest};
use crate::data::Trajectory;
use plot::figure::{Axis, Colour, Figure, Mark, Panel};
use plot::page::{Block, Page};

/// Seconds of the first run that the time plot shows.
const SHOWN_S: f64 = 60.0;

/// The page.
pub(super) fn page(report: &Report, test: &[Trajectory], estimates: &[Rest], unit: &str) -> String {
    let mut blocks = vec![tiles(report, unit)];
    blocks.push(Block::Text(format!("Trained on: {}.", report.trained_on)));
    blocks.push(Block::Heading("Methods side by side".to_owned()));
    blocks.push(Block::Text(format!(
        "On {} whole trajectories ({} rows) that took part in nothing before. Figures of the vector in {unit}, against the truth \
         without added noise; in brackets {}.",
        report.runs.len(),
        report.rows,
        if report.runs.len() < FEW { "the lowest and the highest of one trajectory" } else { "95 % over trajectories (bootstrap)" }
    )));
    blocks.push(methods(&report.methods));
    blocks.push(Block::Heading("Per axis".to_owned()));
    blocks.push(axes(report));
    blocks.push(Block::Heading("Bound and domain".to_owned()));
    blocks.push(Block::List(trust(report, unit)));
    if !report.breakdown.is_empty() {
        blocks.push(Block::Heading("Where, how fast, which way, how loaded".to_owned()));
        blocks.push(breakdown(report));
    }
    blocks.push(Block::Heading("Pictures".to_owned()));
    blocks.push(Block::Figures(vec![over_time(test, estimates, unit), shares(test, estimates, unit)]));
    if !report.notes.is_empty() {
        blocks.push(Block::List(report.notes.clone()));
    }
    let subtitle = format!("{}; research software, no clinical use", report.model);
    Page { title: "Where the arm really is: evaluation".to_owned(), subtitle, blocks }.html()
}

fn model(report: &Report) -> Option<&Method> {
    report.methods.iter().find(|method| method.name == "model")
}

fn tiles(report: &Report, unit: &str) -> Block {
    let raw = report.methods.first();
    let tile = |name: &str, text: String| (name.to_owned(), text);
    let mut tiles = Vec::new();
    if let (Some(raw), Some(model)) = (raw, model(report)) {
        tiles.push(tile("RMS as reported", format!("{:.2} {unit}", raw.exact.vector.rms)));
        tiles.push(tile("RMS with the model", format!("{:.2} {unit}", model.exact.vector.rms)));
        tiles.push(tile("RMS removed", bracket(model.rms_reduction)));
        tiles.push(tile("SD removed", bracket(model.sd_reduction)));
    }
    Block::Tiles(tiles)
}

fn bracket(of: Interval) -> String {
    format!("{:.1} % [{:.1}, {:.1}]", of.value, of.low, of.high)
}

fn methods(methods: &[Method]) -> Block {
    let header = [
        "method",
        "what",
        "RMS",
        "SD",
        "median",
        "95 %",
        "max",
        "RMS measured",
        "RMS, offset per run off",
        "RMS removed",
        "SD removed",
        "removed, offset off",
        "learning, s",
        "estimate, µs",
    ];
    let optional = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
    let rows = methods
        .iter()
        .map(|method| {
            let vector = &method.exact.vector;
            let numbers =
                [vector.rms, vector.sd, vector.median, vector.p95, vector.max, method.measured.vector.rms, method.centred_rms];
            let mut row = vec![method.name.clone(), method.what.clone()];
            row.extend(numbers.iter().map(|number| format!("{number:.3}")));
            row.extend([method.rms_reduction, method.sd_reduction, method.centred_reduction].map(bracket));
            row.extend([optional(method.train_s), optional(method.estimate_us)]);
            row
        })
        .collect();
    Block::Table(2, header.map(str::to_owned).to_vec(), rows)
}

fn axes(report: &Report) -> Block {
    let header = ["output", "method", "RMS", "SD", "median", "95 %", "max"].map(str::to_owned).to_vec();
    let shown = report.methods.iter().filter(|method| ["raw", "model"].contains(&method.name.as_str()));
    let rows = shown
        .flat_map(|method| {
            report.outputs.iter().zip(&method.exact.axes).map(|(output, axis)| {
                let mut row = vec![output.clone(), method.name.clone()];
                row.extend([axis.rms, axis.sd, axis.median, axis.p95, axis.max].map(|number| format!("{number:.3}")));
                row
            })
        })
        .collect();
    Block::Table(2, header, rows)
}

fn trust(report: &Report, unit: &str) -> Vec<String> {
    let trust = &report.trust;
    let list = |numbers: &[f64], digits: usize| numbers.iter().map(|x| format!("{x:.digits$}")).collect::<Vec<_>>().join(", ");
    let mut lines = vec![
        format!("Stated 95 % half widths: {} {unit}.", list(&trust.bound95, 3)),
        format!(
            "They hold the true value in {} % per axis, {:.1} % over all; {:.1} to {:.1} % by trajectory.",
            list(&trust.coverage, 1),
            trust.coverage_all,
            trust.coverage_of_runs.0,
            trust.coverage_of_runs.1
        ),
        format!(
            "Outside a trained range: {:.2} % of the rows; beyond the domain: {:.2} %.",
            trust.out_of_range, trust.out_of_domain
        ),
    ];
    if !trust.bound95_unsettled.is_empty() {
        lines.push(format!("Half widths while the memory has not settled: {} {unit}.", list(&trust.bound95_unsettled, 3)));
    }
    if let Some(words) = trust.settled() {
        lines.push(format!("By run {words}."));
    }
    lines.extend(trust.load.iter().map(|load| format!("By the motors' torque: {load}.")));
    lines.extend(trust.friction.iter().map(|friction| format!("By the same torque: {friction}.")));
    lines.extend(trust.far_off.iter().map(|far_off| format!("{far_off}.")));
    lines.extend(trust.unsettled.iter().map(|unsettled| format!("By age, {unit}: {unsettled}.")));
    if !trust.leaving.is_empty() {
        let names: Vec<String> = trust.leaving.iter().map(|(name, share)| format!("{name} ({share:.2} %)")).collect();
        lines.push(format!("Inputs that leave their range most often: {}.", names.join(", ")));
    }
    lines
}

fn breakdown(report: &Report) -> Block {
    let header = ["by", "part", "rows", "RMS before", "RMS after", "removed, %", "bound holds, %"].map(str::to_owned).to_vec();
    let rows = report
        .breakdown
        .iter()
        .map(|cell| {
            let removed = if cell.before > 0.0 { 100.0 * (1.0 - cell.after / cell.before) } else { 0.0 };
            let numbers = [
                format!("{:.3}", cell.before),
                format!("{:.3}", cell.after),
                format!("{removed:.1}"),
                format!("{:.1}", cell.holds),
            ];
            [vec![cell.by.clone(), cell.part.clone(), cell.rows.to_string()], numbers.to_vec()].concat()
        })
        .collect();
    Block::Table(2, header, rows)
}

fn over_time(test: &[Trajectory], estimates: &[Rest], unit: &str) -> Figure {
    let mut figure = Figure::new("The first minute of the first run", Axis::new("Time, s"));
    let (Some(one), Some(estimate)) = (test.first(), estimates.first()) else { return figure };
    let outputs = (one.exact.len() / one.rows().max(1)).max(1);
    let start_s = one.time_s.first().copied().unwrap_or(0.0);
    let rows = one.time_s.iter().take_while(|time| **time - start_s <= SHOWN_S).count();
    for axis in 0..outputs {
        let points = |of: &[f32]| (0..rows).map(|row| (one.time_s[row], f64::from(of[row * outputs + axis]))).collect();
        let panel = Panel::new(Axis::new(format!("Output {}, {unit}", axis + 1)))
            .mark(Mark::line("true", Colour::INK, points(&one.exact)))
            .mark(Mark::line("estimate", Colour::BLUE, points(estimate)));
        figure = figure.panel(panel);
    }
    figure.caption(format!("{}: the error as it is, and as the model estimates it from the reported state.", one.name))
}

/// Share of rows whose error is below so much, before and after.
fn shares(test: &[Trajectory], estimates: &[Rest], unit: &str) -> Figure {
    let lengths = |left: &dyn Fn(&Trajectory, &Rest, usize) -> f32| {
        let mut all: Vec<f64> = test
            .iter()
            .zip(estimates)
            .flat_map(|(one, estimate)| {
                let outputs = (one.exact.len() / one.rows().max(1)).max(1);
                (0..one.rows())
                    .map(|row| {
                        (0..outputs).map(|axis| f64::from(left(one, estimate, row * outputs + axis)).powi(2)).sum::<f64>().sqrt()
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        all.sort_by(f64::total_cmp);
        (0..=100)
            .filter_map(|k| all.get((k * all.len() / 100).min(all.len().saturating_sub(1))).map(|x| (*x, f64::from(k as u8))))
            .collect()
    };
    let before = lengths(&|one, _, at| one.exact[at]);
    let after = lengths(&|one, estimate, at| one.exact[at] - estimate[at]);
    let panel = Panel::new(Axis::new("Rows below, %")).mark(Mark::line("reported", Colour::VERMILLION, before)).mark(Mark::line(
        "model",
        Colour::BLUE,
        after,
    ));
    Figure::new("How large the error is", Axis::new(format!("Length of the error, {unit}"))).panel(panel)
}
