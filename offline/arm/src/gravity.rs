//! Gravity feed-forward of the control software: static torque of three point masses (raven2-plant.md, section 5).

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::kinematics::Kinematics;
use crate::plant::Plant;
use crate::{Joints, Side};

/// Links that the feed-forward knows.
const LINKS: usize = 3;

/// The controller's gravity model of one arm; its masses differ from the plant's on purpose (section 9).
#[derive(Debug, Clone, PartialEq)]
pub struct GravityFeedForward {
    kinematics: Kinematics,
    gravity_m_s2: Vector3<f64>,
    mass_kg: [f64; LINKS],
    com_m: [Point3<f64>; LINKS],
    /// Capstan torque per joint torque: gear / ratio.
    capstan_share: [f64; LINKS],
}

impl GravityFeedForward {
    pub(crate) fn new(plant: &Plant, side: Side) -> Self {
        let model = &plant.control.gravity_model;
        let com_m = match side {
            Side::Gold => model.com_gold_m,
            Side::Green => model.com_green_m,
        };
        Self {
            kinematics: Kinematics::new(&plant.kinematics, side),
            gravity_m_s2: Vector3::from(model.gravity_m_s2),
            mass_kg: model.mass_kg,
            com_m: com_m.map(Point3::from),
            capstan_share: std::array::from_fn(|i| plant.transmission.gear_big / plant.transmission.ratio[i]),
        }
    }

    /// Torque at the capstans of motors 1 to 3 that holds the arm against gravity, N·m.
    pub fn capstan_torque(&self, joints: &Joints) -> [f64; LINKS] {
        let load = self.joint_load(joints);
        std::array::from_fn(|i| load[i] * self.capstan_share[i])
    }

    /// Torque at the capstans of motors 1 to 3 that holds a mass at the tip, N·m per kg, without friction.
    pub fn capstan_torque_per_tip_kg(&self, joints: &Joints) -> [f64; LINKS] {
        let frames = self.kinematics.frames(joints);
        let load = Self::held(&frames, self.kinematics.tip_position(joints), self.gravity_m_s2, LINKS);
        std::array::from_fn(|i| load[i] * self.capstan_share[i])
    }

    /// Torque (joints 1, 2; N·m) and force (joint 3; N) that hold the arm against gravity.
    fn joint_load(&self, joints: &Joints) -> [f64; LINKS] {
        let frames = self.kinematics.frames(joints);
        let mut load = [0.0; LINKS];
        for link in 0..LINKS {
            let weight = self.gravity_m_s2 * self.mass_kg[link];
            let held = Self::held(&frames, (frames[link] * self.com_m[link]).coords, weight, link + 1);
            load.iter_mut().zip(held).for_each(|(load, held)| *load += held);
        }
        load
    }

    /// What the first so many joints hold of a weight, N, at a point, m.
    fn held(frames: &[IsometryMatrix3<f64>], point: Vector3<f64>, weight: Vector3<f64>, joints: usize) -> [f64; LINKS] {
        let mut held = [0.0; LINKS];
        for (joint, frame) in frames.iter().enumerate().take(joints) {
            let axis = frame.rotation * Vector3::z();
            // Joints 1 and 2 turn about their axis, joint 3 slides along it.
            let motion = if joint == 2 { axis } else { axis.cross(&(point - frame.translation.vector)) };
            held[joint] = -weight.dot(&motion);
        }
        held
    }
}
