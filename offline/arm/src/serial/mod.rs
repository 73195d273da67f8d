//! A chain of rigid links: kinematics and dynamics of any serial arm, without an allocation after the set-up.
//!
//! A [`SerialArm`] is a list of [`Body`]s, each a joint and the link behind it, read from any source: [`crate::urdf`],
//! [`crate::Raven2::rigid_body`], or built by hand. It is constant while algorithms run; everything that they write lies in
//! a [`Workspace`] that the caller keeps, one per thread. Links and joints count from 0 at the base.
//!
//! Units: rad, m, kg, s, N, N·m; for a prismatic joint position, rate and effort are m, m/s, N. Everything "in the base
//! frame" is in the frame in which the first joint's placement and gravity are given. Matrices are row-major slices.
//! Equation of motion: `M(q)·qdd + C(q, qd)·qd + g(q) = tau + Jᵀ·wrench`.
//!
//! | algorithm | file | source |
//! | --- | --- | --- |
//! | poses, Jacobian | `kinematics.rs` | geometric Jacobian, linear rows first |
//! | singular values, manipulability | `dexterity.rs` | Yoshikawa 1985 |
//! | inverse dynamics, bias, gravity | `inverse_dynamics.rs` | recursive Newton-Euler, Luh, Walker, Paul 1980 |
//! | mass matrix | `mass_matrix.rs` | composite rigid bodies, Walker, Orin 1982 |
//! | Coriolis matrix | `coriolis.rs` | Echeandia, Wensing 2021: consistent with the Christoffel symbols |
//! | forward dynamics | `forward_dynamics.rs` | mass matrix and its Cholesky factor |
//! | energy | `energy.rs` | |
//! | inertial regressor | `regressor.rs` | Newton-Euler, linear in ten parameters per link |
//! | base parameters | `base_parameters.rs` | Gautier 1991: rank by singular values, columns from the base outward |
//!
//! Lengths of slices are the caller's business: every method panics on a wrong one, as slice indexing does. Numbers are
//! not: NaN in gives NaN out.

mod base_parameters;
mod body;
mod chain;
mod coriolis;
mod dexterity;
mod energy;
mod forward_dynamics;
mod inertia;
mod inverse_dynamics;
mod kinematics;
mod mass_matrix;
mod regressor;
mod small;
mod stage;
mod workspace;

pub use base_parameters::{BaseParameters, BaseParametersError};
pub use body::{Body, Joint, JointKind, JointLimits, Tool};
pub use chain::{SerialArm, SerialArmError};
pub use dexterity::Dexterity;
pub use forward_dynamics::SingularMassMatrix;
pub use inertia::{LinkInertia, PARAMETERS};
pub use inverse_dynamics::Wrench;
pub use workspace::Workspace;
