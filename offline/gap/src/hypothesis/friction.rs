//! Friction on the motor's or the link's side, and friction that fades with heat.

use super::dictionary::{Dictionary, size};
use super::{Bound, Candidate};
use crate::problem::Channel;

/// Travel over which friction turns round, as shares of a joint's usual travel; 0: with the sign of the velocity alone.
/// Below break-away a bristle keeps its force, which a rigid sign does not: a joint at rest holds what it came with.
const PRESLIDING: [f64; 4] = [0.0, 0.0005, 0.003, 0.015];
/// Speeds below which Stribeck friction rises, as shares of the RMS speed.
const STRIBECK_SPEED: [f64; 4] = [0.03, 0.1, 0.25, 0.6];
/// Exponents of the Stribeck curve.
const STRIBECK_EXPONENT: [f64; 2] = [1.0, 2.0];
/// Time constants of heating, s.
const HEATING_S: [f64; 6] = [3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    for j in 0..dictionary.joints() {
        push_joint(dictionary, j, all);
    }
}

fn push_joint(dictionary: &Dictionary, j: usize, all: &mut Vec<Candidate>) {
    let signs: Vec<(f64, Vec<f64>)> = presliding(dictionary, j).into_iter().map(|d| (d, turning(dictionary, j, d))).collect();
    let velocity = dictionary.at_grid(|r, i, _| dictionary.problem.pairs[r].real.velocity[j][i]);
    let speed = size(&velocity).max(1e-9);
    let load = dictionary.load(j);
    for (form, at_link) in [("motor side", false), ("link side", true)] {
        for (travel, sign) in &signs {
            let named = |physics| Candidate::new(physics, &[j], form, Channel::JointTorque).shaped("presliding", *travel);
            all.push(named("coulomb_friction").with(dictionary.effort_of(j, sign.clone(), at_link), Bound::Positive));
            let by_load: Vec<f64> = sign.iter().zip(&load).map(|(s, l)| s * l.abs()).collect();
            all.push(named("load_dependent_friction").with(dictionary.effort_of(j, by_load.clone(), at_link), Bound::Positive));
            all.push(
                named("load_dependent_friction")
                    .with(dictionary.effort_of(j, by_load, at_link), Bound::Positive)
                    .with(dictionary.effort_of(j, sign.clone(), at_link), Bound::Positive),
            );
            if !at_link {
                for heating in HEATING_S {
                    let faded = heated(dictionary, j, heating, sign);
                    all.push(named("thermal_drift").shaped("T", heating).with(dictionary.effort_of(j, faded, at_link), Bound::Free));
                }
            }
        }
        all.push(
            Candidate::new("viscous_friction", &[j], form, Channel::JointTorque)
                .with(dictionary.effort_of(j, velocity.clone(), at_link), Bound::Positive),
        );
        for share in STRIBECK_SPEED {
            for exponent in STRIBECK_EXPONENT {
                let slow = share * speed;
                let (sign, extra) = stribeck(dictionary, j, slow, exponent);
                all.push(
                    Candidate::new("stribeck_friction", &[j], form, Channel::JointTorque)
                        .shaped("v_s", slow)
                        .shaped("a", exponent)
                        .with(dictionary.effort_of(j, sign, at_link), Bound::Positive)
                        .with(dictionary.effort_of(j, extra, at_link), Bound::Positive),
                );
            }
        }
    }
}

/// Candidates for the presliding travel of a joint, rad or m.
fn presliding(dictionary: &Dictionary, j: usize) -> Vec<f64> {
    let q = dictionary.at_grid(|r, i, _| dictionary.problem.pairs[r].real.position[j][i]);
    let (low, high) = q.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    PRESLIDING.iter().map(|share| share * (high - low)).collect()
}

/// Sign of the motion, turning round over a presliding travel (Dahl), smoothed.
pub(super) fn turning(dictionary: &Dictionary, j: usize, travel: f64) -> Vec<f64> {
    dictionary.smoothed(|r| {
        let motion = &dictionary.problem.pairs[r].real;
        if travel <= 0.0 {
            let eps = motion.sign_speed(j);
            return motion.quick_velocity[j].iter().map(|v| (v / eps).tanh()).collect();
        }
        let mut state = 0.0;
        motion.quick_velocity[j]
            .iter()
            .map(|v| {
                let moved = v * motion.run.dt_s / travel;
                // Exact for a constant direction.
                let limit = v.signum();
                state = if moved == 0.0 { state } else { limit + (state - limit) * (-moved.abs()).exp() };
                state
            })
            .collect()
    })
}

/// The sign of the velocity, and what the Stribeck curve adds per unit of `f_s - f_c`.
fn stribeck(dictionary: &Dictionary, j: usize, slow: f64, exponent: f64) -> (Vec<f64>, Vec<f64>) {
    let part = |extra: bool| {
        dictionary.smoothed(|r| {
            let motion = &dictionary.problem.pairs[r].real;
            let eps = motion.sign_speed(j);
            motion.quick_velocity[j]
                .iter()
                .map(|v| (v / eps).tanh() * if extra { (-(v.abs() / slow).powf(exponent)).exp() } else { 1.0 })
                .collect()
        })
    };
    (part(false), part(true))
}

/// `1 - exp(-h/T)` of a joint, h the time weighted by its squared torque over the mean square.
pub(super) fn heat(dictionary: &Dictionary, j: usize, heating_s: f64) -> Vec<f64> {
    let squares = dictionary.at_grid(|r, i, k| {
        let problem = dictionary.problem;
        let torque = problem.pairs[r].real.torque.as_ref().map_or(problem.loads[r][k].motor[j], |torque| torque[j][i]);
        torque * torque
    });
    let mean = crate::nominal::mean(&squares).max(1e-30);
    let mut h = 0.0;
    dictionary
        .grid
        .iter()
        .zip(&squares)
        .enumerate()
        .map(|(row, (&(r, i, _), square))| {
            let pair = &dictionary.problem.pairs[r].real;
            let before = row.checked_sub(1).map(|b| dictionary.grid[b]).filter(|b| b.0 == r);
            match before {
                Some(before) => h += (i - before.1) as f64 * pair.run.dt_s * square / mean,
                None => h = i as f64 * pair.run.dt_s,
            }
            1.0 - (-h / heating_s).exp()
        })
        .collect()
}

fn heated(dictionary: &Dictionary, j: usize, heating_s: f64, sign: &[f64]) -> Vec<f64> {
    heat(dictionary, j, heating_s).iter().zip(sign).map(|(h, s)| h * s).collect()
}
