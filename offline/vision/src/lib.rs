//! The true pose of the end effector from webcams and three coloured balls.
//!
//! [`rig`], [`table`] and [`picture`] read a scene; [`localise`] and [`bundle`] find out where the cameras stand;
//! Lengths are metres inside, millimetres in files. How it works and what it reaches: `docs/vision.md`.
#![deny(missing_docs)]

pub mod accuracy;
pub mod adjustment;
pub mod associate;
pub mod bundle;
pub mod camera;
pub mod cameras_file;
pub mod chessboard;
pub mod colour;
pub mod commands;
pub mod edge;
pub mod error;
pub mod exposure;
pub mod frame;
pub mod hough;
pub mod least_squares;
pub mod localise;
pub mod marking;
pub mod marks;
pub mod outcome;
pub mod overlay;
pub mod paper;
pub mod picture;
pub mod plane_pose;
pub mod pose;
pub mod recording;
pub mod rig;
pub mod simplex;
pub mod sphere;
pub mod table;
pub mod timing;
pub mod track;
pub mod triangulate;
pub mod update;
pub mod video;

pub use camera::{Camera, Intrinsics};
pub use error::{Error, Result};
