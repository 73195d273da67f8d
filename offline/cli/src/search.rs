//! `ravenpose search`: random recipes, the better third trained longer, and again.

use crate::output;
use crate::train::{self, Source};
use ::training::preset::Recipe;
use ::training::search::{self, BEST, TRIALS, Trial};
use clap::Args;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

/// Trials of the last rungs that are shown.
const SHOWN: usize = 10;

/// What to search.
#[derive(Args)]
pub(crate) struct Wish {
    #[command(flatten)]
    source: Source,
    /// Folder: every finished training, and best.json for `train --recipe`; the same command goes on where one was stopped
    #[arg(long)]
    out: PathBuf,
    /// Random recipes to begin with; a third of them goes on, three times longer, and so forth
    #[arg(long, default_value_t = 100)]
    trials: usize,
    /// Epochs of the first rung
    #[arg(long, default_value_t = 1)]
    epochs: usize,
    /// Use one row in so many
    #[arg(long, default_value_t = 4)]
    every: usize,
    /// Recipe that says whether there is a memory, and how many epochs the best one is to be trained for
    #[arg(long, default_value = "default", value_parser = Recipe::PRESETS)]
    preset: String,
    /// Everything random: recipes, split, weights, order of rows
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    for (name, number) in [("--trials", wish.trials), ("--epochs", wish.epochs), ("--every", wish.every)] {
        if number == 0 {
            return Err(format!("{name} 0: must be 1 or more"));
        }
    }
    let mut base = train::preset(&wish.preset)?;
    base.seed = wish.seed;
    if wish.source.is_table() {
        base = base.for_tables();
    }
    let reading = wish.source.reading(&base)?;
    let wanted = search::Wish {
        data: &wish.source.data,
        reading: &reading,
        base: &base,
        trials: wish.trials,
        epochs: wish.epochs,
        every: wish.every,
        out: &wish.out,
    };
    let terminal = std::io::stderr().is_terminal();
    let mut done = 0;
    let mut told = |trial: &Trial, all: usize| {
        done += 1;
        let line = format!("{done} of {all}: rung {}, recipe {}: {}", trial.rung + 1, trial.index, left(trial));
        if terminal {
            output::complain(format_args!("\r\x1b[K{line}"));
        } else {
            complain!("{line}");
        }
    };
    let trials = search::search(&wanted, &mut told).map_err(|error| error.to_string())?;
    if terminal {
        output::complain(format_args!("\r\x1b[K"));
    }
    for trial in trials.iter().rev().take(SHOWN).rev() {
        let recipe = &trial.recipe;
        say!(
            "recipe {:>3}, {:>3} epochs, {:>5.1} s: {}; {:?}, {:?}, norm {:?}, {:?}, batch {}, rate {:.1e} {:?}, L1 {:.1e}, decay {:.1e}",
            trial.index,
            recipe.epochs,
            trial.seconds,
            left(trial),
            recipe.hidden,
            recipe.activation,
            recipe.norm,
            recipe.preparation,
            recipe.batch,
            recipe.rate,
            recipe.schedule,
            recipe.l1,
            recipe.decay
        );
    }
    say!(
        "{}: every training; {}: the best, for `ravenpose train --recipe`. The test trajectories were not read",
        wish.out.join(TRIALS).display(),
        wish.out.join(BEST).display()
    );
    Ok(ExitCode::SUCCESS)
}

fn left(trial: &Trial) -> String {
    trial.validation_rms.map_or_else(|| "diverged".to_owned(), |rms| format!("{rms:.3} left on validation"))
}
