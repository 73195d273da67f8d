//! What is not there at the same time of every run.

use crate::common::{Case, Folder, case_of, near, primary, wanted, written};
use gap_report::{Report, RunRole, Space, Status};
use generator::order::{Order, Wanted};
use std::path::PathBuf;

/// From the first sample to the last.
const ALWAYS: [f64; 2] = [-120.0, 120.0];

/// Runs of one arm, each with the effect in a window of its own, or without it; with the folders that hold them.
fn each_run(name: &str, effect: &Wanted, windows: &[Option<[f64; 2]>]) -> (Case, Vec<Folder>) {
    each_run_of(78, &format!("cli/{name}"), effect, windows)
}

/// The same of a seed and a label.
fn each_run_of(seed: u64, label: &str, effect: &Wanted, windows: &[Option<[f64; 2]>]) -> (Case, Vec<Folder>) {
    let of_run = |window: &Option<[f64; 2]>| {
        let interval = window.filter(|window| *window != ALWAYS);
        let effects = window.map(|_| Wanted { interval, ..effect.clone() }).into_iter().collect();
        let (folder, label) = (Folder::new("by-run"), label.to_owned());
        let (case, _) = written(&folder, &Order { seed, label, effects, seconds: 12.0, runs: windows.len(), ..Order::default() });
        (case, folder)
    };
    let (cases, folders): (Vec<Case>, Vec<Folder>) = windows.iter().map(of_run).unzip();
    let of = |files: fn(&Case) -> &Vec<PathBuf>| cases.iter().enumerate().map(|(k, case)| files(case)[k].clone()).collect();
    (Case { robot: cases[0].robot.clone(), real: of(|case| &case.real), sim: of(|case| &case.sim) }, folders)
}

/// The one effect that is said, with the runs in which it is and from when on.
fn alone<'r>(report: &'r Report, physics: &str, from: &[(&str, f64)]) -> &'r gap_report::Verdict {
    let [only] = primary(report)[..] else { panic!("{}", report.summary) };
    assert_eq!((report.status, only.physics.to_string().as_str()), (Status::Explained, physics), "{}", report.summary);
    let told = &only.location.time_intervals;
    assert_eq!(told.len(), from.len(), "{told:?}");
    for (interval, (run, start_s)) in told.iter().zip(from) {
        assert_eq!(interval.run, *run);
        assert!((interval.start_s - start_s).abs() < 0.1, "{told:?}");
    }
    only
}

/// A number of a model's file.
fn number(model: &str, key: &str) -> f64 {
    let told = model.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
    told.unwrap_or_else(|| panic!("{key}: {model}")).parse().expect("a number")
}

fn weight() -> Wanted {
    wanted("payload", None, &[("m_p", 0.3), ("c_x", 0.01), ("c_y", 0.0), ("c_z", 0.02)])
}

#[test]
fn a_weight_is_picked_up_at_another_time_of_each_run() {
    // Alike in all runs it was a force from outside, and explained a tenth of what was held out.
    let windows = [4.0, 8.0, 6.0].map(|from| Some([from, 120.0]));
    let (case, folders) = each_run("picked-up", &weight(), &windows);
    let out = folders[0].file("out");
    let report = case.judged(&out);
    let only = alone(&report, "payload", &[("real_1.csv.gz", 4.0), ("real_2.csv.gz", 8.0), ("real_3.csv.gz", 6.0)]);
    near(only, "m_p", 0.3, 0.1);
    // Its size was fitted on the first two runs, when it comes in the last one there.
    assert!(only.fit[0].after < 0.1 * only.fit[0].before, "{:?}", only.fit);
    let played = only.fit.iter().find(|fit| fit.space == Space::ClosedLoop).expect("played again");
    assert!(played.after < 0.6 * played.before, "{played:?}");
    // Known are the times to a tenth of a second, but in the last run, where nothing was fitted.
    let known =
        only.location.time_intervals.iter().map(|told| told.start_ci95_s.map(|[low, high]| high - low < 0.4 && low < told.start_s));
    assert_eq!(known.collect::<Vec<_>>(), [Some(true), Some(true), None]);
    // The model has it as it was in the last run, and says so.
    let model = std::fs::read_to_string(out.join("corrected.toml")).expect("a model");
    let from_s: f64 =
        model.lines().find_map(|line| line.strip_prefix("from_s = ")).expect("a beginning").parse().expect("a number");
    assert!((from_s - 6.0).abs() < 0.1, "{model}");
    assert!(model.starts_with("# Not in this model: payload: when it is there in other runs"), "{model}");
}

#[test]
fn what_comes_in_one_run_stays_in_the_next() {
    let slack = wanted("viscous_friction", Some(3), &[("b", 60.0)]);
    let windows = [None, Some([5.0, 120.0]), Some(ALWAYS), Some(ALWAYS)];
    let (case, folders) = each_run("stays", &slack, &windows);
    let report = case.judged(&folders[0].file("out"));
    let only = alone(&report, "viscous_friction", &[("real_2.csv.gz", 5.0), ("real_3.csv.gz", 0.0), ("real_4.csv.gz", 0.0)]);
    near(only, "b", 60.0, 0.1);
    assert!(only.fit[0].after < 0.2 * only.fit[0].before, "{:?}", only.fit);
}

#[test]
fn a_cable_that_slips_in_the_last_run_is_no_agreement() {
    // What was fitted agrees; the run that was held out said nothing.
    let (case, folders) = each_run("slips", &wanted("joint_offset", Some(2), &[("o", 0.004)]), &[None, Some([5.0, 120.0])]);
    let report = case.judged(&folders[0].file("out"));
    let only = alone(&report, "joint_offset", &[("real_2.csv.gz", 5.0)]);
    near(only, "o", 0.004, 0.05);
    assert!(only.fit[0].after < 0.1 * only.fit[0].before, "{:?}", only.fit);
    let roles: Vec<_> = report.inputs.runs.iter().map(|run| (run.id.as_str(), run.role)).collect();
    assert_eq!(roles, [("real_1.csv.gz", RunRole::Null), ("real_2.csv.gz", RunRole::Split)]);
    let told = report.data_quality.iter().find(|quality| quality.check == "runs_differ").expect("a line");
    assert_eq!(told.message, "nothing is missing in real_1.csv.gz; what is said is of real_2.csv.gz");
}

#[test]
fn what_is_in_the_fitted_run_only_is_told_of_that_run() {
    let (case, folders) = each_run("only-first", &weight(), &[Some(ALWAYS), None]);
    let report = case.judged(&folders[0].file("out"));
    let only = alone(&report, "payload", &[("real_1.csv.gz", 0.0)]);
    near(only, "m_p", 0.3, 0.1);
    // Nothing is claimed of a run that has nothing of it.
    let [fit] = only.fit.as_slice() else { panic!("{:?}", only.fit) };
    assert_eq!((fit.removed_fraction, fit.extra.get(gap_report::ABSENT).is_some()), (None, true), "{fit:?}");
}

#[test]
fn hysteresis_that_the_last_run_lacks_is_told_from_a_spring_that_hardens() {
    // Nothing of what was held out speaks for it or against it: it had no name.
    let folder = Folder::new("bent");
    let (case, _) = case_of(&folder, "full", 2_377_053_097, "03cdc15dfee7");
    let report = case.judged(&folder.file("out"));
    alone(&report, "cable_hysteresis", &[("real_1.csv.gz", 0.0), ("real_2.csv.gz", 0.0)]);
    let windows = vec![[-1e6, 1e6], [4.17, 120.0], [1e6, 1e6]];
    let spring = Wanted { severity: Some(10.0), intervals: windows, ..wanted("outside:cubic_stiffness", None, &[]) };
    let order = Order { seed: 1108, label: "abs108".to_owned(), effects: vec![spring], seconds: 12.0, runs: 3, ..Order::default() };
    let folder = Folder::new("hardens");
    let (case, _) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    assert_eq!(report.status, Status::Unmodelled, "{}", report.summary);
}

#[test]
fn of_four_runs_that_agree_nothing_is_said() {
    for seed in [79, 80, 81] {
        let folder = Folder::new("four");
        let order = Order { seed, label: "cli/four".to_owned(), seconds: 12.0, runs: 4, ..Order::default() };
        let (case, truth) = written(&folder, &order);
        assert!(truth.is_empty());
        let report = case.judged(&folder.file("out"));
        assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    }
}

#[test]
fn a_cable_that_slips_in_the_last_of_eight_runs_is_no_agreement() {
    // Of eight runs two are held out, and of these alone the first one would be fitted on: it agrees as well.
    let windows: Vec<Option<[f64; 2]>> = (0..8).map(|run| (run == 7).then_some([5.0, 120.0])).collect();
    let (case, folders) = each_run("last-of-eight", &wanted("joint_offset", Some(2), &[("o", 0.004)]), &windows);
    let report = case.judged(&folders[0].file("out"));
    let only = alone(&report, "joint_offset", &[("real_8.csv.gz", 5.0)]);
    near(only, "o", 0.004, 0.05);
    let agree = report.inputs.runs.iter().filter(|run| run.role == RunRole::Null).count();
    assert_eq!((agree, report.inputs.runs.len()), (7, 8));
}

#[test]
fn of_one_run_what_goes_in_the_third_that_is_held_out_ends_there() {
    let folder = Folder::new("goes");
    let carried = Wanted { interval: Some([5.0, 20.0]), ..weight() };
    let order =
        Order { seed: 78, label: "cli/goes".to_owned(), effects: vec![carried], seconds: 24.0, runs: 1, ..Order::default() };
    let (case, _) = written(&folder, &order);
    let out = folder.file("out");
    let report = case.judged(&out);
    let only = alone(&report, "payload", &[("real_1.csv.gz", 5.0)]);
    assert!((only.location.time_intervals[0].end_s - 20.0).abs() < 0.1, "{:?}", only.location.time_intervals);
    assert!(only.fit[0].after < 0.1 * only.fit[0].before, "{:?}", only.fit);
    let model = std::fs::read_to_string(out.join("corrected.toml")).expect("a model");
    assert!((number(&model, "from_s") - 5.0).abs() < 0.1 && (number(&model, "to_s") - 20.0).abs() < 0.1, "{model}");
}

#[test]
fn a_step_is_no_loop_that_follows_its_edge() {
    // Five numbers of a loop gain 1 % more where it was fitted, and leave three times the noise of the other run.
    let effect = wanted("joint_offset", Some(2), &[("o", -0.003)]);
    let (case, folders) = each_run_of(1001, "x1", &effect, &[Some([4.0, 120.0]), Some([7.5, 120.0])]);
    let report = case.judged(&folders[0].file("out"));
    let only = alone(&report, "joint_offset", &[("real_1.csv.gz", 4.0), ("real_2.csv.gz", 7.5)]);
    assert!(only.fit[0].after < 0.05 * only.fit[0].before, "{:?}", only.fit);
}

#[test]
fn what_is_there_for_a_while_of_one_run_only_is_found_beside_what_stays_in_others() {
    // From nothing no single edge leads to a while: this push was a lighter link in the first run.
    let folder = Folder::new("by-run");
    let (case, _) = case_of(&folder, "full", 77, "6a58e86f7b6a");
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "external_contact", "{}", report.summary);
    let told: Vec<[f64; 2]> = first.location.time_intervals.iter().map(|interval| [interval.start_s, interval.end_s]).collect();
    let truth = [[5.85, 8.23], [3.80, 12.0], [3.47, 12.0], [4.26, 7.99]];
    assert_eq!(told.len(), truth.len(), "{told:?}");
    for (told, truth) in told.iter().flatten().zip(truth.iter().flatten()) {
        assert!((told - truth).abs() < 0.1, "{told} {truth}");
    }
    assert!(first.fit[0].after < 0.05 * first.fit[0].before, "{:?}", first.fit);
}

#[test]
fn of_what_fits_alike_the_one_that_holds_later_is_said() {
    // Four seconds of a creep are a shifted zero; the four that follow, which nothing was fitted to, are not.
    let folder = Folder::new("by-run");
    let (case, _) = case_of(&folder, "full", 77, "bc9a4fcc8d47");
    let report = case.judged(&folder.file("out"));
    let only = alone(&report, "cable_creep", &[("real_4.csv.gz", 3.94)]);
    assert_eq!(only.location.joint, ["elbow"]);
}
