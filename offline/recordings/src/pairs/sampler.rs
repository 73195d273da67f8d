//! Columns of the state at the times of the pairs: all at once from memory, or row by row from a stream of any length.

use super::track::{Found, Place, find};

/// How a column is brought to a time between two states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight between the neighbours: positions, velocities, torques.
    Linear,
    /// The nearer of the two (the earlier of equals): integers, flags, counts of a state machine.
    Nearest,
}

impl Interpolation {
    fn between(self, before: f64, after: f64, share: f64) -> f64 {
        match self {
            Self::Linear if share <= 0.0 => before,
            Self::Linear if share >= 1.0 => after,
            Self::Linear => before + share * (after - before),
            Self::Nearest => {
                if share <= 0.5 {
                    before
                } else {
                    after
                }
            }
        }
    }
}

/// One column at the times `at_s`; NaN outside and in gaps. `t_s` and `values` are one per state, times rising.
pub fn sample(t_s: &[f64], values: &[f64], how: Interpolation, gap_max_s: f64, at_s: &[f64]) -> Vec<f64> {
    let mut place = Place::default();
    let value = |at: &f64| match find(t_s, *at, gap_max_s, &mut place) {
        Found::Between { row, share } if row + 1 < values.len() => how.between(values[row], values[row + 1], share),
        _ => f64::NAN,
    };
    at_s.iter().map(value).collect()
}

/// Interpolates the rows of a stream at given times and holds two rows at most, so that an hour of states with all 118 features
/// needs no memory. States come in with rising times; the rows asked for come out in the order of time.
#[derive(Debug, Clone)]
pub struct Sampler {
    at_s: Vec<f64>,
    next: usize,
    how: Vec<Interpolation>,
    gap_max_s: f64,
    last: Option<(f64, Vec<f64>)>,
}

impl Sampler {
    /// For rising times `at_s` (see [`Paired::state_times_s`](super::Paired::state_times_s)); `how` has one entry per column.
    pub fn new(at_s: Vec<f64>, how: Vec<Interpolation>, gap_max_s: f64) -> Self {
        Self { at_s, next: 0, how, gap_max_s, last: None }
    }

    /// Takes the next state and calls `row(index of the time, values)` for every time up to it that lies between this state and
    /// the last one. A time that lies in a gap or before the first state is passed over. Values missing at the end of `state`
    /// are NaN; a state that is not later than the last one is passed over.
    pub fn push(&mut self, t_s: f64, state: &[f64], mut row: impl FnMut(usize, &[f64])) {
        if t_s.is_nan() || self.last.as_ref().is_some_and(|(last_s, _)| t_s <= *last_s) {
            return;
        }
        let mut values = vec![f64::NAN; self.how.len()];
        while let Some(&at_s) = self.at_s.get(self.next).filter(|at_s| **at_s <= t_s) {
            if self.fill(at_s, t_s, state, &mut values) {
                row(self.next, &values);
            }
            self.next += 1;
        }
        let (last_s, kept) = self.last.get_or_insert_with(|| (t_s, Vec::new()));
        *last_s = t_s;
        kept.clear();
        kept.extend((0..self.how.len()).map(|i| state.get(i).copied().unwrap_or(f64::NAN)));
    }

    fn fill(&self, at_s: f64, t_s: f64, state: &[f64], values: &mut [f64]) -> bool {
        let now = |i: usize| state.get(i).copied().unwrap_or(f64::NAN);
        let (before_s, before) = match &self.last {
            _ if at_s == t_s => (t_s, None),
            Some((before_s, before)) if at_s >= *before_s && t_s - before_s <= self.gap_max_s => (*before_s, Some(before)),
            _ => return false,
        };
        for (i, value) in values.iter_mut().enumerate() {
            *value = before
                .map_or_else(|| now(i), |before| self.how[i].between(before[i], now(i), (at_s - before_s) / (t_s - before_s)));
        }
        true
    }

    /// Times that have not come yet.
    pub fn waiting(&self) -> usize {
        self.at_s.len() - self.next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_gives_the_same_rows_as_columns_in_memory() {
        let t_s: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i) + if i > 120 { 0.3 } else { 0.0 }).collect();
        let columns: [Vec<f64>; 2] = [t_s.iter().map(|t| (3.0 * t).sin()).collect(), (0..200).map(f64::from).collect()];
        let at_s: Vec<f64> = (0..90).map(|i| -0.05 + 0.027 * f64::from(i)).chain([t_s[50], t_s[51]]).collect();
        let mut at_s = at_s;
        at_s.sort_by(f64::total_cmp);
        let how = [Interpolation::Linear, Interpolation::Nearest];
        let expected: [Vec<f64>; 2] = std::array::from_fn(|c| sample(&t_s, &columns[c], how[c], 0.02, &at_s));
        let mut sampler = Sampler::new(at_s.clone(), how.to_vec(), 0.02);
        let mut found = [vec![f64::NAN; at_s.len()], vec![f64::NAN; at_s.len()]];
        for (i, &t) in t_s.iter().enumerate() {
            sampler.push(t, &[columns[0][i], columns[1][i]], |k, row| {
                found[0][k] = row[0];
                found[1][k] = row[1];
            });
        }
        let mut missing = 0;
        for (k, (a, b)) in found.iter().flatten().zip(expected.iter().flatten()).enumerate() {
            assert!((a - b).abs() < 1e-12 || (a.is_nan() && b.is_nan()), "{k}: {a} against {b}");
            missing += usize::from(a.is_nan());
        }
        assert!(missing > 4 && missing < 60, "{missing} values fell outside or into the gap");
        assert!(sampler.waiting() < 10);
    }
}
