//! From what happens to what is recorded: delays, the tracker's frame, noise.

use crate::arm::{Arm, Motion};
use crate::controller::RATE;
use crate::effect::Effect;
use crate::random::Random;
use crate::run::Signals;
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// Deviations of white noise at scale 1, as data/gap-examples states them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Encoders at turning joints, rad.
    pub joint_rad: f64,
    /// Encoders at sliding joints, m.
    pub joint_m: f64,
    /// Tip per axis, m.
    pub tip_m: f64,
    /// Motor torque, N m before the gearbox.
    pub torque_nm: f64,
}

impl Noise {
    /// Of the examples, times `scale`.
    pub fn scaled(scale: f64) -> Self {
        Self { joint_rad: 0.3e-3 * scale, joint_m: 0.04e-3 * scale, tip_m: 0.25e-3 * scale, torque_nm: 0.4e-3 * scale }
    }

    /// Of the encoder at a joint.
    pub fn joint(&self, motion: Motion) -> f64 {
        match motion {
            Motion::Turns => self.joint_rad,
            Motion::Slides => self.joint_m,
        }
    }
}

/// The recorded signals from time zero on: effects of sensors applied, then noise added if there is any.
pub fn record(truth: &Signals, arm: &Arm, effects: &[Effect], noise: Option<(&Noise, &mut Random)>) -> Signals {
    let mut seen = delayed(truth, effects);
    for effect in effects.iter().filter(|effect| effect.physics == "frame_misalignment") {
        move_frame(&mut seen, effect);
    }
    if let Some((noise, random)) = noise {
        add_noise(&mut seen, arm, noise, random);
    }
    seen
}

/// Cuts the lead off and shifts the signals that an effect delays.
fn delayed(truth: &Signals, effects: &[Effect]) -> Signals {
    let lead = Signals::lead();
    let late = |signal: &str, k: usize| -> f64 {
        let of_signal = |effect: &&Effect| effect.physics == "measurement_delay" && effect.signal.as_deref() == Some(signal);
        let t = k as f64 / RATE;
        effects.iter().filter(of_signal).map(|e| e.weight(t) * (e.value("d") + e.value("clock_drift") * t)).sum()
    };
    let rows = |rows: &[Vec<f64>], signal: &str| -> Vec<Vec<f64>> {
        (0..truth.count())
            .map(|k| {
                let (index, share) = place(k + lead, late(signal, k), rows.len());
                rows[index].iter().zip(&rows[index + 1]).map(|(a, b)| a + share * (b - a)).collect()
            })
            .collect()
    };
    let points = |points: &[[f64; 3]], signal: &str| -> Vec<[f64; 3]> {
        (0..truth.count())
            .map(|k| {
                let (index, share) = place(k + lead, late(signal, k), points.len());
                std::array::from_fn(|x| points[index][x] + share * (points[index + 1][x] - points[index][x]))
            })
            .collect()
    };
    Signals {
        motor: rows(&truth.motor, "motor"),
        motor_speed: rows(&truth.motor_speed, "motor"),
        torque: rows(&truth.torque, "torque"),
        command: rows(&truth.command, ""),
        joint: rows(&truth.joint, "joint"),
        tip: points(&truth.tip, "tip"),
        reported_tip: points(&truth.reported_tip, "motor"),
        load: rows(&truth.load, ""),
    }
}

/// Index and share between it and the next for sample `k` delayed by `delay` seconds.
fn place(k: usize, delay: f64, count: usize) -> (usize, f64) {
    let at = (k as f64 - delay * RATE).clamp(0.0, (count - 1) as f64);
    let index = (at.floor() as usize).min(count - 2);
    (index, at - index as f64)
}

fn move_frame(seen: &mut Signals, effect: &Effect) {
    let v = |name: &str| effect.value(name);
    let (turn, shift) = (Vector3::new(v("w_x"), v("w_y"), v("w_z")), Vector3::new(v("t_x"), v("t_y"), v("t_z")));
    for (k, tip) in seen.tip.iter_mut().enumerate() {
        let weight = effect.weight(k as f64 / RATE);
        let moved = Rotation3::new(turn * weight) * Vector3::from(*tip) + shift * weight;
        *tip = moved.into();
    }
}

fn add_noise(seen: &mut Signals, arm: &Arm, noise: &Noise, random: &mut Random) {
    for k in 0..seen.tip.len() {
        for (j, joint) in arm.joints.iter().enumerate() {
            seen.joint[k][j] += noise.joint(joint.motion) * random.normal();
            seen.torque[k][j] += noise.torque_nm * arm.drives[j].noise * random.normal();
        }
        for x in &mut seen.tip[k] {
            *x += noise.tip_m * random.normal();
        }
    }
}
