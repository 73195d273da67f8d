//! The arm as data, its checks on construction, and what may change while it runs.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};

use super::stage::Stage;
use super::{Body, LinkInertia, PARAMETERS, Tool};

/// Why bodies do not make an arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SerialArmError {
    /// An arm without joints.
    #[error("arm {arm}: it has no joint; give at least one body")]
    NoJoints {
        /// Name of the arm.
        arm: String,
    },
    /// A number that no joint or link has.
    #[error("arm {arm}, {part} {name}: {what}; correct the value")]
    Value {
        /// Name of the arm.
        arm: String,
        /// `joint`, `link` or `tool`.
        part: &'static str,
        /// Name of the part.
        name: String,
        /// What is wrong.
        what: &'static str,
    },
}

/// A serial arm: joints, links, tools and gravity. Constant while algorithms run; see [the module](super).
#[derive(Debug, Clone, PartialEq)]
pub struct SerialArm {
    name: String,
    base: String,
    bodies: Vec<Body>,
    pub(super) stages: Vec<Stage>,
    tools: Vec<Tool>,
    tool: usize,
    pub(super) gravity_m_s2: Vector3<f64>,
}

impl SerialArm {
    /// An arm of bodies in order from the base. Gravity in the base frame, m/s². The first tool is the tip; without tools it
    /// is the frame of the last link.
    ///
    /// # Errors
    /// [`SerialArmError`] with the joint, link or tool and what is wrong with it.
    pub fn new(name: &str, bodies: Vec<Body>, gravity_m_s2: Vector3<f64>, tools: Vec<Tool>) -> Result<Self, SerialArmError> {
        if bodies.is_empty() {
            return Err(SerialArmError::NoJoints { arm: name.to_owned() });
        }
        for body in &bodies {
            check_body(name, body)?;
        }
        for tool in &tools {
            require(is_pose(&tool.pose), name, "tool", &tool.name, "its pose is not a finite rigid transform")?;
        }
        let mut before = Rotation3::identity();
        let stages = bodies
            .iter()
            .map(|body| {
                let stage = Stage::new(body, &before);
                before = stage.alignment;
                stage
            })
            .collect();
        Ok(Self { name: name.to_owned(), base: "base".to_owned(), bodies, stages, tools, tool: 0, gravity_m_s2 })
    }

    /// The same arm with another name for its base frame than `base`.
    #[must_use]
    pub fn with_base_name(mut self, base: &str) -> Self {
        base.clone_into(&mut self.base);
        self
    }

    /// Name of the arm.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name of the frame that everything "in the base frame" is in.
    pub fn base_name(&self) -> &str {
        &self.base
    }

    /// Joints, and moving links: N.
    pub fn joint_count(&self) -> usize {
        self.bodies.len()
    }

    /// The bodies from the base to the tip.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Frames fixed to the last link.
    pub fn tools(&self) -> &[Tool] {
        &self.tools
    }

    /// Makes the tool with this index the tip.
    ///
    /// # Panics
    /// If there are not so many tools.
    pub fn select_tool(&mut self, index: usize) {
        assert!(index < self.tools.len(), "tool {index} of {}", self.tools.len());
        self.tool = index;
    }

    /// Pose of the tip in the frame of the last link.
    pub fn tool_pose(&self) -> IsometryMatrix3<f64> {
        self.tools.get(self.tool).map_or_else(IsometryMatrix3::identity, |tool| tool.pose)
    }

    /// Gravity in the base frame, m/s².
    pub fn gravity_vector(&self) -> Vector3<f64> {
        self.gravity_m_s2
    }

    /// Another gravity, in the base frame, m/s².
    pub fn set_gravity(&mut self, gravity_m_s2: Vector3<f64>) {
        self.gravity_m_s2 = gravity_m_s2;
    }

    /// Inertia of a link in the link's frame.
    pub fn link_inertia(&self, link: usize) -> LinkInertia {
        self.bodies[link].inertia
    }

    /// Another inertia for a link. Allocates nothing. Not checked: an identified parameter set may be impossible as a body
    /// ([`LinkInertia::is_physically_consistent`]) and still be wanted.
    pub fn set_link_inertia(&mut self, link: usize, inertia: LinkInertia) {
        self.bodies[link].inertia = inertia;
        self.stages[link].set_inertia(&inertia);
    }

    /// Adds a point mass, kg, to the last link at a point in that link's frame, m. A negative mass takes it off again, up to
    /// rounding; to restore exactly, keep [`Self::link_inertia`] and set it back. Allocates nothing.
    pub fn add_point_mass(&mut self, mass_kg: f64, point_in_last_link_m: Vector3<f64>) {
        let last = self.bodies.len() - 1;
        let loaded = self.bodies[last].inertia.plus(&LinkInertia::point(mass_kg, point_in_last_link_m));
        self.set_link_inertia(last, loaded);
    }

    /// Adds a point mass, kg, at a point in the tip's frame, m.
    pub fn add_point_mass_at_tip(&mut self, mass_kg: f64, point_in_tool_m: Vector3<f64>) {
        let pose = self.tool_pose();
        self.add_point_mass(mass_kg, pose.rotation * point_in_tool_m + pose.translation.vector);
    }

    /// The ten inertial parameters of every link, one after the other, into 10·N numbers.
    ///
    /// # Panics
    /// If `out` is not 10·N long.
    pub fn parameters(&self, out: &mut [f64]) {
        assert_eq!(out.len(), PARAMETERS * self.joint_count(), "10 N parameters");
        for (body, part) in self.bodies.iter().zip(out.chunks_exact_mut(PARAMETERS)) {
            part.copy_from_slice(&body.inertia.parameters());
        }
    }

    /// Takes the inertia of every link from 10·N parameters.
    ///
    /// # Panics
    /// If `parameters` is not 10·N long.
    pub fn set_parameters(&mut self, parameters: &[f64]) {
        assert_eq!(parameters.len(), PARAMETERS * self.joint_count(), "10 N parameters");
        for (link, part) in parameters.as_chunks().0.iter().enumerate() {
            self.set_link_inertia(link, LinkInertia::from_parameters(part));
        }
    }
}

fn check_body(arm: &str, body: &Body) -> Result<(), SerialArmError> {
    let joint = &body.joint;
    let axis_length = joint.axis.norm();
    let limits = &joint.limits;
    let ordered = limits.lower <= limits.upper && limits.velocity >= 0.0 && limits.effort >= 0.0;
    let axis_good = axis_length.is_finite() && axis_length > f64::MIN_POSITIVE.sqrt();
    require(axis_good, arm, "joint", &joint.name, "its axis is not a direction")?;
    require(ordered, arm, "joint", &joint.name, "its limits are not in order or not numbers")?;
    require(is_pose(&body.placement), arm, "joint", &joint.name, "its placement is not a finite rigid transform")?;
    require(body.inertia.is_usable(), arm, "link", &body.name, "its mass is negative or its inertia is not finite")
}

fn require(good: bool, arm: &str, part: &'static str, name: &str, what: &'static str) -> Result<(), SerialArmError> {
    if good { Ok(()) } else { Err(SerialArmError::Value { arm: arm.to_owned(), part, name: name.to_owned(), what }) }
}

/// Finite, and a proper rotation but for rounding? Written so that NaN fails.
fn is_pose(pose: &IsometryMatrix3<f64>) -> bool {
    let r = pose.rotation.matrix();
    let orthonormal = (r.transpose() * r - Matrix3::identity()).amax() < 1e-9 && r.determinant() > 0.0;
    orthonormal && pose.translation.vector.iter().all(|value| value.is_finite())
}
