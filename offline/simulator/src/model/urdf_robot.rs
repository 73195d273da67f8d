//! A robot whose arm comes from a URDF: the arm, a drive per joint, the coupling of the cables, named physics on top.

use arm::serial::{LinkInertia, SerialArm};
use arm::urdf::{self, Options, UrdfArm};
use nalgebra::Vector3;

use super::controller_model::ControllerModel;
use super::drive_model::DriveModel;
use super::effect::Names;
use super::{Effect, RobotError};
use crate::plant::{JOINTS_MAX, Passive};

/// Largest time step of the plant where the file says nothing, s: that of RAVEN-II's plant.
pub(super) const STEP_S: f64 = 0.25e-3;

/// A robot made of a URDF.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfRobot {
    /// Its name.
    pub name: String,
    /// Text of the URDF, lines ending in `\n`.
    pub(super) urdf: String,
    /// The link at the end of the chain, where the arm branches.
    pub(super) tip: Option<String>,
    /// Gravity in the root link, m/s².
    pub(super) gravity_m_s2: [f64; 3],
    /// What the URDF says; its arm has the inertia of the URDF.
    pub(super) loaded: UrdfArm,
    /// Links with another inertia than the URDF's.
    pub(super) inertias: Vec<Option<LinkInertia>>,
    /// One per joint.
    pub drives: Vec<DriveModel>,
    /// Springs and dampers to the ground, one per joint.
    pub passive: Vec<Passive>,
    /// What joint `j` adds to the position that motor `i` sees, joint units; ones on the diagonal.
    pub coupling: Vec<Vec<f64>>,
    /// Gains, where known.
    pub controller: Option<ControllerModel>,
    /// Standard deviation of the offset that each homing leaves, rad and m.
    pub homing_offset_sd: Vec<f64>,
    /// Largest time step of the plant, s.
    pub step_s: f64,
    /// Named physics on top.
    pub effects: Vec<Effect>,
}

impl UrdfRobot {
    /// From the text of a URDF. `place` stands before its errors, which have their own lines.
    pub(super) fn new(text: &str, tip: Option<&str>, gravity_m_s2: Option<[f64; 3]>, place: &str) -> Result<Self, RobotError> {
        let text = text.replace("\r\n", "\n");
        let mut options = Options { tip: tip.map(str::to_owned), ..Options::default() };
        if let Some(gravity) = gravity_m_s2 {
            options.gravity_in_root_m_s2 = Vector3::from(gravity);
        }
        let refuse = |what: String| RobotError::Urdf { place: place.to_owned(), what };
        let loaded = urdf::load_with(&text, &options).map_err(|error| {
            let branches = matches!(error, urdf::UrdfError::Branch { .. });
            let remedy = if branches { " (a robot file with base = \"urdf\" takes `tip`)" } else { "" };
            refuse(format!("{error}{remedy}"))
        })?;
        let n = loaded.arm.joint_count();
        if n > JOINTS_MAX {
            return Err(refuse(format!(
                "the arm has {n} moving joints, this simulator takes up to {JOINTS_MAX}; fix some of them"
            )));
        }
        let bodies = loaded.arm.bodies();
        Ok(Self {
            name: loaded.arm.name().to_owned(),
            urdf: text,
            tip: tip.map(str::to_owned),
            gravity_m_s2: options.gravity_in_root_m_s2.into(),
            inertias: vec![None; n],
            drives: loaded.drives.iter().zip(bodies).map(|(drive, body)| DriveModel::of_urdf(drive, body)).collect(),
            passive: vec![Passive::NONE; n],
            coupling: (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect(),
            controller: None,
            homing_offset_sd: vec![0.0; n],
            step_s: STEP_S,
            effects: Vec::new(),
            loaded,
        })
    }

    /// Joints.
    pub fn joint_count(&self) -> usize {
        self.drives.len()
    }

    /// The arm with the inertias that differ from the URDF's.
    pub fn arm(&self) -> SerialArm {
        let mut arm = self.loaded.arm.clone();
        for (link, inertia) in self.inertias.iter().enumerate() {
            if let Some(inertia) = inertia {
                arm.set_link_inertia(link, *inertia);
            }
        }
        arm
    }

    /// The arm whose links are where effects of `link_geometry` put them.
    pub(crate) fn true_arm(&self) -> SerialArm {
        crate::any_arm::bent(&self.arm(), &self.effects)
    }

    /// What was assumed in reading the URDF, one line each.
    pub fn notes(&self) -> &[String] {
        &self.loaded.notes
    }

    /// A drive as the URDF alone says.
    pub(super) fn drive_of_urdf(&self, joint: usize) -> DriveModel {
        DriveModel::of_urdf(&self.loaded.drives[joint], &self.loaded.arm.bodies()[joint])
    }

    pub(super) fn names(&self) -> Names {
        let bodies = self.loaded.arm.bodies();
        let mut links: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
        if let Some(tool) = self.loaded.arm.tools().first().filter(|tool| !links.contains(&tool.name)) {
            links.push(tool.name.clone());
        }
        Names { joints: bodies.iter().map(|body| body.joint.name.clone()).collect(), links }
    }
}
