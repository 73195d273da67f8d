//! Camera images of a moving end effector with three coloured balls, as the rig of the paper would see it, with the truth beside
//! them. Rays are cast: nothing here knows how the tracker models a camera, and nothing is shared with it (`tests/independence.rs`).
//!
//! [`Scene`] says what there is to see, [`motion::Motion`] where the end effector goes, [`render`] writes the folder.
//! Lengths are metres inside, millimetres in files.
#![deny(missing_docs)]
#![forbid(unsafe_code)]

mod backdrop;
mod error;
mod eye;
mod film;
mod folder;
pub mod motion;
mod random;
mod rig;
mod scene;
mod solids;
mod stage;

pub use error::{Error, Result};
pub use folder::{Rendered, render};
pub use motion::Motion;
pub use scene::{Place, Scene};
