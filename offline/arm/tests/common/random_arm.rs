//! Random serial arms, the same for the same seed.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use arm::serial::{Body, Joint, JointKind, JointLimits, LinkInertia, SerialArm, Tool};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::Random;

pub(crate) fn pose(random: &mut Random) -> IsometryMatrix3<f64> {
    let rotation = Rotation3::new(random.vector(2.0));
    IsometryMatrix3::from_parts(Translation3::from(random.vector(0.4)), rotation)
}

/// A body that could exist: principal moments of a random cuboid, anywhere, turned at random.
pub(crate) fn inertia(random: &mut Random) -> LinkInertia {
    let mass_kg = random.within(0.2, 3.0);
    let squares =
        Vector3::new(random.within(0.05, 0.4), random.within(0.05, 0.4), random.within(0.05, 0.4)).map(|side| side * side);
    let moments = Vector3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) * (mass_kg / 12.0);
    let upright = LinkInertia { mass_kg, com_m: Vector3::zeros(), inertia_com_kg_m2: Matrix3::from_diagonal(&moments) };
    upright.transformed(&pose(random))
}

pub(crate) fn axis(random: &mut Random) -> Vector3<f64> {
    match random.below(6) {
        0 => Vector3::z(),
        1 => -Vector3::z(),
        2 => Vector3::x(),
        3 => -Vector3::y(),
        _ => random.vector(1.0) + Vector3::new(0.0, 0.0, 1.5),
    }
}

pub(crate) fn arm(random: &mut Random, joints: usize) -> SerialArm {
    let bodies = (0..joints)
        .map(|i| Body {
            name: format!("link{i}"),
            joint: Joint {
                name: format!("joint{i}"),
                kind: [JointKind::Revolute, JointKind::Continuous, JointKind::Prismatic][random.below(3)],
                axis: axis(random),
                limits: JointLimits::NONE,
            },
            placement: pose(random),
            inertia: inertia(random),
        })
        .collect();
    let tool = Tool { name: "tip".to_owned(), pose: pose(random) };
    SerialArm::new("random", bodies, random.vector(9.81), vec![tool]).expect("an arm")
}

/// Positions, rates, accelerations.
pub(crate) struct Motion {
    pub(crate) q: Vec<f64>,
    pub(crate) qd: Vec<f64>,
    pub(crate) qdd: Vec<f64>,
}

pub(crate) fn motion(random: &mut Random, joints: usize) -> Motion {
    let mut vector = |size: f64| (0..joints).map(|_| random.signed(size)).collect();
    Motion { q: vector(2.0), qd: vector(2.0), qdd: vector(4.0) }
}

/// An arm of revolute joints only.
pub(crate) fn revolute(random: &mut Random, joints: usize) -> SerialArm {
    let like = arm(random, joints);
    let mut bodies = like.bodies().to_vec();
    for body in &mut bodies {
        body.joint.kind = JointKind::Continuous;
    }
    SerialArm::new("revolute", bodies, like.gravity_vector(), like.tools().to_vec()).expect("an arm")
}
