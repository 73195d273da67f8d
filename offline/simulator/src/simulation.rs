//! Robot and controller together, one millisecond at a time.

use arm::{Arm, JOINTS, Joints, Motors, Raven2, Side};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use recordings::sample::ArmSample;

use crate::controller::{Controller, Tick};
use crate::delay::DelayLine;
use crate::model::{Bound, Effect, Robot, delay};
use crate::physics::{Channel, Physics};
use crate::plant::{JOINTS_MAX, Method, Plant, PlantError, State};
use crate::random::Random;
use crate::robot_plant;
use crate::tool_axes::{FIRST, ToolAxes};

/// Purpose of the stream of random numbers that homing draws from.
pub(crate) const HOMING: u64 = 1;

/// Where an arm truly is in a cycle, as instruments at the joints and a tracker at the tip would show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthSample {
    /// Joint positions, rad and m.
    pub joints: Joints,
    /// Tip in frame 0.
    pub tip: Isometry3<f64>,
    /// Motor angles before the encoder, rad.
    pub motors: Motors,
    /// Cable force of joints 1 to 3, N at the joint's pulley; NaN for the rigid tool axes.
    pub cable_force_n: Joints,
}

/// One cycle of one arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleOfArm {
    /// What the controller publishes.
    pub reported: ArmSample,
    /// What is the case.
    pub truth: TruthSample,
}

/// What drives the motors in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// The controller follows joint positions, rad and m.
    Joints(Joints),
    /// Amplifier commands as recorded; the joint positions are only reported.
    Dac([i32; JOINTS], Joints),
}

/// One arm and its controller. Deterministic: the same robot, seed and commands give the same bits.
#[derive(Debug, Clone)]
pub struct Simulation {
    arm: Arm,
    plant: Plant,
    tool: ToolAxes,
    controller: Controller,
    true_arm: Arm,
    measured_from_true: Option<Isometry3<f64>>,
    state: State,
    /// Motor angles of the tick before, which the encoders show now.
    seen: Option<Motors>,
    motor_delay: Option<DelayLine<JOINTS>>,
    joint_delay: Option<DelayLine<JOINTS>>,
    tip_delay: Option<DelayLine<7>>,
    encoder_offsets: Motors,
    homing_offset: Joints,
    timed: bool,
    period_s: f64,
    ticks: u64,
}

impl Simulation {
    /// An arm of a robot after a homing, which the seed decides; at rest at joint positions as the controller sees them.
    ///
    /// # Errors
    /// [`PlantError`] for effects that cannot be where they are.
    pub fn new(robot: &Robot, side: Side, seed: u64, start: &Joints) -> Result<Self, PlantError> {
        let mut random = Random::new(seed, HOMING + 16 * side.index() as u64);
        let homing_offset: Joints = robot.homing_offset_sd.map(|sd| sd * random.normal());
        let encoder_offsets = std::array::from_fn(|_| random.between(-60_000.0, 60_000.0).round());
        let (plant, tool) = robot_plant::build(robot, side, &homing_offset)?;
        let arm = robot.raven.arm(side);
        let period_s = robot.raven.plant().sampling.period_s;
        let line = |channel| delay(&robot.effects, channel);
        let mut simulation = Self {
            true_arm: true_arm(robot, side),
            measured_from_true: frame(&robot.effects),
            controller: Controller::new(robot.raven.plant(), arm.clone()),
            state: State::ZERO,
            seen: None,
            motor_delay: line(Channel::Motor).map(|delay| DelayLine::new(delay, period_s)),
            joint_delay: line(Channel::Transmission).map(|delay| DelayLine::new(delay, period_s)),
            tip_delay: line(Channel::EndEffector).map(|delay| DelayLine::new(delay, period_s)),
            encoder_offsets,
            homing_offset,
            timed: robot.effects.iter().any(|effect| effect.from_s.is_finite() || effect.to_s.is_finite()),
            period_s,
            ticks: 0,
            arm,
            plant,
            tool,
        };
        let motors = simulation.arm.transmission.motors(start);
        simulation.rest_at(&motors);
        Ok(simulation)
    }

    /// Puts the motors at rest at angles, rad, with the joints where gravity holds them.
    pub fn rest_at(&mut self, motors: &Motors) {
        let mut base = [0.0; JOINTS_MAX];
        base[..FIRST].copy_from_slice(&motors[..FIRST]);
        let memories = self.state.memories;
        self.state = self.plant.at_rest(&base);
        self.state.memories = memories;
        self.tool.rest_at(motors);
        self.seen = None;
    }

    /// Puts the motors at angles, rad, and speeds, rad/s, the joints where gravity and those speeds put them.
    pub fn start_at(&mut self, motors: &Motors, speeds: &[f64]) {
        self.rest_at(motors);
        let mut all = [0.0; JOINTS];
        all[..FIRST].copy_from_slice(&speeds[..FIRST]);
        if let Some(tool) = speeds.get(FIRST..JOINTS) {
            self.tool.turn_at(tool);
        }
        self.state.speeds[..FIRST].copy_from_slice(&speeds[..FIRST]);
        self.state.rates[..FIRST].copy_from_slice(&self.arm.transmission.joints(&all)[..FIRST]);
    }

    /// Takes over what the cables and motors of the same robot remember: hysteresis, creep, warmth.
    pub fn go_on_from(&mut self, last: &Self) {
        self.state.memories = last.state.memories;
        self.tool.go_on_from(&last.tool);
    }

    /// Another state of joints 1 to 3 and their motors.
    pub fn set_state(&mut self, state: State) {
        self.state = state;
        self.seen = None;
    }

    /// State of joints 1 to 3 and their motors.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Another time step, s, and method.
    pub fn set_step(&mut self, method: Method, step_s: f64) {
        self.plant.set_step(method, step_s);
    }

    /// The plant of joints 1 to 3.
    pub fn plant(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// The arm as the controller believes it to be.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// Offset that this homing left, rad and m.
    pub fn homing_offset(&self) -> &Joints {
        &self.homing_offset
    }

    /// Cycles so far.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Runs for a time under a constant command without showing anything: cables settle, plays find their flank. The time of
    /// effects that start or end does not pass.
    pub fn settle(&mut self, command: &Joints, duration_s: f64) {
        let ticks = self.ticks;
        for _ in 0..(duration_s / self.period_s).round() as u64 {
            self.ticks = ticks;
            let _ = self.tick(&Command::Joints(*command));
        }
        self.ticks = ticks;
    }

    /// One control cycle: what is measured and commanded at its beginning, then the plant moves on by one period.
    pub fn tick(&mut self, command: &Command) -> CycleOfArm {
        let time_s = self.ticks as f64 * self.period_s;
        if self.timed {
            self.plant.at(time_s);
            self.tool.at(time_s);
        }
        let motors = self.motors();
        let mut seen = self.seen.unwrap_or(motors);
        if let Some(line) = &mut self.motor_delay {
            seen = line.pass(seen, time_s);
        }
        let (tick, joints_d) = match command {
            Command::Joints(joints_d) => (self.controller.tick(&seen, joints_d), joints_d),
            Command::Dac(dac, joints_d) => (self.controller.tick_open(&seen, joints_d, dac), joints_d),
        };
        let cycle = CycleOfArm { reported: self.reported(&tick, joints_d), truth: self.truth(&motors, time_s) };
        let torque_nm = self.controller.torque_of(&tick.dac);
        let mut base = [0.0; JOINTS_MAX];
        base[..FIRST].copy_from_slice(&torque_nm[..FIRST]);
        self.plant.advance(&mut self.state, &base, self.period_s);
        self.tool.advance(&torque_nm[FIRST..], self.period_s);
        self.seen = Some(motors);
        self.ticks += 1;
        cycle
    }

    /// True motor angles, rad.
    pub fn motors(&self) -> Motors {
        let mut motors = [0.0; JOINTS];
        motors[..FIRST].copy_from_slice(&self.state.motors[..FIRST]);
        motors[FIRST..].copy_from_slice(self.tool.angles());
        motors
    }

    fn reported(&self, tick: &Tick, joints_d: &Joints) -> ArmSample {
        ArmSample {
            joints: tick.joints,
            joints_d: *joints_d,
            motors: tick.motors,
            motors_d: tick.motors_d,
            motor_speeds: tick.speeds,
            torque_nm: tick.torque_nm,
            dac: tick.dac,
            encoder_offsets: self.encoder_offsets,
        }
    }

    fn truth(&mut self, motors: &Motors, time_s: f64) -> TruthSample {
        let mut joints = [0.0; JOINTS];
        joints[..FIRST].copy_from_slice(&self.state.joints[..FIRST]);
        let base = [joints[0], joints[1], joints[2]];
        joints[FIRST..].copy_from_slice(&self.tool.joints(&self.arm.transmission, motors, &base));
        let tip = self.true_arm.kinematics.tip(&joints);
        let mut tip = Isometry3::from_parts(tip.translation, UnitQuaternion::from_rotation_matrix(&tip.rotation));
        if let Some(frame) = &self.measured_from_true {
            tip = frame * tip;
        }
        if let Some(line) = &mut self.tip_delay {
            let now = beside(packed(&tip), line.newest());
            tip = unpacked(&line.pass(now, time_s));
        }
        if let Some(line) = &mut self.joint_delay {
            joints = line.pass(joints, time_s);
        }
        let forces = self.plant.cable_forces_n(&self.state);
        let cable_force_n = std::array::from_fn(|i| if i < FIRST { forces[i] } else { f64::NAN });
        TruthSample { joints, tip, motors: *motors, cable_force_n }
    }
}

pub(crate) fn true_arm(robot: &Robot, side: Side) -> Arm {
    let bent = robot.effects.iter().any(|effect| matches!(effect.physics, Physics::LinkGeometry(_)));
    let raven: Raven2 = if bent { robot_plant::true_geometry(robot, side) } else { robot.raven.clone() };
    raven.arm(side)
}

/// The tracker's frames, one after the other.
pub(crate) fn frame(effects: &[Effect]) -> Option<Isometry3<f64>> {
    let frames = effects.iter().filter_map(|effect| match (effect.physics, effect.bound) {
        (Physics::FrameMisalignment(frame), Bound::Robot) => Some(frame.transform()),
        _ => None,
    });
    frames.reduce(|all, frame| frame * all)
}

/// Position and quaternion; neighbours are a millisecond apart, so interpolating the quaternion's numbers will do.
fn packed(tip: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (&tip.translation.vector, tip.rotation.quaternion());
    [t.x, t.y, t.z, q.w, q.i, q.j, q.k]
}

/// The same rotation with the sign of its quaternion that lies nearer to the one before.
fn beside(mut now: [f64; 7], before: Option<&[f64; 7]>) -> [f64; 7] {
    if before.is_some_and(|before| (3..7).map(|i| now[i] * before[i]).sum::<f64>() < 0.0) {
        now[3..].iter_mut().for_each(|part| *part = -*part);
    }
    now
}

fn unpacked(numbers: &[f64; 7]) -> Isometry3<f64> {
    let [x, y, z, w, i, j, k] = *numbers;
    let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::from(Vector3::new(x, y, z)), rotation)
}
