//! `ravenpose search`: random recipes, the better third of which is trained longer, and again (successive halving, Jamieson and
//! Talwalkar 2016, by thirds). Every finished training is a line of `trials.jsonl`, from which a stopped search goes on.

use crate::commands::{YOUNG_EVERY, read_parts, write_whole};
use crate::data::Reading;
use crate::error::{TrainingError, hex, shown};
use crate::network::{Activation, NormPlace};
use crate::prepare::Preparation;
use crate::preset::{First, Recipe, Schedule};
use crate::random::Random;
use crate::split::Parts;
use crate::train;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Purpose of the stream of random numbers that recipes are drawn from.
const RECIPES: u64 = 14;
/// One in so many goes on to the next rung, which trains so many times longer.
const KEPT: usize = 3;
const FORMAT: &str = "ravenpose-search/1";
/// File of the finished trainings, in the search's folder.
pub const TRIALS: &str = "trials.jsonl";
/// File of the best recipe.
pub const BEST: &str = "best.json";

/// What is to be searched.
#[derive(Debug, Clone)]
pub struct Wish<'a> {
    /// Recordings, one trajectory each.
    pub data: &'a [PathBuf],
    /// How they are read.
    pub reading: &'a Reading,
    /// What is not searched: memory, what is fitted first, and seed; and the name and the epochs of the recipe that is written in the end.
    pub base: &'a Recipe,
    /// Recipes of the first rung.
    pub trials: usize,
    /// Epochs of the first rung.
    pub epochs: usize,
    /// One row of training and validation in so many is used.
    pub every: usize,
    /// Folder.
    pub out: &'a Path,
}

/// One finished training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Rung, from 0.
    pub rung: usize,
    /// Which recipe.
    pub index: usize,
    /// Least RMS on the validation trajectories, in the labels' unit; none if training left the finite numbers.
    pub validation_rms: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
    /// The recipe, with the epochs of its rung.
    pub recipe: Recipe,
}

impl Trial {
    fn rms(&self) -> f64 {
        self.validation_rms.unwrap_or(f64::INFINITY)
    }
}

/// First line of the file.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    identity: String,
}

/// Recipes that each rung trains, first to last.
pub fn rungs(trials: usize) -> Vec<usize> {
    let mut counts = vec![trials];
    while let Some(&last) = counts.last().filter(|last| **last > 1) {
        counts.push((last / KEPT).max(1));
    }
    counts
}

/// The recipe of a number: the same for the same seed, however many there are.
pub fn draw(base: &Recipe, index: usize) -> Recipe {
    let mut random = Random::new(base.seed.wrapping_add((index as u64) << 20), RECIPES);
    let mut log = |low: f64, high: f64| low * (high / low).powf(random.share());
    let (rate, decay, l1) = (log(3e-4, 1e-2), log(1e-2, 1.0), log(1e-7, 1e-5));
    let layers = 1 + random.below(4);
    let hidden = (0..layers).map(|_| 100 + 50 * random.below(11)).collect();
    let activation = [Activation::Sigmoid, Activation::Tanh, Activation::Relu, Activation::Elu][random.below(4)];
    let norm = [NormPlace::None, NormPlace::Before, NormPlace::After][random.below(3)];
    Recipe {
        name: format!("search-{index}"),
        hidden,
        activation,
        norm,
        // A table has no physical quantities that anybody knew.
        preparation: [base.preparation, Preparation::Standard][random.below(2)],
        first: if First::passes(activation, norm) { base.first } else { First::Nothing },
        memory: base.memory,
        friction: base.friction,
        batch: 128 << random.below(4),
        rate,
        schedule: [Schedule::Constant, Schedule::Cosine][random.below(2)],
        epochs: base.epochs,
        l1: if random.below(2) == 0 { 0.0 } else { l1 },
        decay: if random.below(2) == 0 { 0.0 } else { decay },
        patience: base.epochs,
        seed: base.seed,
    }
}

/// Searches; `told` hears every training, those that an earlier search of the folder has finished too. Returns all of them; the best of
/// the last rung stands in [`BEST`]. The test trajectories stay sealed.
///
/// # Errors
/// [`TrainingError`]: data, a folder that cannot be written or holds another search.
pub fn search(wish: &Wish, told: &mut dyn FnMut(&Trial, usize)) -> Result<Vec<Trial>, TrainingError> {
    let (set, mut parts, _) = read_parts(wish.data, wish.reading, wish.base.seed, &mut |_, _| {})?;
    let outputs = set.outputs();
    for one in parts.train.iter_mut().chain(&mut parts.validation) {
        one.thin(wish.every);
    }
    for one in &mut parts.train {
        one.make_young(YOUNG_EVERY);
    }
    let cannot = |error: std::io::Error| TrainingError::file(wish.out, format!("cannot be made: {error}"), "choose another --out");
    fs::create_dir_all(wish.out).map_err(cannot)?;
    let mut file = Finished::open(&wish.out.join(TRIALS), &identity(wish, &parts))?;
    let all = rungs(wish.trials).iter().sum();
    let mut kept: Vec<usize> = (0..wish.trials).collect();
    let mut found: Vec<Trial> = Vec::new();
    for (rung, count) in rungs(wish.trials).into_iter().enumerate() {
        kept.truncate(count);
        let mut here = Vec::new();
        for &index in &kept {
            let trial = match file.take(rung, index) {
                Some(trial) => trial,
                None => file.add(one(wish, rung, index, &parts, outputs)?)?,
            };
            told(&trial, all);
            here.push(trial);
        }
        here.sort_by(|a, b| a.rms().total_cmp(&b.rms()).then(a.index.cmp(&b.index)));
        kept = here.iter().map(|trial| trial.index).collect();
        found.extend(here);
    }
    if let Some(best) = kept.first().map(|index| draw(wish.base, *index)) {
        let json = serde_json::to_string_pretty(&best).unwrap_or_default() + "\n";
        write_whole(&wish.out.join(BEST), json.as_bytes())?;
    }
    Ok(found)
}

fn one(wish: &Wish, rung: usize, index: usize, parts: &Parts, outputs: usize) -> Result<Trial, TrainingError> {
    let mut recipe = draw(wish.base, index);
    recipe.epochs = wish.epochs * KEPT.pow(rung as u32);
    let begun = std::time::Instant::now();
    let validation_rms = match train::train(parts, outputs, &recipe, None, &mut |_| {}) {
        Ok(trained) => train::best(&trained.curves).map(|best| best.validation_rms),
        Err(TrainingError::Diverged { .. }) => None,
        Err(error) => return Err(error),
    };
    Ok(Trial { rung, index, validation_rms, seconds: begun.elapsed().as_secs_f64(), recipe })
}

/// Of everything that a finished training depends on.
fn identity(wish: &Wish, parts: &Parts) -> String {
    let mut hash = Sha256::new();
    hash.update(format!("{:?} {} {} {}", wish.base, wish.trials, wish.epochs, wish.every));
    for one in parts.train.iter().chain(&parts.validation) {
        hash.update(format!("{}:{}:{}", one.id(), one.rows(), one.inputs.len()));
        one.labels.iter().for_each(|number| hash.update(number.to_le_bytes()));
    }
    hex(&hash.finalize()[..16])
}

/// The finished trainings in the file.
struct Finished {
    path: PathBuf,
    trials: Vec<Trial>,
}

impl Finished {
    fn open(path: &Path, identity: &str) -> Result<Self, TrainingError> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(TrainingError::file(path, format!("cannot be read: {error}"), "choose another --out")),
        };
        // A line that a kill cut off has no end, and is trained again.
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut lines = whole.lines();
        if let Some(first) = lines.next() {
            let header: Option<Header> = serde_json::from_str(first).ok();
            if header.is_none_or(|header| header.format != FORMAT || header.identity != identity) {
                let what = "another seed, preset or number of trials, or other data".to_owned();
                return Err(TrainingError::Checkpoint { file: shown(path), what });
            }
        }
        let trials: Vec<Trial> = lines.filter_map(|line| serde_json::from_str(line).ok()).collect();
        let found = Self { path: path.to_owned(), trials };
        let header = Header { format: FORMAT.to_owned(), identity: identity.to_owned() };
        let mut bytes = found.line(&header)?;
        for trial in &found.trials {
            bytes.extend(found.line(trial)?);
        }
        write_whole(path, &bytes)?;
        Ok(found)
    }

    fn line(&self, value: &impl Serialize) -> Result<Vec<u8>, TrainingError> {
        let mut bytes = serde_json::to_vec(value).map_err(|error| self.failed(&error.to_string()))?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    fn failed(&self, what: &str) -> TrainingError {
        TrainingError::file(&self.path, format!("cannot be written: {what}"), "free the disk or choose another --out")
    }

    fn take(&self, rung: usize, index: usize) -> Option<Trial> {
        self.trials.iter().find(|trial| (trial.rung, trial.index) == (rung, index)).cloned()
    }

    fn add(&mut self, trial: Trial) -> Result<Trial, TrainingError> {
        let line = self.line(&trial)?;
        let written = OpenOptions::new().append(true).open(&self.path).and_then(|mut file| file.write_all(&line));
        written.map_err(|error| self.failed(&error.to_string()))?;
        Ok(trial)
    }
}
