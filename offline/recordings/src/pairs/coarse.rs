//! A first guess of the clock that needs no registration: how far the tip gets within a fixed time does not depend on frame,
//! rotation, or a constant offset. Both streams' distances are correlated over all offsets in the window; long recordings
//! are cut into segments, so that a drift does not wash the peak out, and the best line through them is taken.

use super::report::Motion;
use super::track::{Clock, Frame, Place, Track, median_interval_s};
use super::{Limits, PairError};

/// A clock worth refining, with the correlation of the distances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) clock: Clock,
    pub(super) correlation: f64,
}

/// Times over which distances are taken, s: a short one is sharp, a long one stands out of the noise of 15 Hz cameras.
const BASELINES_S: [f64; 2] = [0.3, 1.0];
/// Step of the offset, s; refinement does the rest.
const STEP_S: f64 = 0.01;
/// Segments in which the drift may be neglected, s.
const SEGMENT_S: f64 = 60.0;
/// Distances of the truth that are used in all.
const SAMPLES_MAX: usize = 20_000;
/// Offsets that go to refinement, at least this far apart, s.
const CANDIDATES: usize = 6;
const APART_S: f64 = 0.12;
/// Peaks below this share of the highest are not refined.
const PEAK_SHARE: f64 = 0.5;

/// Distance over one baseline, by the time in its middle.
struct Distances {
    t_s: Vec<f64>,
    value_m: Vec<f64>,
}

/// Candidates, best first.
///
/// # Errors
/// [`PairError::TooLittleMotion`], [`PairError::NoOverlap`].
pub(super) fn search(
    track: &Track<'_>,
    frames: &[Frame],
    motion: &Motion,
    expected_s: f64,
    window_s: f64,
    drift_max: f64,
    limits: &Limits,
) -> Result<Vec<Candidate>, PairError> {
    let still = PairError::TooLittleMotion {
        spread_m: motion.spread_m[0],
        speed_rms_m_s: motion.speed_rms_m_s,
        duration_s: motion.truth_duration_s,
    };
    let moves = motion.spread_m[0] >= limits.spread_min_m;
    if !moves {
        return Err(still);
    }
    let (first_s, last_s) = (frames[0].t_s, frames[frames.len() - 1].t_s);
    let (state_from_s, state_to_s) = (track.t_s[0], track.t_s[track.t_s.len() - 1]);
    if first_s + expected_s - window_s > state_to_s || last_s + expected_s + window_s < state_from_s {
        let (truth_from_s, truth_to_s) = (first_s, last_s);
        return Err(PairError::NoOverlap { state_from_s, state_to_s, truth_from_s, truth_to_s, expected_s, window_s });
    }
    let plan = Plan::new(first_s, last_s, expected_s, window_s, drift_max);
    let baselines: Vec<Baseline> = BASELINES_S
        .iter()
        .map(|&baseline_s| {
            let truth = truth_distances(frames, baseline_s);
            let state = state_distances(track, baseline_s);
            plan.sums(&truth, &state, state_from_s)
        })
        .collect();
    let candidates = plan.peaks(&baselines);
    if candidates.is_empty() { Err(still) } else { Ok(candidates) }
}

/// Distances of the truth at its own frames; a gap of more than three frames gives none.
fn truth_distances(frames: &[Frame], baseline_s: f64) -> Distances {
    let times: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
    let gap_s = 3.5 * median_interval_s(&times);
    let axis = |i: usize| frames.iter().map(|frame| frame.position_m[i]).collect::<Vec<f64>>();
    let axes = [axis(0), axis(1), axis(2)];
    let track = Track { t_s: &times, position_m: [&axes[0], &axes[1], &axes[2]], gap_max_s: gap_s };
    let (mut before, mut after) = (Place::default(), Place::default());
    let mut distances = Distances { t_s: Vec::new(), value_m: Vec::new() };
    for &t_s in times.iter().step_by(frames.len() / SAMPLES_MAX + 1) {
        let ends = (track.at(t_s - 0.5 * baseline_s, &mut before), track.at(t_s + 0.5 * baseline_s, &mut after));
        if let (Some(start), Some(end)) = ends {
            distances.t_s.push(t_s);
            distances.value_m.push((end - start).norm());
        }
    }
    distances
}

/// Distances of the reported positions on a regular grid from the first state; NaN in gaps.
fn state_distances(track: &Track<'_>, baseline_s: f64) -> Vec<f64> {
    let (first_s, last_s) = (track.t_s[0], track.t_s[track.t_s.len() - 1]);
    let count = ((last_s - first_s) / STEP_S).floor() as usize + 1;
    let (mut before, mut after) = (Place::default(), Place::default());
    let at = |i: usize| {
        let t_s = first_s + i as f64 * STEP_S;
        let start = track.at(t_s - 0.5 * baseline_s, &mut before)?;
        Some((track.at(t_s + 0.5 * baseline_s, &mut after)? - start).norm())
    };
    (0..count).map(at).map(|distance| distance.unwrap_or(f64::NAN)).collect()
}

/// Sums for a correlation.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    yy: f64,
    xy: f64,
}

impl Sums {
    fn see(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.yy += y * y;
        self.xy += x * y;
    }

    fn add(&mut self, other: &Self) {
        self.n += other.n;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.yy += other.yy;
        self.xy += other.xy;
    }

    fn correlation(&self) -> f64 {
        let (vx, vy) = (self.n * self.xx - self.x * self.x, self.n * self.yy - self.y * self.y);
        if vx > 1e-9 * self.n * self.xx && vy > 1e-9 * self.n * self.yy {
            (self.n * self.xy - self.x * self.y) / (vx * vy).sqrt()
        } else {
            0.0
        }
    }
}

/// Sums of one baseline by segment and offset step.
struct Baseline {
    segments: Vec<Vec<Sums>>,
    /// Samples at the offset with the fullest overlap.
    most: f64,
}

/// Which offsets and drifts are looked at.
struct Plan {
    reference_s: f64,
    from_s: f64,
    duration_s: f64,
    segments: usize,
    expected_s: f64,
    /// Offsets at the reference: so many steps to both sides.
    half_steps: i64,
    /// Further steps that a drift adds at the ends.
    drift_steps: i64,
}

impl Plan {
    fn new(first_s: f64, last_s: f64, expected_s: f64, window_s: f64, drift_max: f64) -> Self {
        let duration_s = last_s - first_s;
        Self {
            reference_s: 0.5 * (first_s + last_s),
            from_s: first_s,
            duration_s,
            segments: (duration_s / SEGMENT_S).ceil().max(1.0) as usize,
            expected_s,
            half_steps: (window_s / STEP_S).ceil() as i64,
            drift_steps: (drift_max * 0.5 * duration_s / STEP_S).ceil() as i64,
        }
    }

    /// Per segment and offset step, from `-(half_steps + drift_steps)` up.
    fn sums(&self, truth: &Distances, state: &[f64], state_from_s: f64) -> Baseline {
        let reach = self.half_steps + self.drift_steps;
        let mut sums = vec![vec![Sums::default(); (2 * reach + 1) as usize]; self.segments];
        // A wrong ball gives distances that no arm covers: they count as the largest that the arm did.
        let largest = state.iter().copied().fold(0.0, f64::max) * 1.2;
        for (&t_s, &distance) in truth.t_s.iter().zip(&truth.value_m) {
            let segment = ((t_s - self.from_s) / self.duration_s * self.segments as f64) as usize;
            let middle = ((t_s + self.expected_s - state_from_s) / STEP_S).round() as i64;
            let (low, high) = ((middle - reach).max(0), (middle + reach + 1).min(state.len() as i64));
            let x = distance.min(largest);
            let row = &mut sums[segment.min(self.segments - 1)];
            for place in low..high {
                let y = state[place as usize];
                if y.is_finite() {
                    row[(place - middle + reach) as usize].see(x, y);
                }
            }
        }
        let most = sums.iter().map(|segment| segment.iter().map(|sums| sums.n).fold(0.0, f64::max)).sum();
        Baseline { segments: sums, most }
    }

    /// Mean correlation of the baselines at an offset and a drift, both in steps (the drift's at the ends of the record).
    fn correlation(&self, baselines: &[Baseline], offset: i64, drift: i64) -> f64 {
        let reach = self.half_steps + self.drift_steps;
        let of_baseline = |baseline: &Baseline| {
            let mut total = Sums::default();
            for (i, segment) in baseline.segments.iter().enumerate() {
                let place = (2.0 * (i as f64 + 0.5) / self.segments as f64 - 1.0) * drift as f64;
                total.add(&segment[(offset + place.round() as i64 + reach) as usize]);
            }
            // An offset that leaves little overlap correlates by chance.
            if total.n >= 20.0 && total.n >= 0.3 * baseline.most { total.correlation() } else { 0.0 }
        };
        baselines.iter().map(of_baseline).sum::<f64>() / baselines.len() as f64
    }

    fn peaks(&self, baselines: &[Baseline]) -> Vec<Candidate> {
        let drifts: Vec<i64> = if self.segments < 2 { vec![0] } else { (-self.drift_steps..=self.drift_steps).collect() };
        let best_drift = |offset: i64| {
            let of = |&drift: &i64| (self.correlation(baselines, offset, drift), drift);
            drifts.iter().map(of).fold((f64::MIN, 0), |best, next| if next.0 > best.0 { next } else { best })
        };
        let curve: Vec<(f64, i64)> = (-self.half_steps..=self.half_steps).map(best_drift).collect();
        let mut order: Vec<usize> = (0..curve.len()).collect();
        order.sort_by(|&a, &b| curve[b].0.total_cmp(&curve[a].0));
        let highest = order.first().map_or(0.0, |&i| curve[i].0);
        let apart = (APART_S / STEP_S) as usize;
        let mut chosen: Vec<usize> = Vec::new();
        for i in order {
            let (value, _) = curve[i];
            let peak = (i.saturating_sub(apart)..(i + apart + 1).min(curve.len())).all(|j| curve[j].0 <= value);
            if peak && value > 0.1 && value >= PEAK_SHARE * highest && chosen.len() < CANDIDATES {
                chosen.push(i);
            }
        }
        chosen.into_iter().map(|i| self.candidate(i, curve[i])).collect()
    }

    fn candidate(&self, i: usize, (correlation, drift): (f64, i64)) -> Candidate {
        let offset_s = self.expected_s + (i as i64 - self.half_steps) as f64 * STEP_S;
        let drift = if self.duration_s > 0.0 { drift as f64 * STEP_S / (0.5 * self.duration_s) } else { 0.0 };
        Candidate { clock: Clock { offset_s, drift, reference_s: self.reference_s }, correlation }
    }
}
