//! No algorithm of `serial` and no inverse kinematics allocates once the workspace exists.
#![allow(missing_docs)]

mod common;

use allocation_counter::measure;
use arm::serial::{LinkInertia, SerialArm, Workspace, Wrench};
use arm::{Raven2, Side};
use common::{Random, random_arm};
use nalgebra::Vector3;

/// Every call once, and everything that may change at run time.
fn everything(arm: &mut SerialArm, ws: &mut Workspace, memory: &mut Memory) {
    let Memory { q, qd, tau, out, square, wide, parameters, jacobian } = memory;
    let wrench = Wrench { force_n: Vector3::x(), torque_nm: Vector3::y(), point_in_tool_m: Vector3::z() };
    let inertia = arm.link_inertia(0);
    arm.add_point_mass(0.1, Vector3::x());
    arm.add_point_mass_at_tip(0.1, Vector3::x());
    arm.set_link_inertia(0, inertia.plus(&LinkInertia::point(0.1, Vector3::y())));
    arm.set_gravity(arm.gravity_vector());
    arm.parameters(parameters);
    arm.set_parameters(parameters);
    arm.forward_kinematics(ws, q);
    arm.tip(ws, q);
    arm.jacobian(ws, q, &Vector3::zeros(), jacobian);
    arm.mass_matrix(ws, q, square);
    arm.bias(ws, q, qd, out);
    arm.mass_matrix_and_bias(ws, q, qd, square, out);
    arm.gravity(ws, q, out);
    arm.coriolis(ws, q, qd, square);
    arm.coriolis_torque(ws, q, qd, out);
    arm.inverse_dynamics(ws, q, qd, tau, Some(&wrench), out);
    arm.forward_dynamics(ws, q, qd, tau, out).expect("positive definite");
    arm.regressor(ws, q, qd, tau, wide);
    out[0] = arm.kinetic_energy(ws, q, qd) + arm.potential_energy(ws, q);
}

struct Memory {
    q: Vec<f64>,
    qd: Vec<f64>,
    tau: Vec<f64>,
    out: Vec<f64>,
    square: Vec<f64>,
    wide: Vec<f64>,
    parameters: Vec<f64>,
    jacobian: Vec<f64>,
}

#[test]
fn no_algorithm_allocates_once_the_workspace_exists() {
    for (seed, joints) in (1..=7).enumerate() {
        let mut arm = random_arm::arm(&mut Random::new(seed as u64), joints);
        let mut ws = Workspace::new(&arm);
        let n = joints;
        let mut memory = Memory {
            q: vec![0.3; n],
            qd: vec![0.2; n],
            tau: vec![0.1; n],
            out: vec![0.0; n],
            square: vec![0.0; n * n],
            wide: vec![0.0; 10 * n * n],
            parameters: vec![0.0; 10 * n],
            jacobian: vec![0.0; 6 * n],
        };
        let counted = measure(|| everything(&mut arm, &mut ws, &mut memory));
        assert_eq!(counted.count_total, 0, "{joints} joints");
    }
}

#[test]
fn inverse_kinematics_allocates_nothing() {
    let gold = Raven2::nominal().arm(Side::Gold);
    let tip = gold.kinematics.tip(gold.limits.home());
    let mut found = 0;
    let counted = measure(|| found = gold.kinematics.inverse(&tip, 0.3, &gold.limits).map_or(0, |solutions| solutions.count()));
    assert_eq!((counted.count_total, found), (0, 8));
    // The counter counts.
    assert!(measure(|| drop(std::hint::black_box(vec![1.0; 9]))).count_total > 0);
}

#[test]
fn a_workspace_can_be_cloned_and_sent() {
    fn check<T: Clone + Send + Sync>() {}
    check::<Workspace>();
    check::<SerialArm>();
}
