//! Command limits, hard stops and home pose of the joints (raven2-plant.md, section 4).

use crate::plant::LimitTable;
use crate::{JOINTS, Joints};

/// Limits of the seven joints, rad and m.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    table: LimitTable,
}

impl Limits {
    pub(crate) fn new(table: &LimitTable) -> Self {
        Self { table: table.clone() }
    }

    /// Smallest joint positions that the controller commands.
    pub fn min(&self) -> &Joints {
        &self.table.min
    }

    /// Largest joint positions that the controller commands.
    pub fn max(&self) -> &Joints {
        &self.table.max
    }

    /// Joint positions at the hard stops that homing drives into.
    pub fn homing_stop(&self) -> &Joints {
        &self.table.homing_stop
    }

    /// Joint positions after homing.
    pub fn home(&self) -> &Joints {
        &self.table.home
    }

    /// Is the joint (0 to 6) inside its command limits?
    pub fn allows(&self, joint: usize, position: f64) -> bool {
        (self.table.min[joint]..=self.table.max[joint]).contains(&position)
    }

    /// Are all joints inside their command limits?
    pub fn contains(&self, joints: &Joints) -> bool {
        (0..JOINTS).all(|joint| self.allows(joint, joints[joint]))
    }
}
