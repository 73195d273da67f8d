//! Arms other than RAVEN: two to four joints or six, some sliding, any mount, masses and ratios; and plain ones, planar and gantries.

use crate::arm::{Arm, Drive, DryLaw, Joint, Link, Motion};
use crate::lagrange::Chain;
use crate::random::Random;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::FRAC_PI_2;

/// An arm of two to four joints as a laboratory describes it.
pub(crate) fn draw(random: &mut Random) -> Arm {
    let size = 2 + random.index(3);
    draw_sized(size, random)
}

/// An arm of two, three, four or six joints as a laboratory describes it.
pub(crate) fn draw_sized(size: usize, random: &mut Random) -> Arm {
    let sliding = if random.chance(0.5) { Some(random.index(size)) } else { None };
    let (mut joints, mut links) = (Vec::new(), Vec::new());
    let mut length = 0.0;
    let mut mass = random.uniform(0.8, 2.0);
    for j in 0..size {
        let motion = if sliding == Some(j) { Motion::Slides } else { Motion::Turns };
        joints.push(joint(j, motion, length, random));
        length = random.uniform(0.12, 0.28);
        links.push(link(j, round(mass), length, random));
        mass *= random.uniform(0.45, 0.8);
    }
    let mut angle = || round(random.uniform(-1.0, 1.0));
    let mount = [FRAC_PI_2 + 0.6 * angle(), 0.5 * angle(), 0.0].map(round);
    driven(&format!("arm-{size}dof"), mount, (joints, links), [round(length), 0.0, 0.0], random)
}

/// Two links that turn in one upright plane.
pub(crate) fn draw_planar(random: &mut Random) -> Arm {
    let mut length = 0.0;
    let mut mass = random.uniform(1.0, 2.5);
    let (mut joints, mut links) = (Vec::new(), Vec::new());
    for j in 0..2 {
        joints.push(Joint { rpy: [if j == 0 { FRAC_PI_2 } else { 0.0 }, 0.0, 0.0], ..joint(j, Motion::Turns, length, random) });
        length = random.uniform(0.2, 0.4);
        links.push(link(j, round(mass), length, random));
        mass *= random.uniform(0.4, 0.8);
    }
    driven("planar-2dof", [0.0; 3], (joints, links), [round(length), 0.0, 0.0], random)
}

/// Slides along x and y, and one upwards, each of which carries the next.
pub(crate) fn draw_gantry(random: &mut Random) -> Arm {
    let mut mass = random.uniform(2.0, 4.0);
    let (mut joints, mut links) = (Vec::new(), Vec::new());
    for (j, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
        joints.push(Joint { rpy: [0.0; 3], axis, ..joint(j, Motion::Slides, 0.0, random) });
        links.push(link(j, round(mass), 0.1, random));
        mass *= random.uniform(0.4, 0.7);
    }
    driven("gantry-3dof", [0.0; 3], (joints, links), [0.0, 0.0, -0.1], random)
}

/// An arm with drives that suit it.
fn driven(name: &str, mount: [f64; 3], (joints, links): (Vec<Joint>, Vec<Link>), tip: [f64; 3], random: &mut Random) -> Arm {
    let mut arm = Arm { name: name.into(), mount, joints, links, tip, drives: Vec::new(), dry_law: DryLaw::Smooth(0.5) };
    arm.drives = drives(&arm, random);
    arm
}

/// To a tenth of a millimetre, milliradian or gram, as people write such things.
fn round(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

fn joint(j: usize, motion: Motion, length: f64, random: &mut Random) -> Joint {
    let roll = match random.index(4) {
        0 => 0.0,
        1 => FRAC_PI_2,
        2 => -FRAC_PI_2,
        _ => random.sign() * random.uniform(0.4, 1.4),
    };
    let (limits, centre, reach) = match motion {
        Motion::Turns => {
            let (centre, reach) = (random.uniform(-0.8, 0.8), random.uniform(0.3, 0.6));
            ([centre - 1.2, centre + 1.2], centre, reach)
        }
        Motion::Slides => {
            let reach = random.uniform(0.04, 0.09);
            ([0.02, 0.06 + 2.0 * reach], 0.04 + reach, reach)
        }
    };
    Joint {
        name: format!("joint{}", j + 1),
        motion,
        rpy: [round(roll), 0.0, 0.0],
        xyz: [round(length), 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        limits: limits.map(round),
        centre: round(centre),
        reach,
    }
}

fn link(j: usize, mass: f64, length: f64, random: &mut Random) -> Link {
    let side = || 0.03;
    let centre = [length * random.uniform(0.3, 0.7), random.uniform(-1.0, 1.0) * side(), random.uniform(-1.0, 1.0) * side()];
    let long = mass * length * length / 12.0;
    let thin = mass * 0.03 * 0.03 / 6.0;
    let inertia = [thin, long + thin, long + thin].map(|i| (i * 1e6).round() / 1e6);
    Link {
        name: format!("link{}", j + 1),
        mass,
        centre: Vector3::from(centre.map(round)),
        inertia: Matrix3::from_diagonal(&Vector3::from(inertia)),
    }
}

/// Motors, cables and gains that suit the weight and inertia they meet.
fn drives(arm: &Arm, random: &mut Random) -> Vec<Drive> {
    let mut worst = vec![(0.0f64, 0.0f64); arm.size()];
    for _ in 0..40 {
        let q: Vec<f64> = arm.joints.iter().map(|joint| joint.centre + random.uniform(-1.0, 1.0) * joint.reach).collect();
        for (worst, (weight, inertia)) in worst.iter_mut().zip(meets(arm, &q)) {
            *worst = (worst.0.max(weight.abs()), worst.1.max(inertia));
        }
    }
    let mut drives = Vec::new();
    for (joint, (weight, inertia)) in arm.joints.iter().zip(worst) {
        let turns = joint.motion == Motion::Turns;
        let ratio = if turns { random.uniform(60.0, 150.0) } else { random.log_uniform(900.0, 2500.0) };
        let weight = weight.max(if turns { 0.5 } else { 3.0 });
        // everything of the motor in proportion to one that carries 0.03 N m
        let motor = (weight / ratio / 0.03).clamp(0.3, 6.0);
        let sag = if turns { random.uniform(1.0e-3, 5e-3) } else { random.uniform(0.06e-3, 0.2e-3) };
        // no softer than 12 Hz, or the controller could not hold it
        let stiffness = (weight / sag).max(inertia * 75.0 * 75.0);
        let kp = 0.18 * motor;
        drives.push(Drive {
            ratio: (ratio * 1e3).round() / 1e3,
            inertia: 1.35e-5 * motor,
            dry: 0.011 * motor,
            viscous: 4e-5 * motor,
            stiffness,
            damping: 0.3 * (stiffness * inertia).sqrt(),
            kp,
            kd: 0.02 * kp,
            ki: 0.0,
            limit: 0.8 * motor,
            noise: motor,
        });
    }
    drives
}

/// Weight and inertia at every joint.
fn meets(arm: &Arm, q: &[f64]) -> Vec<(f64, f64)> {
    match arm.size() {
        2 => meets_sized::<2>(arm, q),
        3 => meets_sized::<3>(arm, q),
        4 => meets_sized::<4>(arm, q),
        _ => meets_sized::<6>(arm, q),
    }
}

fn meets_sized<const N: usize>(arm: &Arm, q: &[f64]) -> Vec<(f64, f64)> {
    let posture = Chain::<N>::new(arm).posture(&std::array::from_fn(|j| q[j]), &[0.0; N]);
    (0..N).map(|j| (posture.gravity[j], posture.mass[j][j])).collect()
}
