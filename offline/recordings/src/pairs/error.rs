//! Why no pairs were made; each with what was measured and what to do.

/// A refusal of [`pair`](super::pair).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PairError {
    /// A recording lacks a column.
    #[error("{recording}: has no column `{column}`; pairs need {needs}")]
    MissingColumn {
        /// Name of the recording.
        recording: String,
        /// The missing column.
        column: &'static str,
        /// What is needed, and for what.
        needs: &'static str,
    },
    /// Columns of unequal length, or a matching that does not fit.
    #[error("the {stream} stream: {what}")]
    Column {
        /// `reported` or `truth`.
        stream: &'static str,
        /// What does not fit, and the remedy.
        what: String,
    },
    /// A time that does not rise.
    #[error("the {stream} stream, row {row}: time {now} s does not rise above {before} s; sort the rows and drop repeated times")]
    TimeNotRising {
        /// `reported` or `truth`.
        stream: &'static str,
        /// Row, counted from 0.
        row: usize,
        /// Time of the row before, s.
        before: f64,
        /// Time of this row, s.
        now: f64,
    },
    /// Too few frames with a position, or with a state at their time.
    #[error(
        "only {found} of {frames} true positions can be matched with a state, {needed} are needed; record longer, or check the cameras"
    )]
    TooFewFrames {
        /// Usable frames.
        found: usize,
        /// [`Limits::frames_min`](super::Limits::frames_min).
        needed: usize,
        /// All frames.
        frames: usize,
    },
    /// The clocks do not overlap within the search window.
    #[error(
        "the states run from {state_from_s:.3} to {state_to_s:.3} s, the truth from {truth_from_s:.3} to {truth_to_s:.3} s: they do not meet \
         within {window_s} s of the expected offset {expected_s} s; give the difference of the clocks as the expected offset (--offset-s)"
    )]
    NoOverlap {
        /// First state, s.
        state_from_s: f64,
        /// Last state, s.
        state_to_s: f64,
        /// First frame, s.
        truth_from_s: f64,
        /// Last frame, s.
        truth_to_s: f64,
        /// Expected offset, s.
        expected_s: f64,
        /// Search window to each side, s.
        window_s: f64,
    },
    /// The arm hardly moves.
    #[error(
        "too little motion to tell the clocks apart: the reported tip spreads {:.2} mm and moves at {:.2} mm/s RMS over {duration_s:.1} s; \
         move the arm through its workspace", spread_m * 1e3, speed_rms_m_s * 1e3
    )]
    TooLittleMotion {
        /// Largest standard deviation of the reported position along a principal axis, m.
        spread_m: f64,
        /// RMS speed of the reported tip, m/s.
        speed_rms_m_s: f64,
        /// Duration of the truth, s.
        duration_s: f64,
    },
    /// The offset's standard error is too large.
    #[error(
        "the clock offset is known to {:.0} ms only, {:.0} ms are needed (tip speed {:.2} mm/s RMS, residual {:.2} mm RMS); record longer, faster \
         or with more changes of direction", offset_sd_s * 1e3, needed_s * 1e3, speed_rms_m_s * 1e3, rms_m * 1e3
    )]
    ClockUndetermined {
        /// Standard error, s.
        offset_sd_s: f64,
        /// [`Limits::offset_sd_max_s`](super::Limits::offset_sd_max_s).
        needed_s: f64,
        /// RMS speed of the reported tip, m/s.
        speed_rms_m_s: f64,
        /// RMS residual, m.
        rms_m: f64,
    },
    /// Two offsets fit equally well.
    #[error(
        "the motion fits at two clock offsets, {first_s:.3} s ({:.2} mm RMS) and {second_s:.3} s ({:.2} mm RMS); narrow the search window or record \
         motion that does not repeat", first_rms_m * 1e3, second_rms_m * 1e3
    )]
    Ambiguous {
        /// Best offset, s.
        first_s: f64,
        /// The other, s.
        second_s: f64,
        /// Residual at the best, m RMS.
        first_rms_m: f64,
        /// Residual at the other, m RMS.
        second_rms_m: f64,
    },
    /// The best offset lies at the edge of the search window.
    #[error(
        "the best clock offset {offset_s:.3} s lies at the edge of the search ({expected_s} s ± {window_s} s); widen the window"
    )]
    AtEdge {
        /// Best offset, s.
        offset_s: f64,
        /// Middle of the window, s.
        expected_s: f64,
        /// Half width of the window, s.
        window_s: f64,
    },
    /// The streams do not show the same motion.
    #[error(
        "the two streams do not show the same motion: the truth explains {:.0} % of the reported motion's variance ({:.0} % are needed), \
         {:.2} mm RMS remain; are both of the same run and arm, and is the offset within the window?",
        explained * 1e2, needed * 1e2, rms_m * 1e3
    )]
    NoAgreement {
        /// Share explained.
        explained: f64,
        /// Share needed.
        needed: f64,
        /// RMS residual, m.
        rms_m: f64,
    },
    /// Points on a line, or too close together.
    #[error(
        "the tip's positions cannot tell the registration: standard deviations {:.2}, {:.2}, {:.2} mm along their principal axes (the second must reach \
         {:.1} mm), rotation known to {:.2} deg; traverse the workspace in at least two directions",
        spread_m[0] * 1e3, spread_m[1] * 1e3, spread_m[2] * 1e3, spread_min_m * 1e3, rotation_sd_rad.to_degrees()
    )]
    Degenerate {
        /// Standard deviations of the reported positions along their principal axes, largest first, m.
        spread_m: [f64; 3],
        /// [`Limits::spread_min_m`](super::Limits::spread_min_m).
        spread_min_m: f64,
        /// Largest standard error of the rotation about an axis, rad; infinite where it is open.
        rotation_sd_rad: f64,
    },
}
