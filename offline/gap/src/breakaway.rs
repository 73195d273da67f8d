//! Static friction, where a run shows it plainly: a joint stands while its effort is raised, and breaks away.

use gap_report::{DataQuality, Level};

use crate::filter::Window;
use crate::robot::Robot;
use crate::run::Run;

/// Shares of a joint's travel within which it stands, and beyond which it has broken away.
const STANDS: f64 = 0.002;
const GONE: f64 = 0.006;
/// Time for which a joint has to stand before, s.
const REST_S: f64 = 1.0;
/// Least number of break-aways that say something.
const LEAST: usize = 5;
/// Largest spread of their levels, share of the mean.
const SPREAD: f64 = 0.5;

/// One entry per joint that broke away often enough.
pub(crate) fn levels(robot: &Robot, run: &Run) -> Vec<DataQuality> {
    let Some(torque) = &run.torque else { return Vec::new() };
    (0..robot.joint_count())
        .filter_map(|j| {
            let smooth = Window::new((2.0 * run.dt_s).max(0.02), run.dt_s).apply(&torque[j], 0);
            let all = events(&run.position[j], &smooth, run.dt_s);
            let n = all.len() as f64;
            let mean = crate::series::mean(&all);
            let spread = (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
            if all.len() < LEAST || spread > SPREAD * mean {
                return None;
            }
            let half = (1.96 + 2.4 / (n - 1.0)) * spread / n.sqrt();
            let unit = robot.effort_unit(j);
            let message = format!(
                "{} breaks away at {mean:.3} {unit} on average ({:.3} to {:.3}, {} times): its static friction, gravity and zero of the effort included",
                robot.joints[j],
                mean - half,
                mean + half,
                all.len()
            );
            Some(DataQuality::new("break_away", Level::Ok, message).run(run.id.clone()).value(mean, unit))
        })
        .collect()
}

/// Size of the effort at each break-away.
fn events(position: &[f64], effort: &[f64], dt_s: f64) -> Vec<f64> {
    let (low, high) = crate::series::range(position.iter().copied());
    let travel = high - low;
    let rest = ((REST_S / dt_s) as usize).max(2);
    let mut all = Vec::new();
    let mut i = rest;
    while i < position.len() {
        let before = &position[i - rest..=i];
        let (low, high) = crate::series::range(before.iter().copied());
        if travel <= 0.0 || high - low > STANDS * travel {
            i += 1;
            continue;
        }
        let from = i;
        let start = position[from];
        let Some(gone) = (from..position.len()).find(|&k| (position[k] - start).abs() > GONE * travel) else { break };
        let moved = position[gone] - start;
        // The effort drives the motion, and was raised for it.
        if effort[gone] * moved > 0.0 && effort[gone].abs() > 1.2 * effort[from].abs() {
            all.push(effort[gone].abs());
        }
        i = gone + rest;
    }
    all
}
