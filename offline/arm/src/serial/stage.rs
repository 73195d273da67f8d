//! What the algorithms read of a body, in a frame of their own: the link's frame turned so that the joint's axis is z. The
//! products with the axis then vanish from every inner loop.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};

use super::{Body, LinkInertia};

/// A body ready to be computed with.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stage {
    pub(super) prismatic: bool,
    /// Rotation at joint position 0: this stage's frame to the one before.
    pub(super) rotation: Matrix3<f64>,
    /// Origin at joint position 0 in the frame of the stage before, m.
    pub(super) position: Vector3<f64>,
    /// This stage's frame to the link's own frame; its z column is the joint's axis.
    pub(super) alignment: Rotation3<f64>,
    pub(super) mass: f64,
    /// First moment m·c, kg·m.
    pub(super) moment: Vector3<f64>,
    /// Inertia about the origin, kg·m².
    pub(super) inertia: Matrix3<f64>,
}

impl Stage {
    /// `before`: alignment of the stage before, or the identity at the base. The body has been checked.
    pub(super) fn new(body: &Body, before: &Rotation3<f64>) -> Self {
        let alignment = alignment(&body.joint.axis.normalize());
        let rotation = before.inverse() * body.placement.rotation * alignment;
        let mut stage = Self {
            prismatic: body.joint.kind.is_prismatic(),
            rotation: *rotation.matrix(),
            position: before.inverse() * body.placement.translation.vector,
            alignment,
            mass: 0.0,
            moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        };
        stage.set_inertia(&body.inertia);
        stage
    }

    /// Takes over the inertia of a link, given in the link's own frame.
    pub(super) fn set_inertia(&mut self, inertia: &LinkInertia) {
        let turned = inertia.transformed(&IsometryMatrix3::from_parts(Vector3::zeros().into(), self.alignment.inverse()));
        self.mass = turned.mass_kg;
        self.moment = turned.moment_kg_m();
        self.inertia = turned.inertia_origin_kg_m2();
    }

    /// Rotation and origin in the frame before, at a joint position.
    #[inline]
    pub(super) fn place(&self, q: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let r = &self.rotation;
        if self.prismatic {
            return (*r, self.position + r.column(2) * q);
        }
        let (s, c) = q.sin_cos();
        let turned = Matrix3::new(
            r.m11 * c + r.m12 * s,
            r.m12 * c - r.m11 * s,
            r.m13,
            r.m21 * c + r.m22 * s,
            r.m22 * c - r.m21 * s,
            r.m23,
            r.m31 * c + r.m32 * s,
            r.m32 * c - r.m31 * s,
            r.m33,
        );
        (turned, self.position)
    }
}

/// A rotation whose z column is `axis`; exact where the axis is z or -z.
fn alignment(axis: &Vector3<f64>) -> Rotation3<f64> {
    if *axis == Vector3::z() {
        return Rotation3::identity();
    }
    if *axis == -Vector3::z() {
        return Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)));
    }
    // The unit vector that is most nearly normal to the axis gives x.
    let x = Vector3::ith(axis.iamin(), 1.0);
    let x = (x - axis * axis.dot(&x)).normalize();
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, axis.cross(&x), *axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alignment_is_a_rotation_whose_z_is_the_axis() {
        for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1e-9, 0.0, -1.0], [0.3, -0.4, 0.5]] {
            let axis = Vector3::from(axis).normalize();
            let r = *alignment(&axis).matrix();
            assert!((r * Vector3::z() - axis).norm() < 1e-15);
            assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-14 && (r.determinant() - 1.0).abs() < 1e-14);
        }
    }
}
