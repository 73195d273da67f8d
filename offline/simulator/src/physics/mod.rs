//! Every physics of the vocabulary (`models/gap-vocabulary.json`) as a component of its own that can be switched on: one
//! module, one type, parameters with the vocabulary's names and units. The plant puts them together; nothing here knows
//! of time steps.
//!
//! `D` is the deflection of a transmission in joint units, `D = x - y`: `x` where the motor would put the joint, `y`
//! where the coupled joints are.

pub mod backlash;
pub mod cable_creep;
pub mod cable_hysteresis;
pub mod cable_stretch;
pub mod coulomb_friction;
pub mod external_contact;
pub mod frame_misalignment;
pub mod gravity_direction;
pub mod joint_coupling;
pub mod joint_offset;
pub mod link_geometry;
pub mod link_inertia;
pub mod load_dependent_friction;
pub mod measurement_delay;
pub mod motor_torque_scale;
pub mod payload;
pub mod pulley_eccentricity;
pub mod stribeck_friction;
pub mod thermal_drift;
pub mod torque_ripple;
pub mod transmission_ratio;
pub mod viscous_friction;

mod parameters;
mod table;
mod values;

pub use backlash::Backlash;
pub use cable_creep::CableCreep;
pub use cable_hysteresis::CableHysteresis;
pub use cable_stretch::CableStretch;
pub use coulomb_friction::CoulombFriction;
pub use external_contact::ExternalContact;
pub use frame_misalignment::FrameMisalignment;
pub use gravity_direction::GravityDirection;
pub use joint_coupling::JointCoupling;
pub use joint_offset::JointOffset;
pub use link_geometry::LinkGeometry;
pub use link_inertia::LinkInertia;
pub use load_dependent_friction::LoadDependentFriction;
pub use measurement_delay::{Channel, MeasurementDelay};
pub use motor_torque_scale::MotorTorqueScale;
pub use parameters::{Parameter, ParameterError, Parameters, Value};
pub use payload::Payload;
pub use pulley_eccentricity::PulleyEccentricity;
pub use stribeck_friction::StribeckFriction;
pub use table::{Physics, Place, names, parameters_of, place_of};
pub use thermal_drift::ThermalDrift;
pub use torque_ripple::TorqueRipple;
pub use transmission_ratio::TransmissionRatio;
pub use viscous_friction::ViscousFriction;

/// The sign of a speed, smoothed: `tanh(speed / width)`.
#[inline]
pub fn smooth_sign(speed: f64, width: f64) -> f64 {
    // Beyond 20 widths tanh is 1 to the last bit; most moving joints are there, and tanh is not cheap.
    let ratio = speed / width;
    if ratio.abs() > 20.0 { ratio.signum() } else { ratio.tanh() }
}
