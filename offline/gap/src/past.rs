//! What a play remembers of the time before a part of a run.

/// Where joints and drives turned round before the first sample, in the order of the joints, as far as a play of some width may remember it;
/// nothing where a run begins.
#[derive(Debug, Clone, Default)]
pub struct Past {
    /// Joint positions, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Those of the drives in joint units.
    pub drive: Vec<Vec<f64>>,
}

impl Past {
    /// The past of what goes on after `to` samples of these.
    #[must_use]
    pub fn until(&self, position: &[Vec<f64>], drive: &[Vec<f64>], to: usize) -> Self {
        let after = |past: &[Vec<f64>], series: &[Vec<f64>]| {
            let of_joint = |(j, series): (usize, &Vec<f64>)| {
                let before = past.get(j).map_or(&[][..], Vec::as_slice);
                turning_points(&[before, &series[..to]].concat())
            };
            series.iter().enumerate().map(of_joint).collect()
        };
        Self { position: after(&self.position, position), drive: after(&self.drive, drive) }
    }
}

/// The points of a series that move a play of any width as the whole of it does: the first, the furthest ones, the furthest way back from
/// there, and so on to the last (return-point memory: Brokate and Sprekels, Hysteresis and Phase Transitions, 1996, section 2.2).
fn turning_points(series: &[f64]) -> Vec<f64> {
    let Some(last) = series.len().checked_sub(1) else { return Vec::new() };
    // The last of the furthest from each point on, either way.
    let furthest = |further: fn(f64, f64) -> bool| {
        let mut place = vec![last; series.len()];
        for k in (0..last).rev() {
            place[k] = if further(series[k], series[place[k + 1]]) { k } else { place[k + 1] };
        }
        place
    };
    let (high, low) = (furthest(|a, b| a > b), furthest(|a, b| a < b));
    let (mut out, mut from) = (vec![series[0]], 0);
    loop {
        let (first, then) = (high[from].min(low[from]), high[from].max(low[from]));
        out.extend([series[first], series[then]]);
        if then == from || then == last {
            return out;
        }
        from = then;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a play of a width stands after a series.
    fn played(series: &[f64], width: f64) -> f64 {
        series.iter().fold(series[0], |inner, x| f64::clamp(inner, x - 0.5 * width, x + 0.5 * width))
    }

    #[test]
    fn a_play_of_any_width_stands_where_the_whole_of_the_past_leaves_it() {
        let mut random = 1_u64;
        let mut step = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        for length in [1, 2, 3, 10, 100, 5000] {
            let mut x = 0.3;
            let series: Vec<f64> = (0..length)
                .map(|_| {
                    x += step();
                    x
                })
                .collect();
            let kept = turning_points(&series);
            assert!(kept.len() <= 2 * (length + 1) && (length < 5000 || kept.len() < 200), "{} of {length}", kept.len());
            for width in [0.0, 0.05, 0.4, 1.0, 3.0, 8.0, 30.0] {
                let (whole, short) = (played(&series, width), played(&kept, width));
                assert!((whole - short).abs() < 1e-12, "{length} points, width {width}: {whole} and {short}");
            }
        }
        assert!(turning_points(&[]).is_empty());
    }

    #[test]
    fn the_past_of_a_part_of_a_part_is_that_of_both() {
        let series = vec![vec![0.0, 2.0, -1.0, 1.5, 0.0, 0.7, 0.2]];
        let whole = Past::default().until(&series, &series, 6);
        let rest: Vec<Vec<f64>> = vec![series[0][3..].to_vec()];
        let twice = Past::default().until(&series, &series, 3).until(&rest, &rest, 3);
        for width in [0.1, 0.5, 1.0, 2.5, 4.0] {
            assert!((played(&whole.drive[0], width) - played(&twice.drive[0], width)).abs() < 1e-12);
        }
    }
}
