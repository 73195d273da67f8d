//! Finds encoders that stand still although the robot moves.
//!
//! A robot at rest also shows constant counts, so stillness alone says nothing. Three things a real motor cannot do: stop dead within
//! a millisecond (rotor inertia against the largest torque allows 2 counts/ms at most), have a speed of more than one count per cycle
//! without any change of its count, or let the command run away by more than breakaway friction explains.

use ravenpose_wire::RavenState;

/// Cycles without any change of a count after which trust is reduced.
pub const DEGRADED_AFTER: u32 = 10;
/// Cycles without any change of a count after which it is lost.
pub const FROZEN_AFTER: u32 = 18;

/// A motor that moved at least this many counts in the last cycle cannot stand in the next.
const MOVING_COUNTS: i64 = 3;
/// By so many counts per cycle a motor that brakes gets slower from one cycle to the next.
const BRAKING_COUNTS: i64 = 2;
/// A reported speed beyond this is more than one count per millisecond (90 deg/s).
const MOVING_DEG_S: f32 = 135.0;
/// Breakaway: 0.05 to 0.1 N m of friction over kp = 0.3 N m/rad is 10 to 19 degrees of motor angle; no motor lags further at rest.
const RUNAWAY_DEG: f32 = 30.0;
/// No motor is told to go further (`IMPOSSIBLE` in `guard`); nothing can be compared with such a command.
const COMMAND_MAX_DEG: f32 = 200_000.0;
/// Motors with position control at all times and an inertia that is known: shoulder, elbow, insertion.
const MOTORS: usize = 3;

/// Watches the encoders of one arm's motors 1 to 3, each by itself. Lost and overtaken states are allowed for by the sequence number.
///
/// What it cannot tell from a robot at rest within 20 ms: an encoder that freezes while its motor turns slower than 3 counts per ms
/// (270 deg/s, 2 deg/s at the shoulder). That is found when the command has run away, or when the speed contradicts it.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrozenWatch {
    motors: [Motor; MOTORS],
    /// Of the state seen last.
    sequence: Option<u64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Motor {
    count: i32,
    command: f32,
    /// Counts per cycle in the last step.
    speed: i64,
    /// Cycles without a change of the count.
    still: u32,
    stopped_dead: bool,
    /// Cycles of those in which the reported speed said otherwise.
    contradiction: u32,
}

impl FrozenWatch {
    /// Takes one arm's part of a state; returns for how many cycles an encoder has stood still although its motor moves.
    pub fn observe(&mut self, state: &RavenState, arm: usize) -> u32 {
        let last = self.sequence.replace(state.sequence);
        let cycles = last.map_or(1, |last| state.sequence.saturating_sub(last).clamp(1, 1_000) as u32);
        let mut longest = 0;
        for (slot, motor) in self.motors.iter_mut().enumerate() {
            let slot = arm * 8 + slot;
            let (count, command) = (state.enc_vals[slot], state.mpos_d[slot]);
            if last.is_some() {
                longest = longest.max(motor.observe(count, command, state.mvel[slot], cycles));
            } else {
                *motor = Motor { count, command, ..Motor::default() };
            }
        }
        longest
    }

    /// Forgets everything: another source.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

impl Motor {
    fn observe(&mut self, count: i32, command: f32, speed: f32, cycles: u32) -> u32 {
        let moved = (i64::from(count) - i64::from(self.count)).abs();
        if moved > 0 {
            // Over states that are missing it is the mean that is seen: at their end a motor that brakes is slower by half of what it loses.
            let cycles = i64::from(cycles);
            let speed = moved / cycles - BRAKING_COUNTS * (cycles - 1) / 2;
            *self = Self { count, command, speed, ..Self::default() };
            return 0;
        }
        if !(-COMMAND_MAX_DEG..=COMMAND_MAX_DEG).contains(&self.command) {
            self.command = command;
        }
        if self.still == 0 {
            self.stopped_dead = self.speed >= MOVING_COUNTS;
        }
        self.still = self.still.saturating_add(cycles);
        self.contradiction = if speed.abs() > MOVING_DEG_S { self.contradiction.saturating_add(cycles) } else { 0 };
        if self.stopped_dead || (command - self.command).abs() > RUNAWAY_DEG {
            return self.still;
        }
        self.contradiction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(step: i32) -> RavenState {
        let mut state = RavenState::new();
        state.enc_vals[1] = step * 10;
        state.mvel[1] = 900.0;
        state.mpos_d[1] = step as f32 * 0.9;
        state
    }

    #[test]
    fn held_encoders_are_found_within_20_cycles_in_each_way() {
        for keep_speed in [true, false] {
            let mut watch = FrozenWatch::default();
            for step in 0..50 {
                assert_eq!(watch.observe(&moving(step), 0), 0);
            }
            for cycle in 1..=20 {
                let mut state = moving(49);
                if !keep_speed {
                    state.mvel[1] = 0.0;
                }
                assert_eq!(watch.observe(&state, 0), cycle, "keep_speed {keep_speed}");
            }
            assert_eq!(watch.observe(&moving(50), 0), 0);
        }
    }

    #[test]
    fn a_robot_that_comes_to_rest_is_not_frozen() {
        let mut watch = FrozenWatch::default();
        let mut state = RavenState::new();
        for step in [0, 8, 14, 18, 20, 21, 22, 22] {
            state.enc_vals[1] = step;
            assert_eq!(watch.observe(&state, 0), 0);
        }
        for _ in 0..1000 {
            assert_eq!(watch.observe(&state, 0), 0);
        }
    }

    #[test]
    fn a_robot_that_came_to_rest_while_states_were_missing_is_not_frozen() {
        // 12 counts per cycle, less by one with each: the mean over what is missing is more than a motor that stops dead can have.
        for missing in 1..14_u64 {
            let mut watch = FrozenWatch::default();
            let (mut state, mut speed) = (RavenState::new(), 12);
            for sequence in 1..500 {
                state.sequence = sequence;
                speed = if sequence > 20 { (speed - 1).max(0) } else { speed };
                state.enc_vals[1] += speed;
                if (20..20 + missing).contains(&sequence) {
                    continue;
                }
                assert_eq!(watch.observe(&state, 0), 0, "{missing} missing, state {sequence}");
            }
        }
    }

    #[test]
    fn a_command_that_runs_away_from_still_encoders_is_found() {
        let mut watch = FrozenWatch::default();
        let mut state = RavenState::new();
        assert_eq!(watch.observe(&state, 0), 0);
        state.mpos_d[2] = 29.0;
        assert_eq!(watch.observe(&state, 0), 0);
        state.mpos_d[2] = 31.0;
        assert_eq!(watch.observe(&state, 0), 2);
    }

    #[test]
    fn a_command_that_cannot_be_is_not_what_later_ones_are_compared_with() {
        for bad in [f32::NAN, f32::INFINITY, -1e30] {
            let mut watch = FrozenWatch::default();
            let mut state = RavenState::new();
            state.mpos_d[2] = bad;
            assert_eq!(watch.observe(&state, 0), 0);
            state.mpos_d[2] = 100.0;
            for _ in 0..100 {
                assert_eq!(
                    watch.observe(&state, 0),
                    0,
                    "after {bad} a robot at rest is none that stands although it is told to move"
                );
            }
            state.mpos_d[2] = 131.0;
            assert!(watch.observe(&state, 0) > 0, "after {bad} a command that runs away is found");
        }
    }

    #[test]
    fn one_held_encoder_is_found_while_the_others_move() {
        let mut watch = FrozenWatch::default();
        for step in 0..100 {
            let mut state = moving(step);
            state.enc_vals[0] = step * 7;
            state.enc_vals[2] = step.min(49) * 5;
            let still = watch.observe(&state, 0);
            assert_eq!(still, (step - 49).max(0) as u32, "step {step}");
        }
    }

    #[test]
    fn a_held_encoder_is_found_although_states_are_missing() {
        let mut watch = FrozenWatch::default();
        for step in 0..200 {
            if step % 8 == 7 || (96..105).contains(&step) {
                continue;
            }
            let mut state = moving(step.min(100));
            state.sequence = step as u64;
            let still = watch.observe(&state, 0);
            // What was lost around the stop itself: it is seen at the first state after it.
            assert_eq!(still, (step - 105).max(0) as u32, "step {step}");
        }
    }
}
