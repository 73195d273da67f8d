//! Random forest of regression trees (Breiman 2001): bootstrap rows, a random third of the inputs at each split, quantile bins.

use super::{Rival, rows};
use crate::data::Trajectory;
use crate::random::Random;

const TREES: usize = 40;
const DEPTH_MAX: usize = 16;
const LEAF_MIN: usize = 8;
/// Candidate thresholds per input.
const BINS: usize = 64;
/// Rows that one tree sees at most.
const ROWS_MAX: usize = 40_000;

enum Node {
    Leaf(Vec<f32>),
    Split { input: usize, threshold: f32, low: usize, high: usize },
}

/// A forest on chosen inputs.
pub struct Forest {
    inputs: Vec<usize>,
    seed: u64,
    trees: Vec<Vec<Node>>,
    outputs: usize,
}

/// Rows in bins.
struct Table {
    /// Per input: rising thresholds.
    edges: Vec<Vec<f32>>,
    /// Row-major bins of the chosen inputs.
    bins: Vec<u8>,
    labels: Vec<f32>,
    inputs: usize,
    outputs: usize,
}

impl Forest {
    /// A forest that looks at these inputs only.
    pub fn new(inputs: &[usize], seed: u64) -> Self {
        Self { inputs: inputs.to_vec(), seed, trees: Vec::new(), outputs: 0 }
    }

    /// Learns from given labels instead of the trajectories' own.
    pub(super) fn fit_labels(&mut self, train: &[Trajectory], labels: Vec<f32>, outputs: usize) {
        self.outputs = outputs;
        let table = self.table(train, labels);
        let all = table.labels.len() / outputs.max(1);
        let mut random = Random::new(self.seed, 31);
        self.trees = (0..TREES)
            .map(|_| {
                let mut chosen: Vec<usize> = (0..all.min(ROWS_MAX)).map(|_| random.below(all)).collect();
                let mut tree = Vec::new();
                grow(&table, &mut chosen, 0, &mut tree, &mut random);
                tree
            })
            .collect();
    }

    fn table(&self, train: &[Trajectory], labels: Vec<f32>) -> Table {
        let all: Vec<&[f32]> = train.iter().flat_map(rows).collect();
        let edges: Vec<Vec<f32>> = self
            .inputs
            .iter()
            .map(|input| {
                let step = (all.len() / 20_000).max(1);
                let mut values: Vec<f32> = all.iter().step_by(step).map(|row| row[*input]).collect();
                values.sort_by(f32::total_cmp);
                let mut edges: Vec<f32> = (1..BINS).filter_map(|k| values.get(k * values.len() / BINS).copied()).collect();
                edges.dedup();
                edges
            })
            .collect();
        let bins = all
            .iter()
            .flat_map(|row| {
                self.inputs.iter().zip(&edges).map(|(input, edges)| edges.partition_point(|edge| *edge < row[*input]) as u8)
            })
            .collect();
        Table { edges, bins, labels, inputs: self.inputs.len(), outputs: self.outputs }
    }

    pub(super) fn row(&self, row: &[f32]) -> Vec<f32> {
        let mut sum = vec![0.0_f32; self.outputs];
        for tree in &self.trees {
            let mut at = 0;
            while let Some(Node::Split { input, threshold, low, high }) = tree.get(at) {
                at = if row[self.inputs[*input]] <= *threshold { *low } else { *high };
            }
            if let Some(Node::Leaf(mean)) = tree.get(at) {
                sum.iter_mut().zip(mean).for_each(|(sum, mean)| *sum += mean / self.trees.len() as f32);
            }
        }
        sum
    }
}

impl Rival for Forest {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        let labels = train.iter().flat_map(|one| one.labels.iter().copied()).collect();
        self.fit_labels(train, labels, outputs);
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        rows(one).flat_map(|row| self.row(row)).collect()
    }
}

/// Grows a tree over these rows; gives the index of its root.
fn grow(table: &Table, chosen: &mut [usize], depth: usize, tree: &mut Vec<Node>, random: &mut Random) -> usize {
    let at = tree.len();
    let split = if depth < DEPTH_MAX && chosen.len() >= 2 * LEAF_MIN { best_split(table, chosen, random) } else { None };
    let Some((input, bin)) = split else {
        tree.push(Node::Leaf(mean(table, chosen)));
        return at;
    };
    tree.push(Node::Leaf(Vec::new()));
    let middle = partition(chosen, |row| usize::from(table.bins[row * table.inputs + input]) <= bin);
    let (left, right) = chosen.split_at_mut(middle);
    let low = grow(table, left, depth + 1, tree, random);
    let high = grow(table, right, depth + 1, tree, random);
    tree[at] = Node::Split { input, threshold: table.edges[input][bin], low, high };
    at
}

/// Input and bin with the largest fall of the squares, rows of bins up to it on the low side.
fn best_split(table: &Table, chosen: &[usize], random: &mut Random) -> Option<(usize, usize)> {
    let outputs = table.outputs;
    let mut best = (0.0, None);
    for _ in 0..table.inputs.div_ceil(3) {
        let input = random.below(table.inputs);
        let mut counts = [0_usize; BINS];
        let mut sums = vec![0.0_f64; BINS * outputs];
        for row in chosen {
            let bin = usize::from(table.bins[row * table.inputs + input]).min(BINS - 1);
            counts[bin] += 1;
            for output in 0..outputs {
                sums[bin * outputs + output] += f64::from(table.labels[row * outputs + output]);
            }
        }
        let total: Vec<f64> = (0..outputs).map(|output| (0..BINS).map(|bin| sums[bin * outputs + output]).sum()).collect();
        let whole = total.iter().map(|sum| sum * sum).sum::<f64>() / chosen.len() as f64;
        let (mut n, mut low) = (0, vec![0.0; outputs]);
        for bin in 0..table.edges[input].len() {
            n += counts[bin];
            low.iter_mut().enumerate().for_each(|(output, low)| *low += sums[bin * outputs + output]);
            let rest = chosen.len() - n;
            if n < LEAF_MIN || rest < LEAF_MIN {
                continue;
            }
            let squares = |of: f64, n: usize| of * of / n as f64;
            let gain: f64 =
                low.iter().zip(&total).map(|(low, total)| squares(*low, n) + squares(total - low, rest)).sum::<f64>() - whole;
            if gain > best.0 {
                best = (gain, Some((input, bin)));
            }
        }
    }
    best.1
}

fn mean(table: &Table, chosen: &[usize]) -> Vec<f32> {
    let n = chosen.len().max(1) as f64;
    let sum = |output: usize| chosen.iter().map(|row| f64::from(table.labels[row * table.outputs + output])).sum::<f64>();
    (0..table.outputs).map(|output| (sum(output) / n) as f32).collect()
}

/// Moves those that fulfil it to the front; how many there are.
fn partition(rows: &mut [usize], is_low: impl Fn(usize) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..rows.len() {
        if is_low(rows[i]) {
            rows.swap(i, middle);
            middle += 1;
        }
    }
    middle
}
