//! Recordings of a RAVEN-II simulated again.
#![allow(missing_docs)]

mod common;

use arm::{JOINTS, Side};
use common::data;
use recordings::csv;
use simulator::model::RobotModel;
use simulator::plant::{Dragged, Given, Vector};
use simulator::replay::{MotorRecord, Replay};
use simulator::resimulate::{ClosedLoop, Commands, Motion, OpenLoop, Run, closed_loop, inverse, open_loop};
use simulator::trajectory::{WORKSPACE, teleoperation};
use simulator::{Command, CycleOfArm, Robot, Simulation};

fn wide(values: &[f64; JOINTS]) -> Vector {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Two seconds of a robot that was held for one second first.
fn made(robot: &Robot, side: Side) -> (Vec<CycleOfArm>, Run) {
    let start = WORKSPACE.map(|(low, high)| f64::midpoint(low, high));
    let trajectory = teleoperation(4, start, &WORKSPACE, 2.0);
    let mut simulation = Simulation::new(robot, side, 3, &start).expect("robot");
    simulation.settle(&start, 1.0);
    let cycles: Vec<_> = (0..2000).map(|k| simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)))).collect();
    let rows = |part: &dyn Fn(&CycleOfArm) -> Vector| Some(cycles.iter().map(part).collect());
    let run = Run {
        name: "made".to_owned(),
        time_s: (0..2000).map(|k| f64::from(k) * 1e-3).collect(),
        joints_d: rows(&|cycle| wide(&cycle.reported.joints_d)),
        motors: rows(&|cycle| wide(&cycle.truth.motors)),
        ..Run::default()
    };
    (cycles, run)
}

#[test]
fn the_commands_of_a_simulated_run_give_that_run() {
    for (robot, side) in [(Robot::nominal(), Side::Gold), (Robot::worn(), Side::Green)] {
        let (cycles, run) = made(&robot, side);
        let model = RobotModel::raven(robot, side);
        let options = ClosedLoop { seed: 3, settle_s: 1.0, ..ClosedLoop::default() };
        let found = closed_loop(&model, &run, options).expect("closed loop");
        assert_eq!(found.len(), cycles.len());
        for (row, cycle) in cycles.iter().enumerate() {
            assert_eq!(found.true_joints[row], wide(&cycle.truth.joints), "row {row}");
            assert_eq!(found.motors[row], wide(&cycle.reported.motors), "row {row}");
        }
        let recording = found.to_recording("again", &model);
        assert_eq!(recording.column("tau_3_nm").expect("tau")[700], cycles[700].reported.torque_nm[2] / 12.25);
        assert!((recording.column("x_m").expect("x")[5] - found.tip[5][0]).abs() < 1e-15);
        assert!(recording.column("jpos_d_7_rad").is_some() && recording.column("truth_jpos_3_m").is_some());
    }
}

#[test]
fn joints_of_the_tool_without_commands_stand_at_home() {
    let model = RobotModel::raven(Robot::nominal(), Side::Gold);
    let home = Robot::nominal().raven.plant().limits.home;
    let of = |names: &str, values: &str| {
        let text = format!("t_s,jpos_d_1_rad,jpos_d_2_rad,jpos_d_3_m{names}\n0,0.5,1.5,-0.3{values}\n0.001,0.5,1.5,-0.3{values}\n");
        let recording = csv::read_text("commands", text.as_bytes()).expect("recording");
        *Commands::of_run(&model, &Run::from_recording(&recording, &model).expect("run")).expect("commands").first()
    };
    assert!(home[3..].iter().any(|angle| *angle != 0.0));
    assert_eq!(of("", "")[3..7], home[3..]);
    // A log of states has their columns.
    assert_eq!(of(",jpos_d_4_rad,jpos_d_5_rad,jpos_d_6_rad,jpos_d_7_rad", ",0,0,0,0")[3..7], home[3..]);
    let one = of(",jpos_d_5_rad", ",0.25");
    assert_eq!((one[3], one[4], &one[5..7]), (home[3], 0.25, &home[5..]));
    assert_eq!(of(",jpos_d_4_rad,jpos_d_5_rad", ",0,0.25")[3..5], [0.0, 0.25]);
}

#[test]
fn the_torque_that_a_motion_needs_is_the_one_that_was_commanded() {
    let dragged = Dragged { stiffness_nm_rad: 0.02, level_nm: 0.06, v_s_rad_s: 4.0, memory_s: 0.05 };
    let mut robot = Robot::nominal();
    for tool_cables in [None, Some(dragged)] {
        robot.tool_cables = tool_cables;
        needs_what_was_commanded(&robot);
    }
}

fn needs_what_was_commanded(robot: &Robot) {
    let (cycles, run) = made(robot, Side::Gold);
    let model = RobotModel::raven(robot.clone(), Side::Gold);
    let motion = Motion::of_run(&run, Given::Motors, 6).expect("motion");
    let found = inverse(&model, &motion).expect("inverse");
    for joint in 0..3 {
        let (mut off, mut size) = (0.0, 0.0);
        for (row, cycle) in cycles.iter().enumerate().skip(200) {
            // The command as the amplifier gives it, filtered by nothing: encoder steps rattle in it.
            let torque = cycle.reported.torque_nm[joint] / 12.25;
            off += (found.torque[row][joint] - torque).powi(2);
            size += torque * torque;
        }
        let share = (off / size).sqrt();
        println!("motor {}: torque off by {share:.3} of its RMS", joint + 1);
        assert!(share < 0.25, "motor {}: {share}", joint + 1);
    }
}

#[test]
fn amplifier_commands_in_windows_are_the_replay() {
    let path = data().join("raven2-uiuc/real_first_two_thirds.csv");
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return;
    }
    let recording = csv::read(&path).expect("recording");
    let record = MotorRecord::from_recording(&recording).expect("motors");
    let robot = Robot::from_toml(include_str!("../../../models/raven2-uiuc-fit.toml")).expect("robot");
    let replayed = Replay::new(&robot, Side::Gold).expect("plant").rms(&record, 1000);
    let model = RobotModel::raven(robot, Side::Gold);
    let mut run = Run::from_recording(&recording, &model).expect("run");
    // The replay takes every row for a millisecond.
    run.time_s.iter_mut().enumerate().for_each(|(row, time_s)| *time_s = row as f64 * 1e-3);
    let begun = std::time::Instant::now();
    let found = open_loop(&model, &run, OpenLoop::default()).expect("open loop");
    let speed = (run.time_s[run.len() - 1] - run.time_s[0]) / begun.elapsed().as_secs_f64();
    let whole = run.len() / 1000 * 1000;
    for (motor, wanted) in replayed.iter().enumerate() {
        let squares: f64 = (0..whole).map(|row| (found.motors[row][motor] - record.angles[row][motor]).powi(2)).sum();
        let rms = (squares / whole as f64).sqrt();
        assert!((rms / wanted - 1.0).abs() < 1e-6, "motor {}: {rms} and {wanted}", motor + 1);
    }
    println!("windows of 1 s: {replayed:.2?} rad RMS, {speed:.0} times real time");
}
