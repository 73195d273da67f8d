//! Motor encoders: raw counts to motor angles and back (raven2-plant.md, section 5; ravenstate.md, traps 3 and 6).

use std::f64::consts::TAU;

use crate::plant::Plant;
use crate::{JOINTS, Side};

/// The seven motor encoders of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoders {
    sign: [f64; JOINTS],
    rad_per_count: f64,
    period_s: f64,
}

impl Encoders {
    pub(crate) fn new(plant: &Plant, side: Side) -> Self {
        let signs = match side {
            Side::Gold => &plant.transmission.encoder_sign_gold,
            Side::Green => &plant.transmission.encoder_sign_green,
        };
        Self {
            sign: signs.map(f64::from),
            rad_per_count: TAU / f64::from(plant.sampling.encoder_counts_per_rev),
            period_s: plant.sampling.period_s,
        }
    }

    /// Angle of one count, rad of the motor shaft.
    pub fn rad_per_count(&self) -> f64 {
        self.rad_per_count
    }

    /// Control period that the published speed divides by, whatever the cycle really took, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Sign of the raw count, -1 or 1.
    pub fn sign(&self, joint: usize) -> f64 {
        self.sign[joint]
    }

    /// Motor angle, rad, of a raw count and the offset that homing found.
    pub fn angle(&self, joint: usize, raw_count: i32, offset_counts: f64) -> f64 {
        (self.sign[joint] * f64::from(raw_count) - offset_counts) * self.rad_per_count
    }

    /// Count of a motor angle since motor zero, rounded down as the encoder does: `floor(m · 4000 / 2π)`.
    pub fn quantise(&self, angle: f64) -> f64 {
        (angle / self.rad_per_count).floor()
    }

    /// Raw count that belongs to a count since motor zero (any sign, need not be whole), to the nearest.
    pub fn raw_count(&self, joint: usize, count: f64, offset_counts: f64) -> i32 {
        (self.sign[joint] * (count + offset_counts).round()) as i32
    }

    /// Motor speed as published, rad/s, of two counts one cycle apart.
    pub fn speed(&self, count: f64, count_before: f64) -> f64 {
        (count - count_before) * self.rad_per_count / self.period_s
    }
}
