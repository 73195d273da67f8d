//! Which channels can be compared at all: one needs its columns in every run, and on both sides where the lab gave a simulation.

use gap_report::{DataQuality, Level};

use crate::run::{Both, Run};

/// Measurements of a run that may be there or not.
#[derive(Debug, Clone, Copy)]
enum Signal {
    Torque,
    Truth,
    Tip,
}

impl Signal {
    const ALL: [Self; 3] = [Self::Torque, Self::Truth, Self::Tip];

    fn of(self, run: &Run) -> bool {
        match self {
            Self::Torque => run.torque.is_some(),
            Self::Truth => run.truth.is_some(),
            Self::Tip => run.tip.is_some(),
        }
    }

    fn leave_out(self, run: &mut Run) {
        match self {
            Self::Torque => run.torque = None,
            Self::Truth => run.truth = None,
            Self::Tip => run.tip = None,
        }
    }

    fn columns(self) -> &'static str {
        match self {
            Self::Torque => "tau_J (or jtau_J, dac_J)",
            Self::Truth => "truth_jpos_J",
            Self::Tip => "truth_x, truth_y and truth_z",
        }
    }

    /// What then cannot be judged.
    fn lost(self) -> &'static str {
        match self {
            Self::Torque => "friction, weights, motors, contact and heat cannot be told",
            Self::Truth => "play, cables, ratios and offsets cannot be told but by the tip",
            Self::Tip => "links, tool and the camera's frame cannot be told",
        }
    }
}

/// Leaves out of every run what some of them lack, and tells it. `given` says of each run whether its simulation is the lab's.
///
/// # Errors
/// What some lack, when nothing is left that all have.
pub(crate) fn in_common(runs: &mut [Both], given: &[bool]) -> Result<Vec<DataQuality>, String> {
    let mut told = Vec::new();
    let mut lacks = Vec::new();
    let mut nowhere = Vec::new();
    for signal in Signal::ALL {
        if !runs.iter().any(|(real, _)| signal.of(real)) {
            nowhere.push(format!("{}: {}", signal.columns(), signal.lost()));
            continue;
        }
        let reals = runs.iter().map(|(real, _)| real);
        let sims = runs.iter().zip(given).filter(|(_, given)| **given).filter_map(|((_, sim), _)| sim.as_ref());
        let lacking: Vec<&str> = reals.chain(sims).filter(|run| !signal.of(run)).map(|run| run.id.as_str()).collect();
        let Some(first) = lacking.first() else { continue };
        let others = match lacking.len() {
            1 => String::new(),
            more => format!(" and {} more", more - 1),
        };
        lacks.push(format!("{first}{others} lacks {}", signal.columns()));
        let message = format!(
            "{first}{others} lacks {}: a channel is compared where every recording has it, and every simulation; {}",
            signal.columns(),
            signal.lost()
        );
        told.push(DataQuality::new("channel", Level::Warn, message));
        for run in runs.iter_mut().flat_map(|(real, sim)| std::iter::once(real).chain(sim)) {
            signal.leave_out(run);
        }
    }
    if !nowhere.is_empty() {
        told.push(DataQuality::new("channel", Level::Warn, format!("no recording has {}", nowhere.join("; nor "))));
    }
    let left = |run: &Run| Signal::ALL.into_iter().any(|signal| signal.of(run));
    if !lacks.is_empty() && !runs.iter().any(|(real, _)| left(real)) { Err(lacks.join("; ")) } else { Ok(told) }
}
