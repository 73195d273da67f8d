//! All figures of a trial, and the targets of the design.

use crate::confusion::{Confusion, confusion};
use crate::figures::{Bin, Figures, Outside, Pairs, calibration, calibration_error};
use crate::judge::{Judged, NO_REPORT};
use crate::statistics::{Quantile, Rate, bootstrap, clopper_upper};
use serde::Serialize;
use std::collections::BTreeMap;

/// Figures of one group, with what makes it one.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// What the group has in common.
    pub name: String,
    /// Block, where it is of one block.
    pub block: String,
    /// Severity; 0 where it is over several.
    pub level: f64,
    /// Figures.
    pub figures: Figures,
}

/// Figures of null cases.
#[derive(Clone, Debug, Serialize)]
pub struct Nulls {
    /// Block, where it is of one block.
    pub block: String,
    /// Noise scale; 0 for all.
    pub noise: f64,
    /// Alarms.
    pub alarms: Rate,
    /// One-sided upper bound of 95 % (Clopper and Pearson).
    pub upper95: f64,
}

/// A target of the design and what was reached.
#[derive(Clone, Debug, Serialize)]
pub struct Target {
    /// In words.
    pub name: String,
    /// Severity, 0 where it has none.
    pub level: f64,
    /// Bounds that the figure must keep.
    pub wanted: [f64; 2],
    /// Reached.
    pub reached: f64,
    /// Interval of 95 %.
    pub ci95: [f64; 2],
    /// Number of cases behind it.
    pub of: usize,
    /// Within the bounds.
    pub met: bool,
}

/// Everything.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// Cases in the manifest of truths.
    pub cases: usize,
    /// Of them without a report.
    pub without_report: usize,
    /// SHA-256 of the manifest of truths.
    pub truth_manifest_sha256: String,
    /// SHA-256 of the manifest of reports.
    pub report_manifest_sha256: String,
    /// The targets.
    pub targets: Vec<Target>,
    /// By block and severity.
    pub blocks: Vec<Group>,
    /// Single effects of severity 1 or more, by physics.
    pub physics: Vec<Group>,
    /// Single effects of severity 1 and 3, by noise, arm and law of friction.
    pub conditions: Vec<Group>,
    /// Null cases.
    pub nulls: Vec<Nulls>,
    /// Pairs.
    pub pairs: Vec<Pairs>,
    /// Outside the library.
    pub outside: Vec<Outside>,
    /// Stated and observed probability.
    pub calibration: Vec<Bin>,
    /// Mean distance between them.
    pub calibration_error: f64,
    /// Names by truth.
    pub confusion: Confusion,
    /// Seconds per case: median and 90th percentile.
    pub seconds: [Quantile; 2],
    /// Every case.
    pub judged: Vec<Judged>,
}

/// Severities in which groups are formed.
const LEVELS: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];

/// Blocks of single effects are all but these.
const OTHERS: [&str; 3] = ["null", "pairs", "outside"];

/// Adds everything up.
pub fn score(judged: Vec<Judged>, [truth_manifest_sha256, report_manifest_sha256]: [String; 2]) -> Score {
    let pick = |test: &dyn Fn(&Judged) -> bool| -> Vec<&Judged> { judged.iter().filter(|case| test(case)).collect() };
    let of_block = |block: &str, level: f64| pick(&|case| case.block == block && case.level == level);
    let is_single = |case: &Judged| case.block == "single";

    let mut names: Vec<&str> = judged.iter().map(|case| case.block.as_str()).filter(|block| !OTHERS.contains(block)).collect();
    names.sort_by_key(|block| (*block != "single", *block));
    names.dedup();
    let mut blocks = Vec::new();
    for block in names {
        for level in LEVELS {
            push(&mut blocks, &format!("{block}, severity {level}"), block, level, &of_block(block, level));
        }
    }

    let strong = |case: &Judged| case.level >= 1.0 && !OTHERS.contains(&case.block.as_str());
    let mut by_physics: BTreeMap<&str, Vec<&Judged>> = BTreeMap::new();
    for case in judged.iter().filter(|case| strong(case)) {
        by_physics.entry(&case.truth[0]).or_default().push(case);
    }
    let mut physics = Vec::new();
    for (name, cases) in &by_physics {
        push(&mut physics, name, "", 0.0, cases);
    }

    let mut conditions = Vec::new();
    let counted = |case: &Judged| is_single(case) && (case.level == 1.0 || case.level == 3.0);
    for noise in [1.0, 2.0, 4.0] {
        push(&mut conditions, &format!("noise x {noise}"), "single", 0.0, &pick(&|case| counted(case) && case.noise == noise));
    }
    for (name, robot) in [("RAVEN-like arm", "raven"), ("other arms", "variant")] {
        push(&mut conditions, name, "single", 0.0, &pick(&|case| counted(case) && case.robot == robot));
    }
    for (name, law) in [("smooth dry friction", "smooth"), ("bristles that hold at rest", "bristle")] {
        push(&mut conditions, name, "single", 0.0, &pick(&|case| counted(case) && case.dry_law == law));
    }

    let nulls = [("", 0.0), ("null", 1.0), ("null", 2.0), ("null", 4.0), ("poor", 0.0), ("faulty", 0.0)].map(|(block, noise)| {
        let meant = |case: &Judged| (block.is_empty() || case.block == block) && (noise == 0.0 || case.noise == noise);
        let alarms = Rate::of(
            // Who gives no report has not said that there is nothing.
            pick(&|case| case.truth == ["none"] && meant(case)).iter().map(|case| case.detected || case.status == NO_REPORT),
        );
        Nulls { block: block.to_owned(), noise, alarms, upper95: clopper_upper(alarms.hits, alarms.of) }
    });
    let pairs = LEVELS.map(|level| Pairs::of(level, &of_block("pairs", level)));
    let outside_cases = pick(&|case| case.truth == ["unmodelled"]);
    let outside = if outside_cases.is_empty() { Vec::new() } else { vec![Outside::of("all", &outside_cases)] };
    let bins = calibration(&judged);
    let confusion = confusion(judged.iter());
    let seconds: Vec<f64> = judged.iter().filter_map(|case| case.seconds).collect();
    let seconds = [bootstrap(&seconds, 0.5), bootstrap(&seconds, 0.9)];
    let pairs: Vec<_> = pairs.into_iter().filter(|pair| pair.cases > 0).collect();
    let nulls: Vec<_> = nulls.into_iter().filter(|null| null.alarms.of > 0).collect();
    let targets = targets(&blocks, &nulls, &pairs, &outside);
    Score {
        cases: judged.len(),
        without_report: judged.iter().filter(|case| case.status == "no report").count(),
        truth_manifest_sha256,
        report_manifest_sha256,
        targets,
        blocks,
        physics,
        conditions,
        nulls,
        pairs,
        outside,
        calibration_error: calibration_error(&bins),
        calibration: bins,
        confusion,
        seconds,
        judged,
    }
}

fn push(groups: &mut Vec<Group>, name: &str, block: &str, level: f64, cases: &[&Judged]) {
    if !cases.is_empty() {
        groups.push(Group { name: name.to_owned(), block: block.to_owned(), level, figures: Figures::of(cases) });
    }
}

/// The table of section 9 of the design.
fn targets(blocks: &[Group], nulls: &[Nulls], pairs: &[Pairs], outside: &[Outside]) -> Vec<Target> {
    let mut targets = Vec::new();
    let mut add = |name: &str, level: f64, wanted: [f64; 2], reached: f64, ci95: [f64; 2], of: usize| {
        if of > 0 {
            // A fit may come out below its floor: more than all is removed.
            let met = (wanted[0]..=wanted[1]).contains(&reached.min(1.0));
            targets.push(Target { name: name.to_owned(), level, wanted, reached, ci95, of, met });
        }
    };
    for (k, level) in [1.0, 3.0].into_iter().enumerate() {
        let Some(group) = blocks.iter().find(|group| group.block == "single" && group.level == level) else { continue };
        let figures = &group.figures;
        let mut rate = |name: &str, least: [f64; 2], rate: &Rate| add(name, level, [least[k], 1.0], rate.share, rate.ci95, rate.of);
        rate("mismatch seen", [0.95, 0.99], &figures.detected);
        rate("joint right", [0.95, 0.99], &figures.joint);
        rate("first name right", [0.80, 0.90], &figures.top);
        rate("name in the set", [0.92, 0.97], &figures.in_set);
        let error = &figures.error_median;
        add("median parameter error", level, [0.0, [0.2, 0.1][k]], error.value, error.ci95, error.of);
        add("intervals that hold the truth", level, [0.90, 0.98], figures.covered.share, figures.covered.ci95, figures.covered.of);
        let removed = &figures.removed;
        add("share removed on held-out data, median", level, [[0.6, 0.9][k], 1.0], removed.value, removed.ci95, removed.of);
    }
    for (level, least) in [(1.0, 0.5), (3.0, 0.75)] {
        if let Some(pair) = pairs.iter().find(|pair| pair.level == level) {
            add("pairs: both named", level, [least, 1.0], pair.both.share, pair.both.ci95, pair.both.of);
        }
    }
    if let Some(null) = nulls.first() {
        add("false alarms on nulls", 0.0, [0.0, 0.01], null.alarms.share, null.alarms.ci95, null.alarms.of);
    }
    if let Some(all) = outside.first() {
        add("outside the library: refused", 0.0, [0.8, 1.0], all.refused.share, all.refused.ci95, all.refused.of);
        add("outside the library: one wrong name", 0.0, [0.0, 0.1], all.wrong_name.share, all.wrong_name.ci95, all.wrong_name.of);
    }
    targets
}
