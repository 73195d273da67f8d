//! What the service, the C bridge and every client agree on: the two messages, byte for byte, and the 118 features.
//!
//! Both messages are `repr(C)`, of fixed size, little-endian and 8-byte aligned, and hold no pointer. iceoryx2 compares a
//! payload's name, size and alignment only, so the layout version is part of the type name and of the message itself.
//! `docs/messages.md` lists every offset and unit; a test compares it with what Rust and C compile.

pub mod features;
mod flags;
mod pose;
mod state;

pub use flags::{ArmStatus, FALLBACK_REASONS, FLAGS, Flag, flag, flag_names};
pub use pose::{ArmPose, CorrectedPose, POSE_VERSION};
pub use state::{RavenState, STATE_VERSION};

/// Number of arms in a message.
pub const ARMS: usize = 2;
/// Index of the gold (left) arm.
pub const GOLD: usize = 0;
/// Index of the green (right) arm.
pub const GREEN: usize = 1;
/// Inputs of a network: `raven118-v1`, the features of one arm.
pub const FEATURES: usize = 118;
/// Run level in which the motors follow the surgeon; in any other brakes hold the arm, and cables are loaded differently.
pub const PEDAL_DOWN: i32 = 3;
/// Name of the iceoryx2 service that carries [`RavenState`].
pub const STATE_SERVICE: &str = "raven/state";
/// Name of the iceoryx2 service that carries [`CorrectedPose`].
pub const POSE_SERVICE: &str = "raven/pose";
/// A message whose source time is further ahead of the reader's `CLOCK_MONOTONIC` than this is of another clock, ns.
pub const AHEAD_MAX_NS: i64 = 1_000_000;
/// The iceoryx2 version that all peers must have.
pub const ICEORYX2_VERSION: &str = "0.9.3";

/// Why a message was not admitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// `version` or `size` is not that of this layout.
    Layout,
    /// The guard words differ from the sequence number: parts of two writes, or never finished.
    Torn,
}
