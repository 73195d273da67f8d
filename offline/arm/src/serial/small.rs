//! Products of three by three, written out for the inner loop: nothing that a general product would have to find out.

use nalgebra::{Matrix3, Vector3};

/// `r · v`.
#[inline]
pub(super) fn turn(r: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        r.m11 * v.x + r.m12 * v.y + r.m13 * v.z,
        r.m21 * v.x + r.m22 * v.y + r.m23 * v.z,
        r.m31 * v.x + r.m32 * v.y + r.m33 * v.z,
    )
}

/// `rᵀ · v`.
#[inline]
pub(super) fn turn_back(r: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        r.m11 * v.x + r.m21 * v.y + r.m31 * v.z,
        r.m12 * v.x + r.m22 * v.y + r.m32 * v.z,
        r.m13 * v.x + r.m23 * v.y + r.m33 * v.z,
    )
}

/// `a × b`.
#[inline]
pub(super) fn cross(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// `r · s · rᵀ` of a symmetric `s`, symmetric to the last bit.
#[inline]
pub(super) fn turn_tensor(r: &Matrix3<f64>, s: &Matrix3<f64>) -> Matrix3<f64> {
    let row = |x: f64, y: f64, z: f64| {
        [x * s.m11 + y * s.m12 + z * s.m13, x * s.m12 + y * s.m22 + z * s.m23, x * s.m13 + y * s.m23 + z * s.m33]
    };
    let (a, b, c) = (row(r.m11, r.m12, r.m13), row(r.m21, r.m22, r.m23), row(r.m31, r.m32, r.m33));
    let xx = a[0] * r.m11 + a[1] * r.m12 + a[2] * r.m13;
    let xy = a[0] * r.m21 + a[1] * r.m22 + a[2] * r.m23;
    let xz = a[0] * r.m31 + a[1] * r.m32 + a[2] * r.m33;
    let yy = b[0] * r.m21 + b[1] * r.m22 + b[2] * r.m23;
    let yz = b[0] * r.m31 + b[1] * r.m32 + b[2] * r.m33;
    let zz = c[0] * r.m31 + c[1] * r.m32 + c[2] * r.m33;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn the_written_out_products_are_the_products() {
        let r = *Rotation3::from_euler_angles(0.3, -1.2, 2.5).matrix();
        let (a, b) = (Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.5, 0.25, -4.0));
        let s = Matrix3::new(2.0, 0.1, -0.3, 0.1, 3.0, 0.2, -0.3, 0.2, 1.0);
        assert!((turn(&r, &a) - r * a).norm() < 1e-15 && (turn_back(&r, &a) - r.transpose() * a).norm() < 1e-15);
        assert_eq!(cross(&a, &b), a.cross(&b));
        assert!((turn_tensor(&r, &s) - r * s * r.transpose()).norm() < 1e-15);
    }
}
