//! Coefficients and shapes as the vocabulary's parameters, and back.

use crate::hypothesis::{
    Candidate, DRIFTS, GROUND, HEATING_S, OUT_OF_PLANE, OWN_STIFFNESS, ROTOR, STEADY_FORCE, STRIBECK_RANGE, TOOL_TWIST, TWISTED,
    shift, torque_scale,
};
use crate::nominal::Nominal;
use crate::robot::Robot;
use std::f64::consts::TAU;

/// A named number with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// As in the vocabulary.
    pub name: &'static str,
    /// As in the vocabulary.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
}

impl Named {
    /// Is it an angle of a wave, which comes round?
    pub(crate) fn is_phase(&self) -> bool {
        matches!(self.name, "phase" | "phi")
    }

    /// The value; of a phase the turn of it that lies nearest to another one.
    pub(crate) fn near(&self, other: f64) -> f64 {
        let turns = if self.is_phase() { ((other - self.value) / TAU).round() } else { 0.0 };
        self.value + turns * TAU
    }
}

/// Parameters of a candidate with these coefficients and this shape (which may differ from its own), joint side.
pub fn parameters(robot: &Robot, nominal: &Nominal, candidate: &Candidate, theta: &[f64], shape: &[f64]) -> Vec<Named> {
    let family = &candidate.family;
    let joint = family.joints.first().copied().unwrap_or(0);
    let sliding = robot.prismatic.get(joint).copied().unwrap_or(false);
    let unit = |turning: &'static str, slid: &'static str| if sliding { slid } else { turning };
    let (effort, position) = (unit("N.m", "N"), unit("rad", "m"));
    let named = |name, unit, value| Named { name, unit, value };
    let place = |name: &str| family.shape.iter().position(|n| *n == name);
    let shaped = |name: &str| place(name).map_or(f64::NAN, |k| shape[k]);
    match (family.physics, family.form) {
        ("coulomb_friction", _) => vec![named("f_c", effort, theta[0])],
        ("viscous_friction", _) => vec![named("b", unit("N.m.s/rad", "N.s/m"), theta[0])],
        ("stribeck_friction", _) => vec![
            named("f_c", effort, theta[0]),
            named("f_s", effort, theta[0] + theta[1]),
            named("v_s", unit("rad/s", "m/s"), shaped("v_s")),
            named("a", "1", shaped("a").clamp(STRIBECK_RANGE[0], STRIBECK_RANGE[1])),
        ],
        ("load_dependent_friction", _) => {
            let mut all = vec![named("mu_l", "1", theta[0]), named("mu_theta", "1", theta[0].max(0.0).ln_1p())];
            if let Some(constant) = theta.get(1) {
                all.insert(0, named("f_0", effort, *constant));
            }
            all
        }
        // The vocabulary has a share of the friction only; how far a position drifts stands in the evidence.
        ("thermal_drift", form) if DRIFTS.contains(&form) => vec![named("T", "s", shaped("T"))],
        ("thermal_drift", _) => {
            let friction = nominal.drives[joint][2];
            let share = (friction > 0.0).then(|| named("kappa_T", "1", -theta[0] / friction));
            share.into_iter().chain([named("T", "s", shaped("T").max(HEATING_S[0]))]).collect()
        }
        ("payload", "anywhere on the last link") => {
            let mut all = vec![named("m_p", "kg", theta[0])];
            // What the motion does not show of its place is not told.
            let places = [("moment_x", "c_x"), ("moment_y", "c_y"), ("moment_z", "c_z")];
            all.extend(places.iter().filter_map(|(moment, name)| Some(named(name, "m", theta[place(moment)?] / theta[0]))));
            all
        }
        ("payload", _) => {
            let mut all = vec![named("m_p", "kg", theta[0])];
            all.extend(["c_x", "c_y", "c_z"].map(|name| named(name, "m", shaped(name))));
            all
        }
        // By which side gravity leaves the plane of the joints nothing tells, only by how much.
        ("gravity_direction", OUT_OF_PLANE) => {
            let (across, along) = (theta[0], 1.0 - theta[1]);
            let (turned, out) = (across.atan2(along), across.hypot(along).min(1.0).acos());
            ["a", "b"].map(|name| named(name, "rad", if place(name).is_some() { turned } else { out })).into()
        }
        // What the motion does not show of it is not told.
        ("gravity_direction", _) => ["a", "b"].iter().filter_map(|name| Some(named(name, "rad", theta[place(name)?]))).collect(),
        ("link_inertia", "scaled") => vec![named("dpi_B", "kg", theta[0] * robot.arm.link_inertia(joint).parameters()[0])],
        ("link_inertia", ROTOR) => vec![named("dpi_B", unit("kg.m2", "kg"), theta[0])],
        ("link_inertia", _) => {
            let k = shaped("parameter") as usize;
            vec![named("dpi_B", ["kg", "kg.m", "kg.m2"][usize::from(k > 0) + usize::from(k > 3)], theta[0])]
        }
        ("motor_torque_scale", form) => {
            let mut all = vec![named("kappa", "1", torque_scale(&candidate.family, theta).unwrap_or(1.0))];
            let per_count = robot.drives[joint].torque_per_count * robot.motor_from_joint[(joint, joint)];
            if form.ends_with("offset") && per_count != 0.0 {
                all.push(named("d_0", "DAC", theta[theta.len() - 1] / per_count));
            }
            all
        }
        ("torque_ripple", _) => vec![
            named("amp", effort, theta[0].hypot(theta[1])),
            named("order", "1/rev", shaped("order")),
            named("phase", "rad", theta[1].atan2(theta[0])),
        ],
        ("backlash", "follows the motion") => vec![named("b", position, shaped("b"))],
        ("backlash", _) => vec![named("b", position, theta[0])],
        ("cable_stretch", _) => vec![named("k", unit("N.m/rad", "N/m"), 1.0 / theta[0])],
        ("cable_hysteresis", GROUND) => {
            let (p, q) = (shaped("p"), shaped("p") * shaped("q_over_p"));
            let stiffness = robot.drives[joint].ground[0] + theta[0] + theta[1];
            vec![
                named("a", "1", 1.0 - theta[0] / stiffness),
                named("k", unit("N.m/rad", "N/m"), stiffness),
                named("z_m", position, 1.0 / (p + q)),
                named("n", "1", 1.0),
                named("g", "1", q / (p + q)),
            ]
        }
        ("cable_hysteresis", "play of many widths") => {
            // Share that follows without memory; the width that the others have on average.
            let lost: f64 = theta[..theta.len() - 2].iter().sum();
            vec![named("a", "1", (1.0 - lost).clamp(0.0, 1.0))]
        }
        ("cable_hysteresis", form) => {
            let (straight, compliance) = match form {
                OWN_STIFFNESS => (1.0 - theta[0], nominal.compliance[joint][0]),
                _ => (shaped("a"), theta[0]),
            };
            vec![
                named("a", "1", straight),
                named("k", unit("N.m/rad", "N/m"), 1.0 / compliance),
                named("z_m", position, shaped("yield") * compliance),
                named("n", "1", shaped("n")),
                named("g", "1", shaped("g")),
            ]
        }
        ("cable_creep", _) => vec![named("J_k", unit("rad/(N.m)", "m/N"), theta[0]), named("T_k", "s", shaped("T_k"))],
        ("joint_coupling", _) => vec![named("c_ij", unit("rad/rad", "m/rad"), theta[0])],
        ("joint_offset", _) => vec![named("o", position, theta[0])],
        ("transmission_ratio", _) => vec![named("e", "1", theta[0])],
        ("pulley_eccentricity", _) => vec![
            named("e_over_r", position, theta[0].hypot(theta[1])),
            named("phi", "rad", theta[1].atan2(theta[0])),
            named("period", position, shaped("period")),
        ],
        ("link_geometry", form) if TWISTED.contains(&form) || form == TOOL_TWIST => vec![named("d_alpha", "rad", theta[0])],
        ("link_geometry", _) => {
            let sign = shift(&robot.arm, family).map_or(1.0, |shift| shift.sign);
            vec![named("d_length", "m", sign * theta[0])]
        }
        // Joint encoders that come early against the motors' are motors that come late: nothing is measured ahead of time.
        ("measurement_delay", "joint encoders") => vec![named("d", "s", theta[0].abs())],
        ("measurement_delay", _) => {
            let mut all = vec![named("d", "s", theta[0])];
            all.extend(theta.get(1).map(|drift| named("clock_drift", "s/s", *drift)));
            all
        }
        ("frame_misalignment", _) => {
            let names = [("w_x", "rad"), ("w_y", "rad"), ("w_z", "rad"), ("t_x", "m"), ("t_y", "m"), ("t_z", "m")];
            names.into_iter().zip(theta).map(|((name, unit), value)| named(name, unit, *value)).collect()
        }
        ("external_contact", STEADY_FORCE) => vec![named("f_max", "N", theta.iter().map(|f| f * f).sum::<f64>().sqrt())],
        ("external_contact", _) => {
            vec![named("k", "N/m", theta[0]), named("x_0", "m", shaped("x_0")), named("p", "1", shaped("p"))]
        }
        // What has no name has no parameters.
        (crate::hypothesis::UNMODELLED, _) => Vec::new(),
        (physics, form) => unreachable!("{physics} ({form}) has no parameters here"),
    }
}

/// What the vocabulary has no parameter for: in words, its value, its unit.
pub(crate) fn beside(
    robot: &Robot,
    nominal: &Nominal,
    candidate: &Candidate,
    theta: &[f64],
) -> Option<(&'static str, f64, &'static str)> {
    let family = &candidate.family;
    let joint = family.joints.first().copied().unwrap_or(0);
    let (effort, position) = (robot.effort_unit(joint), robot.position_unit(joint));
    match (family.physics, family.form) {
        ("thermal_drift", form) if DRIFTS.contains(&form) => Some(("how far the position drifts until warm", theta[0], position)),
        ("thermal_drift", _) if nominal.drives[joint][2] <= 0.0 => Some(("how much friction changes until warm", theta[0], effort)),
        ("motor_torque_scale", form) if form.ends_with("offset") && robot.drives[joint].torque_per_count == 0.0 => {
            Some(("constant torque, of an amplifier whose counts are not known", theta[theta.len() - 1], effort))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Named, TAU};

    #[test]
    fn a_phase_is_near_another_one_round_the_turn() {
        let of = |name, value| Named { name, unit: "rad", value };
        assert!((of("phase", -3.1).near(3.1) - (TAU - 3.1)).abs() < 1e-12);
        assert!((of("phi", 3.1).near(-3.1) + TAU - 3.1).abs() < 1e-12);
        assert!((of("phase", 1.0).near(-1.0) - 1.0).abs() < 1e-12);
        assert!((of("a", -3.1).near(3.1) + 3.1).abs() < 1e-12, "no other number comes round");
    }
}
