//! The fields of `raven_state` as one table: names, units and where each number stands, for every format that lists them
//! (ravenstate.md, section 1). Header and times are not in it: every format has its own way with those.

use arm::Side;
use ravenpose_wire::RavenState;

/// The numbers of a field.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Values<'a> {
    /// Whole numbers.
    Int(&'a [i32]),
    /// Floats.
    Float(&'a [f32]),
}

/// The numbers of a field, to be written.
pub(crate) enum ValuesMut<'a> {
    /// Whole numbers.
    Int(&'a mut [i32]),
    /// Floats.
    Float(&'a mut [f32]),
}

/// What the places of a field stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// One number.
    Scalar,
    /// One per arm.
    Arms,
    /// Three axes per arm.
    Axes,
    /// Nine per arm, row by row.
    Rotation,
    /// Eight slots per arm; slot 3 belongs to no joint.
    Slots,
    /// Six per arm without a meaning of their own.
    Six,
}

impl Shape {
    /// Numbers per arm; 0 where the field has no arm.
    const fn per_arm(self) -> usize {
        match self {
            Self::Scalar => 0,
            Self::Arms => 1,
            Self::Axes => 3,
            Self::Rotation => 9,
            Self::Slots => 8,
            Self::Six => 6,
        }
    }
}

/// A field of `raven_state`.
pub(crate) struct Field {
    /// Name as in the message.
    pub(crate) name: &'static str,
    unit: &'static str,
    /// Unit of the slot of joint 3, where it differs (trap 1).
    unit_joint_3: Option<&'static str>,
    pub(crate) shape: Shape,
    /// The numbers.
    pub(crate) get: for<'a> fn(&'a RavenState) -> Values<'a>,
    /// The same, to be written.
    pub(crate) get_mut: for<'a> fn(&'a mut RavenState) -> ValuesMut<'a>,
}

impl Field {
    /// How many numbers.
    pub(crate) const fn count(&self) -> usize {
        match self.shape {
            Shape::Scalar => 1,
            shape => 2 * shape.per_arm(),
        }
    }

    /// Whole numbers?
    pub(crate) fn is_int(&self) -> bool {
        matches!((self.get)(&RavenState::new()), Values::Int(_))
    }

    /// Which arm a place belongs to.
    pub(crate) fn side(&self, place: usize) -> Option<Side> {
        (self.shape != Shape::Scalar).then(|| Side::ALL[usize::from(place >= self.shape.per_arm())])
    }

    /// Unit of a place, as people write it.
    pub(crate) fn unit(&self, place: usize) -> &'static str {
        match self.unit_joint_3 {
            Some(unit) if place % 8 == 2 => unit,
            _ => self.unit,
        }
    }

    /// Name and unit of a place as one column name: `jpos_gold_1_deg`, `jpos_gold_3_m_x57`, `runlevel`.
    pub(crate) fn column_name(&self, place: usize) -> String {
        let unit = match self.unit(place) {
            "" => return self.place_name(place),
            "N m" => "nm",
            "deg/s" => "deg_s",
            "m x 57.29578" => "m_x57",
            "m/s x 57.29578" => "m_s_x57",
            unit => unit,
        };
        format!("{}_{unit}", self.place_name(place))
    }

    /// Name of a place: field, arm, and joint, axis or element: `jpos_gold_3`, `pos_green_x`, `ori_gold_r2c1`, `runlevel`.
    pub(crate) fn place_name(&self, place: usize) -> String {
        let Some(side) = self.side(place) else {
            return self.name.to_owned();
        };
        let (within, field) = (place % self.shape.per_arm(), self.name);
        let arm = side.name();
        match self.shape {
            Shape::Axes => format!("{field}_{arm}_{}", ["x", "y", "z"][within]),
            Shape::Rotation => format!("{field}_{arm}_r{}c{}", within / 3 + 1, within % 3 + 1),
            Shape::Slots if within == 3 => format!("{field}_{arm}_slot3"),
            Shape::Slots => format!("{field}_{arm}_{}", if within < 3 { within + 1 } else { within }),
            Shape::Six => format!("{field}_{arm}_{}", within + 1),
            Shape::Arms | Shape::Scalar => format!("{field}_{arm}"),
        }
    }
}

macro_rules! field {
    ($constant:ident, $member:ident, $name:literal, $unit:literal, $joint_3:expr, $shape:ident, $kind:ident) => {
        pub(crate) static $constant: Field = Field {
            name: $name,
            unit: $unit,
            unit_joint_3: $joint_3,
            shape: Shape::$shape,
            get: |state| Values::$kind(&state.$member),
            get_mut: |state| ValuesMut::$kind(&mut state.$member),
        };
    };
    ($constant:ident, $member:ident) => {
        pub(crate) static $constant: Field = Field {
            name: stringify!($member),
            unit: "",
            unit_joint_3: None,
            shape: Shape::Scalar,
            get: |state| Values::Int(std::slice::from_ref(&state.$member)),
            get_mut: |state| ValuesMut::Int(std::slice::from_mut(&mut state.$member)),
        };
    };
}

/// Unit of joint 3 in the fields that are multiplied by 180/π although it slides.
const METRES: Option<&str> = Some("m x 57.29578");
const METRES_PER_SECOND: Option<&str> = Some("m/s x 57.29578");

field!(RUNLEVEL, runlevel);
field!(SUBLEVEL, sublevel);
field!(LAST_SEQ, last_seq);
field!(TYPE, type_, "type", "", None, Arms, Int);
field!(POS, pos, "pos", "um", None, Axes, Int);
field!(ORI, ori, "ori", "", None, Rotation, Float);
field!(ORI_D, ori_d, "ori_d", "", None, Rotation, Float);
field!(POS_D, pos_d, "pos_d", "um", None, Axes, Int);
field!(ENC_VALS, enc_vals, "encVals", "counts", None, Slots, Int);
field!(DAC_VAL, dac_val, "dac_val", "counts", None, Slots, Int);
field!(TAU, tau, "tau", "N m", None, Slots, Float);
field!(MPOS, mpos, "mpos", "deg", None, Slots, Float);
field!(JPOS, jpos, "jpos", "deg", METRES, Slots, Float);
field!(MVEL, mvel, "mvel", "deg/s", None, Slots, Float);
field!(JVEL, jvel, "jvel", "deg/s", METRES_PER_SECOND, Slots, Float);
field!(MPOS_D, mpos_d, "mpos_d", "deg", None, Slots, Float);
field!(JPOS_D, jpos_d, "jpos_d", "deg", METRES, Slots, Float);
field!(GRASP_D, grasp_d, "grasp_d", "rad", None, Arms, Float);
field!(ENCOFFSETS, encoffsets, "encoffsets", "counts", None, Slots, Float);
field!(JAC_VEL, jac_vel, "jac_vel", "", None, Six, Float);
field!(JAC_F, jac_f, "jac_f", "", None, Six, Float);

/// Every field in the order of the message, without header and `dt`: 239 numbers.
pub(crate) static MESSAGE: [&Field; 21] = [
    &RUNLEVEL,
    &SUBLEVEL,
    &LAST_SEQ,
    &TYPE,
    &POS,
    &ORI,
    &ORI_D,
    &POS_D,
    &ENC_VALS,
    &DAC_VAL,
    &TAU,
    &MPOS,
    &JPOS,
    &MVEL,
    &JVEL,
    &MPOS_D,
    &JPOS_D,
    &GRASP_D,
    &ENCOFFSETS,
    &JAC_VEL,
    &JAC_F,
];

/// The fields of the paper's text after its time: 234 numbers (ravenstate.md, section 3).
pub(crate) static COLUMNS_235: [&Field; 17] = [
    &POS,
    &POS_D,
    &ORI,
    &ORI_D,
    &ENC_VALS,
    &DAC_VAL,
    &TAU,
    &MPOS,
    &JPOS,
    &MVEL,
    &JVEL,
    &MPOS_D,
    &JPOS_D,
    &GRASP_D,
    &ENCOFFSETS,
    &JAC_VEL,
    &JAC_F,
];

/// The fields of the lab's CSV after the message's time: 239 numbers (ravenstate.md, section 3).
pub(crate) static COLUMNS_252: [&Field; 21] = [
    &JPOS,
    &RUNLEVEL,
    &SUBLEVEL,
    &LAST_SEQ,
    &TYPE,
    &POS,
    &ORI,
    &ORI_D,
    &POS_D,
    &ENC_VALS,
    &DAC_VAL,
    &TAU,
    &MPOS,
    &MVEL,
    &JVEL,
    &MPOS_D,
    &JPOS_D,
    &GRASP_D,
    &ENCOFFSETS,
    &JAC_VEL,
    &JAC_F,
];

/// Arms that show any sign of life in a state, bit 0 gold, bit 1 green: an arm that is not connected stays at zero for ever
/// (ravenstate.md, section 1), and a rotation is never zero.
pub(crate) fn arms_by_content(state: &RavenState) -> u32 {
    let alive = |side: usize| {
        state.ori[9 * side..9 * side + 9].iter().any(|value| *value != 0.0)
            || state.enc_vals[8 * side..8 * side + 8].iter().any(|value| *value != 0)
            || state.mpos[8 * side..8 * side + 8].iter().any(|value| *value != 0.0)
    };
    u32::from(alive(0)) | (u32::from(alive(1)) << 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(fields: &[&Field]) -> usize {
        fields.iter().map(|field| field.count()).sum()
    }

    #[test]
    fn the_layouts_have_their_numbers_of_columns() {
        assert_eq!((total(&MESSAGE), total(&COLUMNS_235), total(&COLUMNS_252)), (239, 234, 239));
        for field in MESSAGE {
            let length = match (field.get)(&RavenState::new()) {
                Values::Int(values) => values.len(),
                Values::Float(values) => values.len(),
            };
            assert_eq!(length, field.count(), "{}", field.name);
        }
    }

    #[test]
    fn every_place_has_a_name_of_its_own() {
        let mut names: Vec<String> =
            MESSAGE.iter().flat_map(|field| (0..field.count()).map(|place| field.place_name(place))).collect();
        assert_eq!((names.len(), names[0].as_str()), (239, "runlevel"));
        names.sort();
        names.dedup();
        assert_eq!(names.len(), 239);
        assert_eq!(JPOS.place_name(10), "jpos_green_3");
        assert_eq!(JPOS.place_name(4), "jpos_gold_4");
        assert_eq!(JPOS.place_name(3), "jpos_gold_slot3");
        assert_eq!((JPOS.unit(10), JPOS.unit(4)), ("m x 57.29578", "deg"));
        assert_eq!(ORI.place_name(16), "ori_green_r3c2");
        assert_eq!(JAC_F.place_name(11), "jac_f_green_6");
    }
}
