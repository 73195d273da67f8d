//! What the operator commands: slow waves on all joints, with holds that end gently or in a fast catch-up.

use crate::arm::Arm;
use crate::controller::RATE;
use crate::effect::smooth;
use crate::random::Random;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Time simulated before a recording starts, so that it starts in motion, s.
pub const LEAD: f64 = 0.6;

/// How much the commands tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Excitation {
    /// All joints over much of their range, with holds.
    #[default]
    Teleoperation,
    /// A small corner of the range, slowly, mostly at rest.
    Poor,
}

/// One joint stands still.
#[derive(Clone, Copy, Debug)]
struct Hold {
    start: f64,
    end: f64,
    settle: f64,
    leave: f64,
    at: f64,
}

/// Commands of every joint at every controller sample, from `-LEAD` on.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// `positions[sample][joint]`, rad or m.
    pub positions: Vec<Vec<f64>>,
}

/// Draws the commands of one run.
pub fn draw(arm: &Arm, seconds: f64, excitation: Excitation, random: &mut Random) -> Trajectory {
    let samples = ((seconds + LEAD) * RATE).round() as usize;
    let mut positions = vec![Vec::with_capacity(arm.size()); samples];
    let joints: Vec<_> = (0..arm.size()).collect();
    let first = random.uniform(1.5, 3.0);
    for &j in &joints {
        let joint = &arm.joints[j];
        let (size, slow) = match excitation {
            Excitation::Teleoperation => (random.uniform(0.55, 1.0) * joint.reach, 1.0),
            Excitation::Poor => (random.uniform(0.1, 0.2) * joint.reach, 2.5),
        };
        let centre = joint.centre + random.uniform(-1.0, 1.0) * (joint.reach - size);
        let share = random.uniform(0.55, 0.8);
        let waves = [
            [share * size, TAU / (slow * random.uniform(1.9, 4.2)), random.uniform(0.0, TAU)],
            [(1.0 - share) * size, TAU / (slow * random.uniform(1.4, 7.0)), random.uniform(0.0, TAU)],
        ];
        let wave = |t: f64| centre + waves.iter().map(|[a, w, p]| a * (w * t + p).sin()).sum::<f64>();
        let holds = holds(joint.reach, first + 3.0 * j as f64, seconds, excitation, &wave, random);
        for (index, row) in positions.iter_mut().enumerate() {
            let t = index as f64 / RATE - LEAD;
            row.push(held(t, wave(t), &holds));
        }
    }
    Trajectory { positions }
}

fn holds(
    reach: f64,
    first: f64,
    seconds: f64,
    excitation: Excitation,
    wave: &dyn Fn(f64) -> f64,
    random: &mut Random,
) -> Vec<Hold> {
    let mut holds = Vec::new();
    let mut start = first;
    while start < seconds {
        let length = match excitation {
            Excitation::Teleoperation => random.uniform(1.1, 1.9),
            Excitation::Poor => random.uniform(3.0, 5.0),
        };
        let settle = random.uniform(0.25, 0.4);
        let end = start + length;
        let at = wave(start + 0.5 * settle);
        // a smooth step peaks at 1.875 times its mean speed; nobody moves through the whole range in a tenth of a second
        let way = (wave(end) - at).abs();
        let fastest = way * 1.875 / (8.0 * reach);
        let leave = if random.chance(0.6) { fastest.max(0.2) } else { fastest.max(random.uniform(0.6, 1.0)) };
        holds.push(Hold { start, end, settle, leave, at });
        start = end + leave + random.uniform(7.0, 9.5) - if excitation == Excitation::Poor { 6.0 } else { 0.0 };
    }
    holds
}

fn held(t: f64, free: f64, holds: &[Hold]) -> f64 {
    let mut position = free;
    for hold in holds {
        let share = smooth((t - hold.start) / hold.settle) * (1.0 - smooth((t - hold.end) / hold.leave));
        position += share * (hold.at - position);
    }
    position
}
