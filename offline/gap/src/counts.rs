//! Places in counts: where a recording has those of an encoder and its simulation has none, the simulation is read through the same encoder.
//!
//! In slow motion a velocity out of counts stands and jumps, and with it what friction does of it; that is no physics that the simulation lacks.

use crate::robot::Robot;
use crate::run::Run;
use crate::series::{mean, quantile, resolution};

/// Counts of a step that are looked at: of longer ones rounded digits say nothing.
const FEW: f64 = 8.5;
/// A step that is so near to a whole number of counts is one, counts.
const NEAR: f64 = 0.15;
/// So many of them are, of places in counts; of others three in ten.
const ALMOST_ALL: f64 = 0.95;
/// Share of the steps that may be less than a count: where a line was drawn over what was not recorded.
const LEAST: f64 = 0.01;
/// Fewest steps that tell.
const ENOUGH: usize = 100;
/// A simulation that is finer than that share of a count has none of its own.
const FINER: f64 = 0.5;

/// Where an encoder counts, in the unit of the series.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    origin: f64,
    count: f64,
}

impl Grid {
    /// Of a series; none where it is not in counts.
    fn of(series: &[f64]) -> Option<Self> {
        let mut steps: Vec<f64> = series.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
        let least = quantile(&mut steps, LEAST);
        steps.retain(|step| *step < FEW * least);
        // Printed digits shorten the least of them.
        let mut single: Vec<f64> = steps.iter().copied().filter(|step| *step < 1.5 * least).collect();
        let count = quantile(&mut single, 0.5);
        let whole = steps.iter().filter(|step| off(**step / count).abs() < NEAR).count();
        (steps.len() >= ENOUGH && whole as f64 >= ALMOST_ALL * steps.len() as f64)
            .then(|| Self::through(series, count).unwrap_or(Self { origin: 0.0, count }))
    }

    /// The grid on which all places lie, if they lie on one of nearly this count: many counts tell it better than a printed one.
    fn through(series: &[f64], count: f64) -> Option<Self> {
        let mut number = 0.0;
        let numbers: Vec<f64> = std::iter::once(0.0)
            .chain(series.windows(2).map(|pair| {
                number += ((pair[1] - pair[0]) / count).round();
                number
            }))
            .collect();
        let (middle, place) = (mean(&numbers), mean(series));
        let (mut across, mut along) = (0.0, 0.0);
        for (n, x) in numbers.iter().zip(series) {
            across += (n - middle) * (x - place);
            along += (n - middle) * (n - middle);
        }
        let found = Self { origin: place - middle * across / along, count: across / along };
        let lies = |x: &f64| off((x - found.origin) / found.count).abs() < NEAR;
        ((found.count / count - 1.0).abs() < NEAR && series.iter().all(lies)).then_some(found)
    }

    fn round(self, x: f64) -> f64 {
        self.origin + ((x - self.origin) / self.count).round() * self.count
    }
}

/// From the nearest whole number.
fn off(x: f64) -> f64 {
    x - x.round()
}

/// Rounds what is finer than the counts of the recorded series.
fn round(recorded: &[Vec<f64>], simulated: &mut [Vec<f64>]) -> bool {
    let mut any = false;
    for (recorded, simulated) in recorded.iter().zip(simulated) {
        let Some(grid) = Grid::of(recorded).filter(|grid| resolution(simulated) < FINER * grid.count) else { continue };
        for x in simulated.iter_mut() {
            *x = grid.round(*x);
        }
        any = true;
    }
    any
}

/// A simulation read through the encoders of the recording: those of the motors, or of the joints where these were recorded.
pub(crate) fn read_alike(robot: &Robot, real: &Run, mut sim: Run) -> Run {
    if real.points {
        return sim;
    }
    // Motors on one side and joints on the other are not of the same place.
    if let (Some(recorded), Some(simulated)) = (&real.motor, &mut sim.motor) {
        if round(recorded, simulated) {
            sim.place_by_motors(robot);
        }
    } else if real.motor.is_none() && sim.motor.is_none() && round(&real.position, &mut sim.position) {
        sim.place_drives(robot);
    }
    if let (Some(recorded), Some(simulated)) = (&real.truth, &mut sim.truth) {
        round(recorded, simulated);
    }
    sim
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slow(count: f64) -> Vec<f64> {
        (0..4000)
            .map(|i| 75.0 + 0.3 * (f64::from(i) * 2e-3).sin())
            .map(|x| if count > 0.0 { (x / count).round() * count } else { x })
            .collect()
    }

    #[test]
    fn counts_are_told_from_what_moves_smoothly() {
        let count = 1.57e-3;
        let found = Grid::of(&slow(count)).expect("counts");
        assert!((found.count / count - 1.0).abs() < 1e-6, "{found:?}");
        // Seven digits, as a table has them: all places together tell the grid better than one step.
        let printed: Vec<f64> = slow(count).iter().map(|x| (x * 1e5).round() * 1e-5).collect();
        let found = Grid::of(&printed).expect("counts");
        assert!((found.count / count - 1.0).abs() < 1e-4, "{found:?}");
        assert!(slow(count).iter().all(|x| (found.round(*x) - x).abs() < 1e-5));
        assert_eq!(Grid::of(&slow(0.0)), None);
        assert_eq!(Grid::of(&vec![1.0; 500]), None);
        assert_eq!(Grid::of(&[]), None);
    }

    #[test]
    fn what_was_bridged_leaves_the_count() {
        let mut series = slow(1.57e-3);
        for i in 300..310 {
            series[i] = series[300] + (series[310] - series[300]) * (i - 300) as f64 / 10.0;
        }
        let found = Grid::of(&series).expect("counts");
        assert!((found.count / 1.57e-3 - 1.0).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn what_has_coarser_counts_of_its_own_is_left_alone() {
        let (fine, coarse) = (slow(1e-3), slow(4e-3));
        let mut simulated = [coarse.clone()];
        assert!(!round(&[fine], &mut simulated));
        assert_eq!(simulated[0], coarse);
        let mut smooth = [slow(0.0)];
        assert!(round(std::slice::from_ref(&coarse), &mut smooth));
        assert!(smooth[0].iter().zip(&coarse).all(|(a, b)| (a - b).abs() < 1e-6), "the same encoder");
    }
}
