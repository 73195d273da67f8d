//! Finds encoders that stand still although the robot moves.
//!
//! A robot at rest also shows constant counts, so stillness alone says nothing. Three things a real robot cannot do: stop dead on
//! every motor within a millisecond (rotor inertia against the largest torque allows 2 counts/ms at most), report a speed of more
//! than one count per cycle without any change of a count, or let the command run away by more than breakaway friction explains.

use ravenpose_wire::RavenState;

/// Cycles without any change of a count after which trust is reduced.
pub const DEGRADED_AFTER: u32 = 10;
/// Cycles without any change of a count after which it is lost.
pub const FROZEN_AFTER: u32 = 18;

/// A motor that moved at least this many counts in the last cycle cannot stand in the next.
const MOVING_COUNTS: i64 = 3;
/// A reported speed beyond this is more than one count per millisecond (90 deg/s).
const MOVING_DEG_S: f32 = 135.0;
/// Breakaway: 0.05 to 0.1 N m of friction over kp = 0.3 N m/rad is 10 to 19 degrees of motor angle; no motor lags further at rest.
const RUNAWAY_DEG: f32 = 30.0;
/// Slot 3 belongs to no joint.
const JOINT_SLOTS: [usize; 7] = [0, 1, 2, 4, 5, 6, 7];
/// Motors with position control at all times: shoulder, elbow, insertion.
const MAIN_SLOTS: usize = 3;

/// Watches one arm's encoders.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrozenWatch {
    counts: [i32; 8],
    command: [f32; 8],
    seen: bool,
    moved: i64,
    still: u32,
    stopped_dead: bool,
    contradiction: u32,
}

impl FrozenWatch {
    /// Takes one arm's part of a state; returns for how many cycles the encoders have stood still although the robot moved.
    pub fn observe(&mut self, state: &RavenState, arm: usize) -> u32 {
        let counts = &state.enc_vals[arm * 8..arm * 8 + 8];
        let command = &state.mpos_d[arm * 8..arm * 8 + 8];
        if !self.seen {
            self.restart(counts, command);
            self.seen = true;
            return 0;
        }
        let moved = JOINT_SLOTS.iter().map(|&slot| (i64::from(counts[slot]) - i64::from(self.counts[slot])).abs()).max();
        let moved = moved.unwrap_or(0);
        if moved > 0 {
            self.restart(counts, command);
            self.moved = moved;
            return 0;
        }
        if self.still == 0 {
            self.stopped_dead = self.moved >= MOVING_COUNTS;
        }
        self.still = self.still.saturating_add(1);
        let speed = state.mvel[arm * 8..arm * 8 + 8].iter().fold(0.0_f32, |most, speed| most.max(speed.abs()));
        self.contradiction = if speed > MOVING_DEG_S { self.contradiction.saturating_add(1) } else { 0 };
        let lag =
            command.iter().zip(&self.command).take(MAIN_SLOTS).fold(0.0_f32, |most, (now, then)| most.max((now - then).abs()));
        if self.stopped_dead || lag > RUNAWAY_DEG {
            return self.still;
        }
        self.contradiction
    }

    fn restart(&mut self, counts: &[i32], command: &[f32]) {
        self.counts.copy_from_slice(counts);
        self.command.copy_from_slice(command);
        self.moved = 0;
        self.still = 0;
        self.stopped_dead = false;
        self.contradiction = 0;
    }

    /// Forgets everything: another source, or states were missing.
    pub fn reset(&mut self) {
        *self = Self::default();
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
        for step in [0, 8, 14, 18, 20, 21, 21, 22] {
            state.enc_vals[1] = step;
            assert_eq!(watch.observe(&state, 0), 0);
        }
        for _ in 0..1000 {
            assert_eq!(watch.observe(&state, 0), 0);
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
}
