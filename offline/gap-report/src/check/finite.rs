//! NaN and infinity nowhere. JSON has no word for them, so they would silently become `null`.

use serde_json::Value;

use super::Findings;
use crate::{Fit, Report};

/// Keys that may be null.
const NULLABLE: [&str; 4] = ["corrected_model", "suggested_experiment", "noise_floor", "removed_fraction"];

pub(super) fn check(report: &Report, findings: &mut Findings) {
    match serde_json::to_value(report) {
        Ok(value) => nulls(&value, "report", "", findings),
        Err(error) => findings.0.push(format!("report: cannot be written as JSON: {error}")),
    }
    // Those that may be null are looked at before they are written.
    let of_verdicts = report.verdicts.iter().flat_map(|verdict| &verdict.fit);
    for fit in of_verdicts.chain(report.remaining.fit.iter().flatten()) {
        let Fit { quantity, noise_floor, removed_fraction, .. } = fit;
        for (name, value) in [("noise_floor", noise_floor), ("removed_fraction", removed_fraction)] {
            findings.demand(value.is_none_or(f64::is_finite), || not_finite(&format!("fit of {quantity}: {name}")));
        }
    }
    for excess in &report.mismatch.excess_rms {
        findings.demand(excess.noise_floor.is_finite(), || not_finite(&format!("excess_rms of {}: noise_floor", excess.channel)));
    }
}

fn not_finite(place: &str) -> String {
    format!("{place}: is NaN or infinite; leave it out or write a number")
}

fn nulls(value: &Value, place: &str, key: &str, findings: &mut Findings) {
    match value {
        // Further keys are the writer's own.
        _ if key.starts_with("x_") => {}
        Value::Null => findings.demand(NULLABLE.contains(&key), || not_finite(place)),
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                nulls(item, &format!("{place}[{i}]"), "", findings);
            }
        }
        Value::Object(object) => {
            for (key, value) in object {
                nulls(value, &format!("{place}.{key}"), key, findings);
            }
        }
        _ => {}
    }
}
