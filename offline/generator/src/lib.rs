//! Recordings with a concealed cause, to prove a gap finder with.
//!
//! A plant of its own (Lagrangian with Jacobians and Christoffel symbols, staggered leapfrog at 0.1 ms, bristles or a smooth law
//! for dry friction, elastic cables, a controller on stepped encoders) plays an operator's commands with and without an effect.
//! The recording with the effect goes to the tool, the truth into an envelope of which only the hash is published.
//! Nothing here depends on the arm, the simulator or the gap finder of this workspace.

// sums over joints and links read best with the indices of the formulas
#![allow(clippy::needless_range_loop)]

pub(crate) mod acting;
pub mod arm;
pub mod batch;
mod bench;
pub(crate) mod cable;
pub mod case;
pub(crate) mod cholesky;
pub mod controller;
pub mod draft;
mod draft_more;
pub mod effect;
pub mod friction;
pub mod lagrange;
pub mod logger;
pub mod matrix;
pub mod order;
pub mod plant;
pub mod random;
pub mod robots;
pub mod run;
pub mod scene;
pub mod seal;
pub mod sensors;
pub mod severity;
pub mod table;
pub mod trajectory;
pub(crate) mod units;
pub(crate) mod urdf;
pub(crate) mod variants;
