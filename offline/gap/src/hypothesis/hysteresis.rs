//! Hysteresis of a cable under its load: Bouc-Wen elements.

use std::sync::Arc;

use super::dictionary::Dictionary;
use super::{Bound, Family, product};
use crate::cell::Channel;
use crate::linear::dot;
use crate::pair::Pair;

const PHYSICS: &str = "cable_hysteresis";
/// Bouc-Wen, the cable as stiff as in the simulation.
pub(crate) const OWN_STIFFNESS: &str = "Bouc-Wen, of the simulation's stiffness";
/// Bouc-Wen elements to begin with: shares of the straight spring, the same where its stiffness is known, yield loads over the RMS
/// load, exponents, and how alike loading and unloading bend.
const STRAIGHT: [f64; 2] = [0.3, 0.7];
const STRAIGHT_OWN: [f64; 2] = [0.5, 0.85];
const YIELD: [f64; 4] = [0.12, 0.35, 0.9, 1.8];
const POWER: [f64; 1] = [1.4];
const ALIKE: [f64; 2] = [0.5, 0.85];
/// What the memory of an element holds at the start, to begin with: shares of what the first load leaves in a new one, and of its yield
/// load, which a larger load left.
const STARTED_OF_NEW: [f64; 4] = [0.0, 0.3, 0.6, 1.0];
const STARTED_OF_YIELD: f64 = 0.9;
/// Steps in which a load of one yield load comes on, and most of a row's.
const STEPS: u32 = 2;
const MOST_STEPS: u32 = 16;
/// Parts in which the first load comes on.
const PARTS: u32 = 8;
/// Name of what a memory holds at the start of a run: one number of each run, in their order.
pub(crate) const START: &str = "start";
/// Numbers of an element's law, after which what it holds at the start of each run follows: nobody knows that.
const ELEMENT: usize = 4;
/// Where both bend alike nothing depends on the way any more: a soft spring, which has other names.
const MOST_ALIKE: f64 = 0.93;
/// From where on they bend about alike, and how near to its limit the straight share stands at it.
const ABOUT_ALIKE: f64 = 0.9;
const AT_A_LIMIT: f64 = 1e-3;

/// Is an element a bent spring: is all of it straight or nothing, or does it bend about alike both ways?
pub(super) fn is_a_bent_spring(family: &Family, shape: &[f64]) -> bool {
    let at_a_limit = |straight: f64| family.limits[0].iter().any(|limit| (straight - limit).abs() < AT_A_LIMIT);
    family.physics == PHYSICS && (at_a_limit(shape[0]) || shape[3] > ABOUT_ALIKE)
}

/// Both forms at a joint whose cable has this load, RMS.
pub(super) fn push(dictionary: &Dictionary, j: usize, usual: f64, all: &mut Vec<Family>) {
    let starts = Arc::new(Starts::new(dictionary, j));
    let runs = starts.first.len();
    let numbers = |a: bool| {
        let mut all = vec![("a", a), ("yield", true), ("n", true), ("g", true)];
        all.resize(ELEMENT + runs, (START, true));
        all
    };
    let yields = YIELD.map(|share| share * usual);
    let straight = [0.03, 0.97];
    let mut limits = vec![straight, [0.02 * usual, 6.0 * usual], [1.0, 3.0], [0.5, MOST_ALIKE]];
    limits.resize(ELEMENT + runs, [-1.0, 1.0]);
    let grid = |straight: &[f64]| starts.grid(&product(&[straight, &yields, &POWER, &ALIKE]));
    let of_runs = starts.clone();
    all.push(
        Family::shaped(
            PHYSICS,
            &[j],
            "Bouc-Wen",
            Channel::Transmission,
            &[Bound::Positive, Bound::Free],
            &numbers(true),
            grid(&STRAIGHT),
            move |d, s| {
                let load = d.cable_load(j);
                vec![d.strain_of(j, of_runs.bouc_wen(d, load, s)), d.strain_of(j, load.to_vec())]
            },
        )
        .limited(&limits)
        .penalised(3.0),
    );
    let own = dictionary.problem.nominal.compliance[j][0];
    if own > 0.0 {
        let of_runs = starts.clone();
        // The coefficient is the share that yields: near the share for which a column is made, the deflection goes with it.
        let family = Family::shaped(
            PHYSICS,
            &[j],
            OWN_STIFFNESS,
            Channel::Transmission,
            &[Bound::Between(0.0, straight[1])],
            &numbers(false),
            grid(&STRAIGHT_OWN),
            move |d, s| {
                let load = d.cable_load(j);
                let per_share = own / (1.0 - s[0]);
                let bent = of_runs.bouc_wen(d, load, s);
                vec![d.strain_of(j, bent.iter().zip(load).map(|(x, load)| per_share * (x - load)).collect())]
            },
        );
        all.push(family.limited(&limits).telling(0, |theta| 1.0 - theta[0]).penalised(3.0));
    }
}

/// The runs that an element is fitted to, in each of which its memory starts with a number of its own.
struct Starts {
    /// By name and time: what is held out may be a later part of the same run.
    runs: Vec<(String, f64)>,
    /// Loads of the cable where they begin; 0 of a run without rows.
    first: Vec<f64>,
}

impl Starts {
    /// Of the runs of a dictionary.
    fn new(dictionary: &Dictionary, j: usize) -> Self {
        let load = dictionary.cable_load(j);
        let first = parts(dictionary, load).map(|run| run.first().copied().unwrap_or(0.0)).collect();
        Self { runs: dictionary.problem.pairs.iter().map(of_run).collect(), first }
    }

    /// Elements with what they may hold at the start of each run.
    fn grid(&self, elements: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let begun = |element: &Vec<f64>| {
            let started =
                |held: &dyn Fn(f64) -> f64| [element.clone(), self.first.iter().map(|load| held(*load)).collect()].concat();
            let mut all: Vec<Vec<f64>> =
                STARTED_OF_NEW.iter().map(|share| started(&|load| share * of_new(load, element))).collect();
            all.push(started(&|load| STARTED_OF_YIELD * load.signum()));
            all
        };
        elements.iter().flat_map(begun).collect()
    }

    /// What a shape holds at the start of a run, over its yield load. Of a run that was not fitted: the same share of what its own first load
    /// leaves in a new element.
    fn held(&self, dictionary: &Dictionary, run: usize, load: &[f64], shape: &[f64]) -> f64 {
        let (element, starts) = shape.split_at(ELEMENT);
        if self.runs.get(run) == Some(&of_run(&dictionary.problem.pairs[run])) {
            return starts[run];
        }
        let of_fitted: Vec<f64> = self.first.iter().map(|load| of_new(*load, element)).collect();
        let share = dot(starts, &of_fitted) / dot(&of_fitted, &of_fitted).max(f64::MIN_POSITIVE);
        share * of_new(load.first().copied().unwrap_or(0.0), element)
    }

    /// Deflection times stiffness of a shape under a load on the grid.
    fn bouc_wen(&self, dictionary: &Dictionary, load: &[f64], shape: &[f64]) -> Vec<f64> {
        let of_run = |(r, run): (usize, &[f64])| bouc_wen(run, shape, self.held(dictionary, r, run, shape));
        parts(dictionary, load).enumerate().flat_map(of_run).collect()
    }
}

/// Name and beginning of a run.
fn of_run(pair: &Pair) -> (String, f64) {
    (pair.real.run.id.clone(), pair.real.run.since_s)
}

/// A grid series, run by run.
pub(super) fn parts<'s>(dictionary: &'s Dictionary, series: &'s [f64]) -> impl Iterator<Item = &'s [f64]> {
    dictionary.problem.pairs.iter().scan(series, |rest, pair| {
        let (run, others) = rest.split_at(pair.real.rows.len());
        *rest = others;
        Some(run)
    })
}

/// A Bouc-Wen element, `load = a x + (1 - a) z`, with deflection times stiffness `x` and memory `z`.
struct BoucWen {
    straight: f64,
    yields: f64,
    power: f64,
    alike: f64,
    z: f64,
}

impl BoucWen {
    /// Of a shape (a, yield load, n, g, ...), whose memory holds this share of its yield load.
    fn new(shape: &[f64], held: f64) -> Self {
        let yields = shape[1];
        Self { straight: shape[0], yields, power: shape[2], alike: shape[3], z: held.clamp(-1.0, 1.0) * yields }
    }

    /// More load: `dz = dx (1 - |z/yield|^n (g + (1-g) sgn(dx z)))`, so that `dz / dload` depends on `z` and the way alone.
    ///
    /// In steps of a Rosenbrock method of one stage, implicit by half (Hairer, Wanner, *Solving Ordinary Differential Equations II*, IV.7):
    /// second order, and steady where a memory is full, at one power for each step. The powers are most of what an element costs.
    fn load(&mut self, more: f64) {
        // Rows beside a hole are several yield loads apart; all others take the fewest.
        let steps = STEPS.saturating_mul((more.abs() / self.yields).ceil().max(1.0) as u32).min(MOST_STEPS);
        let step = more / f64::from(steps);
        for _ in 0..steps {
            let bend = if step * self.z >= 0.0 { 1.0 } else { 2.0 * self.alike - 1.0 };
            let bent = bend * (self.z.abs() / self.yields).powf(self.power);
            let total = self.straight + (1.0 - self.straight) * (1.0 - bent);
            let change = step * (1.0 - bent) / total;
            // Minus the step times how `dz / dload` changes with `z`.
            let stiff = if self.z == 0.0 { 0.0 } else { step * self.straight * self.power * bent / (self.z * total * total) };
            self.z = (self.z + change / (1.0 + 0.5 * stiff.max(-1.0))).clamp(-self.yields, self.yields);
        }
    }
}

/// Share of its yield load that the memory of a new element of a shape holds under its first load.
fn of_new(load: f64, shape: &[f64]) -> f64 {
    let mut element = BoucWen::new(shape, 0.0);
    (0..PARTS).for_each(|_| element.load(load / f64::from(PARTS)));
    element.z / element.yields
}

/// Deflection times stiffness of a Bouc-Wen element of a shape under the load of a run, at the start of which its memory holds this share of
/// its yield load.
fn bouc_wen(load: &[f64], shape: &[f64], held: f64) -> Vec<f64> {
    let mut element = BoucWen::new(shape, held);
    let mut before = load.first().copied().unwrap_or(0.0);
    load.iter()
        .map(|&now| {
            element.load(now - before);
            before = now;
            (now - (1.0 - element.straight) * element.z) / element.straight
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_near_enough_for_an_element_to_follow_its_law() {
        // 50 rows a second of a load of 1 that turns at several places.
        let load = |i: u32| {
            let t = 0.02 * f64::from(i) * std::f64::consts::PI;
            t.sin() + 0.4 * (2.6 * t).sin()
        };
        let between = |i: u32, finer: u32| {
            let share = f64::from(i % finer) / f64::from(finer);
            (1.0 - share) * load(i / finer) + share * load(i / finer + 1)
        };
        let series = |finer: u32| (0..300 * finer).map(|i| between(i, finer)).collect::<Vec<f64>>();
        for (straight, most) in [(0.03, 2e-3), (0.3, 1e-3), (0.7, 4e-4)] {
            for yields in YIELD {
                for (power, alike) in [(1.0, 0.5), (1.4, 0.85), (3.0, 0.5)] {
                    let shape = [straight, yields, power, alike];
                    let law: Vec<f64> = bouc_wen(&series(100), &shape, 0.0).into_iter().step_by(100).collect();
                    let found = bouc_wen(&series(1), &shape, 0.0);
                    let off: Vec<f64> = found.iter().zip(&law).map(|(x, law)| x - law).collect();
                    let share = (dot(&off, &off) / dot(&law, &law)).sqrt();
                    assert!(share < most, "{shape:?}: {share:.1e} of the deflection");
                    for load in [0.5, 1.0, 1.5, 4.0] {
                        let mut finely = BoucWen::new(&shape, 0.0);
                        (0..1000).for_each(|_| finely.load(1e-3 * load * yields));
                        let off = of_new(load * yields, &shape) - finely.z / yields;
                        assert!(off.abs() < 0.01, "{shape:?}: {off} of the yield load after a first load of {load}");
                    }
                }
            }
        }
    }
}
