//! What an arm is: joints, links, drives. The description only; its motion is in `lagrange` and `plant`.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// About its axis, rad.
    Turns,
    /// Along its axis, m.
    Slides,
}

impl Motion {
    /// Unit of position as it stands in column names: `rad` or `m`.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Turns => "rad",
            Self::Slides => "m",
        }
    }

    /// Unit of joint-side torque or force: `N.m` or `N`.
    pub fn effort(self) -> &'static str {
        match self {
            Self::Turns => "N.m",
            Self::Slides => "N",
        }
    }
}

/// A joint and where it sits on the link before it.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// Turning or sliding.
    pub motion: Motion,
    /// Roll, pitch, yaw of the joint frame in the link before it, rad.
    pub rpy: [f64; 3],
    /// Origin of the joint frame in the link before it, m.
    pub xyz: [f64; 3],
    /// Axis in the joint frame.
    pub axis: [f64; 3],
    /// Smallest and largest position, rad or m.
    pub limits: [f64; 2],
    /// Middle of the range that a user works in, rad or m.
    pub centre: f64,
    /// Half the range that a user works in, rad or m.
    pub reach: f64,
}

/// Mass properties of the link that a joint moves.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name in the URDF.
    pub name: String,
    /// kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass, link axes, kg m^2.
    pub inertia: Matrix3<f64>,
}

/// Motor, gearbox, cable and controller of one joint. Motor quantities are before the gearbox.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Motor rad per joint rad or m.
    pub ratio: f64,
    /// Rotor, kg m^2.
    pub inertia: f64,
    /// Dry friction at the motor shaft, N m.
    pub dry: f64,
    /// Viscous friction at the motor shaft, N m s/rad.
    pub viscous: f64,
    /// Cable, joint side, N m/rad or N/m.
    pub stiffness: f64,
    /// Cable, joint side, N m s/rad or N s/m.
    pub damping: f64,
    /// Position gain, N m/rad at the motor.
    pub kp: f64,
    /// Velocity gain, N m s/rad at the motor.
    pub kd: f64,
    /// Integral gain, N m/(rad s) at the motor.
    pub ki: f64,
    /// Largest commanded torque, N m at the motor.
    pub limit: f64,
    /// Torque noise relative to that of RAVEN's motors.
    pub noise: f64,
}

/// How dry friction is made continuous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DryLaw {
    /// `v / sqrt(v^2 + v_e^2)`; v_e in motor rad/s. Nothing holds at rest.
    Smooth(f64),
    /// Dahl bristles that bend by this many motor rad before they slip. Holds at rest.
    Bristle(f64),
}

/// A serial arm with one drive per joint.
#[derive(Clone, Debug)]
pub struct Arm {
    /// Name in the URDF and in the head of recordings.
    pub name: String,
    /// Roll, pitch, yaw of the base in the world, rad. Gravity is along the world's -z.
    pub mount: [f64; 3],
    /// From the base outward.
    pub joints: Vec<Joint>,
    /// Link k is moved by joint k.
    pub links: Vec<Link>,
    /// Tip in the last link, m.
    pub tip: [f64; 3],
    /// One per joint.
    pub drives: Vec<Drive>,
    /// Of all drives.
    pub dry_law: DryLaw,
}

/// Gravity in the world, m/s^2.
pub const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// URDF's fixed-axis roll, pitch, yaw as a matrix.
pub fn rotation(rpy: [f64; 3]) -> Matrix3<f64> {
    Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]).into_inner()
}

impl Arm {
    /// Gravity in the base frame, m/s^2.
    pub fn gravity(&self) -> Vector3<f64> {
        rotation(self.mount).transpose() * GRAVITY
    }

    /// Number of joints.
    pub fn size(&self) -> usize {
        self.joints.len()
    }
}
