//! Contact: a wall, or a steady force.

use arm::serial::Workspace;
use nalgebra::Vector3;

use super::dictionary::Dictionary;
use super::{Bound, Candidate};
use crate::problem::Channel;

/// Places of a wall, as shares of the travel along its normal.
const WALLS: [f64; 5] = [0.5, 0.65, 0.78, 0.88, 0.95];
/// Exponents of its force.
const EXPONENTS: [f64; 2] = [1.0, 1.5];

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    let n = dictionary.joints();
    let mut ws = Workspace::new(&problem.robot.arm);
    let mut jacobian = vec![0.0; 6 * n];
    let mut tips = Vec::with_capacity(dictionary.grid.len());
    let mut pulls = Vec::with_capacity(dictionary.grid.len());
    for &(r, i, _) in &dictionary.grid {
        let q = problem.pairs[r].real.link(i).position;
        tips.push(problem.robot.arm.tip(&mut ws, &q).translation.vector);
        problem.robot.arm.jacobian(&mut ws, &q, &Vector3::zeros(), &mut jacobian);
        pulls.push(jacobian[..3 * n].to_vec());
    }
    // A force on the tip asks -Jᵀ f of the joints.
    let effort = |force: &dyn Fn(usize) -> Vector3<f64>| {
        let torques: Vec<Option<Vec<f64>>> = (0..n)
            .map(|j| {
                Some((0..tips.len()).map(|row| -(0..3).map(|a| pulls[row][a * n + j] * force(row)[a]).sum::<f64>()).collect())
            })
            .collect();
        dictionary.effort(&torques, true)
    };
    let mut steady = Candidate::new("external_contact", &[], "steady force", Channel::JointTorque);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        steady = steady.with(effort(&|_| axis), Bound::Free);
    }
    all.push(steady);
    for (k, normal) in normals().into_iter().enumerate() {
        let along: Vec<f64> = tips.iter().map(|tip| tip.dot(&normal)).collect();
        let (low, high) = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        for share in WALLS {
            let wall = low + share * (high - low);
            for exponent in EXPONENTS {
                // The wall pushes back, against its normal.
                let column = effort(&|row| -normal * (along[row] - wall).max(0.0).powf(exponent));
                all.push(
                    Candidate::new("external_contact", &[], "wall", Channel::JointTorque)
                        .shaped("normal", k as f64)
                        .shaped("x_0", wall)
                        .shaped("p", exponent)
                        .with(column, Bound::Positive),
                );
            }
        }
    }
}

/// Directions of walls: the six axes and the twelve between two of them.
pub(super) fn normals() -> Vec<Vector3<f64>> {
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
