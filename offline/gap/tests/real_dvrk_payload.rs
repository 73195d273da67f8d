//! Real da Vinci arms with and without a known weight (`data/dvrk-payload`), the run without it as the simulation.
#![allow(missing_docs)]

mod common;

use common::{parameter, primary, report};
use gap_report::Status;

const WITHOUT: &str = "dvrk-payload/psm_traj1_noweight_a.csv";

#[test]
fn a_weight_on_the_insertion_post_is_named_weighed_and_placed() {
    let Some(report) = report("examples/dvrk-psm.toml", &["dvrk-payload/psm_traj1_105g_insertion_full.csv"], &[WITHOUT]) else {
        return;
    };
    let found = primary(&report, "payload");
    let verdict = found.first().expect("a payload");
    let (mass, _) = parameter(verdict, "m_p");
    assert!((mass - 0.105).abs() <= 0.15 * 0.105, "{mass} kg");
    assert!(verdict.location.regime[0].condition.contains("top of the insertion post"), "{}", verdict.location.regime[0].condition);
    assert_eq!(report.verdicts.iter().filter(|v| v.role == gap_report::Role::Primary).count(), 1);
}

#[test]
fn the_bare_arm_recorded_twice_carries_nothing() {
    let Some(report) = report("examples/dvrk-psm.toml", &["dvrk-payload/psm_traj1_noweight_b.csv"], &[WITHOUT]) else { return };
    assert_eq!(report.status, Status::NoMismatch);
}
