//! Gravity feed-forward of the control software: static torque of three point masses (raven2-plant.md, section 5).

use nalgebra::{Point3, Vector3};

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

    /// Torque (joints 1, 2; N·m) and force (joint 3; N) that hold the arm against gravity.
    fn joint_load(&self, joints: &Joints) -> [f64; LINKS] {
        let frames = self.kinematics.frames(joints);
        let mut load = [0.0; LINKS];
        for link in 0..LINKS {
            let weight = self.gravity_m_s2 * self.mass_kg[link];
            let centre = frames[link] * self.com_m[link];
            for (joint, frame) in frames.iter().enumerate().take(link + 1) {
                let axis = frame.rotation * Vector3::z();
                let lever = centre.coords - frame.translation.vector;
                // Joints 1 and 2 turn about their axis, joint 3 slides along it.
                let motion = if joint == 2 { axis } else { axis.cross(&lever) };
                load[joint] -= weight.dot(&motion);
            }
        }
        load
    }
}
