//! What the pictures of a report are drawn from. The engine fills it; nothing of it goes into report.json. Values that are not
//! finite are left blank everywhere.

use crate::Channel;

/// A finite or missing point (x, y).
pub type Point = (f64, f64);

/// Everything that is drawn; what is empty is not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pictures {
    /// Where the error is: one heat map per channel.
    pub heat: Vec<HeatMap>,
    /// Shares of the excess energy, largest first or in any order.
    pub shares: Vec<Share>,
    /// How each named effect shows, at best one per effect.
    pub signatures: Vec<Signature>,
    /// Held-out runs before and after the correction.
    pub before_after: Vec<BeforeAfter>,
    /// Spectra of what is left.
    pub spectra: Vec<Spectrum>,
}

/// A quantity on an axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Quantity {
    /// Name in plain words, such as `Velocity of the insertion joint`.
    pub name: String,
    /// Unit, written as in the report (`N.m`) or for people (`N m`); empty for plain numbers.
    pub unit: String,
}

impl Quantity {
    /// A name and a unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}

/// Error relative to noise over time, per joint or axis.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// The channel.
    pub channel: Channel,
    /// Names of joints or axes, from top to bottom.
    pub rows: Vec<String>,
    /// The runs from left to right.
    pub runs: Vec<HeatRun>,
}

/// A run in a heat map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatRun {
    /// Its id.
    pub run: String,
    /// Time of the first bin's start, s.
    pub start_s: f64,
    /// Width of a bin, s.
    pub bin_s: f64,
    /// RMS error in units of the noise floor (1: noise alone), one list of bins per row.
    pub values: Vec<Vec<f64>>,
}

/// A share of the excess energy of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The channel.
    pub channel: Channel,
    /// Joint or axis.
    pub joint: String,
    /// Condition in words, such as `within 40 ms of a reversal`; empty: the joint as a whole.
    pub regime: String,
    /// Share, 0 to 1.
    pub share: f64,
}

/// How an effect shows: the error against what it depends on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signature {
    /// The effect of the verdict that it belongs to.
    pub effect: u64,
    /// What it depends on, on the horizontal axis.
    pub feature: Quantity,
    /// The error, on the vertical axis.
    pub error: Quantity,
    /// Error before the correction against the feature; a thousand points are plenty.
    pub before: Vec<Point>,
    /// Error after the correction, likewise; may be empty.
    pub after: Vec<Point>,
    /// Fitted curve, in strokes where it jumps.
    pub curve: Vec<Vec<Point>>,
    /// 95 % band of the curve: x, low, high, in the same strokes as the curve.
    pub band: Vec<Vec<(f64, f64, f64)>>,
    /// What to see, in a sentence; may be empty.
    pub caption: String,
}

/// A held-out run before and after.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BeforeAfter {
    /// The effect that is corrected; none for all together.
    pub effect: Option<u64>,
    /// The run.
    pub run: String,
    /// The error that is shown.
    pub error: Quantity,
    /// Times, s, rising.
    pub t_s: Vec<f64>,
    /// Error of the simulation as it was, one per time.
    pub before: Vec<f64>,
    /// Error of the corrected simulation, one per time.
    pub after: Vec<f64>,
    /// RMS of noise alone.
    pub noise_floor: Option<f64>,
}

/// Spectrum of an error.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Spectrum {
    /// The effect that it belongs to; none for what is left of all.
    pub effect: Option<u64>,
    /// The error; its unit per square root of Hz.
    pub error: Quantity,
    /// Frequencies, Hz, rising.
    pub frequency_hz: Vec<f64>,
    /// Amplitude before the correction.
    pub before: Vec<f64>,
    /// Amplitude after the correction; may be empty.
    pub after: Vec<f64>,
    /// Amplitude of noise alone; may be empty.
    pub noise_floor: Vec<f64>,
}
