//! Rigid registration of matched points (Kabsch 1976, Umeyama 1991), robust: least median of squares over random triplets
//! (Rousseeuw 1984) finds the majority, reweighting with Tukey's biweight does the rest.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;

use super::track::median;
use super::{Limits, PairError};

/// position in frame 0 = `rotation` · position in the truth's frame + `translation_m`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rigid {
    /// Rows of the rotation matrix, proper and orthonormal.
    pub rotation: [[f64; 3]; 3],
    /// Translation, m.
    pub translation_m: [f64; 3],
}

const ROTATION_TOLERANCE: f64 = 1e-4;

impl Rigid {
    /// The truth is in frame 0 already.
    pub const IDENTITY: Self = Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation_m: [0.0; 3] };

    /// Brings a position, m, into frame 0.
    pub fn apply(&self, position_m: [f64; 3]) -> [f64; 3] {
        (self.matrix() * Vector3::from(position_m) + Vector3::from(self.translation_m)).into()
    }

    /// Is the matrix proper and orthonormal, to what four or more kept digits leave? Not if anything in it is no number.
    pub fn is_rotation(&self) -> bool {
        let matrix = self.matrix();
        let off = matrix * matrix.transpose() - Matrix3::identity();
        off.iter().all(|part| part.abs() <= ROTATION_TOLERANCE) && matrix.determinant() > 0.0
    }

    pub(super) fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.rotation[row][column])
    }

    pub(super) fn new(rotation: &Matrix3<f64>, translation_m: Vector3<f64>) -> Self {
        let row = |row: usize| std::array::from_fn(|column| rotation[(row, column)]);
        Self { rotation: [row(0), row(1), row(2)], translation_m: translation_m.into() }
    }
}

/// A transform about a centre: frame-0 position = `rotation` · (p - `centre_m`) + `image_m`. The centre is that of the points,
/// so that rotation and translation are uncorrelated.
#[derive(Debug, Clone)]
pub(super) struct Registered {
    pub(super) rotation: Rotation3<f64>,
    pub(super) centre_m: Vector3<f64>,
    pub(super) image_m: Vector3<f64>,
}

impl Registered {
    pub(super) fn known(rigid: &Rigid, points: &[Vector3<f64>]) -> Self {
        let rotation = Rotation3::from_matrix_unchecked(rigid.matrix());
        let centre_m = mean(points);
        Self { rotation, centre_m, image_m: rotation * centre_m + Vector3::from(rigid.translation_m) }
    }

    pub(super) fn apply(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * (point - self.centre_m) + self.image_m
    }

    pub(super) fn rigid(&self) -> Rigid {
        Rigid::new(self.rotation.matrix(), self.image_m - self.rotation * self.centre_m)
    }
}

/// Tukey's constant for 95 % efficiency with three-dimensional normal residuals, from the asymptotic variance of the location
/// (in one dimension the same gives the well-known 4.685).
pub(super) const BIWEIGHT: f64 = 5.49;

/// Median length of a three-dimensional standard normal vector: square root of the median of chi-square with 3 degrees.
pub(super) const MEDIAN_LENGTH_3: f64 = 1.5382;

/// Weight of a residual of this length, in units of the standard deviation per axis.
pub(super) fn biweight(length: f64) -> f64 {
    let u = length / BIWEIGHT;
    if u < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
}

/// Standard deviation per axis of residual vectors, from their median length.
pub(super) fn scale(lengths: &mut [f64]) -> f64 {
    (median(lengths).unwrap_or(0.0) / MEDIAN_LENGTH_3).max(1e-9)
}

/// Random triplets that are tried. With 30 % of outliers a triplet is clean with probability 0.34.
const TRIPLETS: usize = 300;
/// Points that judge a triplet.
const JUDGES: usize = 500;

/// Robust registration.
///
/// # Errors
/// [`PairError::Degenerate`] where the points lie on a line or too close together.
pub(super) fn fit(points: &[Vector3<f64>], targets: &[Vector3<f64>], limits: &Limits) -> Result<Registered, PairError> {
    let spread_m = principal_deviations(targets, None);
    if spread_m[1].is_nan() || spread_m[1] < limits.spread_min_m {
        return Err(PairError::Degenerate { spread_m, spread_min_m: limits.spread_min_m, rotation_sd_rad: f64::INFINITY });
    }
    let mut best = least_median(points, targets);
    let mut lengths: Vec<f64> = Vec::with_capacity(points.len());
    for _ in 0..20 {
        lengths.clear();
        lengths.extend(points.iter().zip(targets).map(|(p, x)| (best.apply(p) - x).norm()));
        let sd = scale(&mut lengths.clone());
        let weights: Vec<f64> = lengths.iter().map(|length| biweight(length / sd)).collect();
        let Some(next) = kabsch(points, targets, &weights) else { break };
        let turned = (next.rotation * best.rotation.inverse()).angle();
        let moved = (next.apply(&next.centre_m) - best.apply(&next.centre_m)).norm();
        best = next;
        if turned < 1e-9 && moved < 1e-9 {
            break;
        }
    }
    Ok(best)
}

/// The triplet's transform with the smallest median residual; without a usable triplet, plain least squares.
fn least_median(points: &[Vector3<f64>], targets: &[Vector3<f64>]) -> Registered {
    let all = vec![1.0; points.len()];
    let plain = kabsch(points, targets, &all).unwrap_or_else(|| Registered {
        rotation: Rotation3::identity(),
        centre_m: mean(points),
        image_m: mean(targets),
    });
    let stride = points.len() / JUDGES + 1;
    let judged = |candidate: &Registered| {
        let mut lengths: Vec<f64> =
            points.iter().zip(targets).step_by(stride).map(|(p, x)| (candidate.apply(p) - x).norm()).collect();
        median(&mut lengths).unwrap_or(f64::INFINITY)
    };
    let mut best = (judged(&plain), plain);
    // A fixed sequence: the same data give the same answer.
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut draw = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((random >> 33) as usize) % points.len()
    };
    for _ in 0..TRIPLETS {
        let chosen = [draw(), draw(), draw()];
        let (three, images) = (chosen.map(|i| points[i]), chosen.map(|i| targets[i]));
        let area = (three[1] - three[0]).cross(&(three[2] - three[0])).norm();
        if area <= 1e-12 {
            continue;
        }
        let Some(candidate) = kabsch(&three, &images, &[1.0; 3]) else { continue };
        let median_m = judged(&candidate);
        if median_m < best.0 {
            best = (median_m, candidate);
        }
    }
    best.1
}

/// Weighted least squares; none where no weight is left.
fn kabsch(points: &[Vector3<f64>], targets: &[Vector3<f64>], weights: &[f64]) -> Option<Registered> {
    let total: f64 = weights.iter().sum();
    if total <= 0.0 {
        return None;
    }
    let weighted = |values: &[Vector3<f64>]| values.iter().zip(weights).map(|(v, w)| v * *w).sum::<Vector3<f64>>() / total;
    let (centre_m, image_m) = (weighted(points), weighted(targets));
    let mut cross = Matrix3::zeros();
    for ((p, x), w) in points.iter().zip(targets).zip(weights) {
        cross += (x - image_m) * (p - centre_m).transpose() * *w;
    }
    let svd = cross.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let handed = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let rotation = Rotation3::from_matrix_unchecked(u * handed * v_t);
    Some(Registered { rotation, centre_m, image_m })
}

fn mean(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

/// Standard deviations along the principal axes, largest first, m; with weights if given.
pub(super) fn principal_deviations(points: &[Vector3<f64>], weights: Option<&[f64]>) -> [f64; 3] {
    let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
    let total: f64 = (0..points.len()).map(weight).sum();
    if total <= 0.0 {
        return [0.0; 3];
    }
    let centre = points.iter().enumerate().map(|(i, p)| p * weight(i)).sum::<Vector3<f64>>() / total;
    let scatter =
        points.iter().enumerate().map(|(i, p)| (p - centre) * (p - centre).transpose() * weight(i)).sum::<Matrix3<f64>>() / total;
    let mut variances: [f64; 3] = scatter.symmetric_eigenvalues().into();
    variances.sort_by(|a, b| b.total_cmp(a));
    variances.map(|variance| variance.max(0.0).sqrt())
}
