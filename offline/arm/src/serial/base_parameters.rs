//! Base parameters: the combinations of inertial parameters that motion and torque can tell apart.
//!
//! Rank by the singular values of regressors at random states; of the columns, from the base outward, those that do not depend
//! on the ones before, with the rest regrouped onto them (M. Gautier, "Numerical calculation of the base inertial parameters
//! of robots", 1991). Pivoting would condition the choice a little better, but ties make it another one for a mirrored arm.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::{Body, PARAMETERS, SerialArm, Workspace};

/// Random states whose regressors are stacked, per joint of the arm.
const STATES_PER_JOINT: usize = 40;

/// A singular value below this share of the largest, columns scaled to one length, counts as zero. Rounding leaves 1e-15,
/// real parameters of seven-joint arms stay above 1e-4.
const NEGLIGIBLE: f64 = 1e-10;

/// A column whose part beyond the ones before is shorter than this share of itself depends on them.
const DEPENDENT: f64 = 1e-7;

/// Between the last kept and the first dropped singular value there must be this factor.
const CLEAR_GAP: f64 = 1e3;

/// Why an arm has no base parameters.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BaseParametersError {
    /// A regressor is not a number.
    #[error("base parameters: the regressor is not finite; the arm has a joint limit or gravity that is not a number")]
    NotFinite,
    /// No clear rank.
    #[error(
        "base parameters: no clear rank, singular values {kept:e} and {dropped:e} follow each other; the arm nearly \
         degenerates, round its geometry"
    )]
    NoClearRank {
        /// Smallest singular value that would count.
        kept: f64,
        /// Largest that would not.
        dropped: f64,
    },
}

/// Base parameters of an arm with its gravity: `base = grouping · parameters`, `Y · parameters = base_regressor · base`.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseParameters {
    columns: Vec<usize>,
    /// rank × 10N.
    grouping: DMatrix<f64>,
    singular_values: Vec<f64>,
}

impl BaseParameters {
    /// Base parameters of an arm; its inertia does not matter. Allocates; always the same for the same arm.
    ///
    /// # Errors
    /// [`BaseParametersError`] where numbers are not finite or the rank is not clear.
    pub fn new(arm: &SerialArm) -> Result<Self, BaseParametersError> {
        let stacked = stacked_regressors(arm);
        let norms: Vec<f64> = stacked.column_iter().map(|column| column.norm()).collect();
        if norms.iter().any(|norm| !norm.is_finite()) {
            return Err(BaseParametersError::NotFinite);
        }
        let largest = norms.iter().copied().fold(0.0, f64::max);
        // A column that never acts must stay zero; scaling would blow up its rounding.
        let scale: Vec<f64> = norms.iter().map(|&norm| if norm > NEGLIGIBLE * largest { norm } else { 1.0 }).collect();
        let mut scaled = stacked;
        for (mut column, (scale, norm)) in scaled.column_iter_mut().zip(scale.iter().zip(&norms)) {
            if *norm > NEGLIGIBLE * largest { column /= *scale } else { column.fill(0.0) }
        }
        // The triangle has the same column relations as the stack, in fewer rows.
        let r = scaled.qr().r();
        let mut singular_values: Vec<f64> = r.singular_values().iter().copied().collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        let rank = clear_rank(&singular_values)?;
        let Relations { columns, shares } = Relations::of(&r);
        if columns.len() != rank {
            return Err(BaseParametersError::NoClearRank { kept: singular_values[rank - 1], dropped: DEPENDENT });
        }
        let grouping = DMatrix::from_fn(rank, scale.len(), |row, column| {
            let value = shares[(row, column)] * scale[column] / scale[columns[row]];
            if value.abs() < NEGLIGIBLE { 0.0 } else { value }
        });
        Ok(Self { columns, grouping, singular_values })
    }

    /// How many base parameters there are.
    pub fn rank(&self) -> usize {
        self.columns.len()
    }

    /// Indices of the parameters that stand for the groups, rising: 10·link + place in the ten.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// rank × 10N matrix that makes base parameters of all parameters.
    pub fn grouping(&self) -> &DMatrix<f64> {
        &self.grouping
    }

    /// Singular values of the stacked, column-scaled regressors, falling: what the rank was read from.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Base parameters of 10·N parameters.
    ///
    /// # Panics
    /// If `parameters` is not 10·N or `out` not rank long.
    pub fn reduce(&self, parameters: &[f64], out: &mut [f64]) {
        assert!(parameters.len() == self.grouping.ncols() && out.len() == self.rank(), "10 N parameters to {}", self.rank());
        for (row, out) in self.grouping.row_iter().zip(out) {
            *out = row.iter().zip(parameters).map(|(share, parameter)| share * parameter).sum();
        }
    }

    /// Base regressor, N×rank row-major, of a regressor, N×10N row-major.
    ///
    /// # Panics
    /// If the slices do not belong to the same number of joints.
    pub fn regressor(&self, full: &[f64], out: &mut [f64]) {
        let (width, rank) = (self.grouping.ncols(), self.rank());
        assert!(full.len().is_multiple_of(width) && full.len() / width * rank == out.len(), "N 10 N numbers to N {rank}");
        for (row, out) in full.chunks_exact(width).zip(out.chunks_exact_mut(rank)) {
            for (out, &column) in out.iter_mut().zip(&self.columns) {
                *out = row[column];
            }
        }
    }
}

/// Which columns are independent, and every column as a sum of those.
struct Relations {
    columns: Vec<usize>,
    /// One row per independent column.
    shares: DMatrix<f64>,
}

impl Relations {
    /// Gram-Schmidt from left to right, every projection done twice against rounding.
    fn of(matrix: &DMatrix<f64>) -> Self {
        let (mut directions, mut columns): (Vec<DVector<f64>>, Vec<usize>) = (Vec::new(), Vec::new());
        let mut projections = DMatrix::zeros(matrix.ncols(), matrix.ncols());
        for (column, vector) in matrix.column_iter().enumerate() {
            let mut rest = vector.into_owned();
            for _ in 0..2 {
                for (row, direction) in directions.iter().enumerate() {
                    let along = direction.dot(&rest);
                    projections[(row, column)] += along;
                    rest.axpy(-along, direction, 1.0);
                }
            }
            let length = rest.norm();
            if length > DEPENDENT {
                projections[(directions.len(), column)] = length;
                directions.push(rest / length);
                columns.push(column);
            }
        }
        let rank = columns.len();
        let triangle = projections.select_columns(&columns).rows(0, rank).into_owned();
        let mut shares = projections.rows(0, rank).into_owned();
        // The diagonal is longer than DEPENDENT, so this has a solution.
        triangle.solve_upper_triangular_mut(&mut shares);
        Self { columns, shares }
    }
}

/// Singular values that count, if a gap separates them from the rest.
fn clear_rank(falling: &[f64]) -> Result<usize, BaseParametersError> {
    let largest = falling.first().copied().unwrap_or(0.0);
    let rank = falling.iter().take_while(|&&value| value > NEGLIGIBLE * largest).count();
    let (kept, dropped) = (falling[..rank].last().copied().unwrap_or(0.0), falling.get(rank).copied().unwrap_or(0.0));
    if kept > CLEAR_GAP * dropped { Ok(rank) } else { Err(BaseParametersError::NoClearRank { kept, dropped }) }
}

fn stacked_regressors(arm: &SerialArm) -> DMatrix<f64> {
    let n = arm.joint_count();
    let (states, width) = (STATES_PER_JOINT * n, PARAMETERS * n);
    let mut ws = Workspace::new(arm);
    let mut random = Uniform(1);
    let mut y = vec![0.0; n * width];
    let mut stacked = DMatrix::zeros(states * n, width);
    for state in 0..states {
        let q: Vec<f64> = arm.bodies().iter().map(|body| position(body, random.next())).collect();
        let mut signed = |size: f64| -> Vec<f64> { (0..n).map(|_| size * (2.0 * random.next() - 1.0)).collect() };
        let (qd, qdd) = (signed(2.0), signed(5.0));
        arm.regressor(&mut ws, &q, &qd, &qdd, &mut y);
        for (row, values) in y.chunks_exact(width).enumerate() {
            for (column, value) in values.iter().enumerate() {
                stacked[(state * n + row, column)] = *value;
            }
        }
    }
    stacked
}

/// A position inside the limits for a share of the way; a turn or 1 m where there are none.
fn position(body: &Body, share: f64) -> f64 {
    let reach = if body.joint.kind.is_prismatic() { 1.0 } else { PI };
    let limits = &body.joint.limits;
    let lower = if limits.lower.is_finite() { limits.lower } else { limits.upper.min(reach) - 2.0 * reach };
    let upper = if limits.upper.is_finite() { limits.upper } else { lower + 2.0 * reach };
    lower + share * (upper - lower)
}

/// Numbers in [0, 1): `SplitMix64`.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
