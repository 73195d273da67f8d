//! The answer in one word and what it needs. The schema says so too; here it is checked without one.

use super::Findings;
use crate::{Physics, Report, SCHEMA_VERSION, Status, Verdict, vocabulary};

pub(super) fn check(report: &Report, findings: &mut Findings) {
    let (status, mut told) = (report.status, report.told());
    let first = report.verdicts.first().map(|verdict| &verdict.physics);
    let detected = report.mismatch.detected;
    let need = |findings: &mut Findings, holds: bool, what: &str| {
        findings.demand(holds, || format!("status {status}: needs {what}"));
    };
    match status {
        Status::NoMismatch => {
            need(findings, first == Some(&Physics::None), "`none` as the first verdict");
            need(findings, !detected, "mismatch.detected = false");
        }
        Status::Unmodelled => {
            need(findings, first == Some(&Physics::Unmodelled), "`unmodelled` as the first verdict");
            need(findings, detected, "mismatch.detected = true");
        }
        Status::Explained => {
            need(findings, told.any(|verdict| verdict.physics.is_named()), "a primary verdict with a named physics");
            need(findings, report.corrected_model.is_some(), "corrected_model");
            need(findings, detected, "mismatch.detected = true");
        }
        Status::PartlyExplained => {
            need(findings, told.any(|verdict| verdict.physics == Physics::Unmodelled), "a primary verdict `unmodelled`");
            need(findings, report.verdicts.len() >= 2, "at least two verdicts");
            need(findings, detected, "mismatch.detected = true");
        }
        Status::InsufficientData => {}
    }
    findings.demand(report.schema_version == SCHEMA_VERSION, || {
        format!("schema_version: is {}, expected {SCHEMA_VERSION}", report.schema_version)
    });
    let (ours, theirs) = (&vocabulary().version, &report.tool.vocabulary_version);
    findings.demand(ours == theirs, || format!("tool.vocabulary_version: is {theirs}, this release has {ours}"));
    findings.demand(!report.summary.is_empty(), || "summary: is empty".to_owned());
    for verdict in &report.verdicts {
        verdict_needs(verdict, findings);
    }
}

fn verdict_needs(verdict: &Verdict, findings: &mut Findings) {
    let place = format!("verdict {} ({})", verdict.rank, verdict.physics);
    let mut need = |holds: bool, what: &str| findings.demand(holds, || format!("{place}: {what}"));
    if !verdict.physics.is_named() {
        need(verdict.parameters.is_empty(), "has parameters; it can have none");
        need(verdict.corrected_model.is_none(), "has a corrected_model; it can have none");
    }
    if verdict.physics == Physics::Unmodelled {
        need(!verdict.evidence.is_empty(), "needs evidence");
    }
    if verdict.physics.is_named() && verdict.is_primary() {
        need(!verdict.parameters.is_empty(), "needs parameters");
        need(!verdict.fit.is_empty(), "needs a fit");
        need(!verdict.evidence.is_empty(), "needs evidence");
        need(verdict.corrected_model.is_some(), "needs a corrected_model");
    }
    let open = verdict.is_primary() && !verdict.confusable_with.is_empty();
    need(!open || verdict.suggested_experiment.is_some(), "can be confused; needs a suggested_experiment");
    need(!verdict.location.regime.is_empty(), "needs a regime in its location");
}
