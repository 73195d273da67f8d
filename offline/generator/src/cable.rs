//! Force of one cable, with the defects that effects give it.

/// A cable between motor and joint, in joint units. Everything but stiffness and damping is set anew each step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cable {
    stiffness: f64,
    damping: f64,
    /// Missing series compliance, rad/(N m) or m/N.
    pub(crate) compliance: f64,
    /// Full width of play, rad or m.
    pub(crate) play: f64,
    /// Cubic stiffness, N m/rad^3 or N/m^3.
    pub(crate) cubic: f64,
    /// Share and pretension stretch (rad or m) of an antagonist pair that can go slack.
    pub(crate) slack: Option<(f64, f64)>,
    /// Bouc-Wen: share that yields, yield deflection, its state.
    pub(crate) soft: (f64, f64, f64),
    /// Creep so far, rad or m.
    pub(crate) sag: f64,
}

impl Cable {
    /// Without defects.
    pub(crate) fn new(stiffness: f64, damping: f64) -> Self {
        Self { stiffness, damping, compliance: 0.0, play: 0.0, cubic: 0.0, slack: None, soft: (0.0, 1.0, 0.0), sag: 0.0 }
    }

    /// Back to no defects.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.stiffness, self.damping);
    }

    /// Force from deflection (motor ahead of joint) and its rate.
    pub(crate) fn force(&self, deflection: f64, rate: f64) -> f64 {
        let total = deflection - self.sag;
        let half = 0.5 * self.play;
        let stretch = if total > half {
            total - half
        } else if total < -half {
            total + half
        } else {
            return 0.0;
        };
        // damping of a softer cable falls with its stiffness, as loss per swing does not change
        let softer = 1.0 / (1.0 + self.stiffness * self.compliance);
        let (yields, state) = (self.soft.0, self.soft.2);
        let mut force = self.stiffness * softer * ((1.0 - yields) * stretch + yields * state) + self.cubic * stretch.powi(3);
        if let Some((share, pretension)) = self.slack {
            let pair = 0.5 * self.stiffness * ((stretch + pretension).max(0.0) - (pretension - stretch).max(0.0));
            force += share * (pair - force);
        }
        let damped = force + self.damping * softer * rate;
        // in play a cable can only pull back towards the middle, so damping never makes it push
        if self.play == 0.0 || damped * stretch > 0.0 { damped } else { 0.0 }
    }
}
