//! The shipped robots give the same bits as when their golden numbers were written: whoever changes the plant on purpose
//! writes new ones.
#![allow(missing_docs)]

use arm::Side;
use simulator::trajectory::{WORKSPACE, teleoperation};
use simulator::{Command, Robot, Simulation};

/// FNV-1a over bits.
#[derive(Clone, Copy)]
struct Fingerprint(u64);

impl Fingerprint {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, value: f64) {
        for byte in value.to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Sines, powers and exponentials come from the machine's own library: only the same library gives the same bits.
fn library() -> u64 {
    let mut print = Fingerprint::new();
    for k in 0..4000 {
        let x = f64::from(k - 2000) * 0.001_37;
        for value in [x.sin(), x.cos(), x.tanh(), x.exp(), x.exp_m1(), (x + 3.0).ln(), (x + 3.0).powf(1.7), x.atan2(0.3)] {
            print.add(value);
        }
    }
    print.0
}

/// Two seconds of a robot: fingerprint of all truth and commands, and the last tip.
fn run(robot: &Robot, side: Side) -> (u64, [f64; 3]) {
    let start = WORKSPACE.map(|(low, high)| f64::midpoint(low, high));
    let trajectory = teleoperation(11, start, &WORKSPACE, 2.0);
    let mut simulation = Simulation::new(robot, side, 11, &start).expect("robot");
    let (mut print, mut last) = (Fingerprint::new(), [0.0; 3]);
    for k in 0..2000 {
        let cycle = simulation.tick(&Command::Joints(trajectory.at(f64::from(k) * 1e-3)));
        let truth = &cycle.truth;
        last = [truth.tip.translation.x, truth.tip.translation.y, truth.tip.translation.z];
        let numbers = truth.joints.iter().chain(&truth.motors).chain(&cycle.reported.torque_nm).chain(&last);
        numbers.for_each(|value| print.add(*value));
    }
    (print.0, last)
}

const LIBRARY: u64 = 0x0e1f_85fd_476b_76da;
const NOMINAL: (u64, [f64; 3]) =
    (0x51c9_6faa_ba3d_1847, [-0.103_267_674_963_088_83, -0.108_846_407_470_813_3, 0.057_017_908_873_642_58]);
const WORN: (u64, [f64; 3]) =
    (0x650a_dede_54f3_b9bd, [-0.106_540_709_395_106_88, 0.110_939_927_449_638_71, 0.053_722_652_075_522_445]);

#[test]
fn nominal_and_worn_give_the_bits_they_always_gave() {
    let same_library = library() == LIBRARY;
    println!("library {:#018x}, bits are {}compared", library(), if same_library { "" } else { "not " });
    for (name, robot, side, golden) in
        [("nominal", Robot::nominal(), Side::Gold, NOMINAL), ("worn", Robot::worn(), Side::Green, WORN)]
    {
        let (print, last) = run(&robot, side);
        println!("{name}: {print:#018x} {last:?}");
        assert!(!same_library || print == golden.0, "{name}: {print:#018x} instead of {:#018x}", golden.0);
        let off = last.iter().zip(golden.1).map(|(found, golden)| (found - golden).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{name}: {off} m");
    }
}
