//! Coriolis matrix and conservation of energy: what a rigid-body model must keep without torque and friction.
#![allow(missing_docs)]

mod common;

use arm::serial::{SerialArm, Workspace};
use common::each_arm::{each_arm, mass_matrix, shifted};
use common::random_arm::{self, motion};
use common::{Random, Worst};
use nalgebra::{DMatrix, DVector};

#[test]
fn the_coriolis_matrix_belongs_to_the_christoffel_symbols() {
    let (mut torque, mut rate, mut symbol) = (Worst::default(), Worst::default(), Worst::default());
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let mut c = vec![0.0; n * n];
        arm.coriolis(&mut ws, &at.q, &at.qd, &mut c);
        let c = DMatrix::from_row_slice(n, n, &c);
        let mut expected = vec![0.0; n];
        arm.coriolis_torque(&mut ws, &at.q, &at.qd, &mut expected);
        let size = expected.iter().fold(1.0_f64, |size, value| size.max(value.abs()));
        let found = &c * DVector::from_column_slice(&at.qd);
        (0..n).for_each(|i| torque.see((found[i] - expected[i]) / size));
        // dM/dq_k by central differences.
        let h = 1e-5;
        let slopes: Vec<DMatrix<f64>> = (0..n)
            .map(|k| {
                let (a, b) = (mass_matrix(arm, &mut ws, &shifted(&at.q, k, -h)), mass_matrix(arm, &mut ws, &shifted(&at.q, k, h)));
                (b - a) / (2.0 * h)
            })
            .collect();
        let m_dot = slopes.iter().zip(&at.qd).fold(DMatrix::zeros(n, n), |sum, (slope, qd)| sum + slope * *qd);
        rate.see((&m_dot - &c - c.transpose()).amax() / size);
        for i in 0..n {
            for j in 0..n {
                let christoffel: f64 =
                    (0..n).map(|k| (slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)]) / 2.0 * at.qd[k]).sum();
                symbol.see((c[(i, j)] - christoffel) / size);
            }
        }
    });
    println!("C qd {:e}, dM/dt - C - C' {:e}, Christoffel symbols {:e}", torque.0, rate.0, symbol.0);
    assert!(torque.0 < 1e-12 && rate.0 < 1e-8 && symbol.0 < 1e-8);
}

/// One Runge-Kutta step of an arm without torque or friction; the state is q, then qd.
fn step(arm: &SerialArm, ws: &mut Workspace, state: &mut [f64], dt: f64) {
    let n = arm.joint_count();
    let zero = vec![0.0; n];
    let mut slope = |state: &[f64]| {
        let mut out = state[n..].to_vec();
        out.resize(2 * n, 0.0);
        arm.forward_dynamics(ws, &state[..n], &state[n..], &zero, &mut out[n..]).expect("positive definite");
        out
    };
    let along = |state: &[f64], slope: &[f64], dt: f64| -> Vec<f64> { state.iter().zip(slope).map(|(x, k)| x + k * dt).collect() };
    let k1 = slope(state);
    let k2 = slope(&along(state, &k1, dt / 2.0));
    let k3 = slope(&along(state, &k2, dt / 2.0));
    let k4 = slope(&along(state, &k3, dt));
    for (i, x) in state.iter_mut().enumerate() {
        *x += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}

/// Largest change of total energy over 10 s, relative to the largest kinetic energy.
fn energy_drift(arm: &SerialArm, start: &[f64], dt: f64) -> f64 {
    let n = arm.joint_count();
    let mut ws = Workspace::new(arm);
    let mut state = start.to_vec();
    let energies = |ws: &mut Workspace, state: &[f64]| {
        let kinetic = arm.kinetic_energy(ws, &state[..n], &state[n..]);
        (kinetic, kinetic + arm.potential_energy(ws, &state[..n]))
    };
    let (mut largest, first) = energies(&mut ws, &state);
    let mut drift = 0.0_f64;
    for _ in 0..(10.0 / dt).round() as usize {
        step(arm, &mut ws, &mut state, dt);
        let (kinetic, total) = energies(&mut ws, &state);
        largest = largest.max(kinetic);
        drift = drift.max((total - first).abs());
    }
    drift / largest
}

#[test]
fn a_frictionless_arm_keeps_its_energy_for_ten_seconds() {
    // Revolute chains only: a free prismatic joint falls out of every workspace.
    for (seed, joints) in [(1, 2), (2, 3), (3, 4)] {
        let mut random = Random::new(seed);
        let arm = random_arm::revolute(&mut random, joints);
        let start: Vec<f64> = (0..2 * joints).map(|_| random.signed(0.5)).collect();
        let (coarse, fine) = (energy_drift(&arm, &start, 1e-3), energy_drift(&arm, &start, 5e-4));
        println!(
            "seed {seed}, {joints} joints: energy drift {coarse:e} at 1 ms, {fine:e} at 0.5 ms, of the largest kinetic energy"
        );
        assert!(coarse < 1e-6, "seed {seed}");
        // Fourth order: what drifts is the integrator, not the arm.
        assert!(fine < coarse / 8.0 || fine < 1e-11, "seed {seed}");
    }
}
