//! What a torque does between two samples.

use super::Run;
use crate::plant::Vector;

/// What a recorded torque does between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hold {
    /// It stands, as an amplifier holds its command.
    #[default]
    Steps,
    /// It runs straight from one to the next.
    Line,
    /// It is the smooth signal that was sampled: windowed sinc, for forces that were measured or synthesised without steps.
    /// Needs an even sampling; where that is off by more than 1 %, the line is taken.
    Smooth,
}

/// Samples on either side that make a value of [`Hold::Smooth`].
const REACH: usize = 32;
/// Shape of its window: side lobes at -90 dB, the band up to 0.9 of the half sampling rate.
const KAISER_BETA: f64 = 9.0;

/// Torque in the middle of each of a number of equal parts of an interval between two rows.
pub(super) struct Held<'a> {
    rows: &'a [Vector],
    hold: Hold,
    parts: usize,
    /// Weights of the samples round an interval, one set per part.
    weights: Vec<[f64; 2 * REACH]>,
}

impl<'a> Held<'a> {
    pub(super) fn new(run: &Run, rows: &'a [Vector], hold: Hold, parts: usize) -> Self {
        let period_s = run.period_s();
        let even = run.time_s.windows(2).all(|pair| ((pair[1] - pair[0]) / period_s - 1.0).abs() < 0.01);
        let hold = if hold == Hold::Smooth && !even { Hold::Line } else { hold };
        let parts = if hold == Hold::Steps { 1 } else { parts };
        let weights = if hold == Hold::Smooth { (0..parts).map(|part| kernel(middle(part, parts))).collect() } else { Vec::new() };
        Self { rows, hold, parts, weights }
    }

    pub(super) fn parts(&self) -> usize {
        self.parts
    }

    /// Between rows `row` and `row + 1`.
    pub(super) fn at(&self, row: usize, part: usize) -> Vector {
        let last = self.rows.len() - 1;
        match self.hold {
            Hold::Steps => self.rows[row],
            Hold::Line => {
                let (a, b, share) = (&self.rows[row], &self.rows[(row + 1).min(last)], middle(part, self.parts));
                std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
            }
            Hold::Smooth => {
                let mut out = [0.0; crate::plant::JOINTS_MAX];
                for (k, weight) in self.weights[part].iter().enumerate() {
                    let sample = &self.rows[(row + k + 1).saturating_sub(REACH).min(last)];
                    out.iter_mut().zip(sample).for_each(|(sum, value)| *sum += weight * value);
                }
                out
            }
        }
    }
}

fn middle(part: usize, parts: usize) -> f64 {
    (part as f64 + 0.5) / parts as f64
}

/// Weights of samples `1 - REACH ..= REACH` for a place between 0 and 1, which add up to 1.
fn kernel(place: f64) -> [f64; 2 * REACH] {
    let raw: [f64; 2 * REACH] = std::array::from_fn(|k| {
        let away = place - (k as f64 + 1.0 - REACH as f64);
        let inside = 1.0 - (away / REACH as f64).powi(2);
        let window = if inside > 0.0 { bessel(KAISER_BETA * inside.sqrt()) / bessel(KAISER_BETA) } else { 0.0 };
        let turn = std::f64::consts::PI * away;
        window * if away == 0.0 { 1.0 } else { turn.sin() / turn }
    });
    let sum: f64 = raw.iter().sum();
    raw.map(|weight| weight / sum)
}

/// Modified Bessel function of the first kind, order 0.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..60 {
        term *= (x / 2.0 / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::JOINTS_MAX;

    #[test]
    fn a_sampled_sine_comes_back_between_its_samples() {
        let tone = |t: f64| (t * 700.0).sin();
        let run = Run { time_s: (0..400).map(|k| f64::from(k) / 750.0).collect(), ..Run::default() };
        let rows: Vec<Vector> =
            run.time_s.iter().map(|t| std::array::from_fn(|i| if i < JOINTS_MAX { tone(*t) } else { 0.0 })).collect();
        for (hold, most) in [(Hold::Smooth, 2e-5), (Hold::Line, 0.12)] {
            let held = Held::new(&run, &rows, hold, 4);
            let mut worst = 0.0_f64;
            for row in 50..350 {
                for part in 0..4 {
                    let t = run.time_s[row] + middle(part, 4) / 750.0;
                    worst = worst.max((held.at(row, part)[0] - tone(t)).abs());
                }
            }
            assert!(worst < most, "{hold:?}: {worst}");
        }
    }
}
