//! `ravenpose gap` as a user runs it: the four examples, cases made by the generator, bad input, gaps in the data.
#![allow(missing_docs)]

mod altered;
mod as_logged;
mod borne;
mod by_run;
mod common;
mod document;
mod examples;
mod gaps;
mod geometry;
mod joined;
mod live;
mod made;
#[path = "../common/mod.rs"]
mod program;
mod refused;
mod sides;
mod unnamed;
mod watch;
