//! Amplifiers: torque at the capstan to command counts and back, and the controller's law (raven2-plant.md, section 5).

use crate::plant::Plant;
use crate::{JOINTS, Motors, Side};

/// The seven amplifiers and motors of an arm, with the gains of its controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplifiers {
    counts_per_nm: [f64; JOINTS],
    limit_counts: [f64; JOINTS],
    gear: [f64; JOINTS],
    kp: [f64; JOINTS],
    kd: [f64; JOINTS],
}

impl Amplifiers {
    pub(crate) fn new(plant: &Plant, side: Side) -> Self {
        let motor = &plant.motor;
        let (signs, kd) = match side {
            Side::Gold => (&motor.dac_sign_gold, plant.control.kd_gold),
            Side::Green => (&motor.dac_sign_green, plant.control.kd_green),
        };
        let gear = plant.transmission.gears();
        Self {
            counts_per_nm: std::array::from_fn(|i| {
                f64::from(signs[i]) * f64::from(motor.dac_per_amp[i]) / (motor.torque_constant_nm_a[i] * gear[i])
            }),
            limit_counts: motor.dac_limit.map(f64::from),
            gear,
            kp: plant.control.kp,
            kd,
        }
    }

    /// Command counts per N·m of capstan torque, with the sign of the arm.
    pub fn counts_per_nm(&self) -> &[f64; JOINTS] {
        &self.counts_per_nm
    }

    /// Gear between motor shaft and capstan: capstan torque = gear · shaft torque.
    pub fn gear(&self) -> &[f64; JOINTS] {
        &self.gear
    }

    /// Command counts for a capstan torque, truncated toward zero, before clipping.
    pub fn counts_unclipped(&self, joint: usize, torque_nm: f64) -> f64 {
        (self.counts_per_nm[joint] * torque_nm).trunc()
    }

    /// Command counts for a capstan torque, truncated toward zero and clipped, as `dac_val` has them.
    pub fn counts(&self, joint: usize, torque_nm: f64) -> i32 {
        let limit = self.limit_counts[joint];
        self.counts_unclipped(joint, torque_nm).clamp(-limit, limit) as i32
    }

    /// Capstan torque that command counts stand for, N·m.
    pub fn torque(&self, joint: usize, counts: f64) -> f64 {
        counts / self.counts_per_nm[joint]
    }

    /// Proportional and derivative part of the controller, N·m at the capstan; the derivative acts on the measured
    /// speed. Neither the integral of joints 4 to 7 nor gravity is in it.
    pub fn proportional_derivative(&self, command: &Motors, motors: &Motors, speeds: &Motors) -> Motors {
        std::array::from_fn(|i| self.kp[i] * (command[i] - motors[i]) - self.kd[i] * speeds[i])
    }
}
