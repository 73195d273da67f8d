//! The controller drives the plant along the recorded commands.

use arm::{JOINTS, Joints};

use super::{Commands, ResimulateError, Run, Simulated};
use crate::any_arm::{ArmCycle, ArmSimulation};
use crate::model::{ControllerModel, Robot, RobotModel};
use crate::plant::{JOINTS_MAX, Vector};
use crate::simulation::{Command, Simulation};

/// How a controller drives the plant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ClosedLoop<'a> {
    /// Gains; none: the robot's own, else assumed ones. A RAVEN-II has its control software.
    pub gains: Option<&'a ControllerModel>,
    /// Seed of the homing, where the robot's file leaves one to chance.
    pub seed: u64,
    /// Hold the first command for so long before the run begins, s: for runs that begin at rest. 0: begin with the recorded
    /// motors, their speeds and, where a gain is an integral, the recorded torque.
    pub settle_s: f64,
    /// Rows earlier than this after the first, s, are simulated and not kept.
    pub from_s: f64,
}

/// The run of a robot that follows the recorded commands, at the times of the recording.
///
/// # Errors
/// [`ResimulateError`] without commands, and for effects that cannot be where they are.
pub fn closed_loop(model: &RobotModel, run: &Run, options: ClosedLoop<'_>) -> Result<Simulated, ResimulateError> {
    let commands = Commands::of_run(model, run)?;
    match model.as_raven() {
        Some(robot) => raven(model, robot, run, &commands, options),
        None => any(model, run, &commands, options),
    }
}

fn any(model: &RobotModel, run: &Run, commands: &Commands, options: ClosedLoop<'_>) -> Result<Simulated, ResimulateError> {
    let mut simulation = ArmSimulation::new(model, options.gains, options.seed, commands.first())?;
    if options.settle_s > 0.0 {
        simulation.settle(commands.first(), options.settle_s);
    } else if let Some((motors, speeds)) = run.state_at(0) {
        simulation.start_at(&motors, &speeds);
        if let Some(torque) = &run.torque {
            simulation.begin_with(commands.first(), &commands.first_rates(), &torque[0]);
        }
    }
    let mut sampler = Sampler::new(run, simulation.period_s(), options.from_s);
    let mut out = Simulated::new(model.joint_count(), sampler.kept());
    while let Some(time_s) = sampler.next_tick_s() {
        let cycle = simulation.tick(&commands.at(time_s));
        sampler.take(&cycle, &mut out);
    }
    Ok(out)
}

fn raven(
    model: &RobotModel,
    robot: &Robot,
    run: &Run,
    commands: &Commands,
    options: ClosedLoop<'_>,
) -> Result<Simulated, ResimulateError> {
    let arm = robot.raven.arm(model.side());
    let mut simulation = Simulation::new(robot, model.side(), options.seed, &narrow(commands.first()))?;
    if options.settle_s > 0.0 {
        simulation.settle(&narrow(commands.first()), options.settle_s);
    } else if let Some((motors, speeds)) = run.start_of_raven(model, commands) {
        simulation.start_at(&motors, &speeds);
    }
    let (gears, period_s) = (*arm.amplifiers.gear(), robot.raven.plant().sampling.period_s);
    let mut sampler = Sampler::new(run, period_s, options.from_s);
    let mut out = Simulated::new(JOINTS, sampler.kept());
    while let Some(time_s) = sampler.next_tick_s() {
        let joints_d = narrow(&commands.at(time_s));
        let cycle = simulation.tick(&Command::Joints(joints_d));
        let (reported, truth) = (&cycle.reported, &cycle.truth);
        let rates = arm.transmission.joints(&reported.motor_speeds);
        let tip = arm.kinematics.tip_position(&reported.joints);
        let found = ArmCycle {
            joints_d: wide(&joints_d),
            motors: wide(&reported.motors),
            speeds: wide(&reported.motor_speeds),
            torque: wide(&std::array::from_fn(|i| reported.torque_nm[i] / gears[i])),
            joints: wide(&reported.joints),
            rates: wide(&rates),
            true_joints: wide(&truth.joints),
            tip: tip.into(),
            true_tip: truth.tip.translation.vector.into(),
        };
        sampler.take(&found, &mut out);
    }
    Ok(out)
}

fn narrow(values: &Vector) -> Joints {
    std::array::from_fn(|i| values[i])
}

fn wide(values: &[f64; JOINTS]) -> Vector {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Cycles of a controller brought to the rows of a recording.
struct Sampler<'a> {
    run: &'a Run,
    period_s: f64,
    kept_from: usize,
    tick: u64,
    row: usize,
    before: Option<ArmCycle>,
}

impl<'a> Sampler<'a> {
    fn new(run: &'a Run, period_s: f64, from_s: f64) -> Self {
        Self { run, period_s, kept_from: run.row_from(from_s), tick: 0, row: 0, before: None }
    }

    /// Rows that are kept.
    fn kept(&self) -> usize {
        self.run.len() - self.kept_from
    }

    /// Time of the next cycle since the first row, s; none when every row is filled.
    fn next_tick_s(&self) -> Option<f64> {
        (self.row < self.run.len()).then_some(self.tick as f64 * self.period_s)
    }

    /// Fills the rows up to the cycle just computed.
    fn take(&mut self, cycle: &ArmCycle, out: &mut Simulated) {
        let now_s = self.tick as f64 * self.period_s;
        while let Some(row_s) = self.run.time_s.get(self.row) {
            // How long before this cycle the row is, in periods.
            let early = (now_s - (row_s - self.run.time_s[0])) / self.period_s;
            if early < -1e-6 {
                break;
            }
            let found = match &self.before {
                Some(before) if early > 1e-6 => between(cycle, before, early.min(1.0)),
                _ => *cycle,
            };
            if self.row >= self.kept_from {
                out.push_cycle(*row_s, &found);
            }
            self.row += 1;
        }
        self.before = Some(*cycle);
        self.tick += 1;
    }
}

/// From `a` a share of the way to `b`.
fn between(a: &ArmCycle, b: &ArmCycle, share: f64) -> ArmCycle {
    fn mix<const N: usize>(a: &[f64; N], b: &[f64; N], share: f64) -> [f64; N] {
        std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
    }
    let joints = |part: fn(&ArmCycle) -> &[f64; JOINTS_MAX]| mix(part(a), part(b), share);
    ArmCycle {
        joints_d: joints(|cycle| &cycle.joints_d),
        motors: joints(|cycle| &cycle.motors),
        speeds: joints(|cycle| &cycle.speeds),
        torque: joints(|cycle| &cycle.torque),
        joints: joints(|cycle| &cycle.joints),
        rates: joints(|cycle| &cycle.rates),
        true_joints: joints(|cycle| &cycle.true_joints),
        tip: mix(&a.tip, &b.tip, share),
        true_tip: mix(&a.true_tip, &b.true_tip, share),
    }
}
