//! Nominal numbers of a drive, without effects.

use super::CableLaw;

/// Friction of one side of a drive as the plant file has it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rubbing {
    /// N·m or N.
    pub coulomb: f64,
    /// Per rad/s or m/s.
    pub viscous: f64,
    /// Speed over which the sign is smoothed.
    pub width: f64,
}

/// What stands between a motor and its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// A cable: motor and joint move apart.
    #[default]
    Cable,
    /// Nothing that gives way: the motor turns with the joint, its inertia and friction act on it. The cable law, and what
    /// effects make of it, then lies between the joint and the ground (a benchmark's spring; of no stiffness for an arm).
    Rigid,
}

/// Spring and damper from a joint to the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Passive {
    /// N·m/rad or N/m.
    pub stiffness: f64,
    /// N·m·s/rad or N·s/m.
    pub damping: f64,
    /// Position at which the spring is at rest, rad or m.
    pub rest: f64,
}

impl Passive {
    /// Neither spring nor damper.
    pub const NONE: Self = Self { stiffness: 0.0, damping: 0.0, rest: 0.0 };
}

/// Nominal numbers of one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveNumbers {
    /// Motor rad per joint unit.
    pub ratio: f64,
    /// Shaft to capstan.
    pub gear: f64,
    /// Capstan N·m per motor rad/s².
    pub inertia: f64,
    /// Cable stretch per deflection, m per rad (joint 3: 1).
    pub radius_m: f64,
    /// Stretch to force.
    pub cable: CableLaw,
    /// Friction of motor and gearbox: N·m at the capstan, motor speed.
    pub motor: Rubbing,
    /// Friction of the joint: joint units.
    pub joint: Rubbing,
    /// Position at which a wrong ratio has no effect, joint units.
    pub home: f64,
    /// Capstan torque under which a motor warms up by one unit of heating, N·m.
    pub torque_ref_nm: f64,
    /// Capstan torque of one amplifier count, N·m.
    pub torque_per_count_nm: f64,
    /// What stands between motor and joint.
    pub between: Between,
    /// From the joint to the ground.
    pub passive: Passive,
}
