//! The report's tests, in one program: each would compile reading and writing the whole report once more.
#![allow(missing_docs)]

mod check;
#[path = "../common/mod.rs"]
mod common;
mod headlines;
mod page;
mod round_trip;
mod schema;
