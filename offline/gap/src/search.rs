//! Which candidates explain the residuals: forward, swap, drop (gap-design.md, section 7).

use crate::hypothesis::{Candidate, Dictionary, library};
use crate::noise::Noise;
use crate::problem::{Channel, Problem};
use crate::score::{Fit, Gain, Grams, Scorer, within_bounds};

/// What decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Least gain of an effect, nats.
    pub nats: f64,
    /// Least share of the remaining squared error of its best cell that a further effect has to remove.
    pub share: f64,
    /// Most effects.
    pub effects: usize,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { nats: 12.0, share: 0.1, effects: 4 }
    }
}

/// A candidate with what it gains beside the others chosen.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Candidate,
    /// Over the set without it.
    pub gain: Gain,
    /// Coefficients of its columns.
    pub coefficients: Vec<f64>,
}

/// An effect that was accepted, and its rivals.
#[derive(Debug, Clone)]
pub struct Effect {
    /// What was accepted.
    pub chosen: Scored,
    /// The best of every other claim in its place, best first.
    pub rivals: Vec<Scored>,
}

/// The search's answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// In the order of acceptance.
    pub effects: Vec<Effect>,
    /// Fit of all of them together.
    pub fit: Fit,
    /// Fit of none.
    pub none: Fit,
    /// The best that was not accepted.
    pub next: Option<Scored>,
    /// Noise of each cell, by the last model.
    pub noise: Vec<Noise>,
}

/// Measurement noise of every cell: white at the sensor, coloured by the window.
fn window_noise(problem: &Problem) -> Vec<Noise> {
    let motion = &problem.pairs[0].real;
    let step = motion.rows.get(1).map_or(1, |second| second - motion.rows[0]);
    let behind = motion.window.autocovariance(step, 3);
    problem
        .cells
        .iter()
        .map(|cell| {
            if cell.channel == Channel::EndEffector { Noise::default() } else { Noise::from_autocovariance(&behind, cell.rows.len()) }
        })
        .collect()
}

/// Searches.
pub fn search(problem: &Problem, thresholds: &Thresholds, trace: &mut dyn FnMut(String)) -> Answer {
    let dictionary = Dictionary::new(problem);
    let candidates = library(&dictionary);
    let noise = window_noise(problem);
    let mut scorer = Scorer::new(problem, noise.clone());
    let empty = scorer.empty();
    let none = scorer.fit(&empty);
    let mut chosen: Vec<Scored> = Vec::new();
    let mut rivals: Vec<Vec<Scored>> = Vec::new();
    let mut grams = empty.clone();
    let mut fit = none.clone();
    let mut next = None;
    while chosen.len() < thresholds.effects {
        scorer.temper(&grams, &fit);
        let ranked = rank(problem, &scorer, &candidates, &grams, &fit);
        let Some(best) = ranked.first().cloned() else { break };
        for scored in ranked.iter().take(8) {
            trace(describe(scored));
        }
        // Correlation that the model leaves makes fewer rows count.
        let better = scorer.extended(&grams, &best.candidate.columns);
        let with = scorer.fit(&better);
        scorer.temper(&better, &with);
        let best = Scored { gain: scorer.gain(&fit, &with), ..best };
        trace(describe(&best));
        let share = removed_share(&scorer, &grams, &fit, &best.candidate);
        trace(format!("  best removes {:.1} % of its cell", 100.0 * share));
        let needed = if chosen.is_empty() { 0.0 } else { thresholds.share };
        if best.gain.nats < thresholds.nats || best.gain.nats < 2.0 * best.gain.error || share < needed {
            next = Some(best);
            break;
        }
        (grams, fit) = (better, with);
        rivals.push(ranked.into_iter().skip(1).filter(|r| !r.candidate.same_claim(&best.candidate)).collect());
        chosen.push(best);
    }
    let effects = chosen.into_iter().zip(rivals).map(|(chosen, rivals)| Effect { chosen, rivals }).collect();
    Answer { effects, fit, none, next, noise }
}

/// The best form of every claim, best claim first.
fn rank(problem: &Problem, scorer: &Scorer, candidates: &[Candidate], grams: &Grams, base: &Fit) -> Vec<Scored> {
    let score = |candidate: &Candidate| -> Option<Scored> {
        let fit = scorer.fit(&scorer.extended(grams, &candidate.columns));
        let own = fit.coefficients[fit.coefficients.len() - candidate.columns.len()..].to_vec();
        within_bounds(candidate, &fit).then(|| Scored { candidate: candidate.clone(), gain: scorer.gain(base, &fit), coefficients: own })
    };
    let mut all = parallel(candidates, &score);
    all.sort_by(|a, b| b.gain.nats.total_cmp(&a.gain.nats));
    // Effects that begin on the way: the best claims again, with an onset.
    let begun: Vec<Candidate> = distinct(&all)
        .into_iter()
        .take(12)
        .filter(|s| s.gain.nats > 3.0)
        .flat_map(|s| {
            let shortest = problem.pairs.iter().map(|p| p.real.run.len() as f64 * p.real.run.dt_s).fold(f64::INFINITY, f64::min);
            (1..20).map(move |k| (s.clone(), shortest * f64::from(k) / 20.0))
        })
        .map(|(s, onset)| {
            let mut candidate = s.candidate.clone();
            candidate.onset_s = Some(onset);
            for column in &mut candidate.columns {
                *column = column.begun_at(problem, onset);
            }
            candidate
        })
        .collect();
    let begun = parallel(&begun, &score);
    // An onset has to pay for being searched.
    all.extend(begun.into_iter().map(|mut s| {
        s.gain.nats -= 6.0;
        s
    }));
    all.sort_by(|a, b| b.gain.nats.total_cmp(&a.gain.nats));
    distinct(&all)
}

/// The first of every claim.
fn distinct(sorted: &[Scored]) -> Vec<Scored> {
    let mut out: Vec<Scored> = Vec::new();
    for scored in sorted {
        if !out.iter().any(|o| o.candidate.same_claim(&scored.candidate)) {
            out.push(scored.clone());
        }
    }
    out
}

fn parallel(candidates: &[Candidate], score: &(dyn Fn(&Candidate) -> Option<Scored> + Sync)) -> Vec<Scored> {
    let half = candidates.len() / 2;
    let (left, right) = candidates.split_at(half);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| right.iter().filter_map(score).collect::<Vec<_>>());
        let mut all: Vec<Scored> = left.iter().filter_map(score).collect();
        all.extend(other.join().expect("no panic in scoring"));
        all
    })
}

/// Largest share of a cell's remaining squared error that a candidate removes.
fn removed_share(scorer: &Scorer, grams: &Grams, base: &Fit, candidate: &Candidate) -> f64 {
    let fit = scorer.fit(&scorer.extended(grams, &candidate.columns));
    let sum = |fit: &Fit, c: usize| fit.held_out[c].iter().sum::<f64>();
    (0..base.held_out.len()).map(|c| 1.0 - sum(&fit, c) / sum(base, c).max(1e-300)).fold(0.0, f64::max)
}

/// One line of a trace.
pub fn describe(scored: &Scored) -> String {
    let c = &scored.candidate;
    format!(
        "  {:9.1} ± {:5.1}  {} {:?} ({}) {:?} onset {:?} θ {:.4?}",
        scored.gain.nats,
        scored.gain.error,
        c.physics,
        c.joints.iter().map(|j| j + 1).collect::<Vec<_>>(),
        c.form,
        c.shape,
        c.onset_s,
        scored.coefficients
    )
}
