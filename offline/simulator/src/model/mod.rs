//! A robot as a file says it is: the nominal plant, numbers that differ from it, named physics on top, and what homing
//! leaves to chance.
//!
//! Either a plant file (`schema = "raven2-plant/1"`), or a robot file:
//!
//! ```toml
//! schema = "ravenpose-robot/1"
//! name = "raven2-worn"
//! base = "raven2-nominal"
//!
//! [plant.cable]               # any numbers of the plant file that differ
//! ke_n = [720e3, 176e3, 9.25e3]
//!
//! [homing]                    # a new static offset at each homing: standard deviation per joint, rad and m
//! offset_sd = [0.01, 0.01, 0.002, 0.0, 0.0, 0.0, 0.0]
//!
//! [stiction]                  # joint friction that holds at rest: travel over which it turns, rad, rad, m
//! presliding = [1e-4, 1e-4, 2e-5]
//!
//! [[effect]]
//! physics = "backlash"        # a name of models/gap-vocabulary.json
//! joint = 3
//! parameters = { b = 0.0015 }
//! from_s = 5.0                # optional: acts from here on (payload picked up, cable slipped)
//! ```

mod effect;
mod file;

pub(crate) use effect::delay;
pub use effect::{Bound, Effect};

use arm::{JOINTS, Raven2};

/// Why a text is not a robot: one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// Not TOML, an unknown or missing key, a value of the wrong type.
    #[error("line {line}: {what}; see models/raven2-worn.toml for an example")]
    Syntax {
        /// From 1.
        line: usize,
        /// What the parser says.
        what: String,
    },
    /// Another schema or base.
    #[error("{key} is `{found}`, expected {expected}")]
    Kind {
        /// `schema` or `base`.
        key: &'static str,
        /// As found.
        found: String,
        /// What would do.
        expected: &'static str,
    },
    /// The plant with its changes is not one.
    #[error(transparent)]
    Plant(#[from] arm::plant::PlantError),
    /// An effect that means nothing.
    #[error("effect {number} ({physics}): {what}")]
    Effect {
        /// From 1, in the order of the file.
        number: usize,
        /// Its name as given.
        physics: String,
        /// What is wrong and what would do.
        what: String,
    },
    /// A number that no robot has.
    #[error("{key} {what}")]
    Value {
        /// Dotted key.
        key: &'static str,
        /// What it must be.
        what: &'static str,
    },
}

/// A robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Nominal plant with the numbers that differ.
    pub raven: Raven2,
    /// A cable law other than the plant's, joints 1 to 3.
    pub cables: Option<Pretension>,
    /// Joint friction of joints 1 to 3 that holds at rest, with the travel over which it turns, rad, rad, m; none: the smoothed
    /// sign of the plant file, which creeps.
    pub presliding: Option<[f64; 3]>,
    /// Standard deviation of the offset that each homing leaves, rad and m.
    pub homing_offset_sd: [f64; JOINTS],
    /// Named physics on top.
    pub effects: Vec<Effect>,
}

/// Pretensioned cables, joints 1 to 3; see [`crate::plant::CableLaw::Pretensioned`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pretension {
    /// Stiffness of one side at no tension, N/m.
    pub stiffness_n_m: [f64; 3],
    /// Stretch over which it stiffens by e, m.
    pub stiffening_length_m: [f64; 3],
    /// Tension of either side at rest, N.
    pub pretension_n: [f64; 3],
}

impl Robot {
    /// The nominal robot.
    pub fn nominal() -> Self {
        Self::of(Raven2::nominal().clone())
    }

    /// A robot that is worn as the paper's was: `models/raven2-worn.toml`.
    ///
    /// # Panics
    /// If the file that was embedded at build time is not a robot; a test reads it.
    pub fn worn() -> Self {
        match Self::from_toml(include_str!("../../../../models/raven2-worn.toml")) {
            Ok(robot) => robot,
            Err(error) => panic!("models/raven2-worn.toml, embedded at build time, is not a robot: {error}"),
        }
    }

    fn of(raven: Raven2) -> Self {
        Self {
            name: raven.plant().name.clone(),
            raven,
            cables: None,
            presliding: None,
            homing_offset_sd: [0.0; JOINTS],
            effects: Vec::new(),
        }
    }

    /// A robot from the text of a plant file or a robot file.
    ///
    /// # Errors
    /// [`RobotError`]: one line with the place and what is wrong.
    pub fn from_toml(text: &str) -> Result<Self, RobotError> {
        file::parse(text)
    }
}
