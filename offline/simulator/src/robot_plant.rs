//! From a robot file to a plant with its effects.

use arm::plant::LengthEntry;
use arm::{JOINTS, Motors, Raven2, Side};

use crate::model::{Bound, Effect, Robot};
use crate::physics::{LinkGeometry, Physics};
use crate::plant::{
    Between, CableLaw, Drive, DriveNumbers, Held, JOINTS_MAX, Method, Passive, Plant, PlantError, Rubbing, Stiction, Timed, Vector,
};
use crate::tool_axes::{FIRST, ToolAxes};

/// Capstan torque under which a motor warms up by one unit: about the RMS torque of teleoperation, N·m **(assumed)**.
const TORQUE_REF_NM: [f64; JOINTS] = [0.15, 0.15, 0.1, 0.03, 0.03, 0.03, 0.03];

/// The joint along which the tool cables run.
const INSERTION: usize = 2;

/// Rate times step up to which the explicit method is used: it is stable to 2.78, and the mass matrix changes with posture.
const EXPLICIT_MAX: f64 = 2.0;

/// Frequency times step up to which the explicit method follows a cable's vibration well.
const EXPLICIT_PHASE_MAX: f64 = 1.0;

/// Are steps of this length short enough for the explicit method, whatever effects come?
pub(crate) fn is_explicit(plant: &mut Plant, joints: &Vector, step_s: f64) -> bool {
    plant.fastest_rate(joints) * step_s < EXPLICIT_MAX && plant.fastest_frequency(joints) * step_s < EXPLICIT_PHASE_MAX
}

/// Effects that the three positioning joints can have, but not a tool axis, whose transmission is rigid.
const NEEDS_A_CABLE: &str = "the cables of joints 4 to 7 are rigid here; on them this effect cannot be";

/// Plant of joints 1 to 3 of an arm, with all effects of the robot; tool axes 4 to 7.
pub(crate) fn build(robot: &Robot, side: Side, homing_offset: &Motors) -> Result<(Plant, ToolAxes), PlantError> {
    let raven = &robot.raven;
    let numbers: Vec<DriveNumbers> = (0..FIRST).map(|joint| base_drive(robot, side, joint)).collect();
    let table = &raven.plant().transmission;
    let coupling = [vec![1.0, 0.0, 0.0], vec![table.coupling_01, 1.0, 0.0], vec![table.coupling_02, table.coupling_12, 1.0]];
    let integrator = &raven.plant().integrator;
    let mut plant = Plant::new(raven.rigid_body(side), &numbers, &coupling, Method::Rk4, integrator.substep_s)?;
    let drives = (FIRST..JOINTS).map(|joint| Drive::new(tool_drive(raven, side, joint))).collect();
    let mut tool = ToolAxes::new(drives, &[0.0; JOINTS]);
    for (joint, offset) in homing_offset.iter().enumerate().filter(|(_, offset)| **offset != 0.0) {
        let offset = Timed::new(crate::physics::JointOffset { o: *offset }, f64::NEG_INFINITY, f64::INFINITY);
        if joint < FIRST { plant.add_offset(offset, joint) } else { tool.offsets.push((offset, joint)) }
    }
    if let Some(presliding) = robot.presliding {
        for (joint, presliding) in presliding.into_iter().enumerate() {
            let slot = plant.memory()?;
            plant.drive_mut(joint).stiction = Some(Stiction { presliding, slot });
        }
    }
    if let Some(dragged) = robot.tool_cables {
        let (strain, faded) = (plant.memory()?, plant.memory()?);
        plant.drive_mut(INSERTION).dragged = Some(Held { dragged, strain, faded });
    }
    for effect in &robot.effects {
        add(&mut plant, &mut tool, effect)?;
    }
    plant.at(0.0);
    tool.at(0.0);
    let mut home = [0.0; JOINTS_MAX];
    home[..FIRST].copy_from_slice(&raven.plant().limits.home[..FIRST]);
    let method = if integrator.method == "rk4" && is_explicit(&mut plant, &home, integrator.substep_s) {
        Method::Rk4
    } else {
        Method::Rosenbrock
    };
    plant.set_step(method, integrator.substep_s);
    Ok((plant, tool))
}

pub(crate) fn base_drive(robot: &Robot, side: Side, joint: usize) -> DriveNumbers {
    let plant = robot.raven.plant();
    let (friction, table) = (&plant.friction, &plant.transmission);
    let cable = match &robot.cables {
        None => CableLaw::Exponential { ke_n: plant.cable.ke_n[joint], be_ns_m: plant.cable.be_ns_m[joint] },
        Some(pair) => CableLaw::pretensioned(
            pair.stiffness_n_m[joint],
            pair.stiffening_length_m[joint],
            pair.pretension_n[joint],
            plant.cable.be_ns_m[joint],
        ),
    };
    DriveNumbers {
        ratio: table.ratio[joint],
        gear: table.gear_big,
        inertia: plant.motor.inertia_capstan[joint],
        radius_m: plant.cable.joint_radius_m[joint],
        cable,
        motor: Rubbing {
            coulomb: friction.motor_coulomb_nm[joint],
            viscous: friction.motor_viscous_nm_s[joint],
            width: friction.motor_v_s_rad_s[joint],
        },
        joint: Rubbing {
            coulomb: friction.joint_coulomb[joint],
            viscous: friction.joint_viscous[joint],
            width: friction.joint_v_s[joint],
        },
        home: plant.limits.homing_stop[joint],
        torque_ref_nm: TORQUE_REF_NM[joint],
        torque_per_count_nm: robot.raven.arm(side).amplifiers.torque(joint, 1.0),
        between: Between::Cable,
        passive: Passive::NONE,
    }
}

fn tool_drive(raven: &Raven2, side: Side, joint: usize) -> DriveNumbers {
    let plant = raven.plant();
    let axis = joint - FIRST;
    DriveNumbers {
        ratio: plant.transmission.ratio[joint],
        gear: plant.transmission.gear_small,
        inertia: plant.tool_axes.inertia_capstan[axis],
        radius_m: 1.0,
        cable: CableLaw::Exponential { ke_n: 0.0, be_ns_m: 0.0 },
        motor: Rubbing {
            coulomb: plant.tool_axes.motor_coulomb_nm[axis],
            viscous: plant.tool_axes.motor_viscous_nm_s[axis],
            width: plant.friction.motor_v_s_rad_s[0],
        },
        joint: Rubbing { coulomb: 0.0, viscous: 0.0, width: plant.friction.joint_v_s[0] },
        home: plant.limits.homing_stop[joint],
        torque_ref_nm: TORQUE_REF_NM[joint],
        torque_per_count_nm: raven.arm(side).amplifiers.torque(joint, 1.0),
        between: Between::Cable,
        passive: Passive::NONE,
    }
}

/// Puts an effect where it belongs. What concerns only what is seen (delays, geometry, frames) is the simulation's.
fn add(plant: &mut Plant, tool: &mut ToolAxes, effect: &Effect) -> Result<(), PlantError> {
    let name = effect.physics.name();
    match effect.bound {
        Bound::Joint(joint) if joint < plant.joints() => on_joint(plant, effect, joint),
        Bound::Joint(joint) => on_tool(tool, effect, joint),
        Bound::Motor(joint) => {
            let drive = if joint < plant.joints() { plant.drive_mut(joint) } else { &mut tool.drives[joint - FIRST] };
            drive.rub_motor(effect);
            Ok(())
        }
        Bound::Pair(driven, driver) => {
            let Physics::JointCoupling(coupling) = effect.physics else { return Ok(()) };
            let timed = Timed::new(coupling, effect.from_s, effect.to_s);
            match (driven < FIRST, driver < FIRST) {
                (true, true) => plant.add_coupling(timed, driven, driver),
                (true, false) => {
                    let why = "joints 1 to 3 are driven by joints 1 to 3 only";
                    return Err(PlantError::Place { physics: name, joint: driven + 1, why });
                }
                (false, _) => tool.couplings.push((timed, driven, driver)),
            }
            Ok(())
        }
        Bound::Link(link) => match effect.physics {
            Physics::LinkInertia(_) if link >= plant.joints() => {
                Err(PlantError::Place { physics: name, joint: link + 1, why: "only links 1 to 3 have inertia" })
            }
            Physics::LinkInertia(change) => {
                plant.add_inertia(Timed::new(change, effect.from_s, effect.to_s), link);
                Ok(())
            }
            Physics::LinkGeometry(_) if link >= 6 => {
                Err(PlantError::Place { physics: name, joint: link + 1, why: "the chain has links 1 to 6" })
            }
            _ => Ok(()),
        },
        Bound::Channel(_) => Ok(()),
        Bound::Robot => {
            match effect.physics {
                Physics::Payload(payload) => plant.add_payload(Timed::new(payload, effect.from_s, effect.to_s)),
                Physics::GravityDirection(tilt) => plant.add_gravity(Timed::new(tilt, effect.from_s, effect.to_s)),
                Physics::ExternalContact(contact) => plant.add_contact(Timed::new(contact, effect.from_s, effect.to_s)),
                _ => {}
            }
            Ok(())
        }
    }
}

/// Puts an effect of a joint into its drive.
pub(crate) fn on_joint(plant: &mut Plant, effect: &Effect, joint: usize) -> Result<(), PlantError> {
    let (from, to) = (effect.from_s, effect.to_s);
    match effect.physics {
        Physics::JointOffset(offset) => plant.add_offset(Timed::new(offset, from, to), joint),
        Physics::CableHysteresis(cable) => {
            let slot = plant.memory()?;
            plant.drive_mut(joint).hysteresis.push((Timed::new(cable, from, to), slot));
        }
        Physics::CableCreep(creep) => {
            let slot = plant.memory()?;
            plant.drive_mut(joint).creep.push((Timed::new(creep, from, to), slot));
        }
        Physics::ThermalDrift(drift) => {
            let slot = plant.memory()?;
            plant.drive_mut(joint).thermal.push((Timed::new(drift, from, to), slot));
        }
        Physics::LoadDependentFriction(friction) => plant.drive_mut(joint).load.push(Timed::new(friction, from, to)),
        Physics::CableStretch(stretch) => plant.drive_mut(joint).stretch.push(Timed::new(stretch, from, to)),
        physics => anywhere(plant.drive_mut(joint), physics, from, to),
    }
    Ok(())
}

fn on_tool(tool: &mut ToolAxes, effect: &Effect, joint: usize) -> Result<(), PlantError> {
    let (from, to) = (effect.from_s, effect.to_s);
    match effect.physics {
        Physics::JointOffset(offset) => tool.offsets.push((Timed::new(offset, from, to), joint)),
        Physics::ThermalDrift(drift) => {
            let drive = &mut tool.drives[joint - FIRST];
            let slot = drive.thermal.len();
            drive.thermal.push((Timed::new(drift, from, to), slot));
            tool.grow_memories();
        }
        Physics::CableHysteresis(_) | Physics::CableCreep(_) | Physics::CableStretch(_) | Physics::LoadDependentFriction(_) => {
            return Err(PlantError::Place { physics: effect.physics.name(), joint: joint + 1, why: NEEDS_A_CABLE });
        }
        physics => anywhere(&mut tool.drives[joint - FIRST], physics, from, to),
    }
    Ok(())
}

/// Effects that any drive can have.
fn anywhere(drive: &mut Drive, physics: Physics, from: f64, to: f64) {
    match physics {
        Physics::CoulombFriction(friction) => drive.coulomb.push(Timed::new(friction, from, to)),
        Physics::ViscousFriction(friction) => drive.viscous.push(Timed::new(friction, from, to)),
        Physics::StribeckFriction(friction) => drive.stribeck.push(Timed::new(friction, from, to)),
        Physics::Backlash(backlash) => drive.backlash.push(Timed::new(backlash, from, to)),
        Physics::TorqueRipple(ripple) => drive.ripple.push(Timed::new(ripple, from, to)),
        Physics::MotorTorqueScale(scale) => drive.scale.push(Timed::new(scale, from, to)),
        Physics::TransmissionRatio(ratio) => drive.ratio.push(Timed::new(ratio, from, to)),
        Physics::PulleyEccentricity(pulley) => drive.eccentricity.push(Timed::new(pulley, from, to)),
        _ => {}
    }
}

/// The robot with the links as they are, for where the tip truly is.
pub(crate) fn true_geometry(robot: &Robot, side: Side) -> Raven2 {
    let mut plant = robot.raven.plant().clone();
    for effect in &robot.effects {
        if let (Physics::LinkGeometry(LinkGeometry { d_alpha, d_length }), Bound::Link(link)) = (effect.physics, effect.bound) {
            let rows = match side {
                Side::Gold => &mut plant.kinematics.gold,
                Side::Green => &mut plant.kinematics.green,
            };
            rows.alpha_deg[link] += d_alpha.to_degrees();
            // Longer, whichever way the row counts it.
            let longer = |length: f64| length + d_length * length.signum();
            match &mut rows.d_m[link] {
                LengthEntry::Constant(length) if rows.a_m[link] == 0.0 => *length = longer(*length),
                _ => rows.a_m[link] = longer(rows.a_m[link]),
            }
        }
    }
    Raven2::from_plant(plant)
}
