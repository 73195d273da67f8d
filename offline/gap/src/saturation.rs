//! Torques that stand at a limit: what an amplifier or a sensor cuts off is no torque that anything can be learnt from.

use crate::series::{range, resolution};

/// Fewest samples in a row at the limit.
const LEAST: usize = 4;
/// Steps of the recorded resolution that a torque must be away from the limit, half as long before or after as it stands there: the top of
/// a rounded curve is 4 away, a cut one many.
const STEEP: f64 = 10.0;
/// Share of the samples from which on it is no limit that was met now and then: a torque that is commanded in steps stands at its extremes.
const SELDOM: f64 = 0.25;
/// Share of its travel that a joint must move at the limit in all: an arm that stands holds its load as evenly.
const MOVES: f64 = 1e-3;

/// A torque at its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Saturated {
    /// Joint, or motor, from 0.
    pub joint: usize,
    /// The limits that it stands at, N·m or N at the motor or the joint as it was recorded.
    pub limits: Vec<f64>,
    /// Share of the samples.
    pub share: f64,
    /// Are they left out? Not where it is so many that it may be how the torque was commanded.
    pub left_out: bool,
}

/// Torques that stand at a limit, and which samples are to be left out. `torque` and `position` have a series for each motor or joint.
pub(crate) fn of(torque: &[Vec<f64>], position: &[Vec<f64>]) -> (Vec<Saturated>, Vec<bool>) {
    let mut rows = vec![false; torque.first().map_or(0, Vec::len)];
    let mut found = Vec::new();
    for (joint, (torque, position)) in torque.iter().zip(position).enumerate() {
        let (low, high) = range(torque.iter().copied().filter(|x| x.is_finite()));
        let (from, to) = range(position.iter().copied().filter(|x| x.is_finite()));
        let resolution = resolution(torque);
        let (mut limits, mut here) = (Vec::new(), Vec::new());
        for limit in [low, high] {
            let stands: Vec<_> = plateaus(torque, limit).filter(|plateau| cut(torque, plateau, resolution)).collect();
            let moved: f64 = stands.iter().map(|p| (position[p.end - 1] - position[p.start]).abs()).filter(|x| x.is_finite()).sum();
            if moved > MOVES * (to - from) {
                limits.push(limit);
                here.extend(stands.into_iter().flatten());
            }
        }
        if limits.is_empty() {
            continue;
        }
        let share = here.len() as f64 / torque.len() as f64;
        let left_out = share < SELDOM;
        if left_out {
            for i in here {
                rows[i] = true;
            }
        }
        found.push(Saturated { joint, limits, share, left_out });
    }
    (found, rows)
}

/// Stretches of at least [`LEAST`] samples that have this very value.
fn plateaus(series: &[f64], value: f64) -> impl Iterator<Item = std::ops::Range<usize>> {
    let mut end = 0;
    series
        .chunk_by(move |a, b| (*a == value) == (*b == value))
        .map(move |part| {
            end += part.len();
            (part[0] == value, end - part.len()..end)
        })
        .filter(|(at, stretch)| *at && stretch.len() >= LEAST)
        .map(|(_, stretch)| stretch)
}

/// Does the series come to a plateau, or leave it, as if it went on beyond?
fn cut(series: &[f64], plateau: &std::ops::Range<usize>, resolution: f64) -> bool {
    let half = plateau.len().div_ceil(2);
    let value = series[plateau.start];
    let before = plateau.start.checked_sub(half).map(|i| series[i]);
    let after = series.get(plateau.end - 1 + half).copied();
    [before, after].into_iter().flatten().any(|x| (x - value).abs() > STEEP * resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that swings, and a torque that goes with it.
    fn swing(of: impl Fn(f64) -> f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let angles = || (0..5000).map(|i| f64::from(i) * 2e-3);
        (vec![angles().map(|a| of(a.sin())).collect()], vec![angles().map(f64::cos).collect()])
    }

    fn cut_at(limit: f64) -> impl Fn(f64) -> f64 {
        move |x| x.clamp(-limit, limit)
    }

    #[test]
    fn what_is_cut_off_is_left_out_and_told_with_its_limits() {
        let (torque, position) = swing(cut_at(0.98));
        let (found, rows) = of(&torque, &position);
        let at = torque[0].iter().filter(|x| x.abs() == 0.98).count();
        assert_eq!(rows.iter().filter(|row| **row).count(), at);
        assert_eq!(found, [Saturated { joint: 0, limits: vec![-0.98, 0.98], share: at as f64 / 5000.0, left_out: true }]);
    }

    #[test]
    fn the_rounded_top_of_a_curve_is_no_limit() {
        for steps in [20.0, 200.0, 2000.0] {
            let (torque, position) = swing(|x| (x * steps).round() / steps);
            assert_eq!(of(&torque, &position).0, [], "{steps}");
            // The same curve cut is one, however it is rounded, if the cut takes more off than the rounding does.
            let cut = swing(|x| (x.min(0.7) * steps).round() / steps);
            assert_eq!(of(&cut.0, &cut.1).0.len(), 1, "{steps}");
        }
    }

    #[test]
    fn an_arm_that_stands_holds_its_load_and_is_at_no_limit() {
        let (mut torque, mut position) = swing(|x| x);
        torque[0].extend([2.0; 1000]);
        let last = position[0][4999];
        position[0].extend([last; 1000]);
        assert_eq!(of(&torque, &position), (Vec::new(), vec![false; 6000]));
    }

    #[test]
    fn a_torque_that_is_as_often_there_as_not_is_told_but_kept() {
        let (torque, position) = swing(|x| if x > 0.0 { 1.0 } else { 0.9 * x });
        let (found, rows) = of(&torque, &position);
        assert!(!found[0].left_out && found[0].share > 0.4, "{found:?}");
        assert!(rows.iter().all(|row| !row));
        // One that knows two values was commanded so.
        let (torque, position) = swing(f64::signum);
        assert_eq!(of(&torque, &position).0, []);
    }
}
