//! 95 % intervals of parameters: leave one block out, shapes and onsets linearised.

use crate::hypothesis::{Candidate, Column, Dictionary};
use crate::nominal::Nominal;
use crate::parameters::{Named, parameters};
use crate::robot::Robot;
use crate::score::Scorer;
use crate::search::Effect;

/// What an effect amounts to.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Parameters, with their 95 % intervals.
    pub parameters: Vec<(Named, [f64; 2])>,
    /// Onset, s from the start of each run, with its interval.
    pub onset_s: Option<(f64, [f64; 2])>,
    /// Coefficients of the candidate's columns.
    pub coefficients: Vec<f64>,
}

/// Model error that blocks share and so do not show, as a share of a value: rigid-body numbers of a lab, forms of friction.
const COMMON: f64 = 0.01;

/// Estimates of all effects together.
pub fn estimates(dictionary: &Dictionary, scorer: &Scorer, nominal: &Nominal, robot: &Robot, effects: &[Effect]) -> Vec<Estimate> {
    // First round: coefficients; second: with the slopes by shape and onset.
    let candidates: Vec<&Candidate> = effects.iter().map(|e| &e.chosen.candidate).collect();
    let plain = candidates.iter().fold(scorer.empty(), |grams, c| scorer.extended(&grams, &c.columns));
    let fit = scorer.fit(&plain);
    let mut grams = scorer.empty();
    let mut layout = Vec::new();
    let (mut start, mut column) = (0, 0);
    for candidate in &candidates {
        let theta = &fit.coefficients[start..start + candidate.columns.len()];
        start += theta.len();
        let slopes = slopes(dictionary, candidate, theta);
        let mut columns = candidate.columns.clone();
        columns.extend(slopes.iter().map(|(_, slope)| slope.clone()));
        grams = scorer.extended(&grams, &columns);
        layout.push((column, theta.to_vec(), slopes.into_iter().map(|(which, _)| which).collect::<Vec<_>>()));
        column += columns.len();
    }
    let wide = scorer.fit(&grams);
    let blocks = wide.without.len() as f64;
    let reach = (1.96 + 2.4 / (blocks - 1.0)) * ((blocks - 1.0) / blocks).sqrt();
    candidates
        .iter()
        .zip(layout)
        .map(|(candidate, (column, theta, which))| {
            let of = |coefficients: &[f64]| -> (Vec<Named>, Option<f64>) {
                let own = &coefficients[column..column + theta.len()];
                let mut shape = candidate.shape.clone();
                let mut onset = candidate.onset_s;
                for (k, which) in which.iter().enumerate() {
                    let moved = coefficients[column + theta.len() + k] - wide.coefficients[column + theta.len() + k];
                    match which {
                        Some(number) => shape[*number] += moved,
                        None => onset = onset.map(|t| t + moved),
                    }
                }
                // Deviations are taken from the wide fit, values from the plain one.
                let at: Vec<f64> = own.iter().zip(&wide.coefficients[column..]).zip(&theta).map(|((x, w), t)| t + x - w).collect();
                (parameters(robot, nominal, candidate, &at, &shape), onset)
            };
            let (values, onset) = of(&wide.coefficients);
            let replicates: Vec<(Vec<Named>, Option<f64>)> = wide.without.iter().map(|c| of(c)).collect();
            let spread = |of: &dyn Fn(&(Vec<Named>, Option<f64>)) -> f64| -> f64 {
                let mean = replicates.iter().map(of).sum::<f64>() / blocks;
                replicates.iter().map(|r| (of(r) - mean).powi(2)).sum::<f64>().sqrt()
            };
            let parameters = values
                .iter()
                .enumerate()
                .map(|(k, named)| {
                    let half = (reach * spread(&|r| r.0[k].value)).hypot(COMMON * named.value);
                    (named.clone(), [named.value - half, named.value + half])
                })
                .collect();
            let onset_s = onset.map(|t| {
                let half = (reach * spread(&|r| r.1.unwrap_or(t))).max(0.01);
                (t, [t - half, t + half])
            });
            Estimate { parameters, onset_s, coefficients: theta }
        })
        .collect()
}

/// Change of the effect per unit of each refined number of its shape, and of its onset (none).
fn slopes(dictionary: &Dictionary, candidate: &Candidate, theta: &[f64]) -> Vec<(Option<usize>, Column)> {
    let family = &candidate.family;
    let mut all = Vec::new();
    for (k, step) in family.steps.iter().enumerate() {
        // What rounds a sign or a crossing is not asked for.
        if step.is_none() || matches!(family.shape[k], "v_eps" | "presliding" | "crossing") {
            continue;
        }
        let step = 1e-3 * candidate.shape[k].abs().max(1e-4);
        let at = |sign: f64| {
            let mut shape = candidate.shape.clone();
            shape[k] += sign * step;
            Candidate::new(dictionary, family, &shape, candidate.onset_s)
        };
        all.push((Some(k), difference(&at(1.0), &at(-1.0), theta, 2.0 * step)));
    }
    if let Some(onset) = candidate.onset_s {
        let step = 0.04;
        let at = |onset: f64| Candidate::new(dictionary, family, &candidate.shape, Some(onset));
        all.push((None, difference(&at(onset + step), &at(onset - step), theta, 2.0 * step)));
    }
    all.retain(|(_, column)| !column.is_empty());
    all
}

fn difference(there: &Candidate, here: &Candidate, theta: &[f64], step: f64) -> Column {
    let mut out = Column::default();
    let cells: std::collections::BTreeSet<usize> =
        there.columns.iter().chain(&here.columns).flat_map(|column| column.parts.iter().map(|(c, _)| *c)).collect();
    for cell in cells {
        let sum = |candidate: &Candidate| candidate.effect(cell, theta);
        let (a, b) = (sum(there), sum(here));
        let rows = a.len().max(b.len());
        let value = |s: &[f64], i: usize| s.get(i).copied().unwrap_or(0.0);
        out.push(Some(cell), (0..rows).map(|i| (value(&a, i) - value(&b, i)) / step).collect());
    }
    out
}
