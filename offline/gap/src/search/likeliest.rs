//! Which of the claims that predict about alike is taken: the likeliest, which is mostly the simplest.

use super::Scored;
use crate::hypothesis::{Candidate, DRIFTS, HARDENING, UNMODELLED, rounds};
use crate::linear::dot;
use crate::robot::Robot;

/// Claims that hold another one and more, in these forms (all, where none is named), and the share of its score by which they
/// have to be better.
const HOLDS: [(&str, &[&str], &str, f64); 4] = [
    ("link_inertia", &["scaled", "free"], "payload", 0.03),
    (UNMODELLED, &HARDENING, "cable_stretch", 0.02),
    ("cable_hysteresis", &[], "cable_stretch", 0.015),
    // A drift that has come to its end before it is there is an offset; a cable that slips takes a moment to settle.
    ("thermal_drift", &DRIFTS, "joint_offset", 0.05),
];

/// The share by which a claim has to be better than one that it holds; none where it holds it not.
fn held(one: &Candidate, other: &Candidate, last_link: usize) -> Option<f64> {
    // A payload hangs on the last link, unless a site says otherwise.
    let place = |candidate: &Candidate| match candidate.family.joints.as_slice() {
        [] => vec![candidate.shape_of("link").map_or(last_link, |link| link as usize)],
        joints => joints.to_vec(),
    };
    let holds = |(larger, forms, smaller, _): &(&str, &[&str], &str, f64)| {
        (one.family.physics, other.family.physics) == (*larger, *smaller) && (forms.is_empty() || forms.contains(&one.family.form))
    };
    let (.., share) = HOLDS.into_iter().find(holds)?;
    (place(one) == place(other)).then_some(share)
}

/// Up to what the load is known by a loop may be a straight line: the share of an effect by which it has to differ from that, and the share of its
/// score that the line may then be behind. Of a load that a simulation without this effect gives, and of one that a robot's own numbers give.
const BY_SIMULATION: [f64; 2] = [0.03, 0.025];
const BY_OWN_NUMBERS: [f64; 2] = [0.1, 0.3];

/// Is a loop that the best claim says, but for this share of it, the straight line that the other one says?
fn is_straight(best: &Scored, line: &Scored, but_for: f64) -> bool {
    let physics = |scored: &Scored| scored.candidate.family.physics;
    if (physics(best), physics(line)) != ("cable_hysteresis", "cable_stretch") || best.candidate.windows != line.candidate.windows {
        return false;
    }
    let effect = |scored: &Scored, cell: usize| scored.candidate.effect(cell, &scored.coefficients);
    line.candidate.columns.iter().flat_map(|column| &column.parts).all(|(cell, _)| {
        let (loops, straight) = (effect(best, *cell), effect(line, *cell));
        let overlap = dot(&loops, &straight).powi(2) / (dot(&loops, &loops) * dot(&straight, &straight)).max(1e-300);
        loops.len() == straight.len() && overlap > 1.0 - but_for * but_for
    })
}

/// Brings the likeliest of those that are about as good as the best to the front, which is mostly the simplest.
pub(super) fn likeliest_first(claims: &mut [Scored], equal: f64, robot: &Robot) {
    let last_link = robot.joint_count() - 1;
    let Some(best) = claims.first() else { return };
    let good = |best: &Scored, claim: &Scored| {
        let held = held(&best.candidate, &claim.candidate, last_link);
        let [but_for, behind] = if robot.simulates_itself { BY_OWN_NUMBERS } else { BY_SIMULATION };
        let share = if held.is_some() && is_straight(best, claim, but_for) { behind } else { held.unwrap_or(equal) };
        claim.score >= best.score - (share * best.score.abs()).max(3.0)
    };
    let likeliest = (0..claims.len()).filter(|k| good(best, &claims[*k])).max_by(|a, b| {
        // A part of the best is as good as that, within what the best would have to be better by.
        let score =
            |k: usize| if held(&best.candidate, &claims[k].candidate, last_link).is_some() { best.score } else { claims[k].score };
        let of = |k: usize| likelihood(score(k), best.score, complexity(&claims[k].candidate) - complexity(&best.candidate));
        // Of equals the better one.
        of(*a).total_cmp(&of(*b)).then(b.cmp(a))
    });
    if let Some(k) = likeliest {
        claims[..=k].rotate_right(1);
    }
    // Of what was taken for simpler, the part may be enough.
    let part = claims.iter().position(|c| held(&claims[0].candidate, &c.candidate, last_link).is_some());
    if let Some(part) = part.filter(|part| good(&claims[0], &claims[*part])) {
        claims[..=part].rotate_right(1);
    }
    of_two_memories(claims);
}

/// Brings a hysteresis to the front before a creep of the same cable that is not better by what it has to be.
fn of_two_memories(claims: &mut [Scored]) {
    let Some(first) = claims.first() else { return };
    let behind = |other: &Scored| (first.score - other.score) / score_scale(first.score);
    let as_well = |other: &Scored| creeps_beside(&first.candidate, &other.candidate) && behind(other) < CREEP_IS_BETTER_BY;
    if let Some(other) = claims.iter().position(as_well) {
        claims[..=other].rotate_right(1);
    }
}

/// What each number that a claim fits takes off the logarithm of its likelihood: of claims that predict alike the simplest was right so much
/// more often (docs/proof.md, stated and observed probability).
const PER_NUMBER: f64 = 1.5;

/// By how much scores differ, nats, whose claims differ by one in the logarithm of their likelihood, near the best score: structural error
/// makes the scale of the scores a share of them.
pub(crate) fn score_scale(best: f64) -> f64 {
    (0.01 * best).max(2.0)
}

/// What a claim may be behind the best and is confused with it, nats.
pub(crate) fn confused(best: f64) -> f64 {
    (0.01 * best).max(3.0)
}

/// Logarithm of how likely a claim of some score is beside another that fits so many numbers less.
pub(crate) fn likelihood(score: f64, beside: f64, more: f64) -> f64 {
    (score - beside) / score_scale(beside) - PER_NUMBER * more
}

/// What a creep has to be better by than a hysteresis, as likelihoods count scores, though that fits more numbers: of 260 opened cases of either, 12 of 14
/// were hysteresis where the creep was ahead by less, and 103 of 108 where it was behind. By their numbers alone a creep would be likelier a hundred times.
const CREEP_IS_BETTER_BY: f64 = 0.4;

/// Are they a creep and a hysteresis of the same cable?
fn creeps_beside(creep: &Candidate, other: &Candidate) -> bool {
    let named = |candidate: &Candidate, physics: &str| candidate.family.physics == physics;
    named(creep, "cable_creep") && named(other, "cable_hysteresis") && creep.family.joints == other.family.joints
}

/// So many numbers more a claim fits than another one, as likelihoods count them. Of a cable's two memories neither is the simpler.
pub(crate) fn numbers_beyond(one: &Candidate, other: &Candidate) -> f64 {
    let by = CREEP_IS_BETTER_BY / PER_NUMBER;
    match (creeps_beside(one, other), creeps_beside(other, one)) {
        (true, _) => by,
        (_, true) => -by,
        _ => complexity(one) - complexity(other),
    }
}

/// Numbers that a candidate fits, and between equals what is less usual.
pub(super) fn complexity(candidate: &Candidate) -> f64 {
    let shape = candidate.family.steps.iter().filter(|step| step.is_some()).count();
    // What rounds a sign is not a claim of its own.
    let rounding = candidate.family.shape.iter().filter(|name| rounds(name)).count();
    let sizes = if candidate.family.physics == "frame_misalignment" { OF_A_FRAME } else { candidate.columns.len() };
    (sizes + shape - rounding + candidate.edges()) as f64 + 0.1 * candidate.family.penalty_nats
}

/// A frame that is off is turned and moved at once: two choices, not six. Of 264 opened cases of one or of a link's geometry that stood first with
/// the other two nats of likelihood behind or before it, a fourth were frames; by six numbers it would be one in two thousand.
const OF_A_FRAME: usize = 2;

/// Share of a claim's score by which a form of more numbers has to be better than a simpler one.
const SAME_FORM: f64 = 0.01;

/// Is there a form of the same claim that fits fewer numbers and does as well?
pub(super) fn simpler_is_enough<'s>(form: &Scored, all: impl IntoIterator<Item = &'s Scored>) -> bool {
    all.into_iter().any(|other| {
        other.candidate.same_claim(&form.candidate)
            && complexity(&other.candidate) < complexity(&form.candidate)
            && other.score >= (1.0 - SAME_FORM) * form.score
    })
}
