//! Friction on the motor's or the link's side, and friction that fades with heat.

use std::sync::Arc;

use super::dictionary::{Dictionary, size, times};
use super::signs::{Place, Sign, Turn};
use super::{Bound, Candidate, Family, Valley, product};
use crate::cell::Channel;
use crate::held_out::Sized;

/// Travel over which friction turns round, as shares of a joint's usual travel. Below break-away a bristle keeps its force, which
/// a rigid sign does not: a joint at rest holds what it came with.
const PRESLIDING: [f64; 3] = [0.0005, 0.003, 0.015];
/// Speeds over which the sign of the velocity turns, as shares of the RMS speed.
pub(super) const SIGN_SPEED: [f64; 3] = [0.003, 0.02, 0.1];
/// The largest, likewise: what turns over the usual speed is viscous friction as well, and stands in the way of either.
const SIGN_SPEED_MOST: f64 = 0.3;
/// Least Stribeck speed over the RMS speed: a narrower curve is a spike at a standstill, whose height nothing tells.
const STRIBECK_LEAST: f64 = 0.01;
/// Speeds below which Stribeck friction rises, as shares of the RMS speed.
const STRIBECK_SPEED: [f64; 4] = [0.03, 0.1, 0.25, 0.6];
/// Exponents of the Stribeck curve to begin with.
const STRIBECK_EXPONENT: [f64; 2] = [1.0, 2.0];
/// Their range in the vocabulary: how a sign turns round is known to its form only, and a free exponent makes up for that, at the cost of the
/// force at rest.
pub(crate) const STRIBECK_RANGE: [f64; 2] = [0.5, 2.0];
/// Most that friction at rest exceeds sliding friction by, in terms of it, with what of it the simulation has: twice the vocabulary's range (f_s/f_c up to 2.5). A bristle's
/// curve at no speed at all fits the noise of standstills otherwise.
const STATIC_EXCESS: f64 = 3.0;
/// Share of the simulation's sliding friction that may be too much beside more of it at rest: a level that load or warmth makes up for fits with
/// less than none otherwise.
const LESS_SLIDING: f64 = 0.1;
/// First guess of the time in which a bristle settles, s.
const SETTLING_S: [f64; 1] = [0.004];
/// Time constants of heating, s.
pub(crate) const HEATING_S: [f64; 6] = [3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];
/// What warms up or creeps began so long before the recording, to begin with, s: a moment, since drives move before one records, or some
/// seconds. Taken for none it bends what follows, and time constants of a recording's length come out half as long.
pub(super) const BEFORE_S: [f64; 2] = [0.5, 4.0];
/// No longer, s, and time constants: what has been under way for long is hardly told from what was always there.
const BEFORE_MOST_S: f64 = 8.0;
const BEFORE_MOST: f64 = 0.5;
/// Its name in a shape.
pub(super) const BEFORE: &str = "before";

/// Its name in the vocabulary.
pub(crate) const BY_LOAD: &str = "load_dependent_friction";
pub(crate) const STRIBECK: &str = "stribeck_friction";
/// Forms of friction before a cable, and behind it: for any load, that of the links alone, and their weight.
pub(crate) const AT_MOTOR: [&str; 3] = ["motor side", "motor side, by its links", "motor side, by their weight"];
const AT_LINK: [&str; 3] = ["link side", "link side, by its links", "link side, by their weight"];

/// A load of a joint at the grid.
type LoadOf = fn(&Dictionary, usize) -> Vec<f64>;

/// What rubs at a joint has two parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// It goes with the direction.
    Dry,
    /// It goes with the speed.
    Viscous,
}

/// Which of them a candidate is.
pub(crate) fn part(candidate: &Candidate) -> Option<Part> {
    match candidate.family.physics {
        "viscous_friction" => Some(Part::Viscous),
        "coulomb_friction" | STRIBECK | BY_LOAD => Some(Part::Dry),
        _ => None,
    }
}

/// Edges of what rubs that are one, s: an edge of a small part beside a large one is known no better.
const ONE_EDGE_S: f64 = 0.6;

/// Do both rub at the same joint, and at the same time?
pub(crate) fn rub_together(one: &Candidate, other: &Candidate) -> bool {
    let both = part(one).is_some() && part(other).is_some();
    let at_once = match (&one.windows, &other.windows) {
        (None, None) => true,
        (Some(own), Some(its)) => own.coincide(its, ONE_EDGE_S),
        _ => false,
    };
    both && at_once && one.family.joints == other.family.joints
}

/// Friction that fades: the simulation's, or that which was found besides as well. How long it has been fading and how much there was then make up for one
/// another in the latter.
const FADES: &str = "friction fades";
const FOUND_FADES: &str = "friction fades, what was found as well";

/// Is dry friction, all the time, beside friction of its joint that fades?
pub(crate) fn levels_what_fades(level: &Candidate, fading: &Candidate) -> bool {
    [FADES, FOUND_FADES].contains(&fading.family.form)
        && part(level) == Some(Part::Dry)
        && level.has_level()
        && level.windows.is_none()
        && level.family.joints == fading.family.joints
}

/// Is a candidate the form of friction that fades which can be beside these?
pub(crate) fn may_fade(candidate: &Candidate, beside: &[Candidate]) -> bool {
    match candidate.family.form {
        FADES => !beside.iter().any(|level| levels_what_fades(level, candidate)),
        FOUND_FADES => beside.iter().any(|level| levels_what_fades(level, candidate)),
        _ => true,
    }
}

/// Does friction fade, or grow, by no more than there is of it: in the simulation, and found besides, with these coefficients?
pub(crate) fn fades_within(fading: Sized, of_simulation: f64, beside: &[Sized]) -> bool {
    let (own, theta) = fading;
    let found = beside.iter().filter(|(level, _)| levels_what_fades(level, own)).map(|(level, theta)| level.level_of(theta));
    own.family.form != FOUND_FADES || of_simulation <= 0.0 || theta[0].abs() <= of_simulation + found.sum::<f64>()
}

/// Are they the two parts of what rubs at a joint at one time?
pub(crate) fn are_parts(one: &Candidate, other: &Candidate) -> bool {
    rub_together(one, other) && part(one) != part(other)
}

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    if !dictionary.problem.has(Channel::JointTorque) {
        return;
    }
    for j in 0..dictionary.joints() {
        for (forms, at_link) in [(AT_MOTOR, false), (AT_LINK, true)] {
            // On the link's side it loads the cable too; seldom told apart, and mostly small there.
            let penalty = if at_link { 1.0 } else { 0.0 };
            let mut families = Vec::new();
            push_side(dictionary, j, forms, at_link, &mut families);
            all.extend(families.into_iter().map(|f| {
                let own = f.penalty_nats;
                f.penalised(own + penalty)
            }));
        }
    }
}

fn push_side(dictionary: &Dictionary, j: usize, forms: [&'static str; 3], at_link: bool, all: &mut Vec<Family>) {
    const TORQUE: Channel = Channel::JointTorque;
    let form = forms[0];
    let travels = presliding(dictionary, j);
    // Before the cable it turns with the drive, which other joints' cables may move too, behind it with the joint.
    let velocity = move |d: &Dictionary| {
        d.at_grid(|r, i, _| {
            let motion = &d.problem.pairs[r].real;
            if at_link { motion.velocity[j][i] } else { motion.drive_velocity[j][i] }
        })
    };
    let speed = size(&velocity(dictionary)).max(1e-9);
    let place = Place { joint: j, at_link, widest: SIGN_SPEED_MOST * speed };
    // What the pulleys carry: all of the cable's load, or what the links ask for in their motion, or to be held; a law is mostly written for one
    // of the latter.
    let mut loads: Vec<(&'static str, LoadOf, f64)> = vec![(form, |d, j| d.load(j), 0.0)];
    if dictionary.problem.nominal.link_friction[j] != [0.0; 2] {
        loads.push((forms[1], |d, j| d.links_alone(j, false), 1.0));
    }
    if size(&dictionary.links_alone(j, true)) > 1e-9 {
        loads.push((forms[2], |d, j| d.links_alone(j, true), 1.0));
    }
    let by_load = move |d: &Dictionary, sign: &[f64], of: LoadOf| {
        let load: Vec<f64> = of(d, j).iter().map(|l| l.abs()).collect();
        d.effort_of(j, times(sign, &load), at_link)
    };
    let positive = Bound::Positive;
    let slowest = SIGN_SPEED.map(|share| share * speed);
    let speeds = (&[("v_eps", true)][..], product(&[&slowest]), Turn::BySpeed);
    let bristles = (&[("presliding", true), ("settling", true)][..], product(&[&travels, &SETTLING_S]), Turn::ByTravel);
    // No more can fade than there is; of what was found that is asked once it is (`fades_within`).
    let coulomb = dictionary.problem.nominal.drives[j][2];
    let fades = if coulomb > 0.0 { Bound::Between(-coulomb, coulomb) } else { Bound::Free };
    // Nor can the robot have less friction than none: of what the simulation has at this place, all may be too much.
    let least = |there: f64| if there > 0.0 && !at_link { Bound::Between(-there, f64::INFINITY) } else { positive };
    let (level, per_speed) = (least(coulomb), least(dictionary.problem.nominal.drives[j][1]));
    for (names, starts, turn) in [speeds, bristles] {
        all.push(Family::shaped("coulomb_friction", &[j], form, TORQUE, &[level], names, starts.clone(), move |d, s| {
            vec![d.effort_of(j, smooth(d, place, s, turn).to_vec(), at_link)]
        }));
        for &(form, of, more) in &loads {
            let alone = move |d: &Dictionary, s: &[f64]| vec![by_load(d, &smooth(d, place, s, turn), of)];
            let family = Family::shaped(BY_LOAD, &[j], form, TORQUE, &[positive], names, starts.clone(), alone);
            all.push(family.penalised(1.0 + more));
            let with_level = move |d: &Dictionary, s: &[f64]| {
                let sign = smooth(d, place, s, turn);
                vec![by_load(d, &sign, of), d.effort_of(j, sign.to_vec(), at_link)]
            };
            let family = Family::shaped(BY_LOAD, &[j], form, TORQUE, &[positive, positive], names, starts.clone(), with_level);
            all.push(family.penalised(3.0 + more));
        }
        if at_link {
            continue;
        }
        for (form, bound, before) in [(FADES, fades, &BEFORE_S[..]), (FOUND_FADES, Bound::Free, &BEFORE_S[..1])] {
            let heated = product(&[&HEATING_S, before]);
            all.push(
                Family::shaped(
                    "thermal_drift",
                    &[j],
                    form,
                    TORQUE,
                    &[bound],
                    &[&[("T", true), (BEFORE, before.len() > 1)], names].concat(),
                    heated.iter().flat_map(|heat| starts.iter().map(move |s| [heat, &s[..]].concat())).collect(),
                    move |d, s| vec![d.effort_of(j, times(&heat(d, j, &s[..2]), &smooth(d, place, &s[2..], turn)), false)],
                )
                .lying_in(Valley::Long)
                .penalised(2.0),
            );
        }
    }
    all.push(Family::fixed("viscous_friction", &[j], form, TORQUE, &[per_speed], move |d| {
        vec![d.effort_of(j, velocity(d), at_link)]
    }));
    let slow = STRIBECK_SPEED.map(|share| share * speed);
    let sliding = least(LESS_SLIDING * coulomb);
    // On bristles too: else plain friction that rounds better would pass for it.
    let excess = Bound::UpTo(STATIC_EXCESS, if at_link { 0.0 } else { coulomb.max(0.0) });
    let speeds = (&["v_s", "a", "v_eps"][..], product(&[&slow, &STRIBECK_EXPONENT, &slowest[..1]]), Turn::BySpeed);
    let starts = product(&[&slow, &STRIBECK_EXPONENT, &travels[..1], &SETTLING_S]);
    let bristles = (&["v_s", "a", "presliding", "settling"][..], starts, Turn::ByTravel);
    let least = STRIBECK_LEAST * speed;
    for (names, starts, turn) in [speeds, bristles] {
        let shape: Vec<(&'static str, bool)> = names.iter().map(|name| (*name, true)).collect();
        all.push(
            Family::shaped(STRIBECK, &[j], form, TORQUE, &[sliding, excess], &shape, starts, move |d, s| {
                let mut shape = s.to_vec();
                shape[0] = shape[0].max(least);
                shape[1] = shape[1].clamp(STRIBECK_RANGE[0], STRIBECK_RANGE[1]);
                let signs = samples(d, place, &s[2..], turn);
                let extra = d.smoothed(|r| stribeck(&signs[r], d.problem.pairs[r].real.quick(j, at_link), &shape));
                vec![d.effort_of(j, smooth(d, place, &s[2..], turn).to_vec(), at_link), d.effort_of(j, extra, at_link)]
            })
            .penalised(3.0),
        );
    }
}

/// Times the least Stribeck speed up to which a curve is as narrow as one may be.
const NARROWEST: f64 = 1.1;

/// Is a shape a Stribeck curve as narrow as one may be?
pub(super) fn is_a_spike(family: &Family, shape: &[f64]) -> bool {
    // The grid begins with the slowest of its speeds.
    family.physics == STRIBECK && shape[0] <= NARROWEST * STRIBECK_LEAST / STRIBECK_SPEED[0] * family.grid[0][0]
}

/// Candidates for the presliding travel of a joint, rad or m.
fn presliding(dictionary: &Dictionary, j: usize) -> Vec<f64> {
    let travel = dictionary.travel(j);
    PRESLIDING.iter().map(|share| share * travel).collect()
}

/// A sign smoothed as everything is, at the grid.
fn smooth(dictionary: &Dictionary, place: Place, shape: &[f64], turn: Turn) -> Arc<Vec<f64>> {
    let sign = Sign::new(place, turn, shape);
    dictionary.signs.smooth.get(sign, || dictionary.smoothed(|r| sign.of(&dictionary.problem.pairs[r].real)))
}

/// The same at every sample of each run.
fn samples(dictionary: &Dictionary, place: Place, shape: &[f64], turn: Turn) -> Arc<Vec<Vec<f64>>> {
    let sign = Sign::new(place, turn, shape);
    dictionary.signs.samples.get(sign, || dictionary.problem.pairs.iter().map(|pair| sign.of(&pair.real)).collect())
}

/// Sign of a drive's velocity, turning over a speed, smoothed.
pub(super) fn turning(dictionary: &Dictionary, j: usize, speed: f64) -> Arc<Vec<f64>> {
    smooth(dictionary, Place { joint: j, at_link: false, widest: f64::INFINITY }, &[speed], Turn::BySpeed)
}

/// The same, as steep as its noise allows.
pub(super) fn steep(dictionary: &Dictionary, j: usize) -> Arc<Vec<f64>> {
    let speed = dictionary.problem.pairs.iter().map(|pair| pair.real.sign_speed(j)).fold(0.0, f64::max);
    turning(dictionary, j, speed)
}

/// What the Stribeck curve adds per unit of `f_s - f_c`, of the signs of some speeds; shape `v_s`, `a`.
fn stribeck(signs: &[f64], speeds: &[f64], shape: &[f64]) -> Vec<f64> {
    signs.iter().zip(speeds).map(|(sign, v)| sign * (-(v.abs() / shape[0]).powf(shape[1])).exp()).collect()
}

/// `1 - exp(-h/T)` of a joint, h the time weighted by its squared torque over the mean square. Shape: T and how long before a run h was zero, s.
pub(super) fn heat(dictionary: &Dictionary, j: usize, shape: &[f64]) -> Vec<f64> {
    // Faster heating is no heating: it would pass for a constant.
    let heating_s = shape[0].max(HEATING_S[0]);
    let before_s = shape[1].clamp(0.0, BEFORE_MOST_S.min(BEFORE_MOST * heating_s));
    let squares = dictionary.at_grid(|r, i, k| {
        let problem = dictionary.problem;
        let torque = problem.pairs[r].real.torque.as_ref().map_or(problem.loads[r][k].motor[j], |torque| torque[j][i]);
        torque * torque
    });
    let mean = crate::series::mean(&squares).max(1e-30);
    let mut h = 0.0;
    dictionary
        .grid
        .iter()
        .zip(&squares)
        .enumerate()
        .map(|(row, (&(r, i, _), square))| {
            let pair = &dictionary.problem.pairs[r].real;
            let before = row.checked_sub(1).map(|b| dictionary.grid[b]).filter(|b| b.0 == r);
            match before {
                Some(before) => h += (i - before.1) as f64 * pair.run.dt_s * square / mean,
                None => h = before_s + pair.run.elapsed_s(i),
            }
            1.0 - (-h / heating_s).exp()
        })
        .collect()
}
