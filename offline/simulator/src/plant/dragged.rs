//! What a motor drags along on its own way: a spring to something that sits until it slips.

use super::drive::Drive;

/// Cables that run along a joint and are held by other motors, as a RAVEN-II's four tool cables run along its insertion: pulled from where they
/// sit they give way like a spring, up to a level at which they slip. The level is that of rest; it fades while they are moved, and comes back.
///
/// `T = K s`, `s' = m'` where `|K s|` is below the level `F (1 - w)`, `w' = (1 - exp(-|m'|/v) - w)/t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dragged {
    /// K, N·m at the capstan per motor rad.
    pub stiffness_nm_rad: f64,
    /// F, N·m at the capstan.
    pub level_nm: f64,
    /// v, motor rad/s.
    pub v_s_rad_s: f64,
    /// t, s.
    pub memory_s: f64,
}

impl Dragged {
    /// The level at which it slips, N·m, after so much of it has faded.
    pub fn level(&self, faded: f64) -> f64 {
        self.level_nm * (1.0 - faded)
    }

    /// What fades of it at a speed that lasts.
    pub fn fades(&self, speed: f64) -> f64 {
        -(-speed.abs() / self.v_s_rad_s).exp_m1()
    }

    /// Torque that holds the motor back, N·m at the capstan.
    pub fn torque(&self, strain: f64, faded: f64) -> f64 {
        let level = self.level(faded);
        (self.stiffness_nm_rad * strain).clamp(-level, level)
    }
}

/// The same with its places in the plant's memories: strain, motor rad; and what of the level has faded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Held {
    pub(crate) dragged: Dragged,
    pub(crate) strain: usize,
    pub(crate) faded: usize,
}

impl Drive {
    /// Torque of what it drags along, N·m at the capstan.
    #[inline]
    pub(crate) fn drag(&self, memories: &[f64]) -> f64 {
        self.dragged.map_or(0.0, |held| held.dragged.torque(memories[held.strain], memories[held.faded]))
    }

    /// Rates of its memories at a motor speed.
    #[inline]
    pub(crate) fn drag_rates(&self, speed: f64, memories: &[f64], rates: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            rates[strain] = speed;
            rates[faded] = (dragged.fades(speed) - memories[faded]) / dragged.memory_s;
        }
    }

    /// Lets it slip where it was strained beyond its level.
    #[inline]
    pub(crate) fn slip(&self, memories: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            memories[strain] = dragged.torque(memories[strain], memories[faded]) / dragged.stiffness_nm_rad;
        }
    }

    /// Carries its memories over a time at a constant motor speed.
    pub(crate) fn drag_on(&self, speed: f64, step_s: f64, memories: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            memories[strain] += step_s * speed;
            memories[faded] += -(-step_s / dragged.memory_s).exp_m1() * (dragged.fades(speed) - memories[faded]);
            self.slip(memories);
        }
    }
}
