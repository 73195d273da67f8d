//! Random mixes of all faults through the pure cycle, a million cycles from printed seeds, with the invariants after each.
//!
//! The generator knows the truth of every state it made; the checks use that and the published messages only.

#![expect(clippy::large_types_passed_by_value, reason = "messages are handed on as the link does")]

use crate::common::Rng;
use crate::world::{BOUND_DEG, BOUND_UM, Fake, MS, OUT_HUGE, OUT_INFINITE, OUT_NAN, TURN_HUGE, TURN_NAN, cycle, state};
use ravenpose::cycle::{Counters, Cycle, Limits};
use ravenpose_wire::{ArmStatus, CorrectedPose, FALLBACK_REASONS, RavenState, flag};
use std::collections::HashMap;

const VALID: u32 = ArmStatus::Valid as u32;
/// What the reader's queue holds.
const QUEUE: usize = ravenpose_transport::DEPTH_MAX;

/// Cycles in all; `RAVENPOSE_FAULT_CYCLES` asks for more.
pub(crate) fn cycles() -> u64 {
    std::env::var("RAVENPOSE_FAULT_CYCLES").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000_000)
}

/// Source, sequence and time: a restarted source uses its numbers again.
type Key = (u64, u64, i64);

#[derive(Clone, Copy)]
struct Truth {
    pos: [i32; 6],
    time_ns: i64,
    /// Per arm: may this state be corrected at all?
    good: [bool; 2],
    /// Which freeze of the encoders, counted from 1, and for how many states; 0 where they move.
    freeze: u64,
    held: u64,
}

struct World {
    rng: Rng,
    now: i64,
    step: u64,
    source: u64,
    sequence: u64,
    pending: Vec<RavenState>,
    held_back: Vec<RavenState>,
    truth: HashMap<Key, Truth>,
    /// Remaining cycles of each standing fault.
    silent: u64,
    frozen: u64,
    held: u64,
    freezes: u64,
    frozen_at: [i32; 16],
    slow: u64,
    offered: u64,
    dropped_by_queue: u64,
}

impl World {
    fn new(seed: u64) -> Self {
        Self {
            rng: Rng(seed),
            now: 5_000 * MS,
            step: 0,
            source: 1,
            sequence: 0,
            pending: Vec::new(),
            held_back: Vec::new(),
            truth: HashMap::new(),
            silent: 0,
            frozen: 0,
            held: 0,
            freezes: 0,
            frozen_at: [0; 16],
            slow: 0,
            offered: 0,
            dropped_by_queue: 0,
        }
    }

    /// Whole episodes without faults alternate with stormy ones, so that the service also gets to be valid.
    fn stormy(&self) -> bool {
        (self.step / 700) % 2 == 1
    }

    /// One millisecond of the control process and of the link.
    fn advance(&mut self) {
        self.now += MS;
        self.step += 1;
        if self.stormy() {
            self.begin_faults();
        }
        if self.silent > 0 {
            self.silent -= 1;
            return;
        }
        self.sequence += 1;
        let mut message = state(self.source, self.sequence, self.step, self.now);
        let mut good = [true; 2];
        if self.frozen > 0 {
            self.frozen -= 1;
            message.enc_vals = self.frozen_at;
            self.held += 1;
        } else {
            self.held = 0;
        }
        message.hdr_stamp_sec = self.rng.next() as u32;
        if self.stormy() && self.rng.chance(40) {
            self.spoil(&mut message, &mut good);
        }
        message.seal(self.sequence);
        self.truth.insert(
            (self.source, self.sequence, self.now),
            Truth {
                pos: message.pos,
                time_ns: self.now,
                good,
                freeze: if self.held > 0 { self.freezes } else { 0 },
                held: self.held,
            },
        );
        self.send(message);
    }

    fn begin_faults(&mut self) {
        if self.rng.chance(300) {
            self.silent = 1 + self.rng.below(40);
        }
        if self.rng.chance(500) && self.frozen == 0 && self.held == 0 {
            self.frozen = 40;
            self.freezes += 1;
            self.frozen_at = state(1, 1, self.step, 0).enc_vals;
        }
        if self.rng.chance(300) {
            self.slow = 1 + self.rng.below(15);
        }
        if self.rng.chance(800) {
            match self.rng.below(3) {
                0 => {
                    self.source += 1;
                    self.sequence = self.rng.below(3);
                }
                1 => self.sequence = 0,
                _ => self.sequence += 1 << 31,
            }
            self.held_back.clear();
        }
    }

    fn spoil(&mut self, message: &mut RavenState, good: &mut [bool; 2]) {
        let arm = self.rng.below(2) as usize;
        let slot = arm * 8 + self.rng.below(8) as usize;
        let value = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30][self.rng.below(5) as usize];
        good[arm] = false;
        match self.rng.below(8) {
            0 => message.tau[slot] = value,
            1 => message.mvel[slot] = value,
            2 => message.jpos[slot] = value,
            3 => message.jac_f[arm * 6 + self.rng.below(6) as usize] = value,
            4 => message.ori[arm * 9 + self.rng.below(9) as usize] = value,
            5 => message.dac_val[arm * 8] = [OUT_NAN, TURN_NAN][self.rng.below(2) as usize],
            6 => message.dac_val[arm * 8] = [OUT_INFINITE, OUT_HUGE, TURN_HUGE][self.rng.below(3) as usize],
            _ => message.pos[arm * 3] = 600_000,
        }
    }

    /// The link: loses, doubles, holds back, tears.
    fn send(&mut self, message: RavenState) {
        if !self.stormy() {
            self.enqueue(message);
            return;
        }
        match self.rng.below(60) {
            0 => {}
            1 => {
                for _ in 0..=self.rng.below(4) {
                    self.enqueue(message);
                }
            }
            2..=4 => self.held_back.push(message),
            5 => {
                let mut torn = message;
                torn.guard_tail = torn.guard_tail.wrapping_sub(1);
                self.enqueue(torn);
            }
            6 => {
                let mut other = message;
                other.version = self.rng.next() as u32 | 2;
                self.enqueue(other);
            }
            7 => {
                let mut early = message;
                early.source_time_ns = [early.source_time_ns + 10_000 * MS, i64::MAX, i64::MIN, -1][self.rng.below(4) as usize];
                self.enqueue(early);
            }
            8 => {
                self.enqueue(message);
                for held in std::mem::take(&mut self.held_back) {
                    self.enqueue(held);
                }
            }
            _ => self.enqueue(message),
        }
    }

    fn enqueue(&mut self, message: RavenState) {
        if self.pending.len() == QUEUE {
            self.pending.remove(0);
            self.dropped_by_queue += 1;
        }
        self.pending.push(message);
    }
}

/// The invariants, from the published messages and the truth alone.
struct Checker {
    last: Option<CorrectedPose>,
    sequence: u64,
    newest: HashMap<u64, (u64, i64)>,
    good_in_row: [u64; 2],
    /// Of each arm, position and orientation.
    recovering: [[bool; 2]; 2],
    /// `held` of the first state of a freeze that got through.
    first_held: Option<(u64, u64)>,
    valid: u64,
    fallbacks: u64,
    reasons: u32,
    dropped_by_queue: u64,
}

impl Checker {
    fn check(&mut self, pose: &CorrectedPose, truth: &HashMap<Key, Truth>, now: i64, limits: &Limits) {
        assert!(pose.admit().is_ok());
        assert_eq!(pose.sequence, self.sequence.wrapping_add(1), "sequence rises by one");
        self.sequence = pose.sequence;
        let known = truth
            .get(&(pose.source_id, pose.source_sequence, pose.source_time_ns))
            .expect("source, sequence and time are those of a state that was made");
        assert!(pose.source_time_ns <= pose.start_time_ns && pose.start_time_ns <= pose.publish_time_ns);
        let repeats = self.last.is_some_and(|last| {
            (last.source_id, last.source_sequence, last.source_time_ns)
                == (pose.source_id, pose.source_sequence, pose.source_time_ns)
        });
        if let Some((sequence, time)) = self.newest.get(&pose.source_id) {
            // Within one life of a source numbers never fall; a restarted one has later times.
            assert!(pose.source_sequence >= *sequence || pose.source_time_ns > *time, "source sequence fell");
        }
        self.newest.insert(pose.source_id, (pose.source_sequence, pose.source_time_ns));
        // Every motor moved fast before: 20 cycles after the first held state that got through nothing may be corrected.
        let same = self.first_held.filter(|(freeze, _)| *freeze == known.freeze);
        self.first_held = (known.freeze > 0).then(|| same.unwrap_or((known.freeze, known.held)));
        let mut known = *known;
        if self.first_held.is_some_and(|(_, first)| known.held - first >= 20) {
            known.good = [false; 2];
        }
        let known = &known;
        for index in 0..2 {
            self.check_arm(index, pose, known, repeats, now, limits);
        }
        self.last = Some(*pose);
    }

    fn check_arm(&mut self, index: usize, pose: &CorrectedPose, known: &Truth, repeats: bool, now: i64, limits: &Limits) {
        let arm = &pose.arm[index];
        let before = self.last.map(|last| last.arm[index]);
        for axis in 0..3 {
            assert_eq!(arm.raw_position_um[axis], f64::from(known.pos[index * 3 + axis]), "raw is raw");
            assert!(arm.correction_um[axis].is_finite() && arm.corrected_position_um[axis].is_finite());
            assert_eq!(arm.corrected_position_um[axis], arm.raw_position_um[axis] + arm.correction_um[axis]);
        }
        let correction = norm(arm.correction_um);
        assert!(correction <= BOUND_UM);
        let turned = norm(arm.rotation_deg);
        assert!(turned <= BOUND_DEG);
        self.reasons |= arm.flags & FALLBACK_REASONS;
        if arm.status == VALID {
            self.valid += 1;
            assert_eq!(arm.flags & FALLBACK_REASONS, 0);
            assert!(arm.corrected_orientation.iter().all(|x| x.is_finite()));
            assert!(!repeats, "a repeated state is never valid");
            assert!(known.good[index], "a bad state is never corrected");
            let age = pose.publish_time_ns.max(now) - pose.source_time_ns;
            assert!(age < limits.stale_ns, "a state that is stale when the answer goes out is never corrected: {age}");
            assert!(self.good_in_row[index] >= u64::from(limits.good_cycles), "only after enough good cycles");
        } else {
            self.fallbacks += 1;
            assert_eq!((arm.correction_um, arm.rotation_deg), ([0.0; 3], [0.0; 3]));
            assert_eq!(arm.corrected_orientation.map(f32::to_bits), arm.orientation.map(f32::to_bits), "NaN and all");
            assert!(arm.flags & FALLBACK_REASONS != 0, "never silence: a reason is given");
            if arm.flags & FALLBACK_REASONS & !(flag::SETTLING | flag::NEW_SOURCE) != 0
                || (arm.flags & flag::NEW_SOURCE != 0 && arm.flags & flag::SETTLING == 0)
            {
                self.good_in_row[index] = 0;
            }
        }
        if arm.flags & FALLBACK_REASONS & !(flag::SETTLING | flag::NEW_SOURCE) == 0 {
            self.good_in_row[index] += 1;
        }
        if !known.good[index] && !repeats {
            assert_ne!(arm.status, VALID);
        }
        if let Some(before) = before {
            let step = |a: [f64; 3], b: [f64; 3]| norm(std::array::from_fn(|axis| a[axis] - b[axis]));
            let announced = arm.reset_count != before.reset_count;
            assert!(
                !announced || (arm.flags & flag::RESET != 0 && correction == 0.0 && turned == 0.0),
                "the drop is announced where it happens"
            );
            assert!(!announced || before.status == VALID, "a step is from what was valid");
            if !announced {
                for (quantity, (step, pace)) in [
                    (step(arm.correction_um, before.correction_um), limits.position),
                    (step(arm.rotation_deg, before.rotation_deg), limits.orientation),
                ]
                .into_iter()
                .enumerate()
                {
                    // On its way back until a step falls short of what is allowed: then it has arrived.
                    let recovering = &mut self.recovering[index][quantity];
                    *recovering |= arm.status == VALID && before.status != VALID;
                    let slew = if *recovering { pace.recover } else { pace.rate };
                    assert!(step <= slew * (1.0 + 1e-9), "step {step} of quantity {quantity} of arm {index}");
                    *recovering &= step >= slew * (1.0 - 1e-6);
                    assert!(!*recovering || arm.flags & flag::RECOVERING != 0, "on its way back, and does not say so");
                }
            }
        }
    }
}

fn norm(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}

fn sum(counters: &Counters) -> u64 {
    counters.accepted.wrapping_add(counters.duplicates).wrapping_add(counters.out_of_order).wrapping_add(counters.refused)
}

fn run(seed: u64, count: u64) -> Checker {
    let mut world = World::new(seed);
    let limits = Limits::default();
    let mut cycle: Cycle<Fake> = cycle(limits);
    if seed.is_multiple_of(3) {
        // Counters that wrap during the run.
        let near = u64::MAX - 500;
        cycle.preset_counters(Counters { published: near, cycles: near, lost: near, ..Counters::default() });
    }
    let start = *cycle.counters();
    let mut checker = Checker {
        last: None,
        sequence: start.published,
        newest: HashMap::new(),
        good_in_row: [0; 2],
        recovering: [[false; 2]; 2],
        first_held: None,
        valid: 0,
        fallbacks: 0,
        reasons: 0,
        dropped_by_queue: 0,
    };
    let mut pose = CorrectedPose::new();
    for _ in 0..count {
        world.advance();
        if world.stormy() && world.rng.chance(2000) {
            // The service is stopped for a while, sometimes for longer than the queue holds, and continued.
            for _ in 0..10 + world.rng.below(600) {
                world.advance();
            }
        }
        let wake = world.now + world.rng.below(200_000) as i64;
        for _ in 0..world.rng.below(3) {
            cycle.keep_warm();
        }
        for message in std::mem::take(&mut world.pending) {
            cycle.offer(&message, wake);
            world.offered += 1;
        }
        if cycle.step(wake, &mut (), &mut pose) {
            let mut took = 30_000 + world.rng.below(30_000) as i64;
            if world.slow > 0 {
                world.slow -= 1;
                took = 500_001 + world.rng.below(400_000) as i64;
                if world.rng.chance(10) {
                    took = world.rng.below(50_000_000) as i64;
                }
            }
            cycle.finish(wake + took, false, &mut pose);
            checker.check(&pose, &world.truth, wake, &limits);
        }
        assert_eq!(sum(cycle.counters()).wrapping_sub(sum(&start)), world.offered, "every message is counted once");
        if world.truth.len() > 20_000 {
            let horizon = world.now - 2_000 * MS;
            world.truth.retain(|_, truth| truth.time_ns > horizon);
        }
    }
    checker.dropped_by_queue = world.dropped_by_queue;
    checker
}

#[test]
fn a_million_cycles_of_mixed_faults_keep_every_invariant() {
    const RUN: u64 = 50_000;
    let first: u64 = std::env::var("RAVENPOSE_FAULT_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let (mut valid, mut fallbacks, mut reasons, mut dropped) = (0, 0, 0, 0);
    for seed in first..first + cycles().div_ceil(RUN) {
        println!("seed {seed} (replay: RAVENPOSE_FAULT_SEED={seed} RAVENPOSE_FAULT_CYCLES={RUN})");
        let checker = run(seed, RUN);
        valid += checker.valid;
        fallbacks += checker.fallbacks;
        reasons |= checker.reasons;
        dropped += checker.dropped_by_queue;
    }
    println!("{valid} valid and {fallbacks} fallback estimates, reasons {reasons:#06x}");
    assert!(valid > cycles() / 4 && fallbacks > cycles() / 4, "both states were exercised");
    assert!(dropped > cycles() / 1000, "{dropped} states did not fit the queue");
    for reason in [
        flag::INPUT_NOT_FINITE,
        flag::INPUT_STALE,
        flag::INPUT_IMPOSSIBLE,
        flag::INPUT_FROZEN,
        flag::OUTPUT_NOT_FINITE,
        flag::OUTPUT_BEYOND_BOUND,
        flag::BUDGET_EXCEEDED,
        flag::SETTLING,
        flag::NEW_SOURCE,
    ] {
        assert!(reasons & reason != 0, "reason {reason:#x} never came up");
    }
}
