//! The plant file `raven2-plant.toml` as strict types: every section and key must be known, every array has its length.
//! What a symbol means: `raven2-plant.md`.

mod body;
mod drive;

pub use body::{
    ClosedForm, Dynamics, DynamicsTable, Insertion, KinematicsTable, LengthEntry, LimitTable, Link, SideKinematics, Term,
    WorldFrame,
};
pub use drive::{
    Cable, Control, Friction, GravityModel, Motor, Sampling, ToolAxes, ToolSign, TransmissionTable, VelocityFilter, WristCoupling,
};

use serde::Deserialize;

use crate::JOINTS;

/// The one schema that this crate reads.
pub const SCHEMA: &str = "raven2-plant/1";

/// Why a text is not a plant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Not TOML, an unknown or missing key, or a value of the wrong type or length.
    #[error("plant file: {what}; compare with models/raven2-plant.toml")]
    Syntax {
        /// What the parser says, on one line.
        what: String,
    },
    /// Another schema.
    #[error("plant file: schema is `{found}`, expected `{SCHEMA}`; convert the file or use the release that wrote it")]
    Schema {
        /// The file's schema.
        found: String,
    },
    /// A number that no robot has.
    #[error("plant file: {key} {what}; correct the value")]
    Value {
        /// Dotted key.
        key: String,
        /// What it must be.
        what: &'static str,
    },
}

/// A whole plant file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// Name of the model.
    pub name: String,
    /// Control period and encoders.
    pub sampling: Sampling,
    /// Denavit-Hartenberg tables.
    pub kinematics: KinematicsTable,
    /// Command limits, hard stops, home pose.
    pub limits: LimitTable,
    /// Gears and cable coupling.
    pub transmission: TransmissionTable,
    /// Motors and amplifiers.
    pub motor: Motor,
    /// Controller gains and its gravity model.
    pub control: Control,
    /// Cable elasticity.
    pub cable: Cable,
    /// Friction of motors and joints.
    pub friction: Friction,
    /// Integration method of the nominal plant.
    pub integrator: Integrator,
    /// Rigid-body parameters of links 1 to 3.
    pub dynamics: DynamicsTable,
    /// Assumed parameters of motors 4 to 7.
    pub tool_axes: ToolAxes,
    /// Other parameter sets of the sources, not used by the nominal plant.
    #[serde(default)]
    pub alternatives: toml::Table,
}

/// Integration method of the nominal plant.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Integrator {
    /// Name of the method.
    pub method: String,
    /// Step, s.
    pub substep_s: f64,
}

impl Plant {
    /// Parses and checks a plant file.
    ///
    /// # Errors
    /// [`PlantError`] with the key and what is wrong with it.
    pub fn from_toml(text: &str) -> Result<Self, PlantError> {
        let plant: Self = toml::from_str(text).map_err(|error| PlantError::Syntax { what: one_line(&error, text) })?;
        plant.check()?;
        Ok(plant)
    }

    /// Checks what types cannot: the schema, every number that is divided by, and the numbers of the rigid body.
    /// [`Self::from_toml`] has done it; do it after changing a plant by hand.
    ///
    /// # Errors
    /// [`PlantError`] with the key and what is wrong with it.
    pub fn check(&self) -> Result<(), PlantError> {
        if self.schema != SCHEMA {
            return Err(PlantError::Schema { found: self.schema.clone() });
        }
        positive("sampling.period_s", &[self.sampling.period_s])?;
        positive("sampling.encoder_counts_per_rev", &[f64::from(self.sampling.encoder_counts_per_rev)])?;
        positive("transmission.ratio", &self.transmission.ratio)?;
        positive("transmission.gb_ratio", &[self.transmission.gb_ratio])?;
        positive("transmission.gear", &[self.transmission.gear_big, self.transmission.gear_small])?;
        positive("motor.torque_constant_nm_a", &self.motor.torque_constant_nm_a)?;
        positive("motor.dac_per_amp", &self.motor.dac_per_amp.map(f64::from))?;
        positive("motor.inertia_capstan", &self.motor.inertia_capstan)?;
        positive("tool_axes.inertia_capstan", &self.tool_axes.inertia_capstan)?;
        positive("cable.joint_radius_m", &self.cable.joint_radius_m)?;
        positive("friction.motor_v_s_rad_s", &self.friction.motor_v_s_rad_s)?;
        positive("friction.joint_v_s", &self.friction.joint_v_s)?;
        positive("integrator.substep_s", &[self.integrator.substep_s])?;
        for (key, values) in [
            ("cable.be_ns_m", &self.cable.be_ns_m),
            ("cable.ke_n", &self.cable.ke_n),
            ("friction.motor_coulomb_nm", &self.friction.motor_coulomb_nm),
            ("friction.motor_viscous_nm_s", &self.friction.motor_viscous_nm_s),
            ("friction.joint_coulomb", &self.friction.joint_coulomb),
            ("friction.joint_viscous", &self.friction.joint_viscous),
        ] {
            not_negative(key, values)?;
        }
        not_negative("tool_axes.motor_coulomb_nm", &self.tool_axes.motor_coulomb_nm)?;
        not_negative("tool_axes.motor_viscous_nm_s", &self.tool_axes.motor_viscous_nm_s)?;
        for (key, signs) in [
            ("transmission.encoder_sign_gold", &self.transmission.encoder_sign_gold),
            ("transmission.encoder_sign_green", &self.transmission.encoder_sign_green),
            ("motor.dac_sign_gold", &self.motor.dac_sign_gold),
            ("motor.dac_sign_green", &self.motor.dac_sign_green),
        ] {
            unit_signs(key, signs)?;
        }
        insertion_is_third("kinematics.gold.d_m", &self.kinematics.gold)?;
        insertion_is_third("kinematics.green.d_m", &self.kinematics.green)?;
        finite("kinematics.gravity_m_s2", &self.kinematics.gravity_m_s2)?;
        self.kinematics.gold.check("gold")?;
        self.kinematics.green.check("green")?;
        self.dynamics.gold.check("gold")?;
        self.dynamics.green.check("green")?;
        ordered(&self.limits)
    }
}

fn positive(key: &str, values: &[f64]) -> Result<(), PlantError> {
    let good = values.iter().all(|value| value.is_finite() && *value > 0.0);
    check(good, key, "must be positive")
}

fn not_negative(key: &str, values: &[f64]) -> Result<(), PlantError> {
    let good = values.iter().all(|value| value.is_finite() && *value >= 0.0);
    check(good, key, "must be 0 or more")
}

fn finite<'a>(key: &str, values: impl IntoIterator<Item = &'a f64>) -> Result<(), PlantError> {
    check(values.into_iter().all(|value| value.is_finite()), key, "must be finite")
}

fn unit_signs(key: &str, signs: &[i32; JOINTS]) -> Result<(), PlantError> {
    check(signs.iter().all(|sign| sign.abs() == 1), key, "must hold -1 and 1 only")
}

fn insertion_is_third(key: &str, side: &SideKinematics) -> Result<(), PlantError> {
    let good = side.d_m.iter().enumerate().all(|(i, entry)| (i == 2) == entry.is_insertion());
    check(good, key, "must have \"jpos_3\" in its third place and numbers elsewhere")
}

fn ordered(limits: &LimitTable) -> Result<(), PlantError> {
    let good = (0..JOINTS).all(|i| limits.min[i] < limits.max[i]);
    check(good, "limits.min", "must lie below limits.max in every joint")
}

fn check(good: bool, key: &str, what: &'static str) -> Result<(), PlantError> {
    if good { Ok(()) } else { Err(PlantError::Value { key: key.to_owned(), what }) }
}

/// The parser's message with its line number, without the drawing of the place.
fn one_line(error: &toml::de::Error, text: &str) -> String {
    let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
    format!("line {line}: {}", error.message().replace('\n', ", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = include_str!("../../../../models/raven2-plant.toml");

    fn refused(from: &str, to: &str) -> String {
        assert!(TEXT.contains(from), "{from}");
        Plant::from_toml(&TEXT.replacen(from, to, 1)).expect_err(to).to_string()
    }

    #[test]
    fn the_embedded_plant_parses() {
        let plant = Plant::from_toml(TEXT).expect("nominal");
        assert_eq!(plant.name, "raven2-nominal");
        assert!((plant.transmission.gear_big - 49.0 / 4.0).abs() < 1e-15);
        assert!((plant.transmission.gear_small - 26.0 / 7.0).abs() < 1e-15);
        assert_eq!(plant.dynamics.closed_form.m33[0], Term(0.407, "1".into()));
    }

    #[test]
    fn the_tables_of_both_arms_agree_with_the_lengths_and_angles_stated_once() {
        let plant = Plant::from_toml(TEXT).expect("nominal");
        let shared = &plant.kinematics;
        for (side, la23) in [(&shared.gold, 180.0 - shared.la23_deg), (&shared.green, shared.la23_deg)] {
            assert_eq!(side.alpha_deg[1], shared.la12_deg);
            assert_eq!(side.alpha_deg[2], la23);
            assert_eq!(side.a_m[5], shared.lw_m);
            assert_eq!(side.d_m[3].constant_m(), shared.d4_m);
        }
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_line() {
        let text = refused("period_s = 0.001", "period_ms = 1.0\nperiod_s = 0.001");
        assert!(text.starts_with("plant file: line 11: unknown field `period_ms`"), "{text}");
        assert!(!text.contains('\n'), "{text}");
    }

    #[test]
    fn an_array_of_the_wrong_length_is_refused() {
        let text = refused("kp = [0.3, 0.3,", "kp = [0.3,");
        assert!(text.contains("invalid length 6"), "{text}");
    }

    #[test]
    fn another_schema_is_refused() {
        assert!(refused("raven2-plant/1", "raven2-plant/9").contains("schema is `raven2-plant/9`"));
    }

    #[test]
    fn impossible_numbers_are_refused() {
        assert!(refused("period_s = 0.001", "period_s = 0.0").contains("sampling.period_s must be positive"));
        assert!(refused("gb_ratio = 2.9", "gb_ratio = -2.9").contains("transmission.gb_ratio"));
        assert!(refused("dac_sign_gold = [-1,", "dac_sign_gold = [2,").contains("motor.dac_sign_gold"));
        assert!(refused("min = [0.0,", "min = [9.0,").contains("limits.min"));
        assert!(refused("alpha_deg = [0.0,", "alpha_deg = [nan,").contains("kinematics.gold.alpha_deg must be finite"));
        assert!(refused("mass_kg = 0.753", "mass_kg = -0.753").contains("dynamics.gold.link2.mass_kg must be positive"));
        assert!(refused("com_m = [-0.00717635999859,", "com_m = [inf,").contains("dynamics.green.link1.com_m must be finite"));
        assert!(refused("\"jpos_3\", -0.47", "0.1, \"jpos_3\"").contains("kinematics.gold.d_m"));
        assert!(refused("\"jpos_3\"", "\"jpos_2\"").contains("plant file"));
    }
}
