//! 95 % intervals of parameters: leave one block out, shapes and windows linearised.

use crate::cell::Channel;
use crate::held_out::{Sized, left_without, noise_left, sized_in_a_row};
use crate::hypothesis::{
    AT_THE_TIP, Candidate, Column, Dictionary, Family, GROUND, LATE_TORQUES, OUT_OF_PLANE, ROTOR, START, STRIBECK_RANGE, are_parts,
    levels_what_fades, rounds,
};
use crate::noise::Noise;
use crate::nominal::Nominal;
use crate::parallel;
use crate::parameters::{Named, parameters};
use crate::problem::Problem;
use crate::refine;
use crate::robot::Robot;
use crate::score::{Grams, Scorer};
use crate::search::{Effect, score_scale};
use crate::series::rms;

/// An instant, s from the start of a run, with its 95 % interval.
pub type Edge = (f64, [f64; 2]);

/// What an effect amounts to.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Parameters, with their 95 % intervals.
    pub parameters: Vec<(Named, [f64; 2])>,
    /// Beginning and end, s from the start of each run, with their intervals, none where it does not begin or end in it; once where all runs are
    /// alike, and nothing where it is always there.
    pub windows: Vec<[Option<Edge>; 2]>,
    /// Coefficients of the candidate's columns.
    pub coefficients: Vec<f64>,
}

impl Estimate {
    /// Do the intervals of what says how large an effect is all hold that it is not there? Of forms that are something else besides that is not asked.
    pub(crate) fn may_be_nothing(&self, family: &Family) -> bool {
        let sizes = sizes(family.physics, family.form);
        let own = |(name, none): &(&str, f64)| {
            let interval = self.parameters.iter().find(|(named, _)| named.name == *name).map(|(_, interval)| interval);
            interval.map(|[least, most]| *least <= *none && *none <= *most)
        };
        let mut told = sizes.iter().filter_map(own).peekable();
        told.peek().is_some() && told.all(|holds| holds)
    }

    /// Does the interval of friction at rest hold that of sliding?
    pub(crate) fn is_a_level(&self) -> bool {
        let of = |name: &str| self.parameters.iter().find(|(named, _)| named.name == name);
        of("f_s").zip(of("f_c")).is_some_and(|((_, [least, most]), (f_c, _))| (*least..=*most).contains(&f_c.value))
    }

    /// Intervals that hold another estimate's as well, of the numbers that both have.
    fn widen(&mut self, other: &Self) {
        let hold = |own: &mut [f64; 2], other: &[f64; 2]| *own = [own[0].min(other[0]), own[1].max(other[1])];
        for (named, interval) in &mut self.parameters {
            if let Some((_, beside)) = other.parameters.iter().find(|(beside, _)| beside.name == named.name) {
                hold(interval, beside);
            }
        }
    }
}

/// How much worse, on the scale of its score, another choice may fit and is not decided against.
const UNDECIDED: f64 = 3.0;

/// Model error that blocks share and so do not show, as a share of how far a value is from no effect: forms of friction, the
/// smoothing of a sign and of what is quick; exponents and shapes of which only some are tried; and for what is measured in units of
/// the model's load, the weights that a lab gives its links (measured on trials whose truths were open by then).
fn common(physics: &str, form: &str, name: &str) -> f64 {
    match (physics, name) {
        ("thermal_drift", "T") => 0.5,
        ("cable_hysteresis", "n" | "g") => 0.6,
        ("stribeck_friction", "f_s") => 0.25,
        ("stribeck_friction", "v_s" | "a") => 0.35,
        ("cable_hysteresis", "z_m") | ("load_dependent_friction" | "torque_ripple", _) => 0.3,
        ("payload", "m_p") if form == AT_THE_TIP => 0.25,
        ("cable_creep", "T_k") | ("external_contact", "p") | ("gravity_direction", _) => 0.2,
        // How steeply dry friction turns round says how late it is.
        ("measurement_delay", _) if form == LATE_TORQUES[0] => 0.2,
        ("cable_creep", "J_k") | ("cable_hysteresis", "a") | ("thermal_drift", "kappa_T") => 0.1,
        ("cable_hysteresis" | "thermal_drift", _) => 0.15,
        ("cable_stretch", _) | ("external_contact", "k") => 0.12,
        ("payload", "m_p") => 0.06,
        ("stribeck_friction", _) => 0.05,
        ("external_contact", "f_max") => 0.04,
        ("payload" | "link_inertia" | "external_contact", _) => 0.08,
        ("link_geometry", _) => 0.03,
        ("motor_torque_scale" | "frame_misalignment" | "measurement_delay", _) => 0.02,
        ("transmission_ratio", _) => 0.008,
        ("joint_offset", _) => 0.006,
        _ => 0.015,
    }
}

/// Of the other part of what rubs at a joint, as much as its form is not known by: a small part makes up for it (docs/decisions/0031).
const OF_THE_OTHER_PART: f64 = 0.01;

/// How much of a part of what rubs at a joint would fit the other part, alone.
fn as_the_other_part(candidates: &[Sized], k: usize) -> f64 {
    let (own, _) = candidates[k];
    let others = candidates.iter().filter(|(other, _)| are_parts(own, other));
    let product: f64 = others
        .flat_map(|(other, theta)| other.columns.iter().zip(*theta).map(|(column, theta)| theta * own.columns[0].dot(column)))
        .sum();
    product / own.columns[0].dot(&own.columns[0]).max(1e-300)
}

/// How long before a recording friction began to fade is supposed, beside a level that is free, to so much, s.
const BEGAN_S: f64 = 0.5;

/// How much of a level friction beside it has faded by, or has not, in the time by which that began otherwise than supposed.
fn as_faded(candidates: &[Sized], k: usize) -> f64 {
    let (own, _) = candidates[k];
    let fading = candidates.iter().filter(|(other, _)| levels_what_fades(own, other));
    fading.map(|(other, theta)| theta[0] * BEGAN_S / other.shape_of("T").unwrap_or(f64::INFINITY)).sum()
}

/// Of the load of a cable, as much as it is not known by, whatever it looks like.
pub(crate) const OF_THE_LOAD: f64 = 0.12;

/// How much a spring's parameter, or that of a zero that is off beside it, may be wrong by since its load is: the zero takes what does not change of the
/// spring's effect, and leaves it as much less to be known by.
fn as_loaded(problem: &Problem, candidates: &[Sized], k: usize, value: f64) -> f64 {
    let (own, _) = candidates[k];
    let of = |physics: &str| {
        let there = |(other, _): &&Sized| other.is_of(physics, &own.family.joints) && other.windows.is_none();
        candidates.iter().find(there)
    };
    let Some(((spring, theta), (zero, _))) = of("cable_stretch").zip(of("joint_offset")) else { return 0.0 };
    let is_there = |cell: &&usize| problem.cells[**cell].channel == Channel::Transmission;
    let Some(cell) = zero.columns[0].parts.iter().map(|(cell, _)| cell).find(is_there) else { return 0.0 };
    let effect = spring.effect(*cell, theta);
    let mean = crate::series::mean(&effect);
    let (whole, varies) = (rms(effect.iter().copied()), rms(effect.iter().map(|x| x - mean)));
    match own.family.physics {
        "cable_stretch" => OF_THE_LOAD * value.abs() * whole / varies.max(1e-300),
        "joint_offset" => OF_THE_LOAD * whole,
        _ => 0.0,
    }
}

/// All dry friction of a drive that fades, if some of it was found: what the simulation has as well.
fn all_that_fades(candidates: &[Sized], k: usize, nominal: &Nominal) -> Option<f64> {
    let (fading, _) = candidates[k];
    let mut found = candidates.iter().filter(|(level, _)| levels_what_fades(level, fading)).peekable();
    let _ = found.peek()?;
    let own = nominal.drives[*fading.family.joints.first()?][2];
    Some(own + found.map(|(level, theta)| level.level_of(theta)).sum::<f64>()).filter(|all| *all > 0.0)
}

/// The numbers that say how large an effect is, with what they are where there is none. Not of forms with other coefficients (a place, a
/// constant, the other numbers of a link), of what warms up or creeps, whose size and time constant make up for one another, nor of what is none
/// where a number is infinite, or of a curve or a wall, which are not one number.
fn sizes(physics: &str, form: &str) -> &'static [(&'static str, f64)] {
    match (physics, form) {
        ("coulomb_friction", _) => &[("f_c", 0.0)],
        ("viscous_friction" | "backlash", _) => &[("b", 0.0)],
        ("load_dependent_friction", _) => &[("mu_l", 0.0)],
        ("cable_hysteresis", _) => &[("a", 1.0)],
        ("joint_coupling", "position" | "position and torque") => &[("c_ij", 0.0)],
        ("payload", _) => &[("m_p", 0.0)],
        ("gravity_direction", _) => &[("a", 0.0), ("b", 0.0)],
        ("link_inertia", "scaled" | ROTOR) => &[("dpi_B", 0.0)],
        ("motor_torque_scale", "scale" | "scale, rounded") => &[("kappa", 1.0)],
        ("torque_ripple", _) => &[("amp", 0.0)],
        ("joint_offset", _) => &[("o", 0.0)],
        ("transmission_ratio", "about zero" | "about zero, torque too") => &[("e", 0.0)],
        ("pulley_eccentricity", _) => &[("e_over_r", 0.0)],
        ("link_geometry", _) => &[("d_alpha", 0.0), ("d_length", 0.0)],
        ("measurement_delay", _) => &[("d", 0.0), ("clock_drift", 0.0)],
        ("frame_misalignment", _) => &[("w_x", 0.0), ("w_y", 0.0), ("w_z", 0.0), ("t_x", 0.0), ("t_y", 0.0), ("t_z", 0.0)],
        _ => &[],
    }
}

/// A payload that is supposed at the tip may be anywhere nearer than this to it, m.
const SUPPOSED_M: f64 = 0.05;

/// Half the interval of what was supposed, not found.
fn supposed(physics: &str, form: &str, name: &str) -> f64 {
    if physics == "payload" && form == AT_THE_TIP && name.starts_with("c_") { SUPPOSED_M } else { 0.0 }
}

/// What a parameter can be: an interval does not reach beyond.
fn possible(physics: &str, form: &str, named: &Named) -> [f64; 2] {
    match (physics, named.name) {
        // Of less than the simulation has.
        ("cable_stretch", "k") if named.value < 0.0 => [f64::NEG_INFINITY, 0.0],
        // The law of a spring to the ground may bend the other way: of a Bouc-Wen element in these numbers, z_m is negative then.
        ("cable_hysteresis", _) if form == GROUND => [f64::NEG_INFINITY, f64::INFINITY],
        ("cable_hysteresis", "a") => [0.0, 1.0],
        ("cable_hysteresis", "g") => [0.5, 1.0],
        ("cable_hysteresis", "n") => [1.0, f64::INFINITY],
        ("cable_hysteresis", "z_m" | "k")
        | ("cable_stretch", "k")
        | ("cable_creep", "T_k")
        | ("thermal_drift", "T")
        | ("stribeck_friction", "v_s")
        | ("pulley_eccentricity", "period") => [0.0, f64::INFINITY],
        // No more fades than there is.
        ("thermal_drift", "kappa_T") => [f64::NEG_INFINITY, 1.0],
        ("stribeck_friction", "a") => STRIBECK_RANGE,
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    }
}

/// Of friction at rest, what sliding friction counts for at least.
const OF_AT_REST: f64 = 0.3;

/// How far a parameter is from no effect; of a direction, the whole of it.
fn size(physics: &str, named: &Named, all: &[Named]) -> f64 {
    match (physics, named.name) {
        ("motor_torque_scale", "kappa") | ("cable_hysteresis", "a") => named.value - 1.0,
        ("gravity_direction" | "frame_misalignment", _) => {
            let own = || beside(physics, named, all);
            rms(own().map(|one| one.value)) * (own().count() as f64).sqrt()
        }
        // Of sliding friction that is about what the simulation has, the friction at rest is what is known by a share.
        ("stribeck_friction", "f_c") => {
            let at_rest = all.iter().find(|one| one.name == "f_s").map_or(0.0, |f_s| f_s.value);
            named.value.abs().max(OF_AT_REST * at_rest.abs())
        }
        // Where a phase is counted from says nothing: what it is on the average.
        _ if named.is_phase() => std::f64::consts::FRAC_PI_2,
        _ => named.value,
    }
}

/// The parameters that are one vector with this one.
fn beside<'a>(physics: &'a str, named: &'a Named, all: &'a [Named]) -> impl Iterator<Item = &'a Named> {
    let vector = match physics {
        "gravity_direction" => 0,
        "frame_misalignment" | "payload" => 2,
        _ => usize::MAX,
    };
    // w_x, w_y and w_z, t_x..., c_x...; a and b.
    all.iter().filter(move |one| {
        one.name == named.name || (one.name.len() >= vector && named.name.get(..vector) == one.name.get(..vector))
    })
}

/// Standard errors of a 95 % interval of each of so many numbers, all of which are to lie within theirs (Bonferroni).
fn errors_of_all(numbers: usize) -> f64 {
    [1.96, 2.24, 2.39][numbers.clamp(1, 3) - 1]
}

/// What a column of the wide fit is the slope of.
#[derive(Debug, Clone, Copy)]
enum Slope {
    Shape(usize),
    Edge,
}

/// Estimates of all effects together. Where a choice of an effect's shape is not decided, the intervals hold what either would say.
pub fn estimates(dictionary: &Dictionary, scorer: &Scorer, nominal: &Nominal, robot: &Robot, effects: &[Effect]) -> Vec<Estimate> {
    let candidates: Vec<&Candidate> = effects.iter().map(|e| &e.chosen.candidate).collect();
    let mut all = of_candidates(dictionary, nominal, robot, &candidates);
    for (k, estimate) in all.iter_mut().enumerate() {
        estimate.windows = edges(dictionary, scorer, &candidates, (k, effects[k].chosen.score));
        for other in chosen_as_well(dictionary, scorer, &candidates, (k, effects[k].chosen.score)) {
            let mut with = candidates.clone();
            with[k] = &other;
            estimate.widen(&of_candidates(dictionary, nominal, robot, &with)[k]);
        }
    }
    all
}

/// An edge is known to the smoothing at best, s; no further is looked for it than so far.
const EDGE_S: f64 = 0.02;
const FURTHEST_S: f64 = 10.0;
/// Times that the end of its interval is halved.
const HALVED: usize = 4;

/// The edges of a candidate's windows among others, each as far as it may lie without fitting much worse: while an arm stands still, nothing says
/// when a weight was picked up.
fn edges(dictionary: &Dictionary, scorer: &Scorer, candidates: &[&Candidate], (k, score): (usize, f64)) -> Vec<[Option<Edge>; 2]> {
    let Some(windows) = &candidates[k].windows else { return Vec::new() };
    let base = others_of(scorer, candidates, k);
    let whole = Candidate::new(dictionary, &candidates[k].family, &candidates[k].shape, None);
    let least = scorer.fitted(&base, candidates[k]).0;
    let of_edge = |(place, edge): (usize, usize)| {
        let fits = |by_s: f64| {
            let moved = windows.moved((place, edge), by_s);
            let [from, to] = moved.all()[place];
            let there = whole.within(dictionary.problem, &moved);
            from < to && there.shows() && scorer.fitted(&base, &there).0 < least + UNDECIDED * score_scale(score)
        };
        let reach = |sign: f64| {
            let mut known = EDGE_S;
            while known < FURTHEST_S && fits(2.0 * sign * known) {
                known *= 2.0;
            }
            let mut step = 0.5 * known;
            for _ in 0..HALVED {
                if fits(sign * (known + step)) {
                    known += step;
                }
                step *= 0.5;
            }
            known
        };
        let t = windows.all()[place][edge];
        (t, [(t - reach(-1.0)).max(0.0), t + reach(1.0)])
    };
    let of_place = |place: usize| [0, 1].map(|edge| windows.all()[place][edge].is_finite().then(|| of_edge((place, edge))));
    parallel::map((0..windows.all().len()).collect::<Vec<_>>(), of_place)
}

/// What there is beside one of some candidates.
fn others_of(scorer: &Scorer, candidates: &[&Candidate], k: usize) -> Grams {
    scorer.grams(candidates.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, other)| *other))
}

/// A candidate among others with its other choices, where these do not fit much worse.
fn chosen_as_well(dictionary: &Dictionary, scorer: &Scorer, candidates: &[&Candidate], (k, score): (usize, f64)) -> Vec<Candidate> {
    if candidates[k].family.choices.is_empty() {
        return Vec::new();
    }
    let base = others_of(scorer, candidates, k);
    let fitted = |candidate: &Candidate| scorer.fitted(&base, candidate);
    let least = fitted(candidates[k]).0;
    if !least.is_finite() {
        return Vec::new();
    }
    let mut all = refine::chosen_otherwise(dictionary, candidates[k], &fitted);
    all.retain(|other| fitted(other).0 < least + UNDECIDED * score_scale(score));
    all
}

/// Rounds in which the noise is learnt from what the last one left.
const ROUNDS: usize = 2;
/// How much more than the least squares may be left by coefficients with another noise, of its RMS.
const MORE_LEFT: f64 = 1.1;

/// With the noise that candidates leave of each cell, beginning with none that is known: that of the search is what the window makes of white noise, and
/// weighs what is quick by far more than a model is right about it. Of play, which turns round at once here and slowly in a robot, what is left is no noise
/// either where much more would be left by it: with none then. Nor is there noise to learn of rows that do not follow each other, and of a model that was learnt
/// from recordings the search knows none.
fn by_what_is_left<'p>(problem: &'p Problem<'p>, candidates: &[&Candidate]) -> Scorer<'p> {
    let plain = Scorer::new(problem, vec![Noise::default(); problem.cells.len()]);
    if problem.of_points() || problem.from_recording {
        return plain;
    }
    let fitted = |scorer: &Scorer| scorer.fit(&scorer.grams(candidates.iter().copied())).coefficients;
    let noise = |coefficients: &[f64]| noise_left(problem, &sized_in_a_row(candidates.iter().copied(), coefficients));
    let least = fitted(&plain);
    let mut scorer = Scorer::new(problem, noise(&least));
    for _ in 1..ROUNDS {
        let coefficients = fitted(&scorer);
        scorer = Scorer::new(problem, noise(&coefficients));
    }
    if candidates.iter().any(|candidate| candidate.family.physics == "backlash") {
        let with_noise = fitted(&scorer);
        let left = |c: usize, coefficients: &[f64]| {
            rms(left_without(problem, c, &sized_in_a_row(candidates.iter().copied(), coefficients)).into_iter())
        };
        if (0..problem.cells.len()).any(|c| left(c, &with_noise) > MORE_LEFT * left(c, &least)) {
            return plain;
        }
    }
    scorer
}

/// Estimates of candidates together.
fn of_candidates(dictionary: &Dictionary, nominal: &Nominal, robot: &Robot, candidates: &[&Candidate]) -> Vec<Estimate> {
    let scorer = by_what_is_left(dictionary.problem, candidates);
    // First round: coefficients; second: with the slopes by shape and windows.
    let plain = scorer.grams(candidates.iter().copied());
    let fit = scorer.fit(&plain);
    let mut grams = scorer.empty();
    let mut layout = Vec::new();
    let mut column = 0;
    let sized = sized_in_a_row(candidates.iter().copied(), &fit.coefficients);
    for (candidate, theta) in &sized {
        let slopes = slopes(dictionary, candidate, theta);
        let mut columns = candidate.columns.to_vec();
        columns.extend(slopes.iter().map(|(_, slope)| slope.clone()));
        grams = scorer.extended(&grams, &columns);
        layout.push((column, theta.to_vec(), slopes.into_iter().map(|(which, _)| which).collect::<Vec<_>>()));
        column += columns.len();
    }
    let wide = scorer.fit(&grams);
    let blocks = wide.without.len() as f64;
    let reach = |numbers: usize| (errors_of_all(numbers) + 2.4 / (blocks - 1.0)) * ((blocks - 1.0) / blocks).sqrt();
    candidates
        .iter()
        .zip(layout)
        .enumerate()
        .map(|(own, (candidate, (column, theta, which)))| {
            let all_that_fades = all_that_fades(&sized, own, nominal);
            let of_others = (OF_THE_OTHER_PART * as_the_other_part(&sized, own)).hypot(as_faded(&sized, own));
            let of = |coefficients: &[f64]| -> Vec<Named> {
                let own = &coefficients[column..column + theta.len()];
                let mut shape = candidate.shape.clone();
                for (k, which) in which.iter().enumerate() {
                    let moved = coefficients[column + theta.len() + k] - wide.coefficients[column + theta.len() + k];
                    match which {
                        Slope::Shape(number) => shape[*number] += moved,
                        // Its own interval is asked of the fit itself.
                        Slope::Edge => {}
                    }
                }
                // Deviations are taken from the wide fit, values from the plain one.
                let at: Vec<f64> = own.iter().zip(&wide.coefficients[column..]).zip(&theta).map(|((x, w), t)| t + x - w).collect();
                let mut all = parameters(robot, nominal, candidate, &at, &shape);
                if let Some(friction) = all_that_fades {
                    all.retain(|one| one.name != "kappa_T");
                    all.insert(0, Named { name: "kappa_T", unit: "1", value: -at[0] / friction });
                }
                all
            };
            let values = of(&wide.coefficients);
            let replicates: Vec<Vec<Named>> = wide.without.iter().map(|c| of(c)).collect();
            let spread = |k: usize| -> f64 {
                let of: Vec<f64> = replicates.iter().map(|r| r[k].near(values[k].value)).collect();
                let mean = of.iter().sum::<f64>() / blocks;
                of.iter().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt()
            };
            let (physics, form) = (candidate.family.physics, candidate.family.form);
            let parameters = values
                .iter()
                .enumerate()
                .map(|(k, named)| {
                    let shared = common(physics, form, named.name) * size(physics, named, &values);
                    let reach = reach(beside(physics, named, &values).count());
                    let plain = matches!((physics, named.name), ("coulomb_friction", "f_c") | ("viscous_friction", "b"));
                    let of_others = match named.name {
                        "k" | "o" => as_loaded(dictionary.problem, &sized, own, named.value),
                        _ if plain => of_others,
                        _ => 0.0,
                    };
                    let half = (reach * spread(k)).hypot(shared).hypot(supposed(physics, form, named.name)).hypot(of_others);
                    let [least, most] = possible(physics, form, named);
                    let either = form == OUT_OF_PLANE && !candidate.family.shape.contains(&named.name);
                    let high = (named.value + half).min(most.max(named.value));
                    let low = if either { -high } else { (named.value - half).max(least.min(named.value)) };
                    (named.clone(), [low, high])
                })
                .collect();
            Estimate { parameters, windows: Vec::new(), coefficients: theta }
        })
        .collect()
}

/// Change of the effect per unit of each refined number of its shape, and of each edge of its windows.
fn slopes(dictionary: &Dictionary, candidate: &Candidate, theta: &[f64]) -> Vec<(Slope, Column)> {
    let family = &candidate.family;
    // What rounds a sign or a crossing is not asked for.
    let asked: Vec<usize> = (0..family.shape.len()).filter(|k| family.steps[*k].is_some() && !rounds(family.shape[*k])).collect();
    let of_numbers = slopes_of(dictionary, candidate, theta, &asked);
    let mut all: Vec<(Slope, Column)> = asked.into_iter().map(Slope::Shape).zip(of_numbers).collect();
    let windows = candidate.windows.as_ref();
    for (windows, edge) in windows.into_iter().flat_map(|windows| windows.edges().into_iter().map(move |edge| (windows, edge))) {
        let step = 0.04;
        let at = |sign: f64| Candidate::new(dictionary, family, &candidate.shape, Some(&windows.moved(edge, sign * step)));
        all.push((Slope::Edge, difference(&at(1.0), &at(-1.0), theta, 2.0 * step)));
    }
    all.retain(|(_, column)| !column.is_empty());
    all
}

/// Change of the effect per unit of each of these numbers of its shape.
pub(crate) fn slopes_of(dictionary: &Dictionary, candidate: &Candidate, theta: &[f64], numbers: &[usize]) -> Vec<Column> {
    // Each run has a start of its own, and none reaches another run: all are moved together.
    let starts: Vec<usize> = (0..candidate.shape.len()).filter(|k| candidate.family.shape[*k] == START).collect();
    let of_starts = numbers.iter().any(|k| starts.contains(k)).then(|| slope(dictionary, candidate, theta, &starts));
    let of_number = |k: &usize| match (starts.iter().position(|start| start == k), &of_starts) {
        (Some(run), Some(together)) => together.of_run(dictionary.problem, run),
        _ => slope(dictionary, candidate, theta, &[*k]),
    };
    parallel::map(numbers, of_number)
}

/// Change of the effect per unit by which some numbers of its shape are moved.
fn slope(dictionary: &Dictionary, candidate: &Candidate, theta: &[f64], numbers: &[usize]) -> Column {
    let family = &candidate.family;
    let span = |k: usize| family.limits.get(k).map_or(0.0, |limits| limits[1] - limits[0]);
    let step = numbers.iter().map(|k| (1e-3 * candidate.shape[*k].abs()).max(1e-7).max(1e-4 * span(*k))).fold(0.0, f64::max);
    let at = |sign: f64| {
        let mut shape = candidate.shape.clone();
        for k in numbers {
            shape[*k] += sign * step;
        }
        Candidate::new(dictionary, family, &shape, candidate.windows.as_ref())
    };
    let (there, here) = parallel::both(|| at(1.0), || at(-1.0));
    difference(&there, &here, theta, 2.0 * step)
}

fn difference(there: &Candidate, here: &Candidate, theta: &[f64], step: f64) -> Column {
    let mut out = Column::default();
    let cells: std::collections::BTreeSet<usize> =
        there.columns.iter().chain(here.columns.iter()).flat_map(|column| column.parts.iter().map(|(c, _)| *c)).collect();
    for cell in cells {
        let sum = |candidate: &Candidate| candidate.effect(cell, theta);
        let (a, b) = (sum(there), sum(here));
        let rows = a.len().max(b.len());
        let value = |s: &[f64], i: usize| s.get(i).copied().unwrap_or(0.0);
        let slope: Vec<f64> = (0..rows).map(|i| (value(&a, i) - value(&b, i)) / step).collect();
        out.push(Some(cell), &slope);
    }
    out
}
