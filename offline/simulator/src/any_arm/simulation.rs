//! An arm from a URDF and its controller, one cycle at a time.

use super::servo::Measured;
use super::{Seen, Sensors, Servo, default_gains};
use crate::any_arm::sensors::is_timed;
use crate::model::{ControllerModel, RobotError, RobotModel};
use crate::plant::{JOINTS_MAX, Plant, State, Vector};
use crate::random::Random;
use crate::simulation::HOMING;

/// One cycle of an arm; joints in rad and m, those beyond the arm's are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmCycle {
    /// Commanded joints.
    pub joints_d: Vector,
    /// Motor angles, rad; where a force acts on the joint itself, the joint.
    pub motors: Vector,
    /// Motor speeds, rad/s.
    pub speeds: Vector,
    /// Commanded motor torque, N·m at the shaft; where a force acts on the joint itself, that.
    pub torque: Vector,
    /// Joints as the controller reports them.
    pub joints: Vector,
    /// Joint rates as the controller reports them.
    pub rates: Vector,
    /// Joints as they are.
    pub true_joints: Vector,
    /// Tip as the controller reports it, m, base frame.
    pub tip: [f64; 3],
    /// Tip as it is.
    pub true_tip: [f64; 3],
}

/// An arm from a URDF and its controller. Deterministic: the same robot, seed and commands give the same bits.
#[derive(Debug, Clone)]
pub struct ArmSimulation {
    plant: Plant,
    sensors: Sensors,
    servo: Servo,
    coupling: Vec<Vec<f64>>,
    state: State,
    homing_offset: Vector,
    timed: bool,
    ticks: u64,
}

impl ArmSimulation {
    /// An arm after a homing, which the seed decides, at rest at joint positions as the controller counts them. Gains: those
    /// given, else the robot's own, else [`default_gains`].
    ///
    /// # Errors
    /// [`RobotError`] for a RAVEN-II (see [`crate::Simulation`]) and for effects that cannot be where they are.
    pub fn new(model: &RobotModel, gains: Option<&ControllerModel>, seed: u64, start: &Vector) -> Result<Self, RobotError> {
        let Some(urdf) = model.as_urdf() else {
            return Err(RobotError::Change("a RAVEN-II has its own simulation; this one is for robots from a URDF".to_owned()));
        };
        let mut random = Random::new(seed, HOMING);
        let mut homing_offset = [0.0; JOINTS_MAX];
        homing_offset.iter_mut().zip(&urdf.homing_offset_sd).for_each(|(offset, sd)| *offset = sd * random.normal() + 0.0);
        let gains = gains.cloned().or_else(|| model.controller()).unwrap_or_else(|| default_gains(model));
        if gains.joints.len() != model.joint_count() {
            return Err(RobotError::Change(format!("the controller needs gains for {} joints", model.joint_count())));
        }
        let mut simulation = Self {
            plant: super::build(urdf, &homing_offset)?,
            sensors: Sensors::new(model, gains.period_s).in_steps(),
            servo: Servo::new(model, gains),
            coupling: model.coupling(),
            state: State::ZERO,
            homing_offset,
            timed: is_timed(model),
            ticks: 0,
        };
        let motors = simulation.sensors.motors_for(start, &simulation.coupling);
        simulation.start_at(&motors, &[0.0; JOINTS_MAX]);
        Ok(simulation)
    }

    /// Puts the motors at angles and speeds as encoders show them, the joints where weight and those speeds put them.
    pub fn start_at(&mut self, motors: &Vector, speeds: &Vector) {
        let memories = self.state.memories;
        self.state = self.plant.at_rest_with(&self.sensors.counted_from_zero(motors), &memories);
        self.state.speeds = *speeds;
        self.state.rates = self.sensors.joints_of(speeds, false);
        self.plant.follow(&mut self.state);
    }

    /// Fills the controller's integral so that the first command is a torque, N·m at the shaft, while the joints are
    /// commanded to be somewhere and to move at a rate.
    pub fn begin_with(&mut self, joints_d: &Vector, rates_d: &Vector, torque: &Vector) {
        let seen = self.sensors.clone().see(&self.state, 0.0);
        let wanted = self.sensors.motors_for(joints_d, &self.coupling);
        let later = self.sensors.motors_for(&std::array::from_fn(|i| joints_d[i] + rates_d[i]), &self.coupling);
        let speed_d = std::array::from_fn(|i| later[i] - wanted[i]);
        let now = Measured { motors: seen.motors, speeds: seen.speeds, joints: seen.joints };
        self.servo.begin_with(now, &wanted, &speed_d, torque);
    }

    /// Time between two cycles, s.
    pub fn period_s(&self) -> f64 {
        self.servo.period_s()
    }

    /// Offset that this homing left, rad and m.
    pub fn homing_offset(&self) -> &Vector {
        &self.homing_offset
    }

    /// The plant.
    pub fn plant(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// The plant's state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Runs for a time under a constant command without showing anything. The time of effects that start or end does not pass.
    pub fn settle(&mut self, joints_d: &Vector, duration_s: f64) {
        let ticks = self.ticks;
        for _ in 0..(duration_s / self.period_s()).round() as u64 {
            self.ticks = ticks;
            let _ = self.tick(joints_d);
        }
        self.ticks = ticks;
    }

    /// One cycle: what is measured and commanded at its beginning, then the plant moves on by one period.
    pub fn tick(&mut self, joints_d: &Vector) -> ArmCycle {
        let time_s = self.ticks as f64 * self.period_s();
        if self.timed {
            self.plant.at(time_s);
        }
        let seen: Seen = self.sensors.see(&self.state, time_s);
        let speeds = self.servo.speeds(&seen.motors, &seen.speeds);
        let wanted = self.sensors.motors_for(joints_d, &self.coupling);
        let torque = self.servo.tick(Measured { motors: seen.motors, speeds, joints: seen.joints }, &wanted);
        self.plant.advance(&mut self.state, &torque, self.servo.period_s());
        self.ticks += 1;
        ArmCycle {
            joints_d: *joints_d,
            motors: seen.motors,
            speeds,
            torque,
            joints: seen.joints,
            rates: seen.rates,
            true_joints: seen.true_joints,
            tip: seen.tip,
            true_tip: seen.true_tip,
        }
    }
}
