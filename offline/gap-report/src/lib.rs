//! The report of `ravenpose gap`: what the recordings of a robot and a simulation of it disagree about.
//!
//! - [`Report`] is report.json, as `models/gap-report.schema.json` has it; [`check`] holds the rules beyond the schema.
//! - [`words`] says it on a terminal, [`headline`] in one sentence per physics.
//! - [`Pictures`] are the data of the figures; [`html()`] makes the page, [`write()`] puts both files on the disk.
//!
//! This crate computes nothing about the robot: what an engine found goes in, what a person reads comes out.
#![deny(missing_docs)]

mod check;
mod figures;
mod html;
mod names;
mod physics;
mod pictures;
mod text;
pub mod types;
mod vocabulary;
mod write;

pub use check::check;
pub use html::html;
pub use physics::{Physics, UnknownPhysics};
pub use pictures::{BeforeAfter, HeatMap, HeatRun, Pictures, Point, Quantity, Share, Signature, Spectrum};
pub use text::{headline, headlines, quality_headline, words};
pub use types::*;
pub use vocabulary::{Hypothesis, Motion, ParameterSpec, Vocabulary, vocabulary};
pub use write::{WriteError, json, timestamp, write};
