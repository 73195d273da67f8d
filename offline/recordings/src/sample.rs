//! One cycle of one arm in SI units, and how it stands in a `RavenState`.

use arm::{Arm, JOINTS, Joints, Motors, Side, kinematics, published};
use ravenpose_wire::RavenState;

/// Raw encoder counts at motor zero. Homing finds them anew each time; these are made up, of the size that a 24-bit
/// counter has after it, and the same in every state so that they are constant as in a real recording.
pub const ENCODER_OFFSETS: [[f64; JOINTS]; 2] = [
    [-4_210.0, 15_873.0, -60_244.0, 2_519.0, -3_307.0, 1_866.0, -745.0],
    [7_938.0, -11_462.0, 52_317.0, -1_984.0, 2_871.0, -1_120.0, 3_605.0],
];

/// Serial numbers of the arms' USB boards, as one laboratory has them (ravenstate.md, section 1, `type`).
const BOARD_TYPES: [i32; 2] = [49, 22];

/// Runlevel "pedal down": the arm is controlled.
const RUNLEVEL_PEDAL_DOWN: i32 = 3;

/// One cycle of one arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSample {
    /// Reported joint positions.
    pub joints: Joints,
    /// Commanded joint positions.
    pub joints_d: Joints,
    /// Measured motor angles, rad.
    pub motors: Motors,
    /// Commanded motor angles, rad.
    pub motors_d: Motors,
    /// Motor speeds, rad/s.
    pub motor_speeds: Motors,
    /// Torque before clipping, N·m at the capstan.
    pub torque_nm: Motors,
    /// Amplifier commands after clipping, counts.
    pub dac: [i32; JOINTS],
    /// Raw counts at motor zero, as homing found them.
    pub encoder_offsets: Motors,
}

/// When a cycle was, and which.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Counted from 0.
    pub index: u64,
    /// Time since the first cycle, ns.
    pub since_start_ns: i64,
    /// Time stamp of the message, ns.
    pub stamp_ns: i64,
    /// Time since the cycle before, ns.
    pub dt_ns: i64,
}

/// A state with its header and times, without arms.
pub fn state_of(cycle: &Cycle) -> RavenState {
    let mut state = RavenState::new();
    state.seal(cycle.index + 1);
    state.source_time_ns = cycle.since_start_ns;
    state.hdr_seq = cycle.index as u32;
    state.runlevel = RUNLEVEL_PEDAL_DOWN;
    let stamp = cycle.stamp_ns.max(0);
    state.hdr_stamp_sec = (stamp / NS_PER_S) as u32;
    state.hdr_stamp_nsec = (stamp % NS_PER_S) as u32;
    state.dt_sec = (cycle.dt_ns / NS_PER_S) as i32;
    state.dt_nsec = (cycle.dt_ns % NS_PER_S) as i32;
    state
}

const NS_PER_S: i64 = 1_000_000_000;

/// Writes one arm into a state, in the units as published.
pub fn put(state: &mut RavenState, arm: &Arm, sample: &ArmSample) {
    let side = arm.side.index();
    state.arms |= 1 << side;
    state.type_[side] = BOARD_TYPES[side];
    put_tip(state, arm, sample);
    let counts: [i32; JOINTS] = std::array::from_fn(|i| {
        arm.encoders.raw_count(i, sample.motors[i] / arm.encoders.rad_per_count(), sample.encoder_offsets[i])
    });
    let speeds = arm.transmission.published_speeds(&sample.motor_speeds);
    put_slots(&mut state.enc_vals, side, &published::slots(&counts));
    put_slots(&mut state.dac_val, side, &published::slots(&sample.dac));
    put_slots(&mut state.tau, side, &published::slots(&sample.torque_nm.map(|torque| torque as f32)));
    put_slots(&mut state.mpos, side, &published::degrees(&sample.motors));
    put_slots(&mut state.jpos, side, &published::degrees(&sample.joints));
    put_slots(&mut state.mvel, side, &published::degrees(&sample.motor_speeds));
    put_slots(&mut state.jvel, side, &published::degrees(&speeds));
    put_slots(&mut state.mpos_d, side, &published::degrees(&sample.motors_d));
    put_slots(&mut state.jpos_d, side, &published::degrees(&sample.joints_d));
    put_slots(&mut state.encoffsets, side, &published::slots(&sample.encoder_offsets.map(|count| count as f32)));
    state.grasp_d[side] = published::grasp(kinematics::jaw_opening(&sample.joints_d));
    let jac = published::jac_vel(arm.side, &sample.joints, &speeds);
    put_slots(&mut state.jac_vel, side, &jac);
    put_slots(&mut state.jac_f, side, &jac);
}

fn put_tip(state: &mut RavenState, arm: &Arm, sample: &ArmSample) {
    let side = arm.side.index();
    let (tip, tip_d) = (arm.kinematics.tip(&sample.joints), arm.kinematics.tip(&sample.joints_d));
    put_slots(&mut state.pos, side, &published::position_um(&tip));
    put_slots(&mut state.pos_d, side, &published::position_um(&tip_d));
    put_slots(&mut state.ori, side, &published::rotation_row_major(&tip));
    put_slots(&mut state.ori_d, side, &published::rotation_row_major(&tip_d));
}

/// Writes an arm's share of a field; the field holds both arms' shares one after the other.
fn put_slots<T: Copy, const SHARE: usize>(field: &mut [T], side: usize, share: &[T; SHARE]) {
    debug_assert_eq!(field.len(), 2 * SHARE);
    field[side * SHARE..(side + 1) * SHARE].copy_from_slice(share);
}

/// Amplifier commands of one arm as the other arm would have them for the same torques.
fn dac_on_other_arm(from: &Arm, to: &Arm, dac: &[i32; JOINTS]) -> [i32; JOINTS] {
    std::array::from_fn(|i| {
        let same_sign = (from.amplifiers.counts_per_nm()[i] > 0.0) == (to.amplifiers.counts_per_nm()[i] > 0.0);
        if same_sign { dac[i] } else { -dac[i] }
    })
}

/// The same joints on the other arm: its tool motors turn the other way with motor 3.
pub fn on_other_arm(from: &Arm, to: &Arm, sample: &ArmSample) -> ArmSample {
    if from.side == to.side {
        return *sample;
    }
    let joint_rates = from.transmission.joints(&sample.motor_speeds);
    let mut other = ArmSample {
        motors: to.transmission.motors_at(&sample.joints, sample.motors[2]),
        motors_d: to.transmission.motors_at(&sample.joints_d, sample.motors[2]),
        motor_speeds: to.transmission.motors_at(&joint_rates, sample.motor_speeds[2]),
        dac: dac_on_other_arm(from, to, &sample.dac),
        encoder_offsets: ENCODER_OFFSETS[to.side.index()],
        ..*sample
    };
    // The cables of joints 1 to 3 are the same on both arms: spare them the rounding of the way there and back.
    other.motors[..3].copy_from_slice(&sample.motors[..3]);
    other.motor_speeds[..3].copy_from_slice(&sample.motor_speeds[..3]);
    other
}

/// An arm with its nominal tool.
pub fn nominal(side: Side) -> Arm {
    arm::Raven2::nominal().arm(side)
}
