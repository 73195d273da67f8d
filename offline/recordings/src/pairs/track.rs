//! The reported positions as a function of time, and the clock between the two streams.

use nalgebra::Vector3;
use serde::Serialize;

/// state time = truth time + `offset_s` + `drift` · (truth time - `reference_s`).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Clock {
    /// State time minus truth time at `reference_s`, s. The lab's images, stamped 0.6 s late, have -0.6.
    pub offset_s: f64,
    /// Change of the offset, s per s.
    pub drift: f64,
    /// Truth time at which `offset_s` holds, s: the middle of the truth, where offset and drift are uncorrelated.
    pub reference_s: f64,
}

impl Clock {
    /// One clock for both.
    pub const IDENTITY: Self = Self { offset_s: 0.0, drift: 0.0, reference_s: 0.0 };

    /// Time on the state's clock of a time on the truth's clock, s.
    pub fn state_time_s(&self, truth_time_s: f64) -> f64 {
        truth_time_s + self.offset_s + self.drift * (truth_time_s - self.reference_s)
    }
}

/// A true position, finite, in the truth's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) t_s: f64,
    pub(super) position_m: Vector3<f64>,
}

/// Reported positions over time, checked: times finite and rising, columns of one length, at least two rows.
#[derive(Clone, Copy)]
pub(super) struct Track<'a> {
    pub(super) t_s: &'a [f64],
    pub(super) position_m: [&'a [f64]; 3],
    pub(super) gap_max_s: f64,
}

/// What stands at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found {
    /// Between the rows `row` and `row + 1`, at this share of the way.
    Between { row: usize, share: f64 },
    /// Before the first or after the last row.
    Outside,
    /// Between rows too far apart.
    Gap,
}

/// Remembers where the last time was found: times mostly rise.
#[derive(Default, Clone, Copy)]
pub(super) struct Place(usize);

/// Row of the last time not after `t_s`; both bounds checked by the caller.
fn row_at(times: &[f64], t_s: f64, place: &mut Place) -> usize {
    let from = if times.get(place.0).is_some_and(|&time| time <= t_s) { place.0 } else { 0 };
    let mut step = 1;
    while times.get(from + step).is_some_and(|&time| time <= t_s) {
        step *= 2;
    }
    let until = (from + step).min(times.len());
    place.0 = from + times[from..until].partition_point(|&time| time <= t_s) - 1;
    place.0
}

/// Finds a time among rising times.
pub(super) fn find(times: &[f64], t_s: f64, gap_max_s: f64, place: &mut Place) -> Found {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Found::Outside };
    if !(t_s >= first && t_s <= last) {
        return Found::Outside;
    }
    let row = row_at(times, t_s, place);
    if times[row] == t_s || row + 1 == times.len() {
        return if row + 1 < times.len() {
            Found::Between { row, share: 0.0 }
        } else {
            Found::Between { row: row - 1, share: 1.0 }
        };
    }
    let interval_s = times[row + 1] - times[row];
    if interval_s > gap_max_s { Found::Gap } else { Found::Between { row, share: (t_s - times[row]) / interval_s } }
}

impl Track<'_> {
    /// Position at a time of the state's clock, m; none outside, in a gap, or beside a value that is not a number.
    pub(super) fn at(&self, t_s: f64, place: &mut Place) -> Option<Vector3<f64>> {
        let Found::Between { row, share } = find(self.t_s, t_s, self.gap_max_s, place) else { return None };
        let position = self.between(row, share);
        position.iter().all(|value| value.is_finite()).then_some(position)
    }

    fn between(&self, row: usize, share: f64) -> Vector3<f64> {
        // At the ends of an interval the other end must not count: it may be missing.
        let axis = |values: &[f64]| match share {
            0.0 => values[row],
            1.0 => values[row + 1],
            _ => values[row] + share * (values[row + 1] - values[row]),
        };
        Vector3::new(axis(self.position_m[0]), axis(self.position_m[1]), axis(self.position_m[2]))
    }

    /// Position and velocity, m and m/s; the velocity over ±`half_s`, so that steps of the published µm do not count.
    pub(super) fn moving_at(&self, t_s: f64, half_s: f64, place: &mut Place) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let before = self.at(t_s - half_s, place)?;
        let here = self.at(t_s, place)?;
        let after = self.at(t_s + half_s, place)?;
        Some((here, (after - before) / (2.0 * half_s)))
    }

    /// Median interval between rows, s.
    pub(super) fn interval_s(&self) -> f64 {
        median_interval_s(self.t_s)
    }
}

/// Median interval of rising times, from at most 10 000 of them, s.
pub(super) fn median_interval_s(times: &[f64]) -> f64 {
    let stride = times.len() / 10_000 + 1;
    let mut intervals: Vec<f64> = times.windows(2).step_by(stride).map(|pair| pair[1] - pair[0]).collect();
    median(&mut intervals).unwrap_or(0.0)
}

/// Median of finite values; reorders them.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_found_between_at_and_outside_the_rows() {
        let times = [0.0, 1.0, 2.0, 5.0];
        let mut place = Place::default();
        for (t_s, expected) in [
            (0.0, Found::Between { row: 0, share: 0.0 }),
            (1.25, Found::Between { row: 1, share: 0.25 }),
            (3.0, Found::Gap),
            (2.0, Found::Between { row: 2, share: 0.0 }),
            (5.0, Found::Between { row: 2, share: 1.0 }),
            (0.5, Found::Between { row: 0, share: 0.5 }),
            (5.1, Found::Outside),
            (-0.1, Found::Outside),
            (f64::NAN, Found::Outside),
        ] {
            assert_eq!(find(&times, t_s, 1.5, &mut place), expected, "{t_s}");
        }
    }
}
