//! Recordings become states whose fields agree with each other as those of RAVEN's controller do.
#![allow(missing_docs)]

mod common;

use arm::{Raven2, Side, published};
use common::data;
use ravenpose_wire::{FEATURES, GOLD, GREEN, RavenState, features};
use recordings::{Arms, Recording, States, csv, states, synthetic};

/// Slots of the seven joints in an arm's share of 16.
const SLOTS: [usize; 7] = published::SLOT_OF_JOINT;

fn load(file: &str) -> Option<Recording> {
    let path = data().join(file);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(csv::read(&path).unwrap_or_else(|error| panic!("{error}")))
}

fn uiuc() -> Option<Recording> {
    load("raven2-uiuc/real_first_two_thirds.csv")
}

fn from(text: &str, arms: Arms) -> Result<States, String> {
    let recording = csv::read_text("run.csv", text.as_bytes()).expect("csv");
    states::from_recording(&recording, arms).map_err(|error| error.to_string())
}

/// Joint positions in SI units from the published ones.
fn joints_si(state: &RavenState, side: usize, field: &[f32; 16]) -> [f64; 7] {
    assert!(state.admit().is_ok());
    SLOTS.map(|slot| f64::from(field[8 * side + slot]).to_radians())
}

/// Everything that must hold in any state of an arm, whatever it was made from.
fn check_consistent(state: &RavenState, side: Side) {
    let arm = Raven2::nominal().arm(side);
    let s = side.index();
    let at = |field: &[f32; 16], i: usize| f64::from(field[8 * s + SLOTS[i]]);
    for (i, slot) in SLOTS.into_iter().enumerate() {
        // mpos = 0.09 (sign encVals - encoffsets), within a count.
        let count = arm.encoders.sign(i) * f64::from(state.enc_vals[8 * s + slot]) - at(&state.encoffsets, i);
        assert!((count - at(&state.mpos, i) / 0.09).abs() <= 1.0, "motor {i}");
        let ratio = arm.transmission.ratio()[i];
        let expected = if i < 3 { at(&state.mvel, i) / ratio } else { 0.0 };
        assert!((at(&state.jvel, i) - expected).abs() <= 1e-6 * expected.abs().max(1.0), "jvel {i}");
        let unclipped = arm.amplifiers.counts_unclipped(i, at(&state.tau, i));
        let dac = f64::from(state.dac_val[8 * s + slot]);
        assert!((dac - unclipped).abs() <= 1.0 || dac.abs() < unclipped.abs(), "dac {i}: {dac}, {unclipped}");
    }
    let joints = joints_si(state, s, &state.jpos);
    let motors = joints_si(state, s, &state.mpos);
    for (i, (found, expected)) in joints.iter().zip(arm.transmission.joints(&motors)).enumerate() {
        // Published motor angles are float32: 4e-3 deg at 5e4 deg.
        assert!((found - expected).abs() < 2e-5, "joint {i}: {found}, {expected}");
    }
    check_tip(state, side, &joints);
    let speeds: [f64; 7] = SLOTS.map(|slot| f64::from(state.jvel[8 * s + slot]).to_radians());
    for (k, expected) in published::jac_vel(side, &joints, &speeds).iter().enumerate() {
        assert!((state.jac_vel[6 * s + k] - expected).abs() < 1e-5, "jac_vel {k}");
    }
    assert_eq!(state.jac_vel, state.jac_f);
    for field in [&state.tau, &state.mpos, &state.jpos, &state.mvel, &state.jvel, &state.mpos_d, &state.jpos_d, &state.encoffsets] {
        assert_eq!(field[8 * s + 3], 0.0);
    }
    let mut found = [f32::NAN; FEATURES];
    features::extract(state, s, &mut found);
    assert!(found.iter().all(|feature| feature.is_finite()));
}

fn check_tip(state: &RavenState, side: Side, joints: &[f64; 7]) {
    let arm = Raven2::nominal().arm(side);
    let s = side.index();
    let tip = arm.kinematics.tip(joints);
    for (axis, um) in published::position_um(&tip).iter().enumerate() {
        assert!((state.pos[3 * s + axis] - um).abs() <= 1, "axis {axis}");
    }
    for (k, expected) in published::rotation_row_major(&tip).iter().enumerate() {
        assert!((state.ori[9 * s + k] - expected).abs() < 1e-6);
    }
}

/// Header, times and runlevel of a whole run.
fn check_headers(states: &[RavenState]) {
    let mut time_ns = 0;
    for (i, state) in states.iter().enumerate() {
        assert!(state.admit().is_ok());
        assert_eq!((state.sequence, state.hdr_seq), (i as u64 + 1, i as u32));
        let dt_ns = i64::from(state.dt_sec) * 1_000_000_000 + i64::from(state.dt_nsec);
        if i > 0 {
            time_ns += dt_ns;
            assert!((state.source_time_ns - time_ns).abs() <= i as i64, "row {i}");
        } else {
            assert_eq!((dt_ns, state.source_time_ns), (1_000_000, 0));
        }
        assert_eq!((state.runlevel, state.sublevel), (3, 0));
    }
}

fn is_blank(state: &RavenState, side: usize) -> bool {
    let mut found = [f32::NAN; FEATURES];
    features::extract(state, side, &mut found);
    found[..FEATURES - 1].iter().all(|feature| *feature == 0.0) && state.type_[side] == 0
}

#[test]
fn the_real_motor_recording_becomes_consistent_states() {
    let Some(recording) = uiuc() else { return };
    let States { states, notes } = states::from_recording(&recording, Arms::Gold).expect("states");
    assert_eq!(states.len(), 14_177);
    check_headers(&states);
    for state in &states {
        assert_eq!((state.arms, state.type_), (1, [49, 0]));
        check_consistent(state, Side::Gold);
        assert!(is_blank(state, GREEN));
        assert_eq!((state.pos, state.ori, state.jpos, state.mpos), (state.pos_d, state.ori_d, state.jpos_d, state.mpos_d));
        assert_eq!((state.dt_sec, state.dt_nsec), (0, 1_000_000));
        assert_eq!(state.jpos[3..8], [0.0; 5], "joints 4 to 7 and the empty slot");
    }
    for note in &notes {
        println!("{note}");
    }
    assert!(notes.iter().any(|note| note.starts_with("Joints 4, 5, 6, 7: not recorded")), "{notes:#?}");
    assert!(notes.iter().any(|note| note.starts_with("Torque: computed back")), "{notes:#?}");
}

#[test]
fn the_real_recording_has_the_joints_of_its_read_off_linear_map_and_its_own_numbers() {
    let Some(recording) = uiuc() else { return };
    let text = std::fs::read_to_string(data().join("raven2-uiuc/real_first_two_thirds.csv")).expect("file");
    let rows = text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().expect("number")).collect());
    let States { states, .. } = states::from_recording(&recording, Arms::Gold).expect("states");
    let map = [[0.007_342_35, 0.0, 0.0], [-0.001_067_94, 0.008_228_96, 0.0], [-4.862_47e-5, -6.646_81e-5, 4.632_65e-4]];
    let mut worst = [0.0_f64; 3];
    for (state, row) in states.iter().zip(rows) {
        let row: Vec<f64> = row;
        for i in 0..3 {
            assert_eq!((state.mpos[i], state.mvel[i]), (row[1 + i] as f32, row[4 + i] as f32));
            assert_eq!(f64::from(state.dac_val[i]), row[7 + i]);
            // README: the torque at the gearbox output is -dac / (1.353775 * 2730).
            assert!((f64::from(state.tau[i]) + row[7 + i] / (1.353_775 * 2730.0)).abs() < 1e-6);
            let expected: f64 = (0..3).map(|k| map[i][k] * row[1 + k]).sum();
            worst[i] = worst[i].max((f64::from(state.jpos[i]) - expected).abs());
        }
    }
    println!("jpos against the linear map, deg, deg, m x 57.3: {worst:?}");
    // Six digits of the map times up to 5e4 deg.
    assert!(worst.iter().all(|deviation| *deviation < 3e-4));
}

#[test]
fn the_real_recording_on_both_arms_mirrors_the_tip() {
    let Some(recording) = uiuc() else { return };
    let States { states, notes } = states::from_recording(&recording, Arms::Both).expect("states");
    assert!(notes.iter().any(|note| note.contains("the green arm shows the joints of the recorded gold arm")));
    for state in states.iter().step_by(50) {
        assert_eq!((state.arms, state.type_), (3, [49, 22]));
        check_consistent(state, Side::Gold);
        check_consistent(state, Side::Green);
        assert_eq!([state.pos[0], -state.pos[1], state.pos[2]], [state.pos[3], state.pos[4], state.pos[5]]);
        assert_eq!(state.dac_val[..3], [-state.dac_val[8], -state.dac_val[9], -state.dac_val[10]]);
        assert_eq!(state.tau[..8], state.tau[8..]);
        assert_eq!(state.mpos[..3], state.mpos[8..11]);
        assert_eq!(state.mpos[4], -state.mpos[12]);
        assert!((state.mvel[4] + state.mvel[12]).abs() <= 1e-5 * state.mvel[4].abs().max(1.0));
    }
}

#[test]
fn the_real_joint_recording_gives_its_own_tip_and_commands() {
    let Some(recording) = load("raven2-circle/circle_first_two_thirds.csv.gz") else { return };
    let States { states, notes } = states::from_recording(&recording, Arms::Gold).expect("states");
    for note in &notes {
        println!("{note}");
    }
    assert_eq!(states.len(), 9726);
    check_headers(&states);
    let tip: Vec<&[f64]> = ["x_m", "y_m", "z_m"].map(|name| recording.column(name).expect(name)).to_vec();
    let commanded: Vec<&[f64]> = ["x_d_um", "y_d_um", "z_d_um"].map(|name| recording.column(name).expect(name)).to_vec();
    let mut command_um: Vec<f64> = Vec::new();
    for (row, state) in states.iter().enumerate() {
        check_consistent(state, Side::Gold);
        for axis in 0..3 {
            assert!((f64::from(state.pos[axis]) - tip[axis][row] * 1e6).abs() < 1.01, "row {row}");
            command_um.push((f64::from(state.pos_d[axis]) - commanded[axis][row]).abs());
        }
    }
    command_um.sort_by(f64::total_cmp);
    let median = command_um[command_um.len() / 2];
    println!("pos_d against the recorded command: median {median} um, largest {} um", command_um[command_um.len() - 1]);
    assert!(median <= 2.0);
    assert!(notes.iter().any(|note| note.contains("since the time steps are irregular")), "{notes:#?}");
    assert!(notes.iter().any(|note| note.starts_with("Tip: the computed position lies")), "{notes:#?}");
}

#[test]
fn joints_beyond_the_limits_are_said_plainly() {
    let motors = "t_s,mpos_1_deg,mpos_2_deg,mpos_3_deg\n0,-1000,20000,51559\n0.001,4000,11500,51559\n";
    let States { notes, .. } = from(motors, Arms::Gold).expect("states");
    let found: Vec<_> = notes.iter().filter(|note| note.contains("outside its command limits")).collect();
    assert_eq!(found.len(), 2, "{notes:#?}");
    assert_eq!(*found[0], "Joint 1: outside its command limits 0.0..90.0 deg in 1 of 2 rows (it spans -7.3..29.4 deg).");
    assert!(found[1].starts_with("Joint 2: outside its command limits 45.0..135.0 deg in 1 of 2 rows"));
}

#[test]
fn shaft_torque_becomes_capstan_torque_and_clipped_counts() {
    let text = "# arm = green\nt_s,mpos_1_rad,mpos_2_rad,mpos_3_rad,tau_1_nm\n0,71,200,900,0.01\n0.001,71,200,900,1\n";
    let States { states, notes } = from(text, Arms::Green).expect("states");
    assert!((states[0].tau[8] - 0.1225).abs() < 1e-7);
    assert_eq!((states[0].dac_val[8], states[1].dac_val[8]), (452, 2500));
    assert!(is_blank(&states[0], GOLD));
    assert_eq!((states[0].arms, states[0].type_), (2, [0, 22]));
    assert!(notes.contains(&"Torque and amplifier counts of motors 2, 3, 4, 5, 6, 7: not recorded, 0.".to_owned()), "{notes:#?}");
    assert!(!notes.iter().any(|note| note.starts_with("Arm:")), "{notes:#?}");
}

#[test]
fn commands_move_the_commanded_fields_only() {
    let text = "t_s,jpos_1_deg,jpos_2_deg,jpos_3_mm,jpos_d_1_deg,jpos_d_6_deg,jpos_d_7_deg\n0,30,90,400,31,45,45\n0.001,30.1,90,400,31,45,45\n";
    let States { states, notes } = from(text, Arms::Gold).expect("states");
    let state = &states[0];
    assert!(
        (state.jpos_d[0] - 31.0).abs() < 1e-5 && (state.jpos[0] - 30.0).abs() < 1e-5 && (state.jpos_d[2] - 22.918_312).abs() < 1e-5
    );
    assert!(state.pos_d != state.pos && state.mpos_d[0] > state.mpos[0]);
    assert_eq!(state.grasp_d[0], 1.57);
    assert!(
        notes.contains(&"Commands of joints 2, 3, 4, 5: not recorded, taken as equal to what was reported.".to_owned()),
        "{notes:#?}"
    );
    // 0.1 deg in 1 ms through the ratio of motor 1; motors 2 and 3 follow through the coupling.
    let speeds = &states[1].mvel;
    assert!((speeds[0] - 13_619.6).abs() < 0.5 && speeds[1] > 1000.0 && (states[1].jvel[0] - 100.0).abs() < 1e-3);
    check_consistent(&states[1], Side::Gold);
}

#[test]
fn time_stamps_and_long_steps_reach_the_header() {
    let text = "t_s,jpos_1_deg,jpos_2_deg,jpos_3_m\n1500000000.25,30,90,0.4\n1500000002.5,30,90,0.4\n";
    let States { states, .. } = from(text, Arms::Gold).expect("states");
    assert_eq!((states[0].hdr_stamp_sec, states[0].hdr_stamp_nsec), (1_500_000_000, 250_000_000));
    assert_eq!((states[1].dt_sec, states[1].dt_nsec), (2, 250_000_000));
    assert_eq!(states[1].source_time_ns, 2_250_000_000);
}

#[test]
fn recordings_that_cannot_become_states_are_refused_with_one_line() {
    for (text, expected) in [
        ("mpos_1_rad\n1\n", "run.csv: has no time; put a column t_s first, or use a run instead of a table"),
        (
            "t_s,mpos_1_rad,mpos_3_rad\n0,1,1\n",
            "run.csv: has no column mpos_2_rad; RAVEN states need mpos_1..3 (rad or deg), or jpos_1, jpos_2 (rad or deg) and jpos_3 (m)",
        ),
        (
            "t_s,jpos_1_rad,jpos_2_rad\n0,1,1\n",
            "run.csv: has no column jpos_3_m; RAVEN states need mpos_1..3 (rad or deg), or jpos_1, jpos_2 (rad or deg) and jpos_3 (m)",
        ),
        (
            "t_s,jpos_1_rad,jpos_2_rad,jpos_3_deg\n0,1,1,1\n",
            "run.csv: column jpos_3_rad has the wrong kind of unit for RAVEN-II; joint 3 slides (m), all others turn (rad, deg)",
        ),
        ("# arm = both\nt_s,mpos_1_rad\n0,1\n", "run.csv: metadata `arm = both` names no arm; write gold (left) or green (right)"),
    ] {
        assert_eq!(from(text, Arms::Gold).expect_err(text), expected);
    }
}

#[test]
fn synthetic_states_are_consistent_smooth_and_inside_the_limits() {
    let States { states, notes } = synthetic::states(7, 20.0, Arms::Both).expect("states");
    assert_eq!((states.len(), notes.len()), (20_000, 1));
    check_headers(&states);
    let limits = Raven2::nominal().arm(Side::Gold).limits;
    let mut moved = [0.0_f64; 14];
    for pair in states.windows(2) {
        for side in Side::ALL {
            check_consistent(&pair[1], side);
            let (before, now) =
                (joints_si(&pair[0], side.index(), &pair[0].jpos), joints_si(&pair[1], side.index(), &pair[1].jpos));
            let commanded = joints_si(&pair[1], side.index(), &pair[1].jpos_d);
            assert!(limits.contains(&now) && limits.contains(&commanded), "{now:?} {commanded:?}");
            assert!((0.25..=0.44).contains(&now[2]));
            for i in 0..7 {
                assert!((now[i] - before[i]).abs() < 4e-3, "joint {i} jumps");
                moved[7 * side.index() + i] += (now[i] - before[i]).abs();
            }
        }
    }
    assert!(moved.iter().all(|travel| *travel > 0.01), "every joint moves: {moved:?}");
    let clipped = states.iter().filter(|state| (0..3).any(|i| state.dac_val[i].abs() >= 2000)).count();
    println!("synthetic: {clipped} of {} states with a large command", states.len());
}

#[test]
fn synthetic_motion_depends_on_its_seed_alone() {
    let first = synthetic::states(1, 0.5, Arms::Both).expect("states");
    assert_eq!(first, synthetic::states(1, 0.5, Arms::Both).expect("states"));
    assert_ne!(first.states, synthetic::states(2, 0.5, Arms::Both).expect("states").states);
    let gold = synthetic::states(1, 0.5, Arms::Gold).expect("states").states;
    assert_eq!(gold[499].pos[..3], first.states[499].pos[..3]);
    assert!(is_blank(&gold[499], GREEN));
}

#[test]
fn impossible_durations_are_refused() {
    for duration in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9, 1e-5] {
        let text = synthetic::states(1, duration, Arms::Gold).expect_err("duration").to_string();
        assert_eq!(text, format!("synthetic motion of {duration} s cannot be made; ask for more than 0 and at most 7200 s"));
    }
}
