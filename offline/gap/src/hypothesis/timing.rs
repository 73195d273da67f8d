//! A channel that comes late.

use super::dictionary::Dictionary;
use super::{Bound, Column, Family};
use crate::cell::Channel;

/// Least delay of a torque, late or early, s: it is given once a millisecond, and what is less than half of that is how two motions are looked at.
const LEAST_LATE_S: f64 = 5e-4;

/// Forms of a late torque: of what the model asks of the motors, and of what the simulation does.
pub(crate) const LATE_TORQUES: [&str; 2] = ["torque", "torque, as simulated"];

/// Rows over which a slope is drawn at least. Over less, noise in what the model asks makes steep slopes pass for small delays (6 % too small over
/// one row, and one in ten not told); over more, slopes are flatter than they are (8 % too large over two).
const ROWS: f64 = 1.5;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    let problem = dictionary.problem;
    let bound = Bound::Between(-0.15, 0.4);
    if problem.cell(Channel::EndEffector, 0).is_some() {
        all.push(Family::fixed("measurement_delay", &[], "tip", Channel::EndEffector, &[bound], |d| vec![late_tip(d, |_, _| 1.0)]));
        all.push(
            Family::fixed(
                "measurement_delay",
                &[],
                "tip, drifting",
                Channel::EndEffector,
                &[bound, Bound::Between(-0.01, 0.01)],
                |d| vec![late_tip(d, |_, _| 1.0), late_tip(d, |r, i| d.problem.pairs[r].real.run.elapsed_s(i))],
            )
            .penalised(2.0),
        );
    }
    if problem.has(Channel::Transmission) {
        // The joint encoders come late: A⁻¹m - q(t - d) grows by d dq/dt, on all joints alike.
        all.push(Family::fixed("measurement_delay", &[], "joint encoders", Channel::Transmission, &[bound], |d| {
            let velocity = |j: usize| d.at_grid(|r, i, _| d.problem.pairs[r].real.velocity[j][i]);
            let velocities: Vec<Option<Vec<f64>>> = (0..d.joints()).map(|j| Some(velocity(j))).collect();
            vec![d.deflection(&velocities)]
        }));
    }
    if problem.has(Channel::JointTorque) {
        // Late is all of it. What only the sign of dry friction says is how that turns, slowly or after a moment's sticking.
        let mut sources: Vec<(&'static str, Source)> = vec![(LATE_TORQUES[0], believed)];
        if problem.pairs.iter().all(|pair| pair.sim.as_ref().is_some_and(|sim| sim.torque.is_some())) {
            sources.push((LATE_TORQUES[1], simulated));
        }
        for (form, source) in sources {
            let family = Family::secant("measurement_delay", &[], form, Channel::JointTorque, &[bound], &["late"], move |d, s| {
                vec![late_torque(d, s[0], source, |load, dry| load + dry)]
            });
            let parts =
                move |d: &Dictionary| vec![late_torque(d, 0.0, source, |load, _| load), late_torque(d, 0.0, source, |_, dry| dry)];
            all.push(family.borne_out(LEAST_LATE_S, parts));
        }
    }
}

/// `y(t) = x(t - d)`: `-d dx/dt` of the tip, weighted.
fn late_tip(dictionary: &Dictionary, weight: impl Fn(usize, usize) -> f64) -> Column {
    let n = dictionary.joints();
    dictionary.tip(|r, i, row| {
        let velocity = &dictionary.problem.pairs[r].real.velocity;
        let along = |axis: usize| (0..n).map(|j| dictionary.tip_jacobian[row][axis * n + j] * velocity[j][i]).sum::<f64>();
        [0, 1, 2].map(|axis| -weight(r, i) * along(axis))
    })
}

/// What is asked of a motor in a run without its dry friction, and the samples where that is known.
type Source = fn(&Dictionary, usize, usize) -> (Vec<f64>, Vec<f64>);

/// By the model, at its rows.
fn believed(dictionary: &Dictionary, run: usize, joint: usize) -> (Vec<f64>, Vec<f64>) {
    let problem = dictionary.problem;
    let rows = problem.pairs[run].real.rows.iter().map(|i| *i as f64).collect();
    (rows, problem.loads[run].iter().map(|load| load.motor[joint]).collect())
}

/// By the simulation, in which the cables are as elastic as they are; at every sample.
fn simulated(dictionary: &Dictionary, run: usize, joint: usize) -> (Vec<f64>, Vec<f64>) {
    let pair = &dictionary.problem.pairs[run];
    let sim = pair.sim.as_ref().unwrap_or(&pair.real);
    let coulomb = dictionary.problem.nominal.drives[joint][2];
    let torque = &sim.torque.as_ref().expect("there are residuals of torque")[joint];
    let loads: Vec<f64> =
        torque.iter().zip(dictionary.problem.nominal.dry_sign(sim, joint)).map(|(torque, sign)| torque - coulomb * sign).collect();
    ((0..loads.len()).map(|i| i as f64).collect(), loads)
}

/// `(τ(t - d) - τ(t)) / d` of what is asked of the motors, made up of their load and their dry friction: the slope over the time between, and over
/// [`ROWS`] of what is known at least.
fn late_torque(dictionary: &Dictionary, late_s: f64, source: Source, of: impl Fn(f64, f64) -> f64) -> Column {
    let problem = dictionary.problem;
    let mut column = Column::default();
    for j in 0..dictionary.joints() {
        let coulomb = problem.nominal.drives[j][2];
        let mut slope = Vec::with_capacity(dictionary.grid.len());
        for (r, pair) in problem.pairs.iter().enumerate() {
            let motion = &pair.real;
            let sign = problem.nominal.dry_sign(motion, j);
            let every: Vec<f64> = (0..sign.len()).map(|i| i as f64).collect();
            let (places, loads) = source(dictionary, r, j);
            let torque = |at: f64| of(between(&places, &loads, at), coulomb * between(&every, &sign, at));
            let late = late_s / motion.run.dt_s;
            let apart = places.get(1).map_or(1.0, |second| second - places[0]);
            let over = late.abs().max(ROWS * apart);
            let of_row = |row: &usize| {
                let middle = *row as f64 - 0.5 * late;
                (torque(middle - 0.5 * over) - torque(middle + 0.5 * over)) / (over * motion.run.dt_s)
            };
            slope.extend(motion.rows.iter().map(of_row));
        }
        column.push(problem.cell(Channel::JointTorque, j), &slope);
    }
    column
}

/// A series at a place between those where it is known (rising): the cubic through the two on either side; at its ends what it is there.
fn between(places: &[f64], series: &[f64], at: f64) -> f64 {
    let after = places.partition_point(|place| *place < at);
    let last = series.len() - 1;
    if after == 0 || after > last {
        return series[after.min(last)];
    }
    let from = after.saturating_sub(2).min(series.len().saturating_sub(4));
    let near = from..(from + 4).min(series.len());
    near.clone()
        .map(|k| {
            let others = near.clone().filter(|other| *other != k);
            series[k] * others.map(|other| (at - places[other]) / (places[k] - places[other])).product::<f64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn a_cubic_is_itself_between_the_places_and_stays_what_it_is_at_its_ends() {
        let cubic = |x: f64| 2.0 - x + 0.5 * x * x - 0.1 * x * x * x;
        let places = [0.0, 1.0, 2.0, 5.0, 6.0, 7.0];
        let series = places.map(cubic);
        for at in [0.3, 1.0, 1.9, 3.7, 5.5, 6.9] {
            assert!((between(&places, &series, at) - cubic(at)).abs() < 1e-12, "{at}");
        }
        assert_eq!([between(&places, &series, -1.0), between(&places, &series, 9.0)], [cubic(0.0), cubic(7.0)]);
    }
}
