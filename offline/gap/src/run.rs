//! One run: the columns that the engine uses, on a uniform clock, in SI and at the joints.

use nalgebra::DMatrix;
use recordings::Recording;

use crate::robot::Robot;

/// Why a recording cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// A table without a time.
    #[error("{run}: has no column t_s; give a run with time, not a table")]
    NoTime {
        /// File of the run.
        run: String,
    },
    /// Neither motor nor joint positions of some joint.
    #[error("{run}: has neither mpos_{joint}_rad nor jpos_{joint}_{unit}; the robot {robot} has {joints} joints, give its recording or another --robot")]
    NoPosition {
        /// File of the run.
        run: String,
        /// Number of the joint, from 1.
        joint: usize,
        /// Its unit.
        unit: &'static str,
        /// The robot.
        robot: String,
        /// Its joints.
        joints: usize,
    },
    /// Nothing overlaps.
    #[error("{run}: its time and that of its simulation do not overlap; give the runs in the same order")]
    NoOverlap {
        /// File of the run.
        run: String,
    },
}

/// Signals of one run of one source (recording or simulation), each N series of equal length.
#[derive(Debug, Clone)]
pub struct Run {
    /// Name for the report.
    pub id: String,
    /// First time, s.
    pub start_s: f64,
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
}

impl Run {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.position[0].len()
    }

    /// Has it no samples?
    pub fn is_empty(&self) -> bool {
        self.position.is_empty() || self.position[0].is_empty()
    }

    /// Time of a sample, s.
    pub fn time_s(&self, i: usize) -> f64 {
        self.start_s + i as f64 * self.dt_s
    }

    /// Takes the columns of a recording.
    ///
    /// # Errors
    /// [`RunError`] where time or positions are missing.
    pub fn new(recording: &Recording, robot: &Robot) -> Result<Self, RunError> {
        let run = recording.name.clone();
        let n = robot.joint_count();
        let clock = match recording.time_s() {
            Some(time) if !by_points(time) => Clock::new(time),
            // Points at which the robot stopped and was measured: their order is known, and that is all that is needed.
            _ if is_table(recording, robot) => Clock::of_points(recording.rows()),
            Some(time) => Clock::new(time),
            None => return Err(RunError::NoTime { run }),
        };
        let time: Vec<f64> = recording.time_s().map_or_else(Vec::new, <[f64]>::to_vec);
        let mapped = |name: &str| {
            let (_, source, scale) = robot.columns.iter().find(|(own, ..)| own == name)?;
            recording.column(source).map(|column| column.iter().map(|x| x * scale).collect::<Vec<f64>>())
        };
        let series = |name: &str| {
            let column = mapped(name).or_else(|| recording.column(name).map(<[f64]>::to_vec))?;
            Some(clock.resample(&time, &column))
        };
        let unit = |j: usize| if robot.prismatic[j] { "m" } else { "rad" };
        // The first of the names that every joint has.
        let all = |names: &[&dyn Fn(usize) -> String]| {
            names.iter().find_map(|name| (0..n).map(|j| series(&name(j))).collect::<Option<Vec<_>>>())
        };
        let motor = all(&[&|j| format!("mpos_{}_rad", j + 1)]);
        let reported = all(&[&|j| format!("jpos_{}_{}", j + 1, unit(j)), &|j| format!("q_{}_{}", j + 1, unit(j)), &|j| format!("q_{}", j + 1), &|j| format!("q_des_{}", j + 1), &|j| format!("q_des_{}_{}", j + 1, unit(j))]);
        let from_motors = motor.is_some();
        let position = match (&motor, reported) {
            (Some(motor), _) => {
                let inverse = robot.motor_from_joint.clone().try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
                let mut joints = combine(&inverse, motor);
                for (series, drive) in joints.iter_mut().zip(&robot.drives) {
                    series.iter_mut().for_each(|q| *q += drive.offset);
                }
                joints
            }
            (None, Some(reported)) => reported,
            (None, None) => {
                let joint = (0..n).find(|&j| series(&format!("mpos_{}_rad", j + 1)).is_none()).unwrap_or(0);
                return Err(RunError::NoPosition { run, joint: joint + 1, unit: unit(joint), robot: robot.name.clone(), joints: n });
            }
        };
        let at_joints = |tau: Vec<Vec<f64>>| combine(&robot.motor_from_joint.transpose(), &tau);
        let motor_torque = all(&[&|j| format!("tau_{}_nm", j + 1)]).filter(|_| from_motors || recording.column("jtau_1_nm").is_none()).map(at_joints);
        let joint_torque = || {
            let effort = |j: usize| if robot.prismatic[j] { "n" } else { "nm" };
            all(&[&|j| format!("jtau_{}_{}", j + 1, effort(j)), &|j| format!("tau_{}", j + 1), &|j| {
                format!("tau_{}_{}", j + 1, if robot.prismatic[j] { "N" } else { "Nm" })
            }])
        };
        let counted = || {
            let known = robot.drives.iter().all(|drive| drive.torque_per_count != 0.0);
            let counts = all(&[&|j| format!("dac_{}_counts", j + 1)]).filter(|_| known)?;
            let torque = counts.iter().zip(&robot.drives).map(|(dac, drive)| dac.iter().map(|x| x * drive.torque_per_count).collect());
            Some(at_joints(torque.collect()))
        };
        let tip = ["x", "y", "z"].map(|axis| series(&format!("truth_{axis}_m")));
        let tip = match tip {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        Ok(Self {
            id: run,
            start_s: clock.start_s,
            dt_s: clock.dt_s,
            points: clock.points,
            drive: combine(&robot.coupling(), &position),
            position,
            torque: motor_torque.or_else(joint_torque).or_else(counted),
            truth: all(&[&|j| format!("truth_jpos_{}_{}", j + 1, unit(j)), &|j| format!("q_act_{}", j + 1), &|j| format!("q_act_{}_{}", j + 1, unit(j))]),
            command: all(&[&|j| format!("jpos_d_{}_{}", j + 1, unit(j))]),
            motor,
            tip,
        })
    }

    /// The samples from `from` up to `to`.
    #[must_use]
    pub fn slice(&self, from: usize, to: usize) -> Self {
        let cut = |set: &Vec<Vec<f64>>| set.iter().map(|s| s[from..to].to_vec()).collect::<Vec<_>>();
        Self {
            id: self.id.clone(),
            start_s: self.time_s(from),
            dt_s: self.dt_s,
            points: self.points,
            position: cut(&self.position),
            drive: cut(&self.drive),
            torque: self.torque.as_ref().map(cut),
            truth: self.truth.as_ref().map(cut),
            command: self.command.as_ref().map(cut),
            motor: self.motor.as_ref().map(cut),
            tip: self.tip.as_ref().map(|tip| tip.each_ref().map(|s| s[from..to].to_vec())),
        }
    }
}

/// Largest distance of two motions that count as one, of a joint's own spread (RMS).
const APART: f64 = 0.25;

/// Is one the same motion as the other at the same time, so that their torques may be compared sample by sample?
pub fn alike(real: &Run, sim: &Run) -> bool {
    let Ok((real, sim)) = common(real, sim) else { return false };
    real.position.iter().zip(&sim.position).all(|(a, b)| {
        let mean = crate::nominal::mean(a);
        let spread = crate::nominal::rms(a.iter().map(|x| x - mean));
        crate::nominal::rms(a.iter().zip(b).map(|(a, b)| a - b)) <= APART * spread.max(1e-4)
    })
}

/// Share of the recording's own jitter from which on a simulation's torque is not that of a simulation.
const JITTER: f64 = 0.3;

/// Does the torque of one jitter like that of the other?
pub fn as_noisy(real: &Run, sim: &Run) -> bool {
    let jitter = |run: &Run, j: usize| {
        let series = run.torque.as_ref().map_or(&[][..], |torque| &torque[j]);
        let mut steps: Vec<f64> = series.windows(4).map(|x| (x[3] - 3.0 * x[2] + 3.0 * x[1] - x[0]).abs()).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    };
    let n = real.position.len();
    2 * (0..n).filter(|&j| jitter(sim, j) > JITTER * jitter(real, j)).count() > n
}

/// The common stretch of a recording and its simulation, sample for sample.
///
/// # Errors
/// [`RunError::NoOverlap`].
pub fn common(real: &Run, sim: &Run) -> Result<(Run, Run), RunError> {
    let start = real.start_s.max(sim.start_s);
    let end = real.time_s(real.len() - 1).min(sim.time_s(sim.len() - 1));
    let count = ((end - start) / real.dt_s + 1.5).floor();
    if count < 2.0 || (real.dt_s - sim.dt_s).abs() > 0.01 * real.dt_s {
        return Err(RunError::NoOverlap { run: real.id.clone() });
    }
    let first = |run: &Run| ((start - run.start_s) / run.dt_s).round() as usize;
    let count = (count as usize).min(real.len() - first(real)).min(sim.len() - first(sim));
    Ok((real.slice(first(real), first(real) + count), sim.slice(first(sim), first(sim) + count)))
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

/// A uniform clock laid over the recording's own.
struct Clock {
    start_s: f64,
    dt_s: f64,
    count: usize,
    uniform: bool,
    points: bool,
}

/// Seconds between samples beyond which an uneven clock is none.
const SLOW_S: f64 = 0.1;

/// Are these times those of points that were measured one after the other?
fn by_points(time: &[f64]) -> bool {
    let clock = Clock::new(time);
    !clock.uniform && clock.dt_s > SLOW_S
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

impl Clock {
    fn of_points(count: usize) -> Self {
        Self { start_s: 0.0, dt_s: 1.0, count, uniform: true, points: true }
    }

    fn new(time: &[f64]) -> Self {
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        // Times are rounded: where no sample is missing, the mean step says more than any one of them.
        let even = steps.first().zip(steps.last()).is_some_and(|(least, most)| *least > 0.75 * median && *most < 1.25 * median);
        let dt_s = if even { (time[time.len() - 1] - time[0]) / steps.len() as f64 } else { median };
        let (start_s, span) = (time[0], time[time.len() - 1] - time[0]);
        let count = (span / dt_s).round() as usize + 1;
        let uniform = count == time.len() && time.iter().enumerate().all(|(i, t)| (t - start_s - i as f64 * dt_s).abs() < 0.25 * dt_s);
        Self { start_s, dt_s, count, uniform, points: false }
    }

    /// Linear between samples; a sample next to an empty cell stays empty.
    fn resample(&self, time: &[f64], values: &[f64]) -> Vec<f64> {
        if self.uniform {
            return values.to_vec();
        }
        let mut k = 0;
        (0..self.count)
            .map(|i| {
                let t = self.start_s + i as f64 * self.dt_s;
                while k + 2 < time.len() && time[k + 1] < t {
                    k += 1;
                }
                let share = ((t - time[k]) / (time[k + 1] - time[k])).clamp(0.0, 1.0);
                values[k] + share * (values[k + 1] - values[k])
            })
            .collect()
    }
}
