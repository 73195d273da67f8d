//! The robot: the plant file, and one [`Arm`] per side and tool taken from it.

use std::sync::LazyLock;

use crate::actuation::Amplifiers;
use crate::gravity::GravityFeedForward;
use crate::kinematics::Kinematics;
use crate::limits::Limits;
use crate::plant::{Plant, PlantError};
use crate::sensing::Encoders;
use crate::transmission::Transmission;
use crate::{Side, Tool};

/// The nominal plant file, embedded: a byte copy of the specification's `raven2-plant.toml`.
const NOMINAL_TOML: &str = include_str!("../../../models/raven2-plant.toml");

static NOMINAL: LazyLock<Raven2> = LazyLock::new(|| match Raven2::from_toml(NOMINAL_TOML) {
    Ok(raven) => raven,
    Err(error) => panic!("models/raven2-plant.toml, embedded at build time, is not a plant: {error}"),
});

/// A RAVEN-II robot with both arms.
#[derive(Debug, Clone, PartialEq)]
pub struct Raven2 {
    plant: Plant,
}

impl Raven2 {
    /// The nominal robot, parsed once.
    pub fn nominal() -> &'static Self {
        &NOMINAL
    }

    /// A robot from the text of a plant file.
    ///
    /// # Errors
    /// [`PlantError`] with the key and what is wrong with it.
    pub fn from_toml(text: &str) -> Result<Self, PlantError> {
        Ok(Self { plant: Plant::from_toml(text)? })
    }

    /// A robot with changed numbers of a plant that was read before; they are not checked again.
    pub fn from_plant(plant: Plant) -> Self {
        Self { plant }
    }

    /// All parameters of the plant file, also those that no arm function needs (cables, friction, dynamics).
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The arm of a side with the nominal tool, the RAVEN grasper.
    pub fn arm(&self, side: Side) -> Arm {
        self.arm_with_tool(side, Tool::default())
    }

    /// The arm of a side with a tool.
    pub fn arm_with_tool(&self, side: Side, tool: Tool) -> Arm {
        let kinematics = Kinematics::new(&self.plant.kinematics, side);
        let transmission = Transmission::new(&self.plant.transmission, side, tool);
        let gravity = GravityFeedForward::new(&self.plant, side);
        Arm {
            side,
            tool,
            limits: Limits::new(&self.plant.limits),
            encoders: Encoders::new(&self.plant, side),
            amplifiers: Amplifiers::new(&self.plant, side),
            kinematics,
            transmission,
            gravity,
        }
    }
}

/// One arm with its tool: every map between encoder counts, motor angles, joints, tip, torque and amplifier command.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Which arm.
    pub side: Side,
    /// Which tool.
    pub tool: Tool,
    /// Command limits, hard stops and home pose of the joints.
    pub limits: Limits,
    /// Joints to tip.
    pub kinematics: Kinematics,
    /// Motors to joints and back, through the cables.
    pub transmission: Transmission,
    /// Encoder counts to motor angles and back.
    pub encoders: Encoders,
    /// Torque to amplifier command and back.
    pub amplifiers: Amplifiers,
    /// Torque that the controller adds against gravity.
    pub gravity: GravityFeedForward,
}
