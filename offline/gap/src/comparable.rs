//! Is it the same robot, moved by the same commands, in the same units on both sides? What is not ends the analysis: every number after it
//! would be wrong.

use gap_report::{DataQuality, Level};

use crate::robot::Robot;
use crate::run::{Both, Run, alike, apart, common};
use crate::series::{mean, range, rms};

/// Times a joint's own range that nothing moves: degrees for radians are 57 times, millimetres for metres 1000.
const BEYOND_RANGE: f64 = 8.0;
/// Times that one side may be the other where both go alike: no physics of the vocabulary makes more than a few of it.
const POSITION_SCALE: f64 = 8.0;
const TORQUE_SCALE: f64 = 25.0;
/// Correlation from which on two series go alike, or against one another: positions that follow the same commands, and torques.
const POSITION_ALIKE: f64 = 0.98;
const TORQUE_ALIKE: f64 = 0.8;

/// Distance of two motions from which on they are not of the same commands, of the recording's own spread (RMS): two motions that know
/// nothing of each other are further apart than that.
const ELSEWHERE: f64 = 0.9;
/// Correlation of two torques that are one: a simulation that the recorded torque drives may end up anywhere.
const SAME_TORQUE: f64 = 0.95;

/// A simulation that moves most of its joints otherwise than the recording does, and not because the recorded torque made it so: of other
/// commands, of another run, or of another robot.
pub(crate) fn elsewhere(robot: &Robot, real: &Run, sim: &Run) -> Option<DataQuality> {
    let (real, sim) = common(real, sim).ok()?;
    if let Some((joint, like)) = exchanged(robot, &real, &sim) {
        let message = format!(
            "{} moves as {} does in the simulation {}, and not as its own: columns in another order (messages of ROS have joints sorted by name); \
             give both sides the joints in the order of the robot's file",
            robot.joints[joint], robot.joints[like], sim.id
        );
        return Some(DataQuality::new("same_motion", Level::Fail, message).run(real.id.clone()));
    }
    let n = robot.joint_count();
    let times = |j: usize| {
        let (distance, spread) = apart(robot, &real, &sim, j);
        distance / spread
    };
    let far: Vec<(usize, f64)> = (0..n).map(|j| (j, times(j))).filter(|(_, times)| *times > ELSEWHERE).collect();
    let driven =
        real.torque.as_ref().zip(sim.torque.as_ref()).is_some_and(|(real, sim)| {
            (0..n).all(|j| correlation_and_scale(&real[j], &sim[j]).is_some_and(|(c, _)| c > SAME_TORQUE))
        });
    if driven || 2 * far.len() <= n {
        return None;
    }
    let (joint, times) = far.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let message = format!(
        "{} of the {n} joints do not move in the simulation {} as recorded, {} least of all ({times:.1} times its own travel away): other \
         commands, another run or another robot; simulate the commands of this recording, and give the runs in the same order",
        far.len(),
        sim.id,
        robot.joints[joint]
    );
    Some(DataQuality::new("same_motion", Level::Fail, message).run(real.id.clone()).value(times, "1"))
}

/// A joint that goes as another one does in the simulation, where neither goes as its own.
fn exchanged(robot: &Robot, real: &Run, sim: &Run) -> Option<(usize, usize)> {
    let n = robot.joint_count();
    let moving = |j: &usize| robot.moves(*j, &real.position[*j]) && robot.moves(*j, &sim.position[*j]);
    let alike = |j: usize, k: usize| {
        correlation_and_scale(&real.position[j], &sim.position[k]).is_some_and(|(correlation, _)| correlation > POSITION_ALIKE)
    };
    let odd: Vec<usize> = (0..n).filter(|j| moving(j) && !alike(*j, *j)).collect();
    let pairs = odd.iter().flat_map(|j| odd.iter().map(move |k| (*j, *k)));
    pairs.filter(|(j, k)| j != k).find(|(j, k)| alike(*j, *k))
}

/// What makes a comparison useless: all of it failures.
pub(crate) fn check(robot: &Robot, runs: &[Both]) -> Vec<DataQuality> {
    let mut all = Vec::new();
    for j in 0..robot.joint_count() {
        all.extend(too_far(robot, runs, j));
        all.extend(measured(robot, runs, j));
        let both: Vec<(&Run, &Run)> = runs.iter().filter_map(|(real, sim)| Some((real, sim.as_ref()?))).collect();
        if both.is_empty() {
            continue;
        }
        let named = |what: &str| format!("{what} of {}", robot.joints[j]);
        let position =
            Compared { what: named("position"), than: "that of the simulation", most: POSITION_SCALE, alike: POSITION_ALIKE };
        let of: Vec<_> = both.iter().map(|(real, sim)| (&real.position[j][..], &sim.position[j][..])).collect();
        // Where a joint stands, the rest of it goes like anything.
        if of.iter().all(|(real, _)| robot.moves(j, real)) {
            all.extend(position.fails(&of, &both[0].0.id));
        }
        let of: Option<Vec<_>> =
            both.iter().map(|(real, sim)| Some((&real.torque.as_ref()?[j][..], &sim.torque.as_ref()?[j][..]))).collect();
        // Of other motions the torques are others.
        if let Some(of) = of.filter(|_| both.iter().all(|(real, sim)| alike(robot, real, sim))) {
            let torque = Compared { what: named("torque"), most: TORQUE_SCALE, alike: TORQUE_ALIKE, ..position };
            all.extend(torque.fails(&of, &both[0].0.id));
        }
    }
    all.extend((0..3).filter_map(|axis| tip(runs, axis)));
    all
}

/// What measures a joint goes with what is reported of it.
fn measured(robot: &Robot, runs: &[Both], j: usize) -> Option<DataQuality> {
    let sources = || runs.iter().flat_map(|(real, sim)| std::iter::once(real).chain(sim));
    let of: Option<Vec<_>> = runs.iter().map(|(real, _)| Some((&real.truth.as_ref()?[j][..], &real.position[j][..]))).collect();
    let what = format!("measured position of {}", robot.joints[j]);
    let compared = Compared { what, than: "that which is reported", most: POSITION_SCALE, alike: POSITION_ALIKE };
    let points = sources().any(|run| run.points);
    let moves = runs.iter().all(|(real, _)| robot.moves(j, &real.position[j]));
    of.filter(|_| !points && moves).and_then(|of| compared.fails(&of, &runs[0].0.id))
}

/// A tip as it is measured on both sides.
fn tip(runs: &[Both], axis: usize) -> Option<DataQuality> {
    let of = |(real, sim): &Both| -> Option<(Vec<f64>, Vec<f64>)> {
        let (real, sim) = (real.tip.as_ref()?, sim.as_ref()?.tip.as_ref()?);
        let both = real[axis].iter().zip(&sim[axis]).filter(|(a, b)| a.is_finite() && b.is_finite());
        Some(both.map(|(a, b)| (*a, *b)).unzip())
    };
    let all: Vec<(Vec<f64>, Vec<f64>)> = runs.iter().map(of).collect::<Option<_>>()?;
    let of: Vec<(&[f64], &[f64])> = all.iter().map(|(real, sim)| (&real[..], &sim[..])).collect();
    let what = format!("tip position along {}", ["x", "y", "z"][axis]);
    Compared { what, than: "that of the simulation", most: POSITION_SCALE, alike: POSITION_ALIKE }.fails(&of, &runs[0].0.id)
}

/// A joint that moves further than it can.
fn too_far(robot: &Robot, runs: &[Both], j: usize) -> Option<DataQuality> {
    let allowed = robot.range(j);
    let unit = robot.position_unit(j);
    let of_sim = |sim| (sim, ", or a simulation that ran away");
    runs.iter().flat_map(|(real, sim)| std::iter::once((real, "")).chain(sim.as_ref().map(of_sim))).find_map(|(run, otherwise)| {
        let (low, high) = range(run.position[j].iter().copied());
        (allowed > 0.0 && high - low > BEYOND_RANGE * allowed).then(|| {
            let message = format!(
                "{} moves through {:.3} {unit} in {}, {:.0} times what it can: positions in another unit, counts, or of another robot{otherwise}; \
                 convert them, or give this robot with --robot",
                robot.joints[j],
                high - low,
                run.id,
                (high - low) / allowed
            );
            DataQuality::new("input_scale", Level::Fail, message).run(run.id.clone()).value((high - low) / allowed, "1")
        })
    })
}

/// One quantity, and another that it should be.
struct Compared {
    what: String,
    than: &'static str,
    /// Times that one side may be the other.
    most: f64,
    /// Least correlation.
    alike: f64,
}

impl Compared {
    /// A scale or a sign that differs in every run.
    fn fails(&self, runs: &[(&[f64], &[f64])], first: &str) -> Option<DataQuality> {
        let all: Vec<(f64, f64)> = runs.iter().filter_map(|(real, sim)| correlation_and_scale(real, sim)).collect();
        if all.len() < runs.len() || all.is_empty() {
            return None;
        }
        let scale = mean(&all.iter().map(|(_, scale)| *scale).collect::<Vec<_>>());
        if all.iter().all(|(c, s)| *c > self.alike && (*s > self.most || *s < 1.0 / self.most)) {
            let message = format!(
                "{} is {scale:.3} times {} and goes like it: one of them is in another unit; convert it",
                self.what, self.than
            );
            return Some(DataQuality::new("input_scale", Level::Fail, message).run(first).value(scale, "1"));
        }
        if all.iter().all(|(c, s)| *c < -self.alike && *s < self.most && *s > 1.0 / self.most) {
            let message = format!(
                "{} has the other sign than {} (correlation {:+.2}): turn it round on the side where it is wrong",
                self.what, self.than, all[0].0
            );
            return Some(DataQuality::new("sign_convention", Level::Fail, message).run(first).value(all[0].0, "1"));
        }
        None
    }
}

/// Size of a series over its largest value, up to which it is one number but for rounding.
const ROUNDING: f64 = 1e-9;

/// Correlation of two series, and the size of the first over that of the second; none of one that stands.
fn correlation_and_scale(real: &[f64], sim: &[f64]) -> Option<(f64, f64)> {
    let centred = |s: &[f64]| {
        let middle = mean(s);
        s.iter().map(|x| x - middle).collect::<Vec<f64>>()
    };
    let (a, b) = (centred(real), centred(sim));
    let (size_a, size_b) = (rms(a.iter().copied()), rms(b.iter().copied()));
    let product = a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>() / a.len().max(1) as f64;
    let varies = |size: f64, series: &[f64]| size > ROUNDING * series.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    (varies(size_a, real) && varies(size_b, sim)).then(|| (product / (size_a * size_b), size_a / size_b))
}
