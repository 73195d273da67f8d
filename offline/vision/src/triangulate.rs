//! A point from the rays of several cameras.

use crate::camera::Camera;
use crate::edge::crosswise;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Point3, Unit, Vector2, Vector3};

/// A ray in the world.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Where it begins.
    pub origin_m: Point3<f64>,
    /// Where it goes.
    pub direction: Unit<Vector3<f64>>,
}

/// A direction that a camera measured, with its covariance along both [`crosswise`] directions of it in the camera's frame, rad^2.
#[derive(Debug, Clone)]
pub struct Bearing<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// Direction in its frame.
    pub axis: Unit<Vector3<f64>>,
    /// Of the direction.
    pub covariance: Matrix2<f64>,
}

/// A point and how well it is known.
#[derive(Debug, Clone, Copy)]
pub struct Located {
    /// Place.
    pub point_m: Point3<f64>,
    /// Of the place, m^2.
    pub covariance: Matrix3<f64>,
    /// Sum of squares of the normalised residuals.
    pub chi_square: f64,
}

/// Middle of the common perpendicular of two rays; `None` if they are parallel or meet behind a camera.
pub fn midpoint(a: &Ray, b: &Ray) -> Option<Point3<f64>> {
    let between = b.origin_m - a.origin_m;
    let cosine = a.direction.dot(&b.direction);
    let sine2 = 1.0 - cosine * cosine;
    if sine2 < 1e-6 {
        return None;
    }
    let (along_a, along_b) = (between.dot(&a.direction), between.dot(&b.direction));
    let s = (along_a - cosine * along_b) / sine2;
    let t = (cosine * along_a - along_b) / sine2;
    if s <= 0.0 || t <= 0.0 {
        return None;
    }
    Some(nalgebra::center(&(a.origin_m + a.direction.into_inner() * s), &(b.origin_m + b.direction.into_inner() * t)))
}

/// The paper's place of a ball: mean of the midpoints of all pairs of rays.
pub fn mean_of_midpoints(rays: &[Ray]) -> Option<Point3<f64>> {
    let mut sum = Vector3::zeros();
    let mut count = 0;
    for (k, a) in rays.iter().enumerate() {
        for b in &rays[k + 1..] {
            if let Some(point) = midpoint(a, b) {
                sum += point.coords;
                count += 1;
            }
        }
    }
    (count > 0).then(|| Point3::from(sum / f64::from(count)))
}

/// Normalised residual of a bearing for a point, whitened, and its derivative.
pub fn whitened(bearing: &Bearing, point_m: &Point3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
    let local = bearing.camera.local(point_m);
    let (a, b) = crosswise(&bearing.axis);
    let depth = local.dot(&bearing.axis);
    if depth <= 1e-6 {
        return None;
    }
    let residual = Vector2::new(local.dot(&a), local.dot(&b)) / depth;
    let rotation = bearing.camera.rotation.matrix();
    let row = |side: &Vector3<f64>, value: f64| ((side - bearing.axis.into_inner() * value) / depth).transpose() * rotation;
    let jacobian = Matrix2x3::from_rows(&[row(&a, residual.x), row(&b, residual.y)]);
    let factor = bearing.covariance.cholesky()?.l();
    let residual = factor.solve_lower_triangular(&residual)?;
    let jacobian = factor.solve_lower_triangular(&jacobian)?;
    Some((residual, jacobian))
}

/// Weighted least squares from a first place; `None` if the rays determine no point before the cameras.
pub fn weighted(bearings: &[Bearing], first_m: Point3<f64>) -> Option<Located> {
    if bearings.len() < 2 {
        return None;
    }
    let mut point_m = first_m;
    for round in 0..20 {
        let (mut normal, mut right, mut chi_square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for bearing in bearings {
            let (residual, jacobian) = whitened(bearing, &point_m)?;
            normal += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * residual;
            chi_square += residual.norm_squared();
        }
        let covariance = normal.try_inverse()?;
        let step = covariance * right;
        point_m -= step;
        if step.norm() < 1e-10 || round == 19 {
            return point_m.iter().all(|v| v.is_finite()).then_some(Located { point_m, covariance, chi_square });
        }
    }
    None
}
