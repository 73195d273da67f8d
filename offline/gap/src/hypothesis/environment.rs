//! Contact: a wall, or a steady force.

use std::sync::Arc;

use arm::serial::Workspace;
use nalgebra::{Matrix3, Vector3};

use super::dictionary::Dictionary;
use super::{Bound, Column, Family, product};
use crate::cell::Channel;

/// Places of a wall, as shares of the travel along its normal.
const WALLS: [f64; 5] = [0.5, 0.65, 0.78, 0.88, 0.95];
/// Exponents of its force.
const EXPONENTS: [f64; 2] = [1.0, 1.5];
/// The form of a force that does not change.
pub(crate) const STEADY_FORCE: &str = "steady force";
/// The form of a wall.
pub(crate) const WALL: &str = "wall";
/// First step by which its normal is turned, rad: half of what the directions are apart.
const TURN: f64 = 0.4;

/// Tip and Jacobian (3×N row-major) at the grid rows.
struct Tips {
    rows: Vec<(usize, usize, usize)>,
    first: usize,
    positions: Vec<Vector3<f64>>,
    jacobians: Vec<Vec<f64>>,
}

impl Tips {
    /// Those of a dictionary: the same, or made anew for other runs.
    fn of(self: &Arc<Self>, dictionary: &Dictionary) -> Arc<Self> {
        let same = self.first == std::ptr::from_ref(dictionary.problem.pairs).addr() && self.rows == dictionary.grid;
        if same { self.clone() } else { Arc::new(tips(dictionary)) }
    }

    /// How far the tip goes along a direction, m.
    fn range(&self, normal: &Vector3<f64>) -> (f64, f64) {
        crate::series::range(self.positions.iter().map(|tip| tip.dot(normal)))
    }
}

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    const TORQUE: Channel = Channel::JointTorque;
    if !dictionary.problem.has(TORQUE) {
        return;
    }
    let tips = Arc::new(tips(dictionary));
    let own = tips.clone();
    let axes = felt(&tips);
    let bounds = vec![Bound::Free; axes.len()];
    all.push(
        Family::fixed("external_contact", &[], STEADY_FORCE, TORQUE, &bounds, move |d| {
            let own = own.of(d);
            axes.iter().map(|axis| effort(d, &own, |_| *axis)).collect()
        })
        // A force that never lets go is a weight before it is a contact.
        .penalised(10.0),
    );
    all.push(wall(&tips));
}

/// A wall that the tip is pressed into; its normal is refined from the nearest of [`normals`].
fn wall(tips: &Arc<Tips>) -> Family {
    let mut grid = Vec::new();
    let mut reach: f64 = 0.0;
    for normal in normals() {
        let (low, high) = tips.range(&normal);
        reach = reach.max(high - low);
        let angles = [normal.y.atan2(normal.x), normal.z.asin()];
        let walls = WALLS.map(|share| low + share * (high - low));
        grid.extend(product(&[&walls, &EXPONENTS]).into_iter().map(|start| [start, angles.to_vec()].concat()));
    }
    let own = tips.clone();
    let columns = move |d: &Dictionary, s: &[f64]| {
        let (tips, normal) = (own.of(d), direction(s[2], s[3]));
        // The wall pushes back, against its normal.
        vec![effort(d, &tips, |row| -normal * (tips.positions[row].dot(&normal) - s[0]).max(0.0).powf(s[1]))]
    };
    let own = tips.clone();
    let shape = [("x_0", true), ("p", false), ("azimuth", true), ("elevation", true)];
    let family = Family::shaped("external_contact", &[], WALL, Channel::JointTorque, &[Bound::Positive], &shape, grid, columns);
    family
        .stepped(&[Some(0.1 * reach), None, Some(TURN), Some(TURN)])
        .choosing(&[1])
        // A wall that turns is still as deep as it was where the tip goes deepest.
        .carrying(move |before, after| {
            let deepest = |s: &[f64]| own.range(&direction(s[2], s[3])).1;
            if before[2..] != after[2..] {
                after[0] = deepest(after) - (deepest(before) - before[0]);
            }
        })
        .penalised(4.0)
}

/// Unit vector with an azimuth and an elevation, rad.
pub fn direction(azimuth: f64, elevation: f64) -> Vector3<f64> {
    Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin())
}

fn tips(dictionary: &Dictionary) -> Tips {
    let problem = dictionary.problem;
    let n = dictionary.joints();
    let mut ws = Workspace::new(&problem.robot.arm);
    let mut jacobian = vec![0.0; 6 * n];
    let (mut positions, mut jacobians) = (Vec::new(), Vec::new());
    for &(r, i, _) in &dictionary.grid {
        let q = problem.pairs[r].real.link(i).position;
        positions.push(problem.robot.arm.tip(&mut ws, &q).translation.vector);
        problem.robot.arm.jacobian(&mut ws, &q, &Vector3::zeros(), &mut jacobian);
        jacobians.push(jacobian[..3 * n].to_vec());
    }
    Tips { rows: dictionary.grid.clone(), first: std::ptr::from_ref(problem.pairs).addr(), positions, jacobians }
}

/// A force on the tip asks `-Jᵀ f` of the joints.
fn effort(dictionary: &Dictionary, tips: &Tips, force: impl Fn(usize) -> Vector3<f64>) -> Column {
    let n = dictionary.joints();
    let forces: Vec<Vector3<f64>> = (0..tips.positions.len()).map(force).collect();
    let torque = |j: usize| {
        forces.iter().zip(&tips.jacobians).map(|(f, jacobian)| -(0..3).map(|a| jacobian[a * n + j] * f[a]).sum::<f64>()).collect()
    };
    let torques: Vec<Option<Vec<f64>>> = (0..n).map(|j| Some(torque(j))).collect();
    dictionary.effort(&torques, true)
}

/// Share of the strongest direction's torque that a direction has to ask of the joints to be felt.
const FELT: f64 = 0.02;

/// Directions of a force that the joints feel, each by its own lever: x, y and z, or, of an arm with fewer joints, those at right angles that are not
/// borne by its bearings.
fn felt(tips: &Tips) -> Vec<Vector3<f64>> {
    let n = tips.jacobians.first().map_or(0, |jacobian| jacobian.len() / 3);
    let mut gram = Matrix3::zeros();
    for j in 0..n {
        let mut own = Matrix3::zeros();
        for jacobian in &tips.jacobians {
            own += Matrix3::from_fn(|a, b| jacobian[a * n + j] * jacobian[b * n + j]);
        }
        gram += own / own.trace().max(1e-300);
    }
    let eigen = gram.symmetric_eigen();
    let least = FELT * FELT * eigen.eigenvalues.max();
    let all: Vec<Vector3<f64>> =
        (0..3).filter(|k| eigen.eigenvalues[*k] > least).map(|k| eigen.eigenvectors.column(k).into()).collect();
    if all.len() == 3 { vec![Vector3::x(), Vector3::y(), Vector3::z()] } else { all }
}

/// Directions in which walls are looked for: the six axes and the twelve between two of them.
fn normals() -> Vec<Vector3<f64>> {
    let mut all = Vec::new();
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                let v = Vector3::new(f64::from(x), f64::from(y), f64::from(z));
                if v.norm_squared() > 0.5 && v.norm_squared() < 2.5 {
                    all.push(v.normalize());
                }
            }
        }
    }
    all
}
