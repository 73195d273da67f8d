//! Base parameters: RAVEN-II's rank as the specification states it, torques on fresh states, and what they are blind to.
#![allow(missing_docs)]

mod common;

use arm::serial::{BaseParameters, BaseParametersError, SerialArm, Workspace};
use arm::{Raven2, Side};
use common::random_arm::{self, motion};
use common::{Random, Worst};
use nalgebra::Vector3;

/// Worst torque error of base regressor times base parameters on states that took no part, relative to the largest torque.
fn torque_error(arm: &SerialArm, base: &BaseParameters, random: &mut Random) -> f64 {
    let (n, rank, mut ws) = (arm.joint_count(), base.rank(), Workspace::new(arm));
    let (mut full, mut reduced, mut parameters) = (vec![0.0; n * 10 * n], vec![0.0; n * rank], vec![0.0; 10 * n]);
    let (mut numbers, mut tau) = (vec![0.0; rank], vec![0.0; n]);
    arm.parameters(&mut parameters);
    base.reduce(&parameters, &mut numbers);
    let (mut worst, mut size) = (Worst::default(), 0.0_f64);
    for _ in 0..50 {
        let at = motion(random, n);
        arm.regressor(&mut ws, &at.q, &at.qd, &at.qdd, &mut full);
        base.regressor(&full, &mut reduced);
        arm.inverse_dynamics(&mut ws, &at.q, &at.qd, &at.qdd, None, &mut tau);
        for (row, tau) in reduced.chunks_exact(rank).zip(&tau) {
            worst.see(row.iter().zip(&numbers).map(|(y, p)| y * p).sum::<f64>() - tau);
            size = size.max(tau.abs());
        }
    }
    worst.0 / size
}

#[test]
fn raven2_has_fourteen_base_parameters_on_either_arm() {
    for side in Side::ALL {
        let arm = Raven2::nominal().rigid_body(side);
        let base = BaseParameters::new(&arm).expect("a clear rank");
        let values = base.singular_values();
        let error = torque_error(&arm, &base, &mut Random::new(5));
        println!(
            "{}: columns {:?}, singular values {:e} .. {:e} | {:e}, torque error {error:e}",
            side.name(),
            base.columns(),
            values[0],
            values[13],
            values[14]
        );
        assert_eq!(base.rank(), 14);
        // Moments of link 1 across its axis and its inertia about it; nothing else of it ever acts.
        assert_eq!(base.columns(), [1, 2, 9, 11, 12, 14, 15, 17, 18, 19, 20, 21, 22, 23]);
        assert!(error < 1e-12);
    }
}

#[test]
fn both_parameter_sets_of_one_motion_have_the_same_base_parameters() {
    // A change that no motion shows: along the null space of the grouping.
    let arm = Raven2::nominal().rigid_body(Side::Gold);
    let base = BaseParameters::new(&arm).expect("a clear rank");
    let mut parameters = vec![0.0; 30];
    arm.parameters(&mut parameters);
    let hidden = (0..30).find(|column| !base.columns().contains(column)).expect("a dependent column");
    let mut other = parameters.clone();
    other[hidden] += 0.1;
    for (row, &column) in base.columns().iter().enumerate() {
        other[column] -= 0.1 * base.grouping()[(row, hidden)];
    }
    let mut changed = arm.clone();
    changed.set_parameters(&other);
    let (mut ws, mut random, mut worst) = (Workspace::new(&arm), Random::new(6), Worst::default());
    for _ in 0..50 {
        let at = motion(&mut random, 3);
        let (mut a, mut b) = ([0.0; 3], [0.0; 3]);
        arm.inverse_dynamics(&mut ws, &at.q, &at.qd, &at.qdd, None, &mut a);
        changed.inverse_dynamics(&mut ws, &at.q, &at.qd, &at.qdd, None, &mut b);
        worst.see_all(&a, &b);
    }
    assert!(changed != arm && worst.0 < 1e-10, "{}", worst.0);
}

#[test]
fn random_arms_reproduce_torques_on_fresh_states() {
    for seed in 0..42 {
        let mut random = Random::new(seed);
        let arm = random_arm::arm(&mut random, 1 + seed as usize % 7);
        let base = BaseParameters::new(&arm).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let error = torque_error(&arm, &base, &mut random);
        assert!(error < 1e-10 && base.rank() < 10 * arm.joint_count(), "seed {seed}: rank {}, error {error:e}", base.rank());
    }
}

#[test]
fn gravity_along_the_first_axis_hides_what_it_does_not_move() {
    // Turning about the vertical, link 1 shows one number: its inertia about the axis. Otherwise two moments more.
    let mut arm = Raven2::nominal().rigid_body(Side::Gold);
    let tilted = BaseParameters::new(&arm).expect("clear").rank();
    arm.set_gravity(Vector3::new(0.0, 0.0, -9.81));
    let upright = BaseParameters::new(&arm).expect("clear").rank();
    assert_eq!((tilted, upright), (14, 12));
}

#[test]
fn gravity_that_is_not_a_number_is_refused() {
    let mut arm = Raven2::nominal().rigid_body(Side::Gold);
    arm.set_gravity(Vector3::new(f64::NAN, 0.0, 0.0));
    assert_eq!(BaseParameters::new(&arm), Err(BaseParametersError::NotFinite));
}
