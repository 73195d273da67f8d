//! Where a simulation and a recording of a robot differ, which physics is missing, and how large it is (gap-design.md).
#![deny(missing_docs)]
#![allow(clippy::needless_range_loop, reason = "cells, blocks and joints index several vectors and matrices at once")]

pub mod analysis;
pub mod builtin;
pub mod cell;
pub mod controller;
pub mod filter;
pub mod flexible;
pub mod floors;
pub mod found;
pub mod given;
pub mod held_out;
pub mod hypothesis;
pub mod intervals;
pub mod linear;
pub mod motion;
pub mod needed;
pub mod noise;
pub mod nominal;
pub mod nuisance;
pub mod pair;
pub mod parallel;
pub mod parameters;
pub mod problem;
pub mod readings;
pub mod refine;
pub mod robot;
pub mod run;
pub mod run_error;
pub mod saturation;
pub mod score;
pub mod search;
pub mod series;
pub mod shaking;
pub mod unexplained;
pub mod verdicts;
pub mod watch;

mod breakaway;
mod channels;
mod clock;
mod closed_loop;
mod comparable;
mod corrected;
mod experiment;
mod gates;
mod held_windows;
mod known;
mod lag;
mod past;
mod pictures;
mod regime;
mod region;
mod rough;
mod split;
mod told;
mod turning;
