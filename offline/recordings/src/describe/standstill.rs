//! How often a robot stands still.

use serde::Serialize;

/// Motors slower than this stand, rad/s of the motor shaft: below one encoder count per cycle, and the figure of
/// data/raven2-uiuc.
pub(super) const MOTOR_STILL_RAD_S: f64 = 0.05;

/// Turning joints slower than this stand, rad/s.
pub(super) const JOINT_STILL_RAD_S: f64 = 0.01;

/// Sliding joints slower than this stand, m/s.
pub(super) const JOINT_STILL_M_S: f64 = 0.001;

/// How often a robot stands still.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standstill {
    /// The arm; empty for a table.
    pub arm: String,
    /// By what it is told.
    pub rule: String,
    /// Share of rows.
    pub share: f64,
    /// Most rows at a stretch.
    pub longest_rows: u64,
}

/// Counts rows at a standstill.
#[derive(Debug, Default)]
pub(super) struct StillRows {
    rows: u64,
    still: u64,
    stretch: u64,
    longest: u64,
}

impl StillRows {
    pub(super) fn see(&mut self, is_still: bool) {
        self.rows += 1;
        self.still += u64::from(is_still);
        self.stretch = if is_still { self.stretch + 1 } else { 0 };
        self.longest = self.longest.max(self.stretch);
    }

    pub(super) fn result(&self, arm: &str, rule: &str) -> Standstill {
        Standstill {
            arm: arm.to_owned(),
            rule: rule.to_owned(),
            share: super::share(self.still, self.rows),
            longest_rows: self.longest,
        }
    }
}
