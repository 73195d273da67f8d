//! Times of a stream: rate, gaps, repetitions, jumps, resolution.

use std::collections::HashMap;

use serde::Serialize;

/// A spacing counts as off if it differs from the median by more than this share of it.
const OFF_SHARE: f64 = 0.5;

/// Longest spacings that are kept.
const GAPS_KEPT: usize = 5;

/// Above this share of spacings that are off, the times are those of arrival or of events, not of a clock.
const IRREGULAR_SHARE: f64 = 0.2;

/// Times of a stream.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    /// First time in the file, s.
    pub first_s: f64,
    /// Last time in the file, s.
    pub last_s: f64,
    /// From the earliest to the latest time, s.
    pub duration_s: f64,
    /// Median of the spacings that go forward, s; 0 where there is none.
    pub median_spacing_s: f64,
    /// One over it, 1/s; 0 where there is none.
    pub rate_hz: f64,
    /// Samples per second over the whole duration, 1/s; 0 where it has none.
    pub mean_rate_hz: f64,
    /// Share of the forward spacings that are off the median by more than half of it.
    pub off_share: f64,
    /// Spacings longer than one and a half medians.
    pub gaps: u64,
    /// Samples that would have filled them.
    pub missing_samples: u64,
    /// The longest spacings, longest first.
    pub longest: Vec<Gap>,
    /// Times equal to the one before.
    pub repeated_times: u64,
    /// Times before the one before.
    pub jumps_back: u64,
    /// The first of these jumps: the row, counted from 1, where time jumps back, and how far, s.
    pub first_jump_back: Option<Gap>,
    /// The largest step of which all spacings are multiples, s; 0 where all times are equal.
    pub resolution_s: f64,
}

impl Timing {
    /// Are the spacings too uneven to speak of a rate and of missing samples?
    pub fn is_irregular(&self) -> bool {
        self.off_share > IRREGULAR_SHARE
    }
}

/// A spacing between a row and the one before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// Number of the later row, from 1.
    pub row: u64,
    /// Time of the row before, s.
    pub after_s: f64,
    /// How far apart they are, s.
    pub length_s: f64,
}

/// Collects the times of a stream, ns.
#[derive(Debug, Default)]
pub(super) struct Times {
    count: u64,
    first_ns: i64,
    last_ns: i64,
    least_ns: i64,
    greatest_ns: i64,
    repeated: u64,
    back: u64,
    first_back: Option<Gap>,
    /// Spacings by size: count and sum. Seven bits of mantissa in at most 64 octaves keep this small.
    spacings: HashMap<u64, (u64, f64)>,
    longest: Vec<Gap>,
    divisor_ns: u64,
}

impl Times {
    pub(super) fn see(&mut self, time_ns: i64) {
        self.count += 1;
        if self.count == 1 {
            (self.first_ns, self.last_ns, self.least_ns, self.greatest_ns) = (time_ns, time_ns, time_ns, time_ns);
            return;
        }
        let before_ns = self.last_ns;
        let step_ns = time_ns.abs_diff(before_ns);
        self.divisor_ns = greatest_common_divisor(self.divisor_ns, step_ns);
        let gap = Gap { row: self.count, after_s: seconds(before_ns), length_s: step_ns as f64 / 1e9 };
        match time_ns.cmp(&before_ns) {
            std::cmp::Ordering::Equal => self.repeated += 1,
            std::cmp::Ordering::Less => {
                self.back += 1;
                self.first_back.get_or_insert(gap);
            }
            std::cmp::Ordering::Greater => self.forward(step_ns, gap),
        }
        self.last_ns = time_ns;
        self.least_ns = self.least_ns.min(time_ns);
        self.greatest_ns = self.greatest_ns.max(time_ns);
    }

    fn forward(&mut self, step_ns: u64, gap: Gap) {
        let class = self.spacings.entry((step_ns as f64).to_bits() >> 45).or_default();
        class.0 += 1;
        class.1 += step_ns as f64;
        let at = self.longest.partition_point(|longer| longer.length_s >= gap.length_s);
        if at < GAPS_KEPT {
            self.longest.truncate(GAPS_KEPT - 1);
            self.longest.insert(at, gap);
        }
    }

    pub(super) fn timing(&self) -> Option<Timing> {
        if self.count == 0 {
            return None;
        }
        let mut classes: Vec<(f64, u64)> = self.spacings.values().map(|(count, sum)| (sum / *count as f64, *count)).collect();
        classes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: u64 = classes.iter().map(|(_, count)| count).sum();
        let median_ns = median(&classes, all);
        let off = |spacing: f64| (spacing - median_ns).abs() > OFF_SHARE * median_ns;
        let count_where = |test: &dyn Fn(f64) -> bool| -> u64 {
            classes.iter().filter(|(spacing, _)| test(*spacing)).map(|(_, count)| count).sum()
        };
        let is_gap = |spacing: f64| spacing > (1.0 + OFF_SHARE) * median_ns;
        let missing: f64 = classes
            .iter()
            .filter(|(spacing, _)| is_gap(*spacing))
            .map(|(spacing, count)| ((spacing / median_ns).round() - 1.0).max(0.0) * *count as f64)
            .sum();
        let duration_s = self.greatest_ns.abs_diff(self.least_ns) as f64 / 1e9;
        Some(Timing {
            first_s: seconds(self.first_ns),
            last_s: seconds(self.last_ns),
            duration_s,
            mean_rate_hz: if duration_s > 0.0 { (self.count - 1) as f64 / duration_s } else { 0.0 },
            median_spacing_s: median_ns / 1e9,
            rate_hz: if median_ns > 0.0 { 1e9 / median_ns } else { 0.0 },
            off_share: super::share(count_where(&off), all),
            gaps: count_where(&is_gap),
            missing_samples: missing as u64,
            longest: self.longest.clone(),
            repeated_times: self.repeated,
            jumps_back: self.back,
            first_jump_back: self.first_back,
            resolution_s: self.divisor_ns as f64 / 1e9,
        })
    }
}

/// Median of classes sorted by their spacing: the mean of the class that holds the middle.
fn median(classes: &[(f64, u64)], all: u64) -> f64 {
    let mut below = 0;
    for (spacing, count) in classes {
        below += count;
        if 2 * below >= all {
            return *spacing;
        }
    }
    0.0
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    let (mut a, mut b) = (a, b);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(times_ms: &[i64]) -> Timing {
        let mut times = Times::default();
        for ms in times_ms {
            times.see(ms * 1_000_000);
        }
        times.timing().expect("times")
    }

    #[test]
    fn gaps_repetitions_and_jumps_are_counted() {
        let timing = of(&[0, 10, 20, 30, 30, 70, 60, 70, 80, 90]);
        assert_eq!((timing.median_spacing_s, timing.rate_hz), (0.01, 100.0));
        assert_eq!((timing.gaps, timing.missing_samples), (1, 3));
        assert_eq!((timing.repeated_times, timing.jumps_back), (1, 1));
        assert_eq!(timing.longest[0], Gap { row: 6, after_s: 0.03, length_s: 0.04 });
        assert_eq!(timing.first_jump_back, Some(Gap { row: 7, after_s: 0.07, length_s: 0.01 }));
        assert_eq!((timing.duration_s, timing.resolution_s), (0.09, 0.01));
        assert!((timing.off_share - 1.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn the_resolution_is_the_step_of_the_clock() {
        assert_eq!(of(&[1000, 1004, 1010]).resolution_s, 0.002);
        assert_eq!(of(&[5, 5, 5]).resolution_s, 0.0);
        assert_eq!(of(&[5]).rate_hz, 0.0);
    }

    #[test]
    fn extreme_times_overflow_nothing() {
        let mut times = Times::default();
        for time in [i64::MIN, i64::MAX, 0, i64::MIN] {
            times.see(time);
        }
        let timing = times.timing().expect("times");
        assert_eq!((timing.jumps_back, timing.longest.len()), (2, 1));
    }
}
