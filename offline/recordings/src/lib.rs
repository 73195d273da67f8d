//! Recordings of robots: [`csv`] reads tidy CSV into a columnar [`Recording`], [`states`] turns one into the full
//! `raven_state` of every cycle, [`synthetic`] makes states when no recording is at hand, [`statefile`] keeps them in the
//! file that the stand-in for RAVEN's controller replays.
//!
//! Everything inside is SI; published units (µm, degrees, joint 3 in m × 57.29578) appear in the states only. Whatever a
//! recording does not say and a state needs is assumed, and every assumption comes back as a sentence.
#![deny(missing_docs)]

pub mod csv;
pub mod statefile;
pub mod states;
pub mod synthetic;

mod recording;
mod sample;

pub use recording::{Column, Recording};
pub use states::{Arms, States};
