//! Where each physics shows, in words.

use gap_report::{Feature, Regime, Subsystem};

use crate::hypothesis::Candidate;

/// The regime that an effect is tied to.
pub(crate) fn regime(candidate: &Candidate) -> Regime {
    let (feature, condition) = match candidate.family.physics {
        "link_inertia" if candidate.is_of_a_drive() => (Feature::All, "proportional to the acceleration"),
        "coulomb_friction" => (Feature::VelocitySign, "constant with the sign of the velocity"),
        "viscous_friction" => (Feature::Speed, "proportional to the velocity"),
        "stribeck_friction" => (Feature::Speed, "more at slow speed"),
        "load_dependent_friction" => (Feature::Load, "with the sign of the velocity, more under load"),
        "backlash" => (Feature::Reversal, "where the load or the motion changes sides"),
        "cable_stretch" => (Feature::Load, "proportional to the load"),
        "cable_hysteresis" => (Feature::Load, "with the load and its history"),
        "cable_creep" => (Feature::Time, "follows the load slowly"),
        "joint_coupling" => (Feature::OtherJoint, "proportional to the position of the other joint"),
        "payload" | "gravity_direction" | "link_inertia" | "link_geometry" => (Feature::Posture, "with posture"),
        "motor_torque_scale" => (Feature::Load, "proportional to the torque"),
        "torque_ripple" => (Feature::MotorAngle, "a fixed number of times per motor turn"),
        "transmission_ratio" => (Feature::Posture, "proportional to the distance from homing"),
        "pulley_eccentricity" => (Feature::Posture, "once per turn of a pulley"),
        "measurement_delay" => (Feature::Speed, "proportional to the velocity, on all joints alike"),
        "external_contact" => (Feature::Contact, "in a part of the workspace"),
        "thermal_drift" => (Feature::TemperatureProxy, "grows with heating"),
        _ => (Feature::All, "everywhere"),
    };
    Regime::new(feature, condition)
}

/// The part of the robot.
pub(crate) fn subsystem(candidate: &Candidate) -> Subsystem {
    match candidate.family.physics {
        "link_inertia" if candidate.is_of_a_drive() => Subsystem::Motor,
        "backlash" => Subsystem::Gearbox,
        "cable_stretch" | "cable_hysteresis" | "cable_creep" | "load_dependent_friction" => Subsystem::Cable,
        "joint_coupling" | "transmission_ratio" | "pulley_eccentricity" => Subsystem::Pulley,
        "payload" => Subsystem::Tool,
        "gravity_direction" => Subsystem::Base,
        "link_inertia" | "link_geometry" => Subsystem::Link,
        "motor_torque_scale" | "torque_ripple" | "thermal_drift" => Subsystem::Motor,
        "joint_offset" => Subsystem::Sensor,
        "measurement_delay" => Subsystem::Clock,
        "frame_misalignment" => Subsystem::Camera,
        "external_contact" => Subsystem::Environment,
        _ => Subsystem::Joint,
    }
}
