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
const LOOP: f64 = 2_310.0;
/// The same with a second model per arm, for the orientation.
const BOTH: f64 = 3_616.0;
/// The 600-500-400 network in every format that AVX2 has, the widest set that valgrind knows; `i12` is stored as `i16` there.
const NETWORK: [(&str, f64); 5] = [
    ("network-f32", 143_840.0),
    ("network-f16", 217_240.0),
    ("network-bf16", 289_520.0),
    ("network-i16", 144_690.0),
    ("network-i8", 144_770.0),
];
const TOLERANCE: f64 = 0.02;
/// Cycles that are counted, after some that are not.
const COUNTED: usize = 200;
const BEFORE: usize = 20;

/// What valgrind looks for: it counts in here only.
#[inline(never)]
fn counted_cycles(cycles: std::ops::Range<usize>, cycle: &mut dyn FnMut(usize)) {
    cycles.for_each(cycle);
}

fn cycles(mut cycle: impl FnMut(usize)) {
    (0..BEFORE).for_each(&mut cycle);
    counted_cycles(BEFORE..BEFORE + COUNTED, &mut cycle);
}

fn part(name: &str) {
    if let Some(format) = name.strip_prefix("network-") {
        let format: Format = format.parse().expect("a format");
        // Reading a model from its file would take valgrind a minute.
        let weight = |place: usize, _| ((place * 7919) % 2003) as f32 * 1e-4 - 0.1;
        let network = Network::dense(&[118, 600, 500, 400, 3], Activation::Sigmoid, weight);
        let mut plan = Plan::with(&network, InstructionSet::Avx2, format);
        let mut output = [0.0_f32; 3];
        cycles(|run| plan.run(&[run as f32; 118], &mut output));
        std::hint::black_box(output);
    } else {
        let states: Vec<RavenState> =
            (1..=(BEFORE + COUNTED) as u64).map(|step| world::state(7, step, step, step as i64 * MS)).collect();
        let mut cycle = match name {
            "loop" => Cycle::new(Limits::default(), [world::model(), world::model()], false, 0),
            _ => world::cycle(Limits::default()),
        };
        let mut pose = CorrectedPose::new();
        cycles(|run| {
            let now = states[run].source_time_ns;
            cycle.offer(&states[run], now);
            assert!(cycle.step(now, &mut (), &mut pose));
            cycle.finish(now + 40_000, false, &mut pose);
        });
        std::hint::black_box(&pose);
    }
}

/// Instructions per cycle of a part, which this test plays as a process of its own.
fn count(name: &str) -> Option<f64> {
    let this = std::env::current_exe().expect("this program");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=*counted_cycles*"])
        .arg(this)
        .args(["--exact", "a_cycle_takes_the_instructions_that_it_took", "--test-threads=1"])
        .env("RAVENPOSE_COUNT_PART", name)
        .output()
        .ok()?;
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words}");
    let collected: f64 = words.lines().find_map(|line| line.split("Collected :").nth(1)?.trim().parse().ok())?;
    Some(collected / COUNTED as f64)
}

#[test]
fn a_cycle_takes_the_instructions_that_it_took() {
    if let Ok(wanted) = std::env::var("RAVENPOSE_COUNT_PART") {
        return part(&wanted);
    }
    let version = Command::new("rustc").arg("--version").output().map(|output| output.stdout).unwrap_or_default();
    if !String::from_utf8_lossy(&version).starts_with(COMPILER) {
        return println!("skipped: instructions were counted with {COMPILER}");
    }
    if InstructionSet::Avx2.available() != InstructionSet::Avx2 {
        return println!("skipped: instructions were counted with AVX2");
    }
    let parts: Vec<(&str, f64)> = [("loop", LOOP), ("both", BOTH)].into_iter().chain(NETWORK).collect();
    // Counts do not depend on what else runs.
    let counts: Vec<Option<f64>> = std::thread::scope(|scope| {
        let begun: Vec<_> = parts.iter().map(|(name, _)| scope.spawn(|| count(name))).collect();
        begun.into_iter().map(|counted| counted.join().expect("counted")).collect()
    });
    let mut off = Vec::new();
    for ((name, expected), found) in parts.into_iter().zip(counts) {
        let Some(found) = found else { return println!("skipped: valgrind is absent") };
        println!("{name}: {found:.0} instructions per cycle, {expected} noted");
        if (found / expected - 1.0).abs() > TOLERANCE {
            off.push(name);
        }
    }
    assert!(off.is_empty(), "more or less than noted, see above: {off:?}");
}
