//! Evaluation on whole trajectories that took no part in training, with the rivals beside the model.

mod breakdown;
mod domain;
mod metrics;
mod page;

use crate::commands::{Model, refuse_twins, truth_noise_key, write_whole};
use crate::data::{self, Reading, Sketch, Trajectory};
use crate::error::{TrainingError, shown};
use crate::{load, rivals};
use metrics::{AllFigures, Interval, Rest};
use ravenpose::card::{Card, CardError};
use ravenpose::correction::Quantity;
use ravenpose::load::MOTORS;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub use breakdown::{BY_TIME, Cell};
pub use metrics::{FEW, Figures, figures, reductions};

/// What is to be evaluated.
#[derive(Debug, Clone)]
pub struct Wish<'a> {
    /// Model file.
    pub model: &'a Path,
    /// Recordings: those of training and validation are recognised and only learnt from, all others are judged on.
    pub data: &'a [PathBuf],
    /// How they are read; rate, noise and memory are the model's own.
    pub reading: &'a Reading,
    /// Run the rivals too.
    pub rivals: bool,
    /// Folder for report.json and report.html.
    pub out: &'a Path,
    /// Of bootstrap and rivals.
    pub seed: u64,
}

/// One way to correct, with what it leaves.
#[derive(Debug, Clone, Serialize)]
pub struct Method {
    /// Name.
    pub name: String,
    /// What it is and whose.
    pub what: String,
    /// Time of learning, s; none where nothing is learnt here.
    pub train_s: Option<f64>,
    /// Time of one estimate here, µs, many rows at a time.
    pub estimate_us: Option<f64>,
    /// What is left against the truth without added noise.
    pub exact: AllFigures,
    /// What is left against the truth as measured.
    pub measured: AllFigures,
    /// RMS of the vector after the best offset per run, against the truth without added noise.
    pub centred_rms: f64,
    /// RMS removed, percent, against the truth without added noise.
    pub rms_reduction: Interval,
    /// SD removed, percent.
    pub sd_reduction: Interval,
    /// RMS after the best offset per run against the same of raw, percent removed.
    pub centred_reduction: Interval,
}

/// How often the stated bound and the trained domain hold.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Trust {
    /// Stated half widths.
    pub bound95: Vec<f64>,
    /// Share of rows within what the service publishes with them (until the memory has settled, the wider ones), per axis, percent,
    /// against the truth without added noise.
    pub coverage: Vec<f64>,
    /// The same over all axes.
    pub coverage_all: f64,
    /// Lowest and highest of a trajectory over all axes, percent.
    pub coverage_of_runs: (f64, f64),
    /// Rows with an input outside its trained range, percent.
    pub out_of_range: f64,
    /// Rows beyond the trained domain, percent.
    pub out_of_domain: f64,
    /// Inputs that left their range most often, with the share of rows, percent.
    pub leaving: Vec<(String, f64)>,
    /// The rows again with a memory that began a few seconds before and had not settled, by its age; none where the model has no memory.
    pub unsettled: Vec<Unsettled>,
    /// Per run: how long its memory took to settle, s; none if it never did.
    pub settled_after_s: Vec<Option<f64>>,
    /// Half widths that the card states for those rows; none if it states none.
    pub bound95_unsettled: Vec<f64>,
    /// What the motors' torque says about a load; none if the card says nothing of it.
    pub load: Option<Load>,
    /// What it says about friction; none for a model that is not told.
    pub friction: Option<Friction>,
    /// Rows that are far off; none if the card does not say what is far.
    pub far_off: Option<FarOff>,
}

impl Trust {
    /// Half widths that the service publishes with a row: the wider ones until the run's own memory has settled.
    fn published(&self, one: &Trajectory, row: usize) -> &[f64] {
        if self.bound95_unsettled.is_empty() || one.is_settled(row) { &self.bound95 } else { &self.bound95_unsettled }
    }

    /// When the memory of each run had settled, in words; none for a model without a memory.
    pub fn settled(&self) -> Option<String> {
        let one = |after_s: &Option<f64>| after_s.map_or("never".to_owned(), |after_s| format!("{after_s:.1} s"));
        let all: Vec<String> = self.settled_after_s.iter().map(one).collect();
        (!all.is_empty()).then(|| format!("the memory settled after: {}", all.join(", ")))
    }
}

/// What the service would say about a load, were these runs carried out before it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Load {
    /// Mass from which on it is unseen, kg.
    pub limit_kg: f64,
    /// Estimate at the end of each run, kg.
    pub mass_kg: Vec<f64>,
    /// When each run said `unseen_load` first, s; none if it never did.
    pub unseen_from_s: Vec<Option<f64>>,
    /// Rows that say `unseen_load`, percent.
    pub unseen: f64,
    /// Share of the other rows within the stated bound over all axes, percent; NaN where there are none.
    pub coverage_of_rest: f64,
}

impl std::fmt::Display for Load {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { limit_kg, mass_kg, unseen_from_s, unseen, coverage_of_rest } = self;
        let masses: Vec<String> = mass_kg.iter().map(|mass| format!("{mass:.2}")).collect();
        write!(f, "load weighed {} kg; unseen_load (beyond {limit_kg:.2} kg) in {unseen:.1} % of the rows", masses.join(", "))?;
        from(f, unseen_from_s)?;
        if coverage_of_rest.is_finite() {
            write!(f, "; the bound holds in {coverage_of_rest:.1} % of the others")?;
        }
        Ok(())
    }
}

/// What the service would tell the network of friction, did it start with each run.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Friction {
    /// Estimate of motors 1 to 3 at the end of each run, N·m beyond the usual.
    pub end_nm: Vec<[f32; MOTORS]>,
    /// When each run said `unseen_friction` first, s; none if it never did.
    pub unseen_from_s: Vec<Option<f64>>,
    /// Rows that say `unseen_friction`, percent.
    pub unseen: f64,
}

impl std::fmt::Display for Friction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of_run =
            |run: &[f32; MOTORS]| run.iter().map(|friction| format!("{:.0}", friction * 1e3)).collect::<Vec<_>>().join(" ");
        let ends: Vec<String> = self.end_nm.iter().map(of_run).collect();
        write!(
            f,
            "friction of motors 1 to 3 beyond the usual {} mN·m; unseen_friction in {:.1} % of the rows",
            ends.join(", "),
            self.unseen
        )?;
        from(f, &self.unseen_from_s)
    }
}

/// `, from never, 20 s on`; nothing where it never was.
fn from(f: &mut std::fmt::Formatter<'_>, from_s: &[Option<f64>]) -> std::fmt::Result {
    if from_s.iter().all(Option::is_none) {
        return Ok(());
    }
    let one = |from_s: &Option<f64>| from_s.map_or("never".to_owned(), |from_s| format!("{from_s:.0} s"));
    write!(f, ", from {} on", from_s.iter().map(one).collect::<Vec<_>>().join(", "))
}

/// Rows that are off by more than three times the RMS on the validation trajectories, and how many of them the service would not have
/// corrected.
#[derive(Debug, Clone, Default, Serialize)]
pub struct FarOff {
    /// Three times that RMS, without the truth's known noise.
    pub limit: f64,
    /// Rows beyond it, percent.
    pub rows: f64,
    /// Share of them with `out_of_range` or `out_of_domain`, percent; NaN where there are none.
    pub flagged: f64,
}

impl std::fmt::Display for FarOff {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1} % of the rows are off by more than three times the RMS on validation ({:.2})", self.rows, self.limit)?;
        if self.flagged.is_finite() {
            write!(f, ", {:.1} % of them flagged", self.flagged)?;
        }
        Ok(())
    }
}

impl std::fmt::Display for Unsettled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ((from, to), rows, rms) = (self.age_s, self.rows, self.rms);
        write!(f, "memory {from} to {to} s old, not settled ({rows} rows): {rms:.3} RMS left, ")?;
        match self.coverage {
            Some(share) => write!(f, "its own bound holds in {share:.1} %"),
            None => f.write_str("no bound stated"),
        }
    }
}

/// What a model with a memory is good for soon after its start.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Unsettled {
    /// Age of the memory, s: from, to.
    pub age_s: (f64, f64),
    /// Rows in which it had not settled.
    pub rows: usize,
    /// RMS of the vector that is left of them, against the truth without added noise.
    pub rms: f64,
    /// Share of those rows within the stated bound over all axes, percent; none where none is stated.
    pub coverage: Option<f64>,
}

/// The whole report.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Format of this file.
    pub format: &'static str,
    /// Model file.
    pub model: String,
    /// What it was trained on, as its card says.
    pub trained_on: String,
    /// Names of outputs.
    pub outputs: Vec<String>,
    /// Names of the runs judged on.
    pub runs: Vec<String>,
    /// Rows of them.
    pub rows: usize,
    /// Runs that took part in training or validation and were only given to the rivals.
    pub runs_of_training: usize,
    /// Raw first, then the model, then the rivals.
    pub methods: Vec<Method>,
    /// Bound and domain.
    pub trust: Trust,
    /// RMS of the vector before and after by region, speed, direction and load.
    pub breakdown: Vec<Cell>,
    /// Of the bootstrap and the rivals.
    pub seed: u64,
    /// What was assumed or left out.
    pub notes: Vec<String>,
}

/// What a run is to a model.
fn parts(model: &Model, all: Vec<Trajectory>) -> (Vec<Trajectory>, Vec<Trajectory>, usize) {
    let (train, validation) = (model.words("ravenpose.train_runs"), model.words("ravenpose.validation_runs"));
    let sketches = |key: &str| model.words(key).into_iter().map(Sketch::of_word).collect::<Vec<_>>();
    let (train_sketches, validation_sketches) = (sketches("ravenpose.train_sketches"), sketches("ravenpose.validation_sketches"));
    let is_of = |one: &Trajectory, ids: &[&str], sketches: &[Sketch]| {
        ids.contains(&one.id().as_str()) || sketches.iter().any(|sketch| sketch.overlaps(&one.sketch))
    };
    let (mut learnt, mut unseen, mut known) = (Vec::new(), Vec::new(), 0);
    for one in all {
        if is_of(&one, &train, &train_sketches) {
            known += 1;
            learnt.push(one);
        } else if is_of(&one, &validation, &validation_sketches) {
            known += 1;
        } else {
            unseen.push(one);
        }
    }
    (learnt, unseen, known)
}

/// Evaluates and writes report.json and report.html; `told` hears what is being done.
///
/// # Errors
/// [`TrainingError`]: model, data, or a folder that cannot be written.
pub fn evaluate(wish: &Wish, told: &mut dyn FnMut(&str)) -> Result<Report, TrainingError> {
    let model = Model::read(wish.model)?;
    let target = Quantity::of_card(&model.card).unwrap_or_default();
    let reading = Reading {
        truth_hz: model.number("ravenpose.truth_hz").unwrap_or(wish.reading.truth_hz),
        truth_noise: model.number(&truth_noise_key(target)).unwrap_or(0.0),
        target,
        plays: model.chain.plays.clone(),
        friction: model.chain.friction,
        ..wish.reading.clone()
    };
    let mut set = data::read(wish.data, &reading, &mut |done, all| told(&format!("{done} of {all} recordings read")))?;
    // As the service reads it.
    let refused = |error: CardError| TrainingError::Model { file: shown(wish.model), what: error.to_string() };
    let card = set.is_raven.then(|| Card::read(&model.card, target)).transpose().map_err(refused)?;
    if let Some(card) = &card {
        card.check_memory(model.chain.plays.len(), model.chain.frictions()).map_err(refused)?;
    }
    let load = card.as_ref().and_then(|card| card.load.as_ref());
    if let (true, Some(load)) = (model.chain.friction, load) {
        set.trajectories.iter_mut().for_each(|one| load::append_friction(load, model.chain.plays.len(), one));
        set.input_names.extend(load::friction_names());
    }
    if set.inputs() != model.chain.inputs() || set.outputs() != model.chain.outputs() {
        let what = format!(
            "maps {} inputs to {} outputs, the recordings have {} and {}",
            model.chain.inputs(),
            model.chain.outputs(),
            set.inputs(),
            set.outputs()
        );
        return Err(TrainingError::Model { file: shown(wish.model), what });
    }
    for (key, found) in [("ravenpose.inputs", &set.input_names), ("ravenpose.outputs", &set.output_names)] {
        let found = found.join(" ");
        // Cards of a RAVEN-II name none: its layout does.
        if let Some(trained_on) = model.card.get(key).filter(|trained_on| **trained_on != found) {
            let what = format!("was trained on {trained_on}, not on {found}");
            let remedy = "give --inputs, --truth, --reported and --plays as they were given to `ravenpose train`";
            return Err(TrainingError::Unfit { file: shown(wish.model), what, remedy });
        }
    }
    let (outputs, unit) = (set.outputs(), set.unit());
    if !set.is_raven && !model.chain.plays.is_empty() {
        let what = "has a memory of a RAVEN-II's joints".to_owned();
        return Err(TrainingError::Unfit {
            file: shown(wish.model),
            what,
            remedy: "give recordings of its states, without --inputs",
        });
    }
    let own_inputs = set.inputs() - model.chain.remembered();
    refuse_twins(&set)?;
    let (train, test, known) = parts(&model, set.trajectories);
    if test.is_empty() {
        return Err(TrainingError::Unfit {
            file: shown(wish.model),
            what: format!("all {known} recordings took part in its training or validation"),
            remedy: "give runs that it has not seen",
        });
    }
    let judge = Judge::new(&test, outputs, wish.seed);
    let mut methods = vec![judge.raw(), judge.fixed_offset()];
    told("the model");
    let begun = Instant::now();
    let estimates: Vec<Rest> = test.iter().map(|one| model.chain.estimate(&one.inputs)).collect();
    let estimate_us = begun.elapsed().as_secs_f64() * 1e6 / judge.rows() as f64;
    methods.push(judge.method("model", "this model file", &estimates, None, Some(estimate_us)));
    if wish.rivals && !train.is_empty() {
        // Rivals see the 118 features alone: the memory is the model's.
        for (name, what, mut rival) in rivals::all(set.is_raven.then_some((reading.arm, reading.target)), own_inputs, wish.seed) {
            told(name);
            let begun = Instant::now();
            rival.fit(&train, outputs);
            let train_s = begun.elapsed().as_secs_f64();
            let begun = Instant::now();
            let found: Vec<Rest> = test.iter().map(|one| rival.estimate(one)).collect();
            let estimate_us = begun.elapsed().as_secs_f64() * 1e6 / judge.rows() as f64;
            methods.push(judge.method(name, what, &found, Some(train_s), Some(estimate_us)));
        }
    }
    let trust = domain::trust(&model, target, load, &test, &estimates, &set.input_names);
    let mut notes = set.notes;
    if let Some(card) = &card {
        let refused = test.iter().filter(|one| !card.allowed.boards.is_empty() && !card.allowed.boards.contains(&one.board));
        notes.extend(refused.map(|one| {
            let (name, board) = (&one.name, one.board);
            format!(
                "{name}: is of board {board}, the service would not correct it (state_not_allowed): the model {}",
                card.limits()
            )
        }));
    }
    let report = Report {
        format: "ravenpose-evaluation/1",
        model: shown(wish.model),
        trained_on: model.card.get("ravenpose.trained_on").cloned().unwrap_or_default(),
        outputs: set.output_names.clone(),
        runs: test.iter().map(|one| one.name.clone()).collect(),
        rows: judge.rows(),
        runs_of_training: known,
        methods,
        breakdown: if set.is_raven { breakdown::cells(&test, &estimates, &trust) } else { Vec::new() },
        trust,
        seed: wish.seed,
        notes,
    };
    std::fs::create_dir_all(wish.out)
        .map_err(|error| TrainingError::file(wish.out, format!("cannot be made: {error}"), "choose another --out"))?;
    let json = serde_json::to_string_pretty(&report)
        .map_err(|error| TrainingError::file(wish.out, format!("cannot hold the report: {error}"), "choose another --out"))?;
    write_whole(&wish.out.join("report.json"), json.as_bytes())?;
    write_whole(&wish.out.join("report.html"), page::page(&report, &test, &estimates, unit).as_bytes())?;
    Ok(report)
}

/// The test trajectories with their truths.
struct Judge<'a> {
    test: &'a [Trajectory],
    outputs: usize,
    seed: u64,
    exact: Vec<Rest>,
}

impl<'a> Judge<'a> {
    fn new(test: &'a [Trajectory], outputs: usize, seed: u64) -> Self {
        Self { test, outputs, seed, exact: test.iter().map(|one| one.exact.clone()).collect() }
    }

    fn rows(&self) -> usize {
        self.test.iter().map(Trajectory::rows).sum()
    }

    fn raw(&self) -> Method {
        let zeros: Vec<Rest> = self.exact.iter().map(|one| vec![0.0; one.len()]).collect();
        self.method("raw", "as reported", &zeros, None, None)
    }

    /// The mean of each run's own truth: nothing constant can do better.
    fn fixed_offset(&self) -> Method {
        let means: Vec<Rest> = self
            .exact
            .iter()
            .zip(metrics::centred(&self.exact, self.outputs))
            .map(|(exact, centred)| exact.iter().zip(centred).map(|(exact, centred)| exact - centred).collect())
            .collect();
        self.method("fixed offset per run", "the best one, from the run's own truth", &means, None, None)
    }

    fn method(&self, name: &str, what: &str, estimates: &[Rest], train_s: Option<f64>, estimate_us: Option<f64>) -> Method {
        let minus =
            |truth: &[f32], estimate: &Rest| truth.iter().zip(estimate).map(|(truth, estimate)| truth - estimate).collect::<Rest>();
        let exact: Vec<Rest> = self.test.iter().zip(estimates).map(|(one, estimate)| minus(&one.exact, estimate)).collect();
        let measured: Vec<Rest> = self.test.iter().zip(estimates).map(|(one, estimate)| minus(&one.labels, estimate)).collect();
        let (before, after) = (metrics::centred(&self.exact, self.outputs), metrics::centred(&exact, self.outputs));
        let (rms_reduction, sd_reduction) = reductions(&self.exact, &exact, self.outputs, self.seed);
        Method {
            name: name.to_owned(),
            what: what.to_owned(),
            train_s,
            estimate_us,
            centred_rms: figures(&after, self.outputs).vector.rms,
            exact: figures(&exact, self.outputs),
            measured: figures(&measured, self.outputs),
            rms_reduction,
            sd_reduction,
            centred_reduction: reductions(&before, &after, self.outputs, self.seed).0,
        }
    }
}
