//! Shapes between the points of the grid: a pattern search, one number after the other.

use std::sync::Arc;

use crate::hypothesis::{Candidate, Dictionary, Family, Valley};
use crate::parallel;

/// Halvings of a step before a number is settled, and of those that are known sharply.
const HALVINGS: usize = 7;
const SHARP_HALVINGS: usize = 12;
/// Times that secants are drawn to the last coefficients.
const SECANTS: usize = 4;
/// First step of an edge, of its time.
const EDGE_S: f64 = 0.1;
/// Rounds over all numbers of a shape, at most, and over those of which one makes up for another.
const ROUNDS: usize = 6;
const SHARP_ROUNDS: usize = 10;
const LONG_ROUNDS: usize = 12;
/// How often choices are made anew.
const CHOICES: usize = 4;

/// Every family at every point of its grid.
pub fn starts(dictionary: &Dictionary, families: &[Arc<Family>]) -> Vec<Candidate> {
    let points: Vec<(&Arc<Family>, &Vec<f64>)> =
        families.iter().flat_map(|family| family.grid.iter().map(move |shape| (family, shape))).collect();
    let mut all = parallel::map(points, |(family, shape)| Candidate::new(dictionary, family, shape, None));
    all.retain(Candidate::shows);
    all
}

/// Misfit of a candidate and its coefficients; infinite where they may not be.
pub type Fitted<'a> = dyn Fn(&Candidate) -> (f64, Vec<f64>) + Sync + 'a;

/// The candidate with its refinable numbers, and the edges of its windows, moved to where the misfit is least, and with the choice
/// that is best then.
pub fn refined(dictionary: &Dictionary, start: &Candidate, fitted: &Fitted) -> Candidate {
    let mut best = settled(dictionary, start, fitted);
    if start.family.choices.is_empty() {
        return best;
    }
    let mut least = fitted(&best).0;
    // Each begins where the other came to rest.
    for _ in 0..CHOICES {
        let others = chosen_otherwise(dictionary, &best, fitted).into_iter().map(|other| (fitted(&other).0, other));
        match others.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((misfit, other)) if misfit < least => (least, best) = (misfit, other),
            _ => break,
        }
    }
    best
}

/// A settled candidate with each other choice that its family has, settled again.
pub fn chosen_otherwise(dictionary: &Dictionary, of: &Candidate, fitted: &Fitted) -> Vec<Candidate> {
    let family = &of.family;
    let with = |k: usize, value: f64| {
        let mut shape = of.shape.clone();
        shape[k] = value;
        Candidate::new(dictionary, family, &shape, of.windows.as_ref())
    };
    let all = family.choices.iter().flat_map(|&k| family.other_choices(k, of.shape[k]).into_iter().map(move |value| (k, value)));
    let starts: Vec<Candidate> = all.map(|(k, value)| with(k, value)).filter(Candidate::shows).collect();
    parallel::map(starts, |start| settled(dictionary, &start, fitted))
}

/// The candidate with its refinable numbers, and the edges of its windows, moved to where the misfit is least.
fn settled(dictionary: &Dictionary, start: &Candidate, fitted: &Fitted) -> Candidate {
    let misfit = &|candidate: &Candidate| fitted(candidate).0;
    let family = &start.family;
    let mut best = start.clone();
    let mut least = misfit(&best);
    if family.secant {
        for _ in 0..SECANTS {
            let shape = fitted(&best).1[..family.shape.len()].to_vec();
            best = Candidate::new(dictionary, family, &shape, best.windows.as_ref());
        }
        least = misfit(&best);
    }
    let free: Vec<usize> = (0..family.shape.len()).filter(|k| family.steps[*k].is_some()).collect();
    let (rounds, halvings) = match family.valley {
        Valley::Sharp => (SHARP_ROUNDS, SHARP_HALVINGS),
        Valley::Long => (LONG_ROUNDS, HALVINGS),
        Valley::Plain if free.len() + best.edges() > 1 => (ROUNDS, HALVINGS),
        Valley::Plain => (1, HALVINGS),
    };
    for _ in 0..rounds {
        let before = least;
        for &k in &free {
            // In a long valley each round begins with the steps of the first: from where a number came to rest, the grid may be next to nothing away.
            let from = if family.valley == Valley::Long { start.shape[k] } else { best.shape[k] };
            let mut step = family.steps[k].filter(|step| step.is_finite()).unwrap_or_else(|| 0.5 * spacing(family, k, from));
            for _ in 0..halvings {
                let here = best.shape[k];
                let with = |there: f64| {
                    // A positive number of a grid stays one.
                    if family.steps[k].is_some_and(f64::is_nan) && here > 0.0 && there <= 0.0 {
                        return None;
                    }
                    let mut shape = best.shape.clone();
                    shape[k] = there;
                    if let Some(carry) = &family.carry {
                        carry(&best.shape, &mut shape);
                    }
                    tried(Candidate::new(dictionary, family, &shape, best.windows.as_ref()), misfit)
                };
                let (less, more) = parallel::both(|| with(here - step), || with(here + step));
                [less, more].into_iter().flatten().for_each(|one| take_better(one, &mut best, &mut least));
                step *= 0.5;
            }
        }
        edges_moved(dictionary, &mut best, &mut least, misfit);
        if least >= before {
            break;
        }
    }
    best
}

/// The edges of windows moved to where the misfit is least.
pub fn edges_moved(dictionary: &Dictionary, best: &mut Candidate, least: &mut f64, misfit: &dyn Fn(&Candidate) -> f64) {
    // The shape stays, and what it costs to make is paid once.
    let mut whole: Option<Candidate> = None;
    let Some(windows) = best.windows.clone() else { return };
    for (place, edge) in windows.edges() {
        let whole = whole.get_or_insert_with(|| Candidate::new(dictionary, &best.family, &best.shape, None));
        let mut step = EDGE_S * windows.all()[place][edge].clamp(1.0, 8.0);
        for _ in 0..HALVINGS + 2 {
            for sign in [-1.0, 1.0] {
                let Some(moved) = best.windows.as_ref().map(|windows| windows.moved((place, edge), sign * step)) else { return };
                let there = moved.all()[place];
                if there[0] < there[1]
                    && there[edge] > 0.0
                    && let Some(one) = tried(whole.within(dictionary.problem, &moved), misfit)
                {
                    take_better(one, best, least);
                }
            }
            step *= 0.5;
        }
    }
}

/// A candidate with its misfit; none where it shows nowhere.
fn tried(candidate: Candidate, misfit: &dyn Fn(&Candidate) -> f64) -> Option<(Candidate, f64)> {
    candidate.shows().then(|| misfit(&candidate)).map(|value| (candidate, value))
}

fn take_better((candidate, value): (Candidate, f64), best: &mut Candidate, least: &mut f64) {
    if value < *least {
        (*best, *least) = (candidate, value);
    }
}

/// Distance to the nearest other value of the grid.
fn spacing(family: &Family, k: usize, here: f64) -> f64 {
    let nearest =
        family.grid.iter().map(|point| (point[k] - here).abs()).filter(|d| *d > 1e-12 * here.abs()).fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { nearest } else { 0.5 * here.abs().max(1e-6) }
}
