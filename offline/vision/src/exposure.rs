//! How long the shutter was open, from how much wider rims are along the motion than across it.
//!
//! An exposure of T smears a rim that moves at v along its normal by vT, which adds (vT)^2 / 12 to the variance of its profile. The
//! image then shows where the ball was in the middle of the exposure, T / 2 after its beginning. Lens, chroma subsampling and light
//! widen rims too, but as functions of their direction and not of speed: per ball and camera they are adjusted away.

use nalgebra::{DMatrix, DVector};

/// Profile width (from half to four fifths of the change) of a Gaussian of unit variance.
const WIDTH_OF_UNIT: f64 = 0.8416;
/// Nuisance terms per ball and camera: mean, two of direction, two of twice the direction.
const TERMS: usize = 5;
/// The slope has to be this many deviations above nothing.
const SIGNIFICANT: f64 = 6.0;
/// A frame whose own slope is this many deviations from the median had another exposure.
const OWN: f64 = 5.0;
/// Variances further than this from their expectation are no rims of one ball, px^2.
const CUT_PX2: f64 = 1.0;

/// The width of a rim at a place.
#[derive(Debug, Clone, Copy)]
pub struct RimWidth {
    /// Index of the frame among those given.
    pub frame: usize,
    /// Index of ball and camera.
    pub group: usize,
    /// Outward normal.
    pub normal: [f32; 2],
    /// From half to four fifths of the change, px.
    pub width_px: f32,
    /// Velocity of the ball in the image along the normal, px/s.
    pub speed_px_s: f32,
}

/// Exposure times of the frames given.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// Of most frames, s.
    pub typical_s: f64,
    /// Standard deviation of it, s.
    pub deviation_s: f64,
    /// Of frames that differ from it beyond doubt, s; by index of the frame.
    pub different_s: Vec<(usize, f64)>,
    /// Mean of the robust cost of the rims' variances, px^4: the motion with the least explains them best.
    pub misfit: f64,
}

/// Exposure out of rim widths; `None` if motion does not widen them beyond doubt.
pub fn estimate(widths: &[RimWidth], frames: usize, groups: usize) -> Option<Exposure> {
    if frames < 3 || widths.len() < 40 * groups.max(1) {
        return None;
    }
    // Speeds are scaled to a typical one, so that all unknowns are of the same size.
    let scale2 = widths.iter().map(|w| f64::from(w.speed_px_s).powi(2)).sum::<f64>() / widths.len() as f64;
    if scale2.is_nan() || scale2 <= 1e-6 {
        return None;
    }
    let (slopes, deviations, misfit) = slopes(widths, frames, groups, scale2)?;
    let mut informed: Vec<usize> = (0..frames).filter(|k| deviations[*k].is_finite()).collect();
    informed.sort_by(|a, b| slopes[*a].total_cmp(&slopes[*b]));
    // The median by weight: frames that stand still say nothing.
    let weight = |k: usize| deviations[k].powi(-2);
    let total: f64 = informed.iter().map(|k| weight(*k)).sum();
    let mut sum = 0.0;
    let middle = *informed.iter().find(|k| {
        sum += weight(**k);
        sum >= 0.5 * total
    })?;
    let median = slopes[middle];
    let scatter =
        (informed.iter().map(|k| weight(*k) * (slopes[*k] - median).abs().min(3.0 * deviations[*k]).powi(2)).sum::<f64>()
            / informed.len() as f64)
            .sqrt()
            .max(1.0);
    let deviation = 1.3 * scatter / total.sqrt();
    let clear = informed.iter().filter(|k| slopes[**k] > 2.0 * deviations[**k]).count();
    if informed.len() < 3 || median < SIGNIFICANT * deviation || 2 * clear < informed.len() {
        return None;
    }
    let seconds = |slope: f64| (12.0 * slope.max(0.0) / scale2).sqrt();
    let typical_s = seconds(median);
    let different_s = informed
        .iter()
        .filter(|k| (slopes[**k] - median).abs() > OWN * deviations[**k].max(0.1 * median))
        .map(|k| (*k, seconds(slopes[*k])))
        .collect();
    Some(Exposure { typical_s, deviation_s: 0.5 * typical_s * deviation / median, different_s, misfit })
}

/// Growth of the rims' variance with the square of the speed, per frame, and its deviation; robust least squares.
fn slopes(widths: &[RimWidth], frames: usize, groups: usize, scale2: f64) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let unknowns = frames + TERMS * groups;
    let mut solution = DVector::<f64>::zeros(unknowns);
    let mut deviations = vec![f64::INFINITY; frames];
    let mut misfit = f64::INFINITY;
    for round in 0..8 {
        // What no rim speaks of stays at nothing.
        let mut normal = DMatrix::<f64>::identity(unknowns, unknowns) * 1e-6;
        let mut right = DVector::<f64>::zeros(unknowns);
        let (mut square, mut weights, mut cost) = (0.0, 0.0, 0.0);
        for width in widths {
            let variance = (f64::from(width.width_px) / WIDTH_OF_UNIT).powi(2);
            let at = frames + TERMS * width.group;
            let [x, y] = width.normal.map(f64::from);
            let row = [
                (width.frame, f64::from(width.speed_px_s).powi(2) / scale2),
                (at, 1.0),
                (at + 1, x),
                (at + 2, y),
                (at + 3, x * x - y * y),
                (at + 4, 2.0 * x * y),
            ];
            let off = variance - row.iter().map(|(k, value)| solution[*k] * value).sum::<f64>();
            let ratio = off / CUT_PX2;
            let weight = match round {
                0 if variance < 5.0 => 1.0,
                0 => 0.0,
                _ if ratio.abs() < 1.0 => (1.0 - ratio * ratio).powi(2),
                _ => 0.0,
            };
            square += weight * off * off;
            weights += weight;
            cost += CUT_PX2 * CUT_PX2 / 6.0 * (1.0 - (1.0 - (ratio * ratio).min(1.0)).powi(3));
            for (i, a) in row {
                right[i] += weight * a * variance;
                for (j, b) in row {
                    normal[(i, j)] += weight * a * b;
                }
            }
        }
        let inverse = normal.cholesky()?.inverse();
        solution = &inverse * right;
        let variance = square / weights.max(1.0);
        misfit = cost / widths.len() as f64;
        for (k, deviation) in deviations.iter_mut().enumerate() {
            // Rim points next to one another share pixels.
            *deviation = (2.0 * variance * inverse[(k, k)]).sqrt();
            if inverse[(k, k)] > 1e4 {
                *deviation = f64::INFINITY;
            }
        }
    }
    Some((solution.rows(0, frames).iter().copied().collect(), deviations, misfit))
}
