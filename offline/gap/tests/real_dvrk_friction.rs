//! Friction tests of a real da Vinci insertion axis (`data/dvrk-friction`).
#![allow(missing_docs)]

mod common;

use common::{primary, report};

#[test]
fn an_axis_at_constant_velocities_shows_dry_friction_and_no_stribeck_curve() {
    let Some(report) = report("examples/dvrk-psm.toml", &["dvrk-friction/insertion_constvel_up.csv"], &[]) else { return };
    let found = primary(&report, "coulomb_friction");
    assert_eq!(found.iter().map(|v| v.location.joint.join("")).collect::<Vec<_>>(), ["insertion"]);
    assert!(primary(&report, "stribeck_friction").is_empty());
}

#[test]
fn break_away_gives_the_static_level_with_an_interval() {
    for run in ["insertion_breakaway_psm1", "insertion_breakaway_psm2_a"] {
        let Some(report) = report("examples/dvrk-psm.toml", &[&format!("dvrk-friction/{run}.csv")], &[]) else { return };
        let found =
            report.data_quality.iter().find(|q| q.check == "break_away" && q.message.starts_with("insertion")).expect("a level");
        println!("{run}: {}", found.message);
        // Coulomb friction of the insertion from its other runs: 0.57 to 0.80 N.
        assert!(found.value.is_some_and(|level| (0.4..1.2).contains(&level)), "{}", found.message);
    }
}
