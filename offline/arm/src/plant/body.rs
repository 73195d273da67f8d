//! Geometry, limits and rigid-body sections of the plant file.

use serde::Deserialize;

use super::{PlantError, finite, positive};
use crate::{JOINTS, Side};

/// `[kinematics]`: modified Denavit-Hartenberg tables (raven2-plant.md, section 2).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KinematicsTable {
    /// Gravity of the plant in frame 0 of either arm, m/s².
    pub gravity_m_s2: [f64; 3],
    /// Gravity that the controller assumes, m/s².
    pub controller_gravity_m_s2: [f64; 3],
    /// Link angle 1 to 2, degrees.
    pub la12_deg: f64,
    /// Link angle 2 to 3, degrees.
    pub la23_deg: f64,
    /// Length of frame 4 along its axis, m.
    pub d4_m: f64,
    /// Wrist length, m.
    pub lw_m: f64,
    /// Wrist yaw in words.
    pub wrist_angle: String,
    /// Table of the gold arm.
    pub gold: SideKinematics,
    /// Table of the green arm.
    pub green: SideKinematics,
}

impl KinematicsTable {
    /// Table of an arm.
    pub fn side(&self, side: Side) -> &SideKinematics {
        match side {
            Side::Gold => &self.gold,
            Side::Green => &self.green,
        }
    }
}

/// Rows of one arm: `T = Rx(alpha) Tx(a) Rz(theta) Tz(d)`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SideKinematics {
    /// Twist, degrees.
    pub alpha_deg: [f64; 6],
    /// Length along x, m.
    pub a_m: [f64; 6],
    /// Length along z, m; the third is the insertion joint.
    pub d_m: [LengthEntry; 6],
    /// What is added to the joint angle, degrees; the third is the whole angle.
    pub theta_offset_deg: [f64; 6],
    /// Frame 0 in the world of the paper's laboratory, where known.
    pub frame0_to_world_mm: Option<WorldFrame>,
}

impl SideKinematics {
    /// Every number finite?
    pub(super) fn check(&self, side: &str) -> Result<(), PlantError> {
        finite(&format!("kinematics.{side}.alpha_deg"), &self.alpha_deg)?;
        finite(&format!("kinematics.{side}.a_m"), &self.a_m)?;
        finite(&format!("kinematics.{side}.d_m"), &self.d_m.each_ref().map(LengthEntry::constant_m))?;
        finite(&format!("kinematics.{side}.theta_offset_deg"), &self.theta_offset_deg)
    }
}

/// A length of the table: a constant, or the insertion joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum LengthEntry {
    /// Constant, m.
    Constant(f64),
    /// The joint that moves along the axis.
    Joint(Insertion),
}

/// The one joint that may stand in a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Insertion {
    /// Insertion, joint 3.
    #[serde(rename = "jpos_3")]
    Jpos3,
}

impl LengthEntry {
    /// The constant, m; 0 for the joint.
    pub fn constant_m(&self) -> f64 {
        match self {
            Self::Constant(metres) => *metres,
            Self::Joint(_) => 0.0,
        }
    }

    /// Is it the joint?
    pub fn is_insertion(&self) -> bool {
        matches!(self, Self::Joint(_))
    }
}

/// Rigid transform `p_world = r · p_0 + t`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldFrame {
    /// Rotation, rows.
    pub r: [[f64; 3]; 3],
    /// Translation, mm.
    pub t: [f64; 3],
}

/// `[limits]`, rad and m (section 4).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitTable {
    /// Smallest commanded positions.
    pub min: [f64; JOINTS],
    /// Largest commanded positions.
    pub max: [f64; JOINTS],
    /// Positions at the hard stops.
    pub homing_stop: [f64; JOINTS],
    /// Positions after homing.
    pub home: [f64; JOINTS],
}

/// `[dynamics]` (section 6).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DynamicsTable {
    /// Links of the gold arm.
    pub gold: Dynamics,
    /// Links of the green arm.
    pub green: Dynamics,
    /// Mass matrix and gravity of the gold arm as sums of monomials.
    pub closed_form: ClosedForm,
}

/// Links 1 to 3 of an arm; only combinations of these numbers mean anything (section 6).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dynamics {
    /// Link 1.
    pub link1: Link,
    /// Link 2.
    pub link2: Link,
    /// Link 3.
    pub link3: Link,
}

/// A rigid link in its own frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass, kg·m².
    pub inertia_com_kg_m2: [[f64; 3]; 3],
}

impl Dynamics {
    /// Masses positive, every number finite?
    pub(super) fn check(&self, side: &str) -> Result<(), PlantError> {
        for (number, link) in [(1, &self.link1), (2, &self.link2), (3, &self.link3)] {
            let key = format!("dynamics.{side}.link{number}");
            positive(&format!("{key}.mass_kg"), &[link.mass_kg])?;
            finite(&format!("{key}.com_m"), &link.com_m)?;
            finite(&format!("{key}.inertia_com_kg_m2"), link.inertia_com_kg_m2.as_flattened())?;
        }
        Ok(())
    }
}

/// A coefficient and its monomial in `s1 c1 s2 c2 d`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Term(pub f64, pub String);

/// The simulator's closed form, gold arm; arguments theta_1, theta_2, d = jpos_3.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "entries of the mass matrix M and of the gravity vector g, named by their indices")]
pub struct ClosedForm {
    pub m11: Vec<Term>,
    pub m12: Vec<Term>,
    pub m13: Vec<Term>,
    pub m22: Vec<Term>,
    pub m23: Vec<Term>,
    pub m33: Vec<Term>,
    pub g1: Vec<Term>,
    pub g2: Vec<Term>,
    pub g3: Vec<Term>,
}
