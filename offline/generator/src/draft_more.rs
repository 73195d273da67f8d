//! Drafts of the effects of motors, sensors and surroundings, and of those outside the library.

use crate::arm::Motion;
use crate::effect::Effect;
use crate::random::Random;
use crate::run::Signals;
use crate::scene::{Draft, Growth, Scene, draft, place, times};
use crate::severity::{Channel, Place};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// The rest of the vocabulary.
pub(crate) fn vocabulary(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let torque = place(Channel::JointTorque, Some(j));
    let noise = scene.torque_noise(j);
    let ratio = scene.arm.drives[j].ratio;
    let at = |parameters: &[(&str, f64)]| Effect::at(physics, Some(j + 1), parameters);
    Some(match physics {
        "motor_torque_scale" => {
            let base = noise / ratio / scene.rms(|run, k| run.torque[k][j]);
            let growing = vec![("kappa", true, Growth::Power(random.sign() * base))];
            draft(at(&[]), growing, 0.8 / base, torque, &[])
        }
        "torque_ripple" => {
            let order = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0][random.index(7)];
            let shape = at(&[("order", order), ("phase", random.uniform(-3.1, 3.1))]);
            draft(shape, vec![times("amp", 1.4 * noise)], 3.0 * scene.arm.drives[j].dry * ratio / noise, torque, &[])
        }
        "link_geometry" => {
            let growing = if random.chance(0.5) {
                times("d_alpha", 1.5e-3 * random.sign())
            } else {
                times("d_length", 0.45e-3 * random.sign())
            };
            draft(at(&[]), vec![growing], 40.0, place(Channel::EndEffector, None), &[])
        }
        "frame_misalignment" => {
            let (turn, shift) = (random.direction(), random.direction());
            let growing = vec![
                times("w_x", 1e-3 * turn[0]),
                times("w_y", 1e-3 * turn[1]),
                times("w_z", 1e-3 * turn[2]),
                times("t_x", 0.25e-3 * shift[0]),
                times("t_y", 0.25e-3 * shift[1]),
                times("t_z", 0.25e-3 * shift[2]),
            ];
            draft(Effect::at(physics, None, &[]), growing, 100.0, place(Channel::EndEffector, None), &[])
        }
        "measurement_delay" => delay(scene, random),
        "external_contact" => contact(scene, random),
        _ => return None,
    })
}

/// One of the logged signals comes late; the loop itself does not.
fn delay(scene: &Scene, random: &mut Random) -> Draft {
    let tip_speed = || {
        let step = |a: &[f64; 3], b: &[f64; 3]| (Vector3::from(*b) - Vector3::from(*a)).norm() * crate::controller::RATE;
        scene.rms(|run, k| step(&run.tip[k - 1], &run.tip[k])) / 3f64.sqrt()
    };
    let joint = |j: usize| scene.joint_noise(j) / scene.speed(j);
    let fastest = (0..scene.arm.size()).map(joint).fold(f64::INFINITY, f64::min);
    let (signal, base, largest) = match random.index(8) {
        0..4 => ("tip", scene.noise.tip_m / tip_speed(), 0.1),
        4..6 => ("joint", fastest, 0.02),
        6 => ("motor", fastest, 0.02),
        _ => ("torque", 3e-3, 0.02),
    };
    let mut effect = Effect::at("measurement_delay", None, &[]);
    effect.signal = Some(signal.into());
    let place = Place { channel: Channel::Timing, joint: None, signal: effect.signal.clone() };
    draft(effect, vec![times("d", base)], largest / base, place, &[])
}

/// A wall that the tip leans on near the edge of its way, or a push for a while.
fn contact(scene: &Scene, random: &mut Random) -> Draft {
    let normal = Vector3::from(random.direction());
    let n = [("n_x", normal.x), ("n_y", normal.y), ("n_z", normal.z)];
    let along = |run: &Signals, k: usize| normal.dot(&Vector3::from(run.tip[k]));
    let shown = place(Channel::JointTorque, None);
    // newtons at the tip that show as much as torque noise at a motor with a lever of 0.2 m
    let force = 1.7 * scene.noise.torque_nm * scene.arm.drives[0].ratio / 0.2;
    if random.chance(0.3) {
        let seconds = (scene.runs[0].count() as f64) / crate::controller::RATE;
        let mut push = Effect::at("external_contact", None, &[]);
        let on = random.uniform(0.15, 0.45) * seconds;
        push.interval = Some([on, on + random.uniform(0.2, 0.4) * seconds]);
        return draft(push, vec![times("f_max", force)], 30.0 / force, shown, &n);
    }
    let mut values: Vec<f64> = scene.over(along).collect();
    values.sort_by(f64::total_cmp);
    let edge = values[(values.len() as f64 * random.uniform(0.7, 0.88)) as usize];
    let depth = values[values.len() - 1] - edge;
    let power = if random.chance(0.5) { 1.0 } else { 1.5 };
    let stiffness = 2.0 * force / depth.powf(power);
    let mut wall = Effect::at("external_contact", None, &[("p", power), ("x_0", edge)]);
    let point = normal * edge;
    wall.details.extend([("x_0x", point.x), ("x_0y", point.y), ("x_0z", point.z)].map(|(name, value)| (name.to_owned(), value)));
    let growing = vec![times("k", stiffness), times("f_max", 2.0 * force)];
    draft(wall, growing, 15.0 / force, shown, &n)
}

/// Effects that no name of the vocabulary covers.
pub(crate) fn outside(physics: &str, j: usize, scene: &Scene, random: &mut Random) -> Option<Draft> {
    let at = || Effect::at(physics, Some(j + 1), &[]);
    let drive = &scene.arm.drives[j];
    let (torque, shown) = (place(Channel::JointTorque, Some(j)), place(Channel::Transmission, Some(j)));
    let (noise, joint_noise) = (scene.torque_noise(j), scene.joint_noise(j));
    let stretch = scene.load(j) / drive.stiffness;
    let detail = |name: &'static str, growth| (name, false, growth);
    let joint = &scene.arm.joints[j];
    Some(match physics {
        "outside:cubic_stiffness" => {
            let base = joint_noise * drive.stiffness / stretch.powi(3);
            draft(at(), vec![detail("cubic", Growth::Times(base))], 20.0 * stretch / joint_noise, shown, &[])
        }
        "outside:position_friction" => {
            let (period, phase) = (joint.reach * random.uniform(0.5, 1.1), random.uniform(0.0, TAU));
            let growing = vec![detail("amplitude", Growth::Times(1.4 * noise))];
            let spare = 0.8 * drive.dry * drive.ratio;
            draft(
                at(),
                growing,
                5.0 * drive.dry * drive.ratio / noise,
                torque,
                &[("period", period), ("phase", phase), ("spare", spare)],
            )
        }
        "outside:drag" => {
            let base = noise / scene.rms(|run, k| (run.motor_speed[k][j] / drive.ratio).powi(2));
            draft(at(), vec![detail("drag", Growth::Times(base))], 5.0 * drive.dry * drive.ratio / noise, torque, &[])
        }
        "outside:cable_slack" => draft(at(), vec![detail("pretension", Growth::Over(0.8 * stretch))], 1e3, shown, &[]),
        "outside:missed_counts" => {
            let seconds = (scene.runs[0].count() as f64) / crate::controller::RATE;
            let mut time = |low: f64| random.uniform(low, low + 0.25) * seconds;
            let times = [("t_1", time(0.1)), ("t_2", time(0.38)), ("t_3", time(0.66))];
            let base = 0.6 * joint_noise * drive.ratio * crate::controller::COUNTS / TAU;
            let largest = if joint.motion == Motion::Turns { 0.03 } else { 0.004 } / joint_noise;
            draft(at(), vec![detail("counts", Growth::Times(base * random.sign()))], largest, shown, &times)
        }
        "outside:gain_change" => {
            let sign = random.sign();
            let growing = vec![detail("kp_factor", Growth::Power(0.15 * sign)), detail("kd_factor", Growth::Power(0.1 * sign))];
            draft(at(), growing, 6.0, torque, &[])
        }
        _ => return None,
    })
}
