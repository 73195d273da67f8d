//! Every physics of the vocabulary in the whole robot: absent it changes nothing, present it shows where it must and nowhere
//! else; names and parameters are those of `models/gap-vocabulary.json`.
#![allow(missing_docs)]

mod common;

use arm::{JOINTS, Joints, Side};
use common::cases::{Case, Places, physics};
use simulator::model::{Bound, Effect};
use simulator::physics::{Channel, names, parameters_of};
use simulator::plant::Method;
use simulator::trajectory::{WORKSPACE, teleoperation};
use simulator::{Command, CycleOfArm, Robot, Simulation};

fn start() -> Joints {
    WORKSPACE.map(|(low, high)| f64::midpoint(low, high))
}

/// Three seconds of motion of a robot with effects, seen every cycle; always with the same method and step.
fn run(effects: &[Effect]) -> Vec<CycleOfArm> {
    let mut robot = Robot::nominal();
    robot.effects = effects.to_vec();
    let trajectory = teleoperation(5, start(), &WORKSPACE, 3.0);
    let mut simulation = Simulation::new(&robot, Side::Gold, 1, &start()).expect("robot");
    simulation.set_step(Method::Rosenbrock, 0.25e-3);
    (0..3000).map(|k| simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)))).collect()
}

/// Every physics on every place that a RAVEN-II has for it.
fn cases() -> Vec<Case> {
    let plant = Robot::nominal().raven.plant().clone();
    let stiffness = (0..3).map(|i| 2.0 * plant.cable.ke_n[i] * plant.cable.joint_radius_m[i].powi(2)).collect();
    let pairs = vec![Bound::Pair(1, 0), Bound::Pair(2, 1), Bound::Pair(5, 4)];
    common::cases::all(&Places {
        joints: 7,
        stiffness,
        pairs,
        heavy_links: 3,
        links: 6,
        ripple: 0.5,
        coulomb: 0.8,
        contact_x_m: -0.2,
    })
}

/// Largest differences of two runs: true joints, reported joints, torque, tip.
fn difference(a: &[CycleOfArm], b: &[CycleOfArm]) -> [f64; 4] {
    let largest = |part: &dyn Fn(&CycleOfArm) -> Vec<f64>| {
        let pairs = a.iter().zip(b).flat_map(|(a, b)| part(a).into_iter().zip(part(b)).collect::<Vec<_>>());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    [
        largest(&|cycle| cycle.truth.joints.to_vec()),
        largest(&|cycle| cycle.reported.joints.to_vec()),
        largest(&|cycle| cycle.reported.torque_nm.to_vec()),
        largest(&|cycle| cycle.truth.tip.translation.vector.iter().copied().collect()),
    ]
}

#[test]
fn names_and_parameters_are_those_of_the_vocabulary() {
    let text = include_str!("../../../models/gap-vocabulary.json");
    let vocabulary: serde_json::Value = serde_json::from_str(text).expect("JSON");
    let hypotheses = vocabulary["hypotheses"].as_array().expect("hypotheses");
    let named: Vec<&str> = hypotheses.iter().filter_map(|entry| entry["physics"].as_str()).collect();
    let physical: Vec<&str> = named.iter().copied().filter(|name| !matches!(*name, "none" | "unmodelled")).collect();
    let mut ours = names().to_vec();
    let mut theirs = physical.clone();
    ours.sort_unstable();
    theirs.sort_unstable();
    assert_eq!(ours, theirs);
    for entry in hypotheses.iter().filter(|entry| physical.contains(&entry["physics"].as_str().expect("name"))) {
        let name = entry["physics"].as_str().expect("name");
        let ours: Vec<(&str, &str)> =
            parameters_of(name).expect("known").iter().map(|parameter| (parameter.name, parameter.unit)).collect();
        let theirs: Vec<(&str, &str)> = entry["parameters"]
            .as_array()
            .expect("parameters")
            .iter()
            .map(|parameter| (parameter["name"].as_str().expect("name"), parameter["unit"].as_str().expect("unit")))
            .collect();
        assert_eq!(ours, theirs, "{name}");
    }
}

#[test]
fn an_effect_of_size_zero_changes_nothing_and_one_of_size_shows() {
    let nominal = run(&[]);
    let mut seen = std::collections::BTreeSet::new();
    for Case { none, some, bounds } in cases() {
        seen.insert(none.name());
        for bound in bounds {
            let absent = difference(&run(&[Effect::new(none, bound)]), &nominal);
            assert!(absent.iter().all(|difference| *difference < 1e-9), "{} of size 0 on {bound:?}: {absent:?}", none.name());
            let present = run(&[Effect::new(some, bound)]);
            let found = difference(&present, &nominal);
            assert!(found.iter().any(|difference| *difference > 1e-6), "{} on {bound:?}: {found:?}", some.name());
            let finite =
                present.iter().all(|cycle| cycle.truth.joints.iter().chain(&cycle.reported.torque_nm).all(|x| x.is_finite()));
            assert!(finite, "{} on {bound:?}", some.name());
        }
    }
    assert_eq!(seen.len(), names().len(), "every physics has a case: {seen:?}");
}

#[test]
fn what_concerns_the_tracker_only_leaves_robot_and_controller_alone() {
    let nominal = run(&[]);
    for (physics, bound) in [
        (physics("frame_misalignment", &[("t_x", 0.004)]), Bound::Robot),
        (physics("link_geometry", &[("d_length", 0.003)]), Bound::Link(5)),
        (physics("measurement_delay", &[("d", 0.02)]), Bound::Channel(Channel::EndEffector)),
    ] {
        let found = difference(&run(&[Effect::new(physics, bound)]), &nominal);
        assert_eq!(found[..3], [0.0; 3], "{}", physics.name());
        assert!(found[3] > 1e-4, "{}: {found:?}", physics.name());
    }
}

#[test]
fn an_offset_moves_the_true_joint_by_its_size_and_the_reported_one_not() {
    let nominal = run(&[]);
    for joint in 0..JOINTS {
        let moved = run(&[Effect::new(physics("joint_offset", &[("o", 0.004)]), Bound::Joint(joint))]);
        let last = moved.len() - 1;
        let shift = moved[last].truth.joints[joint] - nominal[last].truth.joints[joint];
        assert!((shift - 0.004).abs() < 1e-4, "joint {}: {shift}", joint + 1);
        let reported = moved[last].reported.joints[joint] - nominal[last].reported.joints[joint];
        assert!(reported.abs() < 4e-4, "joint {}: {reported}", joint + 1);
    }
}

#[test]
fn an_effect_with_a_start_is_absent_before_it() {
    let nominal = run(&[]);
    let mut payload = Effect::new(physics("payload", &[("m_p", 0.25)]), Bound::Robot);
    payload.from_s = 1.5;
    let loaded = run(&[payload]);
    assert_eq!(difference(&loaded[..1500], &nominal[..1500]), [0.0; 4]);
    assert!(difference(&loaded[1500..], &nominal[1500..])[0] > 1e-5);
}

/// A joint that carries gravity, pushed away from its balance and left alone by a controller that stands still.
fn drift_after_a_push(stiction: bool) -> f64 {
    let mut robot = Robot::nominal();
    robot.presliding = stiction.then_some([1e-4, 1e-4, 2e-5]);
    robot.effects = vec![
        Effect::new(physics("coulomb_friction", &[("f_c", 3.0)]), Bound::Joint(1)),
        Effect::new(physics("cable_stretch", &[("k", 300.0)]), Bound::Joint(1)),
    ];
    let mut simulation = Simulation::new(&robot, Side::Gold, 1, &start()).expect("robot");
    let mut there = start();
    there[1] += 0.1;
    simulation.settle(&there, 1.0);
    simulation.settle(&start(), 0.6);
    let early = simulation.state().joints[1];
    simulation.settle(&start(), 5.0);
    (simulation.state().joints[1] - early).abs()
}

#[test]
fn a_stuck_joint_does_not_drift() {
    let (stuck, creeping) = (drift_after_a_push(true), drift_after_a_push(false));
    println!("drift in 5 s: {stuck:e} rad with stiction, {creeping:e} rad with the smoothed sign");
    // What is left is the motor, whose own friction has the smoothed sign and gives way to the controller.
    assert!(stuck < 1e-4, "{stuck}");
    assert!(creeping > 50.0 * stuck, "{creeping} against {stuck}");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_thread() {
    let make = || {
        let robot = Robot::worn();
        let mut simulation = Simulation::new(&robot, Side::Green, 9, &start()).expect("robot");
        let trajectory = teleoperation(9, start(), &WORKSPACE, 1.0);
        (0..1000).map(|k| simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)))).collect::<Vec<_>>()
    };
    let here = make();
    let there = std::thread::spawn(make).join().expect("thread");
    let bits = |cycles: &[CycleOfArm]| -> Vec<u64> {
        cycles
            .iter()
            .flat_map(|cycle| cycle.truth.joints.map(f64::to_bits).into_iter().chain(cycle.reported.torque_nm.map(f64::to_bits)))
            .collect()
    };
    assert_eq!(bits(&here), bits(&there));
}

#[test]
fn each_homing_leaves_another_offset_and_the_same_seed_the_same_one() {
    let offset = |seed| *Simulation::new(&Robot::worn(), Side::Gold, seed, &start()).expect("robot").homing_offset();
    assert_eq!(offset(1), offset(1));
    assert_ne!(offset(1), offset(2));
    let spread: f64 = (0..200).map(|seed| offset(seed)[0].powi(2)).sum::<f64>() / 200.0;
    assert!((spread.sqrt() / Robot::worn().homing_offset_sd[0] - 1.0).abs() < 0.15, "{}", spread.sqrt());
}

#[test]
fn the_nominal_robot_is_too_perfect_and_the_worn_one_is_off_by_millimetres() {
    let rms = |robot: &Robot, seed: u64| {
        let arm = robot.raven.arm(Side::Gold);
        let trajectory = teleoperation(seed, start(), &WORKSPACE, 20.0);
        let mut simulation = Simulation::new(robot, Side::Gold, seed, &start()).expect("robot");
        let mut squares = 0.0;
        for k in 0..20_000 {
            let cycle = simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)));
            squares += (cycle.truth.tip.translation.vector - arm.kinematics.tip_position(&cycle.reported.joints)).norm_squared();
        }
        (squares / 20_000.0).sqrt() * 1e3
    };
    let nominal = rms(&Robot::nominal(), 1);
    assert!(nominal < 0.3, "{nominal} mm");
    let worn: Vec<f64> = (1..=8).map(|seed| rms(&Robot::worn(), seed)).collect();
    let all = (worn.iter().map(|rms| rms * rms).sum::<f64>() / worn.len() as f64).sqrt();
    println!("tip off by: nominal {nominal:.2} mm RMS, worn {all:.2} mm RMS over eight homings {worn:.2?}");
    assert!((2.0..8.0).contains(&all), "{all} mm");
}

/// A second of motion of a robot with these effects, with the method that the simulator chooses by itself.
fn chosen(effects: &str) -> Vec<CycleOfArm> {
    let robot = format!("schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"raven2-nominal\"\n{effects}");
    let robot = Robot::from_toml(&robot).expect("a robot");
    let trajectory = teleoperation(5, start(), &WORKSPACE, 1.0);
    let mut simulation = Simulation::new(&robot, Side::Gold, 1, &start()).expect("robot");
    (0..1000).map(|k| simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)))).collect()
}

#[test]
fn whatever_an_effect_brings_the_steps_follow_it() {
    let quiet = chosen("");
    for effect in [
        // Dampers and springs that explicit steps of a quarter of a millisecond cannot follow.
        "physics = \"cable_stretch\"\njoint = 3\nparameters = { k = 2000.0, d = 9000.0 }",
        "physics = \"cable_stretch\"\njoint = 2\nparameters = { k = 560.0, d = 5000.0 }",
        "physics = \"cable_hysteresis\"\njoint = 3\nparameters = { a = 0.5, k = 2e7, z_m = 1e-4 }",
        // Together more than all of the load: no drive pushes by itself.
        "physics = \"load_dependent_friction\"\njoint = 2\nparameters = { mu_l = 0.9 }\n[[effect]]\nphysics = \"load_dependent_friction\"\njoint = 2\nparameters = { mu_l = 0.9 }",
    ] {
        let with = chosen(&format!("[[effect]]\n{effect}\n"));
        for (k, (with, quiet)) in with.iter().zip(&quiet).enumerate() {
            for j in 0..3 {
                let off = (with.truth.joints[j] - quiet.truth.joints[j]).abs();
                assert!(off < if j == 2 { 0.03 } else { 0.2 }, "{effect}: joint {} is {off} off after {k} ms", j + 1);
            }
        }
    }
}
