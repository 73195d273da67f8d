//! The arms of the cases: the RAVEN-like one of data/gap-examples, and others drawn at random.

use crate::arm::{Arm, Drive, DryLaw, Joint, Link, Motion};
use crate::random::Random;
use nalgebra::{Matrix3, Vector3};

/// An arm as it is, and as its laboratory believes it to be.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Moves in the recordings and, without effects, in the simulation.
    pub truth: Arm,
    /// Stands in the URDF and in the controller.
    pub model: Arm,
}

fn joint(name: &str, motion: Motion, rpy: [f64; 3], axis: [f64; 3], limits: [f64; 2], centre: f64, reach: f64) -> Joint {
    Joint { name: name.into(), motion, rpy, xyz: [0.0; 3], axis, limits, centre, reach }
}

fn link(name: &str, mass: f64, centre: [f64; 3], inertia: [f64; 3]) -> Link {
    Link { name: name.into(), mass, centre: centre.into(), inertia: Matrix3::from_diagonal(&Vector3::from(inertia)) }
}

#[expect(clippy::approx_constant, reason = "the file has four decimals")]
/// The arm of data/gap-examples/robot.urdf; drives of that plant, as fitted on its noise-free simulations.
fn raven_model() -> Arm {
    let drive = |ratio: f64, dry: f64, stiffness: f64, damping: f64, kp: f64| Drive {
        ratio,
        inertia: 1.35e-5,
        dry,
        viscous: 4e-5,
        stiffness,
        damping,
        kp,
        kd: 0.02 * kp,
        ki: 0.0,
        limit: 0.6,
        noise: 1.0,
    };
    let z = [0.0, 0.0, 1.0];
    Arm {
        name: "raven2-like-3dof".into(),
        mount: [0.5236, 0.0, 0.0],
        joints: vec![
            joint("shoulder", Motion::Turns, [0.0; 3], z, [0.0, 1.57], 0.6, 0.36),
            joint("elbow", Motion::Turns, [1.308_996_94, 0.0, 0.0], z, [0.5, 2.3], 1.25, 0.36),
            joint("insertion", Motion::Slides, [0.907_571_21, 0.0, 0.0], [0.0, 0.0, -1.0], [-0.3, -0.1], -0.215, 0.06),
        ],
        links: vec![
            link("link1", 1.10, [0.03, -0.1063, 0.1385], [0.004, 0.004, 0.012]),
            link("link2", 1.40, [-0.0121, -0.1552, 0.2003], [0.004, 0.004, 0.008]),
            link("tool", 0.407, [0.0, 0.0, 0.10], [0.0005, 0.0005, 0.0001]),
        ],
        tip: [0.0, 0.0, -0.05],
        drives: vec![
            drive(136.207, 0.012, 1594.0, 3.45, 0.20),
            drive(89.366, 0.010, 428.5, 1.0, 0.16),
            drive(2158.590, 0.009, 41_000.0, 80.0, 0.10),
        ],
        dry_law: DryLaw::Smooth(0.5),
    }
}

/// What a laboratory does not know of its arm: masses within a tenth or so, drives within a quarter.
fn deviate(model: &Arm, random: &mut Random) -> Arm {
    let mut truth = model.clone();
    for link in &mut truth.links {
        link.mass *= random.uniform(0.88, 1.12);
        link.centre += Vector3::from(random.direction()) * random.uniform(0.0, 0.01);
        link.inertia *= random.log_uniform(0.7, 1.5);
    }
    for drive in &mut truth.drives {
        drive.dry *= random.log_uniform(0.8, 1.25);
        drive.viscous *= random.log_uniform(0.7, 1.4);
        drive.stiffness *= random.log_uniform(0.8, 1.25);
        drive.damping *= random.log_uniform(0.7, 1.4);
        drive.ki = 0.0;
    }
    // a third of the laboratories added an integral
    if random.chance(0.33) {
        let share = random.uniform(0.3, 1.0);
        for drive in &mut truth.drives {
            drive.ki = share * drive.kp;
        }
    }
    truth.dry_law =
        if random.chance(0.75) { DryLaw::Smooth(random.uniform(0.35, 0.7)) } else { DryLaw::Bristle(random.uniform(0.05, 0.12)) };
    truth
}

/// The RAVEN-like arm; masses and drives drawn around those of the model.
pub fn raven(random: &mut Random) -> Pair {
    let model = raven_model();
    Pair { truth: deviate(&model, random), model }
}

/// Any other arm of two to four joints.
pub fn variant(random: &mut Random) -> Pair {
    let model = crate::variants::draw(random);
    Pair { truth: deviate(&model, random), model }
}

/// An arm of six joints.
pub fn six(random: &mut Random) -> Pair {
    let model = crate::variants::draw_sized(6, random);
    Pair { truth: deviate(&model, random), model }
}

/// Two links that turn about parallel level axes.
pub fn planar(random: &mut Random) -> Pair {
    let model = crate::variants::draw_planar(random);
    Pair { truth: deviate(&model, random), model }
}

/// Three slides at right angles.
pub fn gantry(random: &mut Random) -> Pair {
    let model = crate::variants::draw_gantry(random);
    Pair { truth: deviate(&model, random), model }
}
