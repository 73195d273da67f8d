//! What is fitted on, and what is held out.

use crate::run::Both;

/// Share of a single run that is held out.
pub(crate) const HELD_OUT: f64 = 1.0 / 3.0;

/// What is fitted on, and what is held out: the last quarter of the runs, at least one; of a single run its last third.
pub(crate) fn split(mut runs: Vec<Both>) -> (Vec<Both>, Vec<Both>) {
    if let [(real, sim)] = runs.as_slice() {
        let cut = (real.len() as f64 * (1.0 - HELD_OUT)) as usize;
        // A second between them, so that neither window nor memory reaches over.
        let gap = (1.0 / real.dt_s) as usize;
        let part = |from: usize, to: usize| (real.slice(from, to), sim.as_ref().map(|sim| sim.slice(from, to)));
        return (vec![part(0, cut)], vec![part((cut + gap).min(real.len() - 1), real.len())]);
    }
    let held = runs.split_off(runs.len() - held_out_of(runs.len()));
    (runs, held)
}

/// How many of several runs are held out.
pub(crate) fn held_out_of(runs: usize) -> usize {
    (runs / 4).max(1)
}
