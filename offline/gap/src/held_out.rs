//! What effects leave of what was held out, where nothing was fitted; and which of them do not hold there. What was fitted says how well a
//! claim fits, and its blocks how well it predicts their neighbours: a wrong one, bent to what is there, may do both.

use crate::hypothesis::{Candidate, Dictionary, UNMODELLED};
use crate::intervals::Estimate;
use crate::nominal::{less_means, mean};
use crate::problem::Problem;
use crate::search::{Answer, Effect, Thresholds};
use crate::verdicts::{left, main_cell};

/// Of the squared size of an effect, what it has to leave less of what was held out at least: 1 where it is as it was fitted, -1 where it has
/// nothing to do with what is there; 0 where it is half of what it should be.
const HOLDS: f64 = -0.2;
/// Of an effect that was accepted barely: one that gains less than so many times what is asked, and a memory, whose many numbers find something
/// in most of what they are fitted to.
const HOLDS_BARELY: f64 = 0.0;
const BARELY: f64 = 3.0;
/// What a rival has to leave less there to be taken instead, and the share of the claim's score that it has to have.
const INSTEAD: f64 = 0.5;
const NEAR: f64 = 0.3;
/// What may be otherwise in each run: whether the hand touches, how warm a drive is when it begins.
const OTHERWISE: [&str; 2] = ["external_contact", "thermal_drift"];

/// What was held out, and what it is compared with.
pub(crate) struct HeldOut<'a> {
    /// Residuals of the fit.
    pub problem: &'a Problem<'a>,
    /// Columns of what was held out.
    pub dictionary: &'a Dictionary<'a>,
    /// Noise floor of each cell of the fit.
    pub floors: &'a [f64],
}

/// A claim with its coefficients.
type Sized<'a> = (&'a Candidate, &'a [f64]);

/// The chosen ones of effects, with their sizes.
pub(crate) fn sized<'a>(effects: &'a [Effect], estimates: &'a [Estimate]) -> Vec<Sized<'a>> {
    effects.iter().zip(estimates).map(|(effect, estimate)| (&effect.chosen.candidate, &estimate.coefficients[..])).collect()
}

/// An effect that explains what was fitted and not what was held out.
#[derive(Debug, Clone)]
pub struct Refused {
    /// What was accepted.
    pub effect: Effect,
    /// Its coefficients.
    pub coefficients: Vec<f64>,
    /// Cell in which it shows most.
    pub cell: usize,
    /// RMS of what was held out there, without it and with it, in the cell's unit.
    pub rms: [f64; 2],
}

impl HeldOut<'_> {
    /// Takes back what does not hold, or takes a rival that does in its place; tells the first effect, if it went without one.
    pub(crate) fn judge(
        &self,
        answer: &mut Answer,
        estimates: &mut Vec<Estimate>,
        sizes: &dyn Fn(&Answer) -> Vec<Estimate>,
        thresholds: &Thresholds,
    ) -> Option<Refused> {
        let mut refused = None;
        // Each step takes an effect back, or a rival that holds: of no effect twice.
        let mut exchanged = Vec::new();
        loop {
            let all = sized(&answer.effects, estimates);
            let fails = |k: &usize| !self.holds(answer, &all, *k, thresholds);
            let Some(k) = (0..all.len()).rev().find(fails) else { return refused };
            let rival = if exchanged.contains(&answer.effects[k].chosen.candidate.family.physics) {
                None
            } else {
                self.rival(answer, &all, k, thresholds)
            };
            if let Some(rival) = rival {
                answer.exchange(k, rival);
                exchanged.push(answer.effects[k].chosen.candidate.family.physics);
            } else {
                let cell = main_cell(self.floors, all[k].0, all[k].1);
                let rms = self.without_and_with(&all, k, all[k], cell).map(|(without, with, _)| [without.sqrt(), with.sqrt()]);
                let coefficients = all[k].1.to_vec();
                let barely = is_barely(answer, k, thresholds);
                let effect = answer.take_back(k);
                if let (0, false, true, Some(rms)) = (k, barely, effect.is_named(), rms) {
                    refused = Some(Refused { effect, coefficients, cell, rms });
                }
            }
            *estimates = sizes(answer);
        }
    }

    fn holds(&self, answer: &Answer, all: &[Sized], k: usize, thresholds: &Thresholds) -> bool {
        let physics = all[k].0.family.physics;
        let barely = is_barely(answer, k, thresholds);
        if !barely && (OTHERWISE.contains(&physics) || physics == UNMODELLED) {
            return true;
        }
        let cell = main_cell(self.floors, all[k].0, all[k].1);
        match self.without_and_with(all, k, all[k], cell) {
            // It does not show there.
            Some((_, _, own)) if own <= 0.0 => !barely,
            Some((without, with, own)) if barely => without - with > HOLDS_BARELY * own,
            Some((without, with, own)) => without - with >= HOLDS * own,
            None => true,
        }
    }

    /// The first rival of an effect that holds in its place.
    fn rival(&self, answer: &Answer, all: &[Sized], k: usize, thresholds: &Thresholds) -> Option<usize> {
        let effect = &answer.effects[k];
        let least = thresholds.nats.max(NEAR * effect.chosen.score);
        effect.rivals.iter().position(|rival| {
            let claim = (&rival.candidate, &rival.coefficients[..]);
            let cell = main_cell(self.floors, claim.0, claim.1);
            let removes = |(without, with, own): (f64, f64, f64)| {
                without - with >= INSTEAD * own.max(without - self.floors[cell].powi(2)) && own > 0.0
            };
            rival.candidate.family.physics != UNMODELLED
                && rival.score >= least
                && rival.gain.least >= 0.5 * thresholds.nats
                && self.without_and_with(all, k, claim, cell).is_some_and(removes)
        })
    }

    /// Mean squares of what was held out in a cell of the fit: beside all effects but one, beside these and a claim in its place, and of the
    /// claim's own part.
    fn without_and_with(&self, all: &[Sized], k: usize, claim: Sized, cell: usize) -> Option<(f64, f64, f64)> {
        let others: Vec<Sized> = all.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, one)| *one).collect();
        let with: Vec<Sized> = others.iter().copied().chain([claim]).collect();
        let beside = self.problem.nuisances[cell].estimate(&left(self.problem, cell, with.iter().copied()));
        let (_, _, without) = self.corrected(&others, &beside, cell)?;
        let (_, _, with) = self.corrected(&with, &beside, cell)?;
        let square = |of: &dyn Fn(usize) -> f64| mean(&(0..with.len()).map(|i| of(i).powi(2)).collect::<Vec<_>>());
        Some((square(&|i| without[i]), square(&|i| with[i]), square(&|i| without[i] - with[i])))
    }

    /// Residuals of a cell of what was held out, before and after the correction by some effects, beside the likeliest values of what is known
    /// only roughly; with the cell's number there.
    pub(crate) fn corrected(&self, effects: &[Sized], beside: &[f64], cell: usize) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        let (of, held) = (&self.problem.cells[cell], self.dictionary.problem);
        let c = held.cell(of.channel, of.index)?;
        let before = held.cells[c].residual.clone();
        let mut after = before.clone();
        for (own, coefficients) in effects {
            let there = Candidate::new(self.dictionary, &own.family, &own.shape, own.window);
            there.take_off(c, coefficients, &mut after);
        }
        let nuisance = &held.nuisances[c];
        if self.problem.nuisances[cell].of_run.contains(&true) {
            let rows = &held.cells[c].rows;
            after = less_means(&after, |k| rows[k].0);
        } else if nuisance.columns.len() == beside.len() && !nuisance.columns.is_empty() {
            after.iter_mut().zip(nuisance.predict(beside)).for_each(|(y, p)| *y -= p);
        }
        Some((c, before, after))
    }
}

/// Is an effect the only one, and accepted barely or bent in many numbers?
fn is_barely(answer: &Answer, k: usize, thresholds: &Thresholds) -> bool {
    let effect = &answer.effects[k];
    answer.effects.len() == 1 && (effect.gain.nats < BARELY * thresholds.nats || !effect.chosen.candidate.family.limits.is_empty())
}
