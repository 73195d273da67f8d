//! Numbers that depend on one another: intervals hold their values, fractions follow from what they are made of, parameters are
//! those of the vocabulary.

use super::Findings;
use crate::{Fit, Metric, Parameter, Physics, Report, removed_fraction, vocabulary};

/// Reports may give three digits.
const ROUNDING: f64 = 2e-3;

pub(super) fn check(report: &Report, findings: &mut Findings) {
    for verdict in &report.verdicts {
        let place = format!("verdict {} ({})", verdict.rank, verdict.physics);
        for parameter in &verdict.parameters {
            named(&verdict.physics, parameter, &place, findings);
            holds(parameter.ci95, parameter.value, &format!("{place}, {}: ci95", parameter.name), findings);
        }
        for fit in &verdict.fit {
            fraction(fit, &place, findings);
        }
        for test in &verdict.evidence {
            if let Some((effect, ci95)) = test.effect.as_ref().and_then(|effect| Some((effect, effect.ci95?))) {
                holds(ci95, effect.value, &format!("{place}, {}: ci95", test.test), findings);
            }
            for p in test.p_value.iter().chain(&test.q_value) {
                share(*p, &format!("{place}, {}: p or q value", test.test), findings);
            }
        }
        let location = &verdict.location;
        let regimes = location.regime.iter().flat_map(|regime| [regime.energy_share, regime.q_value]);
        let shares = [location.energy_share, location.confidence, location.workspace_region.energy_share];
        let overlaps = verdict.confusable_with.iter().map(|other| other.overlap);
        for value in regimes.chain(shares).chain(overlaps).flatten() {
            share(value, &format!("{place}: a share or probability"), findings);
        }
    }
    for fit in report.remaining.fit.iter().flatten() {
        fraction(fit, "remaining", findings);
    }
    let calibration = &report.calibration;
    let others = [report.mismatch.p_value, report.remaining.explained_share, calibration.false_alarm_upper95];
    for value in others.into_iter().flatten() {
        share(value, "mismatch, remaining or calibration: a share or probability", findings);
    }
}

fn share(value: f64, place: &str, findings: &mut Findings) {
    // NaN is told elsewhere.
    findings.demand(value.is_nan() || (0.0..=1.0).contains(&value), || format!("{place}: {value} is not within 0 to 1"));
}

fn holds([low, high]: [f64; 2], value: f64, place: &str, findings: &mut Findings) {
    let finite = low.is_finite() && high.is_finite() && value.is_finite();
    findings.demand(!finite || (low <= value && value <= high), || format!("{place}: [{low}, {high}] does not hold {value}"));
}

fn named(physics: &Physics, parameter: &Parameter, place: &str, findings: &mut Findings) {
    let Some(hypothesis) = vocabulary().of(physics) else { return };
    match hypothesis.parameter(&parameter.name) {
        None => {
            let known: Vec<&str> = hypothesis.parameters.iter().map(|known| known.name.as_str()).collect();
            let (name, known) = (&parameter.name, known.join(", "));
            findings.0.push(format!("{place}: `{name}` is no parameter of it in the vocabulary, which has {known}"));
        }
        Some(spec) => findings.demand(spec.units().any(|unit| unit == parameter.unit), || {
            format!("{place}, {}: the unit is `{}`, the vocabulary has {}", parameter.name, parameter.unit, spec.unit)
        }),
    }
}

fn fraction(fit: &Fit, place: &str, findings: &mut Findings) {
    let place = format!("{place}, fit of {}", fit.quantity);
    let Some(given) = fit.removed_fraction else { return };
    if let Some(ci95) = fit.removed_fraction_ci95 {
        holds(ci95, given, &format!("{place}: removed_fraction_ci95"), findings);
    }
    if fit.metric != Metric::Rms {
        return;
    }
    match fit.noise_floor.map(|floor| removed_fraction(fit.before, fit.after, floor)) {
        Some(Some(right)) => findings.demand((right - given).abs() <= ROUNDING * right.abs().max(1.0), || {
            format!("{place}: removed_fraction is {given}, 1 - (after^2-floor^2)/(before^2-floor^2) is {right:.4}")
        }),
        Some(None) => findings.0.push(format!("{place}: removed_fraction is {given} though nothing lies above the noise floor")),
        None => findings.0.push(format!("{place}: removed_fraction is {given} though the noise floor is unknown")),
    }
}
