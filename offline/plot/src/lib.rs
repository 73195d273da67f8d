//! Pictures of recordings: [`overview`] makes one page of a run that stands on its own, [`overview_svg`] the same figures as
//! one SVG file. The building blocks under [`figure`] and [`page`] serve other reports as well.
//!
//! What a recording lacks is said, never made up: without a true position the page shows the tracking error (commanded -
//! reported) under that name.
#![deny(missing_docs)]

pub mod figure;
mod overview;
pub mod page;
pub mod statistics;

pub use overview::{Options, PlotError, overview, overview_svg};
