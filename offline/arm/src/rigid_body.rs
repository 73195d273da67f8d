//! RAVEN-II as a serial arm: joints 1 to 3 with the plant's inertia, or the six axes to the tip (raven2-plant.md, sections 2
//! and 6).

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use crate::kinematics::FRAMES;
use crate::plant::{Link, Plant, SideKinematics};
use crate::serial::{Body, Joint, JointKind, JointLimits, LinkInertia, SerialArm, Tool};
use crate::{Raven2, Side};

/// Joints that have a dynamic model.
pub const RIGID_JOINTS: usize = 3;

/// Names of the axes; the sixth is the wrist's yaw, half the difference of the jaws.
const AXES: [&str; FRAMES] = ["shoulder", "elbow", "insertion", "tool_roll", "wrist", "wrist_yaw"];

impl Raven2 {
    /// Joints 1 to 3 of an arm with links, inertia and gravity of the plant file: positions j1, j2 in rad, j3 in m as the
    /// controller counts them, link frames 1 to 3 and base frame 0 of section 2. Tools, fixed to link 3: `tip`, where all
    /// tool axes stand at 0, and `wrist`.
    ///
    /// # Panics
    /// If the plant did not come from a file and does not pass [`Plant::check`].
    pub fn rigid_body(&self, side: Side) -> SerialArm {
        let mut bodies = bodies(self.plant(), side);
        let tool_frames = bodies.split_off(RIGID_JOINTS);
        let mut pose = IsometryMatrix3::identity();
        let mut tools: Vec<Tool> = tool_frames
            .iter()
            .enumerate()
            .map(|(i, body)| {
                pose *= body.placement;
                Tool { name: ["wrist", "wrist_turned", "tip"][i].to_owned(), pose }
            })
            .collect();
        tools.remove(1);
        tools.reverse();
        self.serial(side, "rigid", bodies, tools)
    }

    /// The six axes j1 to j5 and wrist yaw of an arm; links 4 to 6 without mass, tip = link 6. For kinematics and
    /// Jacobian: its mass matrix has no inverse.
    ///
    /// # Panics
    /// If the plant did not come from a file and does not pass [`Plant::check`].
    pub fn six_axes(&self, side: Side) -> SerialArm {
        self.serial(side, "six_axes", bodies(self.plant(), side), Vec::new())
    }

    fn serial(&self, side: Side, what: &str, bodies: Vec<Body>, tools: Vec<Tool>) -> SerialArm {
        let name = format!("{}-{}-{what}", self.plant().name, side.name());
        let gravity = Vector3::from(self.plant().kinematics.gravity_m_s2);
        match SerialArm::new(&name, bodies, gravity, tools) {
            Ok(arm) => arm.with_base_name("frame_0"),
            Err(error) => panic!("the plant was changed to numbers that no arm has, see Plant::check: {error}"),
        }
    }
}

/// All six axes.
fn bodies(plant: &Plant, side: Side) -> Vec<Body> {
    let rows = plant.kinematics.side(side);
    let dynamics = match side {
        Side::Gold => &plant.dynamics.gold,
        Side::Green => &plant.dynamics.green,
    };
    let inertia = [&dynamics.link1, &dynamics.link2, &dynamics.link3].map(link_inertia);
    (0..FRAMES)
        .map(|i| Body {
            name: format!("link{}", i + 1),
            joint: joint(plant, rows, i),
            placement: placement(rows, i),
            inertia: inertia.get(i).copied().unwrap_or(LinkInertia::ZERO),
        })
        .collect()
}

/// Modified Denavit-Hartenberg row at joint position 0.
fn placement(rows: &SideKinematics, i: usize) -> IsometryMatrix3<f64> {
    let (sa, ca) = rows.alpha_deg[i].to_radians().sin_cos();
    let (s, c) = rows.theta_offset_deg[i].to_radians().sin_cos();
    let rotation = Matrix3::new(c, -s, 0.0, s * ca, c * ca, -sa, s * sa, c * sa, ca);
    let d_m = rows.d_m[i].constant_m();
    IsometryMatrix3::from_parts(Translation3::new(rows.a_m[i], -d_m * sa, d_m * ca), Rotation3::from_matrix_unchecked(rotation))
}

fn joint(plant: &Plant, rows: &SideKinematics, i: usize) -> Joint {
    let (min, max) = (&plant.limits.min, &plant.limits.max);
    // Yaw is (j7 - j6) / 2.
    let (lower, upper) = if i == 5 { ((min[6] - max[5]) / 2.0, (max[6] - min[5]) / 2.0) } else { (min[i], max[i]) };
    Joint {
        name: AXES[i].to_owned(),
        kind: if rows.d_m[i].is_insertion() { JointKind::Prismatic } else { JointKind::Revolute },
        axis: Vector3::z(),
        limits: JointLimits { lower, upper, ..JointLimits::NONE },
    }
}

fn link_inertia(link: &Link) -> LinkInertia {
    let [x, y, z] = link.inertia_com_kg_m2;
    LinkInertia {
        mass_kg: link.mass_kg,
        com_m: Vector3::from(link.com_m),
        inertia_com_kg_m2: Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]),
    }
}
