//! Draws an effect: where, its shape, and the parameters that grow with its size.

use crate::arm::Motion;
use crate::draft_more;
use crate::effect::Effect;
use crate::random::Random;
use crate::scene::{Draft, Growth, Scene, draft, place, times};
use crate::severity::Channel;

/// Draws an effect of the given physics at joint `j` (counted from 0; ignored by effects of the whole robot).
pub fn draw(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    friction(physics, j, scene, random)
        .or_else(|| transmission(physics, j, scene, random))
        .or_else(|| bodies(physics, j, scene, random))
        .or_else(|| draft_more::vocabulary(physics, j, scene, random))
        .or_else(|| draft_more::outside(physics, j, scene, random))
}

fn friction(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let at = |parameters: &[(&str, f64)]| Effect::at(physics, Some(j + 1), parameters);
    let noise = scene.torque_noise(j);
    // five times the dry friction that the drive has
    let largest = 5.0 * scene.arm.drives[j].dry * scene.arm.drives[j].ratio / noise;
    let torque = place(Channel::JointTorque, Some(j));
    // most cable friction is met before the cable stretches; some after
    let at_link = f64::from(random.chance(0.2));
    Some(match physics {
        "coulomb_friction" => draft(at(&[]), vec![times("f_c", noise)], largest, torque, &[("at_link", at_link)]),
        "viscous_friction" => draft(at(&[]), vec![times("b", noise / scene.speed(j))], largest, torque, &[("at_link", at_link)]),
        "stribeck_friction" => {
            let speed = random.log_uniform(0.15, 0.6) * scene.speed(j);
            let (ratio, power) = (random.uniform(1.7, 2.5), random.uniform(1.0, 2.0));
            let shape = at(&[("v_s", speed), ("a", power)]);
            draft(shape, vec![times("f_c", 0.8 * noise), times("f_s", 0.8 * ratio * noise)], largest, torque, &[])
        }
        "load_dependent_friction" => {
            let share = random.uniform(0.0, 0.3);
            let growing = vec![times("f_0", share * noise), times("mu_l", (1.0 - share) * noise / scene.load(j))];
            draft(at(&[]), growing, f64::min(largest, 0.6 * scene.load(j) / noise), torque, &[])
        }
        "thermal_drift" => {
            let time = random.log_uniform(6.0, 60.0);
            let reference = scene.rms(|run, k| run.torque[k][j]);
            let warm = 1.0 - f64::exp(-6.0 / time);
            if random.chance(0.25) {
                // the same shape in position
                let joint_noise = scene.joint_noise(j);
                let base = joint_noise / warm * random.sign();
                let shown = place(Channel::Transmission, Some(j));
                let growing = vec![("drift", false, Growth::Times(base))];
                let largest = warm * if scene.arm.joints[j].motion == Motion::Turns { 0.02 } else { 0.003 } / joint_noise;
                return Some(draft(at(&[("T", time)]), growing, largest, shown, &[("reference", reference)]));
            }
            let level = scene.arm.drives[j].dry * scene.arm.drives[j].ratio * warm;
            let sign = if random.chance(0.7) { 1.0 } else { -1.0 };
            let growing = vec![times("kappa_T", sign * noise / level)];
            draft(at(&[("T", time)]), growing, 0.6 * level / noise, torque, &[("reference", reference)])
        }
        _ => return None,
    })
}

fn transmission(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let at = |parameters: &[(&str, f64)]| Effect::at(physics, Some(j + 1), parameters);
    let noise = scene.joint_noise(j);
    let joint = &scene.arm.joints[j];
    let stiffness = scene.arm.drives[j].stiffness;
    let shown = place(Channel::Transmission, Some(j));
    let turns = joint.motion == Motion::Turns;
    Some(match physics {
        "backlash" => draft(at(&[]), vec![times("b", 2.2 * noise)], if turns { 0.02 } else { 0.003 } / (2.2 * noise), shown, &[]),
        "cable_stretch" => {
            let base = noise / scene.load(j);
            draft(at(&[]), vec![("k", true, Growth::Over(1.0 / base))], 4.0 / (stiffness * base), shown, &[])
        }
        "cable_hysteresis" => {
            let [low, high] = scene.range(|run, k| run.load[k][j]);
            let yields = random.uniform(0.25, 0.6) * f64::max(high.abs(), low.abs()) / stiffness;
            let shape = [("k", stiffness), ("z_m", yields), ("n", random.uniform(1.0, 2.0)), ("g", random.uniform(0.5, 0.9))];
            let base = -noise * stiffness / scene.load(j);
            draft(at(&shape), vec![("a", true, Growth::Power(base))], -1.6 / base, shown, &[])
        }
        "cable_creep" => {
            let base = 1.5 * noise / scene.load(j);
            draft(at(&[("T_k", random.log_uniform(1.0, 6.0))]), vec![times("J_k", base)], 1.0 / (stiffness * base), shown, &[])
        }
        "joint_coupling" => {
            let from = (j + 1 + random.index(scene.arm.size() - 1)) % scene.arm.size();
            let gain = noise / scene.rms(|run, k| run.joint[k][from]);
            let growing = vec![times("c_ij", random.sign() * gain)];
            draft(at(&[]), growing, if turns { 0.03 } else { 0.003 } / noise, shown, &[("from", from as f64 + 1.0)])
        }
        "joint_offset" => {
            draft(at(&[]), vec![times("o", random.sign() * noise)], if turns { 0.06 } else { 0.005 } / noise, shown, &[])
        }
        "transmission_ratio" => {
            let home = if random.chance(0.5) { 0.0 } else { joint.centre };
            let base = noise / scene.rms(|run, k| run.joint[k][j] - home);
            draft(at(&[]), vec![times("e", random.sign() * base)], 0.12 / base, shown, &[("home", home)])
        }
        "pulley_eccentricity" => {
            let period = joint.reach * random.log_uniform(0.5, 2.0);
            let shape = at(&[("period", period), ("phi", random.uniform(-3.1, 3.1))]);
            draft(shape, vec![times("e_over_r", 1.4 * noise)], if turns { 0.02 } else { 0.003 } / noise, shown, &[])
        }
        _ => return None,
    })
}

fn bodies(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let torque = place(Channel::JointTorque, None);
    let scale = scene.noise.torque_nm / 0.4e-3;
    let direction = random.direction();
    Some(match physics {
        "payload" => {
            let spot = [direction[0] * 0.02, direction[1] * 0.02, scene.arm.tip[2] * random.uniform(0.0, 1.0)];
            let shape = Effect::at(physics, None, &[("c_x", spot[0]), ("c_y", spot[1]), ("c_z", spot[2])]);
            draft(shape, vec![times("m_p", 0.012 * scale)], 0.4 / (0.012 * scale), torque, &[])
        }
        "gravity_direction" => {
            let (sin, cos) = random.uniform(0.0, std::f64::consts::TAU).sin_cos();
            let base = 0.012 * scale;
            draft(Effect::at(physics, None, &[]), vec![times("a", base * cos), times("b", base * sin)], 0.3 / base, torque, &[])
        }
        // what turns with the motor, weighs nothing and loads no other joint
        "link_inertia" if random.chance(0.25) => {
            let base = random.sign() * 0.1 * scale;
            let growing = vec![("rotor_factor", false, Growth::Power(base))];
            // a quarter of it to four times
            draft(
                Effect::at(physics, Some(j + 1), &[]),
                growing,
                4.0_f64.ln() / base.abs(),
                place(Channel::JointTorque, Some(j)),
                &[],
            )
        }
        "link_inertia" => {
            let last = j + 1 == scene.arm.size();
            // more mass at the last link would be a payload
            let sign = if last { -1.0 } else { random.sign() };
            let (mass, shift) = (sign * random.uniform(0.3, 1.0) * 0.02 * scale, random.uniform(0.3, 1.0) * 2e-3 * scale);
            let detail = |name, growth| (name, false, growth);
            let growing = vec![
                detail("mass_factor", Growth::Power(mass)),
                detail("inertia_factor", Growth::Power(random.uniform(-0.04, 0.04) * scale)),
                detail("shift_x", Growth::Times(shift * direction[0])),
                detail("shift_y", Growth::Times(shift * direction[1])),
                detail("shift_z", Growth::Times(shift * direction[2])),
            ];
            draft(Effect::at(physics, Some(j + 1), &[]), growing, 30.0 / scale, torque, &[])
        }
        _ => return None,
    })
}
