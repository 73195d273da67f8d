//! The robot as the engine sees it: a serial arm, its drives and its transmission, nothing about any recording.

use arm::kinematics::Kinematics;
use arm::serial::SerialArm;
use nalgebra::DMatrix;
use simulator::model::{Bound, Connection, RobotError, RobotModel};

/// What one drive is believed to be, on the joint's side of the gearbox.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveNominal {
    /// Rotor inertia at the joint, kg·m² (prismatic: kg); NaN where it is not known.
    pub rotor_inertia: f64,
    /// Coulomb friction, N·m or N.
    pub coulomb: f64,
    /// Viscous friction, N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Series stiffness between motor and joint, N·m/rad or N/m; infinite for a rigid one.
    pub stiffness: f64,
    /// Torque at the shaft per command count, N·m, with the drive's sign; 0 where not known.
    pub torque_per_count: f64,
    /// Joint position where the motor stands at 0.
    pub offset: f64,
    /// Friction behind the cable, which loads it: viscous, dry, and the speed over which its sign turns; all of it is in the two above, too.
    pub behind: [f64; 3],
    /// Spring from the joint to the ground: stiffness, damping, rest position.
    pub ground: [f64; 3],
}

impl Default for DriveNominal {
    fn default() -> Self {
        Self {
            rotor_inertia: f64::NAN,
            coulomb: 0.0,
            viscous: 0.0,
            stiffness: f64::INFINITY,
            torque_per_count: 0.0,
            offset: 0.0,
            behind: [0.0, 0.0, 1.0],
            ground: [0.0; 3],
        }
    }
}

/// A place where a weight may hang.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadSite {
    /// Index of the link.
    pub link: usize,
    /// In the link's frame, m.
    pub position_m: [f64; 3],
    /// What to call it.
    pub name: Option<String>,
}

/// An arm with its drives.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Kinematics and inertia.
    pub arm: SerialArm,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Names of the links.
    pub links: Vec<String>,
    /// Does the joint slide?
    pub prismatic: Vec<bool>,
    /// Motor positions from joint positions, N×N: `m = A q` (gap-design.md, section 2).
    pub motor_from_joint: DMatrix<f64>,
    /// One per joint.
    pub drives: Vec<DriveNominal>,
    /// Names of columns of its recordings that are not those of tidy CSV: name, name in the recording, scale.
    pub columns: Vec<(String, String, f64)>,
    /// Candidate places of a payload beside the last link.
    pub payload_sites: Vec<PayloadSite>,
    /// Physics and joints of the effects that its model holds already: of those there may be less, too.
    pub known: Vec<(String, Vec<usize>)>,
    /// Is it simulated by its own numbers? A lab's simulation may have other friction behind its cables, and begins where the recording does.
    pub simulates_itself: bool,
    /// Of a RAVEN-II the kinematics of all seven joints: its tip goes with the wrist, too.
    pub with_wrist: Option<Kinematics>,
}

/// Travel below which a joint stands, rad and m.
const STANDING: f64 = 0.01;
const STANDING_M: f64 = 0.001;

impl Robot {
    /// Does a joint with these positions move?
    pub(crate) fn moves(&self, j: usize, position: &[f64]) -> bool {
        let (low, high) = crate::series::range(position.iter().copied());
        high - low > self.least_travel(j)
    }

    /// Travel of a joint up to which it stands, rad or m.
    pub(crate) fn least_travel(&self, j: usize) -> f64 {
        if self.prismatic[j] { STANDING_M } else { STANDING }
    }

    /// A robot from its URDF.
    ///
    /// # Errors
    /// What the reader says.
    pub fn from_urdf(text: &str) -> Result<Self, RobotError> {
        Ok(Self::of(&RobotModel::from_urdf(text)?))
    }

    /// What the engine needs of a robot model. RAVEN-II: joints 1 to 3, those with dynamics.
    pub fn of(model: &RobotModel) -> Self {
        let arm = model.arm();
        let n = model.joint_count().min(arm.joint_count());
        let a = model.motor_from_joint();
        let motor_from_joint = DMatrix::from_fn(n, n, |i, j| a[i][j]);
        let passive = model.passive();
        let drives = model.drives().into_iter().zip(passive).take(n).map(|(drive, passive)| {
            let reduction = drive.reduction;
            DriveNominal {
                rotor_inertia: drive.rotor_inertia_kg_m2 * reduction * reduction,
                coulomb: drive.motor_coulomb_nm * reduction.abs() + drive.joint_coulomb,
                viscous: drive.motor_viscous_nm_s * reduction * reduction + drive.joint_viscous,
                stiffness: if drive.connection == Connection::Cable { drive.stiffness } else { f64::INFINITY },
                torque_per_count: drive.torque_per_count_nm(),
                offset: drive.offset,
                behind: [drive.joint_viscous, drive.joint_coulomb, drive.joint_sign_width],
                ground: [passive.stiffness, passive.damping, passive.rest],
            }
        });
        let sites = model.payload_sites.iter().map(|site| PayloadSite {
            link: site.link.min(n - 1),
            position_m: site.position_m,
            name: site.name.clone(),
        });
        Self {
            name: model.name().to_owned(),
            joints: model.joint_names().into_iter().take(n).collect(),
            links: model.link_names().into_iter().take(n).collect(),
            prismatic: arm.bodies().iter().take(n).map(|body| body.joint.kind.is_prismatic()).collect(),
            drives: drives.collect(),
            columns: model.columns.iter().map(|c| (c.name.clone(), c.source.clone(), c.scale)).collect(),
            payload_sites: sites.collect(),
            known: effects_of(model),
            with_wrist: model.as_raven().map(|robot| robot.raven.arm(model.side()).kinematics.clone()),
            simulates_itself: false,
            motor_from_joint,
            arm,
        }
    }

    /// How far the tool's own joints (4 to 7, rad) hold the tip from where it is with all of them at 0, in the base frame, m; joints 1 to 3 in rad
    /// and m. Nothing of a robot without them.
    pub fn off_by_wrist(&self, joints: [f64; 3], wrist: [f64; 4]) -> [f64; 3] {
        let Some(kinematics) = &self.with_wrist else { return [0.0; 3] };
        let ([a, b, c], [d, e, f, g]) = (joints, wrist);
        (kinematics.tip_position(&[a, b, c, d, e, f, g]) - kinematics.tip_position(&[a, b, c, 0.0, 0.0, 0.0, 0.0])).into()
    }

    /// What each joint adds to the position that a drive sees, in the drive's own joint's units: `A` with ones on its diagonal.
    pub fn coupling(&self) -> DMatrix<f64> {
        let a = &self.motor_from_joint;
        DMatrix::from_fn(
            a.nrows(),
            a.ncols(),
            |i, j| if a[(i, i)] == 0.0 { f64::from(u8::from(i == j)) } else { a[(i, j)] / a[(i, i)] },
        )
    }

    /// Share of a strain of each drive's cable (column) that each joint sees, `C⁻¹`.
    pub fn strain_shares(&self) -> DMatrix<f64> {
        let n = self.joint_count();
        self.coupling().try_inverse().unwrap_or_else(|| DMatrix::identity(n, n))
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// How far a joint can move by its model, rad or m; 0 where that is not said.
    pub fn range(&self, joint: usize) -> f64 {
        let limits = self.arm.bodies()[joint].joint.limits;
        let range = limits.upper - limits.lower;
        if range.is_finite() { range } else { 0.0 }
    }

    /// Unit of a joint's position.
    pub fn position_unit(&self, joint: usize) -> &'static str {
        if self.prismatic[joint] { "m" } else { "rad" }
    }

    /// Unit of a joint's effort.
    pub fn effort_unit(&self, joint: usize) -> &'static str {
        if self.prismatic[joint] { "N" } else { "N.m" }
    }
}

/// Physics and joints of the effects of a model, as families of hypotheses have them.
pub(crate) fn effects_of(model: &RobotModel) -> Vec<(String, Vec<usize>)> {
    let joints = |bound: Bound| match bound {
        Bound::Joint(joint) | Bound::Motor(joint) | Bound::Link(joint) => vec![joint],
        Bound::Pair(driven, driver) => vec![driven, driver],
        Bound::Channel(_) | Bound::Robot => Vec::new(),
    };
    model.effects().iter().map(|effect| (effect.physics.name().to_owned(), joints(effect.bound))).collect()
}
