//! Shapes whose numbers are refined all at once: those of a memory depend on each other.

use super::likeliest::simpler_is_enough;
use super::rank::keep_better;
use super::{AHEAD, Scored, Search};
use crate::hypothesis::{Candidate, Column, Windows};
use crate::intervals::slopes_of;
use crate::parallel;
use crate::refine::edges_moved;
use crate::score::{Fit, Grams};

/// Most steps of a shape whose numbers are refined at once, and the gain of one after which there is no other, nats.
const STEPS: usize = 25;
const ENOUGH: f64 = 0.05;
/// Most steps after which a shape agrees with its coefficients, and how far off it may be then.
const AGREEING: usize = 5;
const AGREES: f64 = 3e-3;
/// Starts of such a shape, per form of a claim, and share of what the best claim sees that a claim has to see to be refined from them.
const MANY: usize = 4;
const SEEN_OF_BEST: f64 = 0.3;

impl Search<'_, '_> {
    /// All refinable numbers of a shape together (Gauss and Newton, in steps that lead down): those of a memory depend on each
    /// other, and one after the other they stop on the way.
    pub(super) fn refined_at_once(&self, base: &Grams, start: &Candidate) -> Candidate {
        let mut best = start.clone();
        self.descend(base, &mut best);
        if best.edges() > 0 {
            let (mut least, _) = self.scorer.fitted(base, &best);
            edges_moved(self.dictionary, &mut best, &mut least, &|candidate| self.scorer.fitted(base, candidate).0);
            self.descend(base, &mut best);
        }
        best
    }

    /// Steps of a shape, each of which is better than the one before.
    fn descend(&self, base: &Grams, best: &mut Candidate) {
        let family = best.family.clone();
        let free: Vec<usize> = (0..family.shape.len()).filter(|k| family.steps[*k].is_some()).collect();
        let span = |k: usize| family.limits[k][1] - family.limits[k][0];
        let (agreeing, mut least, mut theta) = self.agreeing(base, best.clone());
        if !least.is_finite() {
            return;
        }
        *best = agreeing;
        for _ in 0..STEPS {
            let moves = self.moves(base, best, &free, &slopes_of(self.dictionary, best, &theta, &free));
            // No further at once than a third of what a number can be.
            let furthest = free.iter().zip(&moves).map(|(k, by)| by.abs() / span(*k)).fold(0.0, f64::max);
            if !furthest.is_finite() {
                return;
            }
            let whole = (0.33 / furthest.max(1e-12)).min(1.0);
            let there = [1.0, 0.4, 0.12, 0.03].into_iter().find_map(|part| {
                let mut shape = best.shape.clone();
                for (k, by) in free.iter().zip(&moves) {
                    shape[*k] = (shape[*k] + part * whole * by).clamp(family.limits[*k][0], family.limits[*k][1]);
                }
                let candidate = Candidate::new(self.dictionary, &family, &shape, best.windows.as_ref());
                let (candidate, misfit, own) = if candidate.shows() { self.agreeing(base, candidate) } else { return None };
                (misfit < least).then_some((candidate, misfit, own))
            });
            let Some((candidate, misfit, own)) = there else { return };
            let done = least - misfit < ENOUGH;
            (*best, least, theta) = (candidate, misfit, own);
            if done {
                return;
            }
        }
    }

    /// A candidate of which the number that its coefficients tell agrees with them, as far as it can; with its misfit and coefficients.
    fn agreeing(&self, base: &Grams, candidate: Candidate) -> (Candidate, f64, Vec<f64>) {
        let family = candidate.family.clone();
        let (misfit, theta) = self.scorer.fitted(base, &candidate);
        let mut now = (candidate, misfit, theta);
        let Some((k, told)) = &family.told else { return now };
        let [low, high] = family.limits[*k];
        let off = |theta: &[f64], shape: &[f64]| told(theta).clamp(low, high) - shape[*k];
        let mut by = off(&now.2, &now.0.shape);
        let mut step = by;
        for _ in 0..AGREEING {
            let mut shape = now.0.shape.clone();
            shape[*k] = (shape[*k] + step).clamp(low, high);
            let done = shape[*k] - now.0.shape[*k];
            if by.abs() < AGREES || done == 0.0 {
                break;
            }
            let other = Candidate::new(self.dictionary, &family, &shape, now.0.windows.as_ref());
            let (misfit, theta) = self.scorer.fitted(base, &other);
            let its = off(&theta, &shape);
            // It went too far.
            if its.abs() >= by.abs() {
                step = 0.5 * done;
                continue;
            }
            // A secant; where the slope tells nothing, half of the way on.
            let slope = (its - by) / done;
            step = if slope < -1e-3 { -its / slope } else { 0.5 * its };
            (by, now) = (its, (other, misfit, theta));
        }
        now
    }

    /// Where the free numbers of a shape should go, of their slopes. One that stands at its limit and would go beyond stays, and the others
    /// go where they should without it.
    fn moves(&self, base: &Grams, best: &Candidate, free: &[usize], slopes: &[Column]) -> Vec<f64> {
        let grams = self.scorer.extended(base, &[&best.columns, slopes].concat());
        let fixed = grams.columns() - free.len();
        let beyond = |i: usize, by: f64| {
            let ([low, high], here) = (best.family.limits[free[i]], best.shape[free[i]]);
            (here <= low && by < 0.0) || (here >= high && by > 0.0)
        };
        let mut moving: Vec<usize> = (0..free.len()).collect();
        loop {
            let kept: Vec<usize> = (0..fixed).chain(moving.iter().map(|i| fixed + i)).collect();
            let by = self.scorer.fit(&grams.only(&kept)).coefficients.split_off(fixed);
            let (stay, go): (Vec<_>, Vec<_>) = moving.iter().copied().zip(by).partition(|(i, by)| beyond(*i, *by));
            if stay.is_empty() {
                let mut moves = vec![0.0; free.len()];
                for (i, by) in go {
                    moves[i] = by;
                }
                return moves;
            }
            moving = go.into_iter().map(|(i, _)| i).collect();
        }
    }

    /// Shapes whose numbers depend on each other, refined from several starts, where the claim may be the best: from one they stop at
    /// the next hill.
    pub(super) fn refined_often(&self, grams: &Grams, base: &Fit, all: &[Scored]) -> Vec<Scored> {
        let most = all.iter().map(|s| s.seen).fold(0.0, f64::max);
        let worth = |c: &Candidate| all.iter().any(|s| s.candidate.same_claim(c) && s.seen > (SEEN_OF_BEST * most).max(3.0));
        self.refined_starts(grams, base, &worth, None)
    }

    /// The same in the windows of the best claims, at their joints.
    pub(super) fn refined_often_in_windows(&self, grams: &Grams, base: &Fit, claims: &[Scored]) -> Vec<Scored> {
        let mut tried: Vec<&Candidate> = Vec::new();
        for Scored { candidate, .. } in claims.iter().take(MANY).filter(|s| s.score > self.thresholds.nats) {
            if candidate.windows.is_some() && !tried.iter().any(|other| other.shares_edge(candidate)) {
                tried.push(candidate);
            }
        }
        let found = |best: &&Candidate| {
            let there = |c: &Candidate| c.family.joints.first() == best.family.joints.first();
            self.refined_starts(grams, base, &there, best.windows.as_ref())
        };
        tried.iter().flat_map(found).collect()
    }

    /// Springs that are bent, where a memory comes or goes that is ahead of every other physics: its many numbers bend it as one, and there alone it is
    /// held against them.
    pub(super) fn bent_where_a_memory_is(&self, grams: &Grams, base: &Fit, claims: &[Scored]) -> Vec<Scored> {
        let is_memory = |s: &&Scored| !s.candidate.family.limits.is_empty();
        let next = claims.iter().filter(|s| !is_memory(s)).map(|s| s.score).fold(0.0, f64::max);
        let best = claims.iter().filter(is_memory).max_by(|a, b| a.score.total_cmp(&b.score));
        let Some(memory) = best.filter(|s| s.score - next >= AHEAD * self.thresholds.nats) else { return Vec::new() };
        let joints = &memory.candidate.family.joints;
        let Some(windows) = memory.candidate.windows.as_ref() else { return Vec::new() };
        let of_its_joint = self.candidates.iter().filter(|c| c.family.is_hardening() && c.family.joints == *joints);
        let there = of_its_joint.map(|c| c.within(self.problem, windows)).filter(Candidate::shows);
        let mut forms: Vec<Scored> = Vec::new();
        for scored in there.filter_map(|candidate| self.score(grams, base, &candidate)) {
            keep_better(&mut forms, &scored, Candidate::same_form, |s| s.score);
        }
        let _ = parallel::map(&mut forms, |scored| self.settle_shape(grams, base, scored));
        forms
    }

    fn refined_starts(
        &self,
        grams: &Grams,
        base: &Fit,
        worth: &dyn Fn(&Candidate) -> bool,
        windows: Option<&Windows>,
    ) -> Vec<Scored> {
        let candidates = self.candidates.iter().filter(|c| !c.family.limits.is_empty() && worth(c));
        let scored = parallel::map(candidates.collect::<Vec<_>>(), |c| {
            let candidate = c.when(self.problem, windows);
            if candidate.shows() { self.score(grams, base, &candidate) } else { None }
        });
        let mut starts: Vec<Scored> = scored.into_iter().flatten().collect();
        starts.sort_by(|a, b| b.seen.total_cmp(&a.seen));
        let mut kept: Vec<Scored> = Vec::new();
        for start in starts {
            if kept.iter().filter(|other| other.candidate.same_form(&start.candidate)).count() < MANY {
                kept.push(start);
            }
        }
        let _ = parallel::map(&mut kept, |scored| self.settle_shape(grams, base, scored));
        // With the stiffness of the simulation it is the same claim with a number less.
        kept.iter().filter(|scored| !simpler_is_enough(scored, &kept)).cloned().collect()
    }
}
