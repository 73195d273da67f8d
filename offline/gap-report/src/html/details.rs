//! What is folded: runs, method, where everything came from.

use super::effect::alternatives;
use super::tags::{around, folded, list, table, text};
use crate::text::{as_given, capital, count, duration, percent, short, significance};
use crate::{Evidence, Level, Report, Run, RunRole, Verdict, quality_headline};

/// All of it.
pub(super) fn details(report: &Report) -> String {
    let checks: Vec<String> = report.quality(Level::Ok).map(quality_headline).collect();
    let parts = [
        folded("Runs", &runs(report)),
        folded("Checks of the data that were passed", &list("ul", checks)),
        folded("Alternatives in numbers", &alternatives(report)),
        folded("Method and evidence", &method(report)),
        folded("Where this comes from", &provenance(report)),
    ];
    around("div", "folds", &parts.concat()) + &footer(report)
}

fn runs(report: &Report) -> String {
    let row = |run: &Run| {
        let used = match (run.samples_used, run.samples) {
            (Some(used), Some(all)) => format!("{} of {}", count(used), count(all)),
            (None, Some(all)) => count(all),
            _ => String::new(),
        };
        let part = run
            .held_out_interval
            .as_ref()
            .map_or_else(String::new, |part| format!(" {:.1}\u{2013}{:.1} s", part.start_s, part.end_s));
        vec![
            run.id.clone(),
            format!("{}{part}", plain_role(run.role)),
            duration(run.duration_s),
            format!("{} Hz", short(run.rate_hz)),
            used,
        ]
    };
    table(2, &["Run", "Used for", "Duration", "Rate", "Samples"], report.inputs.runs.iter().map(row).collect())
}

fn plain_role(role: RunRole) -> &'static str {
    match role {
        RunRole::Train => "fitting",
        RunRole::HeldOut => "judging (held out)",
        RunRole::Split => "fitting; judging",
        RunRole::Null => "comparing (nothing missing)",
        RunRole::Calibration => "calibration",
    }
}

fn method(report: &Report) -> String {
    let mut out: String = report.verdicts.iter().map(evidence_of).collect();
    let (calibration, remaining) = (&report.calibration, &report.remaining);
    let mut facts = vec![
        ("Evidence that is asked for", format!("{} nats on held-out data", short(calibration.threshold_nats))),
        ("Tried on data without effect", format!("{} cases", count(calibration.null_runs))),
    ];
    facts.extend(calibration.false_alarm_upper95.map(|share| ("False alarms", format!("below {} (95 % sure)", percent(share)))));
    facts.extend(calibration.probability_temperature.map(|t| ("Temperature of the probabilities", short(t))));
    facts.extend(calibration.source.clone().map(|source| ("Calibrated with", source)));
    facts.extend(report.mismatch.p_value.map(|p| ("p value of a mismatch", significance(p))));
    facts.push(("Gain of all named effects", format!("{} nats", short(remaining.library_gain_nats))));
    facts.push(("Gain of a flexible predictor", format!("{} nats", short(remaining.flexible_gain_nats))));
    facts.push(("Time", times(report)));
    out += &text("h3", "", "Calibration and time");
    out + &list_of(facts.iter().map(|(name, value)| (*name, value.as_str())))
}

fn evidence_of(verdict: &Verdict) -> String {
    if verdict.evidence.is_empty() {
        return String::new();
    }
    let row = |test: &Evidence| {
        let effect = test.effect.as_ref().map_or_else(String::new, |effect| as_given(effect.value, &effect.unit));
        vec![
            capital(&test.claim),
            test.test.clone(),
            format!("{} {}", short(test.statistic), test.statistic_name),
            test.p_value.map_or_else(String::new, significance),
            effect,
        ]
    };
    let score = verdict
        .score
        .as_ref()
        .map_or_else(String::new, |score| format!(" Gain {} \u{b1} {} nats.", short(score.gain_nats), short(score.gain_se)));
    let heading = format!("{}.{score}", capital(verdict.physics.plain()));
    let header = ["What it shows", "Test", "Statistic", "p", "Effect"];
    text("h3", "", &heading) + &around("div", "wrap", &table(2, &header, verdict.evidence.iter().map(row).collect()))
}

fn times(report: &Report) -> String {
    let timing = &report.timing;
    let part = |name: &str, value: Option<f64>| value.map(|value| format!("{name} {}", duration(value)));
    let parts: Vec<String> = [
        part("reading", timing.read_s),
        part("screening", timing.screen_s),
        part("fitting", timing.fit_s),
        part("simulating", timing.simulate_s),
        timing.threads.map(|threads| format!("{threads} threads")),
    ]
    .into_iter()
    .flatten()
    .collect();
    let of_it = if parts.is_empty() { String::new() } else { format!(" ({})", parts.join(", ")) };
    format!("{}{of_it}", duration(timing.total_s))
}

fn provenance(report: &Report) -> String {
    let (tool, inputs) = (&report.tool, &report.inputs);
    let revision = tool.revision.as_ref().map_or_else(String::new, |revision| format!(", revision {revision}"));
    let mut facts = vec![
        ("Report".to_owned(), report.report_id.clone()),
        ("Written".to_owned(), report.created.clone()),
        ("Program".to_owned(), format!("{} {}{revision}", tool.name, tool.version)),
        ("Vocabulary".to_owned(), tool.vocabulary_version.clone()),
        ("Seed".to_owned(), tool.seed.to_string()),
        ("Access to the simulator".to_owned(), inputs.simulator.access.name().replace('_', " ")),
        (
            "Channels".to_owned(),
            inputs.channels.iter().map(|channel| channel.name().replace('_', " ")).collect::<Vec<_>>().join(", "),
        ),
        ("Configuration, SHA-256".to_owned(), tool.config_sha256.clone()),
    ];
    facts.extend(inputs.robot.urdf_sha256.clone().map(|hash| ("URDF, SHA-256".to_owned(), hash)));
    for run in &inputs.runs {
        facts.push((format!("{}, SHA-256", run.id), run.sha256.clone()));
        facts.extend(run.sim_sha256.clone().map(|hash| (format!("{}, simulated, SHA-256", run.id), hash)));
    }
    if let Some(case) = &report.sealed_case {
        facts.push(("Sealed case".to_owned(), case.case_id.clone()));
        facts.push(("Commitment to its truth".to_owned(), case.truth_commitment.clone()));
    }
    let models = report.corrected_model.iter().chain(report.told().filter_map(|verdict| verdict.corrected_model.as_ref()));
    for model in models {
        let hash = model.sha256.as_ref().map_or_else(String::new, |hash| format!(" ({hash})"));
        facts.push(("Corrected model".to_owned(), format!("{}{hash}", model.path)));
    }
    list_of(facts.iter().map(|(name, value)| (name.as_str(), value.as_str())))
}

fn list_of<'a>(facts: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let one = |(name, value): (&str, &str)| text("dt", "", name) + &text("dd", "", value);
    around("dl", "facts", &facts.map(one).collect::<String>())
}

fn footer(report: &Report) -> String {
    let model = report
        .corrected_model
        .as_ref()
        .map_or_else(String::new, |model| format!(" The corrected model is {}: give it to --robot.", model.path));
    let said = format!("{} {}.{model} Research software, no clinical use.", report.tool.name, report.tool.version);
    around("footer", "", &text("p", "fine", &said))
}
