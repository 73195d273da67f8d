//! Learns where the arm really is: recordings with truth become trajectories ([`data`]), whole ones go into training,
//! validation and a sealed test ([`split`]), a dense network learns the error ([`train`]).
//!
//! Nothing here runs in the service: what it runs is the ONNX file that comes out.
#![deny(missing_docs)]

pub mod card;
pub mod chain;
pub mod commands;
pub mod data;
pub mod error;
pub mod evaluate;
pub mod figures;
pub mod load;
pub mod network;
pub mod onnx;
pub mod prepare;
pub mod preset;
pub mod random;
pub mod rivals;
pub mod search;
pub mod split;
pub mod train;

pub use error::TrainingError;
