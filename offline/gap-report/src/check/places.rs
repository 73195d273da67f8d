//! Names that stand for something in the report: runs, joints, files, hashes.

use std::collections::HashSet;

use super::Findings;
use crate::{Artifact, Fit, Interval, Report, Run, RunRole};

pub(super) fn check(report: &Report, findings: &mut Findings) {
    let inputs = &report.inputs;
    let runs: HashSet<&str> = inputs.runs.iter().map(|run| run.id.as_str()).collect();
    let joints: HashSet<&str> = inputs.robot.joints.iter().map(String::as_str).collect();
    findings.demand(!inputs.runs.is_empty(), || "inputs.runs: is empty".to_owned());
    findings.demand(runs.len() == inputs.runs.len(), || "inputs.runs: two runs have the same id".to_owned());
    findings.demand(!joints.is_empty(), || "inputs.robot.joints: is empty".to_owned());
    findings.demand(!inputs.channels.is_empty(), || "inputs.channels: is empty".to_owned());
    for run in &inputs.runs {
        one_run(run, findings);
    }
    for check in report.data_quality.iter().filter_map(|check| check.run.as_ref()) {
        findings.demand(runs.contains(check.as_str()), || format!("data_quality: there is no run `{check}` in inputs.runs"));
    }
    for joint in report.mismatch.excess_rms.iter().filter_map(|excess| excess.joint.as_ref()) {
        findings.demand(joints.contains(joint.as_str()), || no_joint("mismatch.excess_rms", joint));
    }
    for verdict in &report.verdicts {
        let place = format!("verdict {} ({})", verdict.rank, verdict.physics);
        let confusable = verdict.confusable_with.iter().flat_map(|other| other.joint.iter().flatten());
        for joint in verdict.location.joint.iter().chain(confusable) {
            findings.demand(joints.contains(joint.as_str()), || no_joint(&place, joint));
        }
        let distinct: HashSet<&String> = verdict.location.joint.iter().collect();
        findings.demand(distinct.len() == verdict.location.joint.len(), || format!("{place}: names a joint twice"));
        for stretch in &verdict.location.time_intervals {
            findings.demand(runs.contains(stretch.run.as_str()), || {
                format!("{place}: there is no run `{}` in inputs.runs", stretch.run)
            });
            ordered(stretch, &place, findings);
        }
        for fit in &verdict.fit {
            held_out_only(report, fit, &place, findings);
        }
        let experiments =
            verdict.suggested_experiment.iter().filter_map(|experiment| experiment.trajectory.as_ref()?.file.as_ref());
        for file in experiments {
            relative(file, &place, findings);
        }
        for artifact in verdict.corrected_model.iter().chain(&verdict.plots) {
            one_artifact(artifact, &place, findings);
        }
    }
    for fit in report.remaining.fit.iter().flatten() {
        held_out_only(report, fit, "remaining", findings);
    }
    for artifact in report.corrected_model.iter().chain(&report.plots) {
        one_artifact(artifact, "report", findings);
    }
    let sealed = report.sealed_case.iter().flat_map(|case| [Some(&case.truth_commitment), case.manifest_sha256.as_ref()]);
    let hashes = [Some(&report.tool.config_sha256), inputs.robot.urdf_sha256.as_ref()];
    for hash in hashes.into_iter().chain(sealed).flatten() {
        hashed(hash, "report", findings);
    }
}

fn no_joint(place: &str, joint: &str) -> String {
    format!("{place}: there is no joint `{joint}` in inputs.robot.joints")
}

fn one_run(run: &Run, findings: &mut Findings) {
    let place = format!("run `{}`", run.id);
    match (&run.held_out_interval, run.role) {
        (None, RunRole::Split) => findings.0.push(format!("{place}: is split; needs a held_out_interval")),
        (Some(stretch), _) => {
            ordered(stretch, &place, findings);
            findings.demand(stretch.run == run.id, || format!("{place}: its held_out_interval is of run `{}`", stretch.run));
        }
        _ => {}
    }
    hashed(&run.sha256, &place, findings);
    if let Some(hash) = &run.sim_sha256 {
        hashed(hash, &place, findings);
    }
    if let Some(file) = &run.file {
        relative(file, &place, findings);
    }
}

fn ordered(stretch: &Interval, place: &str, findings: &mut Findings) {
    let (start, end) = (stretch.start_s, stretch.end_s);
    findings.demand(start >= 0.0 && start <= end, || format!("{place}: the stretch from {start} to {end} s is not in order"));
}

/// A fit may be judged only on what was not fitted.
fn held_out_only(report: &Report, fit: &Fit, place: &str, findings: &mut Findings) {
    let place = format!("{place}, fit of {}", fit.quantity);
    findings.demand(!fit.on.is_empty(), || format!("{place}: `on` is empty; name the held-out runs"));
    let distinct: HashSet<&String> = fit.on.iter().collect();
    findings.demand(distinct.len() == fit.on.len(), || format!("{place}: names a run twice"));
    for id in &fit.on {
        let role = report.inputs.runs.iter().find(|run| run.id == *id).map(|run| run.role);
        match role {
            Some(RunRole::HeldOut | RunRole::Split) => {}
            Some(role) => {
                findings.0.push(format!("{place}: run `{id}` has the role {role}; fits are judged on held_out or split runs only"))
            }
            None => findings.0.push(format!("{place}: there is no run `{id}` in inputs.runs")),
        }
    }
}

fn one_artifact(artifact: &Artifact, place: &str, findings: &mut Findings) {
    relative(&artifact.path, place, findings);
    if let Some(hash) = &artifact.sha256 {
        hashed(hash, &format!("{place}, {}", artifact.path), findings);
    }
}

/// As the schema has it: no root, no drive letter, no way up.
fn relative(path: &str, place: &str, findings: &mut Findings) {
    let drive = path.as_bytes().first().is_some_and(u8::is_ascii_alphabetic) && path.as_bytes().get(1) == Some(&b':');
    let good = !path.is_empty() && !path.starts_with('/') && !drive && !path.contains("..");
    findings.demand(good, || format!("{place}: `{path}` is not a path relative to the folder of report.json"));
}

fn hashed(hash: &str, place: &str, findings: &mut Findings) {
    let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    findings.demand(hash.len() == 64 && hash.bytes().all(digit), || {
        format!("{place}: `{hash}` is no SHA-256 in 64 lower-case hexadecimal digits")
    });
}
