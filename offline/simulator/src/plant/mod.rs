//! The robot without its controller: motors, cables, links, and whatever physics is switched on.
//!
//! Equations of raven2-plant.md, section 7, in joint units: deflection `D = x(m) - C q`, cable torque `T(D, D')`,
//! `M(q) q'' + c + g = C^T T - friction + J^T f`, `Im m'' = tau - friction - gear (dx/dm)^T T`. `C` is the cable coupling as
//! it is; `x(m)` is what the controller would compute from the motors plus homing offset, wrong ratio and eccentric pulleys.
//! A rigid drive has no deflection: its motor is part of the link (`rigid.rs`).

mod cable;
mod drag;
mod dragged;
mod drive;
mod evaluate;
mod inverse;
mod memory;
mod numbers;
mod rates;
mod rest;
mod rigid;
mod rub;
mod solve;
mod step;
mod timed;

use arm::serial::{SerialArm, Workspace};
use nalgebra::Vector3;

pub use cable::{CableForce, CableLaw};
pub use dragged::Dragged;
pub(crate) use dragged::Held;
pub(crate) use drive::{Drive, Stiction};
pub use inverse::{Given, Memory, Needed};
pub use numbers::{Between, DriveNumbers, Passive, Rubbing};
pub use step::Method;
pub(crate) use timed::{Timed, on};

use crate::physics::{ExternalContact, GravityDirection, JointCoupling, JointOffset, LinkInertia, Payload};

/// Most joints that a plant can have.
pub const JOINTS_MAX: usize = 8;
/// Most memories (hysteresis, creep, warmth) that a plant can have.
pub const MEMORIES_MAX: usize = 16;

/// One number per joint; those beyond the plant's joints are 0.
pub type Vector = [f64; JOINTS_MAX];
/// Square matrix over the joints.
pub type Matrix = [[f64; JOINTS_MAX]; JOINTS_MAX];

/// Everything that changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Joint positions, rad or m.
    pub joints: Vector,
    /// Joint rates.
    pub rates: Vector,
    /// Motor angles before the gearbox, rad; 0 is where the joint would be at 0 with a taut cable and a perfect homing.
    pub motors: Vector,
    /// Motor speeds, rad/s.
    pub speeds: Vector,
    /// Memories of hysteresis, creep and warmth.
    pub memories: [f64; MEMORIES_MAX],
}

impl State {
    /// At rest at zero.
    pub const ZERO: Self = Self {
        joints: [0.0; JOINTS_MAX],
        rates: [0.0; JOINTS_MAX],
        motors: [0.0; JOINTS_MAX],
        speeds: [0.0; JOINTS_MAX],
        memories: [0.0; MEMORIES_MAX],
    };

    /// Is every joint and motor somewhere?
    pub fn is_finite(&self) -> bool {
        [&self.joints, &self.rates, &self.motors, &self.speeds].iter().all(|vector| vector.iter().all(|x| x.is_finite()))
    }
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Too many joints.
    #[error("the arm has {found} joints; this simulator takes up to {JOINTS_MAX}")]
    Joints {
        /// As found.
        found: usize,
    },
    /// The coupling cannot be inverted.
    #[error("the cable coupling is singular; joints must follow from motors")]
    Coupling,
    /// Too many effects with memory.
    #[error("effects with memory take more than {MEMORIES_MAX} places; leave some out")]
    Memories,
    /// A joint that moves nothing.
    #[error("joint {joint} moves no mass; give its link an <inertial> or [inertial], or its drive a rotor_inertia_kg_m2")]
    Massless {
        /// Joint, from 1.
        joint: usize,
    },
    /// An effect where it cannot be.
    #[error("{physics} on joint {joint}: {why}")]
    Place {
        /// Its name.
        physics: &'static str,
        /// Joint, from 1.
        joint: usize,
        /// Why not.
        why: &'static str,
    },
}

/// The plant: constant but for effects that start and end, and the scratch memory of the rigid-body algorithms.
#[derive(Debug, Clone)]
pub struct Plant {
    joints: usize,
    body: SerialArm,
    /// The body before any effect.
    nominal_body: SerialArm,
    workspace: Workspace,
    drives: Vec<Drive>,
    /// As the controller believes.
    coupling_nominal: Matrix,
    coupling_inverse: Matrix,
    /// As it is.
    coupling: Matrix,
    /// Deflection per joint position: `coupling`, but for rigid drives, whose spring is between joint and ground.
    path: Matrix,
    /// Is any drive rigid?
    rigid: bool,
    /// (driven, driver).
    coupling_errors: Vec<(Timed<JointCoupling>, usize, usize)>,
    offsets: Vec<(Timed<JointOffset>, usize)>,
    payloads: Vec<Timed<Payload>>,
    inertias: Vec<(Timed<LinkInertia>, usize)>,
    gravity: Vec<Timed<GravityDirection>>,
    contacts: Vec<Timed<ExternalContact>>,
    memories: usize,
    shifted: bool,
    method: Method,
    step_s: f64,
}

impl Plant {
    /// A plant without effects. `coupling[i][j]` is what joint `j` adds to the position that motor `i` sees, the diagonal is 1.
    ///
    /// # Errors
    /// [`PlantError`] for too many joints or a singular coupling.
    ///
    /// # Panics
    /// If `drives` or `coupling` do not have one entry per joint.
    pub fn new(
        body: SerialArm,
        drives: &[DriveNumbers],
        coupling: &[Vec<f64>],
        method: Method,
        step_s: f64,
    ) -> Result<Self, PlantError> {
        let joints = body.joint_count();
        if joints > JOINTS_MAX {
            return Err(PlantError::Joints { found: joints });
        }
        assert!(drives.len() == joints && coupling.len() == joints, "one drive and one row of coupling per joint");
        let mut matrix = [[0.0; JOINTS_MAX]; JOINTS_MAX];
        for (row, given) in matrix.iter_mut().zip(coupling) {
            row[..joints].copy_from_slice(given);
        }
        let workspace = Workspace::new(&body);
        Ok(Self {
            joints,
            workspace,
            nominal_body: body.clone(),
            body,
            drives: drives.iter().map(|numbers| Drive::new(*numbers)).collect(),
            coupling_inverse: inverse(&matrix, joints).ok_or(PlantError::Coupling)?,
            coupling_nominal: matrix,
            coupling: matrix,
            path: matrix,
            rigid: drives.iter().any(|drive| drive.between == Between::Rigid),
            coupling_errors: Vec::new(),
            offsets: Vec::new(),
            payloads: Vec::new(),
            inertias: Vec::new(),
            gravity: Vec::new(),
            contacts: Vec::new(),
            memories: 0,
            shifted: false,
            method,
            step_s,
        })
    }

    /// Joints.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Largest step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Another step, s, and method.
    pub fn set_step(&mut self, method: Method, step_s: f64) {
        (self.method, self.step_s) = (method, step_s);
    }

    /// The rigid body as it is now.
    pub fn body(&self) -> &SerialArm {
        &self.body
    }

    pub(crate) fn drive_mut(&mut self, joint: usize) -> &mut Drive {
        &mut self.drives[joint]
    }

    /// Numbers of a drive.
    pub fn drive(&self, joint: usize) -> &DriveNumbers {
        &self.drives[joint].nominal
    }

    /// Does it remember anything but positions and speeds?
    pub(crate) fn remembers(&self) -> bool {
        self.memories > 0
    }

    /// A place for a memory.
    pub(crate) fn memory(&mut self) -> Result<usize, PlantError> {
        if self.memories == MEMORIES_MAX {
            return Err(PlantError::Memories);
        }
        self.memories += 1;
        Ok(self.memories - 1)
    }

    pub(crate) fn add_coupling(&mut self, effect: Timed<JointCoupling>, driven: usize, driver: usize) {
        self.coupling_errors.push((effect, driven, driver));
    }

    pub(crate) fn add_offset(&mut self, effect: Timed<JointOffset>, joint: usize) {
        self.offsets.push((effect, joint));
    }

    pub(crate) fn add_payload(&mut self, effect: Timed<Payload>) {
        self.payloads.push(effect);
    }

    pub(crate) fn add_inertia(&mut self, effect: Timed<LinkInertia>, link: usize) {
        self.inertias.push((effect, link));
    }

    pub(crate) fn add_gravity(&mut self, effect: Timed<GravityDirection>) {
        self.gravity.push(effect);
    }

    pub(crate) fn add_contact(&mut self, effect: Timed<ExternalContact>) {
        self.contacts.push(effect);
    }

    /// To be called once after all effects were added, and whenever time may have passed a start or an end: switches effects.
    pub fn at(&mut self, time_s: f64) {
        let mut switched = time_s <= 0.0;
        self.drives.iter_mut().for_each(|drive| switched |= drive.at(time_s));
        self.coupling_errors.iter_mut().for_each(|(effect, ..)| switched |= effect.at(time_s));
        self.offsets.iter_mut().for_each(|(effect, _)| switched |= effect.at(time_s));
        self.payloads.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.inertias.iter_mut().for_each(|(effect, _)| switched |= effect.at(time_s));
        self.gravity.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.contacts.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        if switched {
            self.apply();
        }
    }

    /// Puts the effects that act now into coupling, offsets and bodies.
    fn apply(&mut self) {
        self.coupling = self.coupling_nominal;
        for (effect, driven, driver) in self.coupling_errors.iter().filter(|(effect, ..)| effect.on) {
            self.coupling[*driven][*driver] += effect.effect.c_ij;
        }
        self.path = self.paths();
        self.drives.iter_mut().for_each(|drive| drive.offset = 0.0);
        for (effect, joint) in self.offsets.iter().filter(|(effect, _)| effect.on) {
            self.drives[*joint].offset += effect.effect.o;
        }
        self.shifted = self.drives.iter().any(Drive::is_shifted);
        for link in 0..self.joints {
            self.body.set_link_inertia(link, self.nominal_body.link_inertia(link));
        }
        for (effect, link) in self.inertias.iter().filter(|(effect, _)| effect.on) {
            let mut parameters = self.body.link_inertia(*link).parameters();
            parameters.iter_mut().zip(effect.effect.change).for_each(|(parameter, change)| *parameter += change);
            self.body.set_link_inertia(*link, arm::serial::LinkInertia::from_parameters(&parameters));
        }
        for payload in on(&self.payloads) {
            self.body.add_point_mass(payload.mass_kg, Vector3::from(payload.centre_m));
        }
        let gravity = on(&self.gravity).fold(self.nominal_body.gravity_vector(), |gravity, tilt| tilt.turned(gravity));
        self.body.set_gravity(gravity);
    }
}

/// Inverse of the leading `n` by `n` part, by Gauss-Jordan with pivots; none if singular.
pub(crate) fn inverse(matrix: &Matrix, n: usize) -> Option<Matrix> {
    let mut left = nalgebra::DMatrix::from_fn(n, n, |row, column| matrix[row][column]);
    if !left.try_inverse_mut() {
        return None;
    }
    let mut out = [[0.0; JOINTS_MAX]; JOINTS_MAX];
    for row in 0..n {
        for column in 0..n {
            out[row][column] = left[(row, column)];
        }
    }
    Some(out)
}
