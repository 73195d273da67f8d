//! Inverse kinematics over the workspace of both arms: the identity in both directions, limits, what is refused, and the places
//! where a joint is free. Seeds are printed.
#![allow(missing_docs)]

mod common;

use std::f64::consts::FRAC_PI_2;

use arm::inverse::{Degeneracy, InverseError, RESOLUTION_M, Solutions};
use arm::kinematics::jaw_opening;
use arm::serial::Workspace;
use arm::{Arm, JOINTS, Joints, Raven2, Side};
use common::{Random, Worst};
use nalgebra::{DMatrix, IsometryMatrix3, Matrix3, Rotation3, Vector3};

const POSES: usize = 20_000;

fn arms() -> [Arm; 2] {
    Side::ALL.map(|side| Raven2::nominal().arm(side))
}

/// Uniform over the command limits.
fn joints(arm: &Arm, random: &mut Random) -> Joints {
    std::array::from_fn(|i| random.within(arm.limits.min()[i], arm.limits.max()[i]))
}

fn solve(arm: &Arm, joints: &Joints) -> Result<Solutions, InverseError> {
    arm.kinematics.inverse(&arm.kinematics.tip(joints), jaw_opening(joints), &arm.limits)
}

fn tip_error(a: &IsometryMatrix3<f64>, b: &IsometryMatrix3<f64>) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).amax()
}

#[test]
fn forward_of_inverse_is_the_identity_over_the_workspace() {
    for arm in arms() {
        let seed = 100 + arm.side.index() as u64;
        let (mut random, mut worst, mut original) = (Random::new(seed), Worst::default(), Worst::default());
        let mut counts = [0; 9];
        for k in 0..POSES {
            let j = joints(&arm, &mut random);
            let tip = arm.kinematics.tip(&j);
            // Within a micrometre of the centre the branch of the original is left out, and only there.
            let at_centre = (j[2] - 0.47).abs() < RESOLUTION_M;
            let solutions = match solve(&arm, &j) {
                Err(InverseError::Degenerate(Degeneracy::WristAtCentre)) if at_centre => {
                    counts[0] += 1;
                    continue;
                }
                other => other.unwrap_or_else(|error| panic!("seed {seed}, pose {k}: {error}")),
            };
            for solution in solutions.iter() {
                assert!(solution.joints.iter().all(|value| value.is_finite()));
                worst.see(tip_error(&arm.kinematics.tip(&solution.joints), &tip));
                assert!((jaw_opening(&solution.joints) - jaw_opening(&j)).abs() < 1e-14);
            }
            counts[solutions.count()] += 1;
            assert_eq!(solutions.degeneracy().is_some(), at_centre, "seed {seed}, pose {k}");
            if at_centre {
                continue;
            }
            let nearest = solutions.nearest(&j).unwrap_or_else(|| panic!("seed {seed}, pose {k}"));
            assert!(nearest.within_limits(), "seed {seed}, pose {k}: {j:?} {nearest:?}");
            original.see(nearest.distance(&j));
        }
        println!(
            "{}: seed {seed}, {POSES} poses, tip {:e}, original joints {:e}, solutions per pose {counts:?}",
            arm.side.name(),
            worst.0,
            original.0
        );
        assert!(worst.0 < 1e-12 && original.0 < 1e-9);
    }
}

#[test]
fn solutions_differ_from_each_other() {
    for arm in arms() {
        let mut random = Random::new(110);
        for k in 0..2000 {
            let found: Vec<Joints> = solve(&arm, &joints(&arm, &mut random)).expect("reachable").iter().map(|s| s.joints).collect();
            for (i, a) in found.iter().enumerate() {
                for b in &found[..i] {
                    let apart = (0..JOINTS).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
                    assert!(apart > 1e-6, "seed 110, pose {k}: {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn every_joint_outside_its_limits_is_named() {
    let [gold, _] = arms();
    let mut random = Random::new(120);
    let mut outside = [0; JOINTS];
    for _ in 0..2000 {
        for solution in solve(&gold, &joints(&gold, &mut random)).expect("reachable").iter() {
            for (joint, count) in outside.iter_mut().enumerate() {
                assert_eq!(solution.outside[joint], !gold.limits.allows(joint, solution.joints[joint]));
                *count += usize::from(solution.outside[joint]);
            }
            assert_eq!(solution.within_limits(), gold.limits.contains(&solution.joints));
        }
    }
    println!("outside, per joint: {outside:?}");
    assert!(outside[0] > 0 && outside[1] > 0 && outside[2] > 0 && outside[4] > 0);
}

#[test]
fn a_full_turn_of_the_tool_keeps_its_count_where_only_that_is_allowed() {
    let [gold, _] = arms();
    let mut j = *gold.limits.home();
    // Inside +-182 degrees either way round, and the same tip.
    for roll in [181.0_f64, -181.0, 179.0] {
        j[3] = roll.to_radians();
        let solutions = solve(&gold, &j).expect("reachable");
        let nearest = solutions.nearest(&j).expect("some");
        assert!(nearest.distance(&j) < 1e-12 && nearest.within_limits());
    }
}

#[test]
fn poses_out_of_reach_are_refused_with_the_angle() {
    for arm in arms() {
        let (mut refused, mut random) = (0, Random::new(130));
        for _ in 0..POSES {
            let rotation = Rotation3::new(random.vector(3.0));
            let tip = IsometryMatrix3::from_parts(random.vector(0.3).into(), rotation);
            match arm.kinematics.inverse(&tip, 0.0, &arm.limits) {
                Ok(solutions) => {
                    for solution in solutions.iter() {
                        assert!(tip_error(&arm.kinematics.tip(&solution.joints), &tip) < 1e-12);
                    }
                }
                Err(InverseError::Unreachable { degrees }) => {
                    assert!(degrees > 0.0 && degrees < 90.0);
                    refused += 1;
                }
                Err(error) => panic!("{error}"),
            }
        }
        println!("{}: {refused} of {POSES} random poses out of reach", arm.side.name());
        assert!(refused > 500);
        // Straight up the shoulder axis: axis 3 stays 23 degrees off it at least.
        let along = IsometryMatrix3::from_parts(
            Vector3::new(0.0, 0.013, 0.2).into(),
            Rotation3::from_euler_angles(FRAC_PI_2, 0.0, FRAC_PI_2),
        );
        let error = arm.kinematics.inverse(&along, 0.0, &arm.limits).expect_err("out of reach");
        println!("{error}");
        assert!(matches!(error, InverseError::Unreachable { .. }));
    }
}

#[test]
fn what_is_no_pose_is_refused() {
    let [gold, _] = arms();
    let good = gold.kinematics.tip(gold.limits.home());
    let mut far = good;
    far.translation.vector.x = f64::NAN;
    let mut bent = good;
    bent.rotation = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal_element(1.01));
    let mut mirrored = good;
    mirrored.rotation = Rotation3::from_matrix_unchecked(-Matrix3::identity());
    for pose in [far, bent, mirrored] {
        assert_eq!(gold.kinematics.inverse(&pose, 0.0, &gold.limits), Err(InverseError::NotAPose));
    }
    assert_eq!(gold.kinematics.inverse(&good, f64::INFINITY, &gold.limits), Err(InverseError::NotAPose));
}

#[test]
fn a_wrist_in_the_remote_centre_is_said_and_the_other_branch_kept() {
    for arm in arms() {
        let mut j = *arm.limits.home();
        j[2] = 0.47;
        let solutions = solve(&arm, &j).expect("the other yaw branch stands");
        assert_eq!(solutions.degeneracy(), Some(Degeneracy::WristAtCentre));
        let tip = arm.kinematics.tip(&j);
        for solution in solutions.iter() {
            assert!(tip_error(&arm.kinematics.tip(&solution.joints), &tip) < 1e-12);
            // The other candidate lies twice the wrist's length away.
            assert!((solution.closeness.wrist_to_centre_m - 0.026).abs() < 1e-9);
        }
        // A tenth of a millimetre on, everything is solvable, and the closeness tells the distance.
        j[2] = 0.4701;
        let solutions = solve(&arm, &j).expect("regular");
        assert_eq!(solutions.degeneracy(), None);
        let nearest = solutions.nearest(&j).expect("some");
        assert!(nearest.distance(&j) < 1e-10 && (nearest.closeness.wrist_to_centre_m - 1e-4).abs() < 1e-12);
    }
}

#[test]
fn a_yaw_axis_through_the_remote_centre_is_refused_by_name() {
    for arm in arms() {
        let mut j = *arm.limits.home();
        // raven2-plant.md, section 2: the wrist 13 mm above the centre, tool straight.
        (j[2], j[4]) = (0.47 + 0.013, 0.0);
        assert_eq!(solve(&arm, &j), Err(InverseError::Degenerate(Degeneracy::YawAxisThroughCentre)));
        j[2] += 1e-4;
        let nearest = *solve(&arm, &j).expect("regular").nearest(&j).expect("some");
        assert!((nearest.closeness.yaw_axis_to_centre_m - 1e-4).abs() < 1e-12 && nearest.distance(&j) < 1e-10);
    }
}

#[test]
fn a_folded_elbow_has_two_equal_branches() {
    let [gold, _] = arms();
    let mut j = *gold.limits.home();
    j[1] = 0.0;
    let solutions = solve(&gold, &j).expect("at the edge of reach");
    let nearest = solutions.iter().min_by(|a, b| a.distance(&j).total_cmp(&b.distance(&j))).expect("some");
    // A square root at its zero: half the digits.
    assert!(nearest.distance(&j) < 1e-6 && nearest.closeness.elbow_sine < 1e-6 && nearest.outside[1]);
    assert!(tip_error(&gold.kinematics.tip(&nearest.joints), &gold.kinematics.tip(&j)) < 1e-7);
}

#[test]
fn closeness_vanishes_exactly_where_the_jacobian_loses_rank() {
    for side in Side::ALL {
        let (arm, axes) = (Raven2::nominal().arm(side), Raven2::nominal().six_axes(side));
        let mut ws = Workspace::new(&axes);
        let mut manipulability = |j: &Joints| {
            let mut jacobian = [0.0; 36];
            axes.jacobian(&mut ws, &[j[0], j[1], j[2], j[3], j[4], (j[6] - j[5]) / 2.0], &Vector3::zeros(), &mut jacobian);
            DMatrix::from_row_slice(6, 6, &jacobian).determinant().abs()
        };
        let (mut random, mut worst) = (Random::new(140), Worst::default());
        for _ in 0..2000 {
            let j = joints(&arm, &mut random);
            let near = solve(&arm, &j).expect("reachable").nearest(&j).expect("some").closeness;
            // |det J| = sin(la12) sin(la23) |sin θ2| · s · (distance of the yaw axis).
            let product = near.elbow_sine * near.wrist_to_centre_m * near.yaw_axis_to_centre_m;
            let factor = 75.0_f64.to_radians().sin() * 52.0_f64.to_radians().sin();
            worst.see(manipulability(&j) - factor * product);
        }
        let axes_at = |insertion_m: f64| {
            let q = [0.5, 1.5, insertion_m, 0.1, 0.2, 0.3];
            axes.dexterity(&mut Workspace::new(&axes), &q, 0.1)
        };
        // Angles count as 0.1 m of way: three rows times 0.1.
        let (regular, centred) = (axes_at(0.4), axes_at(0.47));
        let expected = manipulability(&[0.5, 1.5, 0.4, 0.1, 0.2, -0.3, 0.3]) * 1e-3;
        assert!((regular.manipulability() - expected).abs() < 1e-15 && centred.manipulability() < 1e-15);
        assert!(regular.condition() < 100.0 && centred.condition() > 1e12);
        println!("{}: |det J| and the product of the three closenesses differ by {:e}", side.name(), worst.0);
        assert!(worst.0 < 1e-12);
    }
}

#[test]
fn the_jacobian_of_the_six_axes_is_the_derivative_of_the_tip() {
    for side in Side::ALL {
        let (arm, axes) = (Raven2::nominal().arm(side), Raven2::nominal().six_axes(side));
        let (mut ws, mut random, mut worst) = (Workspace::new(&axes), Random::new(150), Worst::default());
        for _ in 0..500 {
            let j = joints(&arm, &mut random);
            let q = [j[0], j[1], j[2], j[3], j[4], (j[6] - j[5]) / 2.0];
            let mut jacobian = [0.0; 36];
            axes.jacobian(&mut ws, &q, &Vector3::zeros(), &mut jacobian);
            let here = arm.kinematics.tip(&j).rotation.matrix().transpose();
            for k in 0..6 {
                let at = |h: f64| {
                    let mut j = j;
                    match k {
                        // Yaw is half the difference of the jaws.
                        5 => (j[5], j[6]) = (j[5] - h, j[6] + h),
                        _ => j[k] += h,
                    }
                    arm.kinematics.tip(&j)
                };
                let h = 1e-5;
                let (a, b) = (at(-h), at(h));
                let linear = (b.translation.vector - a.translation.vector) / (2.0 * h);
                let spin = (b.rotation.matrix() - a.rotation.matrix()) / (2.0 * h) * here;
                let angular = Vector3::new(spin.m32 - spin.m23, spin.m13 - spin.m31, spin.m21 - spin.m12) / 2.0;
                for row in 0..3 {
                    worst.see(jacobian[row * 6 + k] - linear[row]);
                    worst.see(jacobian[(row + 3) * 6 + k] - angular[row]);
                }
            }
        }
        println!("{}: Jacobian and finite differences {:e}", side.name(), worst.0);
        assert!(worst.0 < 1e-9);
    }
}

#[test]
fn a_plant_with_another_geometry_is_refused() {
    let text = include_str!("../../../models/raven2-plant.toml").replacen("a_m = [0.0, 0.0,", "a_m = [0.0, 0.02,", 1);
    let raven = Raven2::from_toml(&text).expect("a plant");
    let gold = raven.arm(Side::Gold);
    assert_eq!(solve(&gold, gold.limits.home()), Err(InverseError::OtherGeometry));
    assert!(solve(&raven.arm(Side::Green), gold.limits.home()).is_ok());
}
