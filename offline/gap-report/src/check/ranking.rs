//! Order and probabilities of the verdicts.

use std::collections::BTreeMap;

use super::Findings;
use crate::{Report, Verdict};

/// For sums of probabilities.
const ROUNDING: f64 = 1e-6;

pub(super) fn check(report: &Report, findings: &mut Findings) {
    for (expected, verdict) in (1..).zip(&report.verdicts) {
        findings.demand(verdict.rank == expected, || {
            format!("verdicts: rank {} stands at place {expected}; sort by rank, 1, 2, 3, ...", verdict.rank)
        });
    }
    let mut effects: BTreeMap<u64, Vec<&Verdict>> = BTreeMap::new();
    for verdict in &report.verdicts {
        effects.entry(verdict.effect).or_default().push(verdict);
        probabilities(verdict, findings);
    }
    for (effect, verdicts) in effects {
        let primaries = verdicts.iter().filter(|verdict| verdict.is_primary()).count();
        findings.demand(primaries == 1, || format!("effect {effect}: has {primaries} primary verdicts, expected exactly one"));
        let sum: f64 = verdicts.iter().map(|verdict| verdict.probability).sum();
        findings.demand(sum <= 1.0 + ROUNDING, || format!("effect {effect}: probabilities add up to {sum}, at most 1 is possible"));
    }
}

fn probabilities(verdict: &Verdict, findings: &mut Findings) {
    let place = format!("verdict {} ({})", verdict.rank, verdict.physics);
    let (one, set) = (verdict.probability, verdict.set_probability);
    findings.demand((0.0..=1.0).contains(&one), || format!("{place}: probability {one} is not within 0 to 1"));
    if let Some(set) = set {
        findings.demand((0.0..=1.0).contains(&set), || format!("{place}: set_probability {set} is not within 0 to 1"));
        findings.demand(set >= one - ROUNDING, || {
            format!("{place}: set_probability {set} is below its own probability {one}; the set holds it")
        });
    }
}
