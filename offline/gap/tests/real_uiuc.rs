//! A recording of a real RAVEN-II against models without friction and with their input reversed (`data/raven2-uiuc`).
#![allow(missing_docs)]

mod common;

use common::{outcome, primary, report};
use gap::found::Outcome;
use gap_report::Level;

const REAL: &str = "raven2-uiuc/real_first_two_thirds.csv";
const SIM: &str = "raven2-uiuc/uiuc_simulator_freerun_first_two_thirds.csv";
/// RMS that plain least squares on inertia, positions, viscous, Coulomb, coupling and presliding terms leave of the last third
/// of the rows, fitted on the first two thirds; the best over presliding travels, N·m and N.
const LEAST_SQUARES: [(&str, f64); 3] = [("shoulder", 0.237), ("elbow", 0.26), ("insertion", 5.17)];

#[test]
fn a_model_without_friction_lacks_dry_friction_on_three_joints() {
    let Some(report) = report("raven2-frictionless.toml", &[REAL], &[]) else { return };
    for (joint, limit) in LEAST_SQUARES {
        let found = primary(&report, "coulomb_friction");
        let verdict = found.iter().find(|v| v.location.joint == [joint]).unwrap_or_else(|| panic!("dry friction of {joint}"));
        assert!(
            verdict.fit[0].after <= limit,
            "{joint}: {} left of the held-out torque, least squares leave {limit}",
            verdict.fit[0].after
        );
    }
}

#[test]
fn a_simulation_with_its_input_reversed_is_told_first() {
    let Some(Outcome { report, corrected, .. }) = outcome("raven2-frictionless.toml", &[REAL], &[SIM]) else { return };
    let first = &report.data_quality[0];
    assert_eq!((first.check.as_str(), first.level), ("input_sign", Level::Fail));
    assert!(first.message.contains("the simulation"), "{}", first.message);
    assert!(report.summary.starts_with("The simulation's input has the wrong sign"), "{}", report.summary);
    assert_eq!(primary(&report, "coulomb_friction").len(), 3);
    // What such a simulation differs by is no error of the model.
    assert!(!corrected.expect("a corrected model").contains("[model_error]"));
}
