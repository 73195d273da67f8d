//! Training: epochs over shuffled rows of whole trajectories, the best by validation kept.

mod checkpoint;
mod linear;

use crate::data::Trajectory;
use crate::error::TrainingError;
use crate::network::{Adam, Network, NormPlace};
use crate::prepare::Prepared;
use crate::preset::{First, Recipe, Schedule};
use crate::random::Random;
use crate::split::Parts;
use linear::Linear;
use ndarray::{Array2, ArrayView2, Axis};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Purpose of the stream of random numbers for weights and order of rows.
const LEARNING: u64 = 13;
/// Rows that are evaluated at a time.
const CHUNK_ROWS: usize = 4096;
/// Share of the steps in which the rate of a cosine rises.
const WARM_UP: f64 = 0.05;

/// One point of the learning curves; 3D RMS of the rest, in the labels' unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// From 1; 0 is what a line leaves before the network learns.
    pub epoch: usize,
    /// On the rows of training, as they were learnt from.
    pub train_rms: f64,
    /// On the validation trajectories.
    pub validation_rms: f64,
}

/// How far training is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The newest point.
    pub point: Point,
    /// Epochs in all.
    pub epochs: usize,
    /// Wall time of this epoch, s.
    pub epoch_s: f64,
    /// Estimated wall time left, s.
    pub left_s: f64,
}

/// A trained estimator before it is exported.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// The network with the least error on validation.
    pub network: Network,
    /// What it sees.
    pub prepared: Prepared,
    /// Mean of the labels, which the network's output is relative to.
    pub label_mean: Vec<f64>,
    /// Unit of the network's output in the labels' unit.
    pub label_scale: f64,
    /// Learning curves.
    pub curves: Vec<Point>,
    /// Wall time of all epochs, s.
    pub seconds: f64,
    /// Is there a line that the network learnt the rest of?
    pub has_line: bool,
}

impl Trained {
    /// Estimates for rows of raw inputs, row-major, in the labels' unit.
    pub fn estimate(&self, inputs: &[f32]) -> Vec<f32> {
        let raw = self.prepared.mean.len().max(1);
        let mut out = Vec::new();
        for rows in inputs.chunks(raw * CHUNK_ROWS) {
            let y = self.network.forward(&self.prepared.apply(rows).view());
            for row in y.rows() {
                out.extend(row.iter().zip(&self.label_mean).map(|(y, mean)| (f64::from(*y) * self.label_scale + mean) as f32));
            }
        }
        out
    }
}

/// The point with the least RMS on validation.
pub fn best(curves: &[Point]) -> Option<&Point> {
    curves.iter().min_by(|a, b| a.validation_rms.total_cmp(&b.validation_rms))
}

/// Rows as the network sees them.
struct Rows {
    x: Array2<f32>,
    y: Array2<f32>,
}

/// What changes from epoch to epoch, all of which a checkpoint keeps.
pub(crate) struct Course {
    network: Network,
    best: Network,
    adam: Adam,
    random: Random,
    curves: Vec<Point>,
    seconds: f64,
}

/// Learns from the first of the parts and chooses by the second. With a checkpoint file it goes on where that file is, and keeps it up to date.
///
/// # Errors
/// [`TrainingError`] for inputs that are all constant, a checkpoint of another run, or training that diverges.
pub fn train(
    parts: &Parts,
    outputs: usize,
    recipe: &Recipe,
    checkpoint: Option<&Path>,
    told: &mut dyn FnMut(&Progress),
) -> Result<Trained, TrainingError> {
    if recipe.first == First::Either {
        let files = ["nothing", "linear"].map(|extension| checkpoint.map(|file| file.with_added_extension(extension)));
        let mut with =
            |first, file: &Option<PathBuf>| train(parts, outputs, &Recipe { first, ..recipe.clone() }, file.as_deref(), told);
        let (without, after) = (with(First::Nothing, &files[0])?, with(First::Linear, &files[1])?);
        // Only now: until both are there a kill must not lose the first.
        for file in files.iter().flatten() {
            drop(std::fs::remove_file(file));
        }
        let left = |trained: &Trained| best(&trained.curves).map_or(f64::INFINITY, |best| best.validation_rms);
        let seconds = without.seconds + after.seconds;
        return Ok(Trained { seconds, ..if left(&without) <= left(&after) { without } else { after } });
    }
    let Parts { train, validation, .. } = parts;
    let inputs = train.first().map_or(0, |one| one.inputs.len() / one.rows().max(1));
    let prepared = Prepared::fit(train, inputs, recipe.preparation)?;
    let (label_mean, label_scale) = label_statistics(train, outputs);
    let rows = |set: &[Trajectory]| Rows::of(set, &prepared, &label_mean, label_scale);
    let (mut learnt, mut chosen) = (rows(train), rows(validation));
    let line = (recipe.first == First::Linear).then(|| Linear::fit(&learnt, &chosen, recipe.hidden.len()));
    let widths = [&[prepared.width()], recipe.hidden.as_slice(), &[outputs]].concat();
    let mut course = Course::begin(&widths, recipe);
    if let Some(line) = &line {
        for rows in [&mut learnt, &mut chosen] {
            rows.y -= &line.of(&rows.x);
        }
        let of = |rows: &Rows| rms(&course.network, rows) * label_scale;
        let point = Point { epoch: 0, train_rms: of(&learnt), validation_rms: of(&chosen) };
        course.curves.push(point);
    }
    let identity = checkpoint::identity(recipe, train, validation);
    if let Some(file) = checkpoint.filter(|file| file.exists()) {
        checkpoint::load(file, &identity, &mut course)?;
    }
    while course.epochs() < recipe.epochs && !course.is_stale(recipe.patience) {
        let begun = Instant::now();
        let epoch = course.epochs() + 1;
        let train_rms = course.epoch(&learnt, recipe) * label_scale;
        let validation_rms = rms(&course.network, &chosen) * label_scale;
        if !(train_rms.is_finite() && validation_rms.is_finite()) {
            return Err(TrainingError::Diverged { epoch });
        }
        if course.curves.iter().all(|point| validation_rms < point.validation_rms) {
            course.best.clone_from(&course.network);
        }
        let point = Point { epoch, train_rms, validation_rms };
        course.curves.push(point);
        let epoch_s = begun.elapsed().as_secs_f64();
        course.seconds += epoch_s;
        if let Some(file) = checkpoint {
            checkpoint::save(file, &identity, &mut course)?;
        }
        let left_s = course.seconds / epoch as f64 * (recipe.epochs - epoch) as f64;
        told(&Progress { point, epochs: recipe.epochs, epoch_s, left_s });
    }
    let has_line = line.is_some();
    let network = match line {
        Some(line) => line.joined(course.best),
        None => course.best,
    };
    Ok(Trained { network, prepared, label_mean, label_scale, curves: course.curves, seconds: course.seconds, has_line })
}

/// Mean per output, and one scale for all: the RMS deviation over all outputs.
pub(crate) fn label_statistics(train: &[Trajectory], outputs: usize) -> (Vec<f64>, f64) {
    let labels = || train.iter().flat_map(|one| one.labels.chunks_exact(outputs.max(1)));
    let n = labels().count().max(1) as f64;
    let mut mean = vec![0.0; outputs];
    labels().for_each(|row| mean.iter_mut().zip(row).for_each(|(mean, label)| *mean += f64::from(*label) / n));
    let squares: f64 = labels().flat_map(|row| row.iter().zip(&mean).map(|(label, mean)| (f64::from(*label) - mean).powi(2))).sum();
    let scale = (squares / (n * outputs.max(1) as f64)).sqrt();
    (mean, if scale > 0.0 { scale } else { 1.0 })
}

impl Rows {
    fn of(set: &[Trajectory], prepared: &Prepared, mean: &[f64], scale: f64) -> Self {
        let inputs: Vec<Array2<f32>> = set.iter().map(|one| prepared.apply(&one.inputs)).collect();
        let views: Vec<ArrayView2<f32>> = inputs.iter().map(|one| one.view()).collect();
        let x = ndarray::concatenate(Axis(0), &views).unwrap_or_else(|_| Array2::zeros((0, prepared.width())));
        let mut y = Array2::zeros((x.nrows(), mean.len()));
        let labels = set.iter().flat_map(|one| one.labels.chunks_exact(mean.len().max(1)));
        for (mut to, label) in y.rows_mut().into_iter().zip(labels) {
            for ((to, label), mean) in to.iter_mut().zip(label).zip(mean) {
                *to = ((f64::from(*label) - mean) / scale) as f32;
            }
        }
        Self { x, y }
    }
}

impl Course {
    fn begin(widths: &[usize], recipe: &Recipe) -> Self {
        let mut random = Random::new(recipe.seed, LEARNING);
        let mut network = Network::new(widths, recipe.activation, recipe.norm, &mut random);
        // After a line the network begins as nothing.
        if let (First::Linear, Some(last)) = (recipe.first, network.layers.last_mut()) {
            last.weight.fill(0.0);
        }
        let adam = Adam::new(network.numbers().iter().map(|numbers| numbers.len()));
        Self { best: network.clone(), network, adam, random, curves: Vec::new(), seconds: 0.0 }
    }

    /// Epochs so far.
    fn epochs(&self) -> usize {
        self.curves.last().map_or(0, |point| point.epoch)
    }

    /// No better validation for so many epochs?
    fn is_stale(&self, patience: usize) -> bool {
        best(&self.curves).is_some_and(|best| self.epochs() - best.epoch >= patience)
    }

    /// One pass over all rows in random order; the RMS on the way, in units of the network's output.
    fn epoch(&mut self, rows: &Rows, recipe: &Recipe) -> f64 {
        let mut order: Vec<usize> = (0..rows.x.nrows()).collect();
        self.random.shuffle(&mut order);
        let steps = order.len().div_ceil(recipe.batch.max(1));
        let all = (steps * recipe.epochs) as f64;
        let decays = self.network.is_weight();
        let mut squares = 0.0;
        for batch in order.chunks(recipe.batch.max(1)) {
            let (mut gradients, batch_squares) = self.gradients(rows, batch, recipe.norm);
            squares += batch_squares;
            if recipe.l1 > 0.0 {
                add_l1(&mut gradients, &mut self.network, &decays, recipe.l1 as f32);
            }
            let rate = rate(recipe, self.adam.steps as f64 / all);
            self.adam.step(&mut self.network.numbers(), &gradients, rate, recipe.decay, &decays);
        }
        (squares / order.len().max(1) as f64).sqrt()
    }

    /// Gradients of the mean square over a batch. Without batch normalisation its two halves run side by side.
    fn gradients(&mut self, rows: &Rows, batch: &[usize], place: NormPlace) -> (Vec<Vec<f32>>, f64) {
        let weight = 2.0 / (batch.len() * rows.y.ncols()).max(1) as f32;
        if place != NormPlace::None || batch.len() < 2 {
            return part(&mut self.network, rows, batch, weight);
        }
        let (left, right) = batch.split_at(batch.len() / 2);
        let mut other = self.network.clone();
        let network = &mut self.network;
        let ((mut gradients, a), (more, b)) = std::thread::scope(|scope| {
            let side = scope.spawn(|| part(&mut other, rows, right, weight));
            let own = part(network, rows, left, weight);
            (own, side.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
        for (sum, more) in gradients.iter_mut().zip(&more) {
            sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
        (gradients, a + b)
    }
}

fn part(network: &mut Network, rows: &Rows, batch: &[usize], weight: f32) -> (Vec<Vec<f32>>, f64) {
    let x = rows.x.select(Axis(0), batch);
    let wanted = rows.y.select(Axis(0), batch);
    let (mut gradient, tape) = network.forward_train(x);
    gradient -= &wanted;
    let squares = gradient.iter().map(|rest| f64::from(*rest).powi(2)).sum();
    gradient *= weight;
    (network.backward(&tape, gradient), squares)
}

fn add_l1(gradients: &mut [Vec<f32>], network: &mut Network, decays: &[bool], l1: f32) {
    for ((gradients, numbers), decays) in gradients.iter_mut().zip(network.numbers()).zip(decays) {
        if *decays {
            gradients.iter_mut().zip(numbers).for_each(|(gradient, number)| *gradient += l1 * number.signum());
        }
    }
}

fn rate(recipe: &Recipe, done: f64) -> f64 {
    match recipe.schedule {
        Schedule::Constant => recipe.rate,
        Schedule::Cosine if done < WARM_UP => recipe.rate * (done / WARM_UP).max(0.01),
        Schedule::Cosine => {
            let share = ((done - WARM_UP) / (1.0 - WARM_UP)).min(1.0);
            0.5 * recipe.rate * (1.0 + (std::f64::consts::PI * share).cos())
        }
    }
}

/// RMS of the vector that is left, in units of the network's output.
fn rms(network: &Network, rows: &Rows) -> f64 {
    let mut squares = 0.0;
    for start in (0..rows.x.nrows()).step_by(CHUNK_ROWS) {
        let end = (start + CHUNK_ROWS).min(rows.x.nrows());
        let slice = ndarray::s![start..end, ..];
        let rest = network.forward(&rows.x.slice(slice)) - rows.y.slice(slice);
        squares += rest.iter().map(|rest| f64::from(*rest).powi(2)).sum::<f64>();
    }
    (squares / rows.x.nrows().max(1) as f64).sqrt()
}
