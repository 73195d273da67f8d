//! Zig-zag: back and forth in one joint at constant speed, a step in a second joint at each turn, layers in the third; the
//! paper's second kind of trajectory.

use arm::{JOINTS, Joints};

use super::{Move, Range, SPEED_MAX, Trajectory, shortest_bell_s};
use crate::random::Random;

/// Rows per layer.
const ROWS: usize = 6;
/// Layers per block.
const LAYERS: usize = 3;
/// Slowest and fastest crossing, as a share of the range per second.
const SPEED: (f64, f64) = (0.08, 0.5);
/// Share of a crossing over which it speeds up, and slows down.
const RAMP: f64 = 0.1;

/// At least `duration_s` of rows inside `ranges`, starting at `start`. Which joint is crossed, which stepped and which
/// layered changes from block to block, as does the speed; the tool turns slowly from row to row.
pub fn zigzag(seed: u64, start: Joints, ranges: &[Range; JOINTS], duration_s: f64) -> Trajectory {
    let mut random = Random::new(seed, 3);
    let mut moves: Vec<Move> = Vec::new();
    let (mut at, mut total_s) = (start, 0.0);
    while total_s < duration_s {
        for step in block(&mut random, at, ranges) {
            total_s += step.duration_s + step.rest_s;
            at = step.to;
            moves.push(step);
        }
    }
    Trajectory::new(start, moves)
}

fn block(random: &mut Random, from: Joints, ranges: &[Range; JOINTS]) -> Vec<Move> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [2, 0, 1], [0, 2, 1], [1, 2, 0], [2, 1, 0]];
    let [crossed, stepped, layered] = ORDERS[(random.share() * 6.0) as usize % 6];
    let speed = SPEED.0 * (SPEED.1 / SPEED.0).powf(random.share());
    let part = |joint: usize, share: f64| ranges[joint].0 + share * (ranges[joint].1 - ranges[joint].0);
    let margin = random.between(0.0, 0.25);
    let mut at = from;
    let mut moves = Vec::new();
    for layer in 0..LAYERS {
        let level = margin + (1.0 - 2.0 * margin) * layer as f64 / (LAYERS - 1) as f64;
        for row in 0..ROWS {
            let height = margin + (1.0 - 2.0 * margin) * row as f64 / (ROWS - 1) as f64;
            let forward = (row + layer) % 2 == 0;
            let (near, far) = if forward { (margin, 1.0 - margin) } else { (1.0 - margin, margin) };
            let mut turn = at;
            turn[layered] = part(layered, level);
            turn[stepped] = part(stepped, height);
            turn[crossed] = part(crossed, near);
            for joint in 3..JOINTS {
                turn[joint] = part(joint, random.between(0.2, 0.8));
            }
            let approach_s = shortest_bell_s(&at, &turn, &SPEED_MAX).max(0.5);
            moves.push(Move { to: turn, duration_s: approach_s, rest_s: 0.0, ramp: 0.5 });
            let mut crossing = turn;
            crossing[crossed] = part(crossed, far);
            let fastest_s = (crossing[crossed] - turn[crossed]).abs() / (1.0 - RAMP) / SPEED_MAX[crossed];
            let duration_s = ((1.0 - 2.0 * margin) / speed).max(fastest_s);
            moves.push(Move { to: crossing, duration_s, rest_s: 0.0, ramp: RAMP });
            at = crossing;
        }
    }
    moves
}

#[cfg(test)]
mod tests {
    use super::super::WORKSPACE;
    use super::*;

    #[test]
    fn rows_are_crossed_at_constant_speed_both_ways_and_everything_stays_inside() {
        let start: Joints = std::array::from_fn(|joint| f64::midpoint(WORKSPACE[joint].0, WORKSPACE[joint].1));
        let trajectory = zigzag(1, start, &WORKSPACE, 900.0);
        assert!(trajectory.duration_s() >= 900.0);
        for step in trajectory.moves() {
            assert!((0..JOINTS).all(|joint| (WORKSPACE[joint].0..=WORKSPACE[joint].1).contains(&step.to[joint])), "{step:?}");
        }
        let crossings: Vec<&Move> = trajectory.moves().iter().filter(|step| step.ramp < 0.5).collect();
        assert!(crossings.len() >= ROWS * LAYERS);
        let mut begins = 0.0;
        let mut found = (0, 0);
        for step in trajectory.moves() {
            if step.ramp < 0.5 {
                let at = |share: f64| trajectory.at(begins + share * step.duration_s);
                let crossed = (0..3).max_by(|a, b| (at(0.9)[*a] - at(0.1)[*a]).abs().total_cmp(&(at(0.9)[*b] - at(0.1)[*b]).abs()));
                let joint = crossed.expect("three joints");
                let (first, second) = (at(0.5)[joint] - at(0.2)[joint], at(0.8)[joint] - at(0.5)[joint]);
                assert!((first - second).abs() < 1e-9);
                if first > 0.0 { found.0 += 1 } else { found.1 += 1 }
            }
            begins += step.duration_s + step.rest_s;
        }
        assert!(found.0 > 5 && found.1 > 5, "{found:?}");
    }
}
