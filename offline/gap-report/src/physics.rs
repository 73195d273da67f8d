//! The names of the vocabulary.

use serde::{Deserialize, Serialize};

macro_rules! physics {
    ($($variant:ident $name:literal $plain:literal;)*) => {
        /// What may be missing: a name of the vocabulary (`models/gap-vocabulary.json`), or a hypothesis that a user added.
        #[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "String")]
        pub enum Physics {
            $(#[doc = concat!("`", $name, "`: ", $plain, ".")] $variant,)*
            /// `plugin:<name>`, a hypothesis added by the user; holds the name without `plugin:`.
            Plugin(String),
        }

        impl Physics {
            /// The 24 names of the vocabulary in its order: 22 physics, `none`, `unmodelled`.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Its spelling in the report.
            pub fn name(&self) -> std::borrow::Cow<'static, str> {
                match self {
                    $(Self::$variant => $name.into(),)*
                    Self::Plugin(name) => format!("plugin:{name}").into(),
                }
            }

            /// What it is in words that need no glossary, without an article.
            pub fn plain(&self) -> &str {
                match self {
                    $(Self::$variant => $plain,)*
                    Self::Plugin(name) => name,
                }
            }
        }
    };
}

physics! {
    CoulombFriction "coulomb_friction" "dry friction";
    ViscousFriction "viscous_friction" "friction that grows with speed";
    StribeckFriction "stribeck_friction" "sticking friction at low speed";
    LoadDependentFriction "load_dependent_friction" "friction that grows with load";
    Backlash "backlash" "play in the transmission";
    CableStretch "cable_stretch" "cable stretch";
    CableHysteresis "cable_hysteresis" "cable hysteresis";
    CableCreep "cable_creep" "cable creep";
    JointCoupling "joint_coupling" "coupling between joints";
    Payload "payload" "a load at the tool";
    GravityDirection "gravity_direction" "a tilted base";
    LinkInertia "link_inertia" "a link of other mass or inertia";
    MotorTorqueScale "motor_torque_scale" "another motor torque constant";
    TorqueRipple "torque_ripple" "torque ripple of the motor";
    JointOffset "joint_offset" "a shifted joint zero";
    TransmissionRatio "transmission_ratio" "another transmission ratio";
    PulleyEccentricity "pulley_eccentricity" "a pulley that runs out of true";
    LinkGeometry "link_geometry" "a link of another shape";
    MeasurementDelay "measurement_delay" "measurement delay";
    FrameMisalignment "frame_misalignment" "a camera frame that is turned or shifted";
    ExternalContact "external_contact" "contact with something outside";
    ThermalDrift "thermal_drift" "drift with temperature";
    None "none" "nothing beyond noise";
    Unmodelled "unmodelled" "something that no known physics explains";
}

impl Physics {
    /// Is it one that a model can be corrected with: neither `none` nor `unmodelled`?
    pub fn is_named(&self) -> bool {
        !matches!(self, Self::None | Self::Unmodelled)
    }
}

impl std::fmt::Display for Physics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name())
    }
}

impl From<Physics> for String {
    fn from(physics: Physics) -> Self {
        physics.name().into_owned()
    }
}

/// A name that is neither in the vocabulary nor a plugin's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no physics of the vocabulary and not of the form plugin:<lower case name>")]
pub struct UnknownPhysics(pub String);

impl std::str::FromStr for Physics {
    type Err = UnknownPhysics;

    fn from_str(name: &str) -> Result<Self, UnknownPhysics> {
        if let Some(known) = Self::ALL.iter().find(|physics| physics.name() == name) {
            return Ok(known.clone());
        }
        match name.strip_prefix("plugin:") {
            Some(plugin) if is_plugin_name(plugin) => Ok(Self::Plugin(plugin.to_owned())),
            _ => Err(UnknownPhysics(name.to_owned())),
        }
    }
}

impl TryFrom<String> for Physics {
    type Error = UnknownPhysics;

    fn try_from(name: String) -> Result<Self, UnknownPhysics> {
        name.parse()
    }
}

/// The schema's `[a-z][a-z0-9_]*`.
pub(crate) fn is_plugin_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_both_ways() {
        assert_eq!(Physics::ALL.len(), 24);
        for physics in Physics::ALL {
            assert_eq!(physics.name().parse(), Ok(physics.clone()));
        }
        assert_eq!("plugin:drag_2".parse(), Ok(Physics::Plugin("drag_2".to_owned())));
        for wrong in ["", "friction", "plugin:", "plugin:2x", "plugin:A", "Coulomb_friction"] {
            assert_eq!(wrong.parse::<Physics>(), Err(UnknownPhysics(wrong.to_owned())));
        }
    }
}
