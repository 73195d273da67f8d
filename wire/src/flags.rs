//! The flags of a pose: one table from which the C header, the documentation and the tools take names and meanings.

/// What the consumer may do with an arm's estimate.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmStatus {
    /// The arm is not connected; its numbers are zero.
    Absent = 0,
    /// No correction yet: fewer than the wanted good cycles since the start.
    Starting = 1,
    /// The corrected position and orientation may be used.
    Valid = 2,
    /// Raw position and orientation, corrections zero; `flags` say why.
    Fallback = 3,
}

impl ArmStatus {
    /// Name as the tools print it; `unknown` for a number outside the table.
    pub fn name(status: u32) -> &'static str {
        match status {
            0 => "absent",
            1 => "starting",
            2 => "valid",
            3 => "fallback",
            _ => "unknown",
        }
    }
}

/// Bits of [`crate::ArmPose::flags`].
pub mod flag {
    /// An input of the network is NaN or infinite.
    pub const INPUT_NOT_FINITE: u32 = 1 << 0;
    /// No new state within the stale limit, or the newest is older than that.
    pub const INPUT_STALE: u32 = 1 << 1;
    /// A value that the robot cannot produce (joint beyond its stop, motor beyond its speed).
    pub const INPUT_IMPOSSIBLE: u32 = 1 << 2;
    /// A feature lies outside the range that the model was trained on.
    pub const OUT_OF_RANGE: u32 = 1 << 3;
    /// The features together lie outside the trained domain: `domain_score` > 1.
    pub const OUT_OF_DOMAIN: u32 = 1 << 4;
    /// Encoders stand still although the robot moves.
    pub const INPUT_FROZEN: u32 = 1 << 5;
    /// The network's output is NaN or infinite.
    pub const OUTPUT_NOT_FINITE: u32 = 1 << 6;
    /// The network's output lies beyond the model's correction bound or the configured envelope.
    pub const OUTPUT_BEYOND_BOUND: u32 = 1 << 7;
    /// Too many cycles in a row exceeded the budget.
    pub const BUDGET_EXCEEDED: u32 = 1 << 8;
    /// A model of the arm was refused at start and the configuration allows to go on without it.
    pub const MODEL_REJECTED: u32 = 1 << 9;
    /// The model is marked untrained and the configuration does not allow that.
    pub const UNTRAINED: u32 = 1 << 10;
    /// No model is configured for this arm.
    pub const NO_MODEL: u32 = 1 << 11;
    /// The fault is over; good cycles are still being counted.
    pub const SETTLING: u32 = 1 << 12;
    /// The control process was restarted (other source, or its sequence began anew).
    pub const NEW_SOURCE: u32 = 1 << 13;
    /// The service is stopping; this is its last message.
    pub const STOPPING: u32 = 1 << 14;
    /// The run level, or the arm's board, is not one that the model may be used with.
    pub const STATE_NOT_ALLOWED: u32 = 1 << 15;

    /// Information: the correction is on its way back from zero; the bound is widened by what is missing.
    pub const RECOVERING: u32 = 1 << 16;
    /// Information: the correction moved faster than the configured rate and was held to it.
    pub const RATE_LIMITED: u32 = 1 << 17;
    /// Information: this answer exceeded its budget.
    pub const LATE: u32 = 1 << 18;
    /// Information: trust is reduced (late cycles in a row, encoders still for 10 cycles).
    pub const DEGRADED: u32 = 1 << 19;
    /// Information: a real-time guarantee is missing on this machine and the configuration allows that.
    pub const NOT_REALTIME: u32 = 1 << 20;
    /// Information: the model is marked untrained and the configuration allows that.
    pub const UNTRAINED_ALLOWED: u32 = 1 << 21;
    /// Information: the same state arrived again since the last message.
    pub const SAW_DUPLICATE: u32 = 1 << 22;
    /// Information: the correction dropped to zero in this message (`reset_count` went up).
    pub const RESET: u32 = 1 << 23;
    /// Information: the model's memory has not seen every joint move far enough yet; the bound is the one for that.
    pub const MEMORY_UNSETTLED: u32 = 1 << 24;
    /// Information beside `out_of_domain`: the motors' torques show a load at the tip that the model was not trained with.
    pub const UNSEEN_LOAD: u32 = 1 << 25;
    /// Information: since the start the motors have not moved far enough to show a load; the bound holds only if there is none.
    pub const LOAD_UNWEIGHED: u32 = 1 << 26;
    /// Information beside `out_of_domain`: the motors' torques show another friction than the model was trained with.
    pub const UNSEEN_FRICTION: u32 = 1 << 27;
}

/// The flags that mean fallback.
pub const FALLBACK_REASONS: u32 = 0xffff;

/// One row of the flag table.
#[derive(Debug, Clone, Copy)]
pub struct Flag {
    /// The bit.
    pub bit: u32,
    /// Name in lower case, as the tools print it.
    pub name: &'static str,
}

/// Every flag with its name, lowest bit first.
pub const FLAGS: [Flag; 28] = [
    Flag { bit: flag::INPUT_NOT_FINITE, name: "input_not_finite" },
    Flag { bit: flag::INPUT_STALE, name: "input_stale" },
    Flag { bit: flag::INPUT_IMPOSSIBLE, name: "input_impossible" },
    Flag { bit: flag::OUT_OF_RANGE, name: "out_of_range" },
    Flag { bit: flag::OUT_OF_DOMAIN, name: "out_of_domain" },
    Flag { bit: flag::INPUT_FROZEN, name: "input_frozen" },
    Flag { bit: flag::OUTPUT_NOT_FINITE, name: "output_not_finite" },
    Flag { bit: flag::OUTPUT_BEYOND_BOUND, name: "output_beyond_bound" },
    Flag { bit: flag::BUDGET_EXCEEDED, name: "budget_exceeded" },
    Flag { bit: flag::MODEL_REJECTED, name: "model_rejected" },
    Flag { bit: flag::UNTRAINED, name: "untrained" },
    Flag { bit: flag::NO_MODEL, name: "no_model" },
    Flag { bit: flag::SETTLING, name: "settling" },
    Flag { bit: flag::NEW_SOURCE, name: "new_source" },
    Flag { bit: flag::STOPPING, name: "stopping" },
    Flag { bit: flag::STATE_NOT_ALLOWED, name: "state_not_allowed" },
    Flag { bit: flag::RECOVERING, name: "recovering" },
    Flag { bit: flag::RATE_LIMITED, name: "rate_limited" },
    Flag { bit: flag::LATE, name: "late" },
    Flag { bit: flag::DEGRADED, name: "degraded" },
    Flag { bit: flag::NOT_REALTIME, name: "not_realtime" },
    Flag { bit: flag::UNTRAINED_ALLOWED, name: "untrained_allowed" },
    Flag { bit: flag::SAW_DUPLICATE, name: "saw_duplicate" },
    Flag { bit: flag::RESET, name: "reset" },
    Flag { bit: flag::MEMORY_UNSETTLED, name: "memory_unsettled" },
    Flag { bit: flag::UNSEEN_LOAD, name: "unseen_load" },
    Flag { bit: flag::LOAD_UNWEIGHED, name: "load_unweighed" },
    Flag { bit: flag::UNSEEN_FRICTION, name: "unseen_friction" },
];

/// The names of the bits that are set, lowest first.
pub fn flag_names(flags: u32) -> impl Iterator<Item = &'static str> {
    FLAGS.iter().filter(move |row| flags & row.bit != 0).map(|row| row.name)
}
