//! What was found and what was dropped: for people (`Display`) and for programs (serde).

use std::fmt;

use serde::Serialize;

use super::{Clock, Reason, Rigid};

/// How much the arm moved, which decides what can be told.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Motion {
    /// Frames with a true position.
    pub frames_seen: usize,
    /// First to last of them, s.
    pub truth_duration_s: f64,
    /// Median interval between them, s.
    pub truth_interval_s: f64,
    /// Median interval between states, s.
    pub state_interval_s: f64,
    /// Standard deviations of the reported position along its principal axes, largest first, m.
    pub spread_m: [f64; 3],
    /// RMS speed of the reported tip, over 0.1 s, m/s.
    pub speed_rms_m_s: f64,
}

/// The clock of the truth against that of the states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockReport {
    /// Was the offset found from the motion?
    pub fitted: bool,
    /// Was the drift found too? If not it is taken as given, or as zero.
    pub drift_fitted: bool,
    /// The clock.
    pub clock: Clock,
    /// Standard error of the offset at the reference time, s.
    pub offset_sd_s: f64,
    /// 95 % interval of the offset, s.
    pub offset_interval_s: [f64; 2],
    /// Drift in millionths.
    pub drift_ppm: f64,
    /// Standard error, millionths.
    pub drift_sd_ppm: f64,
    /// 95 % interval of the drift, millionths.
    pub drift_interval_ppm: [f64; 2],
    /// Correlation of the rotation-invariant distances at the first guess.
    pub correlation: Option<f64>,
}

/// The rigid transform into frame 0 and what it leaves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegistrationReport {
    /// Was it found from these points?
    pub fitted: bool,
    /// Truth's frame into frame 0.
    pub rigid: Rigid,
    /// Standard errors of the rotation about the axes of frame 0, rad.
    pub rotation_sd_rad: [f64; 3],
    /// Standard errors of the translation at the middle of the points, m.
    pub centre_sd_m: [f64; 3],
    /// Points that the robust weights kept.
    pub inliers: usize,
    /// Points in all.
    pub points: usize,
    /// RMS length of the residual of the inliers, m.
    pub rms_m: f64,
    /// Standard deviation of the residual per axis, inliers, m.
    pub sd_m: [f64; 3],
    /// Covariance of the residual, inliers, m².
    pub covariance_m2: [[f64; 3]; 3],
    /// Share of the variance of the reported positions that the truth explains.
    pub explained: f64,
}

/// The labels of the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LabelReport {
    /// Mean per axis, m: near zero where the registration was fitted to these very points.
    pub mean_m: [f64; 3],
    /// Standard deviation per axis, m.
    pub sd_m: [f64; 3],
    /// RMS per axis, m.
    pub rms_m: [f64; 3],
    /// RMS length, m.
    pub rms_3d_m: f64,
    /// Greatest length, m.
    pub max_3d_m: f64,
    /// Noise from one frame to the next per axis, m: the truth's; the rest of the label is slow and the arm's.
    pub noise_sd_m: [f64; 3],
}

/// Orientation labels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OrientationReport {
    /// Pairs with an orientation on both sides.
    pub pairs: usize,
    /// Rotation of the fixture on the end effector, rows; fitted, it holds the arm's constant orientation error too.
    pub mounting: [[f64; 3]; 3],
    /// Was it taken as known?
    pub is_known: bool,
    /// RMS angle, rad.
    pub rms_rad: f64,
}

/// Frames that one reason took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Dropped {
    /// The reason.
    pub reason: Reason,
    /// How many.
    pub frames: usize,
}

/// The report of [`pair`](super::pair).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Frames of the truth; `pairs` and all of `dropped` add up to it.
    pub frames: usize,
    /// Pairs made.
    pub pairs: usize,
    /// Every reason, also those that took none.
    pub dropped: Vec<Dropped>,
    /// How the arm moved.
    pub motion: Motion,
    /// Clock.
    pub clock: ClockReport,
    /// Frame.
    pub registration: RegistrationReport,
    /// Labels.
    pub label: LabelReport,
    /// Orientation, where both streams have one.
    pub orientation: Option<OrientationReport>,
    /// What a reader must know to use the labels.
    pub notes: Vec<String>,
}

impl Report {
    /// As JSON, indented; figures that do not exist (an infinite standard error) are null.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|error| format!("{{\"error\":\"{error}\"}}"))
    }
}

/// Three lengths in mm.
fn mm(values_m: [f64; 3]) -> String {
    values_m.map(|value| format!("{:.3}", value * 1e3)).join(", ")
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} pairs from {} frames", self.pairs, self.frames)?;
        for dropped in self.dropped.iter().filter(|dropped| dropped.frames > 0) {
            writeln!(f, "  dropped {:>7}  {}", dropped.frames, dropped.reason.words())?;
        }
        self.motion.fmt(f)?;
        self.clock.fmt(f)?;
        self.registration.fmt(f)?;
        self.label.fmt(f)?;
        if let Some(orientation) = &self.orientation {
            let degrees = orientation.rms_rad.to_degrees();
            let how = if orientation.is_known { "with the fixture's mounting as given" } else { "after the fixture's mounting" };
            writeln!(f, "orientation: {degrees:.2} deg RMS in {} pairs {how}", orientation.pairs)?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let speed_mm_s = self.speed_rms_m_s * 1e3;
        writeln!(
            f,
            "motion: {:.1} s of truth at {:.1} Hz, states at {:.0} Hz; spread {} mm, speed {speed_mm_s:.1} mm/s RMS",
            self.truth_duration_s,
            1.0 / self.truth_interval_s,
            1.0 / self.state_interval_s,
            mm(self.spread_m)
        )
    }
}

impl fmt::Display for ClockReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let offset_ms = self.clock.offset_s * 1e3;
        if !self.fitted {
            return writeln!(f, "clock: offset {offset_ms:.1} ms, drift {:.1} ppm, as given", self.drift_ppm);
        }
        let [low, high] = self.offset_interval_s.map(|value| value * 1e3);
        write!(f, "clock: offset {offset_ms:.2} ms (95 %: {low:.2} to {high:.2}) at {:.1} s of the truth", self.clock.reference_s)?;
        if self.drift_fitted {
            let [low, high] = self.drift_interval_ppm;
            write!(f, ", drift {:.1} ppm ({low:.1} to {high:.1})", self.drift_ppm)?;
        }
        writeln!(f)
    }
}

impl fmt::Display for RegistrationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rms_mm, explained) = (self.rms_m * 1e3, self.explained * 1e2);
        writeln!(
            f,
            "registration{}: {rms_mm:.3} mm RMS over {} of {} points, SD {} mm per axis, {explained:.1} % of the motion explained",
            if self.fitted { "" } else { " as given" },
            self.inliers,
            self.points,
            mm(self.sd_m)
        )?;
        if self.fitted {
            let degrees = self.rotation_sd_rad.map(|value| format!("{:.3}", value.to_degrees())).join(", ");
            writeln!(f, "  known to {degrees} deg and {} mm (standard errors)", mm(self.centre_sd_m))?;
        }
        Ok(())
    }
}

impl fmt::Display for LabelReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "label (true - reported, frame 0): RMS {} mm per axis, {:.3} mm 3D, at most {:.3} mm; frame-to-frame noise {} mm",
            mm(self.rms_m),
            self.rms_3d_m * 1e3,
            self.max_3d_m * 1e3,
            mm(self.noise_sd_m)
        )
    }
}
