//! Pose of the end effector from the three balls round it.

use crate::least_squares::minimise;
use crate::plane_pose::moved;
use crate::simplex;
use crate::triangulate::{Bearing, Located, whitened};
use nalgebra::{DVector, Isometry3, Matrix3, Matrix6, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A pose and how well it is known.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// End effector's frame to the world's.
    pub pose: Isometry3<f64>,
    /// Of rotation vector (rad) and position (m).
    pub covariance: Matrix6<f64>,
    /// Sum of squares of the normalised residuals.
    pub chi_square: f64,
}

/// Rotation and shift that bring the fixture's balls nearest to measured ones, in closed form (Kabsch; Umeyama, 1991).
pub fn closed_form(fixture_m: &[Vector3<f64>; 3], balls_m: &[Point3<f64>; 3]) -> Option<Isometry3<f64>> {
    let from = fixture_m.iter().sum::<Vector3<f64>>() / 3.0;
    let to = balls_m.iter().map(|ball| ball.coords).sum::<Vector3<f64>>() / 3.0;
    let spread: Matrix3<f64> =
        fixture_m.iter().zip(balls_m).map(|(f, b)| (b.coords - to) * (f - from).transpose()).sum::<Matrix3<f64>>();
    let svd = spread.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u * v_t).determinant().signum();
    // Singular values are in falling order in nalgebra: the last one is the normal of the balls' plane.
    let rotation = u * signs * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let shift = to - rotation * from;
    (shift.iter().all(|v| v.is_finite()) && spread.norm() > 1e-12)
        .then(|| Isometry3::from_parts(Translation3::from(shift), rotation))
}

/// The paper's cost (7): sum of the distances between measured balls and those of an assumed pose, m.
pub fn paper_cost_m(fixture_m: &[Vector3<f64>; 3], balls_m: &[Point3<f64>; 3], pose: &Isometry3<f64>) -> f64 {
    fixture_m.iter().zip(balls_m).map(|(f, b)| (pose * Point3::from(*f) - b).norm()).sum()
}

/// Least paper cost by Nelder and Mead's simplex, begun at the closed form.
pub fn by_simplex(fixture_m: &[Vector3<f64>; 3], balls_m: &[Point3<f64>; 3]) -> Option<Isometry3<f64>> {
    let first = closed_form(fixture_m, balls_m)?;
    let cost = |x: &[f64; 6]| paper_cost_m(fixture_m, balls_m, &moved(&first, x));
    let best = simplex::minimise([0.0; 6], [0.02, 0.02, 0.02, 0.5e-3, 0.5e-3, 0.5e-3], 2000, 1e-10, cost);
    Some(moved(&first, &best))
}

/// Levenberg-Marquardt on located balls, weighted by their covariances.
pub fn refined(fixture_m: &[Vector3<f64>; 3], balls: &[Located; 3], first: &Isometry3<f64>) -> Option<Fitted> {
    let mut factors = Vec::new();
    for ball in balls {
        factors.push(ball.covariance.cholesky()?.l());
    }
    let residuals = |x: &DVector<f64>| {
        let pose = moved(first, x.as_slice());
        let mut all = DVector::zeros(9);
        for k in 0..3 {
            let off = pose * Point3::from(fixture_m[k]) - balls[k].point_m;
            all.fixed_rows_mut::<3>(3 * k).copy_from(&factors[k].solve_lower_triangular(&off)?);
        }
        Some(all)
    };
    fitted(first, residuals)
}

/// Levenberg-Marquardt on all bearings of all balls at once: balls that two cameras see still help by their known distances.
pub fn from_bearings(fixture_m: &[Vector3<f64>; 3], bearings: &[Vec<Bearing>; 3], first: &Isometry3<f64>) -> Option<Fitted> {
    let count: usize = bearings.iter().map(Vec::len).sum();
    let residuals = |x: &DVector<f64>| {
        let pose = moved(first, x.as_slice());
        let mut all = Vec::with_capacity(2 * count);
        for (ball, views) in fixture_m.iter().zip(bearings) {
            let at = pose * Point3::from(*ball);
            for bearing in views {
                let (off, _) = whitened(bearing, &at)?;
                all.extend([off.x, off.y]);
            }
        }
        Some(DVector::from_vec(all))
    };
    if count < 4 { None } else { fitted(first, residuals) }
}

fn fitted(first: &Isometry3<f64>, residuals: impl Fn(&DVector<f64>) -> Option<DVector<f64>>) -> Option<Fitted> {
    let steps = DVector::from_row_slice(&[1e-6, 1e-6, 1e-6, 1e-7, 1e-7, 1e-7]);
    let minimum = minimise(DVector::zeros(6), &steps, 50, residuals)?;
    let covariance = minimum.covariance()?;
    Some(Fitted {
        pose: moved(first, minimum.parameters.as_slice()),
        covariance: Matrix6::from_fn(|r, c| covariance[(r, c)]),
        chi_square: minimum.cost(),
    })
}
