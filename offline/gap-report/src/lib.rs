//! The report of `ravenpose gap`: what the recordings of a robot and a simulation of it disagree about.
//!
//! - [`Report`] is report.json, as `models/gap-report.schema.json` has it; [`check`] holds the rules beyond the schema.
//! - [`words`] says it on a terminal, [`headline`] in one sentence per physics.
//! - [`Pictures`] are the data of the figures; [`html()`] makes the page, [`write()`] puts both files on the disk.
//!
//! ```
//! use gap_report::{Channel, Location, Motion, Parameter, Physics, Regime, Subsystem, Verdict, headline};
//!
//! let location = Location::new(Channel::JointTorque, ["elbow".to_owned()], Subsystem::Cable, Regime::all());
//! let level = Parameter::of(&Physics::CoulombFriction, "f_c", Motion::Revolute, 0.81, [0.70, 0.92]).expect("in the vocabulary");
//! let verdict = Verdict::alternative(1, Physics::CoulombFriction, 0.95, location, vec![level], Vec::new());
//! let expected = "The elbow joint has 0.81 N m (0.70 to 0.92) of dry friction that the simulation lacks.";
//! assert_eq!(headline(&verdict), expected);
//! ```
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
