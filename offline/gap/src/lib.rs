//! Where a simulation and a recording of a robot differ, which physics is missing, and how large it is (gap-design.md).
#![deny(missing_docs)]
#![allow(clippy::needless_range_loop, reason = "cells, blocks and joints index several vectors and matrices at once")]

pub mod filter;
pub mod flexible;
pub mod hypothesis;
pub mod intervals;
pub mod linear;
pub mod motion;
pub mod noise;
pub mod nominal;
pub mod nuisance;
pub mod parameters;
pub mod problem;
pub mod refine;
pub mod robot;
pub mod run;
pub mod saturation;
pub mod score;
pub mod search;

pub mod analysis;
mod breakaway;
pub mod builtin;
mod channels;
mod clock;
mod closed_loop;
mod comparable;
pub mod controller;
mod corrected;
mod experiment;
pub mod floors;
mod gates;
pub mod held_out;
mod held_windows;
mod known;
pub mod needed;
pub mod parallel;
mod past;
mod pictures;
mod regime;
mod region;
pub mod shaking;
mod turning;
pub mod unexplained;
pub mod verdicts;
pub mod watch;
