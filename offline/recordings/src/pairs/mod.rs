//! Time-synchronised (state, truth) pairs: what the arm reported against where cameras saw its tip.
//!
//! Two streams come in: reported tip positions (1 kHz or 100 Hz, frame 0 of the arm, the state's clock) and true ones
//! (15 to 50 Hz, another frame, another clock). [`pair`] finds the clock offset and drift, the rigid transform into frame 0,
//! interpolates the reported position at every true one, and says what it dropped and why. Conventions, and what a
//! registration can and cannot tell from the arm's own error: `docs/pairs.md`.
//!
//! - state time = truth time + `offset_s` + `drift` · (truth time - `reference_s`): [`Clock`];
//! - position in frame 0 = R · position in the truth's frame + t: [`Rigid`];
//! - label = true - reported, in frame 0, metres: corrected = reported + label.

mod coarse;
mod drop;
mod error;
mod hac;
mod input;
mod options;
mod orientation;
mod report;
mod rigid;
mod sampler;
mod solve;
mod summary;
mod track;

pub use drop::Reason;
pub use error::PairError;
pub use input::{Reported, Truth};
pub use options::{ClockChoice, Limits, Options, OutlierLimits, RegistrationChoice, stated_offset_s};
pub use report::{ClockReport, Dropped, LabelReport, Motion, OrientationReport, RegistrationReport, Report};
pub use rigid::Rigid;
pub use sampler::{Interpolation, Sampler, sample};
pub use track::Clock;

use nalgebra::Vector3;
use rigid::Registered;
use solve::{Fit, Free, Problem};
use track::Track;

/// One pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index of the frame in [`Truth`].
    pub frame: usize,
    /// Time of the frame on the truth's clock, s.
    pub truth_time_s: f64,
    /// The same moment on the state's clock, s: where features are to be interpolated.
    pub state_time_s: f64,
    /// Reported position, interpolated, m, frame 0.
    pub reported_m: [f64; 3],
    /// True position brought into frame 0, m.
    pub truth_m: [f64; 3],
    /// `truth_m` - `reported_m`, m, frame 0.
    pub label_m: [f64; 3],
    /// Rotation vector that turns the reported orientation into the true one, rad, axes of frame 0; where both streams have
    /// orientations.
    pub rotation_label_rad: Option<[f64; 3]>,
    /// True orientation of the end effector in frame 0, without the fixture's mounting: w, x, y, z; where both streams have one.
    pub truth_wxyz: Option<[f64; 4]>,
}

/// Pairs, what became of every frame, and the report.
#[derive(Debug, Clone)]
pub struct Paired {
    /// Pairs in the order of time.
    pub pairs: Vec<Pair>,
    /// For every frame of the truth: the reason why it was dropped, or none.
    pub fates: Vec<Option<Reason>>,
    /// Clock of the truth against that of the states.
    pub clock: Clock,
    /// From the truth's frame into frame 0.
    pub registration: Rigid,
    /// Counts, figures and notes.
    pub report: Report,
}

impl Paired {
    /// Times of the pairs on the state's clock, s, rising: for [`Sampler`] and [`sample`].
    pub fn state_times_s(&self) -> Vec<f64> {
        self.pairs.iter().map(|pair| pair.state_time_s).collect()
    }
}

/// Pairs reported with true positions.
///
/// # Errors
/// [`PairError`]: columns that do not fit together, clocks without overlap, too little motion to tell the offset, motion that
/// fits at two offsets, streams that do not show the same motion, points that lie on a line.
pub fn pair(reported: &Reported<'_>, truth: &Truth, options: &Options) -> Result<Paired, PairError> {
    let track = reported.checked(options.gap_max_s)?;
    let frames = truth.checked(options.limits.frames_min)?;
    let motion = summary::motion(&track, &frames);
    let fitted = align(&track, &frames, &motion, options)?;
    let drops = drop::judge(&track, reported, truth, &fitted.fit, options)?;
    Ok(summary::paired(reported, truth, motion, &fitted, drops, options))
}

/// Registration of positions that are already matched, `truth_m[i]` with `reported_m[i]`, in the order of time; pairs with a
/// NaN are passed over. For marker sets, and for one registration from several runs put one after the other.
///
/// # Errors
/// [`PairError::TooFewFrames`], [`PairError::Degenerate`], [`PairError::NoAgreement`], [`PairError::Column`] for unequal lengths.
pub fn register(truth_m: &[[f64; 3]], reported_m: &[[f64; 3]], limits: &Limits) -> Result<RegistrationReport, PairError> {
    if truth_m.len() != reported_m.len() {
        return Err(PairError::Column {
            stream: "reported",
            what: format!("{} positions for {} true ones; give one for each", reported_m.len(), truth_m.len()),
        });
    }
    let matched = truth_m.iter().zip(reported_m).filter(|(p, x)| p.iter().chain(x.iter()).all(|value| value.is_finite()));
    let (points, targets): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) =
        matched.map(|(p, x)| (Vector3::from(*p), Vector3::from(*x))).unzip();
    if points.len() < limits.frames_min {
        return Err(PairError::TooFewFrames { found: points.len(), needed: limits.frames_min, frames: truth_m.len() });
    }
    let start = rigid::fit(&points, &targets, limits)?;
    let problem = Problem::fixed(&points, &targets);
    let fit = solve::solve(&problem, Clock::IDENTITY, start, Free { clock: false, drift: false, rigid: true });
    check_agreement(&fit, limits)?;
    check_registration(&fit, limits)?;
    Ok(summary::registration(&fit, true))
}

/// Offsets are compared on about this many frames; the best is then refined on all.
const RANKING_FRAMES: usize = 6000;

/// The winning alignment and what is known about the others.
struct Aligned {
    fit: Fit,
    /// Correlation of the rotation-invariant signals at the coarse offset, if a clock was searched.
    correlation: Option<f64>,
    free: Free,
    notes: Vec<String>,
}

fn align(track: &Track<'_>, frames: &[track::Frame], motion: &Motion, options: &Options) -> Result<Aligned, PairError> {
    let limits = &options.limits;
    let fits_rigid = matches!(options.registration, RegistrationChoice::Fit);
    let (candidates, fits_clock) = match options.clock {
        ClockChoice::Known(clock) => (vec![coarse::Candidate { clock, correlation: f64::NAN }], false),
        ClockChoice::Fit { expected_offset_s, window_s, drift_max } => {
            (coarse::search(track, frames, motion, expected_offset_s, window_s, drift_max, limits)?, true)
        }
    };
    let free = Free { clock: fits_clock, drift: fits_clock, rigid: fits_rigid };
    let sparse: Vec<track::Frame> = frames.iter().step_by(frames.len() / RANKING_FRAMES + 1).copied().collect();
    let mut fits: Vec<(Fit, f64, Free)> = Vec::new();
    let mut refusal = None;
    for candidate in candidates {
        match refine(track, &sparse, candidate.clock, free, options) {
            Ok((fit, free)) => fits.push((fit, candidate.correlation, free)),
            Err(error) => refusal = refusal.or(Some(error)),
        }
    }
    fits.sort_by(|a, b| a.0.loss().total_cmp(&b.0.loss()));
    let rivals: Vec<Fit> = fits.iter().skip(1).map(|(fit, _, _)| fit.clone()).collect();
    let Some((fit, correlation, free)) = fits.into_iter().next() else {
        return Err(refusal.unwrap_or(PairError::TooFewFrames { found: 0, needed: limits.frames_min, frames: frames.len() }));
    };
    check_agreement(&fit, limits)?;
    let ranked = fit.clone();
    let (fit, free) = if sparse.len() < frames.len() { refine(track, frames, fit.clock, free, options)? } else { (fit, free) };
    if let ClockChoice::Fit { expected_offset_s, window_s, .. } = options.clock {
        check_clock(&fit, &ranked, &rivals, motion, expected_offset_s, window_s, limits)?;
    }
    if fits_rigid {
        check_registration(&fit, limits)?;
    }
    let mut notes = Vec::new();
    if free.clock && !free.drift {
        notes.push(format!("the drift was taken as zero: {:.0} s are too short to tell it", motion.truth_duration_s));
    }
    Ok(Aligned { fit, correlation: fits_clock.then_some(correlation), free, notes })
}

/// Registration at one clock, then everything together; without the drift where the data cannot tell it.
fn refine(
    track: &Track<'_>,
    frames: &[track::Frame],
    clock: Clock,
    free: Free,
    options: &Options,
) -> Result<(Fit, Free), PairError> {
    let problem = Problem::tracked(track, frames);
    let (points, targets) = problem.matched(&clock);
    if points.len() < options.limits.frames_min {
        let needed = options.limits.frames_min;
        return Err(PairError::TooFewFrames { found: points.len(), needed, frames: frames.len() });
    }
    let start = match options.registration {
        RegistrationChoice::Fit => rigid::fit(&points, &targets, &options.limits)?,
        RegistrationChoice::Known(rigid) => Registered::known(&rigid, &points),
    };
    let fit = solve::solve(&problem, clock, start.clone(), free);
    let drift_max = match options.clock {
        ClockChoice::Fit { drift_max, .. } => drift_max,
        ClockChoice::Known(_) => f64::INFINITY,
    };
    // A drift that is known no better than it may be at all only adds noise.
    if free.drift && !(fit.drift_sd() < drift_max && fit.clock.drift.abs() <= drift_max) {
        let free = Free { drift: false, ..free };
        let clock = Clock { drift: 0.0, ..clock };
        return Ok((solve::solve(&problem, clock, start, free), free));
    }
    Ok((fit, free))
}

fn check_registration(fit: &Fit, limits: &Limits) -> Result<(), PairError> {
    let spread_m = fit.spread_m();
    let rotation_sd_rad = fit.rotation_sd_rad().into_iter().fold(0.0, f64::max);
    let told = spread_m[1] >= limits.spread_min_m && rotation_sd_rad <= limits.rotation_sd_max_rad;
    if told { Ok(()) } else { Err(PairError::Degenerate { spread_m, spread_min_m: limits.spread_min_m, rotation_sd_rad }) }
}

fn check_agreement(fit: &Fit, limits: &Limits) -> Result<(), PairError> {
    if fit.explained() >= limits.explained_min {
        return Ok(());
    }
    Err(PairError::NoAgreement { explained: fit.explained(), needed: limits.explained_min, rms_m: fit.rms_m() })
}

/// `ranked` and `rivals` come from the same, possibly thinned out, frames.
fn check_clock(
    fit: &Fit,
    ranked: &Fit,
    rivals: &[Fit],
    motion: &Motion,
    expected_s: f64,
    window_s: f64,
    limits: &Limits,
) -> Result<(), PairError> {
    let offset_s = fit.clock.offset_s;
    let inside = (offset_s - expected_s).abs() < window_s;
    if !inside {
        return Err(PairError::AtEdge { offset_s, expected_s, window_s });
    }
    let told = fit.offset_sd() <= limits.offset_sd_max_s;
    if !told {
        return Err(PairError::ClockUndetermined {
            offset_sd_s: fit.offset_sd(),
            needed_s: limits.offset_sd_max_s,
            speed_rms_m_s: motion.speed_rms_m_s,
            rms_m: fit.rms_m(),
        });
    }
    // Another refined offset counts as a rival if it is not the same minimum, and as beaten if the likelihood says so.
    let same_s = 0.02 + 4.0 * fit.offset_sd();
    let rival = rivals.iter().find(|rival| (rival.clock.offset_s - offset_s).abs() > same_s);
    // Two perfect fits compare as not a number, and so as no better.
    let beats = |rival: &Fit| ranked.advantage_nats(rival) >= limits.advantage_min_nats;
    match rival {
        Some(rival) if !beats(rival) => Err(PairError::Ambiguous {
            first_s: offset_s,
            second_s: rival.clock.offset_s,
            first_rms_m: fit.rms_m(),
            second_rms_m: rival.rms_m(),
        }),
        _ => Ok(()),
    }
}
