//! What is wrong with the data: failures high up, warnings below, what is in order folded.

use super::tags::{around, list, section, text};
use crate::{Level, Report, quality_headline};

/// A box with what must be put right first.
pub(super) fn failures(report: &Report) -> String {
    let lines: Vec<String> = report.quality(Level::Fail).map(quality_headline).collect();
    if lines.is_empty() {
        return String::new();
    }
    let content = text("h2", "", "Put right first") + &list("ul", lines);
    around("section", "alert", &content)
}

/// What to keep in mind.
pub(super) fn warnings(report: &Report) -> String {
    let items: String = report.quality(Level::Warn).map(|check| text("li", "", &quality_headline(check))).collect();
    if items.is_empty() {
        return String::new();
    }
    section("Keep in mind about the data", &around("ul", "warn", &items))
}
