//! One page about one recording.

mod content;
mod errors;
mod facts;
mod names;
mod relations;
mod traces;
mod words;

use recordings::Recording;

use crate::figure::{Figure, NARROW_PX, WIDE_PX, svg_document};
use crate::page::{Block, Page};
use content::Content;
use errors::Errors;

/// What of a recording to show.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Title; the recording's name without it.
    pub title: Option<String>,
    /// First time, s (first row of a table without time).
    pub from_s: Option<f64>,
    /// Last time, s.
    pub to_s: Option<f64>,
}

/// Why there is no page.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlotError {
    /// No rows, or no columns with numbers.
    #[error("{recording}: has no rows with numbers; record at least one sample")]
    Empty {
        /// Name of the recording.
        recording: String,
    },
    /// Columns of unequal length.
    #[error("{recording}: column `{column}` has {found} rows where the first has {expected}; read the file again")]
    Unequal {
        /// Name of the recording.
        recording: String,
        /// The column.
        column: String,
        /// Its rows.
        found: usize,
        /// Rows of the first column.
        expected: usize,
    },
    /// No row in the chosen range.
    #[error("{recording}: no row lies in the chosen range; the recording runs from {from_s} to {to_s}")]
    NothingChosen {
        /// Name of the recording.
        recording: String,
        /// First time, s, or row.
        from_s: f64,
        /// Last.
        to_s: f64,
    },
}

/// One HTML page about a recording, with inline SVG and nothing from outside.
///
/// # Errors
/// [`PlotError`].
pub fn overview(recording: &Recording, options: &Options) -> Result<String, PlotError> {
    page(recording, options).map(|page| page.html())
}

/// The figures of [`overview`] as one SVG file.
///
/// # Errors
/// [`PlotError`].
pub fn overview_svg(recording: &Recording, options: &Options) -> Result<String, PlotError> {
    page(recording, options).map(|page| svg_document(&page.figures()))
}

/// Quantities without a role that are drawn; the rest is listed.
const OTHERS: usize = 12;

fn page(recording: &Recording, options: &Options) -> Result<Page, PlotError> {
    let content = Content::new(recording, options)?;
    let errors = Errors::new(&content);
    let title = options.title.clone().unwrap_or_else(|| facts::file_name(&recording.name));
    let mut blocks = vec![Block::Tiles(facts::tiles(&content))];
    blocks.extend(facts::notices(&content, &errors).into_iter().map(Block::Notice));
    if let Some((header, rows)) = facts::table(&errors) {
        blocks.push(Block::Heading("Errors".to_owned()));
        blocks.push(Block::Table(3, header, rows));
    }
    let over_time = |width| traces::errors(&content, &errors, width);
    if let (Some(wide), Some(narrow)) = (over_time(WIDE_PX), over_time(NARROW_PX)) {
        blocks.push(Block::Responsive(Box::new([wide, narrow])));
    }
    section(&mut blocks, "Tip", "", traces::tip(&content));
    section(&mut blocks, "Joints", "", traces::joints(&content));
    section(&mut blocks, "Error against load", facts::LOAD, relations::load(&content, &errors));
    section(&mut blocks, "Error by direction of motion", facts::DIRECTION, relations::direction(&content, &errors));
    section(&mut blocks, "Error by posture", "", relations::posture(&content, &errors));
    section(&mut blocks, "Distribution of the error", "", relations::distribution(&errors));
    section(&mut blocks, "Load against velocity", facts::FRICTION, relations::friction(&content));
    section(&mut blocks, "Motors", "", traces::motors(&content));
    let others = content.others.iter().take(OTHERS).map(|family| traces::other(&content, family)).collect();
    section(&mut blocks, "Other channels", "", others);
    blocks.push(Block::Heading("How to read this".to_owned()));
    blocks.push(Block::List(facts::reading(&content, OTHERS)));
    Ok(Page { title, subtitle: facts::subtitle(recording, &content), blocks })
}

fn section(blocks: &mut Vec<Block>, heading: &str, text: &str, figures: Vec<Figure>) {
    if figures.is_empty() {
        return;
    }
    blocks.push(Block::Heading(heading.to_owned()));
    if !text.is_empty() {
        blocks.push(Block::Text(text.to_owned()));
    }
    blocks.push(Block::Figures(figures));
}
