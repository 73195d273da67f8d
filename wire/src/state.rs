//! `raven/state`: every field of RAVEN's `raven_state`, with the header that a real-time reader needs.

use crate::Refusal;
use iceoryx2::prelude::ZeroCopySend;

/// Layout version of [`RavenState`]; also the `.v1` of its type name.
pub const STATE_VERSION: u32 = 1;

/// One cycle of RAVEN's controller, as its `raven_state` message has it (units as published: µm, degrees; joint 3 in
/// m × 57.29578). Arrays of 16 are `8 * arm + slot`, slot 3 belongs to no joint; arm 0 is gold (left), arm 1 green (right).
///
/// Source of the fields: `raven_2/raven_state`, MD5 `ce9e7f4969049d8bb365de3c98461a01`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("RavenState.v1")]
pub struct RavenState {
    /// Layout version, [`STATE_VERSION`].
    pub version: u32,
    /// Size of this struct in bytes.
    pub size: u32,
    /// Equals `sequence`; written first.
    pub guard_head: u64,
    /// Chosen at random when the publisher opens: another value is another run of the control process.
    pub source_id: u64,
    /// Counts up by one per control cycle, starting at 1.
    pub sequence: u64,
    /// `CLOCK_MONOTONIC` of the control cycle, ns.
    pub source_time_ns: i64,
    /// Bit 0: gold arm connected, bit 1: green arm connected; 0: as `type_` tells.
    pub arms: u32,
    /// `hdr.seq`.
    pub hdr_seq: u32,
    /// `hdr.stamp.sec`, wall clock, s.
    pub hdr_stamp_sec: u32,
    /// `hdr.stamp.nsec`, ns.
    pub hdr_stamp_nsec: u32,
    /// 0 e-stop, 1 initialising, 2 pedal up, 3 pedal down.
    pub runlevel: i32,
    /// 0..3 while initialising.
    pub sublevel: i32,
    /// Last teleoperation packet number.
    pub last_seq: i32,
    /// `type`: serial number of each arm's USB board, 0 if not connected.
    pub type_: [i32; 2],
    /// Reported tip position, µm, frame 0 of the arm; `3 * arm + axis`.
    pub pos: [i32; 6],
    /// Reported tip rotation, row-major; `9 * arm + 3 * row + column`.
    pub ori: [f32; 18],
    /// Commanded tip rotation, as `ori`.
    pub ori_d: [f32; 18],
    /// Commanded tip position, µm.
    pub pos_d: [i32; 6],
    /// Time since the previous publication: whole seconds.
    pub dt_sec: i32,
    /// Time since the previous publication: the rest, ns.
    pub dt_nsec: i32,
    /// `encVals`: raw encoder counts.
    pub enc_vals: [i32; 16],
    /// Amplifier command after clipping, counts.
    pub dac_val: [i32; 16],
    /// Desired torque at the capstan before clipping, N·m.
    pub tau: [f32; 16],
    /// Motor angle, degrees.
    pub mpos: [f32; 16],
    /// Joint position from the motors, degrees; joint 3: m × 57.29578.
    pub jpos: [f32; 16],
    /// Motor speed, degrees/s.
    pub mvel: [f32; 16],
    /// Joint speed without coupling, degrees/s; joint 3: m/s × 57.29578.
    pub jvel: [f32; 16],
    /// Commanded motor angle, degrees.
    pub mpos_d: [f32; 16],
    /// Commanded joint position, degrees; joint 3: m × 57.29578.
    pub jpos_d: [f32; 16],
    /// Commanded jaw opening, rad.
    pub grasp_d: [f32; 2],
    /// Encoder count at motor zero.
    pub encoffsets: [f32; 16],
    /// `jac_vel` as published; no physical unit.
    pub jac_vel: [f32; 12],
    /// `jac_f` as published, identical to `jac_vel`.
    pub jac_f: [f32; 12],
    /// Zero.
    pub reserved: u32,
    /// Equals `sequence`; written last.
    pub guard_tail: u64,
}

impl RavenState {
    /// A state of zeros with a valid header for sequence number 0.
    pub const fn new() -> Self {
        Self {
            version: STATE_VERSION,
            size: size_of::<Self>() as u32,
            guard_head: 0,
            source_id: 0,
            sequence: 0,
            source_time_ns: 0,
            arms: 0,
            hdr_seq: 0,
            hdr_stamp_sec: 0,
            hdr_stamp_nsec: 0,
            runlevel: 0,
            sublevel: 0,
            last_seq: 0,
            type_: [0; 2],
            pos: [0; 6],
            ori: [0.0; 18],
            ori_d: [0.0; 18],
            pos_d: [0; 6],
            dt_sec: 0,
            dt_nsec: 0,
            enc_vals: [0; 16],
            dac_val: [0; 16],
            tau: [0.0; 16],
            mpos: [0.0; 16],
            jpos: [0.0; 16],
            mvel: [0.0; 16],
            jvel: [0.0; 16],
            mpos_d: [0.0; 16],
            jpos_d: [0.0; 16],
            grasp_d: [0.0; 2],
            encoffsets: [0.0; 16],
            jac_vel: [0.0; 12],
            jac_f: [0.0; 12],
            reserved: 0,
            guard_tail: 0,
        }
    }

    /// Sets the sequence number and both guard words.
    pub fn seal(&mut self, sequence: u64) {
        self.guard_head = sequence;
        self.sequence = sequence;
        self.guard_tail = sequence;
    }

    /// Is this a whole message of this layout?
    ///
    /// # Errors
    /// [`Refusal::Layout`] for another version or size, [`Refusal::Torn`] where a guard word is not the sequence number.
    pub fn admit(&self) -> Result<(), Refusal> {
        if self.version != STATE_VERSION || self.size as usize != size_of::<Self>() {
            return Err(Refusal::Layout);
        }
        if self.guard_head != self.sequence || self.guard_tail != self.sequence {
            return Err(Refusal::Torn);
        }
        Ok(())
    }

    /// Connected arms, bit 0 gold, bit 1 green: `arms`, or where that is 0 the arms whose board has a serial number.
    pub fn connected(&self) -> u32 {
        if self.arms != 0 {
            return self.arms & 3;
        }
        u32::from(self.type_[0] != 0) | (u32::from(self.type_[1] != 0) << 1)
    }
}

impl Default for RavenState {
    fn default() -> Self {
        Self::new()
    }
}
