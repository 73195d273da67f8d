//! Parameters by plain names.

use crate::Physics;

/// A parameter in words with its symbol: `dry friction (f_c)`.
pub(crate) fn parameter_name(physics: &Physics, symbol: &str) -> String {
    let of_physics = |(of, name, _): &&(Option<Physics>, &str, &str)| *name == symbol && of.as_ref().is_none_or(|of| of == physics);
    match NAMES.iter().find(of_physics) {
        Some((_, _, plain)) => format!("{plain} ({symbol})"),
        None => frame_axis(symbol).unwrap_or_else(|| symbol.to_owned()),
    }
}

/// Physics (none: any), symbol, plain name. Where a symbol has several meanings, the physics is named.
static NAMES: [(Option<Physics>, &str, &str); 49] = [
    (Some(Physics::StribeckFriction), "f_c", "friction when moving"),
    (None, "f_c", "dry friction"),
    (None, "f_c_asym", "difference between directions"),
    (Some(Physics::ViscousFriction), "b", "friction per speed"),
    (Some(Physics::Backlash), "b", "width of the play"),
    (Some(Physics::GravityDirection), "b", "tilt about y"),
    (None, "f_s", "friction at rest"),
    (None, "v_s", "speed of the transition"),
    (Some(Physics::StribeckFriction), "a", "sharpness of the transition"),
    (Some(Physics::CableHysteresis), "a", "elastic share"),
    (Some(Physics::GravityDirection), "a", "tilt about x"),
    (None, "f_0", "friction without load"),
    (None, "mu_l", "friction per load"),
    (None, "mu_theta", "friction times wrap angle"),
    (Some(Physics::CableStretch), "k", "missing series stiffness"),
    (Some(Physics::CableHysteresis), "k", "stiffness"),
    (Some(Physics::ExternalContact), "k", "stiffness of the contact"),
    (Some(Physics::CableStretch), "d", "damping"),
    (Some(Physics::MeasurementDelay), "d", "delay"),
    (None, "stiffening", "stiffening"),
    (None, "z_m", "width of the hysteresis"),
    (None, "n", "sharpness"),
    (None, "g", "shape of the loop"),
    (None, "J_k", "creep per load"),
    (None, "T_k", "time constant"),
    (None, "c_ij", "coupling"),
    (None, "m_p", "mass"),
    (None, "c_x", "centre, x"),
    (None, "c_y", "centre, y"),
    (None, "c_z", "centre, z"),
    (None, "dpi_B", "change of an inertial parameter"),
    (None, "kappa", "torque ratio"),
    (None, "d_0", "offset of the motor command"),
    (None, "amp", "amplitude"),
    (None, "order", "periods per turn"),
    (None, "phase", "phase"),
    (None, "o", "offset"),
    (None, "e", "error of the ratio"),
    (None, "e_over_r", "amplitude"),
    (None, "phi", "phase"),
    (None, "period", "travel per period"),
    (None, "d_alpha", "twist"),
    (None, "d_length", "length"),
    (None, "clock_drift", "drift of the clock"),
    (None, "f_max", "greatest force"),
    (None, "x_0", "place of the contact"),
    (None, "p", "exponent"),
    (None, "kappa_T", "change when warm"),
    (None, "T", "time constant"),
];

/// `w_x` to `t_z` of a frame.
fn frame_axis(symbol: &str) -> Option<String> {
    let (kind, axis) = symbol.split_once('_')?;
    match (kind, axis) {
        ("w", "x" | "y" | "z") => Some(format!("turn about {axis} ({symbol})")),
        ("t", "x" | "y" | "z") => Some(format!("shift along {axis} ({symbol})")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vocabulary;

    #[test]
    fn every_parameter_of_the_vocabulary_has_a_plain_name() {
        for hypothesis in &vocabulary().hypotheses {
            for parameter in &hypothesis.parameters {
                let name = parameter_name(&hypothesis.physics, &parameter.name);
                assert!(name.ends_with(&format!("({})", parameter.name)), "{}: {name}", hypothesis.physics);
            }
        }
    }
}
