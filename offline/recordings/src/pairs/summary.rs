//! From the solution to pairs and report.

use nalgebra::{Matrix3, Vector3};

use super::drop::{Drops, length};
use super::orientation;
use super::report::{ClockReport, Dropped, LabelReport, Motion, OrientationReport, RegistrationReport, Report};
use super::rigid;
use super::solve::Fit;
use super::track::{Frame, Place, Track, median_interval_s};
use super::{Aligned, Options, Pair, Paired, Reason, Reported, Truth};

/// Two-sided 95 % point of the normal distribution.
const Z_95: f64 = 1.96;

/// Time over which the speed is taken, s.
const SPEED_OVER_S: f64 = 0.1;

/// How the arm moved; from at most 20 000 moments.
pub(super) fn motion(track: &Track<'_>, frames: &[Frame]) -> Motion {
    let (first_s, last_s) = (track.t_s[0], track.t_s[track.t_s.len() - 1]);
    let count = (((last_s - first_s) / SPEED_OVER_S).ceil() as usize).clamp(1, 20_000);
    let step_s = (last_s - first_s) / count as f64;
    let mut place = Place::default();
    let mut at = |t_s: f64| track.at(t_s, &mut place);
    let moments: Vec<(Vector3<f64>, Option<Vector3<f64>>)> = (0..count)
        .filter_map(|i| {
            let t_s = first_s + i as f64 * step_s;
            Some((at(t_s)?, at(t_s + SPEED_OVER_S)))
        })
        .collect();
    let squares: Vec<f64> = moments.iter().filter_map(|(a, b)| b.map(|b| (b - a).norm_squared())).collect();
    let positions: Vec<Vector3<f64>> = moments.iter().map(|(position, _)| *position).collect();
    let times: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
    Motion {
        frames_seen: frames.len(),
        truth_duration_s: times[times.len() - 1] - times[0],
        truth_interval_s: median_interval_s(&times),
        state_interval_s: track.interval_s(),
        spread_m: rigid::principal_deviations(&positions, None),
        speed_rms_m_s: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt() / SPEED_OVER_S,
    }
}

pub(super) fn registration(fit: &Fit, fitted: bool) -> RegistrationReport {
    let inliers: Vec<Vector3<f64>> = fit.inliers().copied().collect();
    let count = inliers.len().max(1) as f64;
    let mean = inliers.iter().sum::<Vector3<f64>>() / count;
    let covariance = inliers.iter().map(|r| (r - mean) * (r - mean).transpose()).sum::<Matrix3<f64>>() / count;
    RegistrationReport {
        fitted,
        rigid: fit.place.rigid(),
        rotation_sd_rad: fit.rotation_sd_rad(),
        centre_sd_m: fit.centre_sd_m(),
        inliers: inliers.len(),
        points: fit.residuals.len(),
        rms_m: fit.rms_m(),
        sd_m: std::array::from_fn(|i| covariance[(i, i)].sqrt()),
        covariance_m2: std::array::from_fn(|row| std::array::from_fn(|column| covariance[(row, column)])),
        explained: fit.explained(),
    }
}

fn clock(aligned: &Aligned) -> ClockReport {
    let (fit, free) = (&aligned.fit, aligned.free);
    let around = |value: f64, sd: f64| [value - Z_95 * sd, value + Z_95 * sd];
    let (drift_ppm, drift_sd_ppm) = (fit.clock.drift * 1e6, fit.drift_sd() * 1e6);
    ClockReport {
        fitted: free.clock,
        drift_fitted: free.drift,
        clock: fit.clock,
        offset_sd_s: fit.offset_sd(),
        offset_interval_s: around(fit.clock.offset_s, fit.offset_sd()),
        drift_ppm,
        drift_sd_ppm,
        drift_interval_ppm: around(drift_ppm, drift_sd_ppm),
        correlation: aligned.correlation,
    }
}

fn label(labels: &[[f64; 3]], noise_sd_m: [f64; 3]) -> LabelReport {
    let count = labels.len().max(1) as f64;
    let mean_m: [f64; 3] = std::array::from_fn(|i| labels.iter().map(|label| label[i]).sum::<f64>() / count);
    let rms_m: [f64; 3] = std::array::from_fn(|i| (labels.iter().map(|label| label[i] * label[i]).sum::<f64>() / count).sqrt());
    LabelReport {
        mean_m,
        sd_m: std::array::from_fn(|i| (rms_m[i] * rms_m[i] - mean_m[i] * mean_m[i]).max(0.0).sqrt()),
        rms_m,
        rms_3d_m: length(rms_m),
        max_3d_m: labels.iter().map(|label| length(*label)).fold(0.0, f64::max),
        noise_sd_m,
    }
}

fn notes(aligned: &Aligned, motion: &Motion, has_fitted_mounting: bool) -> Vec<String> {
    let mut notes = aligned.notes.clone();
    if aligned.free.rigid {
        notes.push(
            "the registration was fitted to these points: a constant offset of the arm, and a constant rotation of its frame, \
             are in it and not in the labels"
                .to_owned(),
        );
    }
    if aligned.free.clock {
        let mm_per_ms = motion.speed_rms_m_s;
        notes.push(format!(
            "the clock was fitted to these points: a lag of the arm that grows with its speed is in it; 1 ms is {mm_per_ms:.3} mm at the RMS speed"
        ));
    }
    if has_fitted_mounting {
        notes.push(
            "the fixture's mounting was fitted to these orientations: a constant turn of the end effector is in it and not in the labels"
                .to_owned(),
        );
    }
    notes
}

pub(super) fn paired(
    reported: &Reported<'_>,
    truth: &Truth,
    motion: Motion,
    aligned: &Aligned,
    drops: Drops,
    options: &Options,
) -> Paired {
    let rigid = aligned.fit.place.rigid();
    let turned = orientation::labels(reported, truth, &drops.kept, &rigid, options);
    let pairs: Vec<Pair> = drops
        .kept
        .iter()
        .enumerate()
        .map(|(i, one)| {
            let turned = turned.as_ref().and_then(|turned| turned.labels[i]);
            Pair {
                frame: one.frame,
                truth_time_s: truth.t_s[one.frame],
                state_time_s: one.state_time_s,
                reported_m: one.reported_m,
                truth_m: one.truth_m,
                label_m: one.label_m(),
                rotation_label_rad: turned.map(|turned| turned.turn_rad),
                truth_wxyz: turned.map(|turned| turned.truth_wxyz),
            }
        })
        .collect();
    let orientation = turned.as_ref().map(|turned| {
        let angles: Vec<f64> = turned.labels.iter().flatten().map(|label| length(label.turn_rad)).collect();
        let square = angles.iter().map(|angle| angle * angle).sum::<f64>();
        let rms_rad = (square / angles.len().max(1) as f64).sqrt();
        OrientationReport { pairs: angles.len(), mounting: turned.mounting, is_known: options.mounting_known, rms_rad }
    });
    let count = |reason: Reason| drops.fates.iter().filter(|fate| **fate == Some(reason)).count();
    let labels: Vec<[f64; 3]> = pairs.iter().map(|pair| pair.label_m).collect();
    let report = Report {
        frames: truth.t_s.len(),
        pairs: pairs.len(),
        dropped: Reason::ALL.into_iter().map(|reason| Dropped { reason, frames: count(reason) }).collect(),
        motion,
        clock: clock(aligned),
        registration: registration(&aligned.fit, aligned.free.rigid),
        label: label(&labels, drops.noise_sd_m),
        orientation,
        notes: notes(aligned, &motion, turned.is_some() && !options.mounting_known),
    };
    Paired { pairs, fates: drops.fates, clock: aligned.fit.clock, registration: rigid, report }
}
