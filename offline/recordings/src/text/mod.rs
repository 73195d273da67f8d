//! Numbers as text, both ways, fast and exact.

mod parse;
mod print;

pub(crate) use parse::{decimal_nanoseconds, number};
pub(crate) use print::{exponent18, fixed6, integer, microseconds_as_seconds, nanoseconds_as_exponent18, shortest};
