//! The robot model with what was missing.

use simulator::model::{Bound, Connection, Effect, RobotModel};
use simulator::physics::{Channel as DelayChannel, Parameters, Physics, Value};

use crate::analysis::Found;
use crate::hypothesis::{Candidate, normals};
use crate::intervals::Estimate;

/// Text of corrected.toml: the given model, what the simulator was learnt to believe, and the effects that were found.
pub(crate) fn model(given: &RobotModel, found: &Found, learnt: bool) -> String {
    let mut model = given.clone();
    if learnt {
        believe(&mut model, found);
    }
    for (effect, estimate) in found.answer.effects.iter().zip(found.estimates) {
        if let Some(effect) = as_effect(found, &effect.chosen.candidate, estimate) {
            model.effects_mut().push(effect);
        }
    }
    model.set_name(&format!("{} corrected", given.name()));
    model.to_toml()
}

/// Drives as learnt from the simulator's output; links stay as the lab has them.
fn believe(model: &mut RobotModel, found: &Found) {
    for (j, mut drive) in model.drives().into_iter().enumerate().take(found.robot.joint_count()) {
        let [rotor, viscous, coulomb, _] = found.nominal.drives[j];
        let square = drive.reduction * drive.reduction;
        let compliance = found.nominal.compliance[j][0];
        if drive.connection == Connection::Force {
            continue;
        }
        drive.rotor_inertia_kg_m2 = (rotor / square).max(0.0);
        drive.motor_viscous_nm_s = (viscous / square).max(0.0);
        drive.motor_coulomb_nm = (coulomb / drive.reduction.abs()).max(0.0);
        (drive.joint_coulomb, drive.joint_viscous) = (0.0, 0.0);
        if compliance > 0.0 {
            drive.connection = Connection::Cable;
            drive.stiffness = 1.0 / compliance;
            // A tenth of critical, so that a step settles.
            drive.damping = 0.2 * (drive.stiffness * rotor.abs().max(1e-6)).sqrt();
        }
        // What a plant cannot have (a drive of another kind) stays as it was.
        let _ = model.set_drive(j, &drive);
    }
}

/// One effect for the simulator; none where it has no such term.
fn as_effect(found: &Found, candidate: &Candidate, estimate: &Estimate) -> Option<Effect> {
    let family = &candidate.family;
    let joint = family.joints.first().copied();
    let numbers: Vec<(&str, f64)> = estimate.parameters.iter().map(|(named, _)| (named.name, named.value)).collect();
    let mut parameters = Parameters::of(&numbers);
    let bound = match family.physics {
        "payload" if candidate.shape_of("link").is_some_and(|link| link as usize + 1 < found.robot.joint_count()) => {
            // A weight on another link than the last one: what it adds to that link.
            let place = nalgebra::Vector3::from(["c_x", "c_y", "c_z"].map(|name| candidate.shape_of(name).unwrap_or(0.0)));
            let added = arm::serial::LinkInertia::point(estimate.coefficients[0], place).parameters();
            parameters = Parameters::of(&[]);
            let _ = parameters.0.insert("dpi_B".to_owned(), Value::Vector(added.to_vec()));
            let link = candidate.shape_of("link")? as usize;
            return Physics::new("link_inertia", &parameters)?.ok().map(|physics| Effect {
                source: Some(format!("ravenpose gap (payload {})", family.form)),
                ..Effect::new(physics, Bound::Link(link))
            });
        }
        "joint_coupling" => Bound::Pair(family.joints[0], family.joints[1]),
        "link_inertia" => {
            let change = link_change(found, candidate, &estimate.coefficients)?;
            parameters = Parameters::of(&[]);
            let _ = parameters.0.insert("dpi_B".to_owned(), Value::Vector(change));
            Bound::Link(joint?)
        }
        "link_geometry" => Bound::Link(if family.form == "length" { joint? + 1 } else { joint? }),
        "measurement_delay" => Bound::Channel(match family.form {
            "joint encoders" => DelayChannel::Transmission,
            "torque" => return None,
            _ => DelayChannel::EndEffector,
        }),
        "payload" | "gravity_direction" | "frame_misalignment" => Bound::Robot,
        "external_contact" => {
            let normal = normals().get(candidate.shape_of("normal")? as usize).copied()?;
            let _ = parameters.0.insert("n".to_owned(), Value::Vector(normal.as_slice().to_vec()));
            Bound::Robot
        }
        "load_dependent_friction" => {
            let _ = parameters.0.remove("mu_theta");
            Bound::Joint(joint?)
        }
        _ => Bound::Joint(joint?),
    };
    if family.physics == "measurement_delay" {
        // A simulator cannot look ahead.
        parameters.0.retain(|_, value| matches!(value, Value::Number(x) if *x >= 0.0));
    }
    let physics = Physics::new(family.physics, &parameters)?.ok()?;
    let mut effect = Effect::new(physics, bound);
    if let Some([from, to]) = estimate.window {
        effect.from_s = from.map_or(f64::NEG_INFINITY, |(t, _)| t);
        effect.to_s = to.map_or(f64::INFINITY, |(t, _)| t);
    }
    effect.source = Some(format!("ravenpose gap ({})", family.form));
    Some(effect)
}

/// Change of the ten parameters of a link.
fn link_change(found: &Found, candidate: &Candidate, theta: &[f64]) -> Option<Vec<f64>> {
    let link = *candidate.family.joints.first()?;
    let own = found.robot.arm.link_inertia(link).parameters();
    (candidate.family.form == "scaled").then(|| own.iter().map(|x| x * theta[0]).collect())
}
