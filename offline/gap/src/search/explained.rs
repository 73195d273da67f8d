//! Where a candidate explains what it explains.

/// What a candidate explains, in units of what it leaves of each cell, and what of that is at some rows; and the share of the rows that these are.
pub(super) struct Explained {
    pub(super) all: f64,
    pub(super) within: f64,
    pub(super) rows: f64,
}

/// Of residuals without and with it, per cell, and of its effects there.
pub(super) fn explained(
    [without, with]: &[Vec<Vec<f64>>; 2],
    effects: &[Vec<f64>],
    mut some: impl FnMut(usize) -> Vec<bool>,
) -> Explained {
    let mut sum = Explained { all: 0.0, within: 0.0, rows: 0.0 };
    let mut rows = 0;
    for c in (0..effects.len()).filter(|c| !effects[*c].is_empty()) {
        let left = with[c].iter().map(|y| y * y).sum::<f64>().max(1e-300);
        for ((before, after), within) in without[c].iter().zip(&with[c]).zip(some(c)) {
            let of = (before * before - after * after) / left;
            sum.all += of;
            sum.within += if within { of } else { 0.0 };
            sum.rows += f64::from(u8::from(within));
            rows += 1;
        }
    }
    sum.rows /= f64::from(rows.max(1));
    sum
}
