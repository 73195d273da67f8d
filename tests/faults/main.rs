//! The faults of the specification against the pure cycle: each row alone (`rows`), and random mixes of them (`mix`).

mod allowed;
#[path = "../common/mod.rs"]
mod common;
mod load;
mod memory;
mod mix;
mod orientation;
mod rows;
mod warm;
mod world;
