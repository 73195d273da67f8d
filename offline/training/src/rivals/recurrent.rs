//! A gated recurrent unit (Cho 2014, in the form of Chung 2014) that reads a trajectory row by row: what it needs of the past it has to
//! find out itself. Learnt by truncated backpropagation through time.

use super::{Rival, Standard, rows};
use crate::data::Trajectory;
use crate::network::{Activation, Adam};
use crate::random::Random;
use crate::train::label_statistics;
use ndarray::{Array1, Array2, ArrayView2, Axis, linalg::general_mat_mul, s};

/// Numbers that it remembers.
const HIDDEN: usize = 96;
/// Rows through which an error is traced back.
const STEPS: usize = 50;
/// Rows of a piece of a trajectory, at whose start it knows nothing; and pieces that are learnt from side by side.
const PIECE: usize = 1500;
const PIECES: usize = 32;
const EPOCHS: usize = 100;
/// Rate at the start; it falls to 0 along a cosine.
const RATE: f64 = 4e-3;
const DECAY: f64 = 0.02;
/// A gradient longer than this is shortened to it (Pascanu 2013).
const LONGEST: f32 = 1.0;
/// Rows whose inputs are multiplied at once.
const CHUNK_ROWS: usize = 2000;
/// Purpose of the random numbers.
const PURPOSE: u64 = 34;

/// A recurrent network on chosen inputs.
pub struct Recurrent {
    columns: Vec<Vec<(usize, f64)>>,
    seed: u64,
    epochs: usize,
    standard: Standard,
    cell: Cell,
    mean: Vec<f64>,
    scale: f64,
}

/// `z = σ(Wz x + Uz h + bz)`, `r = σ(Wr x + Ur h + br)`, `n = tanh(Wn x + bn + r∘(Un h + c))`, `h' = (1 - z)∘n + z∘h`, `y = V h' + d`.
#[derive(Debug, Clone, Default, PartialEq)]
struct Cell {
    /// z, r and n, 3H x inputs, and their biases.
    w: Array2<f32>,
    b: Array1<f32>,
    /// The same of what is remembered, 3H x H, and the bias within the reset.
    u: Array2<f32>,
    c: Array1<f32>,
    /// Outputs x H, and their bias.
    v: Array2<f32>,
    d: Array1<f32>,
}

/// What the way back needs of one row of each piece.
struct Step {
    before: Array2<f32>,
    z: Array2<f32>,
    r: Array2<f32>,
    n: Array2<f32>,
    /// `Un h + c`.
    recalled: Array2<f32>,
    after: Array2<f32>,
}

impl Cell {
    fn new(inputs: usize, hidden: usize, outputs: usize, random: &mut Random) -> Self {
        let mut matrix = |rows: usize, columns: usize, limit: f64| {
            Array2::from_shape_fn((rows, columns), |_| (limit * (2.0 * random.share() - 1.0)) as f32)
        };
        let (inwards, around) = ((3.0 / inputs.max(1) as f64).sqrt(), (1.0 / hidden as f64).sqrt());
        let (w, u, v) = (matrix(3 * hidden, inputs, inwards), matrix(3 * hidden, hidden, around), matrix(outputs, hidden, around));
        // It begins by remembering: else no error reaches far back.
        let b = Array1::from_shape_fn(3 * hidden, |k| if k < hidden { 1.0 } else { 0.0 });
        Self { w, b, u, c: Array1::zeros(hidden), v, d: Array1::zeros(outputs) }
    }

    fn hidden(&self) -> usize {
        self.c.len()
    }

    /// `W x + b` of many rows.
    fn inwards(&self, x: &ArrayView2<f32>) -> Array2<f32> {
        let mut out = Array2::zeros((x.nrows(), self.w.nrows()));
        general_mat_mul(1.0, x, &self.w.t(), 0.0, &mut out);
        out + &self.b
    }

    /// One row of each piece, from its [`Cell::inwards`].
    fn step(&self, inwards: &ArrayView2<f32>, before: &Array2<f32>) -> Step {
        let h = self.hidden();
        let mut around = Array2::zeros((before.nrows(), 3 * h));
        general_mat_mul(1.0, before, &self.u.t(), 0.0, &mut around);
        let gate = |from: usize| {
            activated(&inwards.slice(s![.., from..from + h]) + &around.slice(s![.., from..from + h]), Activation::Sigmoid)
        };
        let (z, r) = (gate(0), gate(h));
        let recalled = &around.slice(s![.., 2 * h..]) + &self.c;
        let n = activated(&inwards.slice(s![.., 2 * h..]) + &(&r * &recalled), Activation::Tanh);
        let after = &n + &(&z * &(before - &n));
        Step { before: before.clone(), z, r, n, recalled, after }
    }

    fn outputs(&self, hidden: &Array2<f32>) -> Array2<f32> {
        hidden.dot(&self.v.t()) + &self.d
    }

    /// Gradients of [`Cell::numbers`] from those of the outputs of each step; `x` holds the inputs of all steps, one after the other.
    fn backward(&self, x: &ArrayView2<f32>, steps: &[Step], errors: &[Array2<f32>]) -> Vec<Vec<f32>> {
        let h = self.hidden();
        let pieces = steps.first().map_or(0, |step| step.after.nrows());
        let mut inner = Array2::zeros((steps.len() * pieces, 3 * h));
        let mut outer = inner.clone();
        let mut befores = Array2::zeros((steps.len() * pieces, h));
        let (mut v, mut d) = (Array2::zeros(self.v.raw_dim()), Array1::zeros(self.d.len()));
        let mut later = Array2::zeros((pieces, h));
        for (k, (step, error)) in steps.iter().zip(errors).enumerate().rev() {
            general_mat_mul(1.0, &error.t(), &step.after, 1.0, &mut v);
            d += &error.sum_axis(Axis(0));
            let gradient = error.dot(&self.v) + &later;
            let to_n = &gradient * &step.z.mapv(|z| 1.0 - z) * &step.n.mapv(|n| 1.0 - n * n);
            let to_z = &gradient * &(&step.before - &step.n) * &step.z.mapv(|z| z * (1.0 - z));
            let to_r = &to_n * &step.recalled * &step.r.mapv(|r| r * (1.0 - r));
            let rows = k * pieces..(k + 1) * pieces;
            inner.slice_mut(s![rows.clone(), ..h]).assign(&to_z);
            inner.slice_mut(s![rows.clone(), h..2 * h]).assign(&to_r);
            inner.slice_mut(s![rows.clone(), 2 * h..]).assign(&(&to_n * &step.r));
            outer.slice_mut(s![rows.clone(), ..2 * h]).assign(&inner.slice(s![rows.clone(), ..2 * h]));
            outer.slice_mut(s![rows.clone(), 2 * h..]).assign(&to_n);
            befores.slice_mut(s![rows.clone(), ..]).assign(&step.before);
            later = &gradient * &step.z + inner.slice(s![rows, ..]).dot(&self.u);
        }
        let (mut w, mut u) = (Array2::zeros(self.w.raw_dim()), Array2::zeros(self.u.raw_dim()));
        general_mat_mul(1.0, &outer.t(), x, 0.0, &mut w);
        general_mat_mul(1.0, &inner.t(), &befores, 0.0, &mut u);
        let (b, c) = (outer.sum_axis(Axis(0)), inner.slice(s![.., 2 * h..]).sum_axis(Axis(0)));
        let flat = |matrix: Array2<f32>| matrix.into_iter().collect::<Vec<f32>>();
        vec![flat(w), b.to_vec(), flat(u), c.to_vec(), flat(v), d.to_vec()]
    }

    /// What is learnt.
    fn numbers(&mut self) -> [&mut [f32]; 6] {
        [
            self.w.as_slice_mut().unwrap_or_default(),
            self.b.as_slice_mut().unwrap_or_default(),
            self.u.as_slice_mut().unwrap_or_default(),
            self.c.as_slice_mut().unwrap_or_default(),
            self.v.as_slice_mut().unwrap_or_default(),
            self.d.as_slice_mut().unwrap_or_default(),
        ]
    }
}

fn activated(mut sums: Array2<f32>, activation: Activation) -> Array2<f32> {
    activation.apply(sums.as_slice_memory_order_mut().unwrap_or_default());
    sums
}

/// Which of [`Cell::numbers`] are weights.
const WEIGHTS: [bool; 6] = [true, false, true, false, true, false];

/// Shortens gradients to [`LONGEST`] together.
fn shorten(gradients: &mut [Vec<f32>]) {
    let length = gradients.iter().flatten().map(|g| g * g).sum::<f32>().sqrt();
    if length > LONGEST {
        gradients.iter_mut().flatten().for_each(|g| *g *= LONGEST / length);
    }
}

/// A piece of a trajectory, standardised.
struct Piece {
    x: Array2<f32>,
    y: Array2<f32>,
}

impl Recurrent {
    /// On these sums of inputs.
    pub fn new(columns: Vec<Vec<(usize, f64)>>, seed: u64) -> Self {
        Self { columns, seed, epochs: EPOCHS, standard: Standard::default(), cell: Cell::default(), mean: Vec::new(), scale: 1.0 }
    }

    fn inputs(&self, one: &Trajectory) -> Array2<f32> {
        self.standard.of_all(rows(one)).mapv(|x| x as f32)
    }

    fn pieces(&self, train: &[Trajectory], outputs: usize) -> Vec<Piece> {
        let mut all = Vec::new();
        for one in train {
            let x = self.inputs(one);
            let y = Array2::from_shape_fn((one.rows(), outputs), |(row, axis)| {
                ((f64::from(one.labels[row * outputs + axis]) - self.mean[axis]) / self.scale) as f32
            });
            let count = one.rows().div_ceil(PIECE).max(1);
            for k in 0..count {
                let part = s![k * one.rows() / count..(k + 1) * one.rows() / count, ..];
                all.push(Piece { x: x.slice(part).to_owned(), y: y.slice(part).to_owned() });
            }
        }
        all
    }

    /// One pass through some pieces side by side; those that are shorter say nothing at the end.
    fn learn(&mut self, pieces: &[&Piece], adam: &mut Adam, rate: f64) {
        let longest = pieces.iter().map(|piece| piece.x.nrows()).max().unwrap_or(0);
        let (inputs, outputs) = (self.standard.width(), self.mean.len());
        let mut state = Array2::zeros((pieces.len(), self.cell.hidden()));
        for from in (0..longest).step_by(STEPS) {
            let count = STEPS.min(longest - from);
            let mut x = Array2::zeros((count * pieces.len(), inputs));
            for (p, piece) in pieces.iter().enumerate() {
                for k in 0..count.min(piece.x.nrows().saturating_sub(from)) {
                    x.row_mut(k * pieces.len() + p).assign(&piece.x.row(from + k));
                }
            }
            let inwards = self.cell.inwards(&x.view());
            let rows = pieces.iter().map(|piece| count.min(piece.x.nrows().saturating_sub(from))).sum::<usize>();
            let weight = 1.0 / (rows.max(1) * outputs) as f32;
            let (mut steps, mut errors) = (Vec::with_capacity(count), Vec::with_capacity(count));
            for k in 0..count {
                let step = self.cell.step(&inwards.slice(s![k * pieces.len()..(k + 1) * pieces.len(), ..]), &state);
                state.assign(&step.after);
                let mut error = self.cell.outputs(&state);
                for (mut error, piece) in error.rows_mut().into_iter().zip(pieces) {
                    match (from + k < piece.y.nrows()).then(|| piece.y.row(from + k)) {
                        Some(y) => error.zip_mut_with(&y, |error, y| *error = weight * (*error - y)),
                        None => error.fill(0.0),
                    }
                }
                steps.push(step);
                errors.push(error);
            }
            let mut gradients = self.cell.backward(&x.view(), &steps, &errors);
            shorten(&mut gradients);
            adam.step(&mut self.cell.numbers(), &gradients, rate, DECAY, &WEIGHTS);
        }
    }
}

impl Rival for Recurrent {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        self.standard = Standard::fit(self.columns.clone(), train);
        (self.mean, self.scale) = label_statistics(train, outputs);
        let mut random = Random::new(self.seed, PURPOSE);
        self.cell = Cell::new(self.standard.width(), HIDDEN, outputs, &mut random);
        let lengths: Vec<usize> = self.cell.numbers().iter().map(|numbers| numbers.len()).collect();
        let mut adam = Adam::new(lengths.into_iter());
        let pieces = self.pieces(train, outputs);
        let mut order: Vec<&Piece> = pieces.iter().collect();
        for epoch in 0..self.epochs {
            random.shuffle(&mut order);
            let rate = 0.5 * RATE * (1.0 + (std::f64::consts::PI * epoch as f64 / self.epochs as f64).cos());
            for some in order.chunks(PIECES) {
                self.learn(some, &mut adam, rate);
            }
        }
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        let x = self.inputs(one);
        let mut state = Array2::zeros((1, self.cell.hidden()));
        let mut out = Vec::with_capacity(one.rows() * self.mean.len());
        for from in (0..x.nrows()).step_by(CHUNK_ROWS) {
            let inwards = self.cell.inwards(&x.slice(s![from..(from + CHUNK_ROWS).min(x.nrows()), ..]));
            for row in inwards.axis_chunks_iter(Axis(0), 1) {
                state = self.cell.step(&row, &state).after;
                let y = self.cell.outputs(&state);
                out.extend(y.iter().zip(&self.mean).map(|(y, mean)| (f64::from(*y) * self.scale + mean) as f32));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIECES_HERE: usize = 3;
    const STEPS_HERE: usize = 4;

    fn inputs() -> Array2<f32> {
        Array2::from_shape_fn((PIECES_HERE * STEPS_HERE, 2), |(r, c)| (r as f32 * 0.9 + c as f32 * 1.7).sin())
    }

    fn wanted(k: usize) -> Array2<f32> {
        Array2::from_shape_fn((PIECES_HERE, 2), |(p, axis)| ((k * 5 + p * 2 + axis) as f32).cos())
    }

    fn steps(cell: &Cell) -> Vec<Step> {
        let inwards = cell.inwards(&inputs().view());
        let mut state = Array2::from_elem((PIECES_HERE, cell.hidden()), 0.3);
        let rows = |k: usize| s![k * PIECES_HERE..(k + 1) * PIECES_HERE, ..];
        (0..STEPS_HERE)
            .map(|k| {
                let step = cell.step(&inwards.slice(rows(k)), &state);
                state.assign(&step.after);
                step
            })
            .collect()
    }

    fn errors(cell: &Cell) -> Vec<Array2<f32>> {
        steps(cell).iter().enumerate().map(|(k, step)| cell.outputs(&step.after) - wanted(k)).collect()
    }

    #[test]
    fn gradients_through_time_agree_with_differences() {
        let mut random = Random::new(3, 0);
        let mut cell = Cell::new(2, 5, 2, &mut random);
        cell.c.fill(0.4);
        let found = cell.backward(&inputs().view(), &steps(&cell), &errors(&cell));
        let loss = |cell: &Cell| errors(cell).iter().flatten().map(|error| 0.5 * f64::from(*error).powi(2)).sum::<f64>();
        for (slot, found) in found.iter().enumerate() {
            for (at, found) in found.iter().enumerate() {
                let h = 1e-2;
                let shifted = |by: f32| {
                    let mut other = cell.clone();
                    other.numbers()[slot][at] += by;
                    loss(&other)
                };
                let expected = (shifted(h) - shifted(-h)) / f64::from(2.0 * h);
                assert!((f64::from(*found) - expected).abs() < 2e-3 * expected.abs().max(1.0), "{slot} {at} {found} {expected}");
            }
        }
    }

    /// A joint that follows its motor with play: where it stands depends on where the motor came from.
    fn played(seed: u64, rows: usize) -> Trajectory {
        let mut random = Random::new(seed, 0);
        let (mut motor, mut speed, mut joint) = (0.0_f64, 0.0, 0.0_f64);
        let mut one = Trajectory::default();
        for k in 0..rows {
            speed = 0.95 * speed + 0.1 * random.normal();
            motor = 0.98 * motor + 0.2 * speed;
            joint = joint.clamp(motor - 0.5, motor + 0.5);
            one.time_s.push(k as f64 / 30.0);
            one.inputs.push(motor as f32);
            one.labels.push((10.0 + joint - motor) as f32);
        }
        one
    }

    #[test]
    fn it_finds_out_what_to_remember() {
        let train: Vec<Trajectory> = (0..6).map(|seed| played(seed, 3000)).collect();
        let network = |epochs: usize| Recurrent { epochs, ..Recurrent::new(vec![vec![(0, 1.0)]], 1) };
        let mut long = network(24);
        long.fit(&train, 1);
        let test = played(99, 2000);
        let rms = |rest: &mut dyn Iterator<Item = f32>| (rest.map(|x| f64::from(x).powi(2)).sum::<f64>() / 2000.0).sqrt();
        let raw = rms(&mut test.labels.iter().map(|y| y - 10.0));
        let left = rms(&mut long.estimate(&test).iter().zip(&test.labels).map(|(a, b)| a - b));
        // What one position tells leaves most of it.
        let mut forest = super::super::Forest::new(&[0], 1);
        forest.fit(&train, 1);
        let static_left = rms(&mut forest.estimate(&test).iter().zip(&test.labels).map(|(a, b)| a - b));
        assert!(left < 0.25 * raw && left < 0.4 * static_left, "{left} {static_left} {raw}");
        let mut twice = [network(2), network(2)];
        for one in &mut twice {
            one.fit(&train[..1], 1);
        }
        assert_eq!(twice[0].cell, twice[1].cell, "seeded");
    }
}
