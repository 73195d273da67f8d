//! Units of parameters, as the vocabulary has them.

use crate::arm::Arm;
use crate::effect::Effect;
use std::collections::BTreeMap;

/// Unit of every parameter of an effect.
pub(crate) fn of(effect: &Effect, arm: &Arm) -> BTreeMap<String, String> {
    let motion = arm.joints[effect.index()].motion;
    let (position, effort) = (motion.unit(), motion.effort());
    let unit = |name: &str| match name {
        "f_c" | "f_s" | "f_0" | "amp" => effort.to_owned(),
        "b" if effect.physics == "backlash" => position.to_owned(),
        "b" => if effort == "N" { "N.s/m" } else { "N.m.s/rad" }.to_owned(),
        "v_s" => format!("{position}/s"),
        "k" if effect.physics == "external_contact" => "N/m".to_owned(),
        "k" => format!("{effort}/{position}"),
        "z_m" | "o" | "e_over_r" | "period" => position.to_owned(),
        "J_k" => if effort == "N" { "m/N" } else { "rad/(N.m)" }.to_owned(),
        "c_ij" => format!("{position}/rad"),
        "m_p" => "kg".to_owned(),
        "c_x" | "c_y" | "c_z" | "t_x" | "t_y" | "t_z" | "d_length" | "x_0" => "m".to_owned(),
        "w_x" | "w_y" | "w_z" | "phi" | "phase" | "d_alpha" => "rad".to_owned(),
        "a" if effect.physics == "gravity_direction" => "rad".to_owned(),
        "order" => "1/rev".to_owned(),
        "d" | "T" | "T_k" => "s".to_owned(),
        "clock_drift" => "s/s".to_owned(),
        "f_max" => "N".to_owned(),
        _ => "1".to_owned(),
    };
    effect.parameters.keys().map(|name| (name.clone(), unit(name))).collect()
}
