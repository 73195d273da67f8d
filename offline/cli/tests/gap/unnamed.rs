//! What no known physics says, and names beside it.

use crate::common::{Folder, case_of, made, primary, with_columns, written};
use gap_report::{Channel, Status};
use generator::order::{Order, Wanted};

#[test]
fn lost_counts_that_drift_as_warmth_does_are_not_warmth_alone() {
    // Three losses at the same times of both runs: a position that drifts predicts the other run, and leaves three times the noise of each.
    let folder = Folder::new("lost");
    let lost = Wanted { physics: "outside:missed_counts".to_owned(), severity: Some(3.0), ..Wanted::default() };
    let order = Order { seed: 906, label: "mc6".to_owned(), block: "outside".to_owned(), effects: vec![lost], ..Order::default() };
    let (case, _) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    assert_eq!(report.status, Status::PartlyExplained, "{}", report.summary);
    let told = primary(&report);
    let unmodelled = told.iter().find(|verdict| verdict.physics.to_string() == "unmodelled").expect("something without a name");
    assert_eq!((unmodelled.location.channel, &unmodelled.location.joint[..]), (Channel::Transmission, &["elbow".to_owned()][..]));
    assert!(told.iter().all(|verdict| verdict.probability <= 0.5 || verdict.physics.to_string() == "unmodelled"), "{told:?}");
}

#[test]
fn a_name_beside_something_unknown_at_the_same_joint_is_only_possible() {
    // Lost counts were a drift of the position as well, friction that goes with the position a dry one, and another controller one that sticks, with
    // probabilities of 1, 0.88 and 1.
    let cases = [
        (557_738_847, "16f7bd80a204", "thermal_drift"),
        (557_738_847, "a41f80eb30b1", "coulomb_friction"),
        (3_703_964_633, "402da9b9890c", "stribeck_friction"),
    ];
    for (seed, id, part) in cases {
        let folder = Folder::new("beside");
        let (case, _) = case_of(&folder, "full", seed, id);
        let report = case.judged(&folder.file("out"));
        assert_eq!(report.status, Status::PartlyExplained, "{}", report.summary);
        let told = primary(&report);
        let of = |physics: &str| told.iter().find(|verdict| verdict.physics.to_string() == physics).expect("told");
        assert!(told.len() == 2 && of("unmodelled").location.joint == of(part).location.joint, "{}", report.summary);
        assert!(of(part).probability <= 0.5 && report.summary.contains("Possibly the "), "{}", report.summary);
        let all = report.verdicts.iter().filter(|verdict| verdict.effect == of(part).effect);
        assert!(all.map(|verdict| verdict.probability).fold(0.0, f64::max) <= of(part).probability);
    }
}

#[test]
fn what_shakes_an_arm_faster_than_it_moves_is_no_agreement() {
    // Within three rows, 60 ms, half of it turns round: it was taken for noise, and everything for agreement, with a probability of 1.
    const HZ: f64 = 2.7;
    let folder = Folder::new("shaken");
    let (mut case, _) = made(&folder, "null", &[], 12.0);
    let shaking = |column: &str, row: usize, value: f64| {
        let by = if column == "tau_1_nm" { 0.008 * (std::f64::consts::TAU * HZ * 1e-3 * row as f64).sin() } else { 0.0 };
        Some(value + by)
    };
    for (k, path) in case.real.iter_mut().enumerate() {
        *path = with_columns(&folder, &format!("shaken-{k}.csv"), path, shaking);
    }
    let out = folder.file("out");
    let report = case.judged(&out);
    assert_eq!(report.status, Status::Unmodelled, "{}", report.summary);
    let first = primary(&report)[0];
    assert_eq!((first.physics.to_string().as_str(), first.location.channel), ("unmodelled", Channel::JointTorque));
    assert!(report.summary.contains("shoulder"), "{}", report.summary);
    assert!(report.remaining.explained_share.is_none());
    let depends = report.remaining.depends_on.unwrap_or_default().join(", ");
    let told = depends.split_whitespace().find_map(|word| word.parse::<f64>().ok()).expect("a frequency");
    // A run tells frequencies 0.08 Hz apart.
    assert!((told - HZ).abs() < 0.08, "{depends}");
}
