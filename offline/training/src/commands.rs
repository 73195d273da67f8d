//! `ravenpose train` without its words: from recordings to a model file with its card, its hash, its curves.

use crate::card::{self, Facts};
use crate::chain::Chain;
use crate::data::{self, DataSet, Reading, Trajectory};
use crate::error::{TrainingError, hex, shown};
use crate::preset::Recipe;
use crate::split::{Parts, Split};
use crate::train::{self, Progress};
use crate::{figures, load, onnx};
use arm::Raven2;
use ravenpose::correction::Quantity;
use ravenpose::load::LoadCard;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// One row of training in so many has a memory that began a few seconds before.
pub(crate) const YOUNG_EVERY: usize = 8;

/// What is to be trained.
#[derive(Debug, Clone)]
pub struct Wish<'a> {
    /// Recordings, one trajectory each.
    pub data: &'a [PathBuf],
    /// How they are read.
    pub reading: &'a Reading,
    /// How it is learnt.
    pub recipe: &'a Recipe,
    /// ONNX file to write; hash, curves and checkpoint stand beside it.
    pub out: &'a Path,
}

/// What is going on.
#[derive(Debug, Clone)]
pub enum Event {
    /// So many recordings of so many are read.
    Read(usize, usize),
    /// An epoch is done.
    Epoch(Progress),
}

/// What came out.
#[derive(Debug, Clone)]
pub struct Done {
    /// Rows of training, validation and test.
    pub rows: [usize; 3],
    /// Trajectories of each.
    pub trajectories: [usize; 3],
    /// Least RMS on validation, against the truth as measured.
    pub validation_rms: f64,
    /// In which epoch.
    pub epoch: usize,
    /// Is there a line that the network learnt the rest of?
    pub has_line: bool,
    /// Half widths of 95 %.
    pub bounds: Vec<f64>,
    /// Wall time of learning, s.
    pub seconds: f64,
    /// Numbers that were learnt.
    pub weights: usize,
    /// What was assumed or left out.
    pub notes: Vec<String>,
    /// Unit of the outputs.
    pub unit: &'static str,
}

/// Trains and writes the model. The test trajectories stay sealed.
///
/// # Errors
/// [`TrainingError`]: data, checkpoint, or files that cannot be written.
pub fn train(wish: &Wish, told: &mut dyn FnMut(&Event)) -> Result<Done, TrainingError> {
    check_out(wish.out)?;
    let (mut set, mut parts, load) =
        read_parts(wish.data, wish.reading, wish.recipe.seed, &mut |done, all| told(&Event::Read(done, all)))?;
    let count = |part: &[Trajectory]| part.iter().map(Trajectory::rows).sum();
    let rows = [count(&parts.train), count(&parts.validation), parts.test.rows()];
    let trajectories = [parts.train.len(), parts.validation.len(), parts.test.names().len()];
    parts.train.iter_mut().for_each(|one| one.make_young(YOUNG_EVERY));
    let checkpoint = beside(wish.out, "checkpoint");
    let mut progress = |progress: &Progress| told(&Event::Epoch(*progress));
    let trained = train::train(&parts, set.outputs(), wish.recipe, Some(&checkpoint), &mut progress)?;
    let chain = Chain::of(&trained, &wish.reading.plays, wish.reading.tells_friction() && load.is_some());
    let (epoch, validation_rms) = train::best(&trained.curves).map_or((0, f64::NAN), |best| (best.epoch, best.validation_rms));
    let notes = std::mem::take(&mut set.notes);
    let facts = Facts {
        chain: &chain,
        is_raven: set.is_raven,
        target: wish.reading.target,
        load: load.as_ref(),
        prepared: &trained.prepared,
        train: &parts.train,
        validation: &parts.validation,
        trained_on: &trained_on(wish, &parts, &set),
        more: more(wish, &parts, &set),
    };
    let card = card::card(&facts);
    let unit = set.unit();
    write_model(wish.out, &chain, &card)?;
    write_whole(&beside(wish.out, "curves.svg"), figures::curves_svg(&trained.curves, unit).as_bytes())?;
    drop(fs::remove_file(&checkpoint));
    Ok(Done {
        rows,
        trajectories,
        validation_rms,
        epoch,
        has_line: trained.has_line,
        bounds: card::bounds(&chain, &parts.validation),
        seconds: trained.seconds,
        weights: chain.layers.iter().map(|layer| layer.weight.len() + layer.bias.len()).sum(),
        notes,
        unit,
    })
}

/// Can a file be written there in the end?
fn check_out(out: &Path) -> Result<(), TrainingError> {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let what = if out.is_dir() {
        "is a folder"
    } else if !folder.is_dir() {
        "lies in no folder"
    } else {
        return Ok(());
    };
    Err(TrainingError::file(out, what, "choose another --out"))
}

/// Reads recordings and deals whole trajectories out; what they have in common stays behind. Of a RAVEN-II's also what watches the load,
/// fitted to those of training; if the reading wants friction, what it sees of that is appended to all rows but those of the test.
///
/// # Errors
/// [`TrainingError`]: a recording that cannot be read, the same run twice, too few of them.
pub(crate) fn read_parts(
    files: &[PathBuf],
    reading: &Reading,
    seed: u64,
    told: &mut dyn FnMut(usize, usize),
) -> Result<(DataSet, Parts, Option<LoadCard>), TrainingError> {
    let mut set = data::read(files, reading, told)?;
    refuse_twins(&set)?;
    let split = Split::draw(set.trajectories.len(), seed)?;
    let mut parts = Parts::of(&mut set, &split);
    if !set.is_raven {
        return Ok((set, parts, None));
    }
    let (arm, plays) = (Raven2::nominal().arm(reading.arm), reading.plays.len());
    let load = load::fit(&arm, plays, &parts.train, &parts.validation);
    match &load {
        Ok(card) if reading.tells_friction() => {
            parts.train.iter_mut().chain(&mut parts.validation).for_each(|one| load::append_friction(card, plays, one));
            set.input_names.extend(load::friction_names());
        }
        Ok(_) => {}
        Err(why) => {
            let nor = if reading.tells_friction() { ", nor is it told of friction" } else { "" };
            set.notes.push(format!("the model does not watch the load{nor}: {why}"));
        }
    }
    Ok((set, parts, load.ok()))
}

/// A run that is given twice, whole or in part, would be in two sets, or count as two.
pub(crate) fn refuse_twins(set: &DataSet) -> Result<(), TrainingError> {
    for (k, one) in set.trajectories.iter().enumerate() {
        let before = &set.trajectories[..k];
        if let Some(other) = before.iter().find(|other| other.id() == one.id() || other.sketch.overlaps(&one.sketch)) {
            return Err(TrainingError::Unfit {
                file: one.name.clone(),
                what: format!("holds rows of {}: the same run twice", other.name),
                remedy: "give each stretch of a run once: twice it would be in training and test at a time, and count as two runs",
            });
        }
    }
    Ok(())
}

/// FILE.EXTENSION beside a model.
fn beside(model: &Path, extension: &str) -> PathBuf {
    let mut name = model.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    PathBuf::from(name)
}

fn trained_on(wish: &Wish, parts: &Parts, set: &DataSet) -> String {
    let minutes = |part: &[Trajectory]| part.iter().map(Trajectory::seconds).sum::<f64>() / 60.0;
    let kind = if set.is_raven { "RAVEN-II recordings" } else { "tables" };
    let [train, validation, test] = [parts.train.len(), parts.validation.len(), parts.test.names().len()];
    let measured: Vec<f64> = parts.train.iter().filter(|one| one.is_measured).map(Trajectory::seconds).collect();
    let measured = match (measured.len(), measured.iter().sum::<f64>() / 60.0) {
        (0, _) => String::new(),
        (some, minutes) => {
            format!(", none to {some} of the {train} that it learnt from ({minutes:.1} minutes), whose truth was measured")
        }
    };
    format!(
        "{} {kind}, {:.1} minutes of truth at up to {} Hz, whole trajectories split {train}/{validation}/{test} (training/validation/test); learnt \
         from {} rows ({:.1} minutes); truth noise {} {} added{measured}; preset {}, seed {}",
        train + validation + test,
        minutes(&parts.train) + minutes(&parts.validation) + parts.test.seconds() / 60.0,
        wish.reading.truth_hz,
        parts.train.iter().map(Trajectory::rows).sum::<usize>(),
        minutes(&parts.train),
        wish.reading.truth_noise,
        set.unit(),
        wish.recipe.name,
        wish.recipe.seed
    )
}

/// Property of the card: the noise that was added to the truth.
pub(crate) fn truth_noise_key(target: Quantity) -> String {
    format!("ravenpose.truth_noise_{}", target.unit())
}

/// Which runs took part in what, and how they were read: for `evaluate`.
fn more(wish: &Wish, parts: &Parts, set: &DataSet) -> BTreeMap<String, String> {
    let ids = |set: &[Trajectory]| set.iter().map(Trajectory::id).collect::<Vec<_>>().join(" ");
    let sketches = |set: &[Trajectory]| set.iter().map(|one| one.sketch.word()).collect::<Vec<_>>().join(" ");
    let recipe = serde_json::to_string(wish.recipe).unwrap_or_default();
    let mut more = BTreeMap::from([
        ("ravenpose.train_runs".to_owned(), ids(&parts.train)),
        ("ravenpose.validation_runs".to_owned(), ids(&parts.validation)),
        ("ravenpose.train_sketches".to_owned(), sketches(&parts.train)),
        ("ravenpose.validation_sketches".to_owned(), sketches(&parts.validation)),
        ("ravenpose.truth_hz".to_owned(), wish.reading.truth_hz.to_string()),
        (truth_noise_key(wish.reading.target), wish.reading.truth_noise.to_string()),
        ("ravenpose.recipe".to_owned(), recipe),
    ]);
    if !set.is_raven {
        more.insert("ravenpose.inputs".to_owned(), set.input_names.join(" "));
        more.insert("ravenpose.outputs".to_owned(), set.output_names.join(" "));
    }
    more
}

fn write_model(out: &Path, chain: &Chain, card: &BTreeMap<String, String>) -> Result<(), TrainingError> {
    let bytes = onnx::write(chain, card);
    let digest = hex(&Sha256::digest(&bytes));
    let name = out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    write_whole(out, &bytes)?;
    write_whole(&beside(out, "sha256"), format!("{digest}  {name}\n").as_bytes())
}

/// Writes a file that is there when it is complete.
pub(crate) fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), TrainingError> {
    outputs::write(file, bytes)
        .map_err(|error| TrainingError::file(file, format!("cannot be written: {error}"), "choose another --out"))
}

/// A model that [`train`] wrote.
#[derive(Debug, Clone)]
pub struct Model {
    /// Its network.
    pub chain: Chain,
    /// Its card.
    pub card: BTreeMap<String, String>,
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// [`TrainingError::Model`] for what is not a model of this crate.
    pub fn read(file: &Path) -> Result<Self, TrainingError> {
        let wrong = |what: String| TrainingError::Model { file: shown(file), what };
        let bytes = fs::read(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let (chain, card) = onnx::read(&bytes).map_err(wrong)?;
        Ok(Self { chain, card })
    }

    /// A property of the card as a number.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.card.get(key)?.trim().parse().ok()
    }

    /// A property of the card as words.
    pub fn words(&self, key: &str) -> Vec<&str> {
        self.card.get(key).map(|text| text.split_ascii_whitespace().collect()).unwrap_or_default()
    }
}
