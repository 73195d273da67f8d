//! Building blocks for figures as SVG: a [`Figure`] is a column of [`Panel`]s that share their horizontal axis, a panel holds
//! [`Mark`]s. Nothing is drawn with a script; colours follow the reader's light or dark theme; text stays text.
//!
//! Data are reduced before they come in ([`decimate`], [`bins`]), so a figure is small and owns what it draws.
//!
//! ```
//! use plot::figure::{Axis, Colour, Figure, Mark, Panel, svg_document};
//! let line = Mark::line("tip", Colour::BLUE, vec![(0.0, 1.0), (1.0, 3.0), (2.0, 2.0)]);
//! let panel = Panel::new(Axis::new("Position, mm")).mark(line);
//! let figure = Figure::new("Tip", Axis::new("Time, s")).panel(panel).caption("Three points.");
//! assert!(svg_document(&[figure]).starts_with("<svg"));
//! ```

pub mod bins;
mod colour;
pub mod decimate;
mod draw;
mod layout;
mod legend;
mod mark;
mod scale;
mod xml;

pub use colour::{Colour, HEAT_LEVELS, STYLE};
pub use draw::{svg, svg_document};
pub use legend::ratio_legend;
pub use mark::{Cells, Mark, Ramp};
pub use scale::{Axis, Ticks, number, ticks};
pub use xml::escape;

/// One drawing area with its own vertical axis.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Vertical axis; its title stands above the panel.
    pub y: Axis,
    /// What is drawn, in this order.
    pub marks: Vec<Mark>,
    /// Height of the drawing area, px.
    pub height_px: f64,
    /// Short text at the upper right, such as a figure of merit.
    pub note: Option<String>,
}

impl Panel {
    /// An empty panel.
    pub fn new(y: Axis) -> Self {
        Self { y, marks: Vec::new(), height_px: 150.0, note: None }
    }

    /// Adds a mark.
    #[must_use]
    pub fn mark(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }

    /// Adds marks.
    #[must_use]
    pub fn marks(mut self, marks: impl IntoIterator<Item = Mark>) -> Self {
        self.marks.extend(marks);
        self
    }

    /// Sets the height of the drawing area, px.
    #[must_use]
    pub fn height(mut self, height_px: f64) -> Self {
        self.height_px = height_px;
        self
    }

    /// Sets the text at the upper right.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = Some(note.into());
        self
    }
}

/// A titled column of panels over one horizontal axis.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Title, drawn above.
    pub title: String,
    /// Caption: figures and what to look for. Drawn by the page, or below the figure in a document of its own.
    pub caption: String,
    /// Horizontal axis of all panels.
    pub x: Axis,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
    /// Width, px; text has 12 px, so a figure that a telephone shows at full width is [`NARROW_PX`] wide.
    pub width_px: f64,
}

/// Width of a figure that reads well on a telephone and as one of three in a row, px.
pub const NARROW_PX: f64 = 420.0;
/// Width of a figure that takes the whole page on a large screen, px.
pub const WIDE_PX: f64 = 1316.0;

impl Figure {
    /// An empty figure of [`NARROW_PX`].
    pub fn new(title: impl Into<String>, x: Axis) -> Self {
        Self { title: title.into(), caption: String::new(), x, panels: Vec::new(), width_px: NARROW_PX }
    }

    /// Adds a panel below the others.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Sets the caption.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Sets the width, px.
    #[must_use]
    pub fn width(mut self, width_px: f64) -> Self {
        self.width_px = width_px;
        self
    }

    /// Width of the drawing area, px: so many columns are worth drawing.
    pub fn columns_px(&self) -> usize {
        (self.width_px - layout::MARGIN_LEFT_MAX - layout::MARGIN_RIGHT_MIN).max(50.0) as usize
    }
}

pub(crate) use colour::page_colours;
