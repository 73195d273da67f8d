//! What a group of cases says.

use crate::judge::{Judged, NO_REPORT};
use crate::statistics::{Quantile, Rate, bootstrap};
use serde::Serialize;

/// Figures of one group of cases with effects.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Figures {
    /// Number of cases.
    pub cases: usize,
    /// A mismatch was seen.
    pub detected: Rate,
    /// Joint right, of effects that have one.
    pub joint: Rate,
    /// First name right.
    pub top: Rate,
    /// First name right and nothing else named.
    pub alone: Rate,
    /// Truth within the first set.
    pub in_set: Rate,
    /// Mean number of names in the first set, of cases where one was given.
    pub set_size: f64,
    /// Relative parameter error, median; of cases with name and joint right.
    pub error_median: Quantile,
    /// Relative parameter error, 90th percentile.
    pub error_p90: Quantile,
    /// Stated intervals that hold the truth; parameters called not identifiable left out.
    pub covered: Rate,
    /// Share removed on held-out data, median; of cases with the name right.
    pub removed: Quantile,
    /// Overlap of stated and true stretch of time, median; of effects that come or go and are rightly named.
    pub overlap: Quantile,
    /// Seconds per case, median.
    pub seconds: Quantile,
}

impl Figures {
    /// Of the given cases.
    pub fn of(cases: &[&Judged]) -> Self {
        let rate = |test: &dyn Fn(&Judged) -> bool| Rate::of(cases.iter().map(|case| test(case)));
        let values = |value: &dyn Fn(&Judged) -> Option<f64>| -> Vec<f64> { cases.iter().filter_map(|case| value(case)).collect() };
        let parameters: Vec<_> = cases.iter().flat_map(|case| &case.parameters).filter(|parameter| !parameter.disowned).collect();
        let errors: Vec<f64> = parameters.iter().map(|parameter| parameter.error).collect();
        let sets = values(&|case| (case.set_size > 0).then_some(case.set_size as f64));
        Self {
            cases: cases.len(),
            detected: rate(&|case| case.detected),
            joint: Rate::of(cases.iter().filter_map(|case| case.joint)),
            top: rate(&|case| case.top),
            alone: rate(&|case| case.alone),
            in_set: rate(&|case| case.in_set),
            set_size: sets.iter().sum::<f64>() / sets.len().max(1) as f64,
            error_median: bootstrap(&errors, 0.5),
            error_p90: bootstrap(&errors, 0.9),
            covered: Rate::of(parameters.iter().map(|parameter| parameter.covered)),
            removed: bootstrap(&values(&|case| case.removed), 0.5),
            overlap: bootstrap(&values(&|case| case.overlap), 0.5),
            seconds: bootstrap(&values(&|case| case.seconds), 0.5),
        }
    }
}

/// Figures of pairs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Pairs {
    /// Severity.
    pub level: f64,
    /// Number of cases.
    pub cases: usize,
    /// Both names given, in distinct verdicts.
    pub both: Rate,
    /// Both, and no other.
    pub alone: Rate,
    /// Both within distinct sets.
    pub both_in_set: Rate,
    /// At least one name given.
    pub one: Rate,
    /// A mismatch was seen.
    pub detected: Rate,
}

impl Pairs {
    /// Of the given cases.
    pub fn of(level: f64, cases: &[&Judged]) -> Self {
        let rate = |test: &dyn Fn(&Judged) -> bool| Rate::of(cases.iter().map(|case| test(case)));
        Self {
            level,
            cases: cases.len(),
            both: rate(&|case| case.named == 2),
            alone: rate(&|case| case.named == 2 && case.alone),
            both_in_set: rate(&|case| case.named_in_set == 2),
            one: rate(&|case| case.named >= 1),
            detected: rate(&|case| case.detected),
        }
    }
}

/// Figures of effects outside the library.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Outside {
    /// Name, or `all`.
    pub physics: String,
    /// Answer `unmodelled` or `partly_explained`.
    pub refused: Rate,
    /// One name given, as if it were certain.
    pub wrong_name: Rate,
    /// Several names given that the data cannot tell apart.
    pub wrong_set: Rate,
    /// Nothing seen.
    pub missed: Rate,
}

impl Outside {
    /// Of the given cases.
    pub fn of(physics: &str, cases: &[&Judged]) -> Self {
        let rate = |test: &dyn Fn(&Judged) -> bool| Rate::of(cases.iter().map(|case| test(case)));
        Self {
            physics: physics.to_owned(),
            refused: rate(&|case| ["unmodelled", "partly_explained"].contains(&case.status.as_str())),
            wrong_name: rate(&|case| case.status == NO_REPORT || (case.status == "explained" && case.set_size == 1)),
            wrong_set: rate(&|case| case.status == "explained" && case.set_size > 1),
            missed: rate(&|case| !["unmodelled", "partly_explained", "explained"].contains(&case.status.as_str())),
        }
    }
}

/// Claims of about one probability.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Bin {
    /// Bounds of the stated probability.
    pub range: [f64; 2],
    /// Its mean.
    pub stated: f64,
    /// Share that was right.
    pub right: Rate,
}

/// The curve of stated against observed, in tenths, without empty bins.
pub fn calibration(cases: &[Judged]) -> Vec<Bin> {
    let claims: Vec<_> = cases.iter().flat_map(|case| &case.claims).collect();
    (0..10)
        .filter_map(|tenth| {
            let range = [tenth as f64 / 10.0, (tenth + 1) as f64 / 10.0];
            let within: Vec<_> = claims.iter().filter(|c| ((c.probability * 10.0) as usize).min(9) == tenth).collect();
            let stated = within.iter().map(|claim| claim.probability).sum::<f64>() / within.len().max(1) as f64;
            (!within.is_empty()).then(|| Bin { range, stated, right: Rate::of(within.iter().map(|claim| claim.right)) })
        })
        .collect()
}

/// Mean distance of stated and observed over all claims.
pub fn calibration_error(bins: &[Bin]) -> f64 {
    let total: usize = bins.iter().map(|bin| bin.right.of).sum();
    bins.iter().map(|bin| bin.right.of as f64 * (bin.stated - bin.right.share).abs()).sum::<f64>() / total.max(1) as f64
}
