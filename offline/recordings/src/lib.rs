//! Recordings of robots: [`csv`] reads tidy CSV into a columnar [`Recording`], [`states`] turns one into the full
//! `raven_state` of every cycle, [`synthetic`] makes states when no recording is at hand, [`statefile`] keeps them in the
//! file that the stand-in for RAVEN's controller replays.
//!
//! Everything inside is SI; published units (µm, degrees, joint 3 in m × 57.29578) appear in the states only. Whatever a
//! recording does not say and a state needs is assumed, and every assumption comes back as a sentence.
#![deny(missing_docs)]

pub mod columns235;
pub mod columns252;
pub mod csv;
pub mod cut;
pub mod describe;
pub mod open;
pub mod pairs;
pub mod save;
pub mod statefile;
pub mod states;
pub mod synthetic;
pub mod tidy;

pub mod stream;
pub mod table;

pub mod mcap_file;
pub mod parquet_file;
pub mod ros;
pub mod rosbag_file;

mod columns;
mod fields;
mod file;
mod recording;
pub mod sample;
mod text;

pub use recording::{Column, Recording, TextColumn};
pub use states::{Arms, States};
