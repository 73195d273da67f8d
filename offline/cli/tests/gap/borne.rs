//! Loads that were found are borne by cables, and given for by motors.

use crate::common::{Folder, case_of, holds, made, named, near, primary, wanted, written};
use gap_report::Status;
use generator::order::{Kind, Order, Wanted};

#[test]
fn a_soft_cable_bears_the_weight_that_was_found_too() {
    // By the weight of the links alone the cable of an insertion gave way twice as far.
    let soft = wanted("cable_stretch", Some(3), &[("k", 9000.0)]);
    for (label, window) in [("borne", None), ("borne for a while", Some([5.0, 13.0]))] {
        let folder = Folder::new(label);
        let weight = Wanted { interval: window, ..wanted("payload", None, &[("m_p", 0.4)]) };
        let (case, truth) = made(&folder, label, &[weight, soft.clone()], 14.0);
        let report = case.judged(&folder.file("out"));
        let of = |physics: &str| primary(&report).into_iter().find(|v| v.physics.to_string() == physics).expect("named");
        holds(of("cable_stretch"), "k", truth[1].effect.parameters["k"], 0.1);
        near(of("payload"), "m_p", 0.4, 0.1);
    }
}

#[test]
fn what_rubs_is_not_larger_for_a_weak_motor_that_is_asked_for_more() {
    // It was larger by 1/0.7, with an interval of 4 %.
    let folder = Folder::new("weak");
    let effects = [wanted("motor_torque_scale", Some(2), &[("kappa", 0.7)]), wanted("viscous_friction", Some(2), &[("b", 1.4)])];
    let (case, truth) = made(&folder, "weak", &effects, 14.0);
    let report = case.judged(&folder.file("out"));
    let of = |physics: &str| primary(&report).into_iter().find(|v| v.physics.to_string() == physics).expect("named");
    holds(of("motor_torque_scale"), "kappa", 0.7, 0.03);
    holds(of("viscous_friction"), "b", truth[1].effect.parameters["b"], 0.05);
    assert_eq!(primary(&report).len(), 2, "{}", report.summary);
}

#[test]
fn what_loads_make_needless_is_dropped() {
    // Beside a motor of twice the torque that has to give for a weight, the weight's own column left a little, and a cable of 556 kN m/rad explained it.
    let folder = Folder::new("needless");
    let weight = wanted("payload", None, &[("m_p", 0.3)]);
    let order = Order {
        seed: 98_016,
        label: "m162.0".to_owned(),
        block: "pairs".to_owned(),
        effects: vec![wanted("motor_torque_scale", Some(2), &[("kappa", 2.0)]), weight],
        robot: Kind::Variant,
        seconds: 12.0,
        ..Order::default()
    };
    let (case, _) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    let mut names: Vec<String> = primary(&report).iter().map(|verdict| verdict.physics.to_string()).collect();
    names.sort();
    assert_eq!(
        (report.status, names.join(" ")),
        (Status::Explained, "motor_torque_scale payload".to_owned()),
        "{}",
        report.summary
    );
    let motor = primary(&report).into_iter().find(|v| v.physics.to_string() == "motor_torque_scale").expect("named");
    near(motor, "kappa", 2.0, 0.05);
}

#[test]
fn what_a_cable_bears_is_what_the_simulations_own_one_gives_way_by() {
    // Of the nominal load these had no name, one was hysteresis: it lacks what a cable bears when its drive stops and leaves.
    let of = |id: &str| {
        let folder = Folder::new(id);
        let (case, _) = case_of(&folder, "full", 3_703_964_633, id);
        case.judged(&folder.file("out"))
    };
    let hysteresis = of("30ce3bc59af3");
    let first = named(&hysteresis, "cable_hysteresis", "shoulder");
    near(first, "a", 0.286, 0.1);
    near(first, "k", 1376.0, 0.1);
    let spring = of("27e0b62a5617");
    near(named(&spring, "cable_stretch", "joint4"), "k", 37.9, 0.12);
    // Of a spring that hardens with a cube of its deflection there is no name.
    let outside = of("220f72f71780");
    assert_eq!(outside.status, Status::Unmodelled, "{}", outside.summary);
}

#[test]
fn a_hysteresis_is_no_creep_for_its_numbers() {
    // They predict alike, and it fits two numbers more: creep, with probabilities of 0.44, 1 and 0.66. How large it is only the first tells.
    for (seed, id, told) in
        [(3_703_964_633, "f246407a58aa", true), (557_738_847, "2f1486f9b1cd", false), (557_738_847, "6882200b5bd7", false)]
    {
        let folder = Folder::new("memories");
        let (case, truth) = case_of(&folder, "full", seed, id);
        let report = case.judged(&folder.file("out"));
        let hysteresis = named(&report, "cable_hysteresis", truth[0].joint_name.as_deref().expect("a joint"));
        assert!(hysteresis.confusable_with.iter().any(|other| other.physics.to_string() == "cable_creep"), "{}", report.summary);
        assert!(hysteresis.probability < 0.6);
        if told {
            holds(hysteresis, "a", truth[0].effect.parameters["a"], 0.05);
        }
    }
}
