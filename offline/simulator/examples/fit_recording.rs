//! Fits friction, rotor inertia, amplifiers and links of joints 1 to 3 to a recording of amplifier commands, and prints the
//! robot file: `cargo run --release -p ravenpose-simulator --example fit_recording -- RECORDING.csv > robot.toml`.
//! Fitted on the first two thirds, in windows of one second that begin every tenth (of so few strokes another start is another test), then with a
//! little of five; what it prints to standard error is on all and on the rest. A random search of one mean and one size of step, from a seed: some 15 minutes.
#![allow(missing_docs)]

use arm::Side;
use recordings::csv;
use simulator::replay::{MotorRecord, Replay, standing_still_rms};
use simulator::{Random, Robot};
use std::fmt::Write as _;

const WINDOW: usize = 1000;
/// Where windows begin, parts of one.
const PHASES: usize = 10;
/// Longer windows, which count little: what drifts in one second runs away in five.
const LONG: usize = 5000;
/// So many tries with so much weight of the longer windows: first the strokes, then the drift.
const STAGES: [(usize, f64); 2] = [(1600, 0.0), (1200, 0.1)];
const SEED: u64 = 2;
/// Links: mass (1), shift of the centre (3).
const LINKS: usize = 24;
const TOOL: usize = LINKS + 12;
const COUNT: usize = TOOL + 4;
/// Tool cables that motor 3 drags along: stiffness, level, speed, time; where they begin, and how far they may be thought to be off. The first two
/// are of the size that four cables and motors of the plant file have at this capstan.
const TOOL_CABLES: [(&str, f64, f64); 4] =
    [("stiffness_nm_rad", 0.02, 5e-3), ("level_nm", 0.06, 0.01), ("v_s_rad_s", 4.0, 1.0), ("memory_s", 0.05, 0.02)];
/// Masses, kg, and centres, m, of the nominal links.
const MASS: [f64; 3] = [0.503, 0.753, 0.407];
const CENTRE: [[f64; 3]; 3] = [
    [0.007_176_359_998_59, 0.163_997_581_375, -0.071_816_874_933_1],
    [-0.004_103_329_998_7, -0.172_010_044_873, -0.179_319_187_24],
    [-0.018_705_121_263_6, -0.000_150_526_999_862, -0.000_515_072_604_716],
];
/// Three numbers each, one per joint: name, where they begin, how far they may be thought to be off. Friction and inertia from
/// raven2-plant.toml, `[alternatives.motor_fit_2015]`.
const BEGIN: [(&str, [f64; 3], [f64; 3]); 8] = [
    ("motor_coulomb_nm", [0.0516, 0.0887, 0.073], [0.01, 0.01, 0.01]),
    ("motor_viscous_nm_s", [6.7e-4, 1.85e-3, 0.0], [3e-4, 8e-4, 3e-4]),
    ("joint_coulomb", [0.05, 0.05, 0.53], [0.1, 0.1, 0.5]),
    ("joint_viscous", [0.005, 0.0025, 1000.0], [0.05, 0.05, 300.0]),
    ("motor_v_s_rad_s", [1.0, 1.0, 0.1], [0.5, 0.5, 0.1]),
    ("inertia_capstan", [4e-4, 1.2e-4, 2.5e-4], [1e-4, 5e-5, 5e-5]),
    ("kappa", [1.0, 1.0, 1.0], [0.1, 0.1, 0.1]),
    ("d_0", [8.0, 60.0, -75.0], [20.0, 20.0, 20.0]),
];
/// Least of what is divided by.
const LEAST: [(&str, f64); 3] = [("motor_v_s_rad_s", 0.05), ("inertia_capstan", 1e-5), ("kappa", 0.3)];

fn text(p: &[f64; COUNT]) -> String {
    let of = |name: &str| BEGIN.iter().position(|(own, ..)| *own == name).map_or(0, |k| 3 * k);
    let three = |name: &str| format!("{name} = [{:.5e}, {:.5e}, {:.5e}]\n", p[of(name)], p[of(name) + 1], p[of(name) + 2]);
    let friction: String = BEGIN[..5].iter().map(|(name, ..)| three(name)).collect();
    let mut text = format!(
        "schema = \"ravenpose-robot/1\"\nname = \"raven2-uiuc-fit\"\nbase = \"raven2-nominal\"\n\n[plant.motor]\n{}\n[plant.friction]\n{friction}",
        three("inertia_capstan")
    );
    for link in 0..3 {
        let at = LINKS + 4 * link;
        let centre: Vec<String> = (0..3).map(|k| format!("{:.5e}", CENTRE[link][k] + p[at + 1 + k])).collect();
        let (number, mass) = (link + 1, MASS[link] * p[at]);
        let _ = write!(text, "\n[plant.dynamics.gold.link{number}]\nmass_kg = {mass:.5e}\ncom_m = [{}]\n", centre.join(", "));
    }
    text += "\n[tool_cables]\n";
    for (k, (name, ..)) in TOOL_CABLES.iter().enumerate() {
        let _ = writeln!(text, "{name} = {:.5e}", p[TOOL + k]);
    }
    for joint in 0..3 {
        let (kappa, d_0) = (p[of("kappa") + joint], p[of("d_0") + joint]);
        let _ = write!(
            text,
            "\n[[effect]]\nphysics = \"motor_torque_scale\"\njoint = {}\nparameters = {{ kappa = {kappa:.5}, d_0 = {d_0:.2} }}\n",
            joint + 1
        );
    }
    text
}

fn main() {
    let path = std::env::args().nth(1).expect("usage: fit_recording RECORDING.csv");
    let record = MotorRecord::from_recording(&csv::read(path.as_ref()).expect("recording")).expect("motors");
    let split = record.len() * 2 / 3 / WINDOW * WINDOW;
    let rest = record.part(split..record.len());
    let part = |phase: usize| {
        record.part(phase * WINDOW / PHASES..if phase == 0 { split } else { split - WINDOW + phase * WINDOW / PHASES })
    };
    let beside_still = |part: MotorRecord, window: usize| {
        let still = standing_still_rms(&part, window);
        (part, window, still)
    };
    let parts: Vec<_> = (0..PHASES).map(|phase| beside_still(part(phase), WINDOW)).collect();
    let long = [0, split - LONG].map(|from| beside_still(record.part(from..split), LONG));
    let mut begin = [0.0; COUNT];
    let mut size = [0.01; COUNT];
    let mut least = [f64::NEG_INFINITY; COUNT];
    for (k, (name, from, sizes)) in BEGIN.iter().enumerate() {
        begin[3 * k..3 * k + 3].copy_from_slice(from);
        size[3 * k..3 * k + 3].copy_from_slice(sizes);
        let floor = LEAST.iter().find(|(own, _)| own == name).map_or(0.0, |(_, floor)| *floor);
        least[3 * k..3 * k + 3].fill(if *name == "d_0" { f64::NEG_INFINITY } else { floor });
    }
    for (k, (_, from, sizes)) in TOOL_CABLES.iter().enumerate() {
        (begin[TOOL + k], size[TOOL + k], least[TOOL + k]) = (*from, *sizes, 0.1 * from);
    }
    for link in 0..3 {
        (begin[LINKS + 4 * link], size[LINKS + 4 * link], least[LINKS + 4 * link]) = (1.0, 0.1, 0.1);
    }
    // What the few fast strokes of motor 3 cannot tell apart stays as it is: the tool's weight, its amplifier's scale, what rubs viscously, the
    // carriage's dry friction (the plant file's); and it sticks, so its sign turns as sharply as the step allows.
    for place in (LINKS + 8..LINKS + 12).chain([3 + 2, 6 + 2, 12 + 2, 18 + 2]) {
        size[place] = 0.0;
    }
    // Squared error over standing still, and a little for what is far from where it began.
    let cost = |p: &[f64; COUNT], long_weight: f64| -> f64 {
        if p.iter().zip(&least).any(|(x, least)| x < least) {
            return f64::INFINITY;
        }
        let Some(mut replay) = Robot::from_toml(&text(p)).ok().and_then(|robot| Replay::new(&robot, Side::Gold).ok()) else {
            return f64::INFINITY;
        };
        let mut error = |(part, window, still): &(MotorRecord, usize, [f64; 3])| {
            let rms = replay.rms(part, *window);
            rms.iter().zip(still).map(|(rms, still)| (rms / still).powi(2)).sum::<f64>()
        };
        let mut total = parts.iter().map(&mut error).sum::<f64>() / PHASES as f64;
        if long_weight > 0.0 {
            total += long_weight * long.iter().map(&mut error).sum::<f64>();
        }
        let far: f64 = (0..COUNT).filter(|i| size[*i] > 0.0).map(|i| ((p[i] - begin[i]) / (6.0 * size[i])).powi(2)).sum();
        total + 0.002 * far
    };
    let mut random = Random::new(SEED, 7);
    let mut best = begin;
    for (tries, long_weight) in STAGES {
        let mut lowest = cost(&best, long_weight);
        let (mut step_size, mut last) = (0.3_f64, [0.0; COUNT]);
        for tried in 0..tries {
            // Few numbers or many at a time; now and then again where it went well.
            let share = 0.15 + 0.6 * random.between(0.0, 1.0).powi(2);
            let mut step: [f64; COUNT] = std::array::from_fn(|i| {
                let (moves, by) = (random.between(0.0, 1.0) < share, random.normal());
                if moves { step_size * size[i] * by } else { 0.0 }
            });
            if tried % 5 == 4 {
                step = last.map(|x| x * random.between(0.2, 1.5));
            }
            let there = std::array::from_fn(|i| best[i] + step[i]);
            let found = cost(&there, long_weight);
            if found < lowest {
                (best, lowest, last) = (there, found, step);
                step_size = (1.15 * step_size).min(0.6);
            } else {
                step_size = (0.985 * step_size).max(0.01);
            }
            if tried % 200 == 199 {
                eprintln!("{}: {lowest:.4}", tried + 1);
            }
        }
    }
    let robot = Robot::from_toml(&text(&best)).expect("robot");
    for (name, part) in [("fitted part", &record.part(0..split)), ("rest", &rest), ("all", &record)] {
        let rms = Replay::new(&robot, Side::Gold).expect("plant").rms(part, WINDOW);
        eprintln!(
            "{name}: fitted {rms:.2?} rad, nominal {:.2?}, standing still {:.2?}",
            Replay::new(&Robot::nominal(), Side::Gold).expect("plant").rms(part, WINDOW),
            standing_still_rms(part, WINDOW)
        );
    }
    print!("{}", text(&best));
}
