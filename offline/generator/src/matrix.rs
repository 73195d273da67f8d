//! The sets of cases.

use crate::case::{Order, Wanted};

/// Physics of joints and links.
pub const DEV: [&str; 16] = [
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "backlash",
    "cable_stretch",
    "cable_hysteresis",
    "cable_creep",
    "joint_coupling",
    "joint_offset",
    "transmission_ratio",
    "pulley_eccentricity",
    "payload",
    "gravity_direction",
    "link_inertia",
    "thermal_drift",
];

fn single(physics: &str, severity: f64) -> Wanted {
    Wanted { physics: physics.into(), severity: Some(severity), ..Wanted::default() }
}

/// The set to tune with: every effect at four severities, and nulls.
pub fn dev(seed: u64) -> Vec<Order> {
    let mut orders = Vec::new();
    let mut add = |block: &str, effects: Vec<Wanted>| {
        let label = format!("dev/{block}/{}", orders.len());
        orders.push(Order { seed, label, block: block.into(), effects, ..Order::default() });
    };
    for physics in DEV {
        for severity in [1.0, 3.0, 10.0, 30.0] {
            add("single", vec![single(physics, severity)]);
        }
    }
    for _ in 0..10 {
        add("null", Vec::new());
    }
    orders
}
