//! Where a simulation and a recording of a robot differ, which physics is missing, and how large it is (gap-design.md).
#![deny(missing_docs)]

pub mod filter;
pub mod linear;
pub mod motion;
pub mod nominal;
pub mod problem;
pub mod robot;
pub mod run;
pub mod hypothesis;
pub mod noise;
pub mod refine;
pub mod score;
pub mod search;
