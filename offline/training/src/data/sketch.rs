//! Which rows a run is made of, in a few numbers: do two files hold the same stretch of motion, whatever they are called and wherever
//! they begin? The smallest hashes of a run's rows (bottom-k sketch; Broder 1997): of two runs that share a part of their rows they share
//! the same part.

use crate::random::{GOLDEN, mixed};
use std::collections::{BTreeSet, VecDeque};

/// Hashes kept of each run.
const KEPT: usize = 64;
/// Share of the hashes, as its reciprocal, from which on two runs overlap, and least number of them.
const SHARE: usize = 16;
const LEAST: usize = 2;

/// The smallest hashes of a run's rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sketch(BTreeSet<u64>);

/// Rows of a table that are hashed together: one row of a few coarse columns may be in any run, so many in this order are not.
const WINDOW: usize = 32;
/// Fewest of them that differ from the one before.
const CHANGES: usize = WINDOW / 4;

/// The sketch of a table's rows, one window after the other, each beginning a row later.
#[derive(Debug, Default)]
pub(super) struct Windows {
    sketch: Sketch,
    rows: VecDeque<u64>,
}

impl Windows {
    /// Adds a row. Where little changes there is nothing to know a run by.
    pub(super) fn add(&mut self, row: impl IntoIterator<Item = f32>) {
        self.rows.push_back(hashed(row.into_iter().map(|number| u64::from(number.to_bits()))));
        if self.rows.len() == WINDOW {
            let changes = self.rows.iter().zip(self.rows.iter().skip(1)).filter(|(one, next)| one != next).count();
            if changes >= CHANGES {
                self.sketch.insert(hashed(self.rows.iter().copied()));
            }
            self.rows.pop_front();
        }
    }

    /// All that was added; of less than a window its rows as they are.
    pub(super) fn finish(mut self) -> Sketch {
        if self.sketch.0.is_empty() {
            self.sketch.insert(hashed(self.rows.iter().copied()));
        }
        self.sketch
    }
}

fn hashed(numbers: impl IntoIterator<Item = u64>) -> u64 {
    numbers.into_iter().fold(0, |hash, number| mixed(hash ^ number).wrapping_add(GOLDEN))
}

impl Sketch {
    /// Adds a row that is like no other, every number as it was read.
    pub fn add(&mut self, row: impl IntoIterator<Item = f32>) {
        self.insert(hashed(row.into_iter().map(|number| u64::from(number.to_bits()))));
    }

    fn insert(&mut self, hash: u64) {
        if self.0.len() < KEPT || self.0.last().is_some_and(|last| hash < *last) {
            self.0.insert(hash);
            if self.0.len() > KEPT {
                self.0.pop_last();
            }
        }
    }

    /// Do the two hold a sixteenth of the same rows?
    pub fn overlaps(&self, other: &Self) -> bool {
        let least = (self.0.len().min(other.0.len()) / SHARE).max(LEAST);
        self.0.intersection(&other.0).take(least).count() == least
    }

    /// As one word.
    pub fn word(&self) -> String {
        self.0.iter().map(|hash| format!("{hash:016x}")).collect::<Vec<_>>().join(".")
    }

    /// From its word; what is no hash is left out.
    pub fn of_word(word: &str) -> Self {
        Self(word.split('.').filter_map(|hash| u64::from_str_radix(hash, 16).ok()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_a_run_are_known_wherever_they_begin_and_other_runs_are_not() {
        let of = |rows: std::ops::Range<u32>| {
            let mut sketch = Sketch::default();
            rows.for_each(|row| sketch.add([(row as f32).sin(), row as f32]));
            sketch
        };
        let whole = of(0..30_000);
        for part in [of(0..30_000), of(137..30_000), of(20_000..25_000), of(29_000..90_000), of(0..30)] {
            assert_eq!(part.overlaps(&whole), part != of(0..30), "a thousandth says nothing");
            assert_eq!(Sketch::of_word(&part.word()), part);
        }
        assert!(!of(30_000..60_000).overlaps(&whole) && !Sketch::default().overlaps(&whole));
        // Rows that come again, as where a robot stands, count once.
        let mut standing = Sketch::default();
        (0..1000).for_each(|_| standing.add([1.0, 2.0]));
        assert!(!standing.overlaps(&standing.clone()));
    }

    #[test]
    fn coarse_tables_of_other_runs_are_other_runs_and_parts_of_one_are_not() {
        // Degrees to a tenth: of two sweeps that are out of step nearly every row is in both.
        let of = |rows: std::ops::Range<i32>, rate: f32| {
            let mut windows = Windows::default();
            rows.for_each(|row| windows.add([((row as f32 * rate).sin() * 20.0).round() / 10.0, 0.0]));
            windows.finish()
        };
        let whole = of(0..5000, 0.01);
        assert!(of(3000..5000, 0.01).overlaps(&whole));
        assert!(!of(0..5000, 0.0123).overlaps(&whole));
        // Both stand for long where they begin.
        assert!(!of(0..5000, 0.0).overlaps(&of(0..5000, 0.0)));
        let few = of(0..20, 0.01);
        assert!(few == of(0..20, 0.01) && few != of(0..20, 0.02));
    }
}
