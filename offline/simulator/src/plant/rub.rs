//! Friction before the cable, in units of the joint.

use crate::model::Effect;
use crate::physics::{CoulombFriction, Physics, StribeckFriction, ViscousFriction};

use super::Drive;
use super::timed::Timed;

/// Friction that a motor can have beyond its nominal one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rub {
    /// Of constant size.
    Coulomb(CoulombFriction),
    /// In proportion to the speed.
    Viscous(ViscousFriction),
    /// Larger at low speed.
    Stribeck(StribeckFriction),
}

/// What friction amounts to at a speed, units of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Rubbed {
    /// Level that the sign of the speed is multiplied by.
    pub(crate) level: f64,
    /// Torque that is the same in both directions.
    pub(crate) one_sided: f64,
    /// Torque per speed.
    pub(crate) viscous: f64,
}

impl Rub {
    /// At a speed of the joint and its smoothed sign.
    pub(crate) fn at(&self, speed: f64, sign: f64) -> Rubbed {
        match self {
            Self::Coulomb(own) => Rubbed { level: own.f_c, one_sided: own.torque(sign) - own.f_c * sign, ..Rubbed::default() },
            Self::Viscous(own) => Rubbed { viscous: own.b, ..Rubbed::default() },
            Self::Stribeck(own) => Rubbed { level: own.level(speed), ..Rubbed::default() },
        }
    }

    /// Largest level and slope, whatever the speed.
    pub(crate) fn most(&self) -> (f64, f64) {
        match self {
            Self::Coulomb(own) => (own.f_c * (1.0 + own.asymmetry.abs()), 0.0),
            Self::Viscous(own) => (0.0, own.b),
            Self::Stribeck(own) => (own.f_s.max(own.f_c), 0.0),
        }
    }
}

impl Drive {
    /// Adds friction to the motor; any other physics is none of it.
    pub(crate) fn rub_motor(&mut self, effect: &Effect) {
        let rub = match effect.physics {
            Physics::CoulombFriction(own) => Rub::Coulomb(own),
            Physics::ViscousFriction(own) => Rub::Viscous(own),
            Physics::StribeckFriction(own) => Rub::Stribeck(own),
            _ => return,
        };
        self.on_motor.push(Timed::new(rub, effect.from_s, effect.to_s));
    }
}
