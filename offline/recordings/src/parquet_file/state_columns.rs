//! The columns of full states: header, fields of the message, truth of both arms.

use arm::{JOINTS, Side};
use ravenpose_wire::RavenState;

use super::write::{Column, Values};
use crate::fields::MESSAGE;
use crate::stream::Truth;

/// Header and times; the widest type that holds each of them.
pub(super) const HEADER: [&str; 9] =
    ["source_id", "sequence", "source_time_ns", "arms", "hdr_seq", "hdr_stamp_s", "hdr_stamp_ns", "dt_s", "dt_ns"];

/// The header of a state; 64-bit counters without a sign keep their bits.
pub(super) fn header(state: &RavenState) -> [i64; HEADER.len()] {
    [
        state.source_id as i64,
        state.sequence as i64,
        state.source_time_ns,
        i64::from(state.arms),
        i64::from(state.hdr_seq),
        i64::from(state.hdr_stamp_sec),
        i64::from(state.hdr_stamp_nsec),
        i64::from(state.dt_sec),
        i64::from(state.dt_nsec),
    ]
}

/// Puts a number of the header into a state.
pub(super) fn set_header(state: &mut RavenState, place: usize, value: i64) {
    match place {
        0 => state.source_id = value as u64,
        1 => state.seal(value as u64),
        2 => state.source_time_ns = value,
        3 => state.arms = value as u32,
        4 => state.hdr_seq = value as u32,
        5 => state.hdr_stamp_sec = value as u32,
        6 => state.hdr_stamp_nsec = value as u32,
        7 => state.dt_sec = value as i32,
        _ => state.dt_nsec = value as i32,
    }
}

/// Numbers of a truth beside its time: position, rotation, joints, cable forces.
pub(super) const TRUTH_NUMBERS: usize = 3 + 4 + 2 * JOINTS;

/// The numbers of a truth.
pub(super) fn truth_numbers(truth: &Truth) -> impl Iterator<Item = f64> {
    truth.position_m.into_iter().chain(truth.quaternion_wxyz).chain(truth.joints).chain(truth.cable_force_n)
}

/// Puts a number into a truth.
pub(super) fn set_truth(truth: &mut Truth, place: usize, value: f64) {
    let Truth { position_m, quaternion_wxyz, joints, cable_force_n, .. } = truth;
    let mut numbers = position_m.iter_mut().chain(quaternion_wxyz).chain(joints).chain(cable_force_n);
    if let Some(number) = numbers.nth(place) {
        *number = value;
    }
}

/// Names of the columns of an arm's truth, its time first.
pub(super) fn truth_names(side: Side) -> Vec<String> {
    let prefix = format!("truth_{}", side.name());
    let mut names = vec![format!("{prefix}_time_ns")];
    names.extend(["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"].map(|name| format!("{prefix}_{name}")));
    names.extend((1..=JOINTS).map(|joint| format!("{prefix}_jpos_{joint}_{}", if joint == 3 { "m" } else { "rad" })));
    names.extend((1..=JOINTS).map(|joint| format!("{prefix}_cable_{joint}_n")));
    names
}

/// All columns, empty.
pub(super) fn columns() -> Vec<Column> {
    let mut columns: Vec<Column> = HEADER.iter().map(|name| Column::new((*name).to_owned(), Values::I64(Vec::new()))).collect();
    for field in MESSAGE {
        for place in 0..field.count() {
            let values = if field.is_int() { Values::I32(Vec::new()) } else { Values::F32(Vec::new()) };
            columns.push(Column::new(field.column_name(place), values));
        }
    }
    for side in Side::ALL {
        for (place, name) in truth_names(side).into_iter().enumerate() {
            let values = if place == 0 { Values::I64(Vec::new()) } else { Values::F64(Vec::new()) };
            columns.push(Column::new(name, values));
        }
    }
    columns
}
