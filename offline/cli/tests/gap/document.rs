//! docs/gap.md says what the engine does.

use gap::search::Thresholds;

const DOCUMENT: &str = include_str!("../../../../docs/gap.md");

#[test]
fn the_document_has_the_thresholds_that_decide() {
    let of = Thresholds::default();
    let percent = |share: f64| format!("{} %", 100.0 * share);
    for (name, value) in [
        ("nats", of.nats.to_string()),
        ("share", percent(of.share)),
        ("amplitude", percent(of.amplitude)),
        ("equal", percent(of.equal)),
        ("effects", of.effects.to_string()),
    ] {
        let row = format!("| `{name}` | {value} |");
        assert!(DOCUMENT.contains(&row), "docs/gap.md has no row {row}");
    }
}

#[test]
fn the_document_has_every_physics_and_parameter_of_the_vocabulary() {
    for hypothesis in &gap_report::vocabulary().hypotheses {
        let name = hypothesis.physics.to_string();
        if ["none", "unmodelled"].contains(&name.as_str()) {
            continue;
        }
        assert!(DOCUMENT.contains(&format!("| `{name}`")), "docs/gap.md has no row on {name}");
    }
}
