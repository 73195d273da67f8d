//! Why a file is not a robot.

use crate::plant::PlantError;

/// Why a text is not a robot: one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A file that cannot be read or written.
    #[error("{what}")]
    File {
        /// The file and what the system says.
        what: String,
    },
    /// Not TOML, an unknown or missing key, a value of the wrong type.
    #[error("line {line}: {what}; see models/raven2-worn.toml and docs/simulator.md for examples")]
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
    /// The URDF is none.
    #[error("{place}{what}")]
    Urdf {
        /// File or key, empty where the whole file is URDF.
        place: String,
        /// What is wrong and what would do.
        what: String,
    },
    /// An effect that means nothing.
    #[error("line {line}: effect {number} ({physics}): {what}")]
    Effect {
        /// From 1.
        line: usize,
        /// From 1, in the order of the file.
        number: usize,
        /// Its name as given.
        physics: String,
        /// What is wrong and what would do.
        what: String,
    },
    /// A number or name that no robot has.
    #[error("line {line}: {key} {what}")]
    Value {
        /// From 1.
        line: usize,
        /// Dotted key.
        key: String,
        /// What it must be.
        what: String,
    },
    /// Numbers that no simulation can be made of, or a change that this robot cannot take.
    #[error("{0}")]
    Change(String),
    /// Effects that cannot be where they are.
    #[error(transparent)]
    Build(#[from] PlantError),
}

/// Line, from 1, of a byte of a text.
pub(super) fn line_of(text: &str, byte: usize) -> usize {
    1 + text.char_indices().take_while(|(at, _)| *at < byte).filter(|(_, c)| *c == '\n').count()
}

/// The parser's message with its line number, without the drawing of the place.
pub(super) fn syntax(error: &toml::de::Error, text: &str) -> RobotError {
    let line = error.span().map_or(1, |span| line_of(text, span.start));
    RobotError::Syntax { line, what: error.message().replace('\n', ", ") }
}
