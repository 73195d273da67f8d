//! Which frames become pairs, and why the others do not. A frame counts under the first reason that applies.

use serde::Serialize;

use super::solve::Fit;
use super::track::{Found, Place, Track, find, median, median_interval_s};
use super::{Options, PairError, Reported, Truth};

/// Why a frame of the truth made no pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The frame has no position.
    LostFrame,
    /// No state before or after it.
    OutsideOverlap,
    /// The states around it are too far apart, or one of them has no position.
    StateGap,
    /// The arm was not in the wanted runlevel.
    Runlevel,
    /// Position equal to that of the frame before, to the last digit: the camera gave one image twice.
    RepeatedFrame,
    /// Far from its neighbours, or further from the reported position than any arm error.
    Outlier,
    /// The arm stood still and a pair of this place exists.
    Standstill,
}

impl Reason {
    /// All, in the order in which they are tried.
    pub const ALL: [Self; 7] = [
        Self::LostFrame,
        Self::OutsideOverlap,
        Self::StateGap,
        Self::Runlevel,
        Self::RepeatedFrame,
        Self::Outlier,
        Self::Standstill,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::LostFrame => "lost frame",
            Self::OutsideOverlap => "outside the states",
            Self::StateGap => "gap in the states",
            Self::Runlevel => "other runlevel",
            Self::RepeatedFrame => "image given twice",
            Self::Outlier => "outlier",
            Self::Standstill => "standstill",
        }
    }
}

/// A frame with everything that a pair needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged {
    pub(super) frame: usize,
    pub(super) state_time_s: f64,
    pub(super) reported_m: [f64; 3],
    pub(super) truth_m: [f64; 3],
}

impl Judged {
    pub(super) fn label_m(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.truth_m[i] - self.reported_m[i])
    }
}

/// What became of the frames.
pub(super) struct Drops {
    pub(super) fates: Vec<Option<Reason>>,
    pub(super) kept: Vec<Judged>,
    /// Frame-to-frame noise of the label per axis, m.
    pub(super) noise_sd_m: [f64; 3],
}

/// # Errors
/// [`PairError::TooFewFrames`] if fewer remain than [`Limits::frames_min`](super::Limits::frames_min).
pub(super) fn judge(
    track: &Track<'_>,
    reported: &Reported<'_>,
    truth: &Truth,
    fit: &Fit,
    options: &Options,
) -> Result<Drops, PairError> {
    let rigid = fit.place.rigid();
    let mut place = Place::default();
    let mut fates: Vec<Option<Reason>> = vec![None; truth.t_s.len()];
    let mut judged: Vec<Judged> = Vec::new();
    let mut last: Option<[f64; 3]> = None;
    for (frame, fate) in fates.iter_mut().enumerate() {
        let position_m = truth.position_m[frame];
        let repeated = last == Some(position_m);
        last = Some(position_m);
        let state_time_s = fit.clock.state_time_s(truth.t_s[frame]);
        match state_at(track, reported, position_m, state_time_s, options.runlevel, &mut place) {
            Err(reason) => *fate = Some(reason),
            Ok(_) if repeated => *fate = Some(Reason::RepeatedFrame),
            Ok(reported_m) => judged.push(Judged { frame, state_time_s, reported_m, truth_m: rigid.apply(position_m) }),
        }
    }
    let noise_sd_m = noise(&judged);
    let outliers = outliers(&judged, noise_sd_m, options);
    let kept = without(judged, &outliers, Reason::Outlier, &mut fates);
    let standing = standing(&kept, options);
    let kept = without(kept, &standing, Reason::Standstill, &mut fates);
    if kept.len() < options.limits.frames_min {
        let needed = options.limits.frames_min;
        return Err(PairError::TooFewFrames { found: kept.len(), needed, frames: truth.t_s.len() });
    }
    Ok(Drops { fates, kept, noise_sd_m })
}

fn state_at(
    track: &Track<'_>,
    reported: &Reported<'_>,
    position_m: [f64; 3],
    state_time_s: f64,
    runlevel: Option<i32>,
    place: &mut Place,
) -> Result<[f64; 3], Reason> {
    if !position_m.iter().all(|value| value.is_finite()) {
        return Err(Reason::LostFrame);
    }
    let row = match find(track.t_s, state_time_s, track.gap_max_s, place) {
        Found::Outside => return Err(Reason::OutsideOverlap),
        Found::Gap => return Err(Reason::StateGap),
        Found::Between { row, .. } => row,
    };
    let reported_m = track.at(state_time_s, place).ok_or(Reason::StateGap)?;
    match (runlevel, reported.runlevel) {
        (Some(wanted), Some(levels)) if levels[row..row + 2].iter().any(|&level| level != f64::from(wanted)) => {
            Err(Reason::Runlevel)
        }
        _ => Ok(reported_m.into()),
    }
}

fn without(judged: Vec<Judged>, out: &[bool], reason: Reason, fates: &mut [Option<Reason>]) -> Vec<Judged> {
    let keep = |(one, out): (Judged, &bool)| {
        if *out {
            fates[one.frame] = Some(reason);
        }
        (!out).then_some(one)
    };
    judged.into_iter().zip(out).filter_map(keep).collect()
}

/// Standard deviation of the label from one frame to the next, per axis, by the median absolute difference: the arm's own
/// error moves slowly, so this is the noise of the truth.
fn noise(judged: &[Judged]) -> [f64; 3] {
    let times: Vec<f64> = judged.iter().map(|one| one.state_time_s).collect();
    let near_s = 1.5 * median_interval_s(&times);
    std::array::from_fn(|axis| {
        let near = judged.windows(2).filter(|pair| pair[1].state_time_s - pair[0].state_time_s <= near_s);
        let mut steps: Vec<f64> = near.map(|pair| (pair[1].label_m()[axis] - pair[0].label_m()[axis]).abs()).collect();
        // Normal: median of |difference| = 0.6745 sqrt(2) sd.
        median(&mut steps).unwrap_or(0.0) / (0.6745 * std::f64::consts::SQRT_2)
    })
}

/// Frames before and after that a frame is compared with.
const NEIGHBOURS: usize = 3;
/// Neighbours further away than this tell nothing, s.
const NEIGHBOUR_S: f64 = 0.5;

fn outliers(judged: &[Judged], noise_sd_m: [f64; 3], options: &Options) -> Vec<bool> {
    let limits = options.outliers;
    let noise_m = noise_sd_m.into_iter().fold(0.0, f64::max);
    let step_m = (limits.deviations * noise_m).max(limits.step_m);
    let labels: Vec<[f64; 3]> = judged.iter().map(Judged::label_m).collect();
    let is_outlier = |i: usize| {
        if length(labels[i]) > limits.gross_m {
            return true;
        }
        let around = i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(labels.len());
        let near = |j: &usize| *j != i && (judged[*j].state_time_s - judged[i].state_time_s).abs() <= NEIGHBOUR_S;
        let neighbours: Vec<usize> = around.filter(near).collect();
        if neighbours.len() < NEIGHBOURS {
            return false;
        }
        let middle: [f64; 3] =
            std::array::from_fn(|axis| median(&mut neighbours.iter().map(|&j| labels[j][axis]).collect::<Vec<_>>()).unwrap_or(0.0));
        length(std::array::from_fn(|axis| labels[i][axis] - middle[axis])) > step_m
    };
    (0..judged.len()).map(is_outlier).collect()
}

fn standing(judged: &[Judged], options: &Options) -> Vec<bool> {
    let mut last: Option<Judged> = None;
    let mut is_standing = |one: &Judged| {
        let still = last.is_some_and(|last| {
            let moved_m = length(std::array::from_fn(|axis| one.reported_m[axis] - last.reported_m[axis]));
            moved_m < options.standstill_m && one.state_time_s - last.state_time_s < options.standstill_every_s
        });
        if !still {
            last = Some(*one);
        }
        still
    };
    judged.iter().map(&mut is_standing).collect()
}

pub(super) fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}
