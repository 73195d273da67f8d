//! What is far above the noise but in so few places that no hypothesis can be held against what was left out: a wall that is
//! touched once, a cable that slipped for a moment. It has no name, but it is no agreement either.

use crate::nominal::rms;
use crate::problem::{Channel, Problem};

/// Times the noise floor that is left where nothing was found. Robots without an effect stay below 1 (docs/proof.md).
const BEYOND: f64 = 3.0;
/// Squared error of a block, of the largest block's, from which it belongs to the place.
const BELONGS: f64 = 0.25;

/// Where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Seldom {
    /// Cell of the problem.
    pub cell: usize,
    /// RMS over all rows, in the cell's unit.
    pub rms: f64,
    /// Share of the cell's squared error in the stretches.
    pub share: f64,
    /// Run, and s from its start: the stretches in which it is.
    pub stretches: Vec<(usize, [f64; 2])>,
}

/// What nothing explains, in the cell where it stands highest above its floor; none where all stay near theirs.
pub(crate) fn left(problem: &Problem, floors: &[f64]) -> Option<Seldom> {
    let above = |c: usize| rms(problem.cells[c].residual.iter().copied()) / floors[c].max(1e-300);
    let cell = (0..problem.cells.len())
        .filter(|c| problem.cells[*c].channel != Channel::EndEffector && above(*c) > BEYOND)
        .max_by(|a, b| above(*a).total_cmp(&above(*b)))?;
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
    Some(Seldom { cell, rms: (total / of.rows.len().max(1) as f64).sqrt(), share: inside / total.max(1e-300), stretches })
}
