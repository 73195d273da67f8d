//! The figures as tables, and the tables as Markdown and plain text.

use crate::figures::Figures;
use crate::score::{Group, Score};
use crate::statistics::{Quantile, Rate};
use crate::vocabulary::spoken;
use std::fmt::Write;

/// A table of words.
#[derive(Clone, Debug)]
pub struct Table {
    /// Headline.
    pub title: String,
    /// What to know for reading it.
    pub note: String,
    /// First row.
    pub head: Vec<String>,
    /// The others.
    pub rows: Vec<Vec<String>>,
}

fn percent(x: f64) -> String {
    format!("{:.0}", 100.0 * x)
}

/// `97 % (93-99), 66`
fn rate(rate: &Rate) -> String {
    if rate.of == 0 {
        return "-".into();
    }
    format!("{} % ({}-{}) of {}", percent(rate.share), percent(rate.ci95[0]), percent(rate.ci95[1]), rate.of)
}

fn share(value: &Quantile) -> String {
    if value.of == 0 {
        return "-".into();
    }
    format!("{} % ({}-{}) of {}", percent(value.value), percent(value.ci95[0]), percent(value.ci95[1]), value.of)
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

fn groups(title: &str, note: &str, groups: &[Group]) -> Table {
    let head = ["group", "cases", "mismatch seen", "joint right", "first name right", "and no other named", "name in the set"];
    let more =
        ["names in the set", "parameter error, median", "90th", "interval holds the truth", "removed, median", "time overlap"];
    let row = |group: &Group| {
        let f: &Figures = &group.figures;
        let rates = [&f.detected, &f.joint, &f.top, &f.alone, &f.in_set].map(rate);
        let mut row = vec![spoken(&group.name), f.cases.to_string()];
        row.extend(rates);
        row.push(format!("{:.1}", f.set_size));
        row.extend([share(&f.error_median), share(&f.error_p90), rate(&f.covered), share(&f.removed), share(&f.overlap)]);
        row
    };
    let mut head = words(&head);
    head.extend(words(&more));
    Table { title: title.into(), note: note.into(), head, rows: groups.iter().map(row).collect() }
}

/// All tables of a score.
pub fn tables(score: &Score) -> Vec<Table> {
    let mut tables = Vec::new();
    let target = |t: &crate::score::Target| {
        let wanted = match t.wanted {
            [low, high] if high >= 1.0 => format!("at least {} %", percent(low)),
            [low, high] if low <= 0.0 => format!("at most {} %", percent(high)),
            [low, high] => format!("{} to {} %", percent(low), percent(high)),
        };
        let level = if t.level == 0.0 { "any".into() } else { format!("{}", t.level) };
        let reached = format!("{:.1} % ({:.1}-{:.1}) of {}", 100.0 * t.reached, 100.0 * t.ci95[0], 100.0 * t.ci95[1], t.of);
        vec![t.name.clone(), level, wanted, reached, if t.met { "met" } else { "missed" }.into()]
    };
    tables.push(Table {
        title: "Targets".into(),
        note: "In parentheses the 95 % interval: Wilson's for shares, bootstrap's for medians.".into(),
        head: words(&["figure", "severity", "wanted", "reached", "verdict"]),
        rows: score.targets.iter().map(target).collect(),
    });
    let note = "Severity is the RMS of the effect in its main channel over the RMS of the noise there. Parameters are judged where name \
                and joint are right.";
    tables.push(groups("By block and severity", note, &score.blocks));
    tables.push(groups("By physics", "Single effects of severity 1 and more, all blocks.", &score.physics));
    tables.push(groups("By condition", "Block `single`, severities 1 and 3.", &score.conditions));
    tables.push(Table {
        title: "False alarms".into(),
        note: "Null cases; the bound is Clopper and Pearson's, one-sided 95 %.".into(),
        head: words(&["nulls", "alarms", "at most"]),
        rows: score
            .nulls
            .iter()
            .map(|null| {
                let which = match (null.block.as_str(), null.noise) {
                    ("", _) => "all".into(),
                    (block, 0.0) => format!("`{block}`"),
                    (_, noise) => format!("noise x {noise}"),
                };
                vec![which, format!("{} of {}", null.alarms.hits, null.alarms.of), format!("{:.1} %", 100.0 * null.upper95)]
            })
            .collect(),
    });
    tables.push(Table {
        title: "Pairs".into(),
        note: String::new(),
        head: words(&[
            "severity",
            "cases",
            "both named",
            "and no other named",
            "both in sets",
            "at least one named",
            "mismatch seen",
        ]),
        rows: score
            .pairs
            .iter()
            .map(|p| {
                let rates = [&p.both, &p.alone, &p.both_in_set, &p.one, &p.detected].map(rate);
                [p.level.to_string(), p.cases.to_string()].into_iter().chain(rates).collect()
            })
            .collect(),
    });
    tables.push(Table {
        title: "Outside the library".into(),
        note: "Refused: the answer was `unmodelled` or `partly_explained`.".into(),
        head: words(&["effects", "refused", "one wrong name", "a wrong set", "nothing seen"]),
        rows: score
            .outside
            .iter()
            .map(|o| vec![o.physics.clone(), rate(&o.refused), rate(&o.wrong_name), rate(&o.wrong_set), rate(&o.missed)])
            .collect(),
    });
    tables.push(Table {
        title: "Stated and observed probability".into(),
        note: format!("All primary verdicts. Mean distance {:.3}.", score.calibration_error),
        head: words(&["stated", "mean", "right"]),
        rows: score
            .calibration
            .iter()
            .map(|bin| {
                vec![format!("{}-{} %", percent(bin.range[0]), percent(bin.range[1])), percent(bin.stated) + " %", rate(&bin.right)]
            })
            .collect(),
    });
    tables.retain(|table| !table.rows.is_empty());
    tables
}

/// What was scored, in a sentence.
pub fn opening(score: &Score) -> String {
    let [median, p90] = &score.seconds;
    format!(
        "{} cases, {} without a report (they count as failures). Truths {}, reports {}. The tool took {:.1} s per case, 90th percentile {:.1} s.",
        score.cases,
        score.without_report,
        &score.truth_manifest_sha256[..12.min(score.truth_manifest_sha256.len())],
        &score.report_manifest_sha256[..12.min(score.report_manifest_sha256.len())],
        median.value,
        p90.value
    )
}

/// For the documentation.
pub fn markdown(score: &Score) -> String {
    let mut out = format!("# Concealed-truth trial\n\n{}\n", opening(score));
    for table in tables(score) {
        let _ = write!(out, "\n## {}\n\n", table.title);
        if !table.note.is_empty() {
            let _ = write!(out, "{}\n\n", table.note);
        }
        let _ = writeln!(out, "| {} |\n|{}", table.head.join(" | "), " --- |".repeat(table.head.len()));
        for row in &table.rows {
            let _ = writeln!(out, "| {} |", row.join(" | "));
        }
    }
    let _ = write!(
        out,
        "\n## Names given\n\nTruth in rows; where more than one in ten went to another name.\n\n| truth | cases | right | went to |\n| --- | --- | --- | --- |\n"
    );
    for row in mistaken(score) {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out
}

/// Rows of the confusion matrix in words.
pub fn mistaken(score: &Score) -> Vec<Vec<String>> {
    let names = &score.confusion.names;
    let mut rows = Vec::new();
    for (k, counts) in score.confusion.counts.iter().enumerate() {
        let total: usize = counts.iter().sum();
        let mut others: Vec<(usize, &str)> = counts.iter().zip(names).map(|(&count, name)| (count, name.as_str())).collect();
        others.remove(k);
        others.retain(|(count, _)| count * 10 > total);
        others.sort_by_key(|(count, name)| (usize::MAX - count, *name));
        if total > 0 {
            let went: Vec<_> = others.iter().map(|(count, name)| format!("{} {count}", spoken(name))).collect();
            rows.push(vec![spoken(&names[k]), total.to_string(), counts[k].to_string(), went.join(", ")]);
        }
    }
    rows
}

/// For the terminal: one line per figure of the first tables.
pub fn text(score: &Score) -> String {
    let mut out = opening(score) + "\n";
    for table in tables(score) {
        let _ = write!(out, "\n{}\n", table.title);
        if table.head.len() <= 7 {
            let width = |k: usize| table.rows.iter().chain([&table.head]).map(|row| row[k].chars().count()).max().unwrap_or(0);
            for row in std::iter::once(&table.head).chain(&table.rows) {
                let cells: Vec<_> = row.iter().enumerate().map(|(k, cell)| format!("{cell:<0$}", width(k))).collect();
                let _ = writeln!(out, "  {}", cells.join("  ").trim_end());
            }
        } else {
            for row in &table.rows {
                let figures = table.head.iter().zip(row).skip(2).filter(|(_, cell)| *cell != "-");
                let figures: Vec<_> = figures.map(|(head, cell)| format!("{head} {cell}")).collect();
                let _ = writeln!(out, "  {} ({} cases): {}", row[0], row[1], figures.join("; "));
            }
        }
    }
    out
}
