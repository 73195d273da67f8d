//! Recordings of an arm that is not RAVEN-II, simulated again (`data/gap-examples`: another program's plant).
#![allow(missing_docs)]

mod common;

use std::path::PathBuf;

use common::cases::physics;
use common::data;
use common::urdf::{THREE_JOINTS, gap_urdf};
use recordings::csv;
use simulator::RobotModel;
use simulator::any_arm::{ArmSimulation, trajectory};
use simulator::model::{Bound, Connection, ControllerModel, ControllerNumbers, Effect};
use simulator::physics::Channel;
use simulator::plant::{Given, Vector};
use simulator::resimulate::{ClosedLoop, Motion, OpenLoop, Run, Simulated, closed_loop, inverse, open_loop};

/// The arm of the examples with drives as least squares on `a/sim_1` gives them: gains from torque over error, rotors and friction
/// from torque over the joints' motion, stiffness from how far motors and joints stand apart under load. Rounded to two digits.
fn robot(urdf: &std::path::Path) -> RobotModel {
    let mut robot = RobotModel::load(&urdf.to_string_lossy()).expect("URDF");
    let drives = [(1600.0, 2.0, 0.0125, 3.1e-5, 0.05), (400.0, 0.5, 0.0105, 3.7e-5, 0.03), (4e4, 30.0, 0.0093, 3.7e-5, 0.12)];
    for (joint, (stiffness, damping, motor_coulomb, motor_viscous, joint_coulomb)) in drives.into_iter().enumerate() {
        let mut drive = robot.drives()[joint];
        (drive.connection, drive.stiffness, drive.damping) = (Connection::Cable, stiffness, damping);
        (drive.motor_coulomb_nm, drive.motor_viscous_nm_s) = (motor_coulomb, motor_viscous);
        (drive.rotor_inertia_kg_m2, drive.joint_coulomb) = (1.5e-5, joint_coulomb);
        robot.set_drive(joint, &drive).expect("drive");
    }
    let joint = |kp: f64, ki: f64, kd: f64| ControllerNumbers { kp, ki, kd, velocity_share: 1.0, gravity_share: 1.0 };
    let joints = vec![joint(0.2, 0.02, 4e-3), joint(0.165, 0.005, 3.2e-3), joint(0.1, 0.0, 2e-3)];
    robot.set_controller(Some(ControllerModel { period_s: 1e-3, delay_cycles: 0, joints })).expect("gains");
    robot
}

fn run(robot: &RobotModel, name: &str) -> Run {
    let path: PathBuf = data().join("gap-examples").join(name);
    Run::from_recording(&csv::read(&path).expect("recording"), robot).expect("run")
}

/// Three numbers with three digits.
fn shown(values: [f64; 3]) -> String {
    values.map(|value| format!("{value:.2e}")).join(" ")
}

fn rms(found: &[Vector], wanted: &[Vector]) -> [f64; 3] {
    let from = 500;
    let rows = (found.len() - from) as f64;
    std::array::from_fn(|joint| {
        let squares: f64 = found.iter().zip(wanted).skip(from).map(|(a, b)| (a[joint] - b[joint]).powi(2)).sum();
        (squares / rows).sqrt()
    })
}

fn spread(rows: &[Vector]) -> [f64; 3] {
    std::array::from_fn(|joint| {
        let mean = rows.iter().map(|row| row[joint]).sum::<f64>() / rows.len() as f64;
        (rows.iter().map(|row| (row[joint] - mean).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
    })
}

#[test]
fn commands_of_another_simulator_give_nearly_its_motion() {
    let Some(urdf) = gap_urdf() else { return };
    let robot = robot(&urdf);
    let recorded = run(&robot, "a/sim_1.csv.gz");
    let begun = std::time::Instant::now();
    let found = closed_loop(&robot, &recorded, ClosedLoop::default()).expect("closed loop");
    let speed = 12.0 / begun.elapsed().as_secs_f64();
    let (torque, motors) = (recorded.torque.as_ref().expect("tau"), recorded.motors.as_ref().expect("mpos"));
    let truth = recorded.true_joints.as_ref().expect("truth_jpos");
    let (off, size) = (rms(&found.true_joints, truth), spread(truth));
    for joint in 0..3 {
        assert!(off[joint] < 0.01 * size[joint], "joint {}: {} of {}", joint + 1, off[joint], size[joint]);
        let (off, size) = (rms(&found.torque, torque)[joint], spread(torque)[joint]);
        assert!(off < 0.25 * size, "torque {}: {off} of {size}", joint + 1);
    }
    println!("closed loop, {speed:.0} times real time; off by (RMS, in brackets the spread of the recorded signal)");
    println!("motors rad {} ({})", shown(rms(&found.motors, motors)), shown(spread(motors)));
    println!("joints rad, m {} ({})", shown(rms(&found.true_joints, truth)), shown(spread(truth)));
    println!("torque Nm {} ({})", shown(rms(&found.torque, torque)), shown(spread(torque)));
    let windows = open_loop(&robot, &recorded, OpenLoop::default()).expect("open loop");
    println!("open loop, 1 s windows: motors rad {}", shown(rms(&windows.motors, motors)));
    (0..3).for_each(|joint| assert!(rms(&windows.motors, motors)[joint] < 0.15 * spread(motors)[joint]));
    for given in [Given::Motors, Given::Joints] {
        let motion = Motion::of_run(&recorded, given, 15).expect("motion");
        let begun = std::time::Instant::now();
        let needed: Simulated = inverse(&robot, &motion).expect("inverse");
        let speed = 12.0 / begun.elapsed().as_secs_f64();
        (0..3).for_each(|joint| assert!(rms(&needed.torque, torque)[joint] < 0.2 * spread(torque)[joint]));
        println!(
            "inverse from {given:?}, {speed:.0} times real time: torque Nm {}, joints {}, motors {}",
            shown(rms(&needed.torque, torque)),
            shown(rms(&needed.true_joints, truth)),
            shown(rms(&needed.motors, motors))
        );
    }
}

/// Rows from `first` on.
fn tail(found: &Simulated, first: usize) -> (Vec<f64>, [Vec<Vector>; 3]) {
    (found.time_s[first..].to_vec(), [&found.motors, &found.torque, &found.true_joints].map(|rows| rows[first..].to_vec()))
}

#[test]
fn rows_that_are_not_kept_are_simulated_all_the_same() {
    let Some(urdf) = gap_urdf() else { return };
    let robot = robot(&urdf);
    let recorded = run(&robot, "a/sim_1.csv.gz");
    let from_s = 7.0;
    let first = recorded.time_s.iter().position(|time_s| time_s - recorded.time_s[0] >= from_s).expect("longer");
    let in_loop =
        |from_s: f64| closed_loop(&robot, &recorded, ClosedLoop { from_s, ..ClosedLoop::default() }).expect("closed loop");
    // What remembers nothing begins with the window of the first row that is kept, what does with the first of all.
    let forever = f64::NEG_INFINITY;
    let hysteresis = with(&robot, "cable_hysteresis", &[("a", 0.5), ("k", 1000.0), ("z_m", 2e-3)], Bound::Joint(1), forever);
    let late = with(&robot, "measurement_delay", &[("d", 0.03)], Bound::Channel(Channel::Transmission), forever);
    let from_motion = with(&robot, "payload", &[("m_p", 0.25)], Bound::Robot, 6.5);
    let driven = |robot: &RobotModel, window_s: f64, from_s: f64| {
        open_loop(robot, &recorded, OpenLoop { window_s, from_s, ..OpenLoop::default() }).expect("open loop")
    };
    let both = |robot: &RobotModel, window_s: f64| (driven(robot, window_s, 0.0), driven(robot, window_s, from_s));
    let all = [
        (in_loop(0.0), in_loop(from_s)),
        both(&robot, 1.0),
        both(&robot, 0.013),
        both(&robot, f64::INFINITY),
        both(&hysteresis, 1.0),
        both(&late, 0.3),
        both(&from_motion, 1.0),
    ];
    for (whole, part) in all {
        assert_eq!((whole.len(), part.len()), (recorded.len(), recorded.len() - first));
        assert_eq!(tail(&whole, first), tail(&part, 0));
    }
}

/// The robot with one more effect.
fn with(robot: &RobotModel, name: &str, numbers: &[(&str, f64)], bound: Bound, from_s: f64) -> RobotModel {
    let mut robot = robot.clone();
    let effect = Effect::new(physics(name, numbers), bound);
    robot.effects_mut().push(Effect { from_s, ..effect });
    robot
}

#[test]
fn the_effect_that_a_recording_has_brings_the_simulation_nearer() {
    let Some(urdf) = gap_urdf() else { return };
    let robot = robot(&urdf);
    // Sizes from truth.json: at the motor's shaft for friction, at the joint for play.
    let friction = with(&robot, "coulomb_friction", &[("f_c", 0.03 * 136.207)], Bound::Joint(0), f64::NEG_INFINITY);
    let play = with(&robot, "backlash", &[("b", 0.0015)], Bound::Joint(2), f64::NEG_INFINITY);
    let load = with(&robot, "payload", &[("m_p", 0.25), ("c_z", -0.05)], Bound::Robot, 5.667_214_664_287_051);
    for (name, corrected, most) in [("d", friction, 0.3), ("a", play, 0.5), ("b", load, 0.7)] {
        let recorded = run(&robot, &format!("{name}/real_1.csv.gz"));
        let off = |robot: &RobotModel| {
            let found = closed_loop(robot, &recorded, ClosedLoop::default()).expect("closed loop");
            let torque = rms(&found.torque, recorded.torque.as_ref().expect("tau"));
            let joints = rms(&found.true_joints, recorded.true_joints.as_ref().expect("truth_jpos"));
            (torque, joints)
        };
        let (before, after) = (off(&robot), off(&corrected));
        println!("{name}: torque Nm {} to {}, joints {} to {}", shown(before.0), shown(after.0), shown(before.1), shown(after.1));
        let left = match name {
            "a" => after.1[2] / before.1[2],
            "b" => after.0[1] / before.0[1],
            _ => after.0[0] / before.0[0],
        };
        assert!(left < most, "{name}: {left}");
    }
}

/// A motion of our own, recorded, and read backwards: torque, joints and motors come back.
#[test]
fn the_inverse_of_a_simulation_is_the_simulation() {
    let text =
        format!("schema = \"ravenpose-robot/1\"\nname = \"r\"\nbase = \"urdf\"\nurdf_xml = '''\n{THREE_JOINTS}'''\n{DRIVES}");
    let plain = RobotModel::from_toml(&text, None).expect("robot");
    let forever = f64::NEG_INFINITY;
    let stiffness = 1000.0;
    for (name, robot) in [
        ("nothing", plain.clone()),
        ("coulomb", with(&plain, "coulomb_friction", &[("f_c", 2.0)], Bound::Joint(0), forever)),
        ("motor", with(&plain, "coulomb_friction", &[("f_c", 2.0)], Bound::Motor(0), forever)),
        ("load", with(&plain, "load_dependent_friction", &[("mu_l", 0.3)], Bound::Joint(1), forever)),
        ("backlash", with(&plain, "backlash", &[("b", 0.002)], Bound::Joint(1), forever)),
        ("stretch", with(&plain, "cable_stretch", &[("k", 800.0)], Bound::Joint(1), forever)),
        ("creep", with(&plain, "cable_creep", &[("J_k", 5e-4), ("T_k", 1.0)], Bound::Joint(1), forever)),
        ("hysteresis", with(&plain, "cable_hysteresis", &[("a", 0.5), ("k", stiffness), ("z_m", 2e-3)], Bound::Joint(1), forever)),
        ("ripple", with(&plain, "torque_ripple", &[("amp", 0.5), ("order", 1.0)], Bound::Joint(0), forever)),
        ("scale", with(&plain, "motor_torque_scale", &[("kappa", 0.8), ("d_0", 20.0)], Bound::Joint(0), forever)),
        ("ratio", with(&plain, "transmission_ratio", &[("e", 0.03)], Bound::Joint(1), forever)),
        ("coupling", with(&plain, "joint_coupling", &[("c_ij", 0.05)], Bound::Pair(1, 0), forever)),
        ("payload", with(&plain, "payload", &[("m_p", 0.3)], Bound::Robot, forever)),
        ("rigid", RobotModel::from_urdf(THREE_JOINTS).expect("URDF")),
    ] {
        let motion = trajectory(&robot, 7, 6.0);
        let mut simulation = ArmSimulation::new(&robot, None, 1, motion.start()).expect("simulation");
        simulation.settle(motion.start(), 1.0);
        let cycles: Vec<_> = (0..6000).map(|k| simulation.tick(&motion.at(f64::from(k) * 1e-3))).collect();
        let recorded = Run {
            name: name.to_owned(),
            time_s: (0..6000).map(|k| f64::from(k) * 1e-3).collect(),
            motors: Some(cycles.iter().map(|cycle| cycle.motors).collect()),
            true_joints: Some(cycles.iter().map(|cycle| cycle.true_joints).collect()),
            ..Run::default()
        };
        let torque: Vec<Vector> = cycles.iter().map(|cycle| cycle.torque).collect();
        let (motors, joints) = (recorded.motors.as_ref().expect("motors"), recorded.true_joints.as_ref().expect("joints"));
        for given in [Given::Motors, Given::Joints] {
            let motion = Motion::of_run(&recorded, given, 4).expect("motion");
            let needed = inverse(&robot, &motion).expect("inverse");
            let share = |found: [f64; 3], size: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| found[i] / size[i]) };
            let off = [
                share(rms(&needed.torque, &torque), spread(&torque)),
                share(rms(&needed.true_joints, joints), spread(joints)),
                share(rms(&needed.motors, motors), spread(motors)),
            ];
            println!("{name} from {given:?}: torque {}, joints {}, motors {}", shown(off[0]), shown(off[1]), shown(off[2]));
            assert!(off[0].iter().all(|off| *off < 0.12), "{name} from {given:?}: {off:?}");
            // What the element remembers at the beginning is not in the recording.
            let most = if name == "hysteresis" { 0.02 } else { 2e-3 };
            assert!(off[1].iter().chain(&off[2]).all(|off| *off < most), "{name} from {given:?}: {off:?}");
        }
    }
}

const DRIVES: &str = "
[drive.shoulder]
rotor_inertia_kg_m2 = 1.5e-5
stiffness = 5000
damping = 10
joint_coulomb = 0.3
torque_constant_nm_a = 0.06
counts_per_a = 2730
[drive.elbow]
rotor_inertia_kg_m2 = 1.5e-5
stiffness = 1000
damping = 3
motor_coulomb_nm = 0.003
[drive.insertion]
rotor_inertia_kg_m2 = 1.5e-5
stiffness = 4e4
damping = 100
[coupling]
matrix = [[1, 0, 0], [0.145, 1, 0], [0.008, 0.0081, 1]]
";

#[test]
fn friction_of_a_motor_asks_the_torque_of_a_joints_but_does_not_stretch_its_cable() {
    let mut bare = RobotModel::from_urdf(THREE_JOINTS).expect("URDF");
    for joint in 0..3 {
        let mut drive = bare.drives()[joint];
        (drive.connection, drive.stiffness, drive.damping, drive.rotor_inertia_kg_m2) = (Connection::Cable, 900.0, 1.0, 1e-5);
        bare.set_drive(joint, &drive).expect("drive");
    }
    let ratio = bare.drives()[1].reduction;
    // The second joint turns steadily, far above the width of its sign, backward and forward.
    for speed in [-0.8, 0.8] {
        let rows = 200;
        let place = |row: usize| [0.4, 1.2 + speed * row as f64 * 1e-3, -0.2];
        let motor = |joints: [f64; 3]| -> Vector {
            let mut motors = Vector::default();
            (0..3).for_each(|j| motors[j] = joints[j] * bare.drives()[j].reduction);
            motors
        };
        let motion = Motion {
            given: Given::Motors,
            time_s: (0..rows).map(|row| row as f64 * 1e-3).collect(),
            positions: (0..rows).map(|row| motor(place(row))).collect(),
            rates: vec![motor([0.0, speed, 0.0]); rows],
            accelerations: vec![Vector::default(); rows],
        };
        let played = |bound: Option<Bound>, name: &str, numbers: &[(&str, f64)]| {
            let mut robot = bare.clone();
            robot.effects_mut().extend(bound.map(|bound| Effect::new(physics(name, numbers), bound)));
            let found = inverse(&robot, &motion).expect("inverse");
            (found.torque[rows - 1][1], found.true_joints[rows - 1][1])
        };
        let (torque, joint) = played(None, "", &[]);
        for (name, numbers, level) in [
            ("coulomb_friction", &[("f_c", 0.5)][..], 0.5 * speed.signum()),
            ("coulomb_friction", &[("f_c", 0.5), ("f_c_asym", 0.2)], 0.5 * speed.signum() + 0.1),
            ("viscous_friction", &[("b", 0.25)], 0.25 * speed),
            ("stribeck_friction", &[("f_c", 0.3), ("f_s", 0.6), ("v_s", 0.01), ("a", 2.0)], 0.3 * speed.signum()),
        ] {
            let (with, there) = played(Some(Bound::Motor(1)), name, numbers);
            assert!(((with - torque) * ratio - level).abs() < 1e-6, "{name}: {} for {level}", (with - torque) * ratio);
            assert_eq!(there, joint, "{name}");
            let (with, there) = played(Some(Bound::Joint(1)), name, numbers);
            assert!(((with - torque) * ratio - level).abs() < 2e-3, "{name}: {} for {level}", (with - torque) * ratio);
            assert!((joint - there - level / 900.0).abs() < 1e-5, "{name}: {}", joint - there);
        }
    }
}
