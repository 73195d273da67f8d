//! Pose of a camera in front of a plane of known points.

use crate::camera::Intrinsics;
use crate::least_squares::minimise;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point2, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Isometry from the plane's frame into the camera's that best explains where the plane's points (x, y, metres) were seen, and the
/// RMS of what is left, px. `None` without four points in general position.
pub fn plane_pose(intrinsics: &Intrinsics, points_m: &[[f64; 2]], pixels: &[Point2<f64>]) -> Option<(Isometry3<f64>, f64)> {
    let first = from_homography(&homography(intrinsics, points_m, pixels)?)?;
    let steps = DVector::from_vec(vec![1e-6; 6]);
    let residuals = |x: &DVector<f64>| {
        let pose = moved(&first, x.as_slice());
        let mut all = DVector::zeros(2 * points_m.len());
        for (k, (point, pixel)) in points_m.iter().zip(pixels).enumerate() {
            let seen = intrinsics.pixel(&(pose * Vector3::new(point[0], point[1], 0.0) + pose.translation.vector))?;
            all[2 * k] = seen.x - pixel.x;
            all[2 * k + 1] = seen.y - pixel.y;
        }
        Some(all)
    };
    let minimum = minimise(DVector::zeros(6), &steps, 60, residuals)?;
    let rms = (minimum.cost() / (2 * points_m.len()) as f64).sqrt();
    Some((moved(&first, minimum.parameters.as_slice()), rms))
}

/// A pose moved by a small rotation vector (first three) and a translation (last three).
pub fn moved(pose: &Isometry3<f64>, by: &[f64]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
    Isometry3::from_parts(Translation3::from(pose.translation.vector + Vector3::new(by[3], by[4], by[5])), turn * pose.rotation)
}

/// Direct linear transform from the plane to normalised coordinates.
fn homography(intrinsics: &Intrinsics, points_m: &[[f64; 2]], pixels: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    if points_m.len() < 4 {
        return None;
    }
    let scale = points_m.iter().flatten().fold(0.0_f64, |most, v| most.max(v.abs())).max(1e-9);
    let mut system = DMatrix::zeros((2 * points_m.len()).max(9), 9);
    for (k, (point, pixel)) in points_m.iter().zip(pixels).enumerate() {
        let direction = intrinsics.direction(*pixel);
        let (u, v) = (direction.x / direction.z, direction.y / direction.z);
        let (x, y) = (point[0] / scale, point[1] / scale);
        let rows = [[x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y, -u], [0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y, -v]];
        for (r, row) in rows.iter().enumerate() {
            for (c, value) in row.iter().enumerate() {
                system[(2 * k + r, c)] = *value;
            }
        }
    }
    let svd = system.svd(false, true);
    let least = svd.singular_values.imin();
    let rows = svd.v_t?;
    let h = rows.row(least);
    let matrix = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(matrix * Matrix3::from_diagonal(&Vector3::new(1.0 / scale, 1.0 / scale, 1.0)))
}

fn from_homography(h: &Matrix3<f64>) -> Option<Isometry3<f64>> {
    let size = 0.5 * (h.column(0).norm() + h.column(1).norm());
    if size.is_nan() || size <= 1e-12 {
        return None;
    }
    // The plane stands before the camera.
    let scaled = h / (size * h[(2, 2)].signum());
    let (a, b) = (scaled.column(0).into_owned(), scaled.column(1).into_owned());
    let axes = Matrix3::from_columns(&[a, b, a.cross(&b)]);
    let svd = axes.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    if rotation.determinant().is_nan() || rotation.determinant() <= 0.5 {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts(Translation3::from(scaled.column(2).into_owned()), rotation))
}
