//! In which region an effect shows: a box that is made smaller from the side where least is lost, as long as nearly all of the explained
//! error stays in it (patient rule induction: Friedman and Fisher, Bump hunting in high-dimensional data, Statistics and Computing 9, 1999).

use arm::serial::Workspace;
use gap_report::Region;

use crate::found::Found;
use crate::held_out::{others, sized};
use crate::hypothesis::{ALWAYS, Windows};
use crate::problem::Problem;

/// Share of the rows that each step takes off one side, and how much may be explained in them, of what is explained in as many on average:
/// a box ends where something begins, and not where most of it is.
const PEEL: f64 = 0.08;
const NOTHING: f64 = 0.1;
/// Share of the explained error that stays in the box,
const KEPT: f64 = 0.9;
/// and of the rows at most, for a box to be one.
const SMALL: f64 = 0.5;
/// The same of what was held out, where the box was not looked for.
const KEPT_THERE: f64 = 0.75;
const SMALL_THERE: f64 = 0.6;
/// Rows within and without, at least, of both.
const ROWS: usize = 25;
/// How far a tip has to move to have a workspace, m.
const MOVES_M: f64 = 2e-3;

/// Limits of a box along some axes: axis, lower, upper; infinite where nothing was taken off.
type Limits = Vec<(usize, [f64; 2])>;

/// Squared error that an effect explains, and where, row by row.
struct Rows {
    places: Vec<Vec<f64>>,
    explained: Vec<f64>,
}

/// Where an effect shows in a cell; everywhere, if no box holds nearly all of it on what was held out as well.
pub(crate) fn of_effect(found: &Found, effect: usize, cell: usize) -> Region {
    let space = Space::of(found);
    let Some(space) = space.filter(|_| found.problem.nuisances[cell].columns.is_empty()) else { return Region::all() };
    let (Some(fitted), Some(held)) = (fitted(found, effect, cell, &space), held_out(found, effect, cell, &space)) else {
        return Region::all();
    };
    let limits = peeled(&fitted);
    if limits.is_empty() || !holds(&fitted, &limits, KEPT, SMALL) || !holds(&held, &limits, KEPT_THERE, SMALL_THERE) {
        return Region::all();
    }
    let share = inside(&fitted, &limits).1 / fitted.explained.iter().sum::<f64>();
    let mut region = space.region(&within_reach(&limits, [&fitted, &held]));
    region.energy_share = Some(share.clamp(0.0, 1.0));
    region
}

/// In which coordinates a robot's region is told.
enum Space {
    /// The tip's, m.
    Tip,
    /// The joints', which all have this unit.
    Joints(Vec<String>, &'static str),
}

impl Space {
    /// The tip's, where it moves; the joints', where they have one unit.
    fn of(found: &Found) -> Option<Self> {
        let tips = places(found.problem, &Self::Tip, &every_row(found.problem));
        let moves = |axis: usize| {
            let (low, high) = crate::series::range(tips.iter().map(|tip| tip[axis]));
            high - low > MOVES_M
        };
        if (0..3).any(moves) {
            return Some(Self::Tip);
        }
        let units: Vec<&'static str> = (0..found.robot.joint_count()).map(|j| found.robot.position_unit(j)).collect();
        units.iter().all(|unit| *unit == units[0]).then(|| Self::Joints(found.robot.joints.clone(), units[0]))
    }

    fn region(&self, limits: &Limits) -> Region {
        let (min, max) = limits.iter().map(|(_, limits)| (limits[0], limits[1])).unzip();
        match self {
            Self::Tip => Region::tip_box(limits.iter().map(|(axis, _)| ["x", "y", "z"][*axis].to_owned()).collect(), min, max),
            Self::Joints(names, unit) => {
                Region::joint_box(limits.iter().map(|(j, _)| names[*j].clone()).collect(), min, max, *unit)
            }
        }
    }
}

fn every_row(problem: &Problem) -> Vec<(usize, usize)> {
    problem.cells.first().map_or_else(Vec::new, |cell| cell.rows.clone())
}

/// Coordinates of rows.
fn places(problem: &Problem, space: &Space, rows: &[(usize, usize)]) -> Vec<Vec<f64>> {
    let mut ws = Workspace::new(&problem.robot.arm);
    rows.iter()
        .map(|&(r, i)| {
            let joints = problem.joints(&problem.pairs[r].real, i);
            match space {
                Space::Tip => problem.robot.arm.tip(&mut ws, &joints).translation.vector.as_slice().to_vec(),
                Space::Joints(..) => joints,
            }
        })
        .collect()
}

/// What an effect explains of a residual beside the others, at the rows within its windows.
fn rows(problem: &Problem, cell: usize, space: &Space, without: &[f64], own: &[f64], windows: Option<&Windows>) -> Option<Rows> {
    let all = &problem.cells[cell].rows;
    let within = |&(r, i): &(usize, usize)| {
        let time_s = problem.pairs[r].real.run.elapsed_s(i);
        let [from, to] = windows.map_or(ALWAYS, |windows| windows.of(r));
        (from..=to).contains(&time_s)
    };
    let kept: Vec<usize> = (0..all.len()).filter(|k| within(&all[*k]) && k < &own.len()).collect();
    let explained: Vec<f64> = kept.iter().map(|k| without[*k].powi(2) - (without[*k] - own[*k]).powi(2)).collect();
    let rows: Vec<(usize, usize)> = kept.iter().map(|k| all[*k]).collect();
    (explained.iter().sum::<f64>() > 0.0).then(|| Rows { places: places(problem, space, &rows), explained })
}

fn fitted(found: &Found, effect: usize, cell: usize, space: &Space) -> Option<Rows> {
    let others = others(&sized(&found.answer.effects, found.estimates), effect);
    let without = crate::held_out::left(found.problem, cell, &others);
    let candidate = &found.answer.effects[effect].chosen.candidate;
    let own = candidate.effect(cell, &found.estimates[effect].coefficients);
    rows(found.problem, cell, space, &without, &own, candidate.windows.as_ref())
}

fn held_out(found: &Found, effect: usize, cell: usize, space: &Space) -> Option<Rows> {
    let all = sized(&found.answer.effects, found.estimates);
    let (c, without, with) = found.held_out().beside(&all, effect, all[effect], cell)?;
    let own: Vec<f64> = without.iter().zip(&with).map(|(without, with)| without - with).collect();
    rows(found.held, c, space, &without, &own, found.held_windows[effect].as_ref())
}

/// The same, with how far the motion went where there is no limit.
fn within_reach(limits: &Limits, all: [&Rows; 2]) -> Limits {
    let reach = |axis: usize| crate::series::range(all.iter().flat_map(|rows| &rows.places).map(|place| place[axis]));
    let bounded = |&(axis, [low, high]): &(usize, [f64; 2])| {
        let (least, most) = reach(axis);
        (axis, [low.max(least), high.min(most)])
    };
    limits.iter().map(bounded).collect()
}

/// The box that is left when nothing more can be taken off: each time from the side where the most rows hold next to nothing.
fn peeled(rows: &Rows) -> Limits {
    let total: f64 = rows.explained.iter().sum();
    let usual = total / rows.explained.len().max(1) as f64;
    let axes = rows.places.first().map_or(0, Vec::len);
    let mut left: Vec<usize> = (0..rows.places.len()).collect();
    let mut limits = vec![[f64::NEG_INFINITY, f64::INFINITY]; axes];
    let mut lost = 0.0;
    loop {
        let off = ((PEEL * left.len() as f64) as usize).max(1);
        let mut best: Option<(f64, usize, usize, f64)> = None;
        for axis in 0..axes {
            let mut sorted: Vec<f64> = left.iter().map(|k| rows.places[*k][axis]).collect();
            sorted.sort_by(f64::total_cmp);
            if 2 * off >= sorted.len() {
                continue;
            }
            // Where the robot stood, many rows are at one place: they go together.
            let (low, high) = (sorted[off - 1], sorted[sorted.len() - off]);
            let (low, high) = (sorted.iter().find(|x| **x > low), sorted.iter().rev().find(|x| **x < high));
            for (side, limit) in [low, high].into_iter().enumerate().filter_map(|(side, limit)| Some((side, *limit?))) {
                let goes = |k: &&usize| if side == 0 { rows.places[**k][axis] < limit } else { rows.places[**k][axis] > limit };
                let (count, sum) = left.iter().filter(goes).fold((0, 0.0), |(count, sum), k| (count + 1, sum + rows.explained[*k]));
                let mean = sum / f64::from(count.max(1));
                if count > 0 && mean < NOTHING * usual && lost + sum <= (1.0 - KEPT) * total && best.is_none_or(|b| mean < b.0) {
                    best = Some((mean, axis, side, limit));
                }
            }
        }
        let Some((_, axis, side, limit)) = best else { break };
        limits[axis][side] = limit;
        let stays = |k: &usize| if side == 0 { rows.places[*k][axis] >= limit } else { rows.places[*k][axis] <= limit };
        lost += left.iter().filter(|k| !stays(k)).map(|k| rows.explained[*k]).sum::<f64>();
        left.retain(stays);
    }
    limits.into_iter().enumerate().filter(|(_, limits)| limits.iter().any(|limit| limit.is_finite())).collect()
}

/// How many rows are in a box, and what is explained there.
fn inside(rows: &Rows, limits: &Limits) -> (usize, f64) {
    let within = |place: &[f64]| limits.iter().all(|(axis, [low, high])| (*low..=*high).contains(&place[*axis]));
    let there = rows.places.iter().zip(&rows.explained).filter(|(place, _)| within(place));
    there.fold((0, 0.0), |(count, sum), (_, explained)| (count + 1, sum + explained))
}

/// Does a box of few rows hold so much of what is explained?
fn holds(rows: &Rows, limits: &Limits, kept: f64, small: f64) -> bool {
    let (count, sum) = inside(rows, limits);
    let (all, total) = (rows.places.len(), rows.explained.iter().sum::<f64>());
    count >= ROWS && all - count >= ROWS && (count as f64) <= small * all as f64 && sum >= kept * total * (1.0 - 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of places in a square, each with what is explained there.
    fn square(explained: impl Fn(f64, f64) -> f64) -> Rows {
        let places: Vec<Vec<f64>> = (0..900).map(|k| vec![f64::from(k % 30) / 30.0, f64::from(k / 30) / 30.0]).collect();
        let explained = places.iter().map(|p| explained(p[0], p[1])).collect();
        Rows { places, explained }
    }

    #[test]
    fn what_is_explained_in_a_corner_is_found_there_and_what_is_explained_everywhere_nowhere() {
        let corner = square(|x, y| if x > 0.6 && y < 0.3 { 1.0 } else { 0.001 });
        let limits = peeled(&corner);
        assert_eq!(limits.iter().map(|(axis, _)| *axis).collect::<Vec<_>>(), [0, 1]);
        assert!(limits[0].1[0] > 0.55 && limits[1].1[1] < 0.35, "{limits:?}");
        assert!(holds(&corner, &limits, KEPT, SMALL));
        // Of the one axis along which nothing changes there are no limits.
        let side = square(|x, _| if x < 0.25 { 2.0 } else { 0.0 });
        assert_eq!(peeled(&side).iter().map(|(axis, _)| *axis).collect::<Vec<_>>(), [0]);
        let everywhere = square(|x, y| 1.0 + 0.2 * (40.0 * x + 31.0 * y).sin());
        let limits = peeled(&everywhere);
        assert!(!holds(&everywhere, &limits, KEPT, SMALL), "{limits:?}");
    }

    #[test]
    fn a_box_of_what_was_fitted_is_none_where_the_rest_is_explained_elsewhere() {
        let limits = peeled(&square(|x, _| if x < 0.25 { 2.0 } else { 0.0 }));
        let elsewhere = square(|x, _| if x > 0.5 { 2.0 } else { 0.0 });
        assert!(!holds(&elsewhere, &limits, KEPT_THERE, SMALL_THERE));
        let few = Rows { places: vec![vec![0.0, 0.0]; 3], explained: vec![1.0; 3] };
        assert!(!holds(&few, &peeled(&few), KEPT, SMALL));
    }
}
