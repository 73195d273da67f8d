//! `check` catches the violation of every rule, one at a time.

use crate::common;

use gap_report::{Fit, Interval, Parameter, Physics, Report, Role, RunRole, Space, Status, check};

/// No finding.
const NOTHING: [String; 0] = [];

/// A report with one fault must give a finding that says so, and nothing without the fault.
fn caught(says: &str, base: fn() -> Report, fault: impl Fn(&mut Report)) {
    let mut report = base();
    assert_eq!(check(&report), NOTHING);
    fault(&mut report);
    let found = check(&report);
    assert!(found.iter().any(|finding| finding.contains(says)), "expected `{says}`, found {found:#?}");
}

#[test]
fn order_and_probabilities() {
    caught("sort by rank", common::explained, |report| report.verdicts.swap(0, 1));
    caught("sort by rank", common::explained, |report| report.verdicts[2].rank = 5);
    caught("exactly one", common::explained, |report| report.verdicts[1].role = Role::Primary);
    caught("exactly one", common::explained, |report| report.verdicts[2].effect = 1);
    caught("add up to", common::explained, |report| report.verdicts[1].probability = 0.3);
    caught("not within 0 to 1", common::explained, |report| report.verdicts[2].probability = 1.2);
    caught("below its own probability", common::explained, |report| report.verdicts[0].set_probability = Some(0.7));
}

#[test]
fn intervals_hold_their_values() {
    caught("does not hold", common::explained, |report| report.verdicts[0].parameters[0].ci95 = [12.5, 12.9]);
    caught("does not hold", common::explained, |report| report.verdicts[0].parameters[0].ci95 = [12.9, 11.3]);
    caught("does not hold", common::explained, |report| {
        report.verdicts[0].evidence[1].effect.as_mut().expect("effect").ci95 = Some([0.0, 1.0]);
    });
    caught("removed_fraction_ci95", common::explained, |report| {
        report.verdicts[0].fit[0].removed_fraction_ci95 = Some([0.99, 1.0]);
    });
}

#[test]
fn fits_are_judged_on_held_out_runs_only() {
    caught("has the role train", common::explained, |report| report.verdicts[0].fit[0].on.push("run-01".to_owned()));
    caught("no run `run-09`", common::explained, |report| report.verdicts[0].fit[0].on = vec!["run-09".to_owned()]);
    caught("`on` is empty", common::explained, |report| report.verdicts[0].fit[0].on.clear());
    caught("names a run twice", common::explained, |report| report.verdicts[0].fit[0].on.push("run-04".to_owned()));
    caught("has the role null", common::explained_with_failure, |report| {
        let on = vec!["rest".to_owned()];
        report.remaining.fit = Some(vec![Fit::rms("torque", "N.m", Space::EquationError, (1.0, 0.5), None, on)]);
    });
}

#[test]
fn fractions_follow_from_what_they_are_made_of() {
    caught("(before^2-floor^2) is 0.98", common::explained, |report| {
        let fit = &mut report.verdicts[0].fit[0];
        (fit.removed_fraction, fit.removed_fraction_ci95) = (Some(0.5), None);
    });
    caught("noise floor is unknown", common::explained, |report| report.verdicts[0].fit[0].noise_floor = None);
    caught("nothing lies above", common::explained, |report| report.verdicts[0].fit[0].noise_floor = Some(14.0));
}

#[test]
fn parameters_are_those_of_the_vocabulary() {
    caught("no parameter of it", common::explained, |report| report.verdicts[0].parameters[0].name = "b".to_owned());
    caught("the vocabulary has N.m|N", common::explained, |report| report.verdicts[0].parameters[0].unit = "mN".to_owned());
    caught("this release has", common::explained, |report| report.tool.vocabulary_version = "0.9".to_owned());
    // A plugin brings names of its own.
    let mut report = common::explained();
    report.verdicts[0].physics = Physics::Plugin("drag".to_owned());
    report.verdicts[0].parameters = vec![Parameter::new("c_w", 0.4, "1", [0.3, 0.5])];
    assert_eq!(check(&report), NOTHING);
}

#[test]
fn numbers_are_finite_everywhere() {
    for value in [f64::NAN, f64::INFINITY] {
        caught("report.timing.total_s: is NaN", common::explained, |report| report.timing.total_s = value);
        caught("report.verdicts[0].parameters[0].ci95[0]", common::explained, |report| {
            report.verdicts[0].parameters[0].ci95[0] = -value;
        });
        caught("noise_floor: is NaN", common::explained, |report| report.verdicts[0].fit[0].noise_floor = Some(value));
        caught("noise_floor: is NaN", common::explained, |report| report.mismatch.excess_rms[0].noise_floor = value);
        caught("removed_fraction: is NaN", common::explained, |report| report.verdicts[0].fit[0].removed_fraction = Some(value));
        caught("parameters[0].prior_range[1]", common::explained, |report| {
            report.verdicts[0].parameters[0].prior_range = Some([0.0, value]);
        });
    }
}

#[test]
fn names_stand_for_something() {
    caught("no joint `wrist`", common::explained, |report| report.verdicts[0].location.joint.push("wrist".to_owned()));
    caught("names a joint twice", common::explained, |report| report.verdicts[0].location.joint.push("insertion".to_owned()));
    caught("no joint `wrist`", common::explained, |report| report.mismatch.excess_rms[0].joint = Some("wrist".to_owned()));
    caught("no run `run-9`", common::explained, |report| report.data_quality[0].run = Some("run-9".to_owned()));
    caught("no run `run-9`", common::explained, |report| {
        report.verdicts[0].location.time_intervals.push(Interval::new("run-9", 0.0, 1.0));
    });
    caught("not in order", common::explained, |report| {
        report.verdicts[0].location.time_intervals.push(Interval::new("run-01", 2.0, 1.0));
    });
    caught("same id", common::explained, |report| report.inputs.runs[1].id = "run-01".to_owned());
    caught("needs a held_out_interval", common::explained, |report| report.inputs.runs[3].role = RunRole::Split);
    caught("is of run", common::unmodelled, |report| {
        report.inputs.runs[0].held_out_interval = Some(Interval::new("other", 0.0, 1.0));
    });
    for path in ["/tmp/x", "../x", "C:\\x", "", "a/../../b"] {
        caught("not a path relative", common::explained, |report| {
            report.corrected_model.as_mut().expect("model").path = path.to_owned();
        });
    }
    caught("no SHA-256", common::explained, |report| report.inputs.runs[0].sha256 = "ABC".to_owned());
}

#[test]
fn every_status_has_what_it_needs() {
    caught("needs corrected_model", common::explained, |report| report.corrected_model = None);
    caught("needs mismatch.detected = true", common::explained, |report| report.mismatch.detected = false);
    caught("needs mismatch.detected = false", common::none, |report| report.mismatch.detected = true);
    caught("needs `none` as the first", common::explained, |report| report.status = Status::NoMismatch);
    caught("needs `unmodelled` as the first", common::explained, |report| report.status = Status::Unmodelled);
    caught("needs a primary verdict `unmodelled`", common::explained, |report| report.status = Status::PartlyExplained);
    caught("needs at least two", common::unmodelled, |report| report.status = Status::PartlyExplained);
    caught("needs a suggested_experiment", common::explained, |report| report.verdicts[0].suggested_experiment = None);
    caught("needs a fit", common::explained, |report| report.verdicts[0].fit.clear());
    caught("needs evidence", common::unmodelled, |report| report.verdicts[0].evidence.clear());
    caught("it can have none", common::unmodelled, |report| {
        report.verdicts[0].parameters = common::friction(1).parameters;
    });
    caught("schema_version", common::none, |report| report.schema_version = "2".to_owned());
}
