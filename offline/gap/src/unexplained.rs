//! What is far above the noise where nothing was found: in so few places that no hypothesis can be held against what was left out (a wall that
//! is touched once, a cable that slipped for a moment), or so fast that differences of the rows take it for noise (a motor that shakes the
//! arm). It has no name, but it is no agreement either. Nor is what was found the whole of it where as much is left of its own place nearly
//! all the time (an encoder that loses counts drifts, but by steps).

use crate::cell::Channel;
use crate::held_out::{Sized, left as left_by};
use crate::hypothesis::UNMODELLED;
use crate::noise::Noise;
use crate::problem::Problem;
use crate::score::{segments, whiten};
use crate::series::rms;
use crate::told::main_cell;

/// Times the noise floor that is left where nothing was found. Robots without an effect stay near 1.
const BEYOND: f64 = 3.0;
/// Times what it would be if it were noise behind the window. Robots without an effect stay near 1.
const FORESEEN: f64 = 2.5;
/// Times the noise floor that effects leave in half of the blocks or more of a position from which one of them was told. Of 326 right names in opened
/// sets none leaves that and its share; what loses counts, and a play that was taken for a coupling, leave 2.8 times and more.
const MOSTLY: f64 = 2.5;
/// Share of their own size that they have to leave as well.
const SHARE: f64 = 0.1;
/// What a cable does under its load: the library's forms are near ones, and what they leave of a large one says nothing.
pub(crate) const NEAR_FORMS: [&str; 3] = ["backlash", "cable_stretch", "cable_hysteresis"];
/// Squared error of a block, of the largest block's, from which it belongs to the place.
const BELONGS: f64 = 0.25;

/// Why it is no noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// It stands high in few places.
    Seldom,
    /// Its own past tells it.
    Again {
        /// Where it is strongest, Hz.
        frequency_hz: f64,
    },
    /// Effects leave it nearly all the time.
    Mostly,
}

/// Where and how it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// Cell of the problem.
    pub cell: usize,
    /// RMS over all rows, in the cell's unit.
    pub rms: f64,
    /// What noise alone gives, in the same unit.
    pub floor: f64,
    /// Why it is no noise.
    pub pattern: Pattern,
    /// Share of the cell's squared error in the stretches.
    pub share: f64,
    /// Run, and s from its start: the stretches in which it is.
    pub stretches: Vec<(usize, [f64; 2])>,
}

/// RMS of a cell over what it would be if white noise behind the window had the innovations that it has: 1 for noise, large for what comes
/// again, however fast.
fn foreseen(problem: &Problem, c: usize) -> f64 {
    let cell = &problem.cells[c];
    let innovations = whiten(problem, &Noise::fit(&by_run(problem, c)), c, &cell.residual);
    // The window itself makes noise foreseeable.
    let behind = problem.pairs[0].real.noise_of_rows();
    let window = Noise::from_autocovariance(&behind, cell.rows.len());
    let told: f64 = window.coefficients.iter().zip(&behind[1..]).map(|(phi, covariance)| phi * covariance).sum();
    let own = (1.0 - told / behind[0]).max(0.0).sqrt();
    rms(cell.residual.iter().copied()) * own / rms(innovations.into_iter()).max(1e-300)
}

/// The residual of a cell, run by run.
fn by_run<'p>(problem: &'p Problem, c: usize) -> Vec<&'p [f64]> {
    segments(problem, c).into_iter().map(|rows| &problem.cells[c].residual[rows]).collect()
}

/// What effects leave of a position that one of those with a name is told from, far above its floor for half of the time or more. Of torques nothing is said:
/// laws of friction are near ones too.
pub(crate) fn mostly(problem: &Problem, floors: &[f64], effects: &[Sized]) -> Option<Unexplained> {
    let is_exact = |physics| physics != UNMODELLED && !NEAR_FORMS.contains(&physics);
    let exact = effects.iter().filter(|(claim, _)| is_exact(claim.family.physics));
    let cells = exact.map(|(claim, coefficients)| main_cell(floors, claim, coefficients));
    let of_cell = |cell: usize| {
        let of = left_by(problem, cell, effects);
        let mut squares = vec![(0.0, 0); problem.block_count];
        for (y, &block) in of.iter().zip(&problem.blocks[cell]) {
            squares[block].0 += y * y;
            squares[block].1 += 1;
        }
        let told = rms(problem.cells[cell].residual.iter().zip(&of).map(|(before, after)| before - after));
        let least = (MOSTLY * floors[cell]).max(SHARE * told).powi(2);
        let blocks = || squares.iter().filter(|(_, rows)| *rows > 0);
        let large = blocks().filter(|(sum, rows)| *sum > least * f64::from(*rows)).count();
        let unexplained = || Unexplained {
            cell,
            rms: rms(of.iter().copied()),
            floor: floors[cell],
            pattern: Pattern::Mostly,
            share: 1.0,
            stretches: Vec::new(),
        };
        (2 * large >= blocks().count()).then(unexplained)
    };
    cells.filter(|c| problem.cells[*c].channel == Channel::Transmission).find_map(of_cell)
}

/// Rows of each run, at most, that a frequency is told from: 80 s. Each frequency asks all of them.
const ROWS: usize = 4096;

/// The frequency at which a cell is strongest, Hz, of as many as its longest run tells apart.
fn strongest(problem: &Problem, c: usize) -> f64 {
    let runs: Vec<&[f64]> = by_run(problem, c).into_iter().map(|run| &run[..run.len().min(ROWS)]).collect();
    let longest = runs.iter().map(|run| run.len()).max().unwrap_or(0);
    let motion = &problem.pairs[0].real;
    let period_s = motion.step() as f64 * motion.run.dt_s;
    let power = |run: &[f64], turns: f64| {
        let at = |k: usize| std::f64::consts::TAU * turns * k as f64;
        let (cos, sin) = run.iter().enumerate().fold((0.0, 0.0), |(c, s), (k, y)| (c + y * at(k).cos(), s + y * at(k).sin()));
        cos * cos + sin * sin
    };
    let turns = |k: usize| k as f64 / longest as f64;
    let of = |k: usize| runs.iter().map(|run| power(run, turns(k))).sum::<f64>();
    let all: Vec<f64> = (1..=longest / 2).map(of).collect();
    let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b])).map_or(0.0, |k| turns(k + 1));
    best / period_s
}

/// What nothing explains, in the cell where it stands highest above its floor; none where all stay near theirs.
pub(crate) fn left(problem: &Problem, floors: &[f64]) -> Option<Unexplained> {
    let size = |c: usize| rms(problem.cells[c].residual.iter().copied());
    // What the model leaves of its own simulation is nothing that the robot has.
    let above = |c: usize| size(c) / floors[c].max(problem.practical.any[c]).max(problem.own_error(c) / BEYOND).max(1e-300);
    let highest = |of: &dyn Fn(usize) -> f64, from: f64| {
        let heights = (0..problem.cells.len()).filter(|c| problem.cells[*c].channel != Channel::EndEffector).map(|c| (c, of(c)));
        heights.filter(|(_, height)| *height > from).max_by(|a, b| a.1.total_cmp(&b.1))
    };
    // What a corrected model is known to get wrong may be told by its past; points have no past.
    let again = || {
        let asked = !problem.practical.is_known() && !problem.of_points();
        asked.then(|| highest(&|c| foreseen(problem, c), FORESEEN)).flatten()
    };
    let ((cell, height), pattern) = match highest(&above, BEYOND) {
        Some(found) => (found, Pattern::Seldom),
        None => again().map(|found| (found, Pattern::Again { frequency_hz: strongest(problem, found.0) }))?,
    };
    let floor = size(cell) / height;
    let of = &problem.cells[cell];
    let mut blocks = vec![(0.0, None::<(usize, [f64; 2])>); problem.block_count];
    for ((&(run, i), y), &block) in of.rows.iter().zip(&of.residual).zip(&problem.blocks[cell]) {
        let t = i as f64 * problem.pairs[run].real.run.dt_s;
        let (sum, place) = &mut blocks[block];
        *sum += y * y;
        place.get_or_insert((run, [t, t])).1[1] = t;
    }
    let total: f64 = blocks.iter().map(|(sum, _)| sum).sum();
    let most = blocks.iter().map(|(sum, _)| *sum).fold(0.0, f64::max);
    let (mut stretches, mut inside): (Vec<(usize, [f64; 2])>, f64) = (Vec::new(), 0.0);
    for (sum, place) in blocks.iter().filter(|(sum, _)| *sum >= BELONGS * most) {
        inside += sum;
        let Some((run, [from, to])) = *place else { continue };
        match stretches.last_mut() {
            // The next block begins a row after the last one ended.
            Some((last, [_, end])) if *last == run && from - *end < 0.1 => *end = to,
            _ => stretches.push((run, [from, to])),
        }
    }
    Some(Unexplained { cell, rms: size(cell), floor, pattern, share: inside / total.max(1e-300), stretches })
}
