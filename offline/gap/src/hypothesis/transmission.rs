//! What lies between motor and joint: play, stretch, hysteresis, creep, coupling, ratio, eccentric pulleys, offsets.

use super::dictionary::{Dictionary, size};
use super::{Bound, Candidate};
use crate::problem::Channel;

/// Widths of play, shares of a joint's travel.
const PLAY: [f64; 14] =
    [0.0003, 0.0006, 0.001, 0.0018, 0.003, 0.005, 0.008, 0.012, 0.018, 0.027, 0.04, 0.06, 0.09, 0.14];
/// Loads over which a loaded joint crosses its play, shares of the RMS load.
const CROSSING: [f64; 3] = [0.02, 0.1, 0.3];
/// Bouc-Wen shapes: share of the straight spring, yield load over RMS load.
const HYSTERESIS: [(f64, f64); 9] =
    [(0.3, 0.1), (0.3, 0.3), (0.3, 0.8), (0.6, 0.1), (0.6, 0.3), (0.6, 0.8), (0.85, 0.1), (0.85, 0.3), (0.85, 0.8)];
/// Time constants of creep, s.
const CREEP_S: [f64; 8] = [0.5, 1.0, 2.0, 5.0, 15.0, 50.0, 150.0, 500.0];
/// Periods of an eccentric pulley, from and to as shares of the travel, and how many.
const PERIODS: (f64, f64, usize) = (0.03, 2.5, 36);

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    if problem.cell(Channel::Transmission, 0).is_none() && problem.cell(Channel::EndEffector, 0).is_none() {
        return;
    }
    for j in 0..dictionary.joints() {
        let position = dictionary.at_grid(|r, i, _| problem.pairs[r].real.position[j][i]);
        let (low, high) = position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let travel = (high - low).max(1e-9);
        push_play(dictionary, j, travel, all);
        push_elastic(dictionary, j, all);
        push_geometry(dictionary, j, &position, travel, all);
    }
}

fn named(physics: &'static str, j: usize, form: &'static str) -> Candidate {
    Candidate::new(physics, &[j], form, Channel::Transmission)
}

fn push_play(dictionary: &Dictionary, j: usize, travel: f64, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    for width in PLAY.map(|share| share * travel) {
        let lag = dictionary.smoothed(|r| {
            let series = &problem.pairs[r].real.position[j];
            let mut inner = series[0];
            series
                .iter()
                .map(|x| {
                    inner = f64::clamp(inner, x - 0.5 * width, x + 0.5 * width);
                    x - inner
                })
                .collect()
        });
        all.push(
            named("backlash", j, "follows the motion").shaped("b", width).with(dictionary.deflection_of(j, lag), Bound::Between(0.7, 1.4)),
        );
    }
    let load = dictionary.load(j);
    let usual = size(&load).max(1e-9);
    for share in CROSSING {
        let seat: Vec<f64> = load.iter().map(|l| 0.5 * (l / (share * usual)).tanh()).collect();
        all.push(
            named("backlash", j, "rests on the loaded side")
                .shaped("crossing", share * usual)
                .with(dictionary.deflection_of(j, seat), Bound::Positive),
        );
    }
}

fn push_elastic(dictionary: &Dictionary, j: usize, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    let load = dictionary.load(j);
    let usual = size(&load);
    if usual < 1e-9 {
        return;
    }
    all.push(named("cable_stretch", j, "linear").with(dictionary.deflection_of(j, load.clone()), Bound::Positive));
    for (straight, yields) in HYSTERESIS {
        let series = per_run(dictionary, &load, |run| bouc_wen(run, straight, yields * usual));
        all.push(
            named("cable_hysteresis", j, "Bouc-Wen")
                .shaped("a", straight)
                .shaped("yield", yields * usual)
                .with(dictionary.deflection_of(j, series), Bound::Positive)
                .with(dictionary.deflection_of(j, load.clone()), Bound::Free),
        );
    }
    for time in CREEP_S {
        let step: Vec<f64> = problem.pairs.iter().map(|pair| row_period(&pair.real)).collect();
        let mut state = 0.0;
        let crept: Vec<f64> = dictionary
            .grid
            .iter()
            .zip(&load)
            .map(|(&(r, _, k), load)| {
                let keep = (-step[r] / time).exp();
                // At the start the cable is taken to have crept as far as its load asks.
                state = if k == 0 { *load } else { keep * state + (1.0 - keep) * load };
                state
            })
            .collect();
        let fresh: Vec<f64> = {
            let mut state = 0.0;
            dictionary
                .grid
                .iter()
                .zip(&load)
                .map(|(&(r, _, k), load)| {
                    let keep = (-step[r] / time).exp();
                    state = if k == 0 { 0.0 } else { keep * state + (1.0 - keep) * load };
                    state
                })
                .collect()
        };
        for (form, series) in [("settled at the start", crept), ("fresh at the start", fresh)] {
            all.push(named("cable_creep", j, form).shaped("T_k", time).with(dictionary.deflection_of(j, series), Bound::Positive));
        }
    }
}

/// Seconds between rows.
fn row_period(motion: &crate::motion::Motion) -> f64 {
    motion.rows.get(1).map_or(0.0, |second| (second - motion.rows[0]) as f64 * motion.run.dt_s)
}

/// A memory of a grid series, run by run.
fn per_run(dictionary: &Dictionary, series: &[f64], memory: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut out = Vec::with_capacity(series.len());
    let mut start = 0;
    for pair in dictionary.problem.pairs {
        let end = start + pair.real.rows.len();
        out.extend(memory(&series[start..end]));
        start = end;
    }
    out
}

/// Deflection times stiffness of a Bouc-Wen element (n = 1, g = 0.5) under a load, where `load = a x + (1 - a) z`.
fn bouc_wen(load: &[f64], straight: f64, yields: f64) -> Vec<f64> {
    let mut z = 0.0_f64;
    let mut x = load.first().copied().unwrap_or(0.0);
    let mut before = x;
    z = z.clamp(-yields, yields);
    load.iter()
        .map(|&now| {
            let step = (now - before) / 8.0;
            for _ in 0..8 {
                // zd = xd (1 - |z|/yield (g + (1-g) sgn(xd z))), so that loading bends and unloading is straight.
                let direction = step.signum();
                let slope = 1.0 - (z.abs() / yields) * if direction * z > 0.0 { 1.0 } else { 0.0 };
                let stiffness = straight + (1.0 - straight) * slope;
                let dx = step / stiffness;
                x += dx;
                z = (z + slope * dx).clamp(-yields, yields);
            }
            before = now;
            x
        })
        .collect()
}

fn push_geometry(dictionary: &Dictionary, j: usize, position: &[f64], travel: f64, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    let ones = vec![1.0; position.len()];
    let minus: Vec<f64> = position.iter().map(|q| -q).collect();
    // q_true = q + o: the deflection A⁻¹m - q_true is -o.
    let offset = || dictionary.deflection_of(j, ones.iter().map(|x| -x).collect());
    all.push(named("joint_offset", j, "constant").with(offset(), Bound::Free));
    let ratio = || dictionary.deflection_of(j, minus.clone());
    all.push(named("transmission_ratio", j, "about zero").with(ratio(), Bound::Between(-0.5, 0.5)));
    all.push(named("transmission_ratio", j, "about where it was homed").with(ratio(), Bound::Between(-0.5, 0.5)).with(offset(), Bound::Free));
    for i in (0..dictionary.joints()).filter(|i| *i != j) {
        let other = dictionary.at_grid(|r, s, _| problem.pairs[r].real.position[i][s]);
        let coupled = || dictionary.deflection_of(j, other.clone());
        let dual = || {
            // m = (A + c) q, so tau_q = Aᵀ tau_m gains c times the other motor's torque, and less is asked of this one.
            let back: Vec<f64> = dictionary.load(j).iter().map(|l| -l).collect();
            let mut column = coupled();
            column.push(problem.cell(Channel::JointTorque, i), back);
            column
        };
        let pair = |form| Candidate::new("joint_coupling", &[j, i], form, Channel::Transmission);
        all.push(pair("position").with(coupled(), Bound::Between(-0.5, 0.5)));
        all.push(pair("position about a place").with(coupled(), Bound::Between(-0.5, 0.5)).with(offset(), Bound::Free));
        all.push(pair("position and torque").with(dual(), Bound::Between(-0.5, 0.5)));
    }
    let (from, to, count) = PERIODS;
    for k in 0..count {
        let period = travel * from * (to / from).powf(k as f64 / (count - 1) as f64);
        let wave = |phase: f64| -> Vec<f64> {
            // q_true = q + e sin(...): the deflection is the opposite.
            position.iter().map(|q| -(std::f64::consts::TAU * q / period + phase).sin()).collect()
        };
        all.push(
            named("pulley_eccentricity", j, "once per turn")
                .shaped("period", period)
                .with(dictionary.deflection_of(j, wave(0.0)), Bound::Free)
                .with(dictionary.deflection_of(j, wave(std::f64::consts::FRAC_PI_2)), Bound::Free),
        );
    }
    for heating in [3.0, 10.0, 30.0, 100.0, 300.0] {
        let drift: Vec<f64> = super::friction::heat(dictionary, j, heating);
        all.push(named("thermal_drift", j, "position").shaped("T", heating).with(dictionary.deflection_of(j, drift), Bound::Free));
    }
}
