//! The algorithms on random serial arms against finite differences, against each other and against conservation laws. Every
//! assertion names its seed.
#![allow(missing_docs)]

mod common;

use arm::serial::{LinkInertia, Workspace, Wrench};
use arm::{Raven2, Side};
use common::Worst;
use common::each_arm::{each_arm, inverse_dynamics, mass_matrix, shifted};
use common::random_arm::motion;
use nalgebra::{DMatrix, Vector3};

#[test]
fn the_jacobian_is_the_derivative_of_the_tip() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let (at, point) = (motion(random, n), random.vector(0.3));
        let mut jacobian = vec![0.0; 6 * n];
        arm.jacobian(&mut ws, &at.q, &point, &mut jacobian);
        let here = arm.tip(&mut ws, &at.q);
        for k in 0..n {
            let h = 1e-5;
            let (a, b) = (arm.tip(&mut ws, &shifted(&at.q, k, -h)), arm.tip(&mut ws, &shifted(&at.q, k, h)));
            let linear = ((b * nalgebra::Point3::from(point)) - (a * nalgebra::Point3::from(point))) / (2.0 * h);
            // dR/dq Rᵀ is the cross matrix of the angular velocity.
            let spin = (b.rotation.matrix() - a.rotation.matrix()) / (2.0 * h) * here.rotation.matrix().transpose();
            let angular = Vector3::new(spin.m32 - spin.m23, spin.m13 - spin.m31, spin.m21 - spin.m12) / 2.0;
            for row in 0..3 {
                worst.see(jacobian[row * n + k] - linear[row]);
                worst.see(jacobian[(row + 3) * n + k] - angular[row]);
            }
        }
    });
    println!("Jacobian and finite differences: {:e}", worst.0);
    assert!(worst.0 < 1e-8);
}

#[test]
fn the_mass_matrix_is_the_hessian_of_kinetic_energy() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let q = motion(random, n).q;
        let m = mass_matrix(arm, &mut ws, &q);
        // Energy is quadratic in the rates, so the polar form is exact.
        let mut energy = |i: usize, j: usize| {
            let mut qd = vec![0.0; n];
            qd[i] += 1.0;
            qd[j] += 1.0;
            arm.kinetic_energy(&mut ws, &q, &qd)
        };
        for i in 0..n {
            for j in 0..n {
                let diagonal = (energy(i, i) + energy(j, j)) / 4.0;
                worst.see((m[(i, j)] - (energy(i, j) - diagonal)) / m.amax());
            }
        }
        assert!(m.clone().cholesky().is_some(), "positive definite");
        assert_eq!(m, m.transpose());
    });
    println!("mass matrix and energy: {:e} of the largest entry", worst.0);
    assert!(worst.0 < 1e-12);
}

#[test]
fn gravity_is_the_gradient_of_potential_energy() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let q = motion(random, n).q;
        let mut g = vec![0.0; n];
        arm.gravity(&mut ws, &q, &mut g);
        for (k, g) in g.iter().enumerate() {
            let h = 1e-4;
            let rise = arm.potential_energy(&mut ws, &shifted(&q, k, h)) - arm.potential_energy(&mut ws, &shifted(&q, k, -h));
            worst.see((g - rise / (2.0 * h)) / 100.0);
        }
    });
    println!("gravity and potential energy: {:e} of 100 N m", worst.0);
    assert!(worst.0 < 1e-8);
}

#[test]
fn inverse_dynamics_is_mass_matrix_times_acceleration_plus_bias() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let tau = inverse_dynamics(arm, &mut ws, &at, None);
        let (mut m, mut bias, mut alone, mut g, mut c) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        arm.mass_matrix_and_bias(&mut ws, &at.q, &at.qd, &mut m, &mut bias);
        arm.bias(&mut ws, &at.q, &at.qd, &mut alone);
        arm.gravity(&mut ws, &at.q, &mut g);
        arm.coriolis_torque(&mut ws, &at.q, &at.qd, &mut c);
        assert_eq!(bias, alone);
        assert_eq!(DMatrix::from_row_slice(n, n, &m), mass_matrix(arm, &mut ws, &at.q));
        let size = tau.iter().fold(1.0_f64, |size, tau| size.max(tau.abs()));
        for i in 0..n {
            let inertial: f64 = (0..n).map(|j| m[i * n + j] * at.qdd[j]).sum();
            worst.see((tau[i] - inertial - bias[i]) / size);
            worst.see((bias[i] - g[i] - c[i]) / size);
        }
    });
    println!("inverse dynamics and M qdd + bias: {:e} of the largest torque", worst.0);
    assert!(worst.0 < 1e-12);
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let tau = inverse_dynamics(arm, &mut ws, &at, None);
        let mut qdd = vec![0.0; n];
        arm.forward_dynamics(&mut ws, &at.q, &at.qd, &tau, &mut qdd).expect("positive definite");
        worst.see_all(&qdd, &at.qdd);
    });
    println!("forward dynamics of inverse dynamics: {:e}", worst.0);
    assert!(worst.0 < 1e-9);
}

#[test]
fn an_external_wrench_acts_through_the_jacobian() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let wrench = Wrench { force_n: random.vector(20.0), torque_nm: random.vector(3.0), point_in_tool_m: random.vector(0.2) };
        let (free, pushed) = (inverse_dynamics(arm, &mut ws, &at, None), inverse_dynamics(arm, &mut ws, &at, Some(&wrench)));
        let mut jacobian = vec![0.0; 6 * n];
        arm.jacobian(&mut ws, &at.q, &wrench.point_in_tool_m, &mut jacobian);
        for k in 0..n {
            let torque: f64 = (0..3)
                .map(|row| jacobian[row * n + k] * wrench.force_n[row] + jacobian[(row + 3) * n + k] * wrench.torque_nm[row])
                .sum();
            worst.see((free[k] - pushed[k] - torque) / 20.0);
        }
    });
    println!("wrench and transposed Jacobian: {:e} of 20 N m", worst.0);
    assert!(worst.0 < 1e-12);
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    let mut worst = Worst::default();
    each_arm(|_, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let (mut y, mut parameters) = (vec![0.0; n * 10 * n], vec![0.0; 10 * n]);
        arm.regressor(&mut ws, &at.q, &at.qd, &at.qdd, &mut y);
        arm.parameters(&mut parameters);
        let tau = inverse_dynamics(arm, &mut ws, &at, None);
        let size = tau.iter().fold(1.0_f64, |size, tau| size.max(tau.abs()));
        for (row, tau) in y.chunks_exact(10 * n).zip(&tau) {
            let found: f64 = row.iter().zip(&parameters).map(|(y, p)| y * p).sum();
            worst.see((found - tau) / size);
        }
        let mut copy = arm.clone();
        copy.set_parameters(&parameters);
        worst.see_all(
            &inverse_dynamics(&copy, &mut ws, &at, None).iter().map(|tau| tau / size).collect::<Vec<_>>(),
            &tau.iter().map(|tau| tau / size).collect::<Vec<_>>(),
        );
    });
    println!("regressor and inverse dynamics: {:e} of the largest torque", worst.0);
    assert!(worst.0 < 1e-12);
}

#[test]
fn payload_and_gravity_change_at_run_time() {
    each_arm(|name, arm, random| {
        let (n, mut ws) = (arm.joint_count(), Workspace::new(arm));
        let at = motion(random, n);
        let (mass, point) = (random.within(0.1, 0.5), random.vector(0.2));
        let mut loaded = arm.clone();
        loaded.add_point_mass_at_tip(mass, point);
        // A point mass is what its weight and inertia do through the Jacobian: check the static part.
        let (mut before, mut after, mut jacobian) = (vec![0.0; n], vec![0.0; n], vec![0.0; 6 * n]);
        arm.gravity(&mut ws, &at.q, &mut before);
        loaded.gravity(&mut ws, &at.q, &mut after);
        arm.jacobian(&mut ws, &at.q, &point, &mut jacobian);
        for k in 0..n {
            let lifted: f64 = (0..3).map(|row| -jacobian[row * n + k] * mass * arm.gravity_vector()[row]).sum();
            assert!((after[k] - before[k] - lifted).abs() < 1e-11, "{name}");
        }
        // M grows by m Jᵀ J.
        let grown = mass_matrix(&loaded, &mut ws, &at.q) - mass_matrix(arm, &mut ws, &at.q);
        let linear = DMatrix::from_row_slice(6, n, &jacobian).rows(0, 3).into_owned();
        assert!((grown - linear.transpose() * linear * mass).amax() < 1e-10, "{name}");
        loaded.set_link_inertia(n - 1, arm.link_inertia(n - 1));
        assert_eq!(&loaded, arm);
        loaded.set_gravity(Vector3::zeros());
        loaded.gravity(&mut ws, &at.q, &mut after);
        assert!(after.iter().all(|&torque| torque == 0.0), "{name}");
        let dropped = LinkInertia::point(mass, point);
        loaded.add_point_mass(mass, point);
        assert_eq!(loaded.link_inertia(n - 1), arm.link_inertia(n - 1).plus(&dropped));
    });
}

#[test]
fn not_a_number_in_gives_not_a_number_out_and_no_panic() {
    let arm = Raven2::nominal().rigid_body(Side::Gold);
    let mut ws = Workspace::new(&arm);
    let (mut m, mut bias) = ([0.0; 9], [0.0; 3]);
    arm.mass_matrix_and_bias(&mut ws, &[f64::NAN; 3], &[0.0; 3], &mut m, &mut bias);
    assert!(m[0].is_nan() && bias[0].is_nan());
    let refused = arm.forward_dynamics(&mut ws, &[f64::INFINITY; 3], &[0.0; 3], &[0.0; 3], &mut bias);
    assert!(refused.is_err());
    // The workspace is none the worse.
    arm.forward_dynamics(&mut ws, &[0.5, 1.5, 0.4], &[0.0; 3], &[0.0; 3], &mut bias).expect("finite");
}

#[test]
fn an_arm_without_inertia_at_its_tip_has_no_accelerations() {
    let arm = Raven2::nominal().six_axes(Side::Gold);
    let mut ws = Workspace::new(&arm);
    let refused = arm.forward_dynamics(&mut ws, &[0.5, 1.5, 0.4, 0.0, 0.1, 0.2], &[0.0; 6], &[0.0; 6], &mut [0.0; 6]);
    let text = refused.expect_err("links 4 to 6 have no inertia").to_string();
    assert_eq!(text, "joint 6: nothing with inertia moves with it alone; give the links behind it mass or inertia");
}
