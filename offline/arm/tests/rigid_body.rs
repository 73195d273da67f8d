//! RAVEN-II's rigid body against the simulator's own numbers (`dynamics.csv`), against its closed form, and the green arm
//! against the gold one.
#![allow(missing_docs)]

mod common;

use arm::plant::{ClosedForm, Term};
use arm::serial::{SerialArm, Workspace};
use arm::{Raven2, Side};
use common::{Random, Worst, table, vectors};

fn gold() -> SerialArm {
    Raven2::nominal().rigid_body(Side::Gold)
}

/// theta of the Denavit-Hartenberg table to joint positions.
fn joints(theta: [f64; 3]) -> [f64; 3] {
    let offset = Raven2::nominal().plant().kinematics.gold.theta_offset_deg;
    [theta[0] - offset[0].to_radians(), theta[1] - offset[1].to_radians(), theta[2]]
}

#[test]
fn dynamics_match_the_published_simulator() {
    let Some(table) = table(&vectors().join("dynamics.csv")) else { return };
    assert!(table.rows() >= 240, "{} rows", table.rows());
    let (arm, mut ws) = (gold(), Workspace::new(&gold()));
    let mut worst: [Worst; 4] = Default::default();
    for row in 0..table.rows() {
        let read = |names: [&str; 3]| names.map(|name| table.number(row, name));
        let q = joints(read(["theta_1_rad", "theta_2_rad", "d_3_m"]));
        let qd = read(["thetad_1_rad_s", "thetad_2_rad_s", "dd_3_m_s"]);
        let tau = read(["tau_1_nm", "tau_2_nm", "f_3_n"]);
        let (mut qdd, mut m, mut bias, mut g, mut c) = ([0.0; 3], [0.0; 9], [0.0; 3], [0.0; 3], [0.0; 3]);
        arm.forward_dynamics(&mut ws, &q, &qd, &tau, &mut qdd).expect("positive definite");
        arm.mass_matrix_and_bias(&mut ws, &q, &qd, &mut m, &mut bias);
        arm.gravity(&mut ws, &q, &mut g);
        arm.coriolis_torque(&mut ws, &q, &qd, &mut c);
        let expected_m = ["m11", "m12", "m13", "m12", "m22", "m23", "m13", "m23", "m33"].map(|name| table.number(row, name));
        let expected_g = read(["g_1_nm", "g_2_nm", "g_3_n"]);
        let expected_c = read(["c_1_nm", "c_2_nm", "c_3_n"]);
        worst[0].see_all(&qdd, &read(["thetadd_1_rad_s2", "thetadd_2_rad_s2", "ddd_3_m_s2"]));
        worst[1].see_all(&m, &expected_m);
        worst[2].see_all(&g, &expected_g);
        worst[3].see_all(&c, &expected_c);
        assert!((0..3).all(|i| (bias[i] - g[i] - c[i]).abs() < 1e-14));
    }
    let [qdd, m, g, c] = worst.map(|worst| worst.0);
    println!("dynamics: accelerations {qdd:e}, M {m:e}, g {g:e}, c {c:e}");
    assert!(qdd < 1e-7 && m < 1e-8 && g < 1e-8 && c < 1e-8);
}

/// Value of a sum of monomials in `s1 c1 s2 c2 d`, for example `-0.8·c2*d^2`.
fn polynomial(terms: &[Term], theta_1: f64, theta_2: f64, d: f64) -> f64 {
    let factor = |name: &str| match name {
        "1" => 1.0,
        "s1" => theta_1.sin(),
        "c1" => theta_1.cos(),
        "s2" => theta_2.sin(),
        "c2" => theta_2.cos(),
        "d" => d,
        "c2^2" => theta_2.cos().powi(2),
        "d^2" => d * d,
        other => panic!("{other}"),
    };
    terms.iter().map(|Term(coefficient, monomial)| coefficient * monomial.split('*').map(factor).product::<f64>()).sum()
}

#[test]
fn mass_matrix_and_gravity_match_the_closed_form() {
    let form: &ClosedForm = &Raven2::nominal().plant().dynamics.closed_form;
    let (arm, mut ws, mut random) = (gold(), Workspace::new(&gold()), Random::new(61));
    let (mut worst_m, mut worst_g) = (Worst::default(), Worst::default());
    for _ in 0..2000 {
        let theta = [random.within(-3.2, 3.2), random.within(-3.2, 3.2), random.within(0.1, 0.6)];
        let value = |terms: &[Term]| polynomial(terms, theta[0], theta[1], theta[2]);
        let (mut m, mut g) = ([0.0; 9], [0.0; 3]);
        arm.mass_matrix(&mut ws, &joints(theta), &mut m);
        arm.gravity(&mut ws, &joints(theta), &mut g);
        let [m12, m13, m23] = [&form.m12, &form.m13, &form.m23].map(|terms| value(terms));
        worst_m.see_all(&m, &[value(&form.m11), m12, m13, m12, value(&form.m22), m23, m13, m23, value(&form.m33)]);
        worst_g.see_all(&g, &[value(&form.g1), value(&form.g2), value(&form.g3)]);
    }
    println!("closed form: M {:e}, g {:e}", worst_m.0, worst_g.0);
    assert!(worst_m.0 < 1e-8 && worst_g.0 < 1e-8);
}

#[test]
fn both_arms_accelerate_alike_at_equal_joints() {
    let arms = Side::ALL.map(|side| Raven2::nominal().rigid_body(side));
    let (mut ws, mut random, mut worst) = (Workspace::new(&arms[0]), Random::new(62), Worst::default());
    for _ in 0..2000 {
        let q = [random.within(0.0, 1.6), random.within(0.7, 2.4), random.within(0.2, 0.6)];
        let qd = [random.signed(2.0), random.signed(2.0), random.signed(0.3)];
        let tau = [random.signed(5.0), random.signed(5.0), random.signed(5.0)];
        let [a, b] = [0, 1].map(|i| {
            let mut qdd = [0.0; 3];
            arms[i].forward_dynamics(&mut ws, &q, &qd, &tau, &mut qdd).expect("positive definite");
            qdd
        });
        worst.see_all(&a, &b);
    }
    println!("gold and green accelerations differ by {:e}", worst.0);
    assert!(worst.0 < 1e-11);
}

#[test]
fn tips_are_those_of_the_kinematics() {
    for side in Side::ALL {
        let (rigid, axes) = (Raven2::nominal().rigid_body(side), Raven2::nominal().six_axes(side));
        let kinematics = Raven2::nominal().arm(side).kinematics;
        let (mut ws, mut six, mut random) = (Workspace::new(&rigid), Workspace::new(&axes), Random::new(63));
        for _ in 0..200 {
            let j: [f64; 7] = std::array::from_fn(|_| random.signed(1.5));
            let straight = [j[0], j[1], j[2], 0.0, 0.0, 0.0, 0.0];
            let yaw = (j[6] - j[5]) / 2.0;
            let difference = rigid.tip(&mut ws, &j[..3]).to_homogeneous() - kinematics.tip(&straight).to_homogeneous();
            assert!(difference.amax() < 1e-15);
            let turned = axes.tip(&mut six, &[j[0], j[1], j[2], j[3], j[4], yaw]);
            assert!((turned.to_homogeneous() - kinematics.tip(&j).to_homogeneous()).amax() < 1e-15);
            let frames = kinematics.frames(&j);
            assert!(six.frames().iter().zip(&frames).all(|(a, b)| (a.to_homogeneous() - b.to_homogeneous()).amax() < 1e-15));
        }
        let wrist = rigid.tools().iter().position(|tool| tool.name == "wrist").expect("wrist");
        assert!((rigid.tools()[wrist].pose.translation.vector.z + 0.47).abs() < 1e-15);
    }
}
