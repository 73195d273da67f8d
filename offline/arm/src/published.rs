//! The units and quirks of `raven_state`: slots, micrometres, degrees, and `jac_vel` (ravenstate.md, sections 1 and 2).

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3};

use crate::{JOINTS, Joints, Side};

/// Slots per arm in the message's arrays of 16.
pub const SLOTS: usize = 8;

/// Slot of each joint; slot 3 belongs to none.
pub const SLOT_OF_JOINT: [usize; JOINTS] = [0, 1, 2, 4, 5, 6, 7];

/// Tip position as published: micrometres, truncated toward zero.
pub fn position_um(tip: &IsometryMatrix3<f64>) -> [i32; 3] {
    let position = &tip.translation.vector;
    [position.x, position.y, position.z].map(|metres| (metres * 1e6) as i32)
}

/// Tip rotation as published: row-major.
pub fn rotation_row_major(tip: &IsometryMatrix3<f64>) -> [f32; 9] {
    let matrix = tip.rotation.matrix();
    std::array::from_fn(|i| matrix[(i / 3, i % 3)] as f32)
}

/// The rotation that was published as these nine numbers, row-major; none where they are no rotation to 1e-3, as where none was published.
pub fn rotation(row_major: &[f32; 9]) -> Option<Rotation3<f64>> {
    let matrix = Matrix3::from_row_iterator(row_major.iter().map(|value| f64::from(*value)));
    let off = matrix.transpose() * matrix - Matrix3::identity();
    // Written so that NaN fails; a reflection is no rotation.
    let is_rotation = off.iter().all(|value| value.abs() <= 1e-3) && matrix.determinant() > 0.0;
    is_rotation.then(|| Rotation3::from_matrix_unchecked(matrix))
}

/// One number per joint, as it stands in the eight slots of an arm.
pub fn slots<T: Copy + Default>(joints: &[T; JOINTS]) -> [T; SLOTS] {
    let mut out = [T::default(); SLOTS];
    for (slot, value) in SLOT_OF_JOINT.into_iter().zip(joints) {
        out[slot] = *value;
    }
    out
}

/// Positions or speeds as published: times 180/π in every slot, the prismatic joint 3 included (trap 1).
pub fn degrees(values: &[f64; JOINTS]) -> [f32; SLOTS] {
    slots(&values.map(|value| value.to_degrees() as f32))
}

/// Commanded jaw opening as published, rad: a whole count of mrad over 1000.
pub fn grasp(opening_rad: f64) -> f32 {
    ((opening_rad * 1e3).trunc() / 1e3) as f32
}

/// `jac_vel` as published, which `jac_f` repeats (trap 2): not a tip velocity, but reproducible. `joints` in rad and m,
/// `speeds` as published in rad/s and m/s. The angle of 1 rad in it is the original's own slip.
pub fn jac_vel(side: Side, joints: &Joints, speeds: &Joints) -> [f32; 6] {
    let kappa = match side {
        Side::Gold => -1.0,
        Side::Green => 1.0,
    };
    let (s, c) = 1.0_f64.sin_cos();
    let [_, _, d, q4, q5, q6, _] = *joints;
    let [v1, v2, v3, ..] = *speeds;
    let ((s4, c4), (s5, c5), (s6, c6)) = (q4.sin_cos(), q5.sin_cos(), q6.sin_cos());
    let row_3 = -c * c6 * s5 + s * c4 * c5 * c6 + s * s4 * s6;
    let row_4 = -s * c4 * c5 * s6 + s * c6 * s4;
    let row_5 = s * c4 * s5;
    [
        kappa * s * d * c4 * s6 * v1 + c6 * s5 * v3,
        -s5 * s6 * v3,
        2.0 * v1 - c5 * v3,
        (2.0 + kappa * row_3) * v1 + row_3 * v2,
        kappa * (2.0 * c * s5 * s6 + row_4) * v1 + (c * s5 * s6 + row_4) * v2,
        kappa * (2.0 * c * c5 + row_5) * v1 + (c * c5 + row_5) * v2,
    ]
    .map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_rotation_is_none() {
        let turn = Rotation3::from_euler_angles(0.3, -1.2, 2.5);
        let published = rotation_row_major(&IsometryMatrix3::from_parts(nalgebra::Translation3::identity(), turn));
        let found = rotation(&published).expect("a rotation");
        assert!((found.matrix() - turn.matrix()).amax() < 1e-6, "{found}");
        assert_eq!(rotation(&[0.0; 9]), None, "nothing was published");
        let mut broken = published;
        broken[4] = f32::NAN;
        assert_eq!(rotation(&broken), None);
        assert_eq!(rotation(&published.map(|value| -value)), None, "a reflection");
        assert_eq!(rotation(&published.map(|value| 1.01 * value)), None);
    }
}
