//! Shapes of what the vocabulary has no name for. They stand beside the physics as rivals, so that the nearest name is not
//! taken for what it is not: where one of them wins, the answer is `unmodelled`, with what it depends on.

use super::dictionary::{Dictionary, times};
use super::{Bound, Family, geometric, product};
use crate::cell::Channel;

/// Their name in the vocabulary.
pub const UNMODELLED: &str = "unmodelled";
/// Forms of a cable that hardens, or has slack: a soft cable and more.
pub(crate) const HARDENING: [&str; 2] = ["load, bent", "load beyond a level"];
/// The form of steps in time, which say themselves when they come.
pub(crate) const STEPS_IN_TIME: &str = "steps in time";
/// Share of the largest load beyond which a cable is softer, to begin with.
const SLACK: [f64; 4] = [0.1, 0.3, 0.5, 0.7];
/// Periods of a wave, shares of the travel: from, to, how many.
const WAVES: (f64, f64, usize) = (0.08, 2.0, 24);
/// How much harder a hardening cable is at its largest load, to begin with.
const HARDER: [f64; 3] = [0.5, 4.0, 30.0];
/// Most steps of a position, and the part of a run that has to lie between two of them.
const STEPS: usize = 3;
const APART: f64 = 0.05;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    for j in 0..dictionary.joints() {
        if dictionary.problem.cell(Channel::JointTorque, j).is_some() {
            push_friction(dictionary, j, all);
            push_spring(j, all);
        }
        if let Some(cell) = dictionary.problem.cell(Channel::Transmission, j) {
            push_cable(dictionary, j, all);
            push_steps(dictionary, j, cell, all);
        }
    }
}

/// What grows with the square of the speed.
pub(crate) const SQUARED: &str = "velocity squared";

fn push_friction(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    const TORQUE: Channel = Channel::JointTorque;
    for at_link in [false, true] {
        let drag = move |d: &Dictionary| {
            let squared = d.at_grid(|r, i, _| {
                let v = d.problem.pairs[r].real.drive_velocity[j][i];
                v * v.abs()
            });
            vec![d.effort_of(j, squared, at_link)]
        };
        let penalty = if at_link { 7.0 } else { 6.0 };
        all.push(Family::fixed(UNMODELLED, &[j], SQUARED, TORQUE, &[Bound::Free], drag).penalised(penalty));
    }
    let waves = move |d: &Dictionary, s: &[f64]| {
        let sign = super::friction::steep(d, j);
        let q = d.at_grid(|r, i, _| d.problem.pairs[r].real.position[j][i]);
        let wave = |phase: f64| {
            let of = |q: &f64| (std::f64::consts::TAU * q / s[0] + phase).sin();
            d.effort_of(j, times(&sign, &q.iter().map(of).collect::<Vec<_>>()), false)
        };
        vec![wave(0.0), wave(std::f64::consts::FRAC_PI_2)]
    };
    let (travel, free) = (dictionary.travel(j), Bound::Free);
    let (from, to, count) = WAVES;
    let periods = geometric(travel * from, travel * to, count);
    let period = [("period", true)];
    let family =
        Family::shaped(UNMODELLED, &[j], "friction and position", TORQUE, &[free, free], &period, product(&[&periods]), waves);
    all.push(family.penalised(9.0));
}

/// What pulls a joint to a place, as a hose or a lead does, behind its cable or before it.
fn push_spring(j: usize, all: &mut Vec<Family>) {
    for (form, at_link, penalty) in [("position", true, 8.0), ("position, before the cable", false, 9.0)] {
        let pull = move |d: &Dictionary| {
            let q = d.at_grid(|r, i, _| d.problem.pairs[r].real.position[j][i]);
            let constant = vec![1.0; q.len()];
            vec![d.effort_of(j, q, at_link), d.effort_of(j, constant, at_link)]
        };
        let family = Family::fixed(UNMODELLED, &[j], form, Channel::JointTorque, &[Bound::Free, Bound::Free], pull);
        all.push(family.penalised(penalty));
    }
}

/// A cable whose stiffness changes with its load: bent one way, or softer beyond a load.
fn push_cable(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    const TRANSMISSION: Channel = Channel::Transmission;
    let usual = dictionary.cable_load(j).iter().fold(0.0_f64, |most, l| most.max(l.abs()));
    if usual < 1e-9 {
        return;
    }
    // A spring k x + c x³ in place of k x, or in place of a softer one: the share that the cube has at the largest load.
    let harder = move |d: &Dictionary, s: &[f64]| {
        let less = |l: &f64| {
            let l = l / usual;
            bent(l, s[0]) - l
        };
        let load = d.cable_load(j);
        let column = |series: Vec<f64>| d.strain_of(j, series);
        vec![column(load.iter().map(less).collect()), column(load.to_vec())]
    };
    let family = Family::shaped(
        UNMODELLED,
        &[j],
        HARDENING[0],
        TRANSMISSION,
        &[Bound::Free, Bound::Free],
        &[("harder", true)],
        product(&[&HARDER]),
        harder,
    );
    all.push(family.penalised(8.0));
    let beyond = move |d: &Dictionary, s: &[f64]| {
        let soft = |l: &f64| l.signum() * (l.abs() - s[0]).max(0.0);
        vec![d.strain_of(j, d.cable_load(j).iter().map(soft).collect())]
    };
    let shares = SLACK.map(|share| share * usual);
    let family = Family::shaped(
        UNMODELLED,
        &[j],
        HARDENING[1],
        TRANSMISSION,
        &[Bound::Positive],
        &[("level", true)],
        product(&[&shares]),
        beyond,
    );
    all.push(family.penalised(7.0));
}

/// The root x of `x + c x³ = l`, by Newton's method from the side that it cannot overshoot.
fn bent(l: f64, c: f64) -> f64 {
    let mut x = l;
    for _ in 0..40 {
        let step = (x + c * x * x * x - l) / (1.0 + 3.0 * c * x * x);
        x -= step;
        if step.abs() < 1e-12 {
            break;
        }
    }
    x
}

/// A position that steps: the instants are those at which steps take most out of what is seen, run by run.
fn push_steps(dictionary: &Dictionary, j: usize, cell: usize, all: &mut Vec<Family>) {
    let seen = &dictionary.problem.cells[cell].residual;
    // By name and time, since what is held out has other runs, or a later part of the same.
    let mut places: Vec<(String, f64)> = Vec::new();
    for (r, pair) in dictionary.problem.pairs.iter().enumerate() {
        let own: Vec<usize> = (0..dictionary.grid.len()).filter(|k| dictionary.grid[*k].0 == r).collect();
        let Some(first) = own.first() else { continue };
        let values: Vec<f64> = own.iter().map(|k| seen[*k]).collect();
        let run = &pair.real.run;
        places.extend(steps(&values).into_iter().map(|k| (run.id.clone(), run.time_s(dictionary.grid[first + k].1))));
    }
    if places.is_empty() {
        return;
    }
    let count = places.len();
    let family = Family::fixed(UNMODELLED, &[j], STEPS_IN_TIME, Channel::Transmission, &vec![Bound::Free; count], move |d| {
        let step = |(id, from_s): &(String, f64)| {
            let since = |r: usize, i: usize| {
                let run = &d.problem.pairs[r].real.run;
                f64::from(u8::from(run.id == *id && run.time_s(i) >= *from_s))
            };
            d.deflection_of(j, d.at_grid(|r, i, _| since(r, i)))
        };
        places.iter().map(step).collect()
    });
    all.push(family.penalised(6.0 * count as f64));
}

/// Where a series is cut so that the means of its parts leave least, one cut after the other.
fn steps(values: &[f64]) -> Vec<usize> {
    let apart = ((APART * values.len() as f64) as usize).max(2);
    let mut sums = vec![0.0];
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    let gain = |from: usize, at: usize, to: usize| {
        let mean = |a: usize, b: usize| (sums[b] - sums[a]).powi(2) / (b - a) as f64;
        mean(from, at) + mean(at, to) - mean(from, to)
    };
    let mut cuts = vec![0, values.len()];
    for _ in 0..STEPS {
        let best = cuts
            .windows(2)
            .flat_map(|part| (part[0] + apart..part[1].saturating_sub(apart)).map(move |at| (part[0], at, part[1])))
            .map(|(from, at, to)| (gain(from, at, to), at))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, at)) = best else { break };
        cuts.push(at);
        cuts.sort_unstable();
    }
    cuts[1..cuts.len() - 1].to_vec()
}

#[cfg(test)]
mod tests {
    use super::{bent, steps};

    #[test]
    fn a_bent_spring_gives_back_its_load() {
        for (l, c) in [(1.0, 0.5), (-0.7, 30.0), (0.0, 4.0), (3.0, 100.0)] {
            let x = bent(l, c);
            assert!((x + c * x * x * x - l).abs() < 1e-9);
        }
    }

    #[test]
    fn steps_are_found_where_they_are() {
        let values: Vec<f64> = (0..600)
            .map(|k| f64::from(u8::from(k >= 120)) + f64::from(u8::from(k >= 300)) - 2.0 * f64::from(u8::from(k >= 450)))
            .collect();
        assert_eq!(steps(&values), [120, 300, 450]);
    }
}
