//! What may be set, with the defaults.

use super::{Clock, Rigid};
use crate::Recording;

/// Where the clock of the truth comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClockChoice {
    /// Found from the motion.
    Fit {
        /// Offset around which to search, s: the difference of the two clocks where they do not start together.
        expected_offset_s: f64,
        /// Search this far to both sides, s.
        window_s: f64,
        /// Largest drift, s per s.
        drift_max: f64,
    },
    /// Known, as for a truth that was logged on the state's clock: [`Clock::IDENTITY`].
    Known(Clock),
}

/// Where the transform of the truth's frame into frame 0 comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegistrationChoice {
    /// Found from these very points: then a constant offset of the arm cannot be seen in the labels.
    Fit,
    /// Known from elsewhere (markers on the base, a registration over many homings, or the truth is in frame 0 already:
    /// [`Rigid::IDENTITY`]): then the labels hold the whole error of the arm.
    Known(Rigid),
}

/// What makes a true position an outlier. The arm's own error may be large but moves slowly; a tracker that took the wrong
/// ball jumps. So a frame is judged by its neighbours, and by an absolute bound that no arm error reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlierLimits {
    /// A deviation from the median of the neighbouring labels beyond this many standard deviations of the frame-to-frame
    /// noise ...
    pub deviations: f64,
    /// ... and beyond this distance is an outlier, m.
    pub step_m: f64,
    /// A label longer than this is an outlier whatever its neighbours say, m. Three times the paper's largest error.
    pub gross_m: f64,
}

/// When to refuse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Fewest frames with a position and a state.
    pub frames_min: usize,
    /// The second largest standard deviation of the reported positions along their principal axes, m: below it they lie on a
    /// line, and the rotation about that line is open.
    pub spread_min_m: f64,
    /// Largest standard error of the registration's rotation about any axis, rad.
    pub rotation_sd_max_rad: f64,
    /// Largest standard error of the clock offset, s.
    pub offset_sd_max_s: f64,
    /// Least share of the reported motion's variance that the truth must explain.
    pub explained_min: f64,
    /// Least log-likelihood by which an offset must beat any other, nats.
    pub advantage_min_nats: f64,
}

const SEPTEMBER_2001_NS: i64 = 1_000_000_000_000_000_000;

/// What the offset of the clocks is by the two recordings' own words, s: both say when their time is 0, on the wall clock.
///
/// `start_unix_ns` of states, which is a small number where their clock began with the run; of the truth, `start_unix_s` (`vision
/// track`) is looked for as well. Only times after 2001 count.
pub fn stated_offset_s(reported: &Recording, truth: &Recording) -> Option<f64> {
    let start_ns = |recording: &Recording| {
        let whole = || recording.metadata.get("start_unix_ns")?.parse::<i64>().ok();
        let seconds = || Some((recording.metadata.get("start_unix_s")?.parse::<f64>().ok()? * 1e9) as i64);
        whole().or_else(seconds).filter(|start_ns| *start_ns >= SEPTEMBER_2001_NS)
    };
    Some((start_ns(truth)? - start_ns(reported)?) as f64 / 1e9)
}

/// Everything that [`pair`](super::pair) may be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Clock of the truth.
    pub clock: ClockChoice,
    /// Frame of the truth.
    pub registration: RegistrationChoice,
    /// Never interpolate between states further apart than this, s.
    pub gap_max_s: f64,
    /// Keep only frames with the arm in this runlevel, where the states have one (3 is pedal down).
    pub runlevel: Option<i32>,
    /// The fixture's axes are the end effector's: nothing of the orientation is fitted.
    pub mounting_known: bool,
    /// What is an outlier.
    pub outliers: OutlierLimits,
    /// While the reported position stays within this distance of the last pair, m ...
    pub standstill_m: f64,
    /// ... keep one frame in this time, s; zero keeps all.
    pub standstill_every_s: f64,
    /// When to refuse.
    pub limits: Limits,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            frames_min: 30,
            spread_min_m: 2e-3,
            rotation_sd_max_rad: 0.035,
            offset_sd_max_s: 0.02,
            explained_min: 0.75,
            advantage_min_nats: 6.0,
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            clock: ClockChoice::Fit { expected_offset_s: 0.0, window_s: 5.0, drift_max: 500e-6 },
            registration: RegistrationChoice::Fit,
            gap_max_s: 0.025,
            runlevel: Some(3),
            mounting_known: false,
            outliers: OutlierLimits { deviations: 6.0, step_m: 4e-3, gross_m: 30e-3 },
            standstill_m: 20e-6,
            standstill_every_s: 1.0,
            limits: Limits::default(),
        }
    }
}

impl Options {
    /// For a truth on the state's own clock and already in frame 0: nothing is fitted, the labels are plain differences.
    pub fn same_clock_and_frame() -> Self {
        Self {
            clock: ClockChoice::Known(Clock::IDENTITY),
            registration: RegistrationChoice::Known(Rigid::IDENTITY),
            ..Self::default()
        }
    }
}
