//! One test per row of the fault table that concerns the pure cycle; the name begins with the row.

use crate::common::Rng;
use crate::mix::cycles;
use crate::orientation::is_raw;
use crate::world::{BOUND_UM, Bench, MS, OUT_HUGE, OUT_INFINITE, OUT_NAN, model as model_of_world, state};
use ravenpose::correction::ArmModel;
use ravenpose::cycle::{Counters, Cycle, Limits};
use ravenpose::guard::Guard;
use ravenpose_transport::DEPTH_MAX;
use ravenpose_wire::{ArmPose, ArmStatus, CorrectedPose, FEATURES, RavenState, features, flag};

const VALID: u32 = ArmStatus::Valid as u32;
const FALLBACK: u32 = ArmStatus::Fallback as u32;
const STARTING: u32 = ArmStatus::Starting as u32;

fn assert_fallback(pose: &CorrectedPose, reason: u32) {
    for arm in &pose.arm {
        assert_eq!(arm.status, FALLBACK);
        assert_ne!(arm.flags & reason, 0, "flags {:#x}", arm.flags);
        assert_eq!(arm.correction_um, [0.0; 3]);
        assert_eq!(arm.corrected_position_um, arm.raw_position_um);
        assert!(arm.bound95_um.iter().all(|bound| bound.is_nan()));
        assert!(is_raw(arm), "{arm:?}");
    }
}

#[test]
fn starts_raw_and_becomes_valid_after_100_good_cycles() {
    let mut bench = Bench::new();
    for count in 1..=100 {
        let pose = bench.good();
        assert!(pose.arm.iter().all(|arm| arm.status == STARTING && arm.hold_cycles == 100 - count), "{count}");
    }
    let pose = bench.good();
    assert!(pose.arm.iter().all(|arm| arm.status == VALID && arm.flags == flag::RECOVERING));
    assert_eq!(pose.arm[0].reset_count, 0);
}

#[test]
fn f05_messages_stop() {
    let mut bench = Bench::new();
    let last = bench.settle();
    for _ in 0..4 {
        bench.now += MS;
        assert!(bench.run(&[]).is_none(), "held while younger than the limit");
    }
    bench.now += MS;
    let first = bench.run(&[]).expect("flagged at 5 ms");
    assert_fallback(&first, flag::INPUT_STALE);
    assert!(first.arm.iter().all(|arm| arm.flags & flag::RESET != 0 && arm.reset_count == 1));
    for _ in 0..10_000 {
        bench.now += MS;
        let pose = bench.run(&[]).expect("repeated while it lasts");
        assert_fallback(&pose, flag::INPUT_STALE);
        assert_eq!((pose.source_sequence, pose.source_time_ns), (last.source_sequence, last.source_time_ns));
        assert_eq!(pose.arm[0].reset_count, 1, "announced once");
    }
}

#[test]
fn f05_an_old_message_is_not_corrected() {
    let mut bench = Bench::new();
    bench.settle();
    let mut old = bench.next_state();
    bench.now += 20 * MS;
    old.source_time_ns = bench.now - 5 * MS;
    assert_fallback(&bench.run(&[old]).expect("answered"), flag::INPUT_STALE);
}

#[test]
fn f05_a_state_that_becomes_stale_inside_the_cycle_is_not_corrected() {
    let mut bench = Bench::new();
    bench.settle();
    bench.took = 5 * MS;
    let pose = bench.good();
    assert_fallback(&pose, flag::INPUT_STALE);
    assert!(pose.arm.iter().all(|arm| arm.flags & (flag::LATE | flag::RESET) == flag::LATE | flag::RESET));
}

#[test]
fn f05_a_first_answer_that_is_held_up_is_no_step() {
    for (took, reason) in [(5 * MS, flag::INPUT_STALE), (0, flag::STOPPING)] {
        let mut bench = Bench::new();
        for _ in 0..100 {
            bench.good();
        }
        bench.took = took;
        let pose = if reason == flag::STOPPING {
            let state = bench.next_state();
            bench.cycle.offer(&state, bench.now);
            let mut pose = CorrectedPose::new();
            assert!(bench.cycle.stop(bench.now, &mut pose));
            pose
        } else {
            bench.good()
        };
        assert_fallback(&pose, reason);
        // No valid pose was ever seen: nobody has to shift a target.
        assert!(pose.arm.iter().all(|arm| arm.flags & flag::RESET == 0 && arm.reset_count == 0), "{pose:?}");
        bench.took = 0;
        let first = bench.settle();
        assert_eq!(first.arm[0].reset_count, 0);
    }
}

#[test]
fn f17_an_answer_that_comes_when_its_readers_have_given_up_the_last_is_an_announced_step() {
    // The loop is held up while the controller goes on: the states are there, the newest is fresh.
    for (held_ms, outlived) in [(2, false), (4, false), (5, true), (12, true), (60, true)] {
        let mut bench = Bench::new();
        let before = bench.settle();
        assert_eq!(before.arm[0].status, ArmStatus::Valid as u32);
        let states: Vec<RavenState> = (0..held_ms).map(|_| bench.next_state()).collect();
        let pose = bench.run(&states).expect("an answer");
        assert!(bench.now - pose.source_time_ns < 2 * MS, "the newest is fresh");
        if outlived {
            assert_fallback(&pose, flag::INPUT_STALE);
        }
        for (arm, before) in pose.arm.iter().zip(&before.arm) {
            assert_eq!(arm.reset_count, before.reset_count + u32::from(outlived), "{held_ms} ms");
            assert_eq!(arm.flags & flag::RESET != 0, outlived, "{held_ms} ms");
            assert_eq!(arm.status == ArmStatus::Valid as u32, !outlived, "{held_ms} ms");
        }
        // Afterwards slewed, as after any fault.
        let first = bench.settle();
        assert_eq!(first.arm[0].reset_count, before.arm[0].reset_count + u32::from(outlived));
    }
}

#[test]
fn f02_a_restarted_service_is_an_announced_step_with_higher_numbers() {
    let (mut before, mut after) = (Bench::new(), Bench::new());
    before.cycle.begin_at(before.now);
    let old = before.settle();
    after.now = before.now;
    after.cycle.begin_at(after.now);
    let new = after.good();
    assert!(new.sequence > old.sequence);
    assert!((0..2).all(|arm| new.arm[arm].reset_count != old.arm[arm].reset_count));
}

#[test]
fn f06_duplicates_publish_nothing() {
    let mut bench = Bench::new();
    bench.settle();
    for copies in 2..=5 {
        let state = bench.next_state();
        let before = bench.cycle.counters().duplicates;
        assert!(bench.run(&[state]).is_some());
        for _ in 1..copies {
            bench.now += MS / 4;
            assert!(bench.run(&[state]).is_none());
        }
        assert_eq!(bench.cycle.counters().duplicates - before, copies - 1);
        let pose = bench.good();
        assert!(pose.arm.iter().all(|arm| arm.status == VALID && arm.flags & flag::SAW_DUPLICATE != 0));
    }
}

#[test]
fn f06_the_stale_clock_runs_on_under_duplicates() {
    let mut bench = Bench::new();
    bench.settle();
    let state = bench.next_state();
    bench.run(&[state]);
    for _ in 0..4 {
        bench.now += MS;
        assert!(bench.run(&[state]).is_none());
    }
    bench.now += MS;
    assert_fallback(&bench.run(&[state]).expect("stale all the same"), flag::INPUT_STALE);
}

#[test]
fn f07_reordered_messages_never_go_back() {
    let mut rng = Rng(77);
    for window in 2..=50_usize {
        let mut bench = Bench::new();
        bench.settle();
        let mut states: Vec<RavenState> = (0..window).map(|_| bench.next_state()).collect();
        for at in (1..window).rev() {
            states.swap(at, rng.below(at as u64 + 1) as usize);
        }
        let mut newest = 0;
        let before = *bench.cycle.counters();
        for state in &states {
            let fresh = state.sequence > newest;
            newest = newest.max(state.sequence);
            let answered = bench.run(&[*state]);
            assert!(answered.is_some() || !fresh, "window {window}");
            // An older one is never answered; at most the newest is repeated as stale.
            assert!(
                answered.is_none_or(|pose| pose.source_sequence == newest && (fresh || pose.arm[0].flags & flag::INPUT_STALE != 0))
            );
        }
        let after = bench.cycle.counters();
        assert_eq!(after.out_of_order - before.out_of_order + after.accepted - before.accepted, window as u64);
    }
}

#[test]
fn f08_every_gap_is_counted_exactly() {
    for percent in [1, 5, 10, 25, 50] {
        let mut rng = Rng(1000 + percent);
        let mut bench = Bench::new();
        bench.settle();
        let (mut lost, mut pending) = (0, 0);
        for _ in 0..20_000 {
            let state = bench.next_state();
            if rng.below(100) < percent {
                pending += 1;
                // While nothing comes the cycle runs all the same.
                bench.run(&[]);
            } else {
                lost += std::mem::take(&mut pending);
                assert_eq!(bench.run(&[state]).expect("answered").lost, lost);
            }
        }
        assert!(lost > 100, "the test dropped something");
    }
}

#[test]
fn f08_a_single_loss_does_not_end_the_correction() {
    let mut bench = Bench::new();
    bench.settle();
    bench.next_state();
    assert!(bench.good().arm.iter().all(|arm| arm.status == VALID));
}

#[test]
fn f09_a_million_corruptions_none_accepted_with_a_wrong_guard() {
    let mut rng = Rng(9);
    let mut bench = Bench::new();
    bench.settle();
    let good = bench.next_state();
    let size = size_of::<RavenState>();
    let mut wrong = 0_u64;
    let before = *bench.cycle.counters();
    for _ in 0..1_000_000 {
        let mut bytes: [u8; 1032] = bytes_of(&good);
        assert_eq!(bytes.len(), size);
        for _ in 0..=rng.below(4) {
            bytes[rng.below(size as u64) as usize] = rng.next() as u8;
        }
        let torn = of_bytes(&bytes);
        let whole =
            torn.version == 1 && torn.size as usize == size && torn.guard_head == torn.sequence && torn.guard_tail == torn.sequence;
        if whole {
            // What lies between good guards is judged by the other rows.
            continue;
        }
        wrong += 1;
        bench.cycle.offer(&torn, bench.now);
    }
    let after = bench.cycle.counters();
    assert!(wrong > 10_000);
    assert_eq!(after.refused - before.refused, wrong);
    assert_eq!(after.accepted, before.accepted);
}

fn bytes_of(state: &RavenState) -> [u8; 1032] {
    // SAFETY: RavenState is repr(C) of 1032 bytes without padding (`bridge/tests/layout.rs`).
    unsafe { std::mem::transmute(*state) }
}

fn of_bytes(bytes: &[u8; 1032]) -> RavenState {
    // SAFETY: as above; any bits are valid in its integers and floats.
    unsafe { std::mem::transmute(*bytes) }
}

/// Puts `value` into the float field behind a feature; `false` where the field is an integer.
fn set_feature(state: &mut RavenState, arm: usize, feature: usize, value: f32) -> bool {
    let RavenState { ori, ori_d, tau, mpos, jpos, mvel, jvel, mpos_d, jpos_d, grasp_d, encoffsets, jac_vel, jac_f, .. } = state;
    let fields: [(&mut [f32], usize, usize); 13] = [
        (ori, 6, 9),
        (ori_d, 15, 9),
        (tau, 40, 8),
        (mpos, 48, 8),
        (jpos, 56, 8),
        (mvel, 64, 8),
        (jvel, 72, 8),
        (mpos_d, 80, 8),
        (jpos_d, 88, 8),
        (grasp_d, 96, 1),
        (encoffsets, 97, 8),
        (jac_vel, 105, 6),
        (jac_f, 111, 6),
    ];
    for (field, start, count) in fields {
        if (start..start + count).contains(&feature) {
            field[arm * count + feature - start] = value;
            return true;
        }
    }
    false
}

#[test]
fn f10_f11_nothing_unfit_reaches_the_network_from_any_position() {
    let payloads = [
        f32::NAN,
        -f32::NAN,
        f32::from_bits(0x7f80_0001),
        f32::from_bits(0xffff_ffff),
        f32::INFINITY,
        f32::NEG_INFINITY,
        1e30,
        -1e30,
    ];
    let mut floats = 0;
    for feature in 0..FEATURES {
        for payload in payloads {
            for arm in 0..2 {
                let mut bench = Bench::new();
                bench.settle();
                let mut bad = bench.next_state();
                if !set_feature(&mut bad, arm, feature, payload) {
                    continue;
                }
                floats += 1;
                let pose = bench.run(&[bad]).expect("answered with the raw pose");
                assert_eq!(pose.arm[arm].status, FALLBACK, "feature {feature} {payload}");
                let reason = if payload.is_finite() { flag::INPUT_IMPOSSIBLE } else { flag::INPUT_NOT_FINITE };
                assert_eq!(pose.arm[arm].flags & reason, reason);
                assert_eq!(pose.arm[arm].correction_um, [0.0; 3]);
                // The other arm does not suffer.
                assert_eq!(pose.arm[1 - arm].status, VALID);
            }
        }
    }
    // All but pos, pos_d, encVals, dac_val (integers) and dt (made of integers).
    assert_eq!(floats, (118 - 3 - 3 - 8 - 8 - 1) * payloads.len() * 2);
}

#[test]
fn f10_the_guard_itself_catches_all_118_positions() {
    let guard = Guard::new(None);
    let mut good = [0.0_f32; FEATURES];
    features::extract(&state(1, 1, 1, 1), 0, &mut good);
    assert_eq!(guard.check(&good).reasons, 0);
    for position in 0..FEATURES {
        for payload in [f32::NAN, -f32::NAN, f32::from_bits(0x7fa0_0000), f32::INFINITY, f32::NEG_INFINITY] {
            let mut bad = good;
            bad[position] = payload;
            assert_eq!(guard.check(&bad).reasons, flag::INPUT_NOT_FINITE, "{position}");
        }
        for payload in [1e30, -1e30] {
            let mut bad = good;
            bad[position] = payload;
            assert_eq!(guard.check(&bad).reasons, flag::INPUT_IMPOSSIBLE, "{position}");
        }
    }
}

#[test]
fn f13_the_limits_are_exact_for_each_feature() {
    let guard = Guard::new(None);
    let mut good = [0.0_f32; FEATURES];
    features::extract(&state(1, 1, 1, 1), 0, &mut good);
    for feature in 0..FEATURES {
        let (min, max) = guard.possible(feature);
        assert!(min < max, "{feature}");
        for (value, admitted) in [
            (min, true),
            (max, true),
            (min.next_up(), true),
            (max.next_down(), true),
            (min.next_down(), false),
            (max.next_up(), false),
        ] {
            let mut tried = good;
            tried[feature] = value;
            if admitted && (6..15).contains(&feature) {
                // Whether it is a rotation is asked of all nine.
                continue;
            }
            let expected = if admitted { 0 } else { flag::INPUT_IMPOSSIBLE };
            assert_eq!(guard.check(&tried).reasons, expected, "{} = {value}", features::name(feature));
        }
    }
}

#[test]
fn f15_frozen_encoders_end_the_correction_within_20_ms() {
    let mut bench = Bench::new();
    let held = bench.settle();
    assert_eq!(held.arm[0].status, VALID);
    let frozen = bench.cycle.newest().expect("settled").enc_vals;
    let mut seen_degraded = false;
    for cycle in 1..=20 {
        let mut state = bench.next_state();
        state.enc_vals = frozen;
        let pose = bench.run(&[state]).expect("answered");
        seen_degraded |= pose.arm[0].status == VALID && pose.arm[0].flags & flag::DEGRADED != 0;
        if pose.arm[0].status == FALLBACK {
            assert!(seen_degraded, "degraded first");
            assert_fallback(&pose, flag::INPUT_FROZEN);
            return;
        }
        assert!(cycle < 20, "not found in 20 ms");
    }
}

#[test]
fn f15_and_f08_frozen_encoders_are_found_although_states_are_lost() {
    let mut bench = Bench::new();
    bench.settle();
    let frozen = bench.cycle.newest().expect("settled").enc_vals;
    for cycle in 1..=40 {
        let mut state = bench.next_state();
        if cycle % 3 == 0 {
            continue;
        }
        state.enc_vals = frozen;
        if bench.run(&[state]).expect("answered").arm[0].status == FALLBACK {
            assert!(cycle <= 30, "{cycle}");
            return;
        }
    }
    panic!("never found");
}

#[test]
fn f17_the_return_is_slewed_and_the_drop_announced() {
    let mut bench = Bench::new();
    let before = bench.settle();
    let mut bad = bench.next_state();
    bad.tau[0] = f32::NAN;
    bad.tau[8] = f32::NAN;
    let dropped = bench.run(&[bad]).expect("answered");
    assert_fallback(&dropped, flag::INPUT_NOT_FINITE);
    assert!(dropped.arm.iter().zip(&before.arm).all(|(now, then)| now.reset_count == then.reset_count + 1));
    for _ in 0..100 {
        let pose = bench.good();
        assert!(
            pose.arm.iter().all(|arm| arm.status == FALLBACK && arm.flags & flag::SETTLING != 0 && arm.correction_um == [0.0; 3])
        );
    }
    let mut last = [0.0; 3];
    let mut complete = false;
    for _ in 0..1000 {
        let arm = bench.good().arm[0];
        assert_eq!(arm.status, VALID);
        assert_eq!(arm.reset_count, dropped.arm[0].reset_count);
        let step: f64 = arm.correction_um.iter().zip(last).map(|(now, then)| (now - then) * (now - then)).sum::<f64>().sqrt();
        last = arm.correction_um;
        if arm.flags & flag::RECOVERING == 0 {
            complete = true;
            break;
        }
        assert!(step <= 10.0 + 1e-9, "{step}");
        assert!(
            arm.bound95_um[0] >= 300.0 && arm.bound95_um.iter().any(|bound| *bound > 300.0),
            "bound widened by what is missing"
        );
    }
    assert!(complete);
}

#[test]
fn f18_other_layouts_are_refused() {
    let mut bench = Bench::new();
    bench.settle();
    let before = *bench.cycle.counters();
    for (version, size) in [(0, 1032), (2, 1032), (1, 1024), (1, 1040), (u32::MAX, 0)] {
        let mut other = bench.next_state();
        other.version = version;
        other.size = size;
        bench.cycle.offer(&other, bench.now);
    }
    assert_eq!(bench.cycle.counters().refused - before.refused, 5);
    assert_eq!(bench.cycle.counters().accepted, before.accepted);
}

#[test]
fn f18_random_bytes_are_refused_and_behind_a_right_head_never_corrected() {
    let mut rng = Rng(18);
    let mut bench = Bench::new();
    bench.settle();
    let mut random = || -> RavenState {
        let mut bytes = [0; 1032];
        for eight in bytes.chunks_exact_mut(8) {
            eight.copy_from_slice(&rng.next().to_le_bytes());
        }
        of_bytes(&bytes)
    };
    let before = *bench.cycle.counters();
    let count = (cycles() / 10).max(100);
    for turn in 0..count {
        let mut message = random();
        if turn % 2 == 0 {
            // As far as the guard words.
            (message.version, message.size) = (1, 1032);
        }
        bench.cycle.offer(&message, bench.now);
    }
    assert_eq!(bench.cycle.counters().refused - before.refused, count);
    assert_eq!(bench.cycle.counters().accepted, before.accepted);
    let mut connected = 0;
    for _ in 0..count {
        let good = bench.next_state();
        let head = RavenState { version: good.version, size: good.size, source_id: good.source_id, ..random() };
        let mut message = RavenState { source_time_ns: good.source_time_ns, ..head };
        message.seal(good.sequence);
        let pose = bench.run(&[message]).expect("answered");
        assert_eq!((pose.source_sequence, pose.source_time_ns), (good.sequence, good.source_time_ns));
        for arm in &pose.arm {
            connected += u64::from(arm.status == FALLBACK);
            assert!(arm.status != VALID && arm.correction_um == [0.0; 3] && is_raw(arm), "{arm:?}");
            assert_eq!(arm.corrected_position_um, arm.raw_position_um);
        }
    }
    assert!(connected > count / 10, "{connected}");
    assert!((0..=100).any(|_| bench.good().arm.iter().all(|arm| arm.status == VALID)), "it recovers");
}

#[test]
fn f19_a_restarted_source_is_new_whatever_its_numbers_do() {
    for (source, jump) in [(8, 1), (7, 1), (7, 1 << 31), (7, u64::MAX / 2)] {
        let mut bench = Bench::new();
        bench.settle();
        let offset = if jump == 1 { 0 } else { jump };
        for count in 0..250 {
            bench.now += MS;
            bench.step += 1;
            let sequence = if offset == 0 { 1 + count } else { bench.step + offset };
            let message = state(source, sequence, bench.step, bench.now);
            let pose = bench.run(&[message]).expect("answered");
            assert_eq!((pose.source_id, pose.source_sequence), (source, sequence));
            if count == 0 {
                assert_fallback(&pose, flag::NEW_SOURCE);
            } else if count <= 100 {
                assert!(pose.arm.iter().all(|arm| arm.status == FALLBACK && arm.flags & flag::NEW_SOURCE != 0), "{count}");
            } else {
                assert!(pose.arm.iter().all(|arm| arm.status == VALID), "{count}: {:#x}", pose.arm[0].flags);
            }
        }
        assert_eq!(bench.cycle.counters().sources, 1);
        assert_eq!(bench.cycle.counters().lost, 0, "a restart is not a loss");
    }
}

#[test]
fn f24_outputs_beyond_the_bound_or_not_finite_are_never_published() {
    for (fault, reason) in
        [(OUT_NAN, flag::OUTPUT_NOT_FINITE), (OUT_INFINITE, flag::OUTPUT_NOT_FINITE), (OUT_HUGE, flag::OUTPUT_BEYOND_BOUND)]
    {
        let mut bench = Bench::new();
        bench.settle();
        let mut state = bench.next_state();
        state.dac_val[0] = fault;
        state.dac_val[8] = fault;
        let pose = bench.run(&[state]).expect("answered");
        assert_fallback(&pose, reason);
        assert!(pose.arm.iter().all(|arm| arm.correction_um.iter().map(|c| c * c).sum::<f64>().sqrt() <= BOUND_UM));
    }
}

#[test]
fn f25_the_wall_clock_has_no_effect_and_a_stop_is_stale_then_recovers() {
    let (mut plain, mut jumping) = (Bench::new(), Bench::new());
    for step in 0..500_u32 {
        let expected = plain.good();
        let mut state = jumping.next_state();
        state.hdr_stamp_sec = step.wrapping_mul(3_600_000);
        state.hdr_stamp_nsec = 999_999_999 - step;
        // Compared as text, because a bound of NaN equals nothing.
        assert_eq!(format!("{expected:?}"), format!("{:?}", jumping.run(&[state]).expect("answered")));
    }
    // Stopped for three seconds and continued: a full queue waits, its newest is fresh, and what it could not hold is lost.
    let sent: Vec<RavenState> = (0..3000).map(|_| jumping.next_state()).collect();
    let waiting = &sent[3000 - DEPTH_MAX..];
    let pose = jumping.run(waiting).expect("answered");
    assert_eq!(pose.source_sequence, waiting[DEPTH_MAX - 1].sequence);
    assert_eq!(pose.skipped, DEPTH_MAX as u64 - 1);
    assert_eq!(pose.lost, (3000 - DEPTH_MAX) as u64);
    assert_eq!(jumping.cycle.counters().published, 501, "one answer, not a burst");
}

#[test]
fn f26_late_answers_are_marked_degrade_and_end_the_correction() {
    let mut bench = Bench::new();
    bench.settle();
    bench.took = 700_000;
    for count in 1..=12 {
        let pose = bench.good();
        let arm = pose.arm[0];
        assert_eq!(pose.late, count);
        match count {
            1 | 2 => assert_eq!((arm.status, arm.flags & (flag::LATE | flag::DEGRADED)), (VALID, flag::LATE)),
            3..=9 => assert_eq!((arm.status, arm.flags & (flag::LATE | flag::DEGRADED)), (VALID, flag::LATE | flag::DEGRADED)),
            _ => assert_fallback(&pose, flag::BUDGET_EXCEEDED),
        }
    }
    assert_eq!(bench.pose.overruns, 0);
    bench.took = 40_000;
    // The burst is over: the first answer still stands under it, the next one is good and settles.
    let pose = bench.good();
    assert_eq!(pose.arm[0].flags & flag::LATE, 0);
    let pose = bench.good();
    assert_eq!(pose.arm[0].flags & (flag::LATE | flag::BUDGET_EXCEEDED), 0);
    assert_ne!(pose.arm[0].flags & flag::SETTLING, 0);
    for _ in 0..101 {
        bench.good();
    }
    assert_eq!(bench.good().arm[0].status, VALID);
}

#[test]
fn f26_cycles_beyond_the_period_count_as_overruns() {
    let mut bench = Bench::new();
    bench.settle();
    bench.took = 3 * MS;
    assert_eq!(bench.good().overruns, 1);
    bench.took = 40_000;
    assert_eq!(bench.good().overruns, 1);
}

#[test]
fn f42_the_last_message_says_stopping() {
    let mut bench = Bench::new();
    let last = bench.settle();
    bench.now += MS / 2;
    let mut pose = bench.pose;
    assert!(bench.cycle.stop(bench.now, &mut pose));
    assert_fallback(&pose, flag::STOPPING);
    assert_eq!(pose.sequence, last.sequence + 1);
    assert_eq!(pose.source_sequence, last.source_sequence);
    let mut never = Bench::new();
    assert!(!never.cycle.stop(never.now, &mut pose), "nothing to say when there never was a state");
}

#[test]
fn f44_counters_wrap_without_a_change_of_behaviour() {
    let mut bench = Bench::new();
    for counter in [u64::from(u32::MAX) - 50, u64::MAX - 50] {
        bench.cycle.preset_counters(Counters {
            cycles: counter,
            accepted: counter,
            lost: counter,
            skipped: counter,
            duplicates: counter,
            out_of_order: counter,
            refused: counter,
            sources: counter,
            late: counter,
            overruns: counter,
            published: counter,
        });
        for step in 1..=200 {
            let pose = bench.good();
            assert_eq!(pose.sequence, counter.wrapping_add(step));
            assert!(pose.admit().is_ok());
        }
    }
    assert_eq!(bench.good().arm[0].status, VALID);
}

#[test]
fn an_arm_that_is_not_connected_is_absent_and_returns_through_settling() {
    let mut bench = Bench::new();
    bench.settle();
    let mut state = bench.next_state();
    state.arms = 1;
    let pose = bench.run(&[state]).expect("answered");
    assert_eq!((pose.arm[0].status, pose.arm[1].status, pose.arms), (VALID, ArmStatus::Absent as u32, 1));
    assert_eq!((pose.arm[1].flags, pose.arm[1].reset_count), (flag::RESET, 1), "the drop is announced");
    let absent = ArmPose { flags: flag::RESET, reset_count: 1, ..ArmPose::ABSENT };
    // Compared as text, because a bound of NaN equals nothing.
    assert_eq!(format!("{:?}", pose.arm[1]), format!("{absent:?}"));
    let pose = bench.good();
    assert_eq!(pose.arm[1].status, FALLBACK);
    assert_eq!(pose.arm[1].reset_count, 1);
    assert_ne!(pose.arm[1].flags & flag::SETTLING, 0);
}

#[test]
fn a_message_with_a_time_of_another_clock_is_refused() {
    let mut bench = Bench::new();
    bench.settle();
    for (count, time) in [bench.now + 3 * MS, i64::MAX, -1, i64::MIN].into_iter().enumerate() {
        let mut state = bench.next_state();
        bench.now -= MS;
        state.source_time_ns = time;
        assert!(bench.run(&[state]).is_none());
        assert_eq!(bench.cycle.counters().refused, count as u64 + 1);
    }
}

#[test]
fn a_correction_that_jumps_is_rate_limited_and_flagged() {
    let mut bench = Bench::new();
    let before = bench.settle();
    let mut state = bench.next_state();
    state.pos[0] = -15_000;
    let pose = bench.run(&[state]).expect("answered");
    assert_ne!(pose.arm[0].flags & flag::RATE_LIMITED, 0);
    assert_eq!(pose.arm[0].status, VALID);
    let step: f64 =
        pose.arm[0].correction_um.iter().zip(before.arm[0].correction_um).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    assert!((step - 100.0).abs() < 1e-6, "{step}");
}

#[test]
fn a_model_reason_stands_in_every_message_also_in_repeated_stale_ones() {
    for (model, reason) in [(ArmModel::None, flag::NO_MODEL), (ArmModel::Rejected, flag::MODEL_REJECTED)] {
        let mut bench = Bench::new();
        bench.cycle = Cycle::new(Limits::default(), [model, model_of_world()], false, 0);
        assert_ne!(bench.good().arm[0].flags & reason, 0);
        bench.now += 6 * MS;
        let stale = bench.run(&[]).expect("repeated");
        assert_eq!(stale.arm[0].flags & (reason | flag::INPUT_STALE), reason | flag::INPUT_STALE);
    }
}
