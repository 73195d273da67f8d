//! `[drive.JOINT]` by name: one table for reading, checking and writing.

use super::drive_model::DriveModel;

/// A number of a drive.
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) range: Range,
    pub(super) get: fn(&DriveModel) -> Option<f64>,
    pub(super) set: fn(&mut DriveModel, f64),
}

/// What numbers mean anything.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Range {
    Any,
    NotZero,
    NotNegative,
    Positive,
    Sign,
}

impl Range {
    pub(super) fn has(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::NotZero => value != 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Positive => value > 0.0,
                Self::Sign => value.abs() == 1.0,
            }
    }

    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Any => "a finite number",
            Self::NotZero => "a number other than 0",
            Self::NotNegative => "a number of 0 or more",
            Self::Positive => "a number above 0",
            Self::Sign => "1 or -1",
        }
    }
}

macro_rules! fields {
    (needed { $($needed:ident $range:ident,)* } optional { $($optional:ident $optional_range:ident,)* }) => {
        /// Every number of a drive but what stands between motor and joint.
        pub(super) const FIELDS: &[Field] = &[
            $(Field {
                name: stringify!($needed),
                range: Range::$range,
                get: |drive| Some(drive.$needed),
                set: |drive, value| drive.$needed = value,
            },)*
            $(Field {
                name: stringify!($optional),
                range: Range::$optional_range,
                get: |drive| drive.$optional,
                set: |drive, value| drive.$optional = Some(value),
            },)*
        ];
    };
}

fields! {
    needed {
        reduction NotZero,
        offset Any,
        rotor_inertia_kg_m2 NotNegative,
        sign Sign,
        motor_coulomb_nm NotNegative,
        motor_viscous_nm_s NotNegative,
        motor_sign_width_rad_s Positive,
        joint_coulomb NotNegative,
        joint_viscous NotNegative,
        joint_sign_width Positive,
        stiffness NotNegative,
        damping NotNegative,
        radius_m Positive,
        home Any,
        torque_ref_nm Positive,
    }
    optional {
        torque_constant_nm_a Positive,
        counts_per_a Positive,
        counts_max Positive,
        torque_max_nm Positive,
        encoder_counts_per_rev Positive,
        presliding Positive,
    }
}
