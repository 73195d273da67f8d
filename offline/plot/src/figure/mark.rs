//! What a panel can hold.

use super::Colour;
use super::bins::{Histogram, extent};
use super::decimate::Point;

/// A grid of values; cell 0 is at the lower left, rows follow one another upward, NaN is blank.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Limits of the grid in x.
    pub x: (f64, f64),
    /// Limits in y.
    pub y: (f64, f64),
    /// Cells in a row.
    pub columns: usize,
    /// One value per cell.
    pub values: Vec<f64>,
}

/// How the values of cells become colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ramp {
    /// Straight from the least to the greatest, with a colour bar.
    Heat,
    /// By the logarithm from 1, and below, to `most`, without a bar: see [`super::ratio_legend`]. Equal in all panels.
    Ratio {
        /// Value of the last colour.
        most: f64,
    },
    /// Shades of grey by the logarithm, without a bar: where the samples are.
    Density,
}

/// Something drawn in a panel.
#[derive(Debug, Clone)]
pub enum Mark {
    /// A line in strokes, named at its end.
    Line {
        /// Name beside the line's end; none without one.
        name: Option<String>,
        /// Colour.
        colour: Colour,
        /// Strokes of finite points.
        strokes: Vec<Vec<Point>>,
        /// Further classes of the style sheet: `thin`, `broad`, `dashed`.
        style: &'static str,
    },
    /// An area between two heights.
    Band {
        /// Colour, drawn faint.
        colour: Colour,
        /// x, lower and upper y, rising in x.
        points: Vec<(f64, f64, f64)>,
    },
    /// Faint dots.
    Dots {
        /// Colour.
        colour: Colour,
        /// Finite points.
        points: Vec<Point>,
    },
    /// Outline of a histogram, named at the right.
    Steps {
        /// Name.
        name: Option<String>,
        /// Colour.
        colour: Colour,
        /// Counts.
        histogram: Histogram,
    },
    /// A grid of colours.
    Cells {
        /// The grid.
        cells: Cells,
        /// Its colours.
        ramp: Ramp,
        /// Title of the colour bar with the unit.
        title: String,
    },
    /// A horizontal line across the panel, such as zero.
    Rule {
        /// Height.
        y: f64,
    },
}

impl Mark {
    /// A line of one stroke.
    pub fn line(name: impl Into<String>, colour: Colour, points: Vec<Point>) -> Self {
        Self::strokes(name, colour, vec![points])
    }

    /// A line of several strokes.
    pub fn strokes(name: impl Into<String>, colour: Colour, strokes: Vec<Vec<Point>>) -> Self {
        let name = name.into();
        Self::Line { name: (!name.is_empty()).then_some(name), colour, strokes, style: "" }
    }

    /// Sets further classes of a line.
    #[must_use]
    pub fn style(mut self, classes: &'static str) -> Self {
        if let Self::Line { style, .. } = &mut self {
            *style = classes;
        }
        self
    }

    /// Name and colour of its label.
    pub(super) fn label(&self) -> Option<(&str, Colour)> {
        match self {
            Self::Line { name, colour, .. } | Self::Steps { name, colour, .. } => name.as_deref().map(|name| (name, *colour)),
            _ => None,
        }
    }

    /// Where the label belongs, in the unit of y: at the end of a line.
    pub(super) fn end(&self) -> Option<f64> {
        match self {
            Self::Line { strokes, .. } => strokes.last()?.last().map(|point| point.1),
            _ => None,
        }
    }

    /// Does it need a colour bar?
    pub(super) fn bar(&self) -> Option<(&Cells, &str)> {
        match self {
            Self::Cells { cells, ramp: Ramp::Heat, title } => Some((cells, title)),
            _ => None,
        }
    }

    /// Extent in x and y.
    pub(super) fn extent(&self) -> ((f64, f64), (f64, f64)) {
        const NONE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);
        let of = |points: &mut dyn Iterator<Item = Point>| {
            points.fold((NONE, NONE), |(x, y), point| (widen(x, point.0), widen(y, point.1)))
        };
        match self {
            Self::Line { strokes, .. } => of(&mut strokes.iter().flatten().copied()),
            Self::Dots { points, .. } => of(&mut points.iter().copied()),
            Self::Band { points, .. } => of(&mut points.iter().flat_map(|&(x, low, high)| [(x, low), (x, high)])),
            Self::Steps { histogram, .. } => {
                let most = histogram.counts.iter().copied().max().unwrap_or(0);
                let end = histogram.low + histogram.width * histogram.counts.len() as f64;
                ((histogram.low, end), (0.0, most as f64))
            }
            Self::Cells { cells, .. } => (cells.x, cells.y),
            Self::Rule { .. } => (NONE, NONE),
        }
    }
}

fn widen((low, high): (f64, f64), value: f64) -> (f64, f64) {
    if super::scale::drawable(value) { (low.min(value), high.max(value)) } else { (low, high) }
}

impl Cells {
    /// Least and greatest value; equal if there is one only, low above high if there is none.
    pub(super) fn range(&self) -> (f64, f64) {
        extent(self.values.iter().copied())
    }

    /// Rows of the grid.
    pub(super) fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }
}
