//! Numbers as text, both ways, fast and exact.

mod parse;
mod print;
mod seconds;

pub(crate) use parse::{number, number_of_cell, single_of_cell};
pub(crate) use print::{exponent18, fixed6, integer, microseconds_as_seconds, nanoseconds_as_exponent18, shortest};
pub(crate) use seconds::decimal_nanoseconds;
