//! Every physics on an arm from a URDF, with cables and without: absent it changes nothing, present it shows.
#![allow(missing_docs)]

mod common;

use common::cases::{Case, Places, all, physics};
use common::urdf::THREE_JOINTS;
use simulator::RobotModel;
use simulator::any_arm::{ArmCycle, ArmSimulation, trajectory};
use simulator::model::{Bound, Connection, Effect};
use simulator::plant::{Method, Passive, Vector};

const STIFFNESS: [f64; 3] = [5500.0, 1000.0, 1e5];

fn robot(connection: Connection) -> RobotModel {
    let mut robot = RobotModel::from_urdf(THREE_JOINTS).expect("URDF");
    for joint in 0..3 {
        let mut drive = robot.drives()[joint];
        drive.connection = connection;
        (drive.rotor_inertia_kg_m2, drive.joint_coulomb) = (2e-5, [0.3, 0.3, 1.0][joint]);
        if connection == Connection::Cable {
            (drive.stiffness, drive.damping) = (STIFFNESS[joint], [20.0, 5.0, 300.0][joint]);
        }
        if connection == Connection::Force {
            drive.reduction = 1.0;
            robot.set_passive(joint, Passive { stiffness: 20.0, damping: 0.1, rest: 0.3 }).expect("spring");
        }
        (drive.torque_constant_nm_a, drive.counts_per_a) = (Some(0.06), Some(2730.0));
        robot.set_drive(joint, &drive).expect("drive");
    }
    robot
}

fn run(robot: &RobotModel, effects: &[Effect]) -> Vec<ArmCycle> {
    let mut robot = robot.clone();
    *robot.effects_mut() = effects.to_vec();
    let motion = trajectory(&robot, 5, 2.0);
    let mut simulation = ArmSimulation::new(&robot, None, 1, motion.start()).expect("simulation");
    simulation.plant().set_step(Method::Rosenbrock, 0.25e-3);
    (0..2000).map(|k| simulation.tick(&motion.at(f64::from(k) * 1e-3))).collect()
}

fn cases(joints: usize) -> Vec<Case> {
    let pairs = vec![Bound::Pair(1, 0), Bound::Pair(2, 1), Bound::Pair(0, 2)];
    let stiffness = STIFFNESS[..joints].to_vec();
    all(&Places { joints: 3, stiffness, pairs, heavy_links: 3, links: 4, ripple: 0.5, coulomb: 0.8, contact_x_m: 0.1 })
}

/// Largest differences of two runs: true joints, reported joints, torque, tip.
fn difference(a: &[ArmCycle], b: &[ArmCycle]) -> [f64; 4] {
    let largest = |part: fn(&ArmCycle) -> &Vector| {
        let pairs = a.iter().zip(b).flat_map(|(a, b)| part(a).iter().zip(part(b)));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let tips = a.iter().zip(b).flat_map(|(a, b)| a.true_tip.iter().zip(&b.true_tip));
    [
        largest(|cycle| &cycle.true_joints),
        largest(|cycle| &cycle.joints),
        largest(|cycle| &cycle.torque),
        tips.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
    ]
}

#[test]
fn on_cables_an_effect_of_size_zero_changes_nothing_and_one_of_size_shows() {
    let robot = robot(Connection::Cable);
    let nominal = run(&robot, &[]);
    for Case { none, some, bounds } in cases(3) {
        for bound in bounds {
            let absent = difference(&run(&robot, &[Effect::new(none, bound)]), &nominal);
            assert!(absent.iter().all(|difference| *difference < 1e-9), "{} of size 0 on {bound:?}: {absent:?}", none.name());
            let found = difference(&run(&robot, &[Effect::new(some, bound)]), &nominal);
            assert!(found.iter().any(|difference| *difference > 1e-6), "{} on {bound:?}: {found:?}", some.name());
            assert!(found.iter().all(|difference| difference.is_finite()), "{} on {bound:?}: {found:?}", some.name());
        }
    }
}

#[test]
fn on_rigid_drives_and_under_forces_every_effect_shows_too() {
    for connection in [Connection::Rigid, Connection::Force] {
        let robot = robot(connection);
        let nominal = run(&robot, &[]);
        for Case { some, bounds, .. } in cases(3) {
            for bound in bounds {
                let found = difference(&run(&robot, &[Effect::new(some, bound)]), &nominal);
                // Without motors there is no cable that couples joints.
                let nothing = connection == Connection::Force && matches!(bound, Bound::Pair(..));
                let shows = found.iter().any(|difference| *difference > 1e-6);
                assert!(shows || nothing, "{connection:?}: {} on {bound:?}: {found:?}", some.name());
                assert!(found.iter().all(|difference| difference.is_finite()), "{} on {bound:?}: {found:?}", some.name());
            }
        }
    }
}

#[test]
fn what_the_controller_does_not_know_shows_in_the_true_joint_by_its_size() {
    for connection in [Connection::Cable, Connection::Rigid, Connection::Force] {
        let robot = robot(connection);
        let nominal = run(&robot, &[]);
        let last = nominal.len() - 1;
        for joint in 0..3 {
            let size = 0.004;
            let moved = run(&robot, &[Effect::new(physics("joint_offset", &[("o", size)]), Bound::Joint(joint))]);
            let shift = |cycle: &ArmCycle| cycle.true_joints[joint] - cycle.joints[joint];
            let found = shift(&moved[last]) - shift(&nominal[last]);
            assert!((found - size).abs() < 3e-4, "{connection:?}, joint {}: {found}", joint + 1);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_a_homing_its_offset() {
    let text = "[homing]\noffset_sd = [0.01, 0.01, 0.001]\n";
    let text = format!("schema = \"ravenpose-robot/1\"\nname = \"h\"\nbase = \"urdf\"\nurdf_xml = '''\n{THREE_JOINTS}'''\n{text}");
    let robot = RobotModel::from_toml(&text, None).expect("robot");
    let offset = |seed| *ArmSimulation::new(&robot, None, seed, &[0.0; 8]).expect("arm").homing_offset();
    assert_eq!(offset(1), offset(1));
    assert_ne!(offset(1), offset(2));
    assert_eq!(run(&robot, &[]), run(&robot, &[]));
}

#[test]
fn an_arm_follows_its_commands_within_its_limits_with_assumed_gains() {
    for connection in [Connection::Cable, Connection::Rigid] {
        let robot = robot(connection);
        let motion = trajectory(&robot, 3, 30.0);
        let mut simulation = ArmSimulation::new(&robot, None, 1, motion.start()).expect("simulation");
        let mut worst = [0.0_f64; 3];
        for k in 0..30_000 {
            let cycle = simulation.tick(&motion.at(f64::from(k) * 1e-3));
            for (joint, body) in robot.arm().bodies().iter().enumerate() {
                assert!(body.joint.limits.allows(cycle.joints_d[joint]), "{:?}", cycle.joints_d);
                worst[joint] = worst[joint].max((cycle.joints[joint] - cycle.joints_d[joint]).abs());
            }
        }
        println!("{connection:?}: off by {worst:?} rad, rad, m at most");
        assert!(worst[0] < 0.03 && worst[1] < 0.03 && worst[2] < 0.01, "{connection:?}: {worst:?}");
    }
}

#[test]
fn a_rigid_motor_turns_as_fast_as_its_angle_says_whatever_its_ratio() {
    let robot = robot(Connection::Rigid);
    let effect = "physics = \"transmission_ratio\"\njoint = 2\nparameters = { e = 0.1 }";
    let more = RobotModel::from_toml(&format!("{}\n[[effect]]\n{effect}\n", robot.to_toml()), None).expect("a robot");
    let cycles = run(&robot, more.effects());
    let slope = |k: usize| (cycles[k + 1].motors[1] - cycles[k - 1].motors[1]) / 2e-3;
    let pairs = || (100..1900).map(|k| (cycles[k].speeds[1], slope(k)));
    let found = pairs().map(|(speed, slope)| speed * slope).sum::<f64>() / pairs().map(|(_, slope)| slope * slope).sum::<f64>();
    assert!((found - 1.0).abs() < 0.01, "{found} of the angle's own speed");
}
