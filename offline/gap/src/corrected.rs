//! The robot model with what was missing.

use recordings::Recording;
use simulator::model::{Bound, Connection, Effect, RobotModel};
use simulator::physics::{
    Backlash, CableStretch, Channel as DelayChannel, CoulombFriction, JointCoupling, JointOffset, LinkGeometry, MotorTorqueScale,
    Parameters, Payload, Physics, TorqueRipple, TransmissionRatio, Value, ViscousFriction,
};

use arm::serial::{LinkInertia, PARAMETERS};
use nalgebra::Vector3;

use crate::builtin::along_motion;
use crate::found::Found;
use crate::given::Given;
use crate::hypothesis::{
    ALWAYS, AT_MOTOR, Candidate, DRIFTS, LATE_COUPLING, LATE_TORQUES, NEVER, SENSOR, TOOL_LENGTH, TOOL_TWIST, WITH_OTHER_LINKS,
    Window, direction, shift,
};
use crate::intervals::Estimate;
use crate::known;
use crate::motion::{Band, Motion};
use crate::turning::Turning;

/// What is believed of the robot, with and without what was missing.
pub(crate) struct Corrected {
    /// The given model, and what the simulator was learnt to believe.
    pub(crate) before: RobotModel,
    /// The same with the effects that were found.
    pub(crate) after: RobotModel,
    /// The same for each run that was held out, with the effects when they are there, if they are.
    pub(crate) there: Vec<RobotModel>,
    /// Effects that no simulator can be given, each with the reason.
    pub(crate) left_out: Vec<String>,
}

impl Corrected {
    /// Text of corrected.toml; what is not in it stands in its first lines.
    pub(crate) fn to_toml(&self) -> String {
        let told: Vec<String> = self.left_out.iter().map(|why| format!("# Not in this model: {why}.\n")).collect();
        told.concat() + &self.after.to_toml()
    }
}

/// The given model with what was missing.
pub(crate) fn model(given: &RobotModel, found: &Found, (runs, band): (&[Given], Band)) -> Corrected {
    let mut before = given.clone();
    if found.learnt && runs.iter().any(|one| one.sim.is_some()) {
        believe(&mut before, found);
        before.model_error = known::model_error(&before, found.robot, runs, band);
    }
    let (mut after, mut left_out) = (before.clone(), Vec::new());
    let mut there = vec![before.clone(); found.held.pairs.len()];
    let told = |candidate: &Candidate, why: &str| format!("{}: {why}", named(found, candidate));
    for (k, (effect, estimate)) in found.answer.effects.iter().zip(found.estimates).enumerate() {
        let candidate = &effect.chosen.candidate;
        let window = last_window(found, k);
        let put = |model: &RobotModel, window: Window| {
            let mut with = model.clone();
            // The model has the inertia of its drives; all else is an effect.
            let all = if candidate.is_of_a_drive() {
                put_on_rotor(&mut with, candidate.family.joints[0], estimate.coefficients[0])?;
                Vec::new()
            } else {
                let main = as_effect(found, candidate, estimate, window)?;
                [main].into_iter().chain(beside(&before, candidate, estimate, window)).collect()
            };
            for (effect, sign) in all {
                if !merged(&mut with, &effect, sign) {
                    if sign < 0.0 {
                        return Err::<_, String>("there is less of it than none".to_owned());
                    }
                    with.effects_mut().push(effect);
                }
            }
            // A file that could not be read again, or a simulation that runs away, would be worse than one without the effect.
            with.plant().map_err(|error| error.to_string())?;
            stays(&with, &runs[0].real)?;
            RobotModel::from_toml(&with.to_toml(), None).map_err(|error| error.to_string())?;
            Ok(with)
        };
        match put(&after, window) {
            Ok(with) => {
                for (run, model) in there.iter_mut().enumerate() {
                    let own = if found.is_later_part() { window } else { found.window_there(k, run) };
                    *model = match own {
                        NEVER => continue,
                        _ if own == window && *model == after => with.clone(),
                        // What can be put into one can be put into all.
                        _ => put(model, own).unwrap_or_else(|_| model.clone()),
                    };
                }
                after = with;
                if !found.is_later_part() && windows(found, k).any(|other| other != window) {
                    left_out.push(told(candidate, "when it is there in other runs than the last one where it is"));
                }
                if candidate.family.physics == "link_geometry" && candidate.family.form.ends_with(", torque too") {
                    left_out.push(told(candidate, "the torque that its weight asks for then is not a term of the simulator"));
                }
                if candidate.family.form == WITH_OTHER_LINKS {
                    left_out
                        .push(told(candidate, "what links add to it that are not as the file has them, which nothing else tells"));
                }
                if candidate.family.form == LATE_COUPLING {
                    left_out.push(told(
                        candidate,
                        "the part of it that comes late, by the other joint's play, is not a term of the simulator",
                    ));
                }
            }
            Err(why) => left_out.push(told(candidate, &why)),
        }
    }
    after.set_name(&format!("{} corrected", given.name()));
    Corrected { before, after, there, left_out }
}

/// When an effect is there, run by run.
fn windows(found: &Found, effect: usize) -> impl DoubleEndedIterator<Item = Window> {
    let fitted = (0..found.problem.pairs.len()).map(move |run| found.answer.effects[effect].chosen.candidate.window_of(run));
    fitted.chain((0..found.held.pairs.len()).map(move |run| found.window_there(effect, run)))
}

/// When it is there in the last run that has it; in the only one, from when it begins where it was fitted to when it ends in the rest.
fn last_window(found: &Found, effect: usize) -> Window {
    if found.is_later_part() {
        let ([from, to], there) = (found.answer.effects[effect].chosen.candidate.window_of(0), found.window_there(effect, 0));
        let ends = to.min(found.held.pairs[0].real.run.elapsed_s(0));
        return [from, if there == NEVER { ends } else { there[1] }];
    }
    windows(found, effect).rev().find(|window| *window != NEVER).unwrap_or(ALWAYS)
}

/// Largest number in any unit that a robot's simulation may reach.
const FAR: f64 = 1e6;

/// Does a model stay where numbers mean something, along a recorded motion?
fn stays(model: &RobotModel, real: &Recording) -> Result<(), String> {
    // What cannot be played at all is told elsewhere.
    let Ok(played) = along_motion(model, real) else { return Ok(()) };
    let away = played.columns.iter().find(|column| !column.values.iter().all(|value| value.abs() < FAR));
    away.map_or(Ok(()), |column| Err(format!("the simulator runs away with it ({})", column.name)))
}

/// Puts more (or less: a sign of -1) of what the model has already into the effect that it has; false where it has none, or the two do not
/// add up to one of their kind.
fn merged(model: &mut RobotModel, more: &Effect, sign: f64) -> bool {
    let always = |effect: &Effect| effect.from_s == f64::NEG_INFINITY && effect.to_s == f64::INFINITY;
    let same = |effect: &&mut Effect| {
        effect.physics.name() == more.physics.name() && effect.bound == more.bound && always(effect) && always(more)
    };
    let Some(at) = model.effects_mut().iter_mut().position(|mut effect| same(&mut effect)) else {
        return sign < 0.0 && always(more) && taken_off_drive(model, more);
    };
    let own = &mut model.effects_mut()[at];
    let both = match (own.physics, more.physics) {
        (Physics::CoulombFriction(a), Physics::CoulombFriction(b)) if a.asymmetry == 0.0 && b.asymmetry == 0.0 => {
            Physics::CoulombFriction(CoulombFriction { f_c: a.f_c + sign * b.f_c, ..a })
        }
        (Physics::ViscousFriction(a), Physics::ViscousFriction(b)) => {
            Physics::ViscousFriction(ViscousFriction { b: a.b + sign * b.b })
        }
        (Physics::Backlash(a), Physics::Backlash(b)) => Physics::Backlash(Backlash { b: a.b + sign * b.b }),
        (Physics::CableStretch(a), Physics::CableStretch(b)) => {
            // In series: compliances add up.
            Physics::CableStretch(CableStretch { k: 1.0 / (1.0 / a.k + sign / b.k), ..a })
        }
        (Physics::JointCoupling(a), Physics::JointCoupling(b)) => Physics::JointCoupling(JointCoupling { c_ij: a.c_ij + b.c_ij }),
        (Physics::JointOffset(a), Physics::JointOffset(b)) => Physics::JointOffset(JointOffset { o: a.o + b.o }),
        (Physics::TransmissionRatio(a), Physics::TransmissionRatio(b)) => {
            Physics::TransmissionRatio(TransmissionRatio { e: a.e + b.e })
        }
        (Physics::LinkGeometry(a), Physics::LinkGeometry(b)) => {
            Physics::LinkGeometry(LinkGeometry { d_alpha: a.d_alpha + b.d_alpha, d_length: a.d_length + b.d_length })
        }
        (Physics::MotorTorqueScale(a), Physics::MotorTorqueScale(b)) if a.d_0 == 0.0 && b.d_0 == 0.0 => {
            Physics::MotorTorqueScale(MotorTorqueScale { kappa: a.kappa * b.kappa, ..a })
        }
        (Physics::TorqueRipple(a), Physics::TorqueRipple(b)) if a.order == b.order => {
            let [sine, cosine] = [f64::cos, f64::sin].map(|part| a.amplitude * part(a.phase) + sign * b.amplitude * part(b.phase));
            Physics::TorqueRipple(TorqueRipple { amplitude: sine.hypot(cosine), phase: cosine.atan2(sine), ..a })
        }
        (Physics::Payload(a), Physics::Payload(b)) => {
            let mass_kg = a.mass_kg + sign * b.mass_kg;
            let moment = |k: usize| a.mass_kg * a.centre_m[k] + sign * b.mass_kg * b.centre_m[k];
            Physics::Payload(Payload { mass_kg, centre_m: std::array::from_fn(|k| moment(k) / mass_kg) })
        }
        _ => return false,
    };
    let (before, after) = (amount(&own.physics), amount(&both));
    if after < 0.0 && -after < NOTHING * before {
        // All of it is gone, as far as its size is known.
        model.effects_mut().remove(at);
        return true;
    }
    // What is below nothing is not one of its kind: the caller is told when it is read again.
    own.physics = both;
    own.source.clone_from(&more.source);
    true
}

/// Less of the friction, or of the give of the cable, that the drive itself has; false where it has not so much.
fn taken_off_drive(model: &mut RobotModel, less: &Effect) -> bool {
    let (Bound::Joint(joint) | Bound::Motor(joint)) = less.bound else { return false };
    let Some(mut drive) = model.drives().get(joint).copied() else { return false };
    if let Physics::CableStretch(CableStretch { k, .. }) = less.physics {
        // In series: compliances are taken from one another.
        drive.stiffness = 1.0 / (1.0 / drive.stiffness - 1.0 / k);
        return drive.stiffness.is_finite() && drive.stiffness > 0.0 && model.set_drive(joint, &drive).is_ok();
    }
    let ratio = drive.reduction.abs();
    let (at_joint, at_motor, scale, amount) = match less.physics {
        Physics::CoulombFriction(CoulombFriction { f_c, .. }) => {
            (&mut drive.joint_coulomb, &mut drive.motor_coulomb_nm, ratio, f_c)
        }
        Physics::ViscousFriction(ViscousFriction { b }) => {
            (&mut drive.joint_viscous, &mut drive.motor_viscous_nm_s, ratio * ratio, b)
        }
        _ => return false,
    };
    let there = *at_joint + scale * *at_motor;
    if there <= 0.0 || amount > (1.0 + NOTHING) * there {
        return false;
    }
    let left = (1.0 - amount / there).max(0.0);
    *at_joint *= left;
    *at_motor *= left;
    model.set_drive(joint, &drive).is_ok()
}

/// More, or less, inertia of a joint's drive, as the joint feels it.
fn put_on_rotor(model: &mut RobotModel, joint: usize, more: f64) -> Result<(), String> {
    let mut drive = *model.drives().get(joint).ok_or("it has no drive")?;
    drive.rotor_inertia_kg_m2 += more / (drive.reduction * drive.reduction);
    if drive.rotor_inertia_kg_m2 < 0.0 {
        return Err("there is less of it than none".to_owned());
    }
    model.set_drive(joint, &drive).map_err(|error| error.to_string())
}

/// Share of an effect by which more than all of it may seem to be gone.
const NOTHING: f64 = 0.1;

/// How much there is of what cannot be less than nothing; 1 of anything else.
fn amount(physics: &Physics) -> f64 {
    match physics {
        Physics::CoulombFriction(friction) => friction.f_c,
        Physics::ViscousFriction(friction) => friction.b,
        Physics::Backlash(play) => play.b,
        Physics::CableStretch(cable) => 1.0 / cable.k,
        _ => 1.0,
    }
}

/// An effect and where it is, in words.
fn named(found: &Found, candidate: &Candidate) -> String {
    let places = crate::told::joints(found.robot, candidate);
    let at = if places.is_empty() { String::new() } else { format!(" of {}", places.join(" and ")) };
    format!("{}{at}", candidate.family.physics.replace('_', " "))
}

/// What goes with an effect, and -1 where it is to be taken off: the offset of the joint with a ratio or a coupling, which is right elsewhere than
/// where the simulator has it (a ratio where the joint was homed, a coupling at zero); what sliding friction is less, with that at rest.
fn beside(model: &RobotModel, candidate: &Candidate, estimate: &Estimate, window: Window) -> Option<(Effect, f64)> {
    let (family, theta) = (&candidate.family, &estimate.coefficients);
    if family.physics == "stribeck_friction" && theta[0] < 0.0 {
        let less = Physics::CoulombFriction(CoulombFriction { f_c: -theta[0], asymmetry: 0.0 });
        return Some((windowed(Effect::new(less, Bound::Joint(*family.joints.first()?)), window), -1.0));
    }
    let constant = match (family.physics, family.form) {
        ("transmission_ratio", _) => {
            let home = model.drives().get(*family.joints.first()?)?.home;
            theta.get(1).copied().unwrap_or(0.0) + theta[0] * home
        }
        ("joint_coupling", "position about a place" | LATE_COUPLING) => *theta.last()?,
        _ => return None,
    };
    if constant == 0.0 {
        return None;
    }
    let physics = Physics::JointOffset(JointOffset { o: constant });
    let mut effect = windowed(Effect::new(physics, Bound::Joint(*family.joints.first()?)), window);
    effect.source = Some(format!("ravenpose gap (constant of {} {})", family.physics, family.form));
    Some((effect, 1.0))
}

/// The effect in a window.
fn windowed(mut effect: Effect, [from_s, to_s]: Window) -> Effect {
    (effect.from_s, effect.to_s) = (from_s, to_s);
    effect
}

/// Links and drives as learnt from the simulator's output.
fn believe(model: &mut RobotModel, found: &Found) {
    let sims: Vec<&Motion> = found.problem.pairs.iter().filter_map(|pair| pair.sim.as_ref()).collect();
    let turning = Turning::learn(found.robot, found.nominal, &sims);
    for (j, mut drive) in model.drives().into_iter().enumerate().take(found.robot.joint_count()) {
        let [rotor, ..] = found.nominal.drives[j];
        let square = drive.reduction * drive.reduction;
        let compliance = found.nominal.compliance[j][0];
        if drive.connection == Connection::Force {
            continue;
        }
        let Turning { viscous, coulomb, width } = turning[j];
        // Behind the cable there is that part of the friction that stretches it.
        let [viscous_behind, coulomb_behind] = found.nominal.link_friction[j];
        (drive.joint_coulomb, drive.joint_viscous) = (coulomb_behind.min(coulomb.max(0.0)), viscous_behind.min(viscous.max(0.0)));
        drive.rotor_inertia_kg_m2 = (rotor / square).max(0.0);
        drive.motor_viscous_nm_s = (viscous - drive.joint_viscous).max(0.0) / square;
        drive.motor_coulomb_nm = (coulomb - drive.joint_coulomb).max(0.0) / drive.reduction.abs();
        if let Some(width) = width {
            drive.joint_sign_width = width;
            drive.motor_sign_width_rad_s = width * drive.reduction.abs();
        }
        if compliance > 0.0 {
            drive.connection = Connection::Cable;
            drive.stiffness = 1.0 / compliance;
            // A tenth of critical, so that a step settles.
            drive.damping = 0.2 * (drive.stiffness * rotor.abs().max(1e-6)).sqrt();
        }
        // What a plant cannot have (a drive of another kind) stays as it was.
        let _ = model.set_drive(j, &drive);
    }
    for (link, learnt) in found.nominal.inertial.as_chunks::<PARAMETERS>().0.iter().enumerate() {
        // A link that was learnt to weigh less than nothing stays as the lab has it.
        let _ = model.set_link_inertia(link, &LinkInertia::from_parameters(learnt));
    }
}

/// One effect for the simulator, and -1 where it is to be taken off; the reason where it has no such term.
fn as_effect(found: &Found, candidate: &Candidate, estimate: &Estimate, window: Window) -> Result<(Effect, f64), String> {
    let family = &candidate.family;
    let joint = family.joints.first().copied();
    let numbers: Vec<(&str, f64)> = estimate.parameters.iter().map(|(named, _)| (named.name, named.value)).collect();
    let mut parameters = Parameters::of(&numbers);
    // Before the cable, where there is one.
    let on_motor = AT_MOTOR.contains(&family.form) && joint.is_some_and(|j| found.nominal.compliance[j][0] > 0.0);
    let at_joint = || joint.map(if on_motor { Bound::Motor } else { Bound::Joint }).ok_or_else(|| "it has no joint".to_owned());
    let mut name = family.physics;
    let bound = match (family.physics, family.form) {
        ("payload", _) if candidate.shape_of("link").is_some_and(|link| link as usize + 1 < found.robot.joint_count()) => {
            // A weight on another link than the last one: what it adds to that link.
            let place = Vector3::from(["c_x", "c_y", "c_z"].map(|name| candidate.shape_of(name).unwrap_or(0.0)));
            let added = LinkInertia::point(estimate.coefficients[0], place).parameters();
            parameters = vector("dpi_B", added.to_vec());
            name = "link_inertia";
            Bound::Link(candidate.shape_of("link").unwrap_or(0.0) as usize)
        }
        ("joint_coupling", _) => Bound::Pair(family.joints[0], family.joints[1]),
        ("link_inertia", _) => {
            parameters = vector("dpi_B", link_change(found, candidate, &estimate.coefficients)?);
            joint.map(Bound::Link).ok_or("it has no link")?
        }
        ("link_geometry", form) => {
            let link = joint.ok_or("it has no link")?;
            if let Some(shift) = shift(&found.robot.arm, family) {
                // A RAVEN-II's insertion is longer along x, which no frame before it shows.
                let longer = shift.longer.filter(|_| found.robot.with_wrist.is_none() || !found.robot.prismatic[link]);
                let sign = longer.ok_or("a link moved across its length is not a term of the simulator")?;
                parameters = Parameters::of(&[("d_length", sign * estimate.coefficients[0])]);
            }
            // The tool comes after the last link.
            Bound::Link(if [TOOL_LENGTH, TOOL_TWIST].contains(&form) { link + 1 } else { link })
        }
        ("measurement_delay", "joint encoders") if estimate.coefficients[0] < 0.0 => {
            return Err("the simulator has no late motor positions".to_owned());
        }
        ("measurement_delay", form) => Bound::Channel(match form {
            "joint encoders" => DelayChannel::Transmission,
            form if LATE_TORQUES.contains(&form) => return Err("the simulator has no late torque".to_owned()),
            _ => DelayChannel::EndEffector,
        }),
        ("gravity_direction", _) => {
            for name in ["a", "b"] {
                let _ = parameters.0.entry(name.to_owned()).or_insert(Value::Number(0.0));
            }
            Bound::Robot
        }
        ("payload" | "frame_misalignment", _) => Bound::Robot,
        ("external_contact", _) => {
            let angles = candidate.shape_of("azimuth").zip(candidate.shape_of("elevation"));
            let (azimuth, elevation) = angles.ok_or("a force without a wall is not a term of the simulator")?;
            let normal = direction(azimuth, elevation);
            let _ = parameters.0.insert("n".to_owned(), Value::Vector(normal.as_slice().to_vec()));
            Bound::Robot
        }
        ("stribeck_friction", _) if estimate.coefficients[0] < 0.0 => {
            // Sliding friction is less beside it.
            let _ = parameters.0.insert("f_c".to_owned(), Value::Number(0.0));
            let _ = parameters.0.insert("f_s".to_owned(), Value::Number(estimate.coefficients[1]));
            at_joint()?
        }
        ("load_dependent_friction", _) => {
            let _ = parameters.0.remove("mu_theta");
            joint.map(Bound::Joint).ok_or("it has no joint")?
        }
        ("motor_torque_scale", form) if form.ends_with("offset") && !parameters.0.contains_key("d_0") => {
            return Err("its offset is in counts of the amplifier, and the robot's file has no torque_constant_nm_a and \
                        counts_per_a of the drive"
                .to_owned());
        }
        ("thermal_drift", _) if !parameters.0.contains_key("kappa_T") => {
            return Err(if DRIFTS.contains(&family.form) {
                "a position that drifts is not a term of the simulator".to_owned()
            } else {
                "the model has no friction there that could fade".to_owned()
            });
        }
        ("joint_offset", SENSOR) => return Err("a sensor at a joint whose zero is off is not a term of the simulator".to_owned()),
        ("cable_hysteresis", "play of many widths") => {
            return Err("play of many widths, of a joint without known load, is not a term of the simulator".to_owned());
        }
        _ => at_joint()?,
    };
    if family.physics == "measurement_delay" && parameters.0.values().any(|value| matches!(value, Value::Number(age) if *age < 0.0))
    {
        return Err("a simulator cannot look ahead".to_owned());
    }
    let sign = less(name, &mut parameters);
    let physics = Physics::new(name, &parameters).ok_or("the simulator does not know it")?.map_err(|error| error.to_string())?;
    let mut effect = windowed(Effect::new(physics, bound), window);
    let told = if name == family.physics { family.form.to_owned() } else { format!("{} {}", family.physics, family.form) };
    effect.source = Some(format!("ravenpose gap ({told})"));
    Ok((effect, sign))
}

/// Sizes that cannot be negative, of what the model may hold too much of.
const SIZES: [(&str, &str); 5] =
    [("coulomb_friction", "f_c"), ("viscous_friction", "b"), ("backlash", "b"), ("cable_stretch", "k"), ("payload", "m_p")];

/// -1 where there is less than the model holds; the parameter is then how much less.
fn less(physics: &str, parameters: &mut Parameters) -> f64 {
    let size = SIZES.iter().find(|(name, _)| *name == physics).map(|(_, parameter)| *parameter);
    match size.and_then(|name| parameters.0.get_mut(name)) {
        Some(Value::Number(size)) if *size < 0.0 => {
            *size = -*size;
            -1.0
        }
        _ => 1.0,
    }
}

fn vector(name: &str, values: Vec<f64>) -> Parameters {
    let mut parameters = Parameters::of(&[]);
    let _ = parameters.0.insert(name.to_owned(), Value::Vector(values));
    parameters
}

/// Change of the ten parameters of a link.
fn link_change(found: &Found, candidate: &Candidate, theta: &[f64]) -> Result<Vec<f64>, String> {
    let link = *candidate.family.joints.first().ok_or("it has no link")?;
    let own = found.robot.arm.link_inertia(link).parameters();
    match (candidate.family.form, theta) {
        ("scaled", [share, ..]) => Ok(own.iter().map(|x| x * share).collect()),
        _ => Err("its parameters are known in the combinations that the motion shows, not one by one".to_owned()),
    }
}
