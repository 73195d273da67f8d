//! Why a URDF text is no arm.

use crate::serial::SerialArmError;

/// Why a URDF text is no arm. Every message names the line, the element and the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// Not well-formed XML.
    #[error("URDF: not well-formed XML: {what}; expand xacro first, and check the place")]
    Xml {
        /// The parser's message with line and column.
        what: String,
    },
    /// Another kind of document.
    #[error(
        "URDF line {line}: the outermost element is <{found}>, expected <robot>; give a URDF file (xacro and SDF must be converted)"
    )]
    NotARobot {
        /// Line.
        line: usize,
        /// Name of the outermost element.
        found: String,
    },
    /// An element or attribute that has no default.
    #[error("URDF line {line}, {place}: {what} is missing; add it")]
    Missing {
        /// Line.
        line: usize,
        /// Element.
        place: String,
        /// What is missing.
        what: String,
    },
    /// Text that is not the number or numbers expected.
    #[error("URDF line {line}, {place}: {what} is `{found}`, expected {expected}; correct it")]
    Number {
        /// Line.
        line: usize,
        /// Element.
        place: String,
        /// Attribute or element.
        what: String,
        /// Its text.
        found: String,
        /// What it must be.
        expected: &'static str,
    },
    /// Something that contradicts itself.
    #[error("URDF line {line}, {place}: {what}")]
    Contradiction {
        /// Line.
        line: usize,
        /// Element.
        place: String,
        /// What, and the remedy.
        what: String,
    },
    /// Two elements with one name.
    #[error("URDF line {line}: there is a {place} already; give this one another name")]
    Duplicate {
        /// Line of the second.
        line: usize,
        /// Kind and name.
        place: String,
    },
    /// A joint to a link that does not exist.
    #[error("URDF line {line}, joint {joint}: there is no link `{link}`; add the link or correct the name")]
    UnknownLink {
        /// Line.
        line: usize,
        /// The joint.
        joint: String,
        /// The link.
        link: String,
    },
    /// A link that hangs on two joints.
    #[error(
        "URDF line {line}, joint {joint}: link `{link}` already hangs on joint `{other}`; closed loops cannot be represented, \
         remove one joint"
    )]
    TwoParents {
        /// Line of the second joint.
        line: usize,
        /// The second joint.
        joint: String,
        /// The link.
        link: String,
        /// The first joint.
        other: String,
    },
    /// No root, or several.
    #[error("URDF: {found}, expected one link that is no joint's child; connect the links")]
    Roots {
        /// What was found.
        found: String,
    },
    /// Nothing moves.
    #[error(
        "URDF: no joint between the root `{root}` and {tip} moves; give a robot with a revolute, continuous or prismatic joint"
    )]
    NothingMoves {
        /// The root link.
        root: String,
        /// The tip, in words.
        tip: String,
    },
    /// Moving joints on several branches.
    #[error(
        "URDF: the arm branches at link `{link}` into joints {joints}; name the tip link of the chain that is meant (known \
         tips: {tips}), or remove the other branches"
    )]
    Branch {
        /// Where it branches.
        link: String,
        /// First moving joints behind it.
        joints: String,
        /// Links at the ends.
        tips: String,
    },
    /// The tip asked for does not exist.
    #[error("URDF: there is no link `{tip}` to be the tip; known links: {known}")]
    UnknownTip {
        /// The link asked for.
        tip: String,
        /// All links.
        known: String,
    },
    /// A joint that a serial arm with one degree of freedom per joint has not.
    #[error(
        "URDF line {line}, joint {joint}: {kind} joints cannot be represented; replace it by revolute, continuous, prismatic or \
         fixed joints"
    )]
    JointKind {
        /// Line.
        line: usize,
        /// The joint.
        joint: String,
        /// `floating`, `planar`, `mimic`, ...
        kind: String,
    },
    /// A transmission that is not one motor on one joint.
    #[error("URDF line {line}, transmission {name}: {what}; only SimpleTransmission, one motor on one joint, can be represented")]
    Transmission {
        /// Line.
        line: usize,
        /// Its name.
        name: String,
        /// What it is.
        what: String,
    },
    /// Numbers that no arm has.
    #[error("URDF: {0}")]
    Arm(#[from] SerialArmError),
}
