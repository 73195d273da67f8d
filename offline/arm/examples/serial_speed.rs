//! How long the calls of a simulator's inner loop take: `cargo run --release -p ravenpose-arm --example serial_speed`.
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Instant;

use arm::serial::Workspace;
use arm::{Raven2, Side};

const CALLS: u32 = 200_000;
const ROUNDS: usize = 15;

/// Median over rounds, ns per call.
fn measure(name: &str, mut call: impl FnMut(f64)) {
    let mut rounds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            for k in 0..CALLS {
                call(f64::from(k) * 1e-5);
            }
            start.elapsed().as_nanos() as f64 / f64::from(CALLS)
        })
        .collect();
    rounds.sort_by(f64::total_cmp);
    println!("{name:<32} {:>8.1} ns median, {:>8.1} ns best", rounds[ROUNDS / 2], rounds[0]);
}

fn main() {
    for (name, arm) in
        [("raven2, 3 joints", Raven2::nominal().rigid_body(Side::Gold)), ("raven2, 6 axes", Raven2::nominal().six_axes(Side::Gold))]
    {
        println!("{name}");
        let n = arm.joint_count();
        let mut ws = Workspace::new(&arm);
        let (mut q, qd, mut m, mut out) = (vec![0.4; n], vec![0.3; n], vec![0.0; n * n], vec![0.0; n]);
        let mut jacobian = vec![0.0; 6 * n];
        let at = |q: &mut Vec<f64>, shift: f64| q.iter_mut().for_each(|q| *q = 0.4 + shift);
        measure("  mass_matrix_and_bias", |shift| {
            at(&mut q, shift);
            arm.mass_matrix_and_bias(&mut ws, black_box(&q), black_box(&qd), &mut m, &mut out);
            black_box((&m, &out));
        });
        measure("  mass_matrix", |shift| {
            at(&mut q, shift);
            arm.mass_matrix(&mut ws, black_box(&q), &mut m);
            black_box(&m);
        });
        measure("  bias", |shift| {
            at(&mut q, shift);
            arm.bias(&mut ws, black_box(&q), black_box(&qd), &mut out);
            black_box(&out);
        });
        measure("  tip", |shift| {
            at(&mut q, shift);
            black_box(arm.tip(&mut ws, black_box(&q)));
        });
        measure("  jacobian", |shift| {
            at(&mut q, shift);
            arm.jacobian(&mut ws, black_box(&q), &nalgebra::Vector3::zeros(), &mut jacobian);
            black_box(&jacobian);
        });
        if n == 3 {
            let tau = vec![0.1; n];
            measure("  forward_dynamics", |shift| {
                at(&mut q, shift);
                black_box(arm.forward_dynamics(&mut ws, black_box(&q), &qd, black_box(&tau), &mut out)).ok();
            });
        }
    }
}
