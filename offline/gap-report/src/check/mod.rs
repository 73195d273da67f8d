//! What must hold in a report beyond its schema. [`check`] lists every violation with its place, what was found and what was
//! expected; an empty list is a good report.

mod finite;
mod places;
mod ranking;
mod status;
mod values;

use crate::Report;

/// Violations found so far.
#[derive(Default)]
struct Findings(Vec<String>);

impl Findings {
    /// Notes a violation unless the rule holds.
    fn demand(&mut self, holds: bool, message: impl FnOnce() -> String) {
        if !holds {
            self.0.push(message());
        }
    }
}

/// Everything in a report that contradicts itself, the vocabulary or the rules that the schema cannot hold; empty if nothing.
pub fn check(report: &Report) -> Vec<String> {
    let mut findings = Findings::default();
    finite::check(report, &mut findings);
    status::check(report, &mut findings);
    ranking::check(report, &mut findings);
    places::check(report, &mut findings);
    values::check(report, &mut findings);
    findings.0
}

/// Places of numbers that are NaN or infinite.
pub(crate) fn not_finite(report: &Report) -> Vec<String> {
    let mut findings = Findings::default();
    finite::check(report, &mut findings);
    findings.0
}
