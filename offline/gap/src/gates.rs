//! Checks before anything else, because what they find mimics physics.

use gap_report::{DataQuality, Level};

use recordings::Recording;

use crate::motion::Motion;
use crate::nominal::Nominal;
use crate::readings::{NoReadings, Why};
use crate::robot::Robot;
use crate::run::{Both, Run, apart};
use crate::saturation::Saturated;
use crate::series::{resolution, rms};

/// Speed that counts as motion, of the largest speed.
const MOVING: f64 = 0.05;

/// Checks the runs; failures first.
pub(crate) fn check(robot: &Robot, runs: &[Both]) -> Vec<DataQuality> {
    let mut all = input_sign(robot, runs);
    for (real, sim) in runs {
        all.extend(standing(robot, real));
        all.extend(repeated(real));
        all.extend(gaps(real));
        all.extend(no_readings(real, false));
        all.extend(saturated(robot, real));
        all.extend(crate::breakaway::levels(robot, real));
        if let Some(sim) = sim {
            all.extend(another_robot(robot, real, sim));
            all.extend(itself(real, sim));
            all.extend(no_readings(sim, true));
        }
    }
    all.sort_by_key(|q| match q.level {
        Level::Fail => 0,
        Level::Warn => 1,
        Level::Ok => 2,
    });
    all
}

/// Velocity of each joint, from positions, smoothed over some samples.
fn velocity(run: &Run, joint: usize) -> Vec<f64> {
    crate::filter::Window::new((4.0 * run.dt_s).max(0.01), run.dt_s).apply(&run.position[joint], 1)
}

/// Mean power over what the sizes of torque and speed allow, in -1 to 1. A drive with friction gives more than it takes.
fn power(torque: &[f64], velocity: &[f64]) -> f64 {
    let work: f64 = torque.iter().zip(velocity).map(|(t, v)| t * v).sum();
    work / (rms(torque.iter().copied()) * rms(velocity.iter().copied()) * torque.len() as f64).max(1e-300)
}

/// Sign of torque against velocity: friction takes energy, so over a run every drive gives more than it gets back. A source
/// whose joints all take energy has its input the other way round.
fn input_sign(robot: &Robot, runs: &[Both]) -> Vec<DataQuality> {
    let mut all = Vec::new();
    let n = robot.joint_count();
    let mean_power = |of: &dyn Fn(&Both, usize) -> Option<f64>| -> Option<Vec<f64>> {
        (0..n)
            .map(|j| {
                let each: Option<Vec<f64>> = runs.iter().map(|run| of(run, j)).collect();
                each.map(|e| crate::series::mean(&e))
            })
            .collect()
    };
    let Some(real) = mean_power(&|run, j| run.0.torque.as_ref().map(|t| power(&t[j], &velocity(&run.0, j)))) else { return all };
    // The simulation was driven by the same commands: its own torque where it has one, else the recording's.
    let sim = mean_power(&|run, j| {
        let sim = run.1.as_ref()?;
        let torque = sim.torque.as_ref().or(run.0.torque.as_ref())?;
        Some(power(&torque[j], &velocity(sim, j)))
    });
    let reversed = |power: &[f64]| power.iter().all(|p| *p < -0.1);
    let said = |power: &[f64]| power.iter().map(|p| format!("{p:+.2}")).collect::<Vec<_>>().join(", ");
    if let Some(sim) = &sim
        && reversed(sim)
        && !reversed(&real)
    {
        let message = format!(
            "the simulation was driven with its input reversed: its joints take power from the torque (correlation of torque and velocity {}; recording {})",
            said(sim),
            said(&real)
        );
        all.push(DataQuality::new("input_sign", Level::Fail, message));
    } else if reversed(&real) {
        let message = format!(
            "the recording's torque has the other sign than its motion: its joints give power back all the time (correlation of torque and velocity {})",
            said(&real)
        );
        all.push(DataQuality::new("input_sign", Level::Fail, message));
    } else {
        all.push(DataQuality::new(
            "input_sign",
            Level::Ok,
            format!("torque drives the motion (correlation of torque and velocity {})", said(&real)),
        ));
    }
    all
}

/// A simulation that is the recording.
fn itself(real: &Run, sim: &Run) -> Option<DataQuality> {
    (real.position == sim.position && real.torque == sim.torque && real.truth == sim.truth).then(|| {
        let message =
            format!("the simulation {} is this recording, sample for sample: give what a simulator made of its commands", sim.id);
        DataQuality::new("same_motion", Level::Warn, message).run(real.id.clone())
    })
}

/// Joints that do not move.
fn standing(robot: &Robot, run: &Run) -> Vec<DataQuality> {
    (0..robot.joint_count())
        .filter_map(|j| {
            let (low, high) = crate::series::range(run.position[j].iter().copied());
            (high - low < 1e-4).then(|| {
                let message = format!(
                    "{} does not move: nothing can be said of its friction or transmission; move every joint",
                    robot.joints[j]
                );
                DataQuality::new("excitation", Level::Warn, message).run(run.id.clone())
            })
        })
        .collect()
}

/// Rows that repeat the one before while the robot moves by more than it resolves.
fn repeated(run: &Run) -> Option<DataQuality> {
    let speeds: Vec<Vec<f64>> = (0..run.position.len()).map(|j| velocity(run, j)).collect();
    let seen_from = |(position, speed): (&Vec<f64>, &Vec<f64>)| {
        let top = speed.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        (MOVING * top).max(resolution(position) / run.dt_s)
    };
    let seen_from: Vec<f64> = run.position.iter().zip(&speeds).map(seen_from).collect();
    let moving = |i: usize| speeds.iter().zip(&seen_from).any(|(s, least)| s[i].abs() > *least);
    let same = |i: usize| run.position.iter().all(|s| s[i] == s[i - 1]);
    let count = (1..run.len()).filter(|&i| moving(i)).count().max(1);
    let repeats = (1..run.len()).filter(|&i| moving(i) && same(i)).count();
    let share = 100.0 * repeats as f64 / count as f64;
    (share > 2.0).then(|| {
        let message = format!("{share:.1} % of the samples in motion repeat the one before: polled faster than updated");
        DataQuality::new("duplicates", Level::Warn, message).run(run.id.clone()).value(share, "%")
    })
}

/// Samples that were not recorded.
fn gaps(run: &Run) -> Vec<DataQuality> {
    let share = 100.0 * run.mask.iter().filter(|masked| **masked).count() as f64 / run.len().max(1) as f64;
    let masked = (share > 0.0).then(|| {
        let why = if run.saturated.is_empty() { "" } else { ", or have a torque at its limit," };
        let message = format!("{share:.1} % of the samples were not recorded (empty cells, lost rows){why} and are left out");
        let level = if share > 1.0 { Level::Warn } else { Level::Ok };
        DataQuality::new("gaps", level, message).run(run.id.clone()).value(share, "%")
    });
    let left_out = run.left_out.iter().map(|name| {
        let message = format!("more than half of the cells of {name} are empty: this channel is not looked at");
        DataQuality::new("gaps", Level::Warn, message).run(run.id.clone())
    });
    let lacks = run.lacks.iter().map(|name| {
        let message =
            format!("{name} is missing, though other joints have it: this channel is not looked at; record it of every joint");
        DataQuality::new("channel", Level::Warn, message).run(run.id.clone())
    });
    masked.into_iter().chain(left_out).chain(lacks).collect()
}

/// What was taken as no reading. Of a simulation only that it is slower than its rows: without noise, numbers repeat where they are rounded.
fn no_readings(run: &Run, simulated: bool) -> Vec<DataQuality> {
    let all: Vec<&NoReadings> = run.no_readings.iter().filter(|one| !simulated || matches!(one.why, Why::Slow(_))).collect();
    let mut kinds: Vec<Why> = Vec::new();
    for one in &all {
        if !kinds.contains(&one.why) {
            kinds.push(one.why);
        }
    }
    let of = |why: Why| {
        let alike: Vec<&NoReadings> = all.iter().copied().filter(|one| one.why == why).collect();
        let count: usize = alike.iter().map(|one| one.count).sum();
        let names: Vec<&str> = alike.iter().map(|one| one.of.as_str()).collect();
        let of = format!("{}{}", if simulated { "the simulation's " } else { "" }, listed(&names));
        // A verb, of one and of more.
        let one_or = |one: &'static str, more: &'static str| if count == 1 { one } else { more };
        let readings = format!("{count} {} of {of}", one_or("reading", "readings"));
        let (check, message) = match why {
            Why::AtZero => (
                "gaps",
                format!(
                    "{count} {} of {of} {} 0, 0, 0 to the last digit, as some trackers write a frame that they lost: taken as none; leave such cells empty",
                    one_or("position", "positions"),
                    one_or("is", "are")
                ),
            ),
            Why::Away => (
                "spikes",
                format!(
                    "{readings} {} at once, which nothing that moves does: taken as none; look for errors of its bus or tracker",
                    one_or("leaves the motion and is back", "leave the motion and are back")
                ),
            ),
            Why::Stalled => (
                "duplicates",
                format!(
                    "{readings} {} the one before in the middle of a motion: taken as none; look for lost packets",
                    one_or("repeats", "repeat")
                ),
            ),
            Why::Slow(rows) => (
                "duplicates",
                format!(
                    "a new reading of {of} comes every {rows} rows and is repeated until then, as if it were late: {count} {} taken as none; leave such cells empty",
                    one_or("repeat is", "repeats are")
                ),
            ),
        };
        DataQuality::new(check, Level::Warn, message).run(run.id.clone()).value(count as f64, "1")
    };
    kinds.into_iter().map(of).collect()
}

/// Columns that are named; of more the number is told.
const NAMED: usize = 3;

/// Names of columns: all of them, or the first ones.
fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] if names.len() <= NAMED => format!("{} and {last}", first.join(", ")),
        _ => format!("{} and {} more columns", names[..NAMED].join(", "), names.len() - NAMED),
    }
}

/// Torques that stand at a limit.
fn saturated(robot: &Robot, run: &Run) -> Vec<DataQuality> {
    let of = |one: &Saturated| {
        let limits = one.limits.iter().map(|limit| format!("{limit:.4}")).collect::<Vec<_>>().join(" and ");
        let share = 100.0 * one.share;
        let done = if one.left_out {
            "these samples are left out; move slower, or with less load"
        } else {
            "a limit, or a torque commanded in steps: nothing is left out; if it is a limit, move slower or with less load"
        };
        let message =
            format!("the torque of {} stands at {limits} in {share:.1} % of the samples: {done}", robot.joints[one.joint]);
        DataQuality::new("saturation", Level::Warn, message).run(run.id.clone()).value(share, "%")
    };
    run.saturated.iter().map(of).collect()
}

/// Joints of a recording that the robot does not have.
pub(crate) fn beyond(robot: &Robot, recording: &Recording, run: &str) -> Option<DataQuality> {
    let n = robot.joint_count();
    let has = |j: usize| {
        ["mpos_J_rad", "jpos_J_rad", "jpos_J_m", "q_J_rad", "q_J_m"]
            .iter()
            .any(|name| recording.column(&name.replace('J', &j.to_string())).is_some())
    };
    let last = (n + 1..=99).take_while(|j| has(*j)).last()?;
    let message = format!(
        "the recording has {last} joints, the robot {} has {n}: those beyond are not looked at; their weight and their couplings are missing",
        robot.name
    );
    Some(DataQuality::new("joints", Level::Warn, message).run(run).value(last as f64, "1"))
}

/// A simulation that does not move as the recording does.
fn another_robot(robot: &Robot, real: &Run, sim: &Run) -> Vec<DataQuality> {
    (0..robot.joint_count())
        .filter_map(|j| {
            let (apart, usual) = apart(robot, real, sim, j);
            (apart > 2.0 * usual).then(|| {
                let message = format!(
                    "the simulated {} is {:.1} times its own travel away from the recorded one: another robot, other commands, or a free run",
                    robot.joints[j],
                    apart / usual
                );
                DataQuality::new("closed_loop", Level::Warn, message).run(real.id.clone()).value(apart / usual, "1")
            })
        })
        .collect()
}

/// How well the tool's own model follows the simulator.
pub(crate) fn nominal(robot: &Robot, nominal: &Nominal, sims: &[&Motion]) -> Vec<DataQuality> {
    if sims.is_empty() {
        return Vec::new();
    }
    (0..robot.joint_count())
        .filter_map(|j| {
            let share = nominal.not_understood(j);
            (share > 0.5).then(|| {
                let message = format!("{:.0} % of the simulated torque of {} is not understood", 100.0 * share, robot.joints[j]);
                DataQuality::new("nominal_model", Level::Warn, message).value(100.0 * share, "%")
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_that_a_slow_motion_has_not_moved_by_are_not_polled_too_fast() {
        fn swings(t: f64) -> f64 {
            0.1 * (0.5 * t).sin()
        }
        let run = |of: fn(f64) -> f64| Run::of_one_joint(&(0..4000).map(|i| of(f64::from(i) * 1e-3)).collect::<Vec<_>>());
        // 50 mrad/s, in counts of 1 mrad: each lasts for 20 rows and more.
        assert_eq!(repeated(&run(|t| (swings(t) * 1e3).round() * 1e-3)), None);
        // A new value every fourth row.
        let told = repeated(&run(|t| swings((t * 250.0).floor() / 250.0))).expect("told");
        assert_eq!(told.check, "duplicates");
        assert!(told.value.is_some_and(|share| (share - 75.0).abs() < 1.0), "{told:?}");
    }

    #[test]
    fn columns_without_readings_for_one_reason_are_told_at_once() {
        let of = |of: &str, why: Why, count: usize| NoReadings { of: of.to_owned(), why, count };
        let run = Run {
            no_readings: vec![
                of("mpos_1", Why::Away, 2),
                of("mpos_2", Why::Away, 3),
                of("tau_1_nm", Why::Stalled, 1),
                of("mpos_3", Why::Away, 1),
                of("jpos_1", Why::Away, 4),
                of("jpos_2", Why::Away, 5),
                of("jpos_1", Why::Slow(4), 30),
                of("jpos_2", Why::Slow(4), 31),
            ],
            ..Run::of_one_joint(&[0.0, 1.0])
        };
        let told = no_readings(&run, false);
        let begins = |place: usize, with: &str| assert!(told[place].message.starts_with(with), "{}", told[place].message);
        assert_eq!(told.iter().map(|one| one.value).collect::<Vec<_>>(), [Some(15.0), Some(1.0), Some(61.0)]);
        begins(0, "15 readings of mpos_1, mpos_2, mpos_3 and 2 more columns leave the motion and are back at once");
        begins(1, "1 reading of tau_1_nm repeats the one before");
        begins(2, "a new reading of jpos_1 and jpos_2 comes every 4 rows");
        // Numbers of a simulation repeat where they are rounded.
        let told = no_readings(&run, true);
        assert_eq!(told.len(), 1);
        assert!(told[0].message.starts_with("a new reading of the simulation's jpos_1 and jpos_2 comes"));
    }
}
