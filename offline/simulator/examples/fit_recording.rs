//! Fits friction, rotor inertia and amplifier offsets of motors 1 to 3 to a recording of amplifier commands, and prints the
//! robot file: `cargo run --release -p ravenpose-simulator --example fit_recording -- RECORDING.csv > robot.toml`.
//! Fitted on the first two thirds of its windows of one second; what it prints to standard error is on all and on the rest.
#![allow(missing_docs)]

use arm::Side;
use recordings::csv;
use simulator::Robot;
use simulator::replay::{MotorRecord, Replay, standing_still_rms};
use std::fmt::Write as _;

const WINDOW: usize = 1000;
/// Motor Coulomb (3), motor viscous (3), motor inertia (3), joint Coulomb (3), amplifier offsets in counts (3).
const COUNT: usize = 15;

fn text(p: &[f64; COUNT]) -> String {
    let three = |at: usize| format!("[{:.5e}, {:.5e}, {:.5e}]", p[at], p[at + 1], p[at + 2]);
    let mut text = format!(
        "schema = \"ravenpose-robot/1\"\nname = \"raven2-uiuc-fit\"\nbase = \"raven2-nominal\"\n\n[plant.motor]\ninertia_capstan = {}\n\n[plant.friction]\nmotor_coulomb_nm = {}\nmotor_viscous_nm_s = {}\njoint_coulomb = {}\n",
        three(6),
        three(0),
        three(3),
        three(9)
    );
    for joint in 0..3 {
        let _ = write!(
            text,
            "\n[[effect]]\nphysics = \"motor_torque_scale\"\njoint = {}\nparameters = {{ d_0 = {:.2} }}\n",
            joint + 1,
            p[12 + joint]
        );
    }
    text
}

fn main() {
    let path = std::env::args().nth(1).expect("usage: fit_recording RECORDING.csv");
    let record = MotorRecord::from_recording(&csv::read(path.as_ref()).expect("recording")).expect("motors");
    let split = record.len() * 2 / 3 / WINDOW * WINDOW;
    let (train, rest) = (record.part(0..split), record.part(split..record.len()));
    let still = standing_still_rms(&train, WINDOW);
    let cost = |p: &[f64; COUNT]| -> f64 {
        let robot = Robot::from_toml(&text(p)).expect("robot");
        let rms = Replay::new(&robot, Side::Gold).expect("plant").rms(&train, WINDOW);
        (0..3).map(|i| (rms[i] / still[i]).powi(2)).sum::<f64>()
    };
    // From the least-squares figures of raven2-plant.toml, [alternatives.motor_fit_2015].
    let mut p = [0.0516, 0.0887, 0.06, 6.7e-4, 1.85e-3, 1.0e-3, 1.79e-4, 1.57e-4, 1.8e-4, 0.05, 0.05, 0.3, 0.0, 0.0, 0.0];
    let mut best = cost(&p);
    let mut steps = [1.3_f64; COUNT];
    let mut offsets = 30.0;
    for sweep in 0..14 {
        for i in 0..COUNT {
            for up in [true, false] {
                let mut tried = p;
                if i < 12 {
                    tried[i] *= if up { steps[i] } else { 1.0 / steps[i] };
                } else {
                    tried[i] += if up { offsets } else { -offsets };
                }
                let found = cost(&tried);
                if found < best {
                    (best, p) = (found, tried);
                    break;
                }
                if !up && i < 12 {
                    steps[i] = 1.0 + (steps[i] - 1.0) * 0.7;
                }
            }
        }
        offsets *= 0.85;
        eprintln!("sweep {sweep}: {best:.4}");
    }
    let robot = Robot::from_toml(&text(&p)).expect("robot");
    for (name, part) in [("fitted part", &train), ("rest", &rest), ("all", &record)] {
        let rms = Replay::new(&robot, Side::Gold).expect("plant").rms(part, WINDOW);
        eprintln!(
            "{name}: fitted {rms:.2?} rad, nominal {:.2?}, standing still {:.2?}",
            Replay::new(&Robot::nominal(), Side::Gold).expect("plant").rms(part, WINDOW),
            standing_still_rms(part, WINDOW)
        );
    }
    print!("{}", text(&p));
}
