//! Random arms and RAVEN's, one after the other, and what tests ask of all of them.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use arm::serial::{SerialArm, Workspace, Wrench};
use arm::{Raven2, Side};
use nalgebra::DMatrix;

use super::Random;
use super::random_arm::{self, Motion};

/// One to seven joints, many seeds, and both RAVEN arms.
pub(crate) fn each_arm(mut check: impl FnMut(&str, &SerialArm, &mut Random)) {
    for seed in 0..140 {
        let mut random = Random::new(seed);
        let arm = random_arm::arm(&mut random, 1 + seed as usize % 7);
        check(&format!("seed {seed}"), &arm, &mut random);
    }
    for side in Side::ALL {
        check(side.name(), &Raven2::nominal().rigid_body(side), &mut Random::new(7));
    }
}

pub(crate) fn inverse_dynamics(arm: &SerialArm, ws: &mut Workspace, at: &Motion, wrench: Option<&Wrench>) -> Vec<f64> {
    let mut tau = vec![0.0; arm.joint_count()];
    arm.inverse_dynamics(ws, &at.q, &at.qd, &at.qdd, wrench, &mut tau);
    tau
}

pub(crate) fn mass_matrix(arm: &SerialArm, ws: &mut Workspace, q: &[f64]) -> DMatrix<f64> {
    let n = arm.joint_count();
    let mut m = vec![0.0; n * n];
    arm.mass_matrix(ws, q, &mut m);
    DMatrix::from_row_slice(n, n, &m)
}

/// `q + h e_k`.
pub(crate) fn shifted(q: &[f64], k: usize, h: f64) -> Vec<f64> {
    let mut q = q.to_vec();
    q[k] += h;
    q
}
