//! The best form of every claim, beside the effects that were taken.

use super::likeliest::{likeliest_first, simpler_is_enough};
use super::{Scored, Search, price};
use crate::hypothesis::{
    Candidate, Family, IN_THE_PLANE, OUT_OF_PLANE, Part, RIPPLE, are_parts, may_fade, part, rounds, rub_together,
};
use crate::parallel;
use crate::robot::Robot;
use crate::score::{Fit, Gain, Grams, Scorer, within_bounds};

/// Claims that are tried in windows.
const CLAIMS_IN_WINDOWS: usize = 14;

/// Forms that are tried in the window of the best claim, between the grid's points: their number, and the share of its score.
const FORMS_IN_WINDOW: usize = 8;
const NEAR_IN_WINDOW: f64 = 0.5;

/// Share of the best claim's score from which on a rival begins again with its rounding.
const ROUNDED: f64 = 0.2;

/// Claims are close whose score is this share of the best, and as many are looked at again.
const CLOSE: f64 = 0.9;
const MOST_CLOSE: usize = 5;

impl Search<'_, '_> {
    /// The best form of every claim beside the others, best claim first. Claims are ordered by how much of the error they
    /// explain; the scale is that of the first one's significance.
    pub(super) fn rank(&mut self, others: &[Candidate]) -> Vec<Scored> {
        let grams = &self.grams(others, None);
        let base = self.scorer.fit(grams);
        self.scorer.untempered();
        let mut all = best_claims(self.candidates.len(), &|k| {
            let candidate = &self.candidates[k];
            if may_fade(candidate, others) { self.score_of_start(grams, &base, candidate) } else { None }
        });
        // Effects that begin or end on the way: the claims that do something, again, in windows.
        let windows = self.windows(grams, &base);
        all.sort_by(|a, b| b.seen.total_cmp(&a.seen));
        let mut worth: Vec<Scored> = distinct(&all).into_iter().take(CLAIMS_IN_WINDOWS).filter(|s| s.seen > 3.0).collect();
        let refined = self.refined_often(grams, &base, &all);
        all.retain(|scored| self.is_borne_out(grams, scored));
        all.extend(refined);
        sort(&mut all);
        let mut claims = distinct(&all);
        for scored in claims.iter().take(CLAIMS_IN_WINDOWS).filter(|s| s.gain.nats > 3.0) {
            if !worth.iter().any(|other| other.candidate.same_start(&scored.candidate)) {
                worth.push(scored.clone());
            }
        }
        worth.retain(|s| s.candidate.family.comes_and_goes());
        claims.extend(best_claims(worth.len() * windows.len(), &|k| {
            let candidate = worth[k / windows.len()].candidate.within(self.problem, &windows[k % windows.len()]);
            if candidate.shows() { self.score(grams, &base, &candidate) } else { None }
        }));
        sort(&mut claims);
        let mut claims = distinct(&claims);
        // Between the grid's points, for those that may win; an edge that is off costs what is right more than what bends.
        let best = claims.first().map_or(0.0, |s| s.score);
        let worth = claims.iter_mut().enumerate().filter(|(k, s)| *k < if s.candidate.edges() > 0 { 12 } else { 6 });
        let worth: Vec<_> = worth.filter(|(_, s)| s.score > 3.0 && s.score > 0.1 * best).collect();
        let _ = parallel::map(worth, |(_, scored)| {
            self.run_by_run(grams, &base, scored);
            self.settle_shape(grams, &base, scored);
            self.in_the_plane(grams, &base, scored);
        });
        sort(&mut claims);
        self.round_alike(grams, &base, &mut claims, others);
        // What an edge that is not quite sharp, or not quite there, leaves of one effect is not another one, but for the other part of what rubs.
        // And of one joint's dry friction there is one level, and what ripples in a drive shakes its cable.
        let robot = self.problem.robot;
        let of = |other: &Candidate, s: &Candidate| {
            (other.shares_edge(s) && !are_parts(other, s)) || levels_twice(other, s) || ripples_alike(other, s, robot)
        };
        let rest = |s: &Scored| others.iter().any(|other| of(other, &s.candidate));
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        claims.extend(self.in_the_window_of_the_first(&claims, grams, &base, others));
        claims.extend(self.refined_often_in_windows(grams, &base, &claims));
        claims.retain(|s| !rest(s));
        claims.extend(self.bent_where_a_memory_is(grams, &base, &claims));
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        let mut claims = distinct(&claims);
        // One that was found in the window only may turn round otherwise than what stood first before.
        self.round_alike(grams, &base, &mut claims, others);
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        // Rivals are told apart by the rows that count once the best of them is in: what it leaves is its model's error, and
        // that is not independent from row to row.
        if let Some(best) = claims.first().filter(|best| best.gain.nats > 0.0) {
            let with = self.scorer.extended(grams, &best.candidate.columns);
            let after = self.scorer.fit(&with);
            self.scorer.temper(&with, &after);
            let scale = (self.scorer.gain(&base, &after).nats.max(0.0) / best.gain.nats).min(1.0);
            self.scorer.untempered();
            for scored in &mut claims {
                let Gain { nats, error, least, explained, ranks } = scored.gain;
                scored.gain = Gain { nats: scale * nats, error: scale * error, least: scale * least, explained, ranks };
                scored.score = scored.gain.nats - price(&scored.candidate);
            }
        }
        sort(&mut claims);
        self.told_apart(others, &mut claims);
        likeliest_first(&mut claims, self.thresholds.equal, self.problem.robot);
        claims
    }

    /// Of gravity that leaves the plane of all joints, a turn in it, if that does as well once it is refined.
    fn in_the_plane(&self, grams: &Grams, base: &Fit, scored: &mut Scored) {
        if scored.candidate.family.form != OUT_OF_PLANE {
            return;
        }
        let Some(start) = self.candidates.iter().find(|c| c.family.form == IN_THE_PLANE) else { return };
        let start = start.when(self.problem, scored.candidate.windows.as_ref());
        let Some(mut plain) = self.score(grams, base, &start) else { return };
        self.settle_shape(grams, base, &mut plain);
        if simpler_is_enough(scored, [&plain]) || plain.score >= scored.score - NO_BETTER {
            *scored = plain;
        }
    }

    /// Everything once more in the window that was found with the best claim: the grid of windows takes each claim in the form
    /// that fits the whole of the runs best, and some are not tried in windows of their own.
    fn in_the_window_of_the_first(&self, claims: &[Scored], grams: &Grams, base: &Fit, others: &[Candidate]) -> Vec<Scored> {
        let best = claims.first().filter(|best| best.score > self.thresholds.nats);
        let Some((best, windows)) = best.and_then(|best| Some((best, best.candidate.windows.clone()?))) else { return Vec::new() };
        let mut forms = best_of(self.candidates.len(), Candidate::same_form, &|k| {
            let candidate = self.candidates[k].within(self.problem, &windows);
            if candidate.shows() && candidate.family.may_have_edges() && may_fade(&candidate, others) {
                self.score(grams, base, &candidate)
            } else {
                None
            }
        });
        sort(&mut forms);
        let mut forms = distinct_by(&forms, Candidate::same_form);
        forms.retain(|s| s.score > NEAR_IN_WINDOW * best.score);
        forms.truncate(FORMS_IN_WINDOW);
        let _ = parallel::map(&mut forms, |scored| self.settle_shape(grams, base, scored));
        forms.iter().filter(|form| !simpler_is_enough(form, claims.iter().chain(&forms))).cloned().collect()
    }

    /// How a sign turns round belongs to the joint and not to the law: rivals of the best claim, which round otherwise and do worse, begin
    /// again from its numbers. A search over one more number than it has starts seldom finds them.
    fn round_alike(&self, grams: &Grams, base: &Fit, claims: &mut [Scored], others: &[Candidate]) {
        let Some((Scored { candidate: own, score: best, .. }, rivals)) = claims.split_first_mut() else { return };
        let rounding: Vec<(&str, f64)> =
            own.family.shape.iter().copied().zip(own.shape.iter().copied()).filter(|(name, _)| rounds(name)).collect();
        if rounding.is_empty() {
            return;
        }
        let least = (ROUNDED * *best).max(3.0);
        let alike = |family: &Family| {
            family.joints == own.family.joints
                && family.side() == own.family.side()
                && rounding.iter().all(|(name, _)| family.shape.contains(name))
        };
        let again = |rival: &mut Scored| {
            let mut starts: Vec<Candidate> = Vec::new();
            let is_alike =
                |start: &&Candidate| start.same_claim(&rival.candidate) && alike(&start.family) && may_fade(start, others);
            for start in self.candidates.iter().filter(is_alike) {
                let mut shape = start.shape.clone();
                for (name, value) in &rounding {
                    if let Some(k) = start.family.shape.iter().position(|own| own == name) {
                        shape[k] = *value;
                    }
                }
                // Many starts differ in nothing but the rounding.
                if !starts.iter().any(|other| other.same_form(start) && other.shape == shape) {
                    starts.push(Candidate::new(self.dictionary, &start.family, &shape, rival.candidate.windows.as_ref()));
                }
            }
            let scored = starts.iter().filter(|start| start.shows()).filter_map(|start| self.score(grams, base, start));
            let Some(mut again) = scored.max_by(|a, b| a.score.total_cmp(&b.score)) else { return };
            self.settle_shape(grams, base, &mut again);
            if again.score > rival.score {
                *rival = again;
            }
        };
        let _ = parallel::map(rivals.iter_mut().filter(|rival| rival.score > least), again);
    }

    /// Moves a candidate between the grid's points, where that is better.
    pub(super) fn settle_shape(&self, grams: &Grams, base: &Fit, scored: &mut Scored) {
        let candidate = self.refined(grams, &scored.candidate);
        if let Some(better) = self.score(grams, base, &candidate)
            && better.score > scored.score
        {
            *scored = better;
        }
    }

    /// The first claims, where they are close to each other, in the order of their gain over the noise that the best of them
    /// leaves: what differs between close rivals is small, and drowns in the plain sum of squares.
    fn told_apart(&self, others: &[Candidate], claims: &mut [Scored]) {
        let Some(best) = claims.first().filter(|best| best.score > self.thresholds.nats) else { return };
        let close = claims.iter().take(MOST_CLOSE).take_while(|s| s.score >= CLOSE * best.score).count();
        if close < 2 {
            return;
        }
        let grams = |scorer: &Scorer, one: Option<&Candidate>| scorer.grams(others.iter().chain(one));
        let fit = self.scorer.fit(&grams(&self.scorer, Some(&best.candidate)));
        let scorer = Scorer::new(self.problem, self.noise_left(others, &best.candidate, &fit));
        let base = scorer.fit(&grams(&scorer, None));
        let over: Vec<f64> = parallel::map(&claims[..close], |s| {
            scorer.gain(&base, &scorer.fit(&grams(&scorer, Some(&s.candidate)))).nats - price(&s.candidate)
        });
        let most = over.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most <= 0.0 {
            return;
        }
        let score = best.score;
        for (claim, over) in claims[..close].iter_mut().zip(over) {
            claim.score = score * over / most;
        }
        sort(&mut claims[..close]);
    }

    /// Is a candidate as large as it has to be, and does its first part say no less than half of what the whole says?
    fn is_borne_out(&self, grams: &Grams, Scored { candidate, coefficients, .. }: &Scored) -> bool {
        if candidate.apart.is_empty() {
            return true;
        }
        let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.apart));
        let first = fit.coefficients[fit.coefficients.len() - candidate.apart.len()];
        coefficients[0].abs() >= candidate.family.least && first / coefficients[0] >= BORNE_OUT
    }

    pub(super) fn score(&self, grams: &Grams, base: &Fit, candidate: &Candidate) -> Option<Scored> {
        self.score_of_start(grams, base, candidate).filter(|scored| self.is_borne_out(grams, scored))
    }

    /// The same of what may be more in a window, and is not held to what it has to be there.
    fn score_of_start(&self, grams: &Grams, base: &Fit, candidate: &Candidate) -> Option<Scored> {
        let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.columns));
        let coefficients = fit.coefficients[fit.coefficients.len() - candidate.columns.len()..].to_vec();
        let gain = self.scorer.gain(base, &fit);
        within_bounds(candidate, &fit).then(|| Scored {
            candidate: candidate.clone(),
            gain,
            score: gain.nats - price(candidate),
            seen: self.scorer.misfit(base) - self.scorer.misfit(&fit) - price(candidate),
            coefficients,
        })
    }
}

/// What a turn out of the plane has to be better by than one in it, nats.
const NO_BETTER: f64 = 3.0;

/// How much of what a whole says its first part has to say at least beside the others, which may pull the whole the other way.
const BORNE_OUT: f64 = 0.5;

/// Cosine between two effects from which on they are one: what a load does that varies by a seventh at most is a level.
const ONE: f64 = 0.99;

/// Do both have a level of dry friction at the same joint and time? Only their sum is seen. A load that hardly changes makes one as well: a joint that
/// slides upright was told 287 N of dry friction, and nearly as much less by its weight.
fn levels_twice(one: &Candidate, other: &Candidate) -> bool {
    if !rub_together(one, other) || [one, other].iter().any(|own| part(own) != Some(Part::Dry)) {
        return false;
    }
    (one.has_level() && other.has_level()) || cosine(one, other).abs() > ONE
}

/// Cosine between the first columns of two candidates.
fn cosine(one: &Candidate, other: &Candidate) -> f64 {
    let (a, b) = (&one.columns[0], &other.columns[0]);
    a.dot(b) / (a.dot(a) * b.dot(b)).sqrt().max(1e-300)
}

/// Difference of two periods that are one, of either.
const ALIKE: f64 = 0.03;

/// Does a motor ripple as often as a pulley of its joint is out of true?
fn ripples_alike(ripple: &Candidate, pulley: &Candidate, robot: &Robot) -> bool {
    let (one, other) = (&ripple.family, &pulley.family);
    if (one.physics, other.physics) != (RIPPLE, "pulley_eccentricity") || one.joints != other.joints {
        return false;
    }
    let turn = 2.0 * std::f64::consts::PI / robot.motor_from_joint[(one.joints[0], one.joints[0])].abs();
    let Some((order, period)) = ripple.shape_of("order").zip(pulley.shape_of("period")) else { return false };
    (turn / order - period).abs() < ALIKE * period
}

fn sort(all: &mut [Scored]) {
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// The first of every claim.
fn distinct(sorted: &[Scored]) -> Vec<Scored> {
    distinct_by(sorted, Candidate::same_claim)
}

fn distinct_by(sorted: &[Scored], same: fn(&Candidate, &Candidate) -> bool) -> Vec<Scored> {
    let mut out: Vec<Scored> = Vec::new();
    for scored in sorted {
        if !out.iter().any(|o| same(&o.candidate, &scored.candidate)) {
            out.push(scored.clone());
        }
    }
    out
}

/// The best of every claim among so many candidates, by score and by what is seen; the first of equals. What loses is dropped
/// at once: with its columns it would take as much memory as the whole library.
fn best_claims(count: usize, score: &(dyn Fn(usize) -> Option<Scored> + Sync)) -> Vec<Scored> {
    best_of(count, Candidate::same_claim, score)
}

/// Candidates that are scored by one core before it takes others.
const PART: usize = 32;

/// The same of every kind of candidate: of those that are the same.
fn best_of(
    count: usize,
    same: fn(&Candidate, &Candidate) -> bool,
    score: &(dyn Fn(usize) -> Option<Scored> + Sync),
) -> Vec<Scored> {
    let best = |of: &mut dyn Iterator<Item = Scored>| {
        let (mut by_score, mut by_seen) = (Vec::new(), Vec::new());
        for scored in of {
            keep_better(&mut by_score, &scored, same, |s| s.score);
            keep_better(&mut by_seen, &scored, same, |s| s.seen);
        }
        by_score.extend(by_seen);
        by_score
    };
    // Those of either half stay: where the best one is not borne out another may be.
    let half = |range: std::ops::Range<usize>| {
        let parts = range.clone().step_by(PART).map(|from| from..(from + PART).min(range.end));
        let of_parts = parallel::map(parts, |part| best(&mut part.filter_map(score)));
        best(&mut of_parts.into_iter().flatten())
    };
    [half(0..count / 2), half(count / 2..count)].concat()
}

/// Takes a candidate in place of the one that says the same, if it is better.
pub(super) fn keep_better(
    all: &mut Vec<Scored>,
    scored: &Scored,
    same: fn(&Candidate, &Candidate) -> bool,
    value: impl Fn(&Scored) -> f64,
) {
    match all.iter_mut().find(|other| same(&other.candidate, &scored.candidate)) {
        Some(other) if value(scored) > value(other) => *other = scored.clone(),
        Some(_) => {}
        None => all.push(scored.clone()),
    }
}
