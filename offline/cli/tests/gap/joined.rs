//! Effects that are told together, where one of them alone leads elsewhere.

use crate::common::{Folder, holds, near, parameter, primary, wanted, written};
use gap_report::{Report, Status, Verdict};
use generator::order::{Kind, Order, Wanted};

/// The answer to a case of two effects, and whether these are what it tells.
fn told(folder: &Folder, seed: u64, label: &str, robot: Kind, effects: Vec<Wanted>, seconds: f64) -> Report {
    let mut names: Vec<String> = effects.iter().map(|effect| effect.physics.clone()).collect();
    let order = Order { seed, label: label.to_owned(), block: "pairs".to_owned(), effects, robot, seconds, ..Order::default() };
    let (case, _) = written(folder, &order);
    let report = case.judged(&folder.file("out"));
    let mut told: Vec<String> = primary(&report).iter().map(|verdict| verdict.physics.to_string()).collect();
    names.sort();
    told.sort();
    assert_eq!((report.status, told), (Status::Explained, names), "{}", report.summary);
    report
}

fn of<'r>(report: &'r Report, physics: &str) -> &'r Verdict {
    primary(report).into_iter().find(|v| v.physics.to_string() == physics).expect("named")
}

fn of_severity(physics: &str, joint: usize, severity: f64) -> Wanted {
    Wanted { severity: Some(severity), ..wanted(physics, Some(joint), &[]) }
}

/// Dry friction that the simulation lacks, and all of it fades or grows.
fn fading() -> Vec<Wanted> {
    vec![of_severity("coulomb_friction", 1, 20.0), of_severity("thermal_drift", 1, 10.0)]
}

#[test]
fn a_zero_that_is_off_and_a_soft_cable_are_no_memory_of_the_cable() {
    // They were hysteresis of 8.5 N m/rad that yields at 0.5 rad, with intervals from nothing to 18 times that.
    let folder = Folder::new("zero");
    let effects = vec![of_severity("joint_offset", 2, 10.0), of_severity("cable_stretch", 2, 10.0)];
    let report = told(&folder, 99_028, "c28", Kind::Planar, effects, 15.0);
    holds(of(&report, "joint_offset"), "o", -0.003, 0.3);
    holds(of(&report, "cable_stretch"), "k", 248.55, 0.5);
}

#[test]
fn what_was_found_of_friction_fades_as_well() {
    // No more could fade than the simulation has: kappa stood at its end, and was of the simulation's friction alone.
    let folder = Folder::new("grows");
    let report = told(&folder, 99_041, "c41", Kind::Gantry, fading(), 15.0);
    holds(of(&report, "coulomb_friction"), "f_c", 8.577, 0.1);
    holds(of(&report, "thermal_drift"), "kappa_T", -0.6, 0.2);
    holds(of(&report, "thermal_drift"), "T", 23.9, 0.6);
}

#[test]
fn friction_that_has_faded_half_has_not_ended() {
    // It was dry friction that ends after four seconds.
    let folder = Folder::new("fades");
    let report = told(&folder, 99_043, "c43", Kind::Planar, fading(), 15.0);
    assert!(of(&report, "coulomb_friction").location.time_intervals.is_empty());
    near(of(&report, "thermal_drift"), "kappa_T", 0.6, 0.15);
}

#[test]
fn a_curve_and_viscous_friction_are_told_though_neither_alone_fits_beside_dry_friction() {
    // Dry friction left what grew with the square of the speed, which has no name.
    let folder = Folder::new("curve");
    let curve = wanted("stribeck_friction", Some(2), &[("f_c", 1.0), ("f_s", 1.7), ("v_s", 0.15), ("a", 2.0)]);
    let effects = vec![curve, wanted("viscous_friction", Some(2), &[("b", 1.5)])];
    let report = told(&folder, 99_313, "c313", Kind::Planar, effects, 15.0);
    for (name, value, within) in [("f_c", 1.0, 0.1), ("f_s", 1.7, 0.3), ("v_s", 0.15, 0.4)] {
        holds(of(&report, "stribeck_friction"), name, value, within);
    }
    holds(of(&report, "viscous_friction"), "b", 1.5, 0.05);
}

#[test]
fn viscous_friction_is_large_where_a_ripple_shakes_the_cable_and_is_none_of_it() {
    // It was dropped as what a ripple leaves, though it is 0.9 times as large as that, and then had no name.
    let folder = Folder::new("fast");
    let effects = vec![of_severity("torque_ripple", 2, 10.0), of_severity("viscous_friction", 2, 10.0)];
    let report = told(&folder, 97_022, "r22", Kind::Raven, effects, 12.0);
    holds(of(&report, "viscous_friction"), "b", 2.19492, 0.05);
    near(of(&report, "torque_ripple"), "amp", 0.85076, 0.05);
}

#[test]
fn gravity_out_of_the_plane_of_all_joints_takes_weight_off_them() {
    // What the joints bear less was a link's inertia besides.
    let folder = Folder::new("plane");
    let tilt = wanted("gravity_direction", None, &[("a", 0.1), ("b", -0.03)]);
    let report = told(&folder, 99_002, "c2", Kind::Planar, vec![tilt], 15.0);
    let tilted = of(&report, "gravity_direction");
    holds(tilted, "b", -0.03, 0.8);
    // By how much is seen, but not to which side.
    let (out, [low, high]) = parameter(tilted, "a");
    assert!((out - 0.1).abs() < 0.02 && low < -0.1 && high > 0.1, "{out} from {low} to {high}");
}
