//! `raven/pose`: the corrected pose of both arms, and everything that tells whether to trust it.

use crate::{ArmStatus, Refusal};
use iceoryx2::prelude::ZeroCopySend;

/// Layout version of [`CorrectedPose`]; also the `.v1` of its type name.
pub const POSE_VERSION: u32 = 1;

/// The estimate for one arm, in frame 0 of the arm: positions in micrometres, rotations in degrees.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("ArmPose.v1")]
pub struct ArmPose {
    /// An [`ArmStatus`]: use `corrected_position_um` and `corrected_orientation` only when it is `valid`.
    pub status: u32,
    /// Bits of [`crate::flag`]: why, and what else to know.
    pub flags: u32,
    /// First eight bytes of the SHA-256 of the position's model file, big-endian (prints as the hash begins); 0 without a model.
    pub model_id: u64,
    /// Goes up by one whenever the correction drops to zero at once (an announced step); a restarted service begins with another one.
    pub reset_count: u32,
    /// Distance from the trained domain, 1 = its edge, the larger one of the arm's models; -1 where it was not computed.
    pub domain_score: f32,
    /// Position as RAVEN reports it, µm.
    pub raw_position_um: [f64; 3],
    /// What was added, µm; zero unless `status` is valid.
    pub correction_um: [f64; 3],
    /// `raw_position_um + correction_um`, µm.
    pub corrected_position_um: [f64; 3],
    /// Half width per axis that holds the true position with 95 %, µm; NaN while the model states none.
    pub bound95_um: [f64; 3],
    /// Rotation as RAVEN reports it, row-major, bit for bit.
    pub orientation: [f32; 9],
    /// Good cycles still wanted before the correction returns.
    pub hold_cycles: u32,
    /// As `model_id`, of the model that corrects the orientation; 0 without one: then it is RAVEN's own in every status.
    pub orientation_model_id: u64,
    /// What the orientation was turned by, a rotation vector in the axes of frame 0, degrees; zero unless `status` is valid.
    pub rotation_deg: [f64; 3],
    /// Half width per axis of `rotation_deg` that holds the true rotation with 95 %, degrees; NaN while the model states none.
    pub rotation_bound95_deg: [f64; 3],
    /// `exp(rotation_deg)` times `orientation`, row-major; bit for bit `orientation` where the rotation is zero.
    pub corrected_orientation: [f32; 9],
    /// Zero.
    pub reserved: u32,
}

impl ArmPose {
    /// An arm that is not connected.
    pub const ABSENT: Self = Self {
        status: ArmStatus::Absent as u32,
        flags: 0,
        model_id: 0,
        reset_count: 0,
        domain_score: -1.0,
        raw_position_um: [0.0; 3],
        correction_um: [0.0; 3],
        corrected_position_um: [0.0; 3],
        bound95_um: [f64::NAN; 3],
        orientation: [0.0; 9],
        hold_cycles: 0,
        orientation_model_id: 0,
        rotation_deg: [0.0; 3],
        rotation_bound95_deg: [f64::NAN; 3],
        corrected_orientation: [0.0; 9],
        reserved: 0,
    };
}

/// What the service publishes once per cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("CorrectedPose.v1")]
pub struct CorrectedPose {
    /// Layout version, [`POSE_VERSION`].
    pub version: u32,
    /// Size of this struct in bytes.
    pub size: u32,
    /// Equals `sequence`; written first.
    pub guard_head: u64,
    /// Counts up by one per published message; a restarted service goes on from a higher number.
    pub sequence: u64,
    /// `source_id` of the state that this answers.
    pub source_id: u64,
    /// `sequence` of the state that this answers.
    pub source_sequence: u64,
    /// `source_time_ns` of the state that this answers, `CLOCK_MONOTONIC`, ns.
    pub source_time_ns: i64,
    /// When the cycle took the state (or, without one, began), `CLOCK_MONOTONIC`, ns.
    pub start_time_ns: i64,
    /// When this message was handed over, `CLOCK_MONOTONIC`, ns.
    pub publish_time_ns: i64,
    /// Connected arms: bit 0 gold, bit 1 green.
    pub arms: u32,
    /// `runlevel` of the state.
    pub runlevel: i32,
    /// Cycles since the service started, idle ones included.
    pub cycles: u64,
    /// States that never arrived (gaps in the source sequence).
    pub lost: u64,
    /// States that arrived but were overtaken by a newer one in the same cycle.
    pub skipped: u64,
    /// States that arrived more than once.
    pub duplicates: u64,
    /// States older than one already taken.
    pub out_of_order: u64,
    /// Messages refused: other layout, torn, or a time in the future.
    pub refused: u64,
    /// Cycles that took longer than the budget.
    pub late: u64,
    /// Cycles that took longer than the period.
    pub overruns: u64,
    /// Gold, green.
    pub arm: [ArmPose; 2],
    /// Equals `sequence`; written last.
    pub guard_tail: u64,
}

impl CorrectedPose {
    /// A message with no arm and sequence number 0.
    pub const fn new() -> Self {
        Self {
            version: POSE_VERSION,
            size: size_of::<Self>() as u32,
            guard_head: 0,
            sequence: 0,
            source_id: 0,
            source_sequence: 0,
            source_time_ns: 0,
            start_time_ns: 0,
            publish_time_ns: 0,
            arms: 0,
            runlevel: 0,
            cycles: 0,
            lost: 0,
            skipped: 0,
            duplicates: 0,
            out_of_order: 0,
            refused: 0,
            late: 0,
            overruns: 0,
            arm: [ArmPose::ABSENT; 2],
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
    /// As [`crate::RavenState::admit`].
    pub fn admit(&self) -> Result<(), Refusal> {
        if self.version != POSE_VERSION || self.size as usize != size_of::<Self>() {
            return Err(Refusal::Layout);
        }
        if self.guard_head != self.sequence || self.guard_tail != self.sequence {
            return Err(Refusal::Torn);
        }
        Ok(())
    }
}

impl Default for CorrectedPose {
    fn default() -> Self {
        Self::new()
    }
}
