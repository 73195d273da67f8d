//! The plant: motors, cables, links and effects, stepped by staggered leapfrog. Positions stand at whole steps, velocities half a
//! step earlier; friction is solved implicitly at the middle of the step, everything else of velocity is extrapolated to it.

use crate::acting::{Act, Acting};
use crate::arm::Arm;
use crate::cable::Cable;
use crate::cholesky::solve;
use crate::effect::Effect;
use crate::friction::{Brake, Contact};
use crate::lagrange::{Chain, about};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Step, s.
pub const STEP: f64 = 1e-4;

/// Motors are kept in joint units: position and velocity before the gearbox, divided by its ratio.
pub struct Plant<const N: usize> {
    arm: Arm,
    chain: Chain<N>,
    acting: Vec<Acting>,
    rotor: [f64; N],
    cables: [Cable; N],
    motor_contact: [Contact; N],
    link_contact: [Contact; N],
    weighted: bool,
    /// Motor position in joint units.
    pub motor: [f64; N],
    motor_speed: [f64; N],
    motor_speed_before: [f64; N],
    /// True joint position.
    pub joint: [f64; N],
    joint_speed: [f64; N],
    joint_speed_before: [f64; N],
    /// Torque or force in the cable at the last step, joint side.
    pub load: [f64; N],
}

impl<const N: usize> Plant<N> {
    /// At `joint`, moving with `speed`, cables sagging under gravity.
    pub fn new(arm: &Arm, effects: &[Effect], joint: [f64; N], speed: [f64; N]) -> Self {
        let acting: Vec<_> = effects.iter().filter_map(|effect| Acting::new(effect, arm)).collect();
        let chain = Chain::new(arm);
        let hold = chain.posture(&joint, &speed).gravity;
        let law = arm.dry_law;
        let drive = |j: usize| &arm.drives[j];
        let sagged = std::array::from_fn(|j| joint[j] - hold[j] / drive(j).stiffness);
        let mut plant = Self {
            rotor: std::array::from_fn(|j| drive(j).inertia * drive(j).ratio * drive(j).ratio),
            cables: std::array::from_fn(|j| Cable::new(drive(j).stiffness, drive(j).damping)),
            motor_contact: std::array::from_fn(|j| Contact::new(law, drive(j).ratio)),
            link_contact: std::array::from_fn(|j| Contact::new(law, drive(j).ratio)),
            weighted: acting.iter().any(|a| a.effect.interval.is_some()),
            arm: arm.clone(),
            chain,
            acting,
            motor: joint,
            motor_speed: speed,
            motor_speed_before: speed,
            joint: sagged,
            joint_speed: speed,
            joint_speed_before: speed,
            load: hold,
        };
        plant.set_weights(f64::NEG_INFINITY);
        plant.set_rigid();
        plant
    }

    /// Effects that act on the controller or the encoders.
    pub fn acting(&self) -> &[Acting] {
        &self.acting
    }

    /// Tip in the base frame, m, with the geometry as it truly is.
    pub fn tip(&self) -> Vector3<f64> {
        self.chain.tip(&self.joint)
    }

    /// Weights of the effects at a time; rigid bodies follow when one of them changed.
    pub fn set_time(&mut self, t: f64) {
        if self.weighted && self.set_weights(t) {
            self.set_rigid();
        }
    }

    fn set_weights(&mut self, t: f64) -> bool {
        let mut rigid = false;
        for acting in &mut self.acting {
            let weight = acting.effect.weight(t);
            rigid |= acting.is_rigid() && weight != acting.weight;
            acting.weight = weight;
        }
        rigid
    }

    fn set_rigid(&mut self) {
        let mut arm = self.arm.clone();
        let mut payload = (0.0, Vector3::zeros());
        let mut gravity = arm.gravity();
        for Acting { joint, act, weight, .. } in &self.acting {
            match act {
                Act::Payload(mass, at) => payload = (mass * weight, *at),
                Act::Gravity(turned) => gravity += (turned - gravity) * *weight,
                Act::Link { mass, shift, inertia } => {
                    let link = &mut arm.links[*joint];
                    link.mass *= 1.0 + (mass - 1.0) * weight;
                    link.centre += shift * *weight;
                    link.inertia *= 1.0 + (inertia - 1.0) * weight;
                }
                Act::Geometry { twist, length } if *joint + 1 < N => {
                    arm.joints[*joint + 1].rpy[0] += twist * weight;
                    arm.joints[*joint + 1].xyz[2] += length * weight;
                }
                Act::Geometry { twist, length } => {
                    let tip = about(&Vector3::x(), twist * weight) * Vector3::from(arm.tip);
                    arm.tip = (tip * (1.0 + length * weight / tip.norm())).into();
                }
                _ => {}
            }
        }
        self.chain = Chain::new(&arm);
        self.chain.set_load(payload.0, payload.1);
        self.chain.set_gravity(gravity);
    }

    /// One step under motor torques in N m, before the gearbox.
    pub fn step(&mut self, torque: &[f64; N]) {
        let ahead = |now: &[f64; N], before: &[f64; N]| std::array::from_fn(|j| 1.5 * now[j] - 0.5 * before[j]);
        let motor_speed: [f64; N] = ahead(&self.motor_speed, &self.motor_speed_before);
        let joint_speed: [f64; N] = ahead(&self.joint_speed, &self.joint_speed_before);
        let mut drive: [f64; N] = std::array::from_fn(|j| torque[j] * self.arm.drives[j].ratio);
        let mut end = self.motor;
        let mut end_speed = motor_speed;
        let mut gear = [1.0; N];
        let mut carried = [0.0; N];
        let mut rotor = self.rotor;
        let mut motor_brake: [Brake; N] = std::array::from_fn(|j| self.nominal_brake(j));
        let mut link_brake = [Brake::default(); N];
        let mut pushed = [0.0; N];
        for cable in &mut self.cables {
            cable.reset();
        }

        // what the effects change at this moment
        for acting in &mut self.acting {
            let (j, w, u) = (acting.joint, acting.weight, self.motor[acting.joint]);
            match &acting.act {
                Act::Brake { at_link, brake, load, wave } => {
                    let into = if *at_link { &mut link_brake[j] } else { &mut motor_brake[j] };
                    let hill = wave[3] + wave[0] * (TAU * u / wave[1] + wave[2]).sin();
                    into.dry += w * (brake.dry + load * self.load[j].abs() + hill);
                    into.viscous += w * brake.viscous;
                    into.drag += w * brake.drag;
                    if brake.excess != 0.0 {
                        (into.excess, into.speed, into.power) = (w * brake.excess, brake.speed, brake.power);
                    }
                }
                Act::Fade { share, time, reference } => {
                    acting.memory += STEP * (torque[j] / reference).powi(2);
                    motor_brake[j].dry *= 1.0 - w * share * (1.0 - (-acting.memory / time).exp());
                }
                Act::Drift { size, time, reference } => {
                    acting.memory += STEP * (torque[j] / reference).powi(2);
                    end[j] += w * size * (1.0 - (-acting.memory / time).exp());
                }
                Act::Ratio { gain, home } => {
                    end[j] += w * gain * (u - home);
                    gear[j] += w * gain;
                }
                Act::Offset(offset) => end[j] += w * offset,
                Act::Eccentric([size, period, phase]) => {
                    let (sin, cos) = (TAU * u / period + phase).sin_cos();
                    end[j] += w * size * sin;
                    gear[j] += w * size * TAU / period * cos;
                }
                Act::Coupling { from, gain } => {
                    end[j] += w * gain * self.joint[*from];
                    end_speed[j] += w * gain * joint_speed[*from];
                    carried[j] = w * gain;
                }
                Act::Rotor(factor) => rotor[j] *= 1.0 + w * (factor - 1.0),
                Act::MotorScale(kappa) => drive[j] *= 1.0 + w * (kappa - 1.0),
                Act::Ripple([size, order, phase]) => drive[j] -= w * size * (order * u * self.arm.drives[j].ratio + phase).sin(),
                Act::Compliance(compliance) => self.cables[j].compliance += w * compliance,
                Act::Play(width) => self.cables[j].play += w * width,
                Act::Cubic(cubic) => self.cables[j].cubic += w * cubic,
                Act::Slack(pretension) => self.cables[j].slack = Some((w, *pretension)),
                Act::Hysteresis { a, yields, .. } => self.cables[j].soft = (w * (1.0 - a), *yields, acting.memory),
                Act::Creep { .. } => self.cables[j].sag += w * acting.memory,
                Act::Wall { normal, at, stiffness, power } => {
                    let depth = normal.dot(&(self.chain.tip(&self.joint) - at));
                    if depth > 0.0 {
                        let force = normal * (-w * stiffness * depth.powf(*power));
                        pushed = self.chain.tip_force(&self.joint, &force);
                    }
                }
                Act::Push(force) if w > 0.0 => pushed = self.chain.tip_force(&self.joint, &(force * w)),
                _ => {}
            }
        }

        // cables
        for j in 0..N {
            end_speed[j] += (gear[j] - 1.0) * motor_speed[j];
            self.load[j] = self.cables[j].force(end[j] - self.joint[j], end_speed[j] - joint_speed[j]);
        }
        self.remember(&end_speed, &joint_speed);

        // motors
        for j in 0..N {
            let push = drive[j] - gear[j] * self.load[j];
            let before = self.motor_speed[j];
            self.motor_speed_before[j] = before;
            let mean = brake_step(before, push, rotor[j], &motor_brake[j], &self.motor_contact[j]);
            self.motor_contact[j].advance(mean, STEP);
            self.motor_speed[j] = 2.0 * mean - before;
            self.motor[j] += STEP * self.motor_speed[j];
        }

        // links
        let posture = self.chain.posture(&self.joint, &joint_speed);
        let mut mass = posture.mass;
        let mut push: [f64; N] = std::array::from_fn(|j| self.load[j] + pushed[j] - posture.coriolis[j] - posture.gravity[j]);
        for acting in &self.acting {
            if let Act::Coupling { from, .. } = acting.act {
                push[from] -= carried[acting.joint] * self.load[acting.joint];
            }
        }
        for j in 0..N {
            let (v, brake) = (self.joint_speed[j], &link_brake[j]);
            let level = brake.level(v);
            push[j] -= level * self.link_contact[j].sign(v) + brake.fluid(v);
            mass[j][j] += STEP * (level * self.link_contact[j].slope(v) + brake.viscous + 2.0 * brake.drag * v.abs());
        }
        let change = solve(&mass, &push);
        for j in 0..N {
            self.joint_speed_before[j] = self.joint_speed[j];
            self.joint_speed[j] += STEP * change[j];
            self.link_contact[j].advance(self.joint_speed[j], STEP);
            self.joint[j] += STEP * self.joint_speed[j];
        }
    }

    fn nominal_brake(&self, j: usize) -> Brake {
        let drive = &self.arm.drives[j];
        Brake { dry: drive.dry * drive.ratio, viscous: drive.viscous * drive.ratio * drive.ratio, ..Brake::default() }
    }

    /// Memories of cables move on.
    fn remember(&mut self, end_speed: &[f64; N], joint_speed: &[f64; N]) {
        for acting in &mut self.acting {
            let j = acting.joint;
            match acting.act {
                Act::Hysteresis { yields, n, g, .. } => {
                    let rate = end_speed[j] - joint_speed[j];
                    let z = acting.memory / yields;
                    let side = if rate * z >= 0.0 { 1.0 } else { -1.0 };
                    let next = acting.memory + STEP * rate * (1.0 - z.abs().powf(n) * (g + (1.0 - g) * side));
                    acting.memory = next.clamp(-yields, yields);
                }
                Act::Creep { compliance, time } => {
                    let end = compliance * self.load[j];
                    acting.memory = end + (acting.memory - end) * (-STEP / time).exp();
                }
                _ => {}
            }
        }
    }

    /// Energy of motors, cables and links, J, with velocities at the middle of the last step.
    pub fn energy(&self) -> f64 {
        let mid: [f64; N] = std::array::from_fn(|j| self.joint[j] - 0.5 * STEP * self.joint_speed[j]);
        let (kinetic, potential) = self.chain.energy(&mid, &self.joint_speed);
        let drives: f64 = (0..N)
            .map(|j| {
                let stretch = self.motor[j] - 0.5 * STEP * self.motor_speed[j] - mid[j];
                0.5 * (self.rotor[j] * self.motor_speed[j].powi(2) + self.arm.drives[j].stiffness * stretch * stretch)
            })
            .sum();
        kinetic + potential + drives
    }
}

/// Mean speed of a step of one shaft under a push and a brake that both act at the middle of it.
fn brake_step(before: f64, push: f64, inertia: f64, brake: &Brake, contact: &Contact) -> f64 {
    let stiff = 2.0 * inertia / STEP;
    let mut mean = before;
    for _ in 0..3 {
        let level = brake.level(mean);
        let miss = stiff * (mean - before) - push + level * contact.sign(mean) + brake.fluid(mean);
        mean -= miss / (stiff + level * contact.slope(mean) + brake.viscous + 2.0 * brake.drag * mean.abs());
    }
    mean
}
