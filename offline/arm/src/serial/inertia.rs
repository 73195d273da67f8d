//! Inertia of a link: mass, centre and inertia tensor; the ten numbers in which dynamics is linear; physical consistency.

use nalgebra::{IsometryMatrix3, Matrix3, Matrix4, Vector3};

/// Inertial parameters per link: m, m·c (3), inertia about the link's origin (6).
pub const PARAMETERS: usize = 10;

/// Inertia of a link in the link's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub com_m: Vector3<f64>,
    /// Inertia about the centre of mass, axes parallel to the link's frame, kg·m².
    pub inertia_com_kg_m2: Matrix3<f64>,
}

impl LinkInertia {
    /// No mass, no inertia.
    pub const ZERO: Self =
        Self { mass_kg: 0.0, com_m: Vector3::new(0.0, 0.0, 0.0), inertia_com_kg_m2: Matrix3::from_array_storage(ZEROS) };

    /// A point mass: kg at a point in m.
    pub fn point(mass_kg: f64, point_m: Vector3<f64>) -> Self {
        Self { mass_kg, com_m: point_m, inertia_com_kg_m2: Matrix3::zeros() }
    }

    /// Inertia about the origin of the link's frame, kg·m².
    pub fn inertia_origin_kg_m2(&self) -> Matrix3<f64> {
        self.inertia_com_kg_m2 + steiner(self.mass_kg, &self.com_m)
    }

    /// First moment m·c, kg·m.
    pub fn moment_kg_m(&self) -> Vector3<f64> {
        self.com_m * self.mass_kg
    }

    /// The ten parameters `[m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz]`, inertia about the link's origin: the order of
    /// [`SerialArm::regressor`](super::SerialArm::regressor), and of Pinocchio.
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        let (h, i) = (self.moment_kg_m(), self.inertia_origin_kg_m2());
        [self.mass_kg, h.x, h.y, h.z, i[(0, 0)], i[(0, 1)], i[(1, 1)], i[(0, 2)], i[(1, 2)], i[(2, 2)]]
    }

    /// The inverse of [`Self::parameters`]. A link without mass keeps its inertia, and its centre is the origin.
    pub fn from_parameters(parameters: &[f64; PARAMETERS]) -> Self {
        let [mass_kg, hx, hy, hz, xx, xy, yy, xz, yz, zz] = *parameters;
        let com_m = if mass_kg == 0.0 { Vector3::zeros() } else { Vector3::new(hx, hy, hz) / mass_kg };
        let origin = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Self { mass_kg, com_m, inertia_com_kg_m2: origin - steiner(mass_kg, &com_m) }
    }

    /// Both bodies as one, in the same frame. A negative mass takes a body away again.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg == 0.0 {
            return Self { inertia_com_kg_m2: self.inertia_com_kg_m2 + other.inertia_com_kg_m2, ..Self::ZERO };
        }
        let com_m = (self.moment_kg_m() + other.moment_kg_m()) / mass_kg;
        let about = |part: &Self| part.inertia_com_kg_m2 + steiner(part.mass_kg, &(part.com_m - com_m));
        Self { mass_kg, com_m, inertia_com_kg_m2: about(self) + about(other) }
    }

    /// The same body seen from a frame in which its own frame has `pose`.
    #[must_use]
    pub fn transformed(&self, pose: &IsometryMatrix3<f64>) -> Self {
        let r = pose.rotation.matrix();
        Self {
            mass_kg: self.mass_kg,
            com_m: r * self.com_m + pose.translation.vector,
            inertia_com_kg_m2: r * self.inertia_com_kg_m2 * r.transpose(),
        }
    }

    /// Pseudo-inertia: second moments of the mass about the origin, `[[∫xxᵀ, m·c], [m·cᵀ, m]]` (Wensing, Kim, Slotine 2018).
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let (h, i) = (self.moment_kg_m(), self.inertia_origin_kg_m2());
        let second = Matrix3::identity() * (i.trace() / 2.0) - i;
        let mut pseudo = Matrix4::zeros();
        pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&second);
        pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&h);
        pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&h.transpose());
        pseudo[(3, 3)] = self.mass_kg;
        pseudo
    }

    /// Could a body with mass spread in space have these numbers? True where the pseudo-inertia is positive definite: positive
    /// mass, positive principal moments that keep the triangle inequality. A point, a rod and a plate are the limit and
    /// give false, as do NaN and an asymmetric tensor.
    pub fn is_physically_consistent(&self) -> bool {
        let i = &self.inertia_com_kg_m2;
        let symmetric = (i - i.transpose()).amax() <= 1e-12 * i.amax();
        symmetric && self.pseudo_inertia().cholesky().is_some()
    }

    /// Smallest eigenvalue of the pseudo-inertia: negative where no body has these numbers, 0 at the limit (points, rods, plates).
    pub fn consistency_margin(&self) -> f64 {
        self.pseudo_inertia().symmetric_eigenvalues().min()
    }

    /// Are all numbers finite and the mass not negative?
    pub(super) fn is_usable(&self) -> bool {
        let finite = self.com_m.iter().chain(self.inertia_com_kg_m2.iter()).all(|value| value.is_finite());
        finite && self.mass_kg.is_finite() && self.mass_kg >= 0.0
    }
}

const ZEROS: nalgebra::ArrayStorage<f64, 3, 3> = nalgebra::ArrayStorage([[0.0; 3]; 3]);

/// Inertia about the origin of a point mass at `c`.
fn steiner(mass: f64, c: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * mass
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn brick() -> LinkInertia {
        // 2 kg, sides 0.1, 0.2, 0.3 m, turned and moved.
        let box_inertia = Matrix3::from_diagonal(&(Vector3::new(0.13, 0.10, 0.05) * (2.0 / 12.0)));
        let upright = LinkInertia { mass_kg: 2.0, com_m: Vector3::zeros(), inertia_com_kg_m2: box_inertia };
        let pose = IsometryMatrix3::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.4, 0.5, -0.6));
        upright.transformed(&pose)
    }

    #[test]
    fn parameters_and_back_is_the_identity() {
        let back = LinkInertia::from_parameters(&brick().parameters());
        assert!((back.com_m - brick().com_m).norm() < 1e-15);
        assert!((back.inertia_com_kg_m2 - brick().inertia_com_kg_m2).norm() < 1e-15);
        let rotor = LinkInertia { inertia_com_kg_m2: Matrix3::identity(), ..LinkInertia::ZERO };
        assert_eq!(LinkInertia::from_parameters(&rotor.parameters()), rotor);
    }

    #[test]
    fn parts_add_up_in_any_order_and_come_off_again() {
        let payload = LinkInertia::point(0.25, Vector3::new(0.1, 0.2, -0.3));
        let (a, b) = (brick().plus(&payload), payload.plus(&brick()));
        assert!((a.inertia_com_kg_m2 - b.inertia_com_kg_m2).norm() < 1e-15);
        for (sum, (one, two)) in a.parameters().iter().zip(brick().parameters().iter().zip(payload.parameters())) {
            assert!((sum - one - two).abs() < 1e-15);
        }
        let off = a.plus(&LinkInertia::point(-0.25, payload.com_m));
        assert!((off.inertia_com_kg_m2 - brick().inertia_com_kg_m2).norm() < 1e-14);
        assert_eq!(payload.plus(&LinkInertia::point(-0.25, payload.com_m)), LinkInertia::ZERO);
    }

    #[test]
    fn a_transform_and_its_inverse_cancel() {
        let pose = IsometryMatrix3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), Rotation3::from_euler_angles(0.1, 0.2, 0.3));
        let back = brick().transformed(&pose).transformed(&pose.inverse());
        assert!((back.com_m - brick().com_m).norm() < 1e-14);
        assert!((back.inertia_com_kg_m2 - brick().inertia_com_kg_m2).norm() < 1e-14);
    }

    #[test]
    fn only_bodies_that_can_exist_are_consistent() {
        assert!(brick().is_physically_consistent() && brick().consistency_margin() > 0.0);
        assert!(!LinkInertia::point(1.0, Vector3::x()).is_physically_consistent());
        // Moments 1, 1, 3 break the triangle inequality although the tensor is positive definite.
        let impossible = LinkInertia { inertia_com_kg_m2: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 3.0)), ..brick() };
        assert!(!impossible.is_physically_consistent() && impossible.consistency_margin() < 0.0);
        assert!(!LinkInertia { mass_kg: -1.0, ..brick() }.is_physically_consistent());
        assert!(!LinkInertia { mass_kg: f64::NAN, ..brick() }.is_physically_consistent());
        let mut skewed = brick();
        skewed.inertia_com_kg_m2[(0, 1)] += 1e-3;
        assert!(!skewed.is_physically_consistent());
    }
}
