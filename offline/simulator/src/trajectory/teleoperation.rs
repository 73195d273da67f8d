//! Motion as a surgeon's hand makes it through the master: reaches of log-normal length, now and then a pause, the workspace
//! traversed.

use arm::{JOINTS, Joints};

use super::{Move, Range, SPEED_MAX, Trajectory, shortest_bell_s};
use crate::random::Random;

/// Median duration of a reach, s, and the spread of its logarithm **(assumed)**.
const REACH_S: (f64, f64) = (1.1, 0.45);
/// Reaches are never shorter, s.
const REACH_MIN_S: f64 = 0.45;
/// Share of reaches that cross the workspace; the others stay near **(assumed)**.
const FAR_SHARE: f64 = 0.25;
/// Size of a near reach as a share of the range.
const NEAR_SIZE: f64 = 0.18;
/// Share of reaches with a pause at the end **(assumed)**, and its longest, s.
const PAUSE: (f64, f64) = (0.25, 1.6);

/// At least `duration_s` of reaches of a RAVEN-II inside `ranges`, starting at `start`.
pub fn teleoperation(seed: u64, start: Joints, ranges: &[Range; JOINTS], duration_s: f64) -> Trajectory {
    teleoperation_within(seed, start, ranges, &SPEED_MAX, duration_s)
}

/// At least `duration_s` of reaches of any arm inside `ranges`, no joint faster than its speed in `fastest`.
pub fn teleoperation_within<const N: usize>(
    seed: u64,
    start: [f64; N],
    ranges: &[Range; N],
    fastest: &[f64; N],
    duration_s: f64,
) -> Trajectory<N> {
    let mut random = Random::new(seed, 2);
    let mut at = start;
    let mut moves = Vec::new();
    let mut total_s = 0.0;
    while total_s < duration_s {
        let far = random.share() < FAR_SHARE;
        let to: [f64; N] = std::array::from_fn(|joint| {
            let (low, high) = ranges[joint];
            if far {
                random.between(low, high)
            } else {
                reflected(at[joint] + NEAR_SIZE * (high - low) * random.normal(), low, high)
            }
        });
        let wanted_s = REACH_S.0 * (REACH_S.1 * random.normal()).exp() * if far { 1.6 } else { 1.0 };
        let reach_s = wanted_s.max(REACH_MIN_S).max(shortest_bell_s(&at, &to, fastest));
        let rest_s = if random.share() < PAUSE.0 { random.between(0.1, PAUSE.1) } else { 0.0 };
        moves.push(Move { to, duration_s: reach_s, rest_s, ramp: 0.5 });
        total_s += reach_s + rest_s;
        at = to;
    }
    Trajectory::new(start, moves)
}

/// A value beyond a bound comes back by as much.
fn reflected(value: f64, low: f64, high: f64) -> f64 {
    let back = if value < low { 2.0 * low - value } else { value };
    let back = if back > high { 2.0 * high - back } else { back };
    back.clamp(low, high)
}

#[cfg(test)]
mod tests {
    use super::super::{SPEED_MAX, WORKSPACE};
    use super::*;

    #[test]
    fn half_an_hour_traverses_the_workspace_and_stay_inside() {
        let start: Joints = std::array::from_fn(|joint| f64::midpoint(WORKSPACE[joint].0, WORKSPACE[joint].1));
        let trajectory = teleoperation(3, start, &WORKSPACE, 1800.0);
        let mut cells = std::collections::HashSet::new();
        let (mut still, mut count) = (0, 0);
        for k in 0..180_000 {
            let joints = trajectory.at(f64::from(k) * 0.01);
            let mut cell = [0_u8; 3];
            for joint in 0..JOINTS {
                let (low, high) = WORKSPACE[joint];
                assert!((low..=high).contains(&joints[joint]), "joint {joint} at {}", joints[joint]);
                if joint < 3 {
                    cell[joint] = ((joints[joint] - low) / (high - low) * 3.999) as u8;
                }
            }
            cells.insert(cell);
            still += usize::from(trajectory.at(f64::from(k) * 0.01 + 1e-3) == joints);
            count += 1;
        }
        assert!(cells.len() >= 60, "{} of 64 cells of the workspace", cells.len());
        let share = still as f64 / f64::from(count);
        assert!((0.02..0.4).contains(&share), "at rest for {share} of the time");
    }

    #[test]
    fn no_joint_is_asked_for_more_speed_than_its_motor_has() {
        let start: Joints = std::array::from_fn(|joint| WORKSPACE[joint].0);
        let trajectory = teleoperation(4, start, &WORKSPACE, 300.0);
        let mut fastest = [0.0_f64; JOINTS];
        for k in 0..300_000 {
            let (a, b) = (trajectory.at(f64::from(k) * 1e-3), trajectory.at(f64::from(k + 1) * 1e-3));
            for joint in 0..JOINTS {
                fastest[joint] = fastest[joint].max((b[joint] - a[joint]).abs() * 1e3);
            }
        }
        for joint in 0..JOINTS {
            assert!(fastest[joint] < 1.001 * SPEED_MAX[joint], "{fastest:?}");
        }
        assert!(fastest[2] > 0.9 * SPEED_MAX[2], "{fastest:?}");
    }
}
