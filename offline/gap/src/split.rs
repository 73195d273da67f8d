//! What is fitted on, and what is held out.

use crate::run::{Both, Extent};

/// Share of a single run that is held out.
pub(crate) const HELD_OUT: f64 = 1.0 / 3.0;

/// What is fitted on, and what is held out: the last quarter of the runs, at least one; of a single run its last third.
pub(crate) fn split(mut runs: Vec<Both>) -> (Vec<Both>, Vec<Both>) {
    if let [(real, sim)] = runs.as_slice() {
        let (cut, from) = cut(real.extent());
        let part = |from: usize, to: usize| (real.slice(from, to), sim.as_ref().map(|sim| sim.slice(from, to)));
        return (vec![part(0, cut)], vec![part(from, real.len())]);
    }
    let held = runs.split_off(runs.len() - held_out_of(runs.len()));
    (runs, held)
}

/// End of what is fitted of a single run, and begin of what is held out, samples: a second between them, so that neither window nor memory
/// reaches over.
pub(crate) fn cut(run: Extent) -> (usize, usize) {
    let cut = (run.samples as f64 * (1.0 - HELD_OUT)) as usize;
    (cut, (cut + (1.0 / run.dt_s) as usize).min(run.samples.saturating_sub(1)))
}

/// How many of several runs are held out.
pub(crate) fn held_out_of(runs: usize) -> usize {
    (runs / 4).max(1)
}
