//! One run: the columns that the engine uses, on a uniform clock, in SI and at the joints.

use std::cell::RefCell;

use nalgebra::DMatrix;
use recordings::Recording;

use crate::clock::{Clock, by_points};
use crate::past::Past;
use crate::readings::{self, Kind, NoReadings};
use crate::robot::Robot;
use crate::run_error::RunError;
use crate::saturation::{self, Saturated};
use crate::series::{mean, rms};

/// Longest stretch without a value that is bridged by a line; what lies around a longer one is left out, s.
const HOLE_S: f64 = 0.005;
/// The same for joint encoders: they are bridged as the difference to the motor, which changes slowly, s.
const HOLE_OF_TRUTH_S: f64 = 0.025;
/// A channel that would leave less than this share of a run is left out instead.
const KEEP: f64 = 0.5;

/// Signals of one run of one source (recording or simulation), each N series of equal length.
#[derive(Debug, Clone)]
pub struct Run {
    /// Name for the report.
    pub id: String,
    /// First time, s.
    pub start_s: f64,
    /// Its first sample from the start of the run of which it is a part, s; 0 of a whole run.
    pub since_s: f64,
    /// Where joints and drives turned before that.
    pub past: Past,
    /// Sample period, s; 1 of points.
    pub dt_s: f64,
    /// Are the samples points without a clock, at each of which the robot stood?
    pub points: bool,
    /// Joint positions as the motors say them, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Torques of the motors at the joints (Aᵀ τ), N·m or N.
    pub torque: Option<Vec<Vec<f64>>>,
    /// Joint positions measured at the joints.
    pub truth: Option<Vec<Vec<f64>>>,
    /// Commanded joint positions.
    pub command: Option<Vec<Vec<f64>>>,
    /// Positions of the drives in joint units: joint positions and what the other joints' cables add.
    pub drive: Vec<Vec<f64>>,
    /// Motor positions, rad.
    pub motor: Option<Vec<Vec<f64>>>,
    /// Measured tip in the base frame, m; NaN where there was no frame.
    pub tip: Option<[Vec<f64>; 3]>,
    /// What stands in the recording and was taken as no reading.
    pub no_readings: Vec<NoReadings>,
    /// Samples that were not recorded, in which the series are bridged, or in which a torque stands at its limit: nothing may be concluded
    /// from them.
    pub mask: Vec<bool>,
    /// Columns left out because most of their cells are empty.
    pub left_out: Vec<String>,
    /// Columns that only some joints have, so that none is used: the first one that is not there, of each quantity.
    pub lacks: Vec<String>,
    /// Torques that stand at a limit.
    pub saturated: Vec<Saturated>,
}

/// A recording and the simulation of the same commands, if there is one.
pub type Both = (Run, Option<Run>);

/// How long a run is: what a report says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// First time as it is told, s.
    pub start_s: f64,
    /// Number of samples.
    pub samples: usize,
    /// Sample period, s.
    pub dt_s: f64,
}

impl Extent {
    /// Time of a sample as it is told, s.
    pub fn time_s(&self, i: usize) -> f64 {
        self.start_s + i as f64 * self.dt_s
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        self.samples as f64 * self.dt_s
    }
}

impl Run {
    /// How long it is.
    pub fn extent(&self) -> Extent {
        Extent { start_s: self.told_s(self.start_s), samples: self.len(), dt_s: self.dt_s }
    }

    /// A time of this run as a report has it: on the recording's clock, or from the run's first row on where that clock begins below 0.
    pub fn told_s(&self, time_s: f64) -> f64 {
        time_s - (self.start_s - self.since_s).min(0.0)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.position[0].len()
    }

    /// Has it no samples?
    pub fn is_empty(&self) -> bool {
        self.position.is_empty() || self.position[0].is_empty()
    }

    /// Rows from one position to the next, where they are too far apart for what is between them to be believed.
    pub(crate) fn rows_apart(&self) -> Option<usize> {
        self.no_readings.iter().find_map(NoReadings::period).filter(|period| *period as f64 * self.dt_s > HOLE_S)
    }

    /// Time of a sample, s.
    pub fn time_s(&self, i: usize) -> f64 {
        self.start_s + i as f64 * self.dt_s
    }

    /// Time of a sample from the start of the whole run, s.
    pub fn elapsed_s(&self, i: usize) -> f64 {
        self.since_s + i as f64 * self.dt_s
    }

    /// Takes the columns of a recording.
    ///
    /// # Errors
    /// [`RunError`] where time or positions are missing.
    pub fn new(recording: &Recording, robot: &Robot) -> Result<Self, RunError> {
        let run = recording.name.clone();
        let n = robot.joint_count();
        let clock = match recording.time_s() {
            Some(time) if !by_points(time) => Clock::of(&run, time)?,
            // Points at which the robot stopped and was measured: their order is known, and that is all that is needed.
            _ if is_table(recording, robot) => Clock::of_points(recording.rows()),
            Some(time) => Clock::of(&run, time)?,
            None => return Err(RunError::NoTime { run }),
        };
        let time: Vec<f64> = recording.time_s().map_or_else(Vec::new, <[f64]>::to_vec);
        same_kinds(&run, recording, robot)?;
        let mapped = |name: &str| {
            let (_, source, scale) = robot.columns.iter().find(|(own, ..)| own == name)?;
            recording.column(source).map(|column| column.iter().map(|x| x * scale).collect::<Vec<f64>>())
        };
        let column = |name: &str| mapped(name).or_else(|| recording.column(name).map(<[f64]>::to_vec));
        let no_readings: RefCell<Vec<NoReadings>> = RefCell::new(Vec::new());
        let slow_places = || no_readings.borrow().iter().find_map(NoReadings::period);
        // A column without a single value is not there. A sensor's is without what is no reading of it.
        let series = |kind: Option<Kind>, name: &str| {
            let mut set = [column(name).filter(|column| column.iter().any(|x| x.is_finite()))?];
            if let (Some(kind), false) = (kind, clock.points) {
                let as_seldom = slow_places().filter(|_| kind != Kind::Place);
                let repeats = as_seldom.and_then(|period| readings::without_repeats(&mut set, clock.dt_s, name, period));
                let others = readings::without_false(&mut set, clock.dt_s, name, kind);
                no_readings.borrow_mut().extend(repeats.into_iter().chain(others));
            }
            Some(clock.resample(&time, &set[0]))
        };
        let unit = |j: usize| if robot.prismatic[j] { "m" } else { "rad" };
        // The first of the names that every joint has.
        let all = |kind: Option<Kind>, names: &[&dyn Fn(usize) -> String]| {
            names.iter().find_map(|name| (0..n).map(|j| series(kind, &name(j))).collect::<Option<Vec<_>>>())
        };
        // Where only some joints have it, the first column that is missing.
        let lacking = |name: &dyn Fn(usize) -> String| {
            let missing: Vec<usize> = (0..n).filter(|&j| series(None, &name(j)).is_none()).collect();
            missing.first().filter(|_| missing.len() < n).map(|&j| name(j))
        };
        let (place, force) = (Some(Kind::Place), Some(Kind::Force));
        let motor = all(place, &[&|j| format!("mpos_{}_rad", j + 1)]);
        let reported = || {
            all(
                place,
                &[
                    &|j| format!("jpos_{}_{}", j + 1, unit(j)),
                    &|j| format!("q_{}_{}", j + 1, unit(j)),
                    &|j| format!("q_{}", j + 1),
                    &|j| format!("q_des_{}", j + 1),
                    &|j| format!("q_des_{}_{}", j + 1, unit(j)),
                ],
            )
        };
        let from_motors = motor.is_some();
        let position = match &motor {
            Some(motor) => joints_of(robot, motor),
            None => reported().ok_or_else(|| {
                let lacks = |name: String| series(None, &name).is_none();
                let lacks_both = |j: &usize| lacks(format!("mpos_{}_rad", j + 1)) && lacks(format!("jpos_{}_{}", j + 1, unit(*j)));
                let joint = (0..n).find(lacks_both).unwrap_or(0);
                RunError::NoPosition { run: run.clone(), joint: joint + 1, unit: unit(joint), robot: robot.name.clone(), joints: n }
            })?,
        };
        // Torques as they were recorded, before motors become joints: that is where a limit shows.
        let mut limited = (Vec::new(), vec![false; position[0].len()]);
        let mut see = |tau: Vec<Vec<f64>>| {
            limited = saturation::of(&tau, motor.as_ref().unwrap_or(&position));
            tau
        };
        let at_joints = |tau: Vec<Vec<f64>>| combine(&robot.motor_from_joint.transpose(), &tau);
        let of_motors = from_motors || recording.column("jtau_1_nm").is_none();
        let motor_torque = of_motors.then(|| all(force, &[&|j| format!("tau_{}_nm", j + 1)])).flatten();
        let joint_torque = || {
            let effort = |j: usize| if robot.prismatic[j] { "n" } else { "nm" };
            let old = |j: usize| if robot.prismatic[j] { "N" } else { "Nm" };
            all(
                force,
                &[&|j| format!("jtau_{}_{}", j + 1, effort(j)), &|j| format!("tau_{}", j + 1), &|j| {
                    format!("tau_{}_{}", j + 1, old(j))
                }],
            )
        };
        let counted = || {
            let known = robot.drives.iter().all(|drive| drive.torque_per_count != 0.0);
            let counts = all(force, &[&|j| format!("dac_{}_counts", j + 1)]).filter(|_| known)?;
            let torque =
                counts.iter().zip(&robot.drives).map(|(dac, drive)| dac.iter().map(|x| x * drive.torque_per_count).collect());
            Some(torque.collect())
        };
        let torque = match (motor_torque, joint_torque()) {
            (Some(motors), _) => Some(at_joints(see(motors))),
            (None, Some(joints)) => Some(see(joints)),
            (None, None) => counted().map(|motors| at_joints(see(motors))),
        };
        let mut tip = match ["x", "y", "z"].map(|axis| column(&format!("truth_{axis}_m"))) {
            [Some(x), Some(y), Some(z)] => {
                let mut tip = [x, y, z];
                no_readings.borrow_mut().extend(readings::without_zeros(&mut tip));
                if !clock.points {
                    no_readings.borrow_mut().extend(readings::without_false(&mut tip, clock.dt_s, "the tip", Kind::Place));
                }
                let seen = tip.iter().all(|axis| axis.iter().any(|x| x.is_finite()));
                seen.then(|| tip.map(|axis| clock.resample(&time, &axis)))
            }
            _ => None,
        };
        let truth = all(
            place,
            &[&|j| format!("truth_jpos_{}_{}", j + 1, unit(j)), &|j| format!("q_act_{}", j + 1), &|j| {
                format!("q_act_{}_{}", j + 1, unit(j))
            }],
        );
        // The arm is joints 1 to 3: what the wrist moves the tip by is no difference of them.
        let wrist = |name: &str| (4..=7).map(|j| series(None, &format!("{name}_{j}_rad"))).collect::<Option<Vec<_>>>();
        let with_wrist = robot.with_wrist.is_some() && tip.is_some();
        if let (Some(tip), Some(wrist)) = (&mut tip, with_wrist.then(|| wrist("truth_jpos").or_else(|| wrist("jpos"))).flatten()) {
            straighten(robot, tip, truth.as_ref().unwrap_or(&position), &wrist);
        }
        let of_torque = torque.is_none().then(|| {
            let effort = |j: usize| if robot.prismatic[j] { "n" } else { "nm" };
            lacking(&|j| format!("tau_{}_nm", j + 1)).or_else(|| lacking(&|j| format!("jtau_{}_{}", j + 1, effort(j))))
        });
        let of_truth = truth.is_none().then(|| lacking(&|j| format!("truth_jpos_{}_{}", j + 1, unit(j))));
        let lacks = [of_torque, of_truth].into_iter().flatten().flatten().collect();
        let mut made = Self {
            id: run,
            start_s: clock.start_s,
            since_s: 0.0,
            past: Past::default(),
            dt_s: clock.dt_s,
            mask: limited.1,
            points: clock.points,
            drive: combine(&robot.coupling(), &position),
            position,
            torque,
            truth,
            command: all(Some(Kind::Command), &[&|j| format!("jpos_d_{}_{}", j + 1, unit(j))]),
            motor,
            tip,
            no_readings: no_readings.into_inner(),
            left_out: Vec::new(),
            lacks,
            saturated: limited.0,
        };
        made.alive(robot)?;
        made.bridge();
        Ok(made)
    }

    /// Places of joints and drives anew, after those of the motors changed.
    pub(crate) fn place_by_motors(&mut self, robot: &Robot) {
        if let Some(motor) = &self.motor {
            self.position = joints_of(robot, motor);
        }
        self.place_drives(robot);
    }

    /// Places of the drives anew, after those of the joints changed.
    pub(crate) fn place_drives(&mut self, robot: &Robot) {
        self.drive = combine(&robot.coupling(), &self.position);
    }

    /// A sensor that is the same in every row while its joint moves is broken or was not recorded.
    fn alive(&self, robot: &Robot) -> Result<(), RunError> {
        let moves: Vec<bool> = self.position.iter().map(|series| !constant(series)).collect();
        let name = |quantity: &str, j: usize, unit: &str| format!("{quantity}_{}_{unit}", j + 1);
        let Some(moving) = moves.iter().position(|moves| *moves) else {
            let column = if self.motor.is_some() { name("mpos", 0, "rad") } else { name("jpos", 0, robot.position_unit(0)) };
            return Err(RunError::Still { run: self.id.clone(), column });
        };
        let dead = |column: String, moving: usize| {
            Err(RunError::Constant { run: self.id.clone(), column, moving: format!("joint {} moves", moving + 1) })
        };
        for j in (0..moves.len()).filter(|j| moves[*j]) {
            if self.torque.as_ref().is_some_and(|torque| constant(&torque[j])) {
                return dead(format!("the torque of joint {}", j + 1), j);
            }
            if self.truth.as_ref().is_some_and(|truth| constant(&truth[j])) {
                return dead(name("truth_jpos", j, robot.position_unit(j)), j);
            }
        }
        if self.tip.as_ref().is_some_and(|tip| tip.iter().all(|axis| constant(axis))) {
            return dead("the measured tip (truth_x, truth_y, truth_z)".to_owned(), moving);
        }
        Ok(())
    }

    /// Draws lines over cells that are empty, and marks those that are too long to be believed.
    fn bridge(&mut self) {
        let dt_s = self.dt_s;
        for series in self.position.iter_mut().chain(&mut self.drive) {
            mark(&mut self.mask, &bridged(series, dt_s, HOLE_S));
        }
        let length = self.mask.len();
        // A channel that is mostly not there must not take the others with it.
        let mut keep = |name: &str, holes: Vec<bool>, mask: &mut Vec<bool>| {
            let kept = (holes.iter().filter(|hole| !**hole).count() as f64) >= KEEP * length as f64;
            if kept {
                mark(mask, &holes);
            } else {
                self.left_out.push(name.to_owned());
            }
            kept
        };
        if let Some(torque) = &mut self.torque {
            let mut holes = vec![false; length];
            for series in torque.iter_mut() {
                mark(&mut holes, &bridged(series, dt_s, HOLE_S));
            }
            if !keep("tau", holes, &mut self.mask) {
                self.torque = None;
            }
        }
        if let Some(truth) = &mut self.truth {
            let mut holes = vec![false; length];
            for (truth, position) in truth.iter_mut().zip(&self.position) {
                let mut deflection: Vec<f64> = position.iter().zip(&*truth).map(|(m, q)| m - q).collect();
                mark(&mut holes, &bridged(&mut deflection, dt_s, HOLE_OF_TRUTH_S));
                truth.iter_mut().zip(position).zip(deflection).filter(|((q, _), _)| q.is_nan()).for_each(|((q, m), d)| *q = m - d);
            }
            if !keep("truth_jpos", holes, &mut self.mask) {
                self.truth = None;
            }
        }
        for set in [&mut self.command, &mut self.motor].into_iter().flatten() {
            for series in set {
                let _ = bridged(series, dt_s, HOLE_S);
            }
        }
    }

    /// A drive's positions, and where it turned before.
    pub(crate) fn drive_and_past(&self, j: usize) -> [&[f64]; 2] {
        [self.past.drive.get(j).map_or(&[], Vec::as_slice), &self.drive[j]]
    }

    /// The same of a joint.
    pub(crate) fn position_and_past(&self, j: usize) -> [&[f64]; 2] {
        [self.past.position.get(j).map_or(&[], Vec::as_slice), &self.position[j]]
    }

    /// The same at other times: samples `dt_s` apart from `start_s` on, `count` of them, all within the run.
    fn at(&self, start_s: f64, dt_s: f64, count: usize) -> Self {
        let first = (start_s - self.start_s) / self.dt_s;
        let step = dt_s / self.dt_s;
        let last = self.len() - 1;
        let places: Vec<(usize, f64)> = (0..count)
            .map(|i| {
                let at = (first + i as f64 * step).clamp(0.0, last as f64);
                // On a sample but for rounding.
                let at = if (at - at.round()).abs() < 1e-3 { at.round() } else { at };
                (at as usize, at.fract())
            })
            .collect();
        let value = |s: &[f64], (k, share): (usize, f64)| {
            let next = s[(k + 1).min(last)];
            let between = if share == 0.0 { s[k] } else { s[k] + share * (next - s[k]) };
            if between.is_finite() || share == 0.0 {
                between
            } else if share < 0.5 {
                s[k]
            } else {
                next
            }
        };
        let series = |s: &Vec<f64>| places.iter().map(|place| value(s, *place)).collect::<Vec<f64>>();
        let set = |set: &Vec<Vec<f64>>| set.iter().map(series).collect::<Vec<_>>();
        Self {
            id: self.id.clone(),
            start_s,
            since_s: 0.0,
            past: self.past.clone(),
            dt_s,
            points: self.points,
            position: set(&self.position),
            drive: set(&self.drive),
            torque: self.torque.as_ref().map(set),
            truth: self.truth.as_ref().map(set),
            command: self.command.as_ref().map(set),
            motor: self.motor.as_ref().map(set),
            tip: self.tip.as_ref().map(|tip| tip.each_ref().map(series)),
            no_readings: self.no_readings.clone(),
            mask: places.iter().map(|(k, share)| self.mask[*k] || (*share > 0.0 && self.mask[(k + 1).min(last)])).collect(),
            left_out: self.left_out.clone(),
            lacks: self.lacks.clone(),
            saturated: self.saturated.clone(),
        }
    }

    /// The samples from `from` up to `to`.
    #[must_use]
    pub fn slice(&self, from: usize, to: usize) -> Self {
        let cut = |set: &Vec<Vec<f64>>| set.iter().map(|s| s[from..to].to_vec()).collect::<Vec<_>>();
        Self {
            id: self.id.clone(),
            start_s: self.time_s(from),
            since_s: self.since_s + from as f64 * self.dt_s,
            past: if from == 0 { self.past.clone() } else { self.past.until(&self.position, &self.drive, from) },
            dt_s: self.dt_s,
            points: self.points,
            position: cut(&self.position),
            drive: cut(&self.drive),
            torque: self.torque.as_ref().map(cut),
            truth: self.truth.as_ref().map(cut),
            command: self.command.as_ref().map(cut),
            motor: self.motor.as_ref().map(cut),
            tip: self.tip.as_ref().map(|tip| tip.each_ref().map(|s| s[from..to].to_vec())),
            no_readings: self.no_readings.clone(),
            mask: self.mask[from..to].to_vec(),
            left_out: self.left_out.clone(),
            lacks: self.lacks.clone(),
            saturated: self.saturated.clone(),
        }
    }
}

/// Is every value that is there the same?
fn constant(series: &[f64]) -> bool {
    let mut values = series.iter().filter(|x| x.is_finite());
    values.next().is_none_or(|first| values.all(|x| x == first))
}

fn mark(mask: &mut [bool], holes: &[bool]) {
    mask.iter_mut().zip(holes).for_each(|(mask, hole)| *mask |= hole);
}

/// Draws a line over each stretch of NaN, holds the ends; true where a stretch is longer than `hole_s`. A single sample never
/// is, but at the ends.
pub(crate) fn bridged(series: &mut [f64], dt_s: f64, hole_s: f64) -> Vec<bool> {
    let mut holes = vec![false; series.len()];
    let mut i = 0;
    while i < series.len() {
        if series[i].is_finite() {
            i += 1;
            continue;
        }
        let end = series[i..].iter().position(|x| x.is_finite()).map_or(series.len(), |k| i + k);
        let (before, after) = (i.checked_sub(1).map(|k| series[k]), series.get(end).copied());
        let count = end - i;
        let long = before.is_none() || after.is_none() || (count > 1 && count as f64 * dt_s > hole_s);
        for k in i..end {
            holes[k] = long;
            series[k] = match (before, after) {
                (Some(a), Some(b)) => a + (b - a) * (k + 1 - i) as f64 / (count + 1) as f64,
                (Some(held), None) | (None, Some(held)) => held,
                (None, None) => 0.0,
            };
        }
        i = end;
    }
    holes
}

/// Refuses a recording of a robot whose joints turn where this one's slide.
fn same_kinds(run: &str, recording: &Recording, robot: &Robot) -> Result<(), RunError> {
    for (j, prismatic) in robot.prismatic.iter().enumerate() {
        let (own, other, moves) = if *prismatic { ("m", "rad", "slides") } else { ("rad", "m", "turns") };
        for quantity in ["jpos", "jpos_d", "truth_jpos", "q"] {
            let name = |unit: &str| format!("{quantity}_{}_{unit}", j + 1);
            if recording.column(&name(other)).is_some() && recording.column(&name(own)).is_none() {
                let (run, robot) = (run.to_owned(), robot.name.clone());
                return Err(RunError::OtherJoint { run, column: name(other), joint: j + 1, robot, moves });
            }
        }
    }
    Ok(())
}

/// Largest distance of two motions that count as one, of a joint's own spread (RMS).
const APART: f64 = 0.25;

/// Is one the same motion as the other at the same time, so that their torques may be compared sample by sample?
pub fn alike(robot: &Robot, real: &Run, sim: &Run) -> bool {
    let Ok((real, sim)) = common(real, sim) else { return false };
    (0..real.position.len()).all(|j| {
        let (distance, spread) = apart(robot, &real, &sim, j);
        distance <= APART * spread
    })
}

/// Distance of a joint's two motions, sample by sample, and the recording's own spread, RMS, rad or m. A joint that stands in both may hang
/// anywhere within what counts as standing.
pub fn apart(robot: &Robot, real: &Run, sim: &Run, joint: usize) -> (f64, f64) {
    let (a, b) = (&real.position[joint], &sim.position[joint]);
    let middle = mean(a);
    let least = robot.least_travel(joint);
    let stands = !robot.moves(joint, a) && !robot.moves(joint, b);
    let spread = if stands { least / APART } else { rms(a.iter().map(|x| x - middle)).max(least) };
    (rms(a.iter().zip(b).map(|(a, b)| a - b)), spread)
}

/// Share of the recording's own jitter from which on a simulation's torque is not that of a simulation.
const JITTER: f64 = 0.3;
/// Share of the recording's own jitter that is left between two torques which are one: noise of its own would leave all of it, and more.
const ONE_JITTER: f64 = 0.5;

/// Does the torque of one jitter like that of the other, by a noise of its own? A torque that was copied, or drove the simulation, has the other's.
pub fn as_noisy(real: &Run, sim: &Run) -> bool {
    let n = real.position.len();
    let most = |of: &dyn Fn(usize) -> bool| 2 * (0..n).filter(|j| of(*j)).count() > n;
    let noisy = |j: usize| jitter(torque(sim, j)) > JITTER * jitter(torque(real, j));
    let own = |(real, sim): (Run, Run)| {
        most(&|j| {
            let (real, sim) = (torque(&real, j), torque(&sim, j));
            let between: Vec<f64> = real.iter().zip(sim).map(|(real, sim)| real - sim).collect();
            jitter(&between) > ONE_JITTER * jitter(real)
        })
    };
    most(&noisy) && common(real, sim).map_or(true, own)
}

/// Torque of a joint; nothing where there is none.
fn torque(run: &Run, joint: usize) -> &[f64] {
    run.torque.as_ref().map_or(&[], |torque| &torque[joint])
}

/// Third difference over the largest one, up to which a series is a line there: where it was bridged.
const STRAIGHT: f64 = 1e-9;

/// How much a series jitters: the median of its third differences, but for where it is a line.
fn jitter(series: &[f64]) -> f64 {
    let mut steps: Vec<f64> = series.windows(4).map(|x| (x[3] - 3.0 * x[2] + 3.0 * x[1] - x[0]).abs()).collect();
    let straight = STRAIGHT * steps.iter().copied().fold(0.0, f64::max);
    steps.retain(|step| *step > straight);
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Units that a time is told in by mistake, per s, and how near to one a ratio of clocks is that unit.
const UNITS_OF_TIME: [(f64, &str); 3] = [(1e3, "ms"), (1e6, "µs"), (1e9, "ns")];
const NEAR_A_UNIT: f64 = 0.01;

/// Are the times of a recording and of its simulation told in one unit?
///
/// # Errors
/// [`RunError::UnitOfTime`].
pub fn in_one_unit_of_time(real: &Run, sim: &Run) -> Result<(), RunError> {
    for (long, short) in [(real, sim), (sim, real)] {
        let times = long.dt_s / short.dt_s;
        if let Some((_, unit)) = UNITS_OF_TIME.iter().find(|(per_s, _)| (times / per_s - 1.0).abs() < NEAR_A_UNIT) {
            let (run, other) = (long.id.clone(), short.id.clone());
            return Err(RunError::UnitOfTime { run, other, times: format!("{times:.0}"), unit });
        }
    }
    Ok(())
}

/// The common stretch of a recording and its simulation, sample for sample, on the recording's clock.
///
/// # Errors
/// [`RunError::NoOverlap`].
pub fn common(real: &Run, sim: &Run) -> Result<(Run, Run), RunError> {
    let end_s = |run: &Run| run.time_s(run.len() - 1);
    let end = end_s(real).min(end_s(sim));
    // The recording's first sample that the simulation has too.
    let first = ((sim.start_s - real.start_s) / real.dt_s - 1e-3).ceil().max(0.0);
    let start = real.start_s + first * real.dt_s;
    let count = ((end - start) / real.dt_s + 1.0 + 1e-3).floor();
    if count < 2.0 || first as usize >= real.len() {
        let span = |run: &Run| format!("{:.3} to {:.3} s", run.start_s, end_s(run));
        return Err(RunError::NoOverlap { run: real.id.clone(), run_s: span(real), sim: sim.id.clone(), sim_s: span(sim) });
    }
    let first = first as usize;
    let count = (count as usize).min(real.len() - first);
    let (mut real, mut sim) = (real.slice(first, first + count), sim.at(start, real.dt_s, count));
    mark(&mut real.mask, &sim.mask);
    sim.mask.clone_from(&real.mask);
    Ok((real, sim))
}

/// Takes off a tip what the wrist moves it by, wherever there is one.
fn straighten(robot: &Robot, tip: &mut [Vec<f64>; 3], joints: &[Vec<f64>], wrist: &[Vec<f64>]) {
    let (Ok(joints), Ok(wrist)) = (<&[Vec<f64>; 3]>::try_from(joints), <&[Vec<f64>; 4]>::try_from(wrist)) else { return };
    for i in 0..tip[0].len() {
        if tip[0][i].is_finite() {
            let off = robot.off_by_wrist(joints.each_ref().map(|s| s[i]), wrist.each_ref().map(|s| s[i]));
            tip.iter_mut().zip(off).for_each(|(axis, off)| axis[i] -= off);
        }
    }
}

/// Joints as the motors say them.
fn joints_of(robot: &Robot, motor: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = robot.joint_count();
    let inverse = robot.motor_from_joint.clone().try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
    let mut joints = combine(&inverse, motor);
    for (series, drive) in joints.iter_mut().zip(&robot.drives) {
        for q in series.iter_mut() {
            *q += drive.offset;
        }
    }
    joints
}

/// Rows of a matrix times a set of series.
fn combine(matrix: &DMatrix<f64>, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let samples = series[0].len();
    (0..matrix.nrows())
        .map(|i| {
            let mut out = vec![0.0; samples];
            for (j, series) in series.iter().enumerate() {
                let weight = matrix[(i, j)];
                if weight != 0.0 {
                    out.iter_mut().zip(series).for_each(|(out, x)| *out += weight * x);
                }
            }
            out
        })
        .collect()
}

/// Has a recording what can be compared without a clock: positions, and the same measured at the joints?
fn is_table(recording: &Recording, robot: &Robot) -> bool {
    let has = |name: &String| {
        let mapped = robot.columns.iter().any(|(own, source, _)| own == name && recording.column(source).is_some());
        mapped || recording.column(name).is_some()
    };
    (0..robot.joint_count()).all(|j| {
        let (n, unit) = (j + 1, robot.position_unit(j));
        [format!("truth_jpos_{n}_{unit}"), format!("q_act_{n}"), format!("q_act_{n}_{unit}")].iter().any(has)
    })
}

#[cfg(test)]
impl Run {
    /// One joint at places 1 ms apart.
    pub(crate) fn of_one_joint(series: &[f64]) -> Self {
        Self {
            id: String::new(),
            start_s: 0.0,
            since_s: 0.0,
            past: Past::default(),
            dt_s: 0.001,
            points: false,
            position: vec![series.to_vec()],
            drive: vec![series.to_vec()],
            torque: None,
            truth: None,
            command: None,
            motor: None,
            tip: None,
            no_readings: Vec::new(),
            mask: vec![false; series.len()],
            left_out: Vec::new(),
            lacks: Vec::new(),
            saturated: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use recordings::Column;
    use simulator::model::RobotModel;

    fn robot() -> Robot {
        Robot::of(&RobotModel::load("raven2-nominal").expect("it ships"))
    }

    /// Three motors that turn evenly, a tip every 20 ms, and whatever else; rows at the times given.
    fn recording(time: &[f64], more: Vec<Column>) -> Recording {
        let motor = |j: usize| Column::new(format!("mpos_{j}_rad"), time.iter().map(|t| j as f64 * t).collect());
        let frame = |t: f64| (t / 0.02 - (t / 0.02).round()).abs() < 1e-6;
        let tip = |axis: &str| {
            Column::new(format!("truth_{axis}_m"), time.iter().map(|t| if frame(*t) { *t } else { f64::NAN }).collect())
        };
        let mut columns = vec![Column::new("t_s", time.to_vec())];
        columns.extend((1..=3).map(motor));
        columns.extend(["x", "y", "z"].map(tip));
        columns.extend(more);
        Recording { name: "made up".to_owned(), columns, ..Recording::default() }
    }

    fn even(count: usize, dt_s: f64) -> Vec<f64> {
        (0..count).map(|i| i as f64 * dt_s).collect()
    }

    #[test]
    fn lines_bridge_holes_and_long_ones_are_marked() {
        let none = f64::NAN;
        let mut series = [none, 1.0, none, 3.0, none, none, none, 7.0, none];
        let holes = bridged(&mut series, 0.001, 0.002);
        assert_eq!(series, [1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 7.0]);
        assert_eq!(holes, [true, false, false, false, true, true, true, false, true]);
        assert_eq!(bridged(&mut [none, none], 0.001, 1.0), [true, true]);
    }

    #[test]
    fn lost_rows_are_marked_and_cost_no_frame_of_the_camera() {
        let whole = even(1000, 0.001);
        let lost: Vec<f64> =
            whole.iter().copied().enumerate().filter(|(i, _)| *i != 333 && !(500..=600).contains(i)).map(|(_, t)| t).collect();
        let run = Run::new(&recording(&lost, Vec::new()), &robot()).expect("a run");
        assert_eq!(run.len(), 1000);
        assert!(run.position.iter().flatten().all(|q| q.is_finite()));
        // One row is bridged, a tenth of a second is not believed.
        assert_eq!(run.mask.iter().filter(|masked| **masked).count(), 101);
        assert!(run.mask[500] && run.mask[600] && !run.mask[333] && !run.mask[499] && !run.mask[601]);
        let frames: Vec<usize> = (0..1000).filter(|i| run.tip.as_ref().is_some_and(|tip| tip[0][*i].is_finite())).collect();
        let recorded: Vec<usize> = (0..1000).step_by(20).filter(|i| !(500..=600).contains(i)).collect();
        assert_eq!(frames, recorded);
    }

    #[test]
    fn joint_encoders_that_come_seldom_are_bridged_by_the_motor() {
        let time = even(1000, 0.001);
        let inverse = robot().motor_from_joint.try_inverse().expect("regular");
        let truth =
            |j: usize, t: f64| (0..3).map(|k| inverse[(j, k)] * (k + 1) as f64 * t).sum::<f64>() + robot().drives[j].offset - 1e-3;
        let column = |j: usize| {
            let unit = if j == 2 { "m" } else { "rad" };
            let cell = |(i, t): (usize, &f64)| if i % 20 == 0 || i == 999 { truth(j, *t) } else { f64::NAN };
            Column::new(format!("truth_jpos_{}_{unit}", j + 1), time.iter().enumerate().map(cell).collect())
        };
        let run = Run::new(&recording(&time, (0..3).map(column).collect()), &robot()).expect("a run");
        assert!(run.mask.iter().all(|masked| !masked));
        for (j, series) in run.truth.expect("encoders").iter().enumerate() {
            series.iter().zip(&time).for_each(|(q, t)| assert!((q - truth(j, *t)).abs() < 1e-9));
        }
    }

    #[test]
    fn a_simulation_of_another_rate_and_start_comes_to_the_recordings_clock() {
        let robot = robot();
        let run = |time: &[f64]| Run::new(&recording(time, Vec::new()), &robot).expect("a run");
        let later: Vec<f64> = even(300, 0.0025).iter().map(|t| t + 0.1004).collect();
        let (real, sim) = common(&run(&even(1000, 0.001)), &run(&later)).expect("overlap");
        assert_eq!((real.len(), sim.len()), (747, 747));
        assert!((real.start_s - 0.101).abs() < 1e-9 && (sim.start_s - real.start_s).abs() < 1e-12);
        for (a, b) in real.position.iter().zip(&sim.position) {
            a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a} {b}"));
        }
        let apart: Vec<f64> = even(100, 0.001).iter().map(|t| t + 5.0).collect();
        let error = common(&run(&even(1000, 0.001)), &run(&apart)).expect_err("no overlap").to_string();
        assert!(error.contains("5.000 to 5.099 s") && error.contains("0.000 to 0.999 s"), "{error}");
    }

    #[test]
    fn times_that_cannot_be_a_clock_are_refused_with_the_row() {
        let refusal = |time: &[f64]| Run::new(&recording(time, Vec::new()), &robot()).expect_err("refused").to_string();
        assert!(refusal(&[0.0, 0.001, 0.001, 0.002]).contains("row 3 after the header: time 0.001 s does not rise"));
        assert!(refusal(&[0.0, 0.001, f64::NAN]).contains("row 3"));
        assert!(refusal(&[0.0]).contains("has 1 rows"));
        assert!(refusal(&[]).contains("has 0 rows"));
        let mut jump = even(1000, 0.001);
        jump[999] = 1e12;
        assert!(refusal(&jump).contains("time jumps from 0.998 s to 1000000000000 s"));
    }
}
