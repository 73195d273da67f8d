//! report.html: for a person with one minute. From top to bottom: the answer in a sentence, what is wrong with the data, where
//! the error is, per effect how it shows and what the correction gains, what it may be confused with; the rest is folded.

mod details;
mod effect;
mod fits;
mod head;
mod place;
mod quality;
mod style;
mod tags;

use crate::{Pictures, Report};

/// The page: one file, nothing from outside, no script.
pub fn html(report: &Report, pictures: &Pictures) -> String {
    let parts = [
        head::head(report),
        quality::failures(report),
        head::tiles(report),
        place::place(report, pictures),
        effect::effects(report, pictures),
        effect::left_over(report, pictures),
        quality::warnings(report),
        details::details(report),
    ];
    let title = format!("Gap report: {} against {}", report.inputs.robot.name, report.inputs.simulator.name);
    plot::page::document(&title, &style::style(), &parts.join("\n"))
}
