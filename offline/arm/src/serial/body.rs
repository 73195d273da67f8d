//! What a serial arm is made of: joints, links, tools.

use nalgebra::{IsometryMatrix3, Vector3};

use super::LinkInertia;

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JointKind {
    /// Turns about its axis between limits, rad.
    Revolute,
    /// Turns about its axis without limits, rad.
    Continuous,
    /// Slides along its axis, m.
    Prismatic,
}

impl JointKind {
    /// Does it slide?
    pub const fn is_prismatic(self) -> bool {
        matches!(self, Self::Prismatic)
    }

    /// Unit of its position, as column names have it: `rad` or `m`.
    pub const fn position_unit(self) -> &'static str {
        if self.is_prismatic() { "m" } else { "rad" }
    }

    /// Unit of its effort, as column names have it: `nm` or `n`.
    pub const fn effort_unit(self) -> &'static str {
        if self.is_prismatic() { "n" } else { "nm" }
    }
}

/// What a joint may do; infinite where nothing is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Smallest position, rad or m.
    pub lower: f64,
    /// Largest position, rad or m.
    pub upper: f64,
    /// Largest speed, rad/s or m/s.
    pub velocity: f64,
    /// Largest torque or force, N·m or N.
    pub effort: f64,
}

impl JointLimits {
    /// No limit at all.
    pub const NONE: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY, velocity: f64::INFINITY, effort: f64::INFINITY };

    /// Is the position inside? NaN is not.
    pub fn allows(&self, position: f64) -> bool {
        (self.lower..=self.upper).contains(&position)
    }
}

/// A joint with one degree of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name, as the source has it.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Axis in the link's own frame; any length but zero.
    pub axis: Vector3<f64>,
    /// Its limits.
    pub limits: JointLimits,
}

/// A joint and the link that it moves. The link's frame coincides with the joint's frame where the joint is at 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name of the link.
    pub name: String,
    /// The joint between the link before (or the base) and this one.
    pub joint: Joint,
    /// Pose of the link at joint position 0 in the frame of the link before, or of the base.
    pub placement: IsometryMatrix3<f64>,
    /// Mass, centre of mass, inertia.
    pub inertia: LinkInertia,
}

/// A frame fixed to the last link.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// Name.
    pub name: String,
    /// Pose in the frame of the last link.
    pub pose: IsometryMatrix3<f64>,
}
