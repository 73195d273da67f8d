//! Friction of one joint, at the motor or at the link, in joint-side units.

use crate::arm::DryLaw;

/// Everything that brakes one shaft at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Brake {
    /// Dry level, N m or N.
    pub dry: f64,
    /// Stribeck excess over `dry` at rest, N m or N.
    pub excess: f64,
    /// Stribeck speed, rad/s or m/s.
    pub speed: f64,
    /// Stribeck exponent.
    pub power: f64,
    /// Viscous, N m s/rad or N s/m.
    pub viscous: f64,
    /// Quadratic drag, N m s^2/rad^2 or N s^2/m^2.
    pub drag: f64,
}

impl Brake {
    /// Dry level at a speed.
    pub fn level(&self, v: f64) -> f64 {
        if self.excess == 0.0 { self.dry } else { self.dry + self.excess * (-(v.abs() / self.speed).powf(self.power)).exp() }
    }

    /// What grows with speed.
    pub fn fluid(&self, v: f64) -> f64 {
        (self.viscous + self.drag * v.abs()) * v
    }
}

/// The sign of velocity, made continuous; holds the bristle if there is one.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    law: DryLaw,
    scale: f64,
    bend: f64,
}

/// Share of the dry level that brakes the vibration of a bristle, in units of bend per `1/REST` s.
const REST: f64 = 0.004;

impl Contact {
    /// A contact whose law is stated per motor rad, seen through `ratio` motor rad per unit of this shaft.
    pub fn new(law: DryLaw, ratio: f64) -> Self {
        let scale = match law {
            DryLaw::Smooth(speed) => speed / ratio,
            DryLaw::Bristle(length) => length / ratio,
        };
        Self { law, scale, bend: 0.0 }
    }

    /// Signed share of the dry level, in about [-1, 1].
    pub fn sign(&self, v: f64) -> f64 {
        match self.law {
            DryLaw::Smooth(_) => v / (v * v + self.scale * self.scale).sqrt(),
            DryLaw::Bristle(_) => self.bend + REST * (v - v.abs() * self.bend) / self.scale,
        }
    }

    /// Slope of `sign` over speed, never negative.
    pub fn slope(&self, v: f64) -> f64 {
        match self.law {
            DryLaw::Smooth(_) => {
                let h = (v * v + self.scale * self.scale).sqrt();
                self.scale * self.scale / (h * h * h)
            }
            DryLaw::Bristle(_) => (REST * (1.0 - v.signum() * self.bend) / self.scale).max(0.0),
        }
    }

    /// Bends the bristle for a step at constant speed, exactly.
    pub fn advance(&mut self, v: f64, dt: f64) {
        if matches!(self.law, DryLaw::Bristle(_)) {
            let end = v.signum();
            self.bend = end + (self.bend - end) * (-v.abs() * dt / self.scale).exp();
        }
    }
}
