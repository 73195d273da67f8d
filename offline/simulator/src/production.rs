//! Whole runs: homing, a trajectory, full states at 1 kHz with their truth. Every run depends on its own number and seed only, or on
//! the runs before it in its session too, so any number of threads makes the same files.

use arm::{Arm, Joints, Side};
use ravenpose_wire::RavenState;
use recordings::sample::{self, Cycle};
use recordings::stream::{Record, Truth};

use crate::model::{Robot, RobotError, RobotModel};
use crate::plant::PlantError;
use crate::random::Random;
use crate::resimulate::{self, Commands, ResimulateError};
use crate::simulation::{Command, CycleOfArm, Simulation};
use crate::trajectory::{Trajectory, WORKSPACE, teleoperation, zigzag};

/// Wall clock of the first sample of the first run, s since 1970; sessions begin as many hours apart as they have runs.
const EPOCH_S: i64 = 1_700_000_000;
/// How long cables settle before the first sample, s.
const SETTLE_S: f64 = 2.0;

/// Which motion a run has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Reaches as in teleoperation.
    Teleoperation,
    /// Rows back and forth.
    Zigzag,
    /// Three runs of teleoperation, then one of zig-zag.
    Mixed,
}

/// What to make.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The robot; each run homes it anew unless [`Plan::homing_seed`] says otherwise.
    pub robot: Robot,
    /// Connected arms.
    pub sides: Vec<Side>,
    /// Length of all runs together, s.
    pub duration_s: f64,
    /// Longest run, s.
    pub run_s: f64,
    /// So many runs follow each other at once, each as warm as the last ended; at least 1, a cold start each.
    pub runs_per_session: usize,
    /// Everything follows from it.
    pub seed: u64,
    /// What homing leaves follows from this one instead, the same in every run: the robot stays homed between the runs.
    pub homing_seed: Option<u64>,
    /// What the arms do.
    pub motion: Motion,
}

/// One run of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// From 0.
    pub index: usize,
    /// Seed of motion.
    pub seed: u64,
    /// Seed of homing.
    pub homing_seed: u64,
    /// Length, s.
    pub duration_s: f64,
    /// Is it a zig-zag?
    pub zigzag: bool,
    /// Its place in its session, from 0: a cold start.
    pub in_session: usize,
}

impl Plan {
    /// Its runs, of equal length.
    pub fn runs(&self) -> Vec<Run> {
        let count = (self.duration_s / self.run_s - 1e-9).ceil().max(1.0) as usize;
        let mut random = Random::new(self.seed, 4);
        (0..count)
            .map(|index| {
                let seed = (random.share() * (1_u64 << 53) as f64) as u64;
                let zigzag = match self.motion {
                    Motion::Teleoperation => false,
                    Motion::Zigzag => true,
                    Motion::Mixed => index % 4 == 3,
                };
                let homing_seed = self.homing_seed.unwrap_or(seed);
                let in_session = index % self.runs_per_session.max(1);
                Run { index, seed, homing_seed, duration_s: self.duration_s / count as f64, zigzag, in_session }
            })
            .collect()
    }
}

impl Run {
    /// Number of control cycles.
    pub fn cycles(&self) -> u64 {
        (self.duration_s * 1e3).round() as u64
    }
}

/// One arm in a run.
struct Playing {
    arm: Arm,
    simulation: Simulation,
    way: Way,
}

/// Where an arm is sent.
enum Way {
    Made(Trajectory),
    Recorded(Commands),
}

impl Way {
    fn at(&self, time_s: f64) -> Joints {
        match self {
            Self::Made(trajectory) => trajectory.at(time_s),
            Self::Recorded(commands) => {
                let joints = commands.at(time_s);
                std::array::from_fn(|i| joints[i])
            }
        }
    }
}

/// A run being made, cycle by cycle.
pub struct Player {
    run: Run,
    arms: Vec<Playing>,
    cycle: u64,
}

impl Player {
    /// Homes the robot and lets it settle at the start of the trajectory.
    ///
    /// # Errors
    /// [`PlantError`] for effects that cannot be where they are.
    pub fn new(plan: &Plan, run: Run) -> Result<Self, PlantError> {
        let arms = plan.sides.iter().map(|side| playing(&plan.robot, *side, run)).collect::<Result<_, _>>()?;
        Ok(Self { run, arms, cycle: 0 })
    }

    /// The run after this one, in the same session: the arm put elsewhere, with what cables and motors remember.
    ///
    /// # Errors
    /// As [`Player::new`].
    pub fn followed_by(&self, plan: &Plan, run: Run) -> Result<Self, PlantError> {
        let mut next = Self::new(plan, run)?;
        for (next, last) in next.arms.iter_mut().zip(&self.arms) {
            next.simulation.go_on_from(&last.simulation);
            next.simulation.settle(&next.way.at(0.0), SETTLE_S);
        }
        Ok(next)
    }

    /// One arm along the commands of a recording: from the recorded motors and their speeds, or, where it has none, settled at
    /// the first command.
    ///
    /// # Errors
    /// [`ResimulateError`] without commands, and for effects that cannot be where they are.
    pub fn following(model: &RobotModel, recorded: &resimulate::Run, run: Run) -> Result<Self, ResimulateError> {
        let commands = Commands::of_run(model, recorded)?;
        let Some(robot) = model.as_raven() else {
            return Err(RobotError::Change("only a RAVEN-II has states".to_owned()).into());
        };
        let first: Joints = std::array::from_fn(|i| commands.first()[i]);
        let mut simulation = Simulation::new(robot, model.side(), run.homing_seed, &first)?;
        match recorded.start_of_raven(model, &commands) {
            Some((motors, speeds)) => simulation.start_at(&motors, &speeds),
            None => simulation.settle(&first, SETTLE_S),
        }
        let arm = robot.raven.arm(model.side());
        Ok(Self { run, arms: vec![Playing { arm, simulation, way: Way::Recorded(commands) }], cycle: 0 })
    }

    /// The next cycle: the state, and where each arm truly is, in the order of the plan's arms; none at the end of the run.
    pub fn next_cycle(&mut self) -> Option<(RavenState, Vec<(Side, CycleOfArm)>)> {
        if self.cycle == self.run.cycles() {
            return None;
        }
        let period_ns = 1_000_000;
        let since_start_ns = self.cycle as i64 * period_ns;
        let stamp_ns = self.start_ns() + since_start_ns;
        let mut state = sample::state_of(&Cycle { index: self.cycle, since_start_ns, stamp_ns, dt_ns: period_ns });
        let time_s = self.cycle as f64 * 1e-3;
        let cycles = self
            .arms
            .iter_mut()
            .map(|playing| {
                let cycle = playing.simulation.tick(&Command::Joints(playing.way.at(time_s)));
                sample::put(&mut state, &playing.arm, &cycle.reported);
                (playing.arm.side, cycle)
            })
            .collect();
        self.cycle += 1;
        Some((state, cycles))
    }

    /// Gives every record of the run, in order, to `take`: a state, then the truth of each arm.
    ///
    /// # Errors
    /// Whatever `take` refuses.
    pub fn records<E>(&mut self, mut take: impl FnMut(&Record) -> Result<(), E>) -> Result<(), E> {
        let start_ns = self.start_ns();
        while let Some((state, cycles)) = self.next_cycle() {
            let time_ns = start_ns + state.source_time_ns;
            take(&Record::State(Box::new(state)))?;
            for (side, cycle) in &cycles {
                take(&Record::Truth(truth(time_ns, *side, cycle)))?;
            }
        }
        Ok(())
    }

    /// Are its arms somewhere? Where steps cannot follow what pulls at a joint its numbers grow without bound, and stay no numbers.
    pub fn is_somewhere(&self) -> bool {
        self.arms.iter().all(|playing| playing.simulation.state().is_finite())
    }

    /// Offset that homing left on an arm, rad and m.
    pub fn homing_offset(&self, side: Side) -> Option<&Joints> {
        self.arms.iter().find(|playing| playing.arm.side == side).map(|playing| playing.simulation.homing_offset())
    }

    fn start_ns(&self) -> i64 {
        let session = (self.run.index - self.run.in_session) as i64;
        (EPOCH_S + 3600 * session + self.run.in_session as i64 * self.run.duration_s.ceil() as i64) * 1_000_000_000
    }
}

fn playing(robot: &Robot, side: Side, run: Run) -> Result<Playing, PlantError> {
    let arm = robot.raven.arm(side);
    let seed = run.seed ^ (side.index() as u64) << 40;
    let mut random = Random::new(seed, 5);
    let start: Joints = WORKSPACE.map(|(low, high)| random.between(low + 0.3 * (high - low), high - 0.3 * (high - low)));
    let make = if run.zigzag { zigzag } else { teleoperation };
    let trajectory = make(seed, start, &WORKSPACE, run.duration_s);
    let homing_seed = run.homing_seed ^ (side.index() as u64) << 40;
    let mut simulation = Simulation::new(robot, side, homing_seed, &start)?;
    simulation.settle(&start, SETTLE_S);
    Ok(Playing { arm, simulation, way: Way::Made(trajectory) })
}

fn truth(time_ns: i64, side: Side, cycle: &CycleOfArm) -> Truth {
    let (t, q) = (&cycle.truth.tip.translation.vector, cycle.truth.tip.rotation.quaternion());
    Truth {
        time_ns,
        side,
        position_m: [t.x, t.y, t.z],
        quaternion_wxyz: [q.w, q.i, q.j, q.k],
        joints: cycle.truth.joints,
        cable_force_n: cycle.truth.cable_force_n,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_a_session_begins_as_warm_as_the_last_ended() {
        let robot = RobotModel::load("raven2-worn").ok().and_then(|model| model.as_raven().cloned()).expect("worn robot");
        let plan = Plan {
            robot,
            sides: vec![Side::Gold],
            duration_s: 9.0,
            run_s: 3.0,
            runs_per_session: 2,
            seed: 3,
            homing_seed: Some(1),
            motion: Motion::Teleoperation,
        };
        let runs = plan.runs();
        assert_eq!(runs.iter().map(|run| run.in_session).collect::<Vec<_>>(), [0, 1, 0]);
        let mut first = Player::new(&plan, runs[0]).expect("a run");
        while first.next_cycle().is_some() {}
        let warmth = |player: &mut Player| {
            let simulation = &mut player.arms[0].simulation;
            let slot = simulation.plant().drive_mut(2).thermal[0].1;
            simulation.state().memories[slot]
        };
        let (mut cold, mut warm) = (Player::new(&plan, runs[1]).expect("a run"), first.followed_by(&plan, runs[1]).expect("a run"));
        let [end, cold, begun] = [&mut first, &mut cold, &mut warm].map(warmth);
        // Two seconds of holding still, with a time constant of 15 minutes.
        assert!(end > 1e-4 && cold < 0.8 * end && (begun / end - 1.0).abs() < 0.2, "{end} {cold} {begun}");
        // One after the other by the clock too.
        assert_eq!(warm.start_ns() - first.start_ns(), 3_000_000_000);
        assert_eq!(Player::new(&plan, runs[2]).expect("a run").start_ns() - first.start_ns(), 2 * 3_600_000_000_000);
    }
}
