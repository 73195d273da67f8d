//! From a robot file with a URDF to a plant with its effects.

use arm::serial::{SerialArm, Workspace};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use crate::model::{Bound, Connection, DriveModel, Effect, UrdfRobot};
use crate::physics::{JointOffset, LinkGeometry, Physics};
use crate::plant::{JOINTS_MAX, Method, Plant, PlantError, Stiction, Timed, Vector};
use crate::robot_plant::{is_explicit, on_joint};

/// Frequency of a joint's link on a cable that is only there for an effect to act on, Hz: several times that of real cables
/// (RAVEN-II's first joint: about 25 Hz), so that what is seen is the effect.
const STIFF_HZ: f64 = 100.0;
/// Its damping, share of the critical one.
const STIFF_DAMPING: f64 = 0.3;
/// Rotor inertia, at the joint, of a motor of which nothing is known, as a share of what it moves **(assumed)**.
const ROTOR_SHARE: f64 = 0.1;

/// The middle of the joints' ranges; 0 where a range is unknown.
pub(crate) fn middle(arm: &SerialArm) -> Vector {
    let mut out = [0.0; JOINTS_MAX];
    for (position, body) in out.iter_mut().zip(arm.bodies()) {
        let limits = &body.joint.limits;
        if limits.lower.is_finite() && limits.upper.is_finite() {
            *position = f64::midpoint(limits.lower, limits.upper);
        }
    }
    out
}

/// The plant with all effects, and an offset that a homing left at each joint, rad or m.
pub(crate) fn build(robot: &UrdfRobot, homing_offset: &Vector) -> Result<Plant, PlantError> {
    let arm = robot.arm();
    let (n, middle) = (robot.joint_count(), middle(&arm));
    let mut mass = vec![0.0; n * n];
    arm.mass_matrix(&mut Workspace::new(&arm), &middle[..n], &mut mass);
    let drives: Vec<_> = (0..n)
        .map(|joint| {
            let drive = &robot.drives[joint];
            let stiff = drive.connection == Connection::Rigid && robot.effects.iter().any(|effect| strains(effect, joint));
            let drive = if stiff { on_stiff_cable(drive, mass[joint * n + joint]) } else { *drive };
            drive.numbers(robot.passive[joint])
        })
        .collect();
    let mut plant = Plant::new(arm, &drives, &robot.coupling, Method::Rk4, robot.step_s)?;
    for (joint, offset) in homing_offset.iter().enumerate().filter(|(_, offset)| **offset != 0.0) {
        plant.add_offset(Timed::new(JointOffset { o: *offset }, f64::NEG_INFINITY, f64::INFINITY), joint);
    }
    for (joint, drive) in robot.drives.iter().enumerate() {
        if let Some(presliding) = drive.presliding {
            let slot = plant.memory()?;
            plant.drive_mut(joint).stiction = Some(Stiction { presliding, slot });
        }
    }
    for effect in &robot.effects {
        add(&mut plant, robot, effect)?;
    }
    plant.at(0.0);
    if let Some(joint) = plant.massless(&middle) {
        return Err(PlantError::Massless { joint: joint + 1 });
    }
    let explicit = is_explicit(&mut plant, &middle, robot.step_s);
    plant.set_step(if explicit { Method::Rk4 } else { Method::Rosenbrock }, robot.step_s);
    Ok(plant)
}

/// Does the effect need a cable at the joint?
fn strains(effect: &Effect, joint: usize) -> bool {
    effect.bound == Bound::Joint(joint)
        && matches!(
            effect.physics,
            Physics::Backlash(_) | Physics::CableStretch(_) | Physics::CableHysteresis(_) | Physics::CableCreep(_)
        )
}

/// The drive with a cable that hardly gives way in place of a rigid transmission.
fn on_stiff_cable(drive: &DriveModel, link_inertia: f64) -> DriveModel {
    let area = drive.reduction * drive.reduction;
    let rotor = if drive.rotor_inertia_kg_m2 > 0.0 { drive.rotor_inertia_kg_m2 } else { ROTOR_SHARE * link_inertia / area };
    let stiffness = link_inertia * (std::f64::consts::TAU * STIFF_HZ).powi(2);
    let both = 1.0 / (1.0 / link_inertia + 1.0 / (rotor * area));
    let damping = 2.0 * STIFF_DAMPING * (stiffness * both).sqrt();
    DriveModel { connection: Connection::Cable, rotor_inertia_kg_m2: rotor, stiffness, damping, ..*drive }
}

/// Puts an effect where it belongs. What concerns only what is seen (delays, geometry, frames) is the simulation's.
fn add(plant: &mut Plant, robot: &UrdfRobot, effect: &Effect) -> Result<(), PlantError> {
    let (from, to) = (effect.from_s, effect.to_s);
    let refuse = |joint: usize, why| Err(PlantError::Place { physics: effect.physics.name(), joint: joint + 1, why });
    match (effect.bound, effect.physics) {
        (Bound::Joint(joint), physics) => {
            let (drive, loose) = (&robot.drives[joint], robot.passive[joint].stiffness == 0.0);
            if let Physics::MotorTorqueScale(scale) = physics
                && scale.d_0 != 0.0
                && drive.torque_per_count_nm() == 0.0
            {
                return refuse(joint, "d_0 is in counts; give the drive torque_constant_nm_a and counts_per_a");
            }
            let needs_spring = strains(effect, joint) && !matches!(physics, Physics::CableHysteresis(_));
            if drive.connection == Connection::Force && loose && needs_spring {
                return refuse(joint, "has no spring to act on; give [passive] of the joint a stiffness");
            }
            return on_joint(plant, effect, joint);
        }
        (Bound::Motor(joint), _) => plant.drive_mut(joint).rub_motor(effect),
        (Bound::Pair(driven, driver), Physics::JointCoupling(coupling)) => {
            plant.add_coupling(Timed::new(coupling, from, to), driven, driver);
        }
        (Bound::Link(link), Physics::LinkInertia(change)) => {
            if link >= plant.joints() {
                return refuse(link, "the tool is part of the last link; name that");
            }
            plant.add_inertia(Timed::new(change, from, to), link);
        }
        (Bound::Robot, Physics::Payload(payload)) => plant.add_payload(Timed::new(payload, from, to)),
        (Bound::Robot, Physics::GravityDirection(tilt)) => plant.add_gravity(Timed::new(tilt, from, to)),
        (Bound::Robot, Physics::ExternalContact(contact)) => plant.add_contact(Timed::new(contact, from, to)),
        _ => {}
    }
    Ok(())
}

/// An arm with its links where effects of `link_geometry` put them: each turns its link about x of the frame before and moves
/// it along the way from there (along the joint's axis where both frames have one origin). One past the last link is the tool.
pub(crate) fn bent(arm: &SerialArm, effects: &[Effect]) -> SerialArm {
    let (mut bodies, mut tools) = (arm.bodies().to_vec(), arm.tools().to_vec());
    let mut any = false;
    for effect in effects {
        let (Physics::LinkGeometry(change), Bound::Link(link)) = (effect.physics, effect.bound) else { continue };
        any = true;
        if let Some(body) = bodies.get_mut(link) {
            body.placement = moved(&body.placement, &body.joint.axis, &change);
        } else {
            for tool in &mut tools {
                tool.pose = moved(&tool.pose, &Vector3::z(), &change);
            }
        }
    }
    if !any {
        return arm.clone();
    }
    let changed = SerialArm::new(arm.name(), bodies, arm.gravity_vector(), tools);
    changed.map_or_else(|_| arm.clone(), |changed| changed.with_base_name(arm.base_name()))
}

fn moved(pose: &IsometryMatrix3<f64>, axis: &Vector3<f64>, change: &LinkGeometry) -> IsometryMatrix3<f64> {
    let way = pose.translation.vector;
    let along = way.try_normalize(1e-9).unwrap_or_else(|| pose.rotation * axis.normalize());
    let longer = Translation3::from(way + along * change.d_length);
    let turned = Rotation3::from_axis_angle(&Vector3::x_axis(), change.d_alpha);
    IsometryMatrix3::from_parts(Translation3::identity(), turned) * IsometryMatrix3::from_parts(longer, pose.rotation)
}
