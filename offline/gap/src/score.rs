//! Held-out likelihood of sets of candidates, from Gram matrices per cell and block.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::hypothesis::{Bound, Candidate, Column};
use crate::linear;
use crate::noise::{Noise, correlation_time};
use crate::nuisance::Projection;
use crate::problem::Problem;
use crate::series::rms;

/// Whitened parts of columns: for each, its cells.
type Parts = Vec<(usize, Vec<f64>)>;

/// Residuals, whitened.
pub struct Scorer<'a> {
    problem: &'a Problem<'a>,
    noise: Vec<Noise>,
    beside: Vec<Projection>,
    whitened: Vec<Vec<f64>>,
    /// Rows of a block that follow each other, with the block, per cell.
    stretches: Vec<Vec<(Range<usize>, usize)>>,
    /// Rows that count as one, per cell.
    pub correlation: Vec<f64>,
}

/// Sums of products of `p` columns and the residual (last), per cell and block.
#[derive(Clone)]
pub struct Grams {
    columns: usize,
    /// `[cell][block]`, (p+1)×(p+1).
    sums: Vec<Vec<DMatrix<f64>>>,
    /// Shared with the grams that have more columns.
    parts: Vec<Arc<Parts>>,
}

impl Grams {
    /// Of some of the columns, in their order.
    #[must_use]
    pub fn only(&self, columns: &[usize]) -> Self {
        let kept: Vec<usize> = columns.iter().copied().chain([self.columns]).collect();
        let of_kept = |sums: &DMatrix<f64>| DMatrix::from_fn(kept.len(), kept.len(), |i, j| sums[(kept[i], kept[j])]);
        Self {
            columns: columns.len(),
            sums: self.sums.iter().map(|cell| cell.iter().map(of_kept).collect()).collect(),
            parts: columns.iter().map(|k| self.parts[*k].clone()).collect(),
        }
    }

    /// How many columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
}

/// A fitted set.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Coefficients.
    pub coefficients: Vec<f64>,
    /// Held-out squared error of the innovations per cell and block.
    pub held_out: Vec<Vec<f64>>,
    /// Squared error per cell with all blocks in the fit.
    pub within: Vec<f64>,
    /// Coefficients with each block left out.
    pub without: Vec<Vec<f64>>,
}

/// Series that a column is multiplied with at once: each sum waits for its own last term only.
const SIDE_BY_SIDE: usize = 4;
/// Blocks without which their scatter is not taken for known.
const ENOUGH_BLOCKS: usize = 5;

/// How much better one fit predicts than another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Log likelihood of what was held out, nats.
    pub nats: f64,
    /// Its standard error over blocks.
    pub error: f64,
    /// What remains without the block that says most.
    pub least: f64,
    /// Standard errors over blocks that the squared error explained is above none; 0 where too few blocks tell. Where one block keeps more
    /// error than all others hold, `error` is large though each of them is explained.
    pub explained: f64,
    /// The same by ranks (Wilcoxon): of how many blocks more is explained than lost, whatever the largest ones say.
    pub ranks: f64,
}

impl<'a> Scorer<'a> {
    /// With the noise of each cell.
    pub fn new(problem: &'a Problem<'a>, noise: Vec<Noise>) -> Self {
        let mut whitened: Vec<Vec<f64>> =
            (0..problem.cells.len()).map(|c| whiten(problem, &noise[c], c, &problem.cells[c].residual)).collect();
        let correlation = vec![1.0; whitened.len()];
        let beside: Vec<Projection> = (0..whitened.len())
            .map(|c| {
                let columns: Vec<Vec<f64>> =
                    problem.nuisances[c].columns.iter().map(|x| whiten(problem, &noise[c], c, x)).collect();
                Projection::new(&columns, rms(whitened[c].iter().copied()))
            })
            .collect();
        whitened.iter_mut().zip(&beside).for_each(|(y, beside)| beside.apply(y));
        let stretches = problem.blocks.iter().map(|blocks| stretches(blocks)).collect();
        Self { problem, noise, beside, whitened, stretches, correlation }
    }

    /// Residual of a fit, whitened, per cell.
    pub fn left(&self, grams: &Grams, fit: &Fit) -> Vec<Vec<f64>> {
        let mut left = self.whitened.clone();
        for (parts, theta) in grams.parts.iter().zip(&fit.coefficients) {
            for (c, values) in parts.iter() {
                left[*c].iter_mut().zip(values).for_each(|(y, x)| *y -= theta * x);
            }
        }
        left
    }

    /// Takes every row for itself.
    pub fn untempered(&mut self) {
        self.correlation.fill(1.0);
    }

    /// Takes the correlation times of a fit's residual.
    pub fn temper(&mut self, grams: &Grams, fit: &Fit) {
        let left = self.left(grams, fit);
        self.correlation = (0..left.len())
            .map(|c| {
                let parts: Vec<&[f64]> = segments(self.problem, c).into_iter().map(|s| &left[c][s]).collect();
                correlation_time(&parts)
            })
            .collect();
    }

    fn parts(&self, column: &Column) -> Parts {
        let whitened = |c: usize, values: &[f32]| {
            let values: Vec<f64> = values.iter().map(|x| f64::from(*x)).collect();
            let mut series = whiten(self.problem, &self.noise[c], c, &values);
            self.beside[c].apply(&mut series);
            series
        };
        column.parts.iter().map(|(c, values)| (*c, whitened(*c, values))).collect()
    }

    /// Grams of nothing but the residual.
    pub fn empty(&self) -> Grams {
        let sums = self
            .whitened
            .iter()
            .enumerate()
            .map(|(c, y)| {
                let mut sums = vec![DMatrix::zeros(1, 1); self.problem.block_count];
                y.iter().zip(&self.problem.blocks[c]).for_each(|(y, b)| sums[*b][(0, 0)] += y * y);
                sums
            })
            .collect();
        Grams { columns: 0, sums, parts: Vec::new() }
    }

    /// Grams of some candidates, in their order.
    pub fn grams<'c>(&self, candidates: impl IntoIterator<Item = &'c Candidate>) -> Grams {
        candidates.into_iter().fold(self.empty(), |grams, candidate| self.extended(&grams, &candidate.columns))
    }

    /// Grams with more columns.
    pub fn extended(&self, grams: &Grams, columns: &[Column]) -> Grams {
        let (old, new) = (grams.columns, columns.len());
        let p = old + new;
        let fresh: Vec<Arc<Parts>> = columns.iter().map(|column| Arc::new(self.parts(column))).collect();
        let mut sums: Vec<Vec<DMatrix<f64>>> = grams
            .sums
            .iter()
            .map(|cell| {
                cell.iter()
                    .map(|g| {
                        DMatrix::from_fn(p + 1, p + 1, |i, j| {
                            let place = |k: usize| {
                                if k < old {
                                    Some(k)
                                } else if k == p {
                                    Some(old)
                                } else {
                                    None
                                }
                            };
                            match (place(i), place(j)) {
                                (Some(i), Some(j)) => g[(i, j)],
                                _ => 0.0,
                            }
                        })
                    })
                    .collect()
            })
            .collect();
        for (k, parts) in fresh.iter().enumerate() {
            for (c, values) in parts.iter() {
                let before = grams.parts.iter().chain(&fresh[..=k]).enumerate();
                let in_cell = before.filter_map(|(other, parts)| {
                    let (_, series) = parts.iter().find(|(cell, _)| cell == c)?;
                    Some((other, series.as_slice()))
                });
                let others: Vec<(usize, &[f64])> = [(p, self.whitened[*c].as_slice())].into_iter().chain(in_cell).collect();
                for some in others.chunks(SIDE_BY_SIDE) {
                    let series: [&[f64]; SIDE_BY_SIDE] = std::array::from_fn(|s| some.get(s).unwrap_or(&some[0]).1);
                    let totals = self.products(*c, values, series);
                    for (s, (other, _)) in some.iter().enumerate() {
                        for (sums, total) in sums[*c].iter_mut().zip(&totals) {
                            sums[(old + k, *other)] = total[s];
                            sums[(*other, old + k)] = total[s];
                        }
                    }
                }
            }
        }
        let mut parts = grams.parts.clone();
        parts.extend(fresh);
        Grams { columns: p, sums, parts }
    }

    /// Sums of products of a column with some series in a cell, per block.
    fn products(&self, cell: usize, values: &[f64], series: [&[f64]; SIDE_BY_SIDE]) -> Vec<[f64; SIDE_BY_SIDE]> {
        let mut totals = vec![[0.0; SIDE_BY_SIDE]; self.problem.block_count];
        for (rows, block) in &self.stretches[cell] {
            let mut sums = totals[*block];
            let there = series.map(|series| &series[rows.clone()]);
            for (i, x) in values[rows.clone()].iter().enumerate() {
                for (sum, series) in sums.iter_mut().zip(there) {
                    *sum += x * series[i];
                }
            }
            totals[*block] = sums;
        }
        totals
    }

    /// Fits, and predicts each block from the others.
    pub fn fit(&self, grams: &Grams) -> Fit {
        let p = grams.columns;
        let cells = grams.sums.len();
        let totals: Vec<DMatrix<f64>> =
            grams.sums.iter().map(|cell| cell.iter().fold(DMatrix::zeros(p + 1, p + 1), |a, b| a + b)).collect();
        let mut weights: Vec<f64> = (0..cells).map(|c| self.rows(c) / totals[c][(p, p)].max(1e-300)).collect();
        let mut coefficients = DVector::zeros(p);
        let mut within = vec![0.0; cells];
        for _ in 0..3 {
            let (mut gram, right) = weighted(&totals, &weights, p);
            coefficients = right;
            linear::solve(&mut gram, &mut coefficients);
            for c in 0..cells {
                within[c] = squared_error(&totals[c], &coefficients, p);
                weights[c] = self.rows(c) / within[c].max(1e-300);
            }
        }
        let mut held_out = vec![vec![0.0; self.problem.block_count]; cells];
        let mut without = Vec::with_capacity(self.problem.block_count);
        let (gram, right) = weighted(&totals, &weights, p);
        for b in 0..self.problem.block_count {
            let (mut gram, mut theta) = (gram.clone(), right.clone());
            for c in 0..cells {
                let sums = &grams.sums[c][b];
                for i in 0..p {
                    theta[i] -= weights[c] * sums[(i, p)];
                    for j in 0..p {
                        gram[(i, j)] -= weights[c] * sums[(i, j)];
                    }
                }
            }
            linear::solve(&mut gram, &mut theta);
            for c in 0..cells {
                held_out[c][b] = squared_error(&grams.sums[c][b], &theta, p);
            }
            without.push(theta.as_slice().to_vec());
        }
        Fit { coefficients: coefficients.as_slice().to_vec(), held_out, within, without }
    }

    /// Negative log likelihood of a fit on all rows, nats, up to a constant.
    pub fn misfit(&self, fit: &Fit) -> f64 {
        fit.within.iter().enumerate().map(|(c, sum)| 0.5 * self.rows(c) / self.correlation[c] * sum.max(1e-300).ln()).sum()
    }

    /// Misfit of a candidate beside the rest, infinite where its coefficients may not be, and these.
    pub fn fitted(&self, base: &Grams, candidate: &Candidate) -> (f64, Vec<f64>) {
        let fit = self.fit(&self.extended(base, &candidate.columns));
        let own = fit.coefficients[fit.coefficients.len() - candidate.columns.len()..].to_vec();
        (if within_bounds(candidate, &fit) { self.misfit(&fit) } else { f64::INFINITY }, own)
    }

    fn rows(&self, cell: usize) -> f64 {
        self.whitened[cell].len() as f64
    }

    /// Gain of `better` over `base` on what was held out.
    pub fn gain(&self, base: &Fit, better: &Fit) -> Gain {
        self.gain_in(base, better, |_| true)
    }

    /// The same, its errors those over the blocks where the difference shows: the others say nothing of its scatter.
    pub fn gain_in(&self, base: &Fit, better: &Fit, shows: impl Fn(usize) -> bool) -> Gain {
        let cells = 0..base.held_out.len();
        let sums = |fit: &Fit| -> Vec<Without> { cells.clone().map(|c| Without::of(&fit.held_out[c])).collect() };
        let (of_base, of_better) = (sums(base), sums(better));
        let total = |skip: Option<usize>| -> f64 {
            let of_cell = |c: usize| {
                let sum = |of: &[Without]| of[c].sum(skip).max(1e-300);
                0.5 * self.rows(c) / self.correlation[c] * (sum(&of_base) / sum(&of_better)).ln()
            };
            cells.clone().map(of_cell).sum()
        };
        let blocks = 0..self.problem.block_count;
        let left: Vec<f64> = blocks.clone().map(|b| total(Some(b))).collect();
        let least = left.iter().copied().fold(f64::INFINITY, f64::min);
        let there = |values: &[f64]| -> Vec<f64> { blocks.clone().filter(|b| shows(*b)).map(|b| values[b]).collect() };
        let nats = total(None);
        let error = error_of_sum(&there(&left)).unwrap_or(nats.abs());
        let unit: Vec<f64> = (0..better.held_out.len())
            .map(|c| self.rows(c) / self.correlation[c] / better.held_out[c].iter().sum::<f64>().max(1e-300))
            .collect();
        let in_block =
            |b: usize| unit.iter().enumerate().map(|(c, unit)| unit * (base.held_out[c][b] - better.held_out[c][b])).sum();
        let of_blocks = there(&blocks.clone().map(in_block).collect::<Vec<f64>>());
        let explained = match error_of_sum(&of_blocks) {
            Some(error) if of_blocks.len() >= ENOUGH_BLOCKS => of_blocks.iter().sum::<f64>() / error.max(1e-300),
            _ => 0.0,
        };
        let ranks = signed_ranks(&of_blocks);
        Gain { nats, error, least, explained, ranks }
    }
}

/// Sums of a series up to each place and from each on: the whole without one of its parts, as exact as the whole.
struct Without {
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Without {
    fn of(series: &[f64]) -> Self {
        let up_to = |values: &mut dyn Iterator<Item = &f64>| -> Vec<f64> {
            let sums = values.scan(0.0, |sum, x| {
                *sum += x;
                Some(*sum)
            });
            [0.0].into_iter().chain(sums).collect()
        };
        let (before, mut after) = (up_to(&mut series.iter()), up_to(&mut series.iter().rev()));
        after.reverse();
        Self { before, after }
    }

    fn sum(&self, skip: Option<usize>) -> f64 {
        skip.map_or(self.after[0], |b| self.before[b] + self.after[b + 1])
    }
}

/// Standard error of a sum over blocks, from its parts or from the sums without each; one block alone says nothing of it.
fn error_of_sum(values: &[f64]) -> Option<f64> {
    let blocks = values.len() as f64;
    let mean = values.iter().sum::<f64>() / blocks.max(1.0);
    let spread: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (values.len() > 1).then(|| (blocks / (blocks - 1.0) * spread).sqrt())
}

/// Wilcoxon's signed ranks, in their standard deviations if signs were even.
fn signed_ranks(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| *x != 0.0).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let sum: f64 = sorted.iter().zip(1..).map(|(x, rank)| f64::from(rank) * x.signum()).sum();
    let n = sorted.len() as f64;
    sum / (n * (n + 1.0) * (2.0 * n + 1.0) / 6.0).sqrt().max(1e-300)
}

/// Share of what is there that a coefficient held against it has to be: less fits the noise of standstills.
const OF_ALL: f64 = 0.2;

/// Are the coefficients of a candidate, the last ones of a fit, what they may be?
pub fn within_bounds(candidate: &Candidate, fit: &Fit) -> bool {
    let own = &fit.coefficients[fit.coefficients.len() - candidate.columns.len()..];
    own.iter().zip(&candidate.family.bounds).enumerate().all(|(k, (x, bound))| match bound {
        Bound::Free => true,
        Bound::Positive => *x > 0.0,
        Bound::Between(low, high) => (*low..=*high).contains(x),
        Bound::Within(times) => own.first().is_some_and(|first| x.abs() <= times * first.abs()),
        Bound::UpTo(times, there) => {
            let before = k.checked_sub(1).map_or(0.0, |before| own[before]);
            let by_itself = *x <= times * before;
            let of_all = *there > 0.0 && (OF_ALL * there..=times * (there + before)).contains(x);
            *x > 0.0 && (by_itself || of_all)
        }
    })
}

fn weighted(totals: &[DMatrix<f64>], weights: &[f64], p: usize) -> (DMatrix<f64>, DVector<f64>) {
    let mut gram = DMatrix::zeros(p, p);
    let mut right = DVector::zeros(p);
    for (total, weight) in totals.iter().zip(weights) {
        for i in 0..p {
            right[i] += weight * total[(i, p)];
            for j in 0..p {
                gram[(i, j)] += weight * total[(i, j)];
            }
        }
    }
    (gram, right)
}

/// Squared error of the residual less the columns times `theta`, from sums of products.
fn squared_error(sums: &DMatrix<f64>, theta: &DVector<f64>, p: usize) -> f64 {
    let mut error = sums[(p, p)];
    for i in 0..p {
        error -= 2.0 * theta[i] * sums[(i, p)];
        for j in 0..p {
            error += theta[i] * theta[j] * sums[(i, j)];
        }
    }
    error.max(0.0)
}

/// Innovations of a cell's series, run by run.
pub(crate) fn whiten(problem: &Problem, noise: &Noise, cell: usize, series: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(series.len());
    for segment in segments(problem, cell) {
        noise.whiten(&series[segment], &mut out);
    }
    out
}

/// Rows that follow each other in the same block.
fn stretches(blocks: &[usize]) -> Vec<(Range<usize>, usize)> {
    let mut start = 0;
    let of = |same: &[usize]| {
        start += same.len();
        (start - same.len()..start, same[0])
    };
    blocks.chunk_by(|a, b| a == b).map(of).collect()
}

/// Rows of a cell, run by run.
pub fn segments(problem: &Problem, cell: usize) -> Vec<Range<usize>> {
    let rows = &problem.cells[cell].rows;
    let mut all = Vec::new();
    let mut start = 0;
    while let Some((run, _)) = rows.get(start) {
        let end = start + rows[start..].partition_point(|row| row.0 == *run);
        all.push(start..end);
        start = end;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::signed_ranks;

    #[test]
    fn ranks_tell_how_many_blocks_agree_and_not_by_how_much() {
        // All of eight: 36 / sqrt(8 * 9 * 17 / 6).
        let all = 36.0 / 204.0_f64.sqrt();
        assert!((signed_ranks(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 1e6]) - all).abs() < 1e-12);
        assert!((signed_ranks(&[1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -1e6]) - 20.0 / 204.0_f64.sqrt()).abs() < 1e-12);
        assert!(signed_ranks(&[1.0, -1.1, 1.2, -1.3]).abs() < 0.5);
        assert!(signed_ranks(&[]).abs() < 1e-12);
    }
}
