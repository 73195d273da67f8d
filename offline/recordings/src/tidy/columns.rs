//! Names and values of the columns.

use arm::published::{self, SLOT_OF_JOINT};
use arm::{Arm, JOINTS, Side};
use nalgebra::UnitQuaternion;
use ravenpose_wire::RavenState;

use crate::sample;
use crate::stream::Truth;
use crate::table::TableColumn;

/// Numbers of a truth beside its time: position, rotation, joints, cable forces.
pub(super) const TRUTH_NUMBERS: usize = 3 + 4 + 2 * JOINTS;

/// Which of a truth's numbers have a column, and whether its time has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct TruthShown {
    pub(super) numbers: [bool; TRUTH_NUMBERS],
    pub(super) offset: bool,
}

impl TruthShown {
    pub(super) const ALL: Self = Self { numbers: [true; TRUTH_NUMBERS], offset: true };

    /// Also shows what this truth knows.
    pub(super) fn include(&mut self, truth: &Truth) {
        for (shown, number) in self.numbers.iter_mut().zip(numbers(truth)) {
            *shown |= !number.is_nan();
        }
    }

    /// Is there a column for all that this truth knows?
    pub(super) fn covers(&self, truth: &Truth) -> bool {
        self.numbers.iter().zip(numbers(truth)).all(|(shown, number)| *shown || number.is_nan())
    }
}

fn numbers(truth: &Truth) -> impl Iterator<Item = f64> {
    truth.position_m.into_iter().chain(truth.quaternion_wxyz).chain(truth.joints).chain(truth.cable_force_n)
}

/// One arm of the table.
pub(super) struct ArmColumns {
    pub(super) arm: Arm,
    pub(super) truth: TruthShown,
    pub(super) orientation: bool,
}

impl ArmColumns {
    pub(super) fn new(side: Side, truth: TruthShown, orientation: bool) -> Self {
        Self { arm: sample::nominal(side), truth, orientation }
    }

    /// The columns of this arm, in the order of [`ArmColumns::push`].
    pub(super) fn names(&self, prefix: &str) -> Vec<TableColumn> {
        let joint = |quantity: &str, joint: usize, unit: &str| format!("{quantity}_{joint}_{unit}");
        let mut names = Vec::new();
        for (quantity, turning, sliding) in [
            ("mpos", "rad", "rad"),
            ("mvel", "rad_s", "rad_s"),
            ("tau", "nm", "nm"),
            ("dac", "counts", "counts"),
            ("jpos", "rad", "m"),
            ("jvel", "rad_s", "m_s"),
            ("jpos_d", "rad", "m"),
        ] {
            names.extend((1..=JOINTS).map(|number| joint(quantity, number, if number == 3 { sliding } else { turning })));
        }
        names.extend(["x_mm", "y_mm", "z_mm"].map(str::to_owned));
        if self.orientation {
            names.extend(["qw", "qx", "qy", "qz"].map(str::to_owned));
        }
        let mut truth = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"].map(str::to_owned).to_vec();
        truth.extend((1..=JOINTS).map(|number| joint("jpos", number, if number == 3 { "m" } else { "rad" })));
        truth.extend((1..=JOINTS).map(|number| joint("cable", number, "n")));
        let shown = truth.into_iter().zip(self.truth.numbers).filter_map(|(name, shown)| shown.then_some(name));
        names.extend(shown.map(|name| format!("truth_{name}")));
        if self.truth.offset {
            names.push("truth_offset_s".to_owned());
        }
        names.into_iter().map(|name| TableColumn::number(format!("{prefix}{name}"))).collect()
    }

    /// Appends the numbers of a row.
    pub(super) fn push(&self, row: &mut Vec<f64>, state: &RavenState, time_ns: i64, truth: Option<&Truth>) {
        let (base, first_axis) = (8 * self.arm.side.index(), 3 * self.arm.side.index());
        let slots = SLOT_OF_JOINT.map(|slot| base + slot);
        let radians = |field: &[f32; 16]| slots.map(|slot| ten_digits(f64::from(field[slot]).to_radians()));
        let gear = self.arm.amplifiers.gear();
        row.extend(radians(&state.mpos));
        row.extend(radians(&state.mvel));
        row.extend(slots.iter().zip(gear).map(|(slot, gear)| ten_digits(f64::from(state.tau[*slot]) / gear)));
        row.extend(slots.map(|slot| f64::from(state.dac_val[slot])));
        row.extend(radians(&state.jpos));
        row.extend(radians(&state.jvel));
        row.extend(radians(&state.jpos_d));
        row.extend(state.pos[first_axis..first_axis + 3].iter().map(|um| f64::from(*um) / 1e3));
        if self.orientation {
            row.extend(quaternion_wxyz(&std::array::from_fn(|place| state.ori[3 * first_axis + place])));
        }
        if let Some(truth) = truth {
            self.push_truth(row, truth, time_ns);
        } else {
            let count = self.truth.numbers.iter().filter(|shown| **shown).count() + usize::from(self.truth.offset);
            row.extend(std::iter::repeat_n(f64::NAN, count));
        }
    }

    fn push_truth(&self, row: &mut Vec<f64>, truth: &Truth, time_ns: i64) {
        let in_mm = truth.position_m.map(millimetres).into_iter();
        let values = in_mm.chain(numbers(truth).skip(3));
        row.extend(values.zip(self.truth.numbers).filter_map(|(value, shown)| shown.then_some(value)));
        if self.truth.offset {
            row.push(truth.time_ns.saturating_sub(time_ns) as f64 / 1e9);
        }
    }
}

/// Of a published rotation matrix, row-major; NaN where it is none.
fn quaternion_wxyz(row_major: &[f32; 9]) -> [f64; 4] {
    let Some(rotation) = published::rotation(row_major) else { return [f64::NAN; 4] };
    // Of a matrix in float32.
    let turned = UnitQuaternion::new_normalize(*UnitQuaternion::from_rotation_matrix(&rotation));
    [turned.w, turned.i, turned.j, turned.k]
}

/// The millimetres that a reader turns into these metres again, if there are any.
fn millimetres(metres: f64) -> f64 {
    let near = metres * 1e3;
    [near, near.next_up(), near.next_down()].into_iter().find(|mm| *mm / 1e3 == metres).unwrap_or(near)
}

/// Rounded to ten or eleven digits: what a float32 is known to, and short as text.
fn ten_digits(value: f64) -> f64 {
    let binary = ((value.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    // Decimal exponent, at most one too small: log10(2) is 1233/4096, rounded down.
    let places = 9 - ((binary * 1233) >> 12);
    match usize::try_from(places).ok().and_then(|places| POWERS.get(places)) {
        Some(power) => (value * power).round() / power,
        None => value,
    }
}

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_digits_give_the_same_single_back() {
        let mut bits = 1_u32;
        for _ in 0..200_000 {
            bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let degrees = f32::from_bits(bits);
            if degrees.is_finite() && degrees.is_normal() {
                let back = ten_digits(f64::from(degrees).to_radians()).to_degrees() as f32;
                assert_eq!(back.to_bits(), degrees.to_bits(), "{degrees:e}");
            }
        }
        assert_eq!(ten_digits(0.1 + 0.2), 0.3);
        assert_eq!(ten_digits(-0.0).to_bits(), (-0.0_f64).to_bits());
        assert!(ten_digits(f64::NAN).is_nan());
    }

    #[test]
    fn millimetres_are_read_as_the_same_metres() {
        let off =
            (0..10_000).map(|i| f64::from(i) * 1.234_567e-5 - 0.05).filter(|metres| millimetres(*metres) / 1e3 != *metres).count();
        assert!(off < 3_000, "{off}");
        assert_eq!(millimetres(0.123_456), 123.456);
    }
}
