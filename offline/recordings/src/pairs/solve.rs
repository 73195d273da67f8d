//! Offset, drift and registration together: Gauss-Newton with Tukey's biweight on the length of the residual
//! r = R (p - c) + m - x(t + offset + drift (t - t_ref)), where x is the reported position over the state's clock.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};

use super::hac;
use super::rigid::{self, BIWEIGHT, Registered, biweight};
use super::track::{Clock, Frame, Place, Track};

/// Offset, drift, rotation about the three axes of frame 0, image of the centre.
pub(super) const PARAMETERS: usize = 8;
type Vector = SVector<f64, PARAMETERS>;
type Mask = [bool; PARAMETERS];
type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Which parameters are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Free {
    pub(super) clock: bool,
    pub(super) drift: bool,
    pub(super) rigid: bool,
}

impl Free {
    fn mask(self) -> Mask {
        std::array::from_fn(|i| match i {
            0 => self.clock,
            1 => self.drift,
            _ => self.rigid,
        })
    }

    fn count(self) -> usize {
        self.mask().into_iter().filter(|free| *free).count()
    }
}

/// The points to be matched: true ones with the reported ones over time, or with fixed ones.
pub(super) enum Problem<'a> {
    /// Reported positions are looked up at the clock's time.
    Tracked { track: &'a Track<'a>, frames: &'a [Frame], half_s: f64 },
    /// Reported positions are given.
    Fixed { points: &'a [Vector3<f64>], targets: &'a [Vector3<f64>] },
}

/// A true position with the reported one and its velocity.
struct Matched {
    /// Which of the frames.
    frame: usize,
    t_s: f64,
    point: Vector3<f64>,
    target: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl<'a> Problem<'a> {
    pub(super) fn tracked(track: &'a Track<'a>, frames: &'a [Frame]) -> Self {
        Self::Tracked { track, frames, half_s: (2.0 * track.interval_s()).max(0.005) }
    }

    pub(super) fn fixed(points: &'a [Vector3<f64>], targets: &'a [Vector3<f64>]) -> Self {
        Self::Fixed { points, targets }
    }

    fn at(&self, clock: &Clock) -> Vec<Matched> {
        match self {
            Self::Fixed { points, targets } => points
                .iter()
                .zip(*targets)
                .enumerate()
                .map(|(frame, (point, target))| Matched {
                    frame,
                    t_s: 0.0,
                    point: *point,
                    target: *target,
                    velocity: Vector3::zeros(),
                })
                .collect(),
            Self::Tracked { track, frames, half_s } => {
                let mut place = Place::default();
                let found = |(index, frame): (usize, &Frame)| {
                    let (target, velocity) = track.moving_at(clock.state_time_s(frame.t_s), *half_s, &mut place)?;
                    Some(Matched { frame: index, t_s: frame.t_s, point: frame.position_m, target, velocity })
                };
                frames.iter().enumerate().filter_map(found).collect()
            }
        }
    }

    /// True and reported positions at a clock.
    pub(super) fn matched(&self, clock: &Clock) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        self.at(clock).into_iter().map(|matched| (matched.point, matched.target)).unzip()
    }
}

/// A solution with what it leaves.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) clock: Clock,
    pub(super) place: Registered,
    /// Registered truth minus reported, m, of every point, with its weight.
    pub(super) residuals: Vec<(Vector3<f64>, f64)>,
    /// Reported positions of the same points, m.
    targets: Vec<Vector3<f64>>,
    /// Which of the frames the points are, rising.
    frames: Vec<usize>,
    covariance: Matrix,
}

/// Solves from a start. Everything that cannot be told comes back with an infinite standard error, never as a failure.
pub(super) fn solve(problem: &Problem<'_>, clock: Clock, start: Registered, free: Free) -> Fit {
    let mask = free.mask();
    let (mut clock, mut place) = (clock, start);
    let mut scale_m = None;
    for iteration in 0..40 {
        let matched = problem.at(&clock);
        let residuals: Vec<Vector3<f64>> = matched.iter().map(|m| place.apply(&m.point) - m.target).collect();
        // The scale settles first: a scale that goes on changing keeps the rest from converging.
        let sd = match scale_m {
            Some(sd) if iteration >= 10 => sd,
            _ => rigid::scale(&mut residuals.iter().map(Vector3::norm).collect::<Vec<_>>()),
        };
        scale_m = Some(sd);
        let (mut normal, mut gradient) = (Matrix::zeros(), Vector::zeros());
        for (m, r) in matched.iter().zip(&residuals) {
            let weight = biweight(r.norm() / sd);
            if weight > 0.0 {
                let jacobian = jacobian(m, &place, clock.reference_s, mask);
                normal += jacobian.transpose() * jacobian * weight;
                gradient += jacobian.transpose() * r * weight;
            }
        }
        let Some(step) = solved(&normal, &gradient, mask) else { break };
        clock.offset_s -= step[0];
        clock.drift -= step[1];
        place.rotation = Rotation3::new(-Vector3::new(step[2], step[3], step[4])) * place.rotation;
        place.image_m -= Vector3::new(step[5], step[6], step[7]);
        place.rotation.renormalize();
        let span_s = matched.last().map_or(0.0, |m| (m.t_s - clock.reference_s).abs());
        if iteration > 10 && step[0].abs() + step[1].abs() * span_s < 1e-8 && step.fixed_rows::<3>(2).norm() < 1e-9 {
            break;
        }
    }
    finish(problem, clock, place, free)
}

/// Columns: derivatives of the residual by the parameters; zero for those that are not free.
fn jacobian(m: &Matched, place: &Registered, reference_s: f64, mask: Mask) -> SMatrix<f64, 3, PARAMETERS> {
    let lever = place.rotation * (m.point - place.centre_m);
    let mut jacobian = SMatrix::<f64, 3, PARAMETERS>::zeros();
    jacobian.set_column(0, &-m.velocity);
    jacobian.set_column(1, &(-m.velocity * (m.t_s - reference_s)));
    // d(exp(w) lever)/dw = -[lever]x
    jacobian.fixed_columns_mut::<3>(2).copy_from(&-lever.cross_matrix());
    jacobian.fixed_columns_mut::<3>(5).copy_from(&Matrix3::identity());
    for (i, free) in mask.iter().enumerate() {
        if !free {
            jacobian.fill_column(i, 0.0);
        }
    }
    jacobian
}

/// Inverse of a normal matrix over the free parameters, scaled to ones on the diagonal first; none where it is singular.
fn inverse(normal: &Matrix, mask: Mask) -> Option<Matrix> {
    let mut unit = Vector::from_element(1.0);
    for i in 0..PARAMETERS {
        if mask[i] {
            unit[i] = 1.0 / normal[(i, i)].sqrt();
            // Zero, negative or not a number: the data say nothing of it.
            if !unit[i].is_finite() {
                return None;
            }
        }
    }
    let scaled = Matrix::from_fn(|i, j| match (mask[i] && mask[j], i == j) {
        (true, _) => normal[(i, j)] * unit[i] * unit[j],
        (false, true) => 1.0,
        (false, false) => 0.0,
    });
    let told = scaled.symmetric_eigenvalues().min() > 1e-9;
    let inverse = scaled.cholesky().filter(|_| told)?.inverse();
    Some(Matrix::from_fn(|i, j| if mask[i] && mask[j] { inverse[(i, j)] * unit[i] * unit[j] } else { 0.0 }))
}

fn solved(normal: &Matrix, gradient: &Vector, mask: Mask) -> Option<Vector> {
    inverse(normal, mask).map(|inverse| inverse * gradient).filter(|step| step.iter().all(|value| value.is_finite()))
}

/// Residuals, weights and the covariance of the estimates at the solution.
fn finish(problem: &Problem<'_>, clock: Clock, place: Registered, free: Free) -> Fit {
    let mask = free.mask();
    let matched = problem.at(&clock);
    let residuals: Vec<Vector3<f64>> = matched.iter().map(|m| place.apply(&m.point) - m.target).collect();
    let sd = rigid::scale(&mut residuals.iter().map(Vector3::norm).collect::<Vec<_>>());
    let (mut curvature, mut scores, mut weighted) = (Matrix::zeros(), Vec::with_capacity(matched.len()), Vec::new());
    for (m, r) in matched.iter().zip(&residuals) {
        let u = r.norm() / sd / BIWEIGHT;
        let weight = biweight(r.norm() / sd);
        let jacobian = jacobian(m, &place, clock.reference_s, mask);
        if weight > 0.0 {
            // Derivative of weight(|r|) r by r.
            let bend = -4.0 * (1.0 - u * u) / (BIWEIGHT * sd).powi(2);
            let derivative = Matrix3::identity() * weight + r * r.transpose() * bend;
            curvature += jacobian.transpose() * derivative * jacobian;
        }
        scores.push(jacobian.transpose() * r * weight);
        weighted.push((*r, weight));
    }
    let correction = matched.len() as f64 / (matched.len() as f64 - free.count() as f64 / 3.0).max(1.0);
    let correlation = hac::correlation_samples(&weighted.iter().map(|(r, weight)| r * *weight).collect::<Vec<_>>());
    let covariance = inverse(&curvature, mask).map_or_else(
        || Matrix::from_fn(|i, j| if mask[i] && i == j { f64::INFINITY } else { 0.0 }),
        |inverse| inverse * hac::sum_covariance(&scores, correlation) * inverse.transpose() * correction,
    );
    let (targets, frames) = matched.into_iter().map(|m| (m.target, m.frame)).unzip();
    Fit { clock, place, residuals: weighted, targets, frames, covariance }
}

impl Fit {
    fn sd(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt()
    }

    /// Standard error of the offset at the reference time, s; zero if it was given.
    pub(super) fn offset_sd(&self) -> f64 {
        self.sd(0)
    }

    /// Standard error of the drift, s/s.
    pub(super) fn drift_sd(&self) -> f64 {
        self.sd(1)
    }

    /// Standard errors of the rotation about the axes of frame 0, rad.
    pub(super) fn rotation_sd_rad(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.sd(2 + i))
    }

    /// Standard errors of the centre's image, m.
    pub(super) fn centre_sd_m(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.sd(5 + i))
    }

    /// Residuals that the weights kept.
    pub(super) fn inliers(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.residuals.iter().filter(|(_, weight)| *weight > 0.0).map(|(residual, _)| residual)
    }

    /// RMS length of the residuals of the inliers, m.
    pub(super) fn rms_m(&self) -> f64 {
        let count = self.inliers().count().max(1) as f64;
        (self.inliers().map(Vector3::norm_squared).sum::<f64>() / count).sqrt()
    }

    /// Mean square of the residuals, each capped, m²: the same rule for every solution.
    pub(super) fn loss(&self) -> f64 {
        self.residuals.iter().map(|(residual, _)| capped(residual)).sum::<f64>() / self.residuals.len().max(1) as f64
    }

    /// Share of the variance of the reported positions that the truth explains, inliers only.
    pub(super) fn explained(&self) -> f64 {
        let kept: Vec<Vector3<f64>> =
            self.targets.iter().zip(&self.residuals).filter(|(_, (_, weight))| *weight > 0.0).map(|(target, _)| *target).collect();
        let mean = kept.iter().sum::<Vector3<f64>>() / kept.len().max(1) as f64;
        let variance = kept.iter().map(|target| (target - mean).norm_squared()).sum::<f64>() / kept.len().max(1) as f64;
        // An inlier share below one half means that the weights found a corner that happens to fit.
        let told = kept.len() * 2 >= self.residuals.len() && variance > 0.0;
        if told { 1.0 - self.rms_m().powi(2) / variance } else { 0.0 }
    }

    /// Standard deviations of the reported positions along their principal axes, largest first, m; inliers only.
    pub(super) fn spread_m(&self) -> [f64; 3] {
        let weights: Vec<f64> = self.residuals.iter().map(|(_, weight)| f64::from(u8::from(*weight > 0.0))).collect();
        rigid::principal_deviations(&self.targets, Some(&weights))
    }

    /// Log-likelihood over another solution of the same frames, nats, for as many independent points as the residuals'
    /// correlation leaves. Only frames that both could match count: others would compare different noise.
    pub(super) fn advantage_nats(&self, other: &Self) -> f64 {
        let mut theirs = other.frames.iter().zip(&other.residuals).peekable();
        let (mut common, mut ours, mut loss) = (Vec::new(), 0.0, 0.0);
        for (frame, (residual, _)) in self.frames.iter().zip(&self.residuals) {
            while theirs.peek().is_some_and(|(their, _)| *their < frame) {
                theirs.next();
            }
            if let Some((_, (rival, _))) = theirs.peek().filter(|(their, _)| *their == frame) {
                common.push(*residual);
                ours += capped(residual);
                loss += capped(rival);
            }
        }
        1.5 * common.len() as f64 / hac::correlation_samples(&common) * (loss / ours).ln()
    }
}

/// Square of a residual, m², none counting more than 30 mm: three times the paper's largest error.
fn capped(residual: &Vector3<f64>) -> f64 {
    residual.norm_squared().min(9e-4)
}
