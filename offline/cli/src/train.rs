//! `ravenpose train`: from recordings with truth to a model file.

use crate::output;
use ::training::commands::{self, Done, Event};
use ::training::data::{Columns, Reading};
use ::training::preset::{First, Recipe};
use arm::Side;
use clap::Args;
use ravenpose::correction::Quantity;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What to learn from, and how.
#[derive(Args)]
pub(crate) struct Wish {
    #[command(flatten)]
    source: Source,
    /// ONNX file to write; FILE.sha256 and FILE.curves.svg go beside it
    #[arg(long)]
    out: PathBuf,
    /// Recipe
    #[arg(long, default_value = "default", value_parser = Recipe::PRESETS)]
    preset: String,
    /// Recipe in a file: best.json of `ravenpose search`
    #[arg(long, conflicts_with = "preset", value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// What is fitted before the network, which learns the rest; default: either for tables, nothing for states
    #[arg(long, value_parser = First::NAMES)]
    first: Option<String>,
    /// Everything random: split, weights, order of rows; default: the recipe file's, else 0
    #[arg(long)]
    seed: Option<u64>,
    /// Passes over the training rows, instead of the preset's
    #[arg(long)]
    epochs: Option<usize>,
}

/// Recordings, and how they are read.
#[derive(Args)]
pub(crate) struct Source {
    /// Recordings with truth, one whole trajectory each
    #[arg(long, required = true, num_args = 1..)]
    pub(crate) data: Vec<PathBuf>,
    /// At most so many rows per second of truth
    #[arg(long, default_value_t = 30.0)]
    truth_hz: f64,
    /// Noise to add to an exact truth (a simulation's), standard deviation in 3D, in mm, or in degrees of an orientation; a truth that was
    /// measured, as `ravenpose pair` notes it, is given none
    #[arg(long, default_value_t = 0.0)]
    truth_noise: f64,
    /// Arm of a RAVEN-II, gold or green
    #[arg(long, default_value = "gold", value_parser = side)]
    arm: Side,
    /// What of the tip is learnt: the service takes one model for each
    #[arg(long, default_value = "position", value_parser = Quantity::NAMES, conflicts_with = "inputs")]
    target: String,
    #[command(flatten)]
    columns: Named,
}

impl Source {
    /// Is it a table with named columns, not a RAVEN-II's states?
    pub(crate) fn is_table(&self) -> bool {
        self.columns.columns().is_some()
    }

    pub(crate) fn reading(&self, recipe: &Recipe) -> Result<Reading, String> {
        if !(self.truth_hz > 0.0 && self.truth_hz <= 1000.0) {
            return Err(format!("--truth-hz {}: must be above 0 and at most 1000; write --truth-hz 30", self.truth_hz));
        }
        if !(0.0..=100.0).contains(&self.truth_noise) {
            return Err(format!("--truth-noise {}: must be from 0 to 100; write --truth-noise 0.5", self.truth_noise));
        }
        if let Some(width) = self.columns.plays.iter().find(|width| !(width.is_finite() && **width > 0.0)) {
            return Err(format!("--plays {width}: half widths are numbers above 0"));
        }
        Ok(Reading {
            truth_hz: self.truth_hz,
            truth_noise: self.truth_noise,
            seed: recipe.seed,
            plays: recipe.plays(),
            friction: recipe.friction,
            arm: self.arm,
            target: Quantity::of_name(&self.target).unwrap_or_default(),
            columns: self.columns.columns(),
        })
    }
}

pub(crate) fn side(name: &str) -> Result<Side, String> {
    Side::from_name(name).ok_or_else(|| "write gold or green".to_owned())
}

/// Columns of tables that are no RAVEN-II's states.
#[derive(Args)]
pub(crate) struct Named {
    /// Columns of a table that are the inputs, instead of a RAVEN-II's state
    #[arg(long, num_args = 1.., requires = "truth")]
    inputs: Vec<String>,
    /// Columns that are the truth
    #[arg(long, num_args = 1.., requires = "inputs")]
    truth: Vec<String>,
    /// Columns that report the same as --truth, in its order: then truth - reported is learnt
    #[arg(long, num_args = 1.., requires = "truth")]
    reported: Vec<String>,
    /// Also learn from where each input stands within plays of these half widths, in the inputs' units (SI where known)
    #[arg(long, num_args = 1.., requires = "inputs")]
    plays: Vec<f64>,
}

impl Named {
    pub(crate) fn columns(&self) -> Option<Columns> {
        (!self.inputs.is_empty()).then(|| Columns {
            inputs: self.inputs.clone(),
            truth: self.truth.clone(),
            reported: self.reported.clone(),
            plays: self.plays.clone(),
        })
    }
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    let mut recipe = match &wish.recipe {
        None => preset(&wish.preset)?,
        Some(file) => recipe(file)?,
    };
    // The trajectories that a search chose by must not become test trajectories.
    recipe.seed = wish.seed.unwrap_or(recipe.seed);
    if wish.source.is_table() {
        recipe = recipe.for_tables();
    }
    if let Some(epochs) = wish.epochs {
        if epochs == 0 {
            return Err("--epochs 0: must be 1 or more".to_owned());
        }
        recipe.epochs = epochs;
    }
    if let Some(first) = wish.first.as_deref().and_then(First::of_name) {
        recipe.first = first;
    }
    recipe.check().map_err(|wrong| match &wish.recipe {
        Some(file) => format!("{}: {wrong}; give the best.json of `ravenpose search`", file.display()),
        None => format!("--preset {}: {wrong}", wish.preset),
    })?;
    output::check_file(&wish.out, &wish.source.data.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
    let reading = wish.source.reading(&recipe)?;
    let wanted = commands::Wish { data: &wish.source.data, reading: &reading, recipe: &recipe, out: &wish.out };
    let terminal = std::io::stderr().is_terminal();
    let done = commands::train(&wanted, &mut |event| told(event, terminal)).map_err(|error| error.to_string())?;
    if terminal {
        output::complain(format_args!("\r\x1b[K"));
    }
    for note in &done.notes {
        complain!("ravenpose: {note}");
    }
    let _ = output::say(format_args!("{}", words(wish, &done)));
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn preset(name: &str) -> Result<Recipe, String> {
    Recipe::preset(name).ok_or_else(|| format!("--preset {name}: no such recipe"))
}

fn recipe(file: &Path) -> Result<Recipe, String> {
    let name = file.display();
    let text = std::fs::read_to_string(file)
        .map_err(|cause| format!("{name}: cannot be read: {cause}; give the best.json of `ravenpose search`"))?;
    let recipe: Recipe = serde_json::from_str(&text)
        .map_err(|error| format!("{name}: line {}: {error}; give the best.json of `ravenpose search`", error.line()))?;
    Ok(recipe)
}

/// On a terminal one line that changes; elsewhere a line for every tenth epoch.
fn told(event: &Event, terminal: bool) {
    match event {
        Event::Read(done, all) if terminal => output::complain(format_args!("\r\x1b[K{done} of {all} recordings read")),
        Event::Read(..) => {}
        Event::Epoch(progress) => {
            let point = progress.point;
            let line = format!(
                "epoch {} of {}: {:.3} left on training, {:.3} on validation; {:.1} s each, {:.0} s left",
                point.epoch, progress.epochs, point.train_rms, point.validation_rms, progress.epoch_s, progress.left_s
            );
            if terminal {
                output::complain(format_args!("\r\x1b[K{line}"));
            } else if point.epoch % 10 == 1 || point.epoch == progress.epochs {
                complain!("{line}");
            }
        }
    }
}

fn words(wish: &Wish, done: &Done) -> String {
    let [train, validation, test] = done.trajectories;
    let bounds: Vec<String> = done.bounds.iter().map(|bound| format!("{bound:.3}")).collect();
    format!(
        "{}: {} numbers learnt from {} rows of {train} trajectories in {:.0} s\n\
         validation ({validation} trajectories): {:.3} {} RMS left in epoch {}{}; 95 % bound per axis {}\n\
         test ({test} trajectories, {} rows): not read; `ravenpose evaluate` with the same --data does\n",
        wish.out.display(),
        done.weights,
        done.rows[0],
        done.seconds,
        done.validation_rms,
        done.unit,
        done.epoch,
        if done.has_line { ", after a line" } else { "" },
        bounds.join(" "),
        done.rows[2]
    )
}
