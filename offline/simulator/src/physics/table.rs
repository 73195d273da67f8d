//! The 22 names, and which type each stands for.

use super::{
    Backlash, CableCreep, CableHysteresis, CableStretch, CoulombFriction, ExternalContact, FrameMisalignment, GravityDirection,
    JointCoupling, JointOffset, LinkGeometry, LinkInertia, LoadDependentFriction, MeasurementDelay, MotorTorqueScale, Parameter,
    ParameterError, Parameters, Payload, PulleyEccentricity, StribeckFriction, ThermalDrift, TorqueRipple, TransmissionRatio,
    ViscousFriction,
};

/// What an effect is bound to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// One joint.
    Joint,
    /// A joint and the joint that drives it.
    Pair,
    /// A link.
    Link,
    /// A signal.
    Channel,
    /// The robot as a whole, or its surroundings.
    Robot,
}

macro_rules! physics {
    ($($name:literal $variant:ident $place:ident;)*) => {
        /// One physics with its parameters.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[expect(missing_docs, reason = "each variant holds the type that documents it")]
        pub enum Physics {
            $($variant($variant),)*
        }

        impl Physics {
            /// The physics of a name; none if the vocabulary does not have it.
            ///
            /// # Errors
            /// [`ParameterError`] for unknown, missing and impossible parameters.
            pub fn new(name: &str, parameters: &Parameters) -> Option<Result<Self, ParameterError>> {
                match name {
                    $($name => Some($variant::new(parameters).map(Self::$variant)),)*
                    _ => None,
                }
            }

            /// Its name in the vocabulary.
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $name,)*
                }
            }
        }

        const NAMES: &[&str] = &[$($name),*];

        /// Parameters of a physics; none if the vocabulary does not have it.
        pub fn parameters_of(name: &str) -> Option<&'static [Parameter]> {
            match name {
                $($name => Some(&$variant::PARAMETERS),)*
                _ => None,
            }
        }

        /// What a physics is bound to; none if the vocabulary does not have it.
        pub fn place_of(name: &str) -> Option<Place> {
            match name {
                $($name => Some(Place::$place),)*
                _ => None,
            }
        }
    };
}

physics! {
    "coulomb_friction" CoulombFriction Joint;
    "viscous_friction" ViscousFriction Joint;
    "stribeck_friction" StribeckFriction Joint;
    "load_dependent_friction" LoadDependentFriction Joint;
    "backlash" Backlash Joint;
    "cable_stretch" CableStretch Joint;
    "cable_hysteresis" CableHysteresis Joint;
    "cable_creep" CableCreep Joint;
    "joint_coupling" JointCoupling Pair;
    "payload" Payload Robot;
    "gravity_direction" GravityDirection Robot;
    "link_inertia" LinkInertia Link;
    "motor_torque_scale" MotorTorqueScale Joint;
    "torque_ripple" TorqueRipple Joint;
    "joint_offset" JointOffset Joint;
    "transmission_ratio" TransmissionRatio Joint;
    "pulley_eccentricity" PulleyEccentricity Joint;
    "link_geometry" LinkGeometry Link;
    "measurement_delay" MeasurementDelay Channel;
    "frame_misalignment" FrameMisalignment Robot;
    "external_contact" ExternalContact Robot;
    "thermal_drift" ThermalDrift Joint;
}

/// All names, in the order of the vocabulary.
pub fn names() -> &'static [&'static str] {
    NAMES
}
