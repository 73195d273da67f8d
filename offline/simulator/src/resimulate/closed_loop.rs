//! The controller drives the plant along the recorded commands.

use arm::JOINTS;

use super::{ResimulateError, Run, Simulated};
use crate::any_arm::{ArmCycle, ArmSimulation};
use crate::model::{ControllerModel, RobotModel};
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
}

/// The run of a robot that follows the recorded commands, at the times of the recording.
///
/// # Errors
/// [`ResimulateError`] without commands, and for effects that cannot be where they are.
pub fn closed_loop(model: &RobotModel, run: &Run, options: ClosedLoop<'_>) -> Result<Simulated, ResimulateError> {
    let Some(commands) = &run.joints_d else {
        let unit = model.joint_kinds()[0].position_unit();
        return Err(run.missing(&format!("jpos_d_1_{unit}"), "a closed loop needs the commanded position of every joint"));
    };
    if model.as_raven().is_some() { raven(model, run, commands, options) } else { any(model, run, commands, options) }
}

fn any(model: &RobotModel, run: &Run, commands: &[Vector], options: ClosedLoop<'_>) -> Result<Simulated, ResimulateError> {
    let mut simulation = ArmSimulation::new(model, options.gains, options.seed, &commands[0])?;
    let begin = &commands[0];
    if options.settle_s > 0.0 {
        simulation.settle(begin, options.settle_s);
    } else if let Some((motors, speeds)) = run.state_at(0) {
        simulation.start_at(&motors, &speeds);
        let span_s = run.time_s[1] - run.time_s[0];
        let rates_d = std::array::from_fn(|i| (commands[1][i] - begin[i]) / span_s);
        if let Some(torque) = &run.torque {
            simulation.begin_with(begin, &rates_d, &torque[0]);
        }
    }
    let mut out = Simulated::new(model.joint_count(), run.len());
    let mut sampler = Sampler::new(run, simulation.period_s());
    while let Some(time_s) = sampler.next_tick_s() {
        let cycle = simulation.tick(&at(run, commands, time_s));
        sampler.take(&cycle, &mut out);
    }
    Ok(out)
}

fn raven(model: &RobotModel, run: &Run, commands: &[Vector], options: ClosedLoop<'_>) -> Result<Simulated, ResimulateError> {
    let Some(robot) = model.as_raven() else { return Ok(Simulated::default()) };
    let arm = robot.raven.arm(model.side());
    // Joints of the tool that were not commanded stand at home.
    let has_tool = commands.iter().any(|row| row[model.joint_count()..].iter().any(|value| *value != 0.0));
    let all = |row: &Vector| -> [f64; JOINTS] {
        let kept = if has_tool { JOINTS } else { model.joint_count() };
        std::array::from_fn(|i| if i < kept { row[i] } else { arm.limits.home()[i] })
    };
    let mut simulation = Simulation::new(robot, model.side(), options.seed, &all(&commands[0]))?;
    if options.settle_s > 0.0 {
        simulation.settle(&all(&commands[0]), options.settle_s);
    } else if let Some((motors, speeds)) = run.state_at(0) {
        let mut start = arm.transmission.motors(&all(&commands[0]));
        let known = if motors[model.joint_count()..].iter().any(|angle| *angle != 0.0) { JOINTS } else { model.joint_count() };
        start[..known].copy_from_slice(&motors[..known]);
        simulation.start_at(&start, &speeds);
    }
    let (gears, period_s) = (*arm.amplifiers.gear(), robot.raven.plant().sampling.period_s);
    let mut out = Simulated::new(JOINTS, run.len());
    let mut sampler = Sampler::new(run, period_s);
    while let Some(time_s) = sampler.next_tick_s() {
        let joints_d = all(&at(run, commands, time_s));
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

fn wide(values: &[f64; JOINTS]) -> Vector {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Commands at a time since the first row, s, on the line between two rows.
fn at(run: &Run, commands: &[Vector], time_s: f64) -> Vector {
    let time_s = time_s + run.time_s[0];
    let after = run.time_s.partition_point(|row_s| *row_s <= time_s + 1e-9).min(commands.len() - 1);
    let before = after.saturating_sub(1);
    let span_s = run.time_s[after] - run.time_s[before];
    let share = if span_s > 0.0 { ((time_s - run.time_s[before]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    // On a row (but for rounding) the row itself.
    let share = if share < 1e-6 { 0.0 } else { share };
    std::array::from_fn(|i| commands[before][i] + share * (commands[after][i] - commands[before][i]))
}

/// Cycles of a controller brought to the rows of a recording.
struct Sampler<'a> {
    run: &'a Run,
    period_s: f64,
    tick: u64,
    row: usize,
    before: Option<ArmCycle>,
}

impl<'a> Sampler<'a> {
    fn new(run: &'a Run, period_s: f64) -> Self {
        Self { run, period_s, tick: 0, row: 0, before: None }
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
            out.push_cycle(*row_s, &found);
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
