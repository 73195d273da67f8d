//! The report in words: numbers, units, sentences, the text for a terminal.

mod amount;
mod headline;
mod joints;
mod number;
mod parameter;
mod region;
mod sentence;
mod unit;
mod words;

pub use headline::{headline, headlines, quality_headline};
pub use words::words;

pub(crate) use headline::headlines_unbroken;
pub(crate) use joints::{capital, joint, joints, listed};
pub(crate) use number::{
    Estimate, as_given, before_and_after, beside_noise, count, duration, in_one_unit, percent, probability, short, significance,
    with_unit,
};
pub(crate) use parameter::parameter_name;
pub(crate) use region::region;
pub(crate) use unit::{Scale, scale, written};
pub(crate) use words::{names_something, plain_metric};
