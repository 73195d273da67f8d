//! What is known only roughly and is nobody's finding: numbers of a built-in model within a lab's belief, constants of a
//! run. Each cell has columns of them, scaled to what is believed; residuals and hypotheses are compared beside them.
//!
//! With `y = N ν + X θ + e`, ν of variance 1 and e of variance s², the rows' inverse covariance is `S = I - U D²/(D²+1) Uᵀ`
//! (over s²), where `N / s = U D Vᵀ`. Its root, applied to residual and columns alike, makes rows that count singly again.

use arm::serial::{PARAMETERS, Workspace};
use nalgebra::{DMatrix, DVector};

use crate::linear::dot;
use crate::motion::Motion;
use crate::nominal::{range, rms, sign_series};
use crate::problem::{Channel, Problem};

/// Columns of one cell, each for one standard deviation of what is believed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Nuisance {
    /// Values at the cell's rows.
    pub columns: Vec<Vec<f64>>,
    /// Is a column a constant of one run, which says nothing of others?
    pub of_run: Vec<bool>,
}

/// Root of the rows' inverse covariance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Projection {
    /// Orthonormal series.
    basis: Vec<Vec<f64>>,
    /// How much of each is taken away.
    taken: Vec<f64>,
}

impl Projection {
    /// From columns (of variance 1) and the size of the noise.
    pub fn new(columns: &[Vec<f64>], noise: f64) -> Self {
        let k = columns.len();
        if k == 0 || noise <= 0.0 {
            return Self::default();
        }
        let eigen = gram(columns).symmetric_eigen();
        let top = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let mut out = Self::default();
        for (i, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > 1e-12 * top) {
            let mut series = vec![0.0; columns[0].len()];
            for (column, weight) in columns.iter().zip(eigen.eigenvectors.column(i).iter()) {
                series.iter_mut().zip(column).for_each(|(s, x)| *s += weight / value.sqrt() * x);
            }
            out.basis.push(series);
            out.taken.push(1.0 - (1.0 + value / (noise * noise)).sqrt().recip());
        }
        out
    }

    /// Applies it.
    pub fn apply(&self, series: &mut [f64]) {
        let along: Vec<f64> = self.basis.iter().map(|u| dot(u, series)).collect();
        for ((u, along), taken) in self.basis.iter().zip(along).zip(&self.taken) {
            series.iter_mut().zip(u).for_each(|(y, u)| *y -= taken * along * u);
        }
    }
}

impl Nuisance {
    /// Likeliest ν for a residual.
    pub fn estimate(&self, residual: &[f64]) -> Vec<f64> {
        let k = self.columns.len();
        let mut gram = gram(&self.columns);
        let mut right = DVector::from_fn(k, |i, _| dot(&self.columns[i], residual));
        // Twice: the noise is what is left.
        let mut noise = rms(residual.iter().copied());
        let whole = (gram.clone(), right.clone());
        for _ in 0..2 {
            (gram, right) = whole.clone();
            // Rows stand close: ten count as one.
            (0..k).for_each(|i| gram[(i, i)] += 10.0 * noise * noise);
            crate::linear::solve(&mut gram, &mut right);
            let told = self.predict(right.as_slice());
            noise = rms(residual.iter().zip(told).map(|(y, p)| y - p));
        }
        right.as_slice().to_vec()
    }

    /// What they add to the cell.
    pub fn predict(&self, nu: &[f64]) -> Vec<f64> {
        let rows = self.columns.first().map_or(0, Vec::len);
        let mut sum = vec![0.0; rows];
        for (column, nu) in self.columns.iter().zip(nu) {
            sum.iter_mut().zip(column).for_each(|(s, x)| *s += nu * x);
        }
        sum
    }

    /// A residual without them.
    #[must_use]
    pub fn without(&self, residual: &[f64]) -> Vec<f64> {
        if self.columns.is_empty() {
            return residual.to_vec();
        }
        residual.iter().zip(self.predict(&self.estimate(residual))).map(|(y, p)| y - p).collect()
    }

    fn push(&mut self, column: Vec<f64>, of_run: bool) {
        if column.iter().any(|x| *x != 0.0) {
            self.columns.push(column);
            self.of_run.push(of_run);
        }
    }
}

/// Shares of a link's own numbers, and distances, within which a lab believes them.
const BELIEF: f64 = 0.3;
const BELIEF_M: f64 = 0.03;

/// Nuisances of every cell of a model that was not learnt from a simulation: inertia of links and rotors, constants.
pub fn believed(problem: &Problem) -> Vec<Nuisance> {
    let robot = problem.robot;
    let n = robot.joint_count();
    let links = PARAMETERS * n;
    let mut all = vec![Nuisance::default(); problem.cells.len()];
    let mut ws = Workspace::new(&robot.arm);
    let mut y = vec![0.0; n * links];
    for j in 0..n {
        let Some(c) = problem.cell(Channel::JointTorque, j) else { continue };
        let cell = &problem.cells[c];
        let mut columns = vec![vec![0.0; cell.rows.len()]; links];
        let (mut acceleration, mut torque) = (Vec::new(), Vec::new());
        for (row, &(r, i)) in cell.rows.iter().enumerate() {
            let motion = &problem.pairs[r].real;
            let state = motion.link(i);
            robot.arm.regressor(&mut ws, &state.position, &state.velocity, &state.acceleration, &mut y);
            for (k, column) in columns.iter_mut().enumerate() {
                column[row] = y[j * links + k];
            }
            acceleration.push(motion.drive_acceleration[j][i]);
            torque.push(motion.torque.as_ref().map_or(0.0, |t| t[j][i]));
        }
        let usual = rms(torque.into_iter());
        for (k, column) in columns.into_iter().enumerate() {
            let own = problem.nominal.inertial[k];
            let mass = problem.nominal.inertial[k / PARAMETERS * PARAMETERS];
            let spread = match k % PARAMETERS {
                0 => BELIEF * mass,
                1..=3 => BELIEF * own.abs() + BELIEF_M * mass,
                _ => own.abs() + 0.02 * mass,
            };
            all[c].push(column.into_iter().map(|x| spread * x).collect(), false);
        }
        let rotor = problem.nominal.drives[j][0];
        let inertia = if rotor > 0.0 { 0.5 * rotor } else { 0.1 * usual / rms(acceleration.iter().copied()).max(1e-12) };
        all[c].push(acceleration.into_iter().map(|a| inertia * a).collect(), false);
        all[c].push(vec![BELIEF * usual; cell.rows.len()], false);
    }
    // What measures the joints stands anew for every run.
    let runs = problem.pairs.len();
    for (c, cell) in problem.cells.iter().enumerate().filter(|(_, cell)| runs > 1 && cell.channel == Channel::Transmission) {
        let size = rms(cell.residual.iter().copied());
        for run in 0..runs {
            let mean = 1.0 / runs as f64;
            let of = |&(r, _): &(usize, usize)| size * (f64::from(u8::from(r == run)) - mean);
            all[c].push(cell.rows.iter().map(of).collect(), true);
        }
    }
    all
}

/// Shares of what was learnt by which friction, rotor and zero point of a drive differ from one day to the next.
const FRICTION_DRIFT: f64 = 0.4;
/// The same, of the usual torque.
const FRICTION_SHARE: f64 = 0.15;
const ZERO_DRIFT: f64 = 0.15;
/// The same of a drive's inertia, of all that it moves.
const INERTIA_DRIFT: f64 = 0.1;

/// Travel over which dry friction may turn round, shares of a joint's travel.
const TURNING: [f64; 3] = [0.003, 0.012, 0.05];

/// Sign of the motion that turns round over a share of the travel, smoothed.
fn turning(motion: &Motion, j: usize, share: f64) -> Vec<f64> {
    let (low, high) = range(motion.position[j].iter().copied());
    motion.window.apply(&motion.bristle(j, false, (share * (high - low)).max(1e-12), 0.0), 0)
}

/// Nuisances of every cell of a model that was learnt from another recording: friction, constants.
pub fn drifting(problem: &Problem) -> Vec<Nuisance> {
    let mut all = vec![Nuisance::default(); problem.cells.len()];
    for j in 0..problem.robot.joint_count() {
        let Some(c) = problem.cell(Channel::JointTorque, j) else { continue };
        let cell = &problem.cells[c];
        let [_, viscous, coulomb, _] = problem.nominal.drives[j];
        let signs: Vec<Vec<f64>> = problem.pairs.iter().map(|pair| sign_series(&pair.real, j)).collect();
        let usual = problem.nominal.usual_torque[j];
        let dry = (FRICTION_DRIFT * coulomb).max(FRICTION_SHARE * usual);
        all[c].push(cell.rows.iter().map(|&(r, i)| dry * signs[r][i]).collect(), false);
        for share in TURNING {
            let turned: Vec<Vec<f64>> = problem.pairs.iter().map(|pair| turning(&pair.real, j, share)).collect();
            all[c].push(cell.rows.iter().map(|&(r, i)| dry * turned[r][i]).collect(), false);
        }
        let velocity: Vec<f64> = cell.rows.iter().map(|&(r, i)| problem.pairs[r].real.drive_velocity[j][i]).collect();
        let wet = (FRICTION_DRIFT * viscous).max(FRICTION_SHARE * usual / rms(velocity.iter().copied()).max(1e-12));
        all[c].push(velocity.into_iter().map(|v| wet * v).collect(), false);
        all[c].push(vec![ZERO_DRIFT * usual; cell.rows.len()], false);
        // An elastic drive at another pace seems to have another inertia.
        let acceleration: Vec<f64> = cell.rows.iter().map(|&(r, i)| problem.pairs[r].real.drive_acceleration[j][i]).collect();
        let inertia = INERTIA_DRIFT * usual / rms(acceleration.iter().copied()).max(1e-12);
        all[c].push(acceleration.into_iter().map(|a| inertia * a).collect(), false);
    }
    all
}

fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let k = columns.len();
    let mut gram = DMatrix::zeros(k, k);
    for a in 0..k {
        for b in 0..=a {
            gram[(a, b)] = dot(&columns[a], &columns[b]);
            gram[(b, a)] = gram[(a, b)];
        }
    }
    gram
}
