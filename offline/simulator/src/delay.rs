//! A signal as it was some time ago.

use std::collections::VecDeque;

use crate::physics::MeasurementDelay;

/// The last values of a signal at a fixed period, read at any age by linear interpolation; before the start, the first value.
#[derive(Debug, Clone)]
pub(crate) struct DelayLine<const N: usize> {
    delay: MeasurementDelay,
    period_s: f64,
    values: VecDeque<[f64; N]>,
    capacity: usize,
}

/// A run with a drifting clock is longer than this never, s.
const LONGEST_RUN_S: f64 = 7200.0;

impl<const N: usize> DelayLine<N> {
    pub(crate) fn new(delay: MeasurementDelay, period_s: f64) -> Self {
        let capacity = (delay.age_s(LONGEST_RUN_S) / period_s).ceil() as usize + 2;
        Self { delay, period_s, values: VecDeque::with_capacity(capacity), capacity }
    }

    /// The value that came last.
    pub(crate) fn newest(&self) -> Option<&[f64; N]> {
        self.values.front()
    }

    /// Takes the value of now, gives the one that is seen now.
    pub(crate) fn pass(&mut self, value: [f64; N], time_s: f64) -> [f64; N] {
        if self.values.len() == self.capacity {
            self.values.pop_back();
        }
        self.values.push_front(value);
        let age = (self.delay.age_s(time_s) / self.period_s).max(0.0);
        let last = self.values.len() - 1;
        let (younger, part) = ((age.floor() as usize).min(last), age.fract());
        let older = (younger + 1).min(last);
        let (a, b) = (&self.values[younger], &self.values[older]);
        std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_arrives_late_by_the_delay_and_a_drifting_clock_adds_to_it() {
        let mut line = DelayLine::new(MeasurementDelay { d: 0.0035, clock_drift: 1e-3 }, 1e-3);
        let mut worst = 0.0_f64;
        for k in 0..5000 {
            let t = f64::from(k) * 1e-3;
            let [seen] = line.pass([t], t);
            if k > 20 {
                worst = worst.max((seen - (t - 0.0035 - 1e-3 * t)).abs());
            }
        }
        assert!(worst < 1e-12, "{worst}");
    }
}
