//! Cases that the generator makes, so that something is asserted where ../shared is absent.

use crate::common::{
    Case, Folder, case_of, done, holds, made, named, near, parameter, primary, report, text, wanted, with_effect, written,
};
use gap_report::{Channel, RegionKind, Report, Status};
use generator::order::{Kind, Order, Sealed, Wanted};
use generator::trajectory::Excitation;
use std::path::{Path, PathBuf};

#[test]
fn of_nothing_nothing_is_said() {
    let folder = Folder::new("null");
    let (case, truth) = made(&folder, "null", &[], 12.0);
    assert!(truth.is_empty());
    let out = folder.file("out");
    let report = case.judged(&out);
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    assert!(!out.join("corrected.toml").exists());
}

/// A case of a matrix, judged, and how many effects it has.
fn of_matrix(matrix: &str, seed: u64, id: &str) -> (Report, usize) {
    let folder = Folder::new(id);
    let (case, truth) = case_of(&folder, matrix, seed, id);
    (case.judged(&folder.file("out")), truth.len())
}

/// A null of a matrix, which was an alarm once, is none.
fn is_no_alarm(matrix: &str, seed: u64, id: &str) {
    let (report, effects) = of_matrix(matrix, seed, id);
    assert_eq!(effects, 0);
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
}

/// The one name that is said of a case of the whole matrix, with the right joint.
fn is_named_alone(seed: u64, id: &str, physics: &str, joint: &str) {
    let (report, _) = of_matrix("full", seed, id);
    named(&report, physics, joint);
    assert_eq!(primary(&report).len(), 1, "{}", report.summary);
}

#[test]
fn a_burst_of_wrong_readings_is_no_mismatch() {
    // A torque that was wrong in six of seven rows, by 25 times what it is: something in few places without a name.
    is_no_alarm("full", 3_299_647_609, "5c084a887448");
}

#[test]
fn small_effects_on_an_arm_that_mostly_stands_have_their_own_names() {
    // What friction that turns round too steeply left passed for a contact, warmth or dry friction, or had no name.
    is_named_alone(2_519_786_717, "9999238834d3", "viscous_friction", "shoulder");
    is_named_alone(2_519_786_717, "eb59273ab247", "load_dependent_friction", "elbow");
    is_named_alone(2_519_786_717, "fd8f29e9ddbf", "coulomb_friction", "elbow");
    is_named_alone(2_519_786_717, "fdf9e61a29b7", "motor_torque_scale", "insertion");
}

/// A signal that is late by so many seconds from a time on.
fn late(signal: &str, by_s: f64, from_s: f64) -> Wanted {
    Wanted { signal: Some(signal.to_owned()), interval: Some([from_s, 120.0]), ..wanted("measurement_delay", None, &[("d", by_s)]) }
}

#[test]
fn a_torque_is_late_in_all_it_holds_or_not_late() {
    // A quarter of a millisecond, on a null; and dry friction that turns 3 ms late where an arm hardly moves, beside a drift.
    is_no_alarm("full", 278_625_836, "25a256671f4d");
    is_named_alone(278_625_836, "0cd486b7a074", "thermal_drift", "shoulder");
}

#[test]
fn a_torque_that_is_very_late_is_late_by_as_much() {
    // Slopes over rows were flatter than the torque is: 5 % too much.
    let folder = Folder::new("very-late");
    let (case, _) = made(&folder, "very late", &[late("torque", 0.014, 0.0)], 12.0);
    let report = case.judged(&folder.file("out"));
    assert_eq!((report.status, primary(&report).len()), (Status::Explained, 1), "{}", report.summary);
    assert_eq!(primary(&report)[0].physics.to_string(), "measurement_delay");
    near(primary(&report)[0], "d", 0.014, 0.01);
}

#[test]
fn a_torque_that_is_late_in_the_end_of_a_run_is_late() {
    // Over the whole of the run it would be late by less than counts.
    let folder = Folder::new("late");
    let (case, _) = made(&folder, "late", &[late("torque", 0.004, 9.0)], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "measurement_delay", "{}", report.summary);
    near(first, "d", 0.004, 0.25);
}

#[test]
fn a_weight_on_a_link_that_only_slides_is_a_weight() {
    // Half of what a weight may be shows nowhere there, but for the last digit of a right angle.
    let (report, _) = of_matrix("full", 278_625_836, "a9507affb344");
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "payload", "{}", report.summary);
    holds(first, "m_p", 0.0466, 0.1);
}

#[test]
fn dry_friction_behind_the_elbows_cable_is_no_play() {
    // It stretches the cable by what play would be, and moves the tip.
    let folder = Folder::new("elbow");
    let robot = folder.write("dry.toml", with_effect("physics = \"coulomb_friction\"\njoint = 2\nparameters = { f_c = 0.8 }"));
    let run = folder.run("0.5", Some(&robot), &[]);
    let report = Case { robot: PathBuf::from("raven2-nominal"), real: vec![run], sim: Vec::new() }.judged(&folder.file("out"));
    let first = named(&report, "coulomb_friction", "elbow");
    near(first, "f_c", 0.8, 0.05);
}

#[test]
fn one_effect_of_a_raven_is_told_without_a_simulation() {
    // Its cables pass other joints, its friction loads them, and its encoders come a millisecond late.
    let cases = [
        ("physics = \"cable_stretch\"\njoint = 1\nparameters = { k = 2000.0 }", "cable_stretch", "shoulder", "k", 2000.0, 0.1),
        ("physics = \"cable_stretch\"\njoint = 3\nparameters = { k = 8000.0 }", "cable_stretch", "insertion", "k", 8000.0, 0.1),
        ("physics = \"backlash\"\njoint = 2\nparameters = { b = 0.01 }", "backlash", "elbow", "b", 0.01, 0.2),
        (
            "physics = \"motor_torque_scale\"\njoint = 2\nparameters = { kappa = 0.7, d_0 = 0.0 }",
            "motor_torque_scale",
            "elbow",
            "kappa",
            0.7,
            0.05,
        ),
    ];
    for (k, (effect, physics, joint, name, size, share)) in cases.into_iter().enumerate() {
        let folder = Folder::new(&format!("one-effect-{k}"));
        let robot = folder.write("robot.toml", with_effect(effect));
        let run = folder.run("0.5", Some(&robot), &[]);
        let report = Case { robot: PathBuf::from("raven2-nominal"), real: vec![run], sim: Vec::new() }.judged(&folder.file("out"));
        let first = named(&report, physics, joint);
        assert_eq!(primary(&report).len(), 1, "{}", report.summary);
        holds(first, name, size, share);
    }
}

#[test]
fn a_tilted_base_is_alone_though_links_are_not_what_the_lab_says() {
    // Gravity from another side asks for numbers of the links that no motion of the simulation tells: other links and a force were said beside it.
    // In the second, whose base is straight again after eight seconds, its controller's integral, which the simulation hardly uses, passed for gains.
    for (matrix, seed, case) in [("full", 561_426_328, "807d05039a23"), ("dev", 77, "38a052f51cfc")] {
        let (report, _) = of_matrix(matrix, seed, case);
        let told: Vec<String> = primary(&report).iter().map(|v| v.physics.to_string()).collect();
        assert_eq!(told, ["gravity_direction"], "{}", report.summary);
    }
}

/// Effects of some severities, drawn by a seed.
fn of_severity(seed: u64, label: &str, effects: &[(&str, f64)]) -> (Report, Vec<Sealed>) {
    let folder = Folder::new(label);
    let drawn = |(physics, severity): &(&str, f64)| Wanted { severity: Some(*severity), ..wanted(physics, None, &[]) };
    let effects = effects.iter().map(drawn).collect();
    let (case, truth) = written(&folder, &Order { seed, label: label.to_owned(), effects, ..Order::default() });
    (case.judged(&folder.file("out")), truth)
}

#[test]
fn a_motor_that_ripples_strongly_has_links_that_are_what_they_were() {
    // It shakes the links on their cables, which the motors do not show: other links that come and go, and hysteresis, were said beside it, and
    // of its size up to a quarter was lost.
    for (seed, label) in [(70_019, "s19"), (70_027, "s27"), (70_067, "s67")] {
        let (report, truth) = of_severity(seed, label, &[("torque_ripple", 30.0)]);
        let first = named(&report, "torque_ripple", "elbow");
        assert_eq!((report.status, primary(&report).len()), (Status::Explained, 1), "{}", report.summary);
        holds(first, "amp", truth[0].effect.parameters["amp"], 0.05);
    }
    // A weight beside it was another link.
    let (report, truth) = of_severity(50_105, "sp105", &[("torque_ripple", 30.0), ("payload", 10.0)]);
    let told: Vec<String> = primary(&report).iter().map(|v| v.physics.to_string()).collect();
    assert_eq!(told, ["payload", "torque_ripple"], "{}", report.summary);
    holds(primary(&report)[0], "m_p", truth[1].effect.parameters["m_p"], 0.05);
    holds(primary(&report)[1], "amp", truth[0].effect.parameters["amp"], 0.05);
}

#[test]
fn play_is_told_beside_a_strong_effect_though_other_links_seem_to_fit_better() {
    // It crosses a few times only; other links, which are not accepted, predict about as well. It was found, and dropped at the end.
    let (report, truth) = of_severity(50_040, "sp40", &[("viscous_friction", 30.0), ("backlash", 30.0)]);
    let told: Vec<String> = primary(&report).iter().map(|v| v.physics.to_string()).collect();
    assert_eq!(told, ["viscous_friction", "backlash"], "{}", report.summary);
    holds(primary(&report)[1], "b", truth[1].effect.parameters["b"], 0.05);
}

#[test]
fn what_barely_gains_and_makes_the_held_out_run_worse_is_not_said() {
    // The one null of a sealed matrix that was an alarm: a weight, by a later tool a pulley, of 15.7 nats.
    is_no_alarm("full", 1_767_532_870, "d51a126e277d");
}

#[test]
fn what_makes_the_held_out_run_worse_goes_for_what_holds_there() {
    // Play that rests on one side while it is fitted, and on the other in the run that was held out: an offset before.
    let (report, _) = of_matrix("full", 1_952_879_170, "e85596f53006");
    named(&report, "backlash", "insertion");
    // Changed gains, which were called a ripple of the torque: nothing in the vocabulary holds.
    let (report, _) = of_matrix("full", 1_952_879_170, "4c49ab80242c");
    assert_eq!(report.status, Status::Unmodelled, "{}", report.summary);
    assert_eq!(primary(&report)[0].location.joint, ["insertion"]);
    let refused =
        report.verdicts.iter().flat_map(|v| &v.evidence).any(|e| e.claim.contains("torque ripple explains what was fitted"));
    assert!(refused, "{:?}", report.verdicts);
}

#[test]
fn two_effects_are_told_though_neither_alone_leaves_noise() {
    // What the better one leaves is so little like noise that prices outweigh all gains.
    let (report, _) = of_matrix("full", 1_952_879_170, "317bc5ae975d");
    let told: Vec<String> = primary(&report).iter().map(|v| v.physics.to_string()).collect();
    assert_eq!(told, ["transmission_ratio", "cable_hysteresis"], "{}", report.summary);
    holds(primary(&report)[0], "e", 0.001_359_3, 0.05);
}

#[test]
fn an_effect_is_told_though_one_block_keeps_or_says_most_of_it() {
    // A drive of half the torque: most is said where a cable shakes. And friction that is there for two seconds, in three blocks.
    let (report, _) = of_matrix("full", 3_282_418_269, "e0a4d88fc5cc");
    near(named(&report, "motor_torque_scale", "insertion"), "kappa", 0.504_1, 0.05);
    let (report, _) = of_matrix("full", 1_952_879_170, "b23c0d53fc0b");
    named(&report, "load_dependent_friction", "elbow");
}

#[test]
fn a_spike_at_a_standstill_is_no_friction_curve() {
    // An alarm on a null of a sealed set: a curve 0.15 mrad/s wide and 67 N m high, 79 nats.
    is_no_alarm("small", 1_830_933_757, "85c3f6f5ae62");
}

#[test]
fn a_wall_that_is_touched_for_a_moment_is_no_agreement() {
    let folder = Folder::new("wall");
    let wall = Wanted { physics: "external_contact".to_owned(), severity: Some(10.0), ..Wanted::default() };
    let (case, _) = made(&folder, "wall", &[wall], 12.0);
    let report = case.judged(&folder.file("out"));
    assert_ne!(report.status, Status::NoMismatch, "{}", report.summary);
    assert!(report.mismatch.detected && !primary(&report).is_empty());
}

#[test]
fn a_wall_has_the_exponent_that_fits_once_it_is_in_place() {
    // The grid's walls are too far apart to tell: of these the exponents came out the other way round, and stiffnesses by the unit that goes with them.
    // Of the second both runs touch the same part, which is a region; of the first each run another.
    let walls = [
        (3_848_609_202, "5f5e6e7b21ab", 4554.5, 1.5, RegionKind::All),
        (3_282_418_269, "7ccc9963eb98", 242.97, 1.0, RegionKind::Box),
    ];
    for (seed, id, stiffness, exponent, kind) in walls {
        let (report, _) = of_matrix("full", seed, id);
        let first = primary(&report)[0];
        assert_eq!(first.physics.to_string(), "external_contact", "{}", report.summary);
        holds(first, "k", stiffness, 0.1);
        let (power, [low, high]) = parameter(first, "p");
        assert!((power - exponent).abs() < 1e-9 && high - low < 1.0, "{power} ({low} to {high})");
        let region = &first.location.workspace_region;
        assert_eq!(region.kind, kind);
        if kind == RegionKind::Box {
            // The wall is at larger x and smaller y.
            assert!(region.energy_share.is_some_and(|share| share > 0.95));
            assert_eq!(region.axes.as_ref().expect("axes")[..2], ["x", "y"]);
        }
    }
}

#[test]
fn hysteresis_as_large_as_the_noise_is_told_from_a_zero_that_is_off() {
    // Under a weight of one sign most of it is constant. Loading and unloading bend nearly alike in the second.
    for (g, label) in [(0.55, "bent-1"), (0.8, "bent-2")] {
        let folder = Folder::new(label);
        let shape = [("a", 0.75), ("k", 1700.0), ("z_m", 0.0023), ("n", 1.4), ("g", g)];
        let (case, truth) = made(&folder, label, &[wanted("cable_hysteresis", Some(1), &shape)], 12.0);
        let report = case.judged(&folder.file("out"));
        let first = named(&report, "cable_hysteresis", truth[0].joint_name.as_ref().expect("a joint"));
        near(first, "a", 0.75, 0.15);
        let (_, [low, high]) = parameter(first, "g");
        assert!((0.5..=1.0).contains(&low) && low < high && high <= 1.0, "{low} to {high}");
    }
}

#[test]
fn hysteresis_whose_numbers_stand_at_their_limits_is_found_and_measured() {
    // Its memory begins between nothing and what the first load leaves in a new cable. The search once stopped at the limit of g.
    let (report, _) = of_matrix("full", 629_759_738, "8ac11ab8318f");
    let first = named(&report, "cable_hysteresis", "shoulder");
    near(first, "k", 1359.0, 0.1);
    near(first, "z_m", 0.0044, 0.15);
}

#[test]
fn hysteresis_is_found_and_measured_where_elastic_joints_shake_each_other() {
    // A joint that leaves at once shakes the others at 8 Hz: no motor shows what their cables bear then. These had no name: of the first
    // the gain was 1030 nats, give or take 667, since one block keeps most of the error.
    let cases = [("3ed9b7cc5170", "shoulder", 0.00304), ("66ab65a5575a", "joint2", 0.01164)];
    for (id, joint, yields) in cases {
        let (report, _) = of_matrix("full", 3_282_418_269, id);
        let first = named(&report, "cable_hysteresis", joint);
        near(first, "z_m", yields, 0.1);
        let held_out = &first.fit[0];
        assert!(held_out.after < 0.35 * held_out.before, "{held_out:?}");
    }
}

#[test]
fn hysteresis_begins_each_run_where_that_run_found_it() {
    let folder = Folder::new("begun");
    let effects = vec![wanted("cable_hysteresis", Some(1), &[("a", 0.4), ("k", 1400.0), ("z_m", 0.0044), ("n", 1.5), ("g", 0.7)])];
    let order = Order { seed: 3, label: "mr3".to_owned(), effects, seconds: 12.0, runs: 5, ..Order::default() };
    let (case, truth) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "cable_hysteresis", truth[0].joint_name.as_ref().expect("a joint"));
    // One start for all runs gains 118 nats, one of each 6205.
    assert!(first.evidence[0].statistic > 1000.0, "{:?}", first.evidence);
    near(first, "a", 0.4, 0.2);
}

#[test]
fn a_pulley_out_of_true_is_found_in_a_small_part_of_its_turn() {
    // The joint moves through less than a third of a turn, where a sine is nearly the straight line of a wrong ratio.
    let folder = Folder::new("turn");
    let pulley = [("e_over_r", 0.0043), ("period", 0.63), ("phi", 1.56)];
    let effects = vec![wanted("pulley_eccentricity", Some(2), &pulley)];
    let order = Order {
        seed: 2,
        label: "e2".to_owned(),
        effects,
        excitation: Excitation::Poor,
        seconds: 12.0,
        runs: 2,
        ..Order::default()
    };
    let (case, truth) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "pulley_eccentricity", truth[0].joint_name.as_ref().expect("a joint"));
    near(first, "e_over_r", 0.0043, 0.5);
    near(first, "period", 0.63, 0.3);
}

#[test]
fn a_position_that_drifts_is_no_share_of_friction() {
    let folder = Folder::new("drift");
    let (case, truth) = made(&folder, "drift", &[wanted("thermal_drift", Some(1), &[("drift", 0.02), ("T", 10.0)])], 24.0);
    let out = folder.file("out");
    let report = case.judged(&out);
    let first = named(&report, "thermal_drift", truth[0].joint_name.as_ref().expect("a joint"));
    assert!(first.parameters.iter().all(|parameter| parameter.name == "T"), "{:?}", first.parameters);
    let drift = first.evidence.iter().find(|evidence| evidence.test.contains("drifts")).expect("how far");
    assert!(drift.statistic_name == "rad" && (0.005..0.05).contains(&drift.statistic.abs()), "{drift:?}");
    // The simulator's effect of this name is friction that fades.
    let corrected = std::fs::read_to_string(out.join("corrected.toml")).unwrap_or_default();
    assert!(!corrected.contains("physics = \"thermal_drift\""), "{corrected}");
    let told = |quality: &gap_report::DataQuality| quality.message.contains("a position that drifts is not a term");
    assert!(report.data_quality.iter().any(told), "{:?}", report.data_quality);
}

#[test]
fn what_began_before_the_recording_has_its_time_constant() {
    // In the generator's recordings 0.6 s before. Where that was taken for nothing, 20 s came out as 11, 3 s as 2.2, and a drift of
    // another arm passed for creep.
    let cases = [
        ("thermal_drift", &[("drift", 0.01), ("T", 20.0)][..], ("T", 20.0)),
        ("cable_creep", &[("J_k", 0.001), ("T_k", 3.0)], ("T_k", 3.0)),
    ];
    for (physics, parameters, (name, time_s)) in cases {
        let folder = Folder::new(physics);
        let (case, truth) = made(&folder, &format!("since-{physics}"), &[wanted(physics, Some(1), parameters)], 12.0);
        let report = case.judged(&folder.file("out"));
        holds(named(&report, physics, truth[0].joint_name.as_ref().expect("a joint")), name, time_s, 0.25);
    }
    named(&of_matrix("full", 629_759_738, "39362489d057").0, "thermal_drift", "joint1");
}

#[test]
fn dry_friction_is_named_at_its_joint_and_measured() {
    let folder = Folder::new("coulomb");
    let (case, truth) = made(&folder, "coulomb", &[wanted("coulomb_friction", Some(2), &[("f_c", 2.0)])], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "coulomb_friction", truth[0].joint_name.as_ref().expect("a joint"));
    near(first, "f_c", truth[0].effect.parameters["f_c"], 0.15);
}

#[test]
fn friction_that_falls_with_speed_is_not_taken_for_plain_friction() {
    let folder = Folder::new("stribeck");
    let curve = [("f_c", 0.36), ("f_s", 0.7), ("v_s", 0.19), ("a", 1.8)];
    let (case, truth) = made(&folder, "stribeck", &[wanted("stribeck_friction", Some(1), &curve)], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "stribeck_friction", truth[0].joint_name.as_ref().expect("a joint"));
    near(first, "f_s", truth[0].effect.parameters["f_s"], 0.35);
}

#[test]
fn friction_that_falls_with_speed_turns_round_as_plain_friction_does() {
    // From its own starts alone the search ends beside it, and nothing in the library is good enough.
    let folder = Folder::new("curve");
    let curve = [("f_c", 0.33), ("f_s", 0.82), ("v_s", 0.15), ("a", 1.9)];
    let (case, truth) = made(&folder, "curve-3", &[wanted("stribeck_friction", Some(2), &curve)], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "stribeck_friction", truth[0].joint_name.as_ref().expect("a joint"));
    near(first, "f_c", 0.33, 0.1);
}

#[test]
fn friction_that_falls_with_speed_is_named_where_it_ends_on_the_way() {
    let folder = Folder::new("stribeck-ends");
    let curve = [("f_c", 6.1), ("f_s", 12.0), ("v_s", 0.02), ("a", 1.5)];
    let ends = Wanted { interval: Some([-120.0, 7.0]), ..wanted("stribeck_friction", Some(3), &curve) };
    let (case, truth) = made(&folder, "stribeck-ends", &[ends], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "stribeck_friction", truth[0].joint_name.as_ref().expect("a joint"));
    assert!(!first.location.time_intervals.is_empty(), "{}", report.summary);
    for interval in &first.location.time_intervals {
        assert!((interval.end_s - 7.0).abs() < 0.2, "{} s", interval.end_s);
    }
}

#[test]
fn of_one_run_what_came_on_the_way_is_there_in_the_third_that_is_held_out() {
    let folder = Folder::new("one-run");
    let picked = Wanted { interval: Some([5.0, 120.0]), ..wanted("payload", None, &[("m_p", 0.3)]) };
    let (case, _) = written(
        &folder,
        &Order { seed: 77, label: "cli/one-run".to_owned(), effects: vec![picked], seconds: 24.0, runs: 1, ..Order::default() },
    );
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "payload", "{}", report.summary);
    let [interval] = first.location.time_intervals.as_slice() else { panic!("{:?}", first.location.time_intervals) };
    assert!((interval.start_s - 5.0).abs() < 0.2 && interval.end_s > 23.5, "{interval:?}");
    let fit = &first.fit[0];
    assert!(fit.after < 0.2 * fit.before, "{fit:?}");
}

/// 5 N along (0.6, -0.8, 0).
fn force_for_a_while() -> Wanted {
    let along = [("n_x", 0.6), ("n_y", -0.8), ("n_z", 0.0)].map(|(name, value)| (name.to_owned(), value));
    Wanted {
        details: along.into_iter().collect(),
        interval: Some([4.0, 8.0]),
        ..wanted("external_contact", None, &[("f_max", 5.0)])
    }
}

#[test]
fn a_force_that_bearings_carry_a_part_of_is_not_called_known() {
    let folder = Folder::new("borne");
    let effects = vec![force_for_a_while()];
    // Walls and steady forces are drawn.
    let order = Order { seed: 99_103, label: "f1".to_owned(), effects, robot: Kind::Planar, ..Order::default() };
    let (case, truth) = written(&folder, &order);
    assert!(!truth[0].effect.parameters.contains_key("k"), "{:?}", truth[0].effect.parameters);
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "external_contact", "{}", report.summary);
    near(first, "f_max", 3.0, 0.1);
    assert_eq!(first.parameters[0].identifiable, gap_report::Identifiable::No);
}

#[test]
fn a_force_for_a_while_is_no_weight() {
    let folder = Folder::new("force");
    // Walls and steady forces are drawn.
    let (case, truth) = made(&folder, "f2", &[force_for_a_while()], 12.0);
    assert!(!truth[0].effect.parameters.contains_key("k"), "{:?}", truth[0].effect.parameters);
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "external_contact", "{}", report.summary);
    near(first, "f_max", 5.0, 0.1);
}

#[test]
fn a_tool_that_is_turned_is_told_from_a_camera_that_is() {
    let folder = Folder::new("twist");
    let (case, truth) = made(&folder, "twist", &[wanted("link_geometry", Some(3), &[("d_alpha", 0.03)])], 12.0);
    let report = case.judged(&folder.file("out"));
    let first = named(&report, "link_geometry", truth[0].joint_name.as_ref().expect("a joint"));
    near(first, "d_alpha", 0.03, 0.1);
}

#[test]
fn a_tip_that_comes_late_from_the_middle_of_the_runs_on_is_seen() {
    let folder = Folder::new("late");
    let (case, _) = made(&folder, "late", &[late("tip", 0.08, 5.0)], 12.0);
    let report = case.judged(&folder.file("out"));
    let verdicts = primary(&report);
    assert_eq!(
        verdicts.first().map(|verdict| verdict.physics.to_string()).as_deref(),
        Some("measurement_delay"),
        "{}",
        report.summary
    );
}

#[test]
fn a_simulation_of_our_own_with_the_noise_of_a_robot_is_taken_for_a_simulation() {
    let folder = Folder::new("own");
    let loose = folder.write("loose.toml", with_effect("physics = \"coulomb_friction\"\njoint = 1\nparameters = { f_c = 1.0 }"));
    let (real, sim) = (folder.file("real"), folder.file("sim"));
    done(&["simulate", "--robot", text(&loose), "--minutes", "0.75", "--seed", "3", "--out", text(&real)]);
    let real = real.join("run_0001.mcap");
    done(&["simulate", "--robot", "raven2-nominal", "--commands", text(&real), "--out", text(&sim)]);
    let case = Case { robot: "raven2-nominal".into(), real: vec![real], sim: vec![sim.join("run_0001.mcap")] };
    let report = case.judged(&folder.file("out"));
    near(named(&report, "coulomb_friction", "shoulder"), "f_c", 1.0, 0.1);
}

#[test]
fn an_arm_of_two_joints_is_judged_like_any_other() {
    let folder = Folder::new("two");
    let effects = vec![wanted("viscous_friction", Some(1), &[("b", 2.0)])];
    let order = |number: usize| Order {
        seed: 77,
        label: format!("cli/two {number}"),
        effects: effects.clone(),
        robot: Kind::Variant,
        seconds: 12.0,
        runs: 2,
        ..Order::default()
    };
    // Arms of two to four joints are drawn.
    let two = |number: &usize| {
        let files = order(*number).make().expect("a case").files;
        files
            .iter()
            .any(|(name, bytes)| name == "robot.urdf" && String::from_utf8_lossy(bytes).matches("<transmission").count() == 2)
    };
    let (case, truth) = written(&folder, &order((0..20).find(two).expect("an arm of two joints")));
    let report = case.judged(&folder.file("out"));
    assert_eq!(report.status, Status::Explained, "{}", report.summary);
    named(&report, "viscous_friction", truth[0].joint_name.as_ref().expect("a joint"));
}

#[test]
fn a_payload_is_named_and_weighed_the_same_each_time() {
    let folder = Folder::new("payload");
    let (case, truth) = made(&folder, "payload", &[wanted("payload", None, &[("m_p", 0.3)])], 12.0);
    let (first, second) = (folder.file("first"), folder.file("second"));
    let reports = [&first, &second].map(|out| {
        let output = case.gap_with(out, &["--seed", "9"]);
        report(out, &output)
    });
    let verdict = primary(&reports[0])[0];
    assert_eq!(verdict.physics.to_string(), "payload", "{}", reports[0].summary);
    let m = truth[0].effect.parameters["m_p"];
    near(verdict, "m_p", m, 0.2);
    assert_eq!(reports[0].tool.seed, 9);
    assert_eq!(timeless(&reports[0]), timeless(&reports[1]));
    let corrected = |out: &Path| std::fs::read_to_string(out.join("corrected.toml")).expect("a model");
    assert_eq!(corrected(&first), corrected(&second));
}

#[test]
fn an_arm_of_six_joints_is_an_arm_like_others() {
    // Fifteen residuals and twice the library: what chance finds in so many is none.
    let folder = Folder::new("six");
    let order = |label: &str, effects| Order {
        seed: 95_000,
        label: format!("cli/{label}"),
        robot: Kind::Six,
        effects,
        seconds: 15.0,
        ..Order::default()
    };
    let (null, _) = written(&folder, &order("six none", Vec::new()));
    let report = null.judged(&folder.file("none"));
    assert_eq!((report.status, report.inputs.robot.joints.len()), (Status::NoMismatch, 6), "{}", report.summary);
    let (case, truth) = written(&folder, &order("six", vec![wanted("viscous_friction", Some(6), &[("b", 0.05)])]));
    let report = case.judged(&folder.file("one"));
    named(&report, "viscous_friction", truth[0].joint_name.as_ref().expect("a joint"));
    holds(primary(&report)[0], "b", 0.05, 0.05);
    assert_eq!(primary(&report).len(), 1, "{}", report.summary);
}

#[test]
fn what_rubs_has_both_its_parts_however_small_one_of_them_is() {
    // The small one passed for the other's error, and the other was too large by 7 and 18 %, with intervals of 3 %.
    let (dry, slow) = (("coulomb_friction", "f_c", 0.7), ("viscous_friction", "b", 0.2));
    for (label, large, small, interval) in [
        ("dry", dry, slow, None),
        ("fast", ("viscous_friction", "b", 2.3), ("coulomb_friction", "f_c", 0.12), None),
        ("from then on", dry, ("viscous_friction", "b", 0.4), Some([5.0, 15.0])),
    ] {
        let folder = Folder::new(label);
        let of = |(physics, name, value)| Wanted { interval, ..wanted(physics, Some(2), &[(name, value)]) };
        let effects = [large, small].map(of);
        let (case, _) = made(&folder, label, &effects, 15.0);
        let report = case.judged(&folder.file("out"));
        assert_eq!(primary(&report).len(), 2, "{}", report.summary);
        for (physics, name, value) in [large, small] {
            let told = primary(&report).into_iter().find(|v| v.physics.to_string() == physics).expect("named");
            assert_eq!(told.location.joint, ["elbow"]);
            match interval {
                None => holds(told, name, value, 0.1),
                Some(_) => near(told, name, value, 0.15),
            }
        }
    }
}

/// The report but for when it was made and how long that took.
fn timeless(report: &Report) -> serde_json::Value {
    let mut value = serde_json::to_value(report).expect("JSON");
    for key in ["created", "timing"] {
        value.as_object_mut().expect("an object").remove(key);
    }
    value
}

#[test]
fn a_robot_agrees_with_its_own_simulation() {
    let folder = Folder::new("again");
    let robot = folder.write("heavy.toml", with_effect("physics = \"payload\"\nparameters = { m_p = 0.2, c_z = -0.45 }"));
    let run = folder.run("0.5", Some(&robot), &[]);
    let report = Case { robot, real: vec![run], sim: Vec::new() }.judged(&folder.file("same"));
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    // The tip goes with a wrist that moves through tens of degrees, too: by millimetres.
    let tip: Vec<f64> = report
        .mismatch
        .excess_rms
        .iter()
        .filter(|excess| excess.channel == Channel::EndEffector)
        .map(|excess| excess.value)
        .collect();
    assert!(tip.len() == 3 && tip.iter().all(|metres| *metres < 5e-5), "{tip:?}");
}

/// The one name that is said of a case of a set that was sealed, with the right joint and size.
fn is_said_alone(id: &str, physics: &str, joints: &[&str], told: (&str, f64, f64)) {
    is_said_alone_of(3_881_812_845, id, physics, joints, told);
}

fn is_said_alone_of(seed: u64, id: &str, physics: &str, joints: &[&str], (parameter, truth, share): (&str, f64, f64)) {
    let (report, _) = of_matrix("full", seed, id);
    assert_eq!((report.status, primary(&report).len()), (Status::Explained, 1), "{id}: {}", report.summary);
    let told = primary(&report)[0];
    assert_eq!(told.physics.to_string(), physics, "{}", report.summary);
    assert_eq!(told.location.joint, joints);
    near(told, parameter, truth, share);
}

#[test]
fn friction_that_comes_on_the_way_turns_round_as_its_rivals_do() {
    // In the window only friction by load, or plain friction, had turned round by the better law: it was named with 0.99.
    is_said_alone("dc2c6ec1311f", "coulomb_friction", &["elbow"], ("f_c", 0.351, 0.05));
    is_said_alone("051071f3646f", "stribeck_friction", &["shoulder"], ("f_s", 2.1771, 0.05));
}

#[test]
fn what_begins_at_once_begins_in_the_rows_as_they_are_smoothed() {
    // With sharp edges the row beside each weighed more than the laws differ by: creep, and a pulley, with 0.95 and 0.99.
    is_said_alone("742d19d58407", "joint_coupling", &["insertion", "elbow"], ("c_ij", 0.00064, 0.05));
    is_said_alone("262b5b02a568", "transmission_ratio", &["insertion"], ("e", 0.0182, 0.05));
}

#[test]
fn what_a_cause_does_elsewhere_is_no_second_cause() {
    // A turned link hangs otherwise, a joint that is dragged along is shaken, what moves further moves faster, a motor that ripples shakes its
    // cable: each had a small second cause beside it, with 0.98 and more.
    is_said_alone("a9c9136b985e", "link_geometry", &["insertion"], ("d_alpha", -0.026, 0.05));
    is_said_alone("e2bf36eeaef8", "joint_coupling", &["joint1", "joint2"], ("c_ij", 0.0246, 0.05));
    is_said_alone("53bdc19aac97", "transmission_ratio", &["joint3"], ("e", 0.0156, 0.05));
    is_said_alone("4dd88de4cae4", "torque_ripple", &["elbow"], ("amp", 0.673, 0.3));
}

#[test]
fn friction_by_load_that_may_be_none_is_plain_friction() {
    is_said_alone("979fb0489eab", "coulomb_friction", &["insertion"], ("f_c", 5.6938, 0.05));
}

#[test]
fn a_recording_is_no_other_than_itself() {
    // Its torque is as noisy as the recording's: it was taken for another recording, and the model's errors for causes.
    let folder = Folder::new("itself");
    let (mut case, _) = made(&folder, "itself", &[late("torque", 0.014, 0.0)], 12.0);
    case.sim.clone_from(&case.real);
    let report = case.judged(&folder.file("out"));
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    let said = report.data_quality.iter().find(|q| q.check == "same_motion").expect("it says so");
    assert!(said.message.contains("this recording, sample for sample"), "{}", said.message);
}

#[test]
fn a_loop_that_is_a_line_within_what_the_load_is_known_by_is_a_soft_cable() {
    is_said_alone_of(2_162_061_666, "0f9b5bdab8d4", "cable_stretch", &["shoulder"], ("k", 971.2, 0.1));
}

#[test]
fn a_soft_cable_gives_way_late_and_is_no_loop() {
    is_named_alone(2_162_061_666, "b0c62881a512", "cable_stretch", "joint1");
}

#[test]
fn what_explains_much_is_not_taken_back_for_a_number_of_its_own() {
    // Play beside a load, told as hysteresis whose loop may be none, was taken back without a word.
    let folder = Folder::new("much");
    let order = Order {
        seed: 5,
        label: "p5".to_owned(),
        effects: vec![
            Wanted { severity: Some(10.0), ..wanted("payload", None, &[]) },
            Wanted { severity: Some(7.0), ..wanted("backlash", Some(2), &[]) },
        ],
        ..Order::default()
    };
    let (case, _) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    let all = primary(&report);
    assert_eq!((all.len(), all[0].physics.to_string()), (2, "payload".to_owned()), "{}", report.summary);
    assert_eq!(all[1].location.joint, ["elbow"]);
    let play = |name: &gap_report::Physics| name.to_string() == "backlash";
    assert!(play(&all[1].physics) || all[1].confusable_with.iter().any(|other| play(&other.physics)), "{all:?}");
}

#[test]
fn a_step_beside_a_slow_drift_is_no_cable_that_creeps() {
    // Creep explains most of it by itself, and what is beside creep then explains little.
    let folder = Folder::new("step-and-drift");
    let strong = |physics: &str| Wanted { physics: physics.to_owned(), severity: Some(30.0), ..Wanted::default() };
    let effects = vec![strong("joint_offset"), strong("thermal_drift")];
    let order = Order { seed: 50_033, label: "sp33".to_owned(), block: "pairs".to_owned(), effects, ..Order::default() };
    let report = written(&folder, &order).0.judged(&folder.file("out"));
    let names: Vec<String> = primary(&report).iter().map(|verdict| verdict.physics.name().into_owned()).collect();
    assert_eq!(names, ["joint_offset", "thermal_drift"], "{}", report.summary);
    assert!(primary(&report).iter().all(|verdict| verdict.location.joint == ["shoulder"]), "{}", report.summary);
}

#[test]
fn a_robot_with_less_friction_than_the_simulation_has_less_friction() {
    // It could only have more: less was a motor that warms up, with probability 1.
    let folder = Folder::new("less-friction");
    for (physics, name, value) in [("coulomb_friction", "f_c", -0.3), ("viscous_friction", "b", -0.3)] {
        let (case, _) = made(&folder, &format!("less-{name}"), &[wanted(physics, Some(1), &[(name, value)])], 15.0);
        let report = case.judged(&folder.file(&format!("out-{name}")));
        named(&report, physics, "shoulder");
        assert_eq!(primary(&report).len(), 1, "{}", report.summary);
        holds(primary(&report)[0], name, value, 0.1);
    }
}
