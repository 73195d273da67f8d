//! Where the joints are commanded to go, at any time: a sequence of smooth moves.
//!
//! Every trajectory is a list of [`Move`]s with minimum-jerk profiles (Flash, Hogan 1985: the way hands move), so commanded
//! positions, speeds and accelerations are continuous and a time can be asked for directly.

mod teleoperation;
mod zigzag;

use arm::JOINTS;

pub use teleoperation::{teleoperation, teleoperation_within};
pub use zigzag::zigzag;

/// From one posture to the next, then a rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move<const N: usize = JOINTS> {
    /// Where it ends, rad and m.
    pub to: [f64; N],
    /// Duration of the motion, s.
    pub duration_s: f64,
    /// Rest at its end, s.
    pub rest_s: f64,
    /// Constant speed in the middle instead of a bell: share of the duration over which it speeds up, and over which it
    /// slows down; 0.5 is a bell.
    pub ramp: f64,
}

/// A sequence of moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory<const N: usize = JOINTS> {
    start: [f64; N],
    moves: Vec<Move<N>>,
    /// When each move begins, s.
    begins_s: Vec<f64>,
    duration_s: f64,
}

impl<const N: usize> Trajectory<N> {
    /// Moves from a posture on.
    pub fn new(start: [f64; N], moves: Vec<Move<N>>) -> Self {
        let mut duration_s = 0.0;
        let begins_s = moves
            .iter()
            .map(|step| {
                let begins = duration_s;
                duration_s += step.duration_s + step.rest_s;
                begins
            })
            .collect();
        Self { start, moves, begins_s, duration_s }
    }

    /// Posture at its beginning.
    pub fn start(&self) -> &[f64; N] {
        &self.start
    }

    /// Length, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Its moves.
    pub fn moves(&self) -> &[Move<N>] {
        &self.moves
    }

    /// Commanded joints at a time, s; before the start the first, after the end the last posture.
    pub fn at(&self, time_s: f64) -> [f64; N] {
        let index = self.begins_s.partition_point(|begins| *begins <= time_s);
        let Some(index) = index.checked_sub(1) else { return self.start };
        let step = &self.moves[index];
        let from = if index == 0 { &self.start } else { &self.moves[index - 1].to };
        let share = profile((time_s - self.begins_s[index]) / step.duration_s, step.ramp);
        std::array::from_fn(|joint| from[joint] + share * (step.to[joint] - from[joint]))
    }
}

/// Share of the way after a share of the time: a minimum-jerk bell for `ramp` 0.5, else a stretch of constant speed between
/// two half bells.
fn profile(time: f64, ramp: f64) -> f64 {
    let time = time.clamp(0.0, 1.0);
    if ramp >= 0.5 {
        return bell(time);
    }
    // Speed rises over the first `ramp` as 3u² - 2u³ does, its integral is u³ - u⁴/2.
    let rise = |u: f64| u * u * u * (1.0 - u / 2.0) * ramp;
    let whole = 1.0 - ramp;
    if time < ramp {
        rise(time / ramp) / whole
    } else if time > 1.0 - ramp {
        1.0 - rise((1.0 - time) / ramp) / whole
    } else {
        (ramp / 2.0 + time - ramp) / whole
    }
}

/// `10 t³ - 15 t⁴ + 6 t⁵`.
fn bell(time: f64) -> f64 {
    time * time * time * (10.0 + time * (-15.0 + 6.0 * time))
}

/// Range of one joint that a trajectory uses.
pub type Range = (f64, f64);

/// Where trajectories go unless told otherwise: inside the command limits and inside insertion 0.25 to 0.44 m, where the tip
/// keeps clear of the remote centre (raven2-plant.md, section 2).
pub const WORKSPACE: [Range; JOINTS] = [(0.25, 1.25), (1.00, 2.15), (0.25, 0.44), (-1.2, 1.2), (-0.8, 0.8), (0.1, 1.0), (0.1, 1.0)];

/// Fastest commanded speeds, rad/s and m/s: what the clipped amplifiers can hold against the plant's viscous friction. Motor 3
/// turns 2159 rad per metre and has 2.84e-3 N·m·s/rad against 0.54 N·m: 0.08 m/s is the end.
pub const SPEED_MAX: [f64; JOINTS] = [0.75, 0.65, 0.055, 2.0, 2.0, 2.0, 2.0];

/// Peak of a bell's speed over its mean.
const BELL_PEAK: f64 = 1.875;

/// Shortest duration of a bell between two postures, s.
fn shortest_bell_s<const N: usize>(from: &[f64; N], to: &[f64; N], fastest: &[f64; N]) -> f64 {
    (0..N).map(|joint| BELL_PEAK * (to[joint] - from[joint]).abs() / fastest[joint]).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_profiles_run_from_0_to_1_without_a_jump_in_speed() {
        for ramp in [0.1, 0.3, 0.5] {
            assert!(profile(0.0, ramp).abs() < 1e-15 && (profile(1.0, ramp) - 1.0).abs() < 1e-15);
            let steps = 100_000;
            let speeds: Vec<f64> = (0..steps)
                .map(|i| {
                    let (a, b) = (f64::from(i) / f64::from(steps), f64::from(i + 1) / f64::from(steps));
                    (profile(b, ramp) - profile(a, ramp)) * f64::from(steps)
                })
                .collect();
            let jump = speeds.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            assert!(jump < 5e-3 && speeds.iter().all(|speed| *speed > -1e-9), "ramp {ramp}: {jump}");
        }
    }

    #[test]
    fn every_time_has_a_posture_and_moves_follow_each_other() {
        let to = |value: f64| [value; JOINTS];
        let step = |value| Move { to: to(value), duration_s: 1.0, rest_s: 0.5, ramp: 0.5 };
        let trajectory = Trajectory::new(to(0.0), vec![step(1.0), step(-1.0)]);
        assert_eq!(trajectory.at(-1.0), to(0.0));
        assert_eq!(trajectory.at(1.2), to(1.0));
        assert_eq!(trajectory.at(99.0), to(-1.0));
        assert!((trajectory.at(0.5)[0] - 0.5).abs() < 1e-12);
        assert_eq!(trajectory.duration_s(), 3.0);
    }
}
