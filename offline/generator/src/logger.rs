//! What a laboratory's logger makes of the signals now and then. None of it is physics: a tool has to see that.

use crate::random::Random;
use crate::run::Signals;
use serde::{Deserialize, Serialize};

/// How a run is logged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Logging {
    /// As it was read.
    #[default]
    Faithful,
    /// Wrong words on the bus, sources that stall, balls that the tracker mistakes; in some cases sources that are slower than the log and repeated in it.
    Faulty,
}

impl Logging {
    /// Is it as it was read?
    #[must_use]
    pub fn is_faithful(&self) -> bool {
        *self == Self::Faithful
    }
}

/// Readings per column that are wrong words.
const WRONG: f64 = 3e-4;
/// Most readings in a row that are.
const IN_A_ROW: usize = 3;
/// Stalls per column and run.
const STALLS: usize = 3;
/// Their length, samples.
const STALL: [f64; 2] = [5.0, 40.0];
/// Frames in which the tracker mistakes something for a ball, and how far off that is, m.
const MISTAKEN: f64 = 0.01;
const OFF_M: [f64; 2] = [5e-3, 30e-3];

/// What goes wrong with one case's recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Faults {
    /// Samples after which the joints' encoders say something new.
    pub joint_every: usize,
    /// The same of the motors.
    pub motor_every: usize,
    /// Is a frame of the tip repeated in every row until the next one?
    pub tip_repeated: bool,
}

impl Faults {
    /// Of a case.
    pub fn draw(random: &mut Random) -> Self {
        let mut every = |probability: f64, least: usize, more: usize| {
            if random.chance(probability) { least + random.index(more) } else { 1 }
        };
        let (joint_every, motor_every) = (every(0.4, 4, 9), every(0.3, 2, 3));
        Self { joint_every, motor_every, tip_repeated: random.chance(0.4) }
    }

    /// Does it to a run. A frame of the tip is there every `frame` samples.
    pub fn damage(&self, seen: &mut Signals, frame: usize, random: &mut Random) {
        for (rows, every) in [(&mut seen.motor, self.motor_every), (&mut seen.joint, self.joint_every)] {
            held(rows, every);
            for column in 0..rows[0].len() {
                wrong(rows, column, random);
                stall(rows, column, random);
            }
        }
        for column in 0..seen.torque[0].len() {
            wrong(&mut seen.torque, column, random);
        }
        for k in (0..seen.tip.len()).step_by(frame) {
            if random.chance(MISTAKEN) {
                let (off, direction) = (random.uniform(OFF_M[0], OFF_M[1]), random.direction());
                seen.tip[k] = std::array::from_fn(|x| seen.tip[k][x] + off * direction[x]);
            }
        }
        if self.tip_repeated {
            held(&mut seen.tip, frame);
        }
    }
}

/// New values only every so many samples.
fn held<T: Clone>(rows: &mut [T], every: usize) {
    for group in rows.chunks_mut(every) {
        let Some((first, others)) = group.split_first_mut() else { continue };
        for row in others {
            row.clone_from(first);
        }
    }
}

/// Single wrong words: anywhere from a twentieth of the range away to beyond it.
fn wrong(rows: &mut [Vec<f64>], column: usize, random: &mut Random) {
    let (low, high) =
        rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| (low.min(row[column]), high.max(row[column])));
    for k in 0..rows.len() {
        if random.chance(WRONG) {
            for row in rows[k..].iter_mut().take(1 + random.index(IN_A_ROW)) {
                row[column] += random.sign() * random.uniform(0.05, 1.2) * (high - low);
            }
        }
    }
}

/// Some stretches in which the source says the same.
fn stall(rows: &mut [Vec<f64>], column: usize, random: &mut Random) {
    for _ in 0..STALLS {
        let (from, length) = (random.index(rows.len()), random.uniform(STALL[0], STALL[1]) as usize);
        let value = rows[from][column];
        rows[from..].iter_mut().take(length).for_each(|row| row[column] = value);
    }
}
