//! What was found, for the parts that judge it and put it into words.

use gap_report::{FloorMethod, Pictures, Report};

use crate::controller::Changed;
use crate::flexible::Ceiling;
use crate::held_out::{HeldOut, Refused, sized};
use crate::hypothesis::{ALWAYS, Dictionary, Window, Windows};
use crate::intervals::Estimate;
use crate::nominal::Nominal;
use crate::problem::Problem;
use crate::robot::Robot;
use crate::search::Answer;
use crate::unexplained::Unexplained;

/// A report with its pictures and the corrected model.
#[derive(Debug)]
pub struct Outcome {
    /// The report.
    pub report: Report,
    /// Its pictures.
    pub pictures: Pictures,
    /// Text of corrected.toml; none where nothing was found.
    pub corrected: Option<String>,
    /// Effects that are not in corrected.toml, each with the reason.
    pub left_out: Vec<String>,
    /// Mean logarithm of what is left of the residuals of held-out runs; NaN where nothing was judged.
    pub(crate) left: f64,
    /// Times more that is left of what was held out than of what was fitted, in the channel where that is most.
    pub(crate) elsewhere: f64,
}

/// What the search and the judgement have in common; for the parts that put it into words.
pub struct Found<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// What is believed of it.
    pub nominal: &'a Nominal,
    /// Residuals of the fit.
    pub problem: &'a Problem<'a>,
    /// Their columns.
    pub dictionary: &'a Dictionary<'a>,
    /// Residuals of what was held out.
    pub held: &'a Problem<'a>,
    /// Their columns.
    pub held_dictionary: &'a Dictionary<'a>,
    /// What the search found.
    pub answer: &'a Answer<'a>,
    /// Sizes of the effects.
    pub estimates: &'a [Estimate],
    /// When each effect is there in what was held out.
    pub held_windows: &'a [Option<Windows>],
    /// The ceiling.
    pub ceiling: &'a Ceiling,
    /// Noise floor of each cell, fixed before the fit.
    pub floors: &'a [f64],
    /// How it was found.
    pub floor_methods: &'a [FloorMethod],
    /// Likeliest values of what is known only roughly, per cell.
    pub beside: &'a [Vec<f64>],
    /// A controller that is not the simulation's.
    pub controller: Option<Changed>,
    /// Was the nominal model learnt from a simulation? Not from one whose input is reversed.
    pub learnt: bool,
    /// Is there something that the library does not explain?
    pub unmodelled: bool,
    /// What explained most, and not what was held out.
    pub refused: Option<&'a Refused>,
    /// Something far above the noise where nothing was found.
    pub unexplained: Option<Unexplained>,
}

impl Found<'_> {
    /// When an effect is there in a run that was held out.
    pub(crate) fn window_there(&self, effect: usize, run: usize) -> Window {
        self.held_windows[effect].as_ref().map_or(ALWAYS, |windows| windows.of(run))
    }

    /// Is nothing of an effect in any run that was held out?
    pub(crate) fn is_absent(&self, effect: usize) -> bool {
        self.held_windows[effect].as_ref().is_some_and(Windows::is_never)
    }

    /// Is what was held out a later part of the only run?
    pub(crate) fn is_later_part(&self) -> bool {
        self.held_out().is_later_part()
    }

    /// What was held out.
    pub(crate) fn held_out(&self) -> HeldOut<'_> {
        HeldOut { problem: self.problem, dictionary: self.held_dictionary, floors: self.floors }
    }
    /// Residuals of a cell of what was held out, before and after the correction by all effects; and its place among the cells there.
    pub(crate) fn before_and_after(&self, cell: usize) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        self.held_out().corrected(&sized(&self.answer.effects, self.estimates), &self.beside[cell], cell)
    }
}
