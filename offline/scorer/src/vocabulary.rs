//! Names, and which parameter says how large an effect is.

/// The 22 physics and the two verdicts, in the order of gap-vocabulary.json.
pub const NAMES: [&str; 24] = [
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "backlash",
    "cable_stretch",
    "cable_hysteresis",
    "cable_creep",
    "joint_coupling",
    "payload",
    "gravity_direction",
    "link_inertia",
    "motor_torque_scale",
    "torque_ripple",
    "joint_offset",
    "transmission_ratio",
    "pulley_eccentricity",
    "link_geometry",
    "measurement_delay",
    "frame_misalignment",
    "external_contact",
    "thermal_drift",
    "none",
    "unmodelled",
];

/// A number that is judged: one parameter about its neutral value, or several as a vector.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Parameters of the vocabulary.
    pub names: &'static [&'static str],
    /// Value that means no effect.
    pub neutral: f64,
    /// A report that leaves it out says neutral by that; otherwise it is not judged then.
    pub told_by_silence: bool,
}

const fn about(neutral: f64, names: &'static [&'static str]) -> Measure {
    Measure { names, neutral, told_by_silence: false }
}

const fn part(names: &'static [&'static str]) -> Measure {
    Measure { names, neutral: 0.0, told_by_silence: true }
}

/// What says how large an effect is. Shapes (exponents, phases, periods) are judged apart.
pub fn measures(physics: &str) -> &'static [Measure] {
    match physics {
        "coulomb_friction" => const { &[about(0.0, &["f_c"])] },
        "viscous_friction" | "backlash" => const { &[about(0.0, &["b"])] },
        "stribeck_friction" => const { &[about(0.0, &["f_c"]), about(0.0, &["f_s"])] },
        "load_dependent_friction" => const { &[about(0.0, &["mu_l"])] },
        "cable_stretch" => const { &[about(0.0, &["k"])] },
        "cable_hysteresis" => const { &[about(1.0, &["a"])] },
        "cable_creep" => const { &[about(0.0, &["J_k"])] },
        "joint_coupling" => const { &[about(0.0, &["c_ij"])] },
        "payload" => const { &[about(0.0, &["m_p"])] },
        "gravity_direction" => const { &[about(0.0, &["a", "b"])] },
        "motor_torque_scale" => const { &[about(1.0, &["kappa"])] },
        "torque_ripple" => const { &[about(0.0, &["amp"])] },
        "joint_offset" => const { &[about(0.0, &["o"])] },
        "transmission_ratio" => const { &[about(0.0, &["e"])] },
        "pulley_eccentricity" => const { &[about(0.0, &["e_over_r"])] },
        "link_geometry" => const { &[part(&["d_alpha"]), part(&["d_length"])] },
        "measurement_delay" => const { &[about(0.0, &["d"])] },
        "frame_misalignment" => const { &[part(&["w_x", "w_y", "w_z"]), part(&["t_x", "t_y", "t_z"])] },
        "external_contact" => const { &[about(0.0, &["f_max"]), about(0.0, &["k"])] },
        "thermal_drift" => const { &[about(0.0, &["kappa_T"])] },
        _ => &[],
    }
}

/// In words.
pub fn spoken(name: &str) -> String {
    name.replace('_', " ")
}
