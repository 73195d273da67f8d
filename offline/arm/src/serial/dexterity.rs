//! How well the tip can be moved: singular values of the Jacobian. For reports; allocates.

use nalgebra::{DMatrix, Vector3};

use super::{SerialArm, Workspace};

/// Singular values of the tip's Jacobian at a posture, angular rows scaled to lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Dexterity {
    singular_values: Vec<f64>,
}

impl Dexterity {
    /// Singular values, falling; as many as joints, six at most.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Product of the singular values; for six joints |det J|. 0 where the arm is singular.
    pub fn manipulability(&self) -> f64 {
        self.singular_values.iter().product()
    }

    /// Largest over smallest singular value; infinite where the arm is singular.
    pub fn condition(&self) -> f64 {
        match (self.singular_values.first(), self.singular_values.last()) {
            (Some(largest), Some(smallest)) => largest / smallest,
            _ => f64::NAN,
        }
    }
}

impl SerialArm {
    /// Singular values of the tip's Jacobian, an angle counted as the way of a point at `length_m` from its axis.
    ///
    /// # Panics
    /// If `q` is not N long or the workspace is another arm's.
    pub fn dexterity(&self, ws: &mut Workspace, q: &[f64], length_m: f64) -> Dexterity {
        let n = self.joint_count();
        let mut jacobian = vec![0.0; 6 * n];
        self.jacobian(ws, q, &Vector3::zeros(), &mut jacobian);
        let mut jacobian = DMatrix::from_row_slice(6, n, &jacobian);
        let mut angular = jacobian.rows_mut(3, 3);
        angular *= length_m;
        // The decomposition does not end well on what is no number.
        let finite = jacobian.iter().all(|value| value.is_finite());
        let count = n.min(6);
        let mut values = if finite { jacobian.singular_values().as_slice().to_vec() } else { vec![f64::NAN; count] };
        values.sort_by(|a, b| b.total_cmp(a));
        Dexterity { singular_values: values }
    }
}
