//! Instructions per cycle, counted by valgrind: the same on every machine and at any load, where times are not.
//!
//! A change of more than 2 % fails, in either direction: note the new number here, with the reason in the commit.

#[path = "faults/world.rs"]
#[expect(dead_code, reason = "shared with the tests of faults, which use all of it")]
mod world;

use ravenpose::cycle::{Cycle, Limits};
use ravenpose::network::{Format, InstructionSet, Plan};
use ravenpose_importer::{Activation, Network};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::process::Command;
use world::MS;

/// The compiler whose code was counted.
const COMPILER: &str = "rustc 1.95.0";
/// Taking a state of both arms, features, guards, correction and pose; all but the network.
const LOOP: f64 = 4_783.0;
/// The same with a second model per arm, for the orientation.
const BOTH: f64 = 8_655.0;
/// The 600-500-400 network in every format that AVX2 has, the widest set that valgrind knows; `i12` is stored as `i16` there.
const NETWORK: [(&str, f64); 5] = [
    ("network-f32", 143_840.0),
    ("network-f16", 217_240.0),
    ("network-bf16", 289_520.0),
    ("network-i16", 144_690.0),
    ("network-i8", 144_770.0),
];
const TOLERANCE: f64 = 0.02;
/// Cycles of the shorter and of the longer run; the rest of both is the same.
const RUNS: [usize; 2] = [20, 220];

fn part(name: &str, runs: usize) {
    if let Some(format) = name.strip_prefix("network-") {
        let format: Format = format.parse().expect("a format");
        // Reading a model from its file would take valgrind a minute.
        let weight = |place: usize, _| ((place * 7919) % 2003) as f32 * 1e-4 - 0.1;
        let network = Network::dense(&[118, 600, 500, 400, 3], Activation::Sigmoid, weight);
        let mut plan = Plan::with(&network, InstructionSet::Avx2, format);
        let mut output = [0.0_f32; 3];
        for run in 0..runs {
            plan.run(&[run as f32; 118], &mut output);
        }
        std::hint::black_box(output);
    } else {
        let states: Vec<RavenState> = (1..=RUNS[1] as u64).map(|step| world::state(7, step, step, step as i64 * MS)).collect();
        let mut cycle = match name {
            "loop" => Cycle::new(Limits::default(), [world::model(), world::model()], false, 0),
            _ => world::cycle(Limits::default()),
        };
        let mut pose = CorrectedPose::new();
        for state in &states[..runs] {
            let now = state.source_time_ns;
            cycle.offer(state, now);
            assert!(cycle.step(now, &mut (), &mut pose));
            cycle.finish(now + 40_000, false, &mut pose);
        }
        std::hint::black_box(&pose);
    }
}

/// Instructions of this test as a process of its own with a part to play.
fn count(name: &str, runs: usize) -> Option<f64> {
    let this = std::env::current_exe().expect("this program");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(this)
        .args(["--exact", "a_cycle_takes_the_instructions_that_it_took", "--test-threads=1"])
        .env("RAVENPOSE_COUNT_PART", format!("{name} {runs}"))
        .output()
        .ok()?;
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words}");
    words.lines().find_map(|line| line.split("Collected :").nth(1)?.trim().parse().ok())
}

#[test]
fn a_cycle_takes_the_instructions_that_it_took() {
    if let Ok(wanted) = std::env::var("RAVENPOSE_COUNT_PART") {
        let (name, runs) = wanted.split_once(' ').expect("a part and a number");
        return part(name, runs.parse().expect("a number"));
    }
    let version = Command::new("rustc").arg("--version").output().map(|output| output.stdout).unwrap_or_default();
    if !String::from_utf8_lossy(&version).starts_with(COMPILER) {
        return println!("skipped: instructions were counted with {COMPILER}");
    }
    if InstructionSet::Avx2.available() != InstructionSet::Avx2 {
        return println!("skipped: instructions were counted with AVX2");
    }
    for (name, expected) in [("loop", LOOP), ("both", BOTH)].into_iter().chain(NETWORK) {
        // Counts do not depend on what else runs.
        let (many, few) = std::thread::scope(|scope| {
            let few = scope.spawn(|| count(name, RUNS[0]));
            (count(name, RUNS[1]), few.join().expect("counted"))
        });
        let (Some(many), Some(few)) = (many, few) else {
            return println!("skipped: valgrind is absent");
        };
        let found = (many - few) / (RUNS[1] - RUNS[0]) as f64;
        println!("{name}: {found:.0} instructions per cycle, {expected} noted");
        assert!((found / expected - 1.0).abs() <= TOLERANCE, "{name}: {found:.0} instructions per cycle, {expected} noted");
    }
}
