//! What a motor drags along on its own way: a spring to something that sits until it slips.

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
        // More than all of it may seem to have faded within a step.
        let level = self.level(faded).max(0.0);
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
