//! What a model's card says about torque, so that the service notices a load that was not trained with (`ravenpose::load`).
//!
//! Expected torque: ridge regression on posture, speed, its sign and the memory. Torque of a mass at the tip: the arm's own statics as a linear
//! function of the tip. Neither asks for a run with a load.

use crate::data::Trajectory;
use crate::rivals::POSTURE;
use arm::Arm;
use nalgebra::{DMatrix, DVector};
use ravenpose::load::{self, LoadCard, LoadObserver, MOTORS, MPOS, MVEL, TAU};
use ravenpose_wire::FEATURES;
use std::ops::Range;

/// Features that explain torque, beside the places of a memory and the signs of speeds: tip, joints 1 to 3, motor speeds without slot 3.
const EXPLAINING: [Range<usize>; 4] = [0..3, 56..59, 64..67, 68..72];
/// Share of the mean square that keeps the normal equations solvable where inputs repeat each other.
const RIDGE: f64 = 1e-6;
/// An input whose standard deviation is less than this share of its largest size is constant.
const CONSTANT: f64 = 1e-6;
/// Usual motion over which the observer averages, s. Shorter, and what friction leaves is not averaged out; longer, and it comes later.
const AVERAGED_S: f64 = 40.0;
/// Rows further apart than this say nothing about speed, s: a pause for the observer.
const APART_MAX_S: f64 = load::PAUSE_NS as f64 * 1e-9;
/// Time between two runs, s; more than a pause.
const BETWEEN_S: f64 = 1.0;
/// Less motion than this many averages long shows nothing about how far they stray.
const MOTION_MIN_S: f64 = 5.0 * AVERAGED_S;
/// The range of friction is widened by this share of itself on both sides.
const FRICTION_ROOM: f32 = 0.2;
/// Share of the rows that stay below the limit, and room beyond it.
const LIMIT_SHARE: f64 = 0.999;
const LIMIT_ROOM: f64 = 1.1;

/// Fits what the observer needs to trajectories of one arm with so many plays behind its 118 features; the limit is taken from those
/// of validation too.
///
/// # Errors
/// In words: rows too far apart, or too little motion.
pub fn fit(arm: &Arm, plays: usize, train: &[Trajectory], validation: &[Trajectory]) -> Result<LoadCard, String> {
    let rows = Rows { width: FEATURES + plays, train };
    let (speed, seconds) = rows.usual_speed();
    if seconds < MOTION_MIN_S {
        return Err(format!("{seconds:.0} s of rows no further apart than {APART_MAX_S} s, at least {MOTION_MIN_S} are needed"));
    }
    let unclear = || "torque does not follow from posture and motion here".to_owned();
    let pull = rows.pull(arm).ok_or_else(unclear)?;
    let (expected, noise_nm) = rows.expected().ok_or_else(unclear)?;
    let alone = |motor: usize| std::array::from_fn(|other| f32::from(u8::from(other == motor)));
    let mut card = LoadCard {
        expected,
        pull: [[1.0, 0.0, 0.0, 0.0]; MOTORS],
        noise_nm,
        weight: alone(0),
        travel_deg: speed.map(|speed| (AVERAGED_S * speed) as f32),
        information: [1.0; MOTORS],
        limit_kg: 1.0,
        friction: None,
    };
    // With a pull of 1 and one motor alone the observer averages what is left of that motor's torque.
    let averaged = |motor: usize| {
        let card = LoadCard { weight: alone(motor), ..card.clone() };
        mean(weigh(&card, plays, train, |_| true).mass_kg.into_iter().map(|left| left * left))
    };
    let weight: [f64; MOTORS] = std::array::from_fn(|motor| 1.0 / averaged(motor));
    (card.pull, card.weight) = (pull, weight.map(|weight| weight as f32));
    card.information = rows.usual_squares(&card).map(|square| square as f32);
    let masses = weigh(&card, plays, train.iter().chain(validation), |_| true).mass_kg;
    let mut masses: Vec<f64> = masses.into_iter().map(f64::abs).collect();
    masses.sort_by(f64::total_cmp);
    let place = (LIMIT_SHARE * masses.len() as f64) as usize;
    card.limit_kg = (LIMIT_ROOM * masses.get(place).copied().unwrap_or(f64::NAN)) as f32;
    let usable = |number: &f32| number.is_finite() && *number > 0.0;
    let numbers = card.noise_nm.iter().chain(&card.weight).chain(&card.travel_deg).chain(&card.information).chain([&card.limit_kg]);
    if numbers.into_iter().all(usable) { Ok(card) } else { Err("a motor hardly moved".to_owned()) }
}

/// What an observer says after each row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Weighed {
    /// Estimated mass, kg.
    pub mass_kg: Vec<f64>,
    /// Would the service call it unseen?
    pub unseen: Vec<bool>,
    /// Friction of motors 1 to 3 beyond the usual, N·m.
    pub friction_nm: Vec<[f32; MOTORS]>,
    /// Would the service call that unseen?
    pub friction_unseen: Vec<bool>,
    /// Had it moved far enough for either?
    pub has_weighed: Vec<bool>,
}

/// Runs one observer through trajectories, one after the other as a service does that runs on; it is shown the rows, counted through all of
/// them, that `admitted` lets it see.
pub fn weigh<'a>(
    card: &LoadCard,
    plays: usize,
    runs: impl IntoIterator<Item = &'a Trajectory>,
    admitted: impl Fn(usize) -> bool,
) -> Weighed {
    let mut observer = LoadObserver::new(card.clone());
    let mut found = Weighed::default();
    let mut begun_s = 0.0;
    for one in runs {
        let width = one.inputs.len() / one.rows().max(1);
        for (row, time_s) in one.inputs.chunks_exact(width.max(1)).zip(&one.time_s) {
            if admitted(found.unseen.len()) {
                observer.follow(&row[..FEATURES + plays], ((begun_s + time_s) * 1e9).round() as i64);
            }
            found.mass_kg.push(observer.mass_kg());
            found.unseen.push(observer.score() > 1.0);
            found.friction_nm.push(observer.friction_nm());
            found.friction_unseen.push(observer.friction_score().is_some_and(|score| score > 1.0));
            found.has_weighed.push(observer.has_weighed());
        }
        begun_s += one.time_s.last().unwrap_or(&0.0) + BETWEEN_S;
    }
    found
}

/// Names of what [`append_friction`] appends.
pub fn friction_names() -> impl Iterator<Item = String> {
    (1..=MOTORS).map(|motor| format!("friction_{motor}_nm"))
}

/// Appends to each row the friction that an observer sees which begins with the trajectory: as a service does that has just started. The
/// memory has settled when the observer has weighed, too.
pub fn append_friction(card: &LoadCard, plays: usize, one: &mut Trajectory) {
    let mut observer = LoadObserver::new(card.clone());
    let mut weighed = Vec::with_capacity(one.rows());
    let seen = one.inputs.chunks_exact(FEATURES + plays).zip(&one.time_s).flat_map(|(row, time_s)| {
        observer.follow(row, (time_s * 1e9).round() as i64);
        weighed.push(observer.has_weighed());
        [row, &observer.friction_nm()].concat()
    });
    one.inputs = seen.collect();
    for (unsettled, has_weighed) in one.is_unsettled.iter_mut().zip(weighed) {
        *unsettled |= !has_weighed;
    }
}

/// A trajectory whose friction nobody knew: one row in so many.
#[must_use]
pub fn without_friction(one: &Trajectory, every: usize) -> Trajectory {
    let mut unknown = one.clone();
    unknown.thin(every);
    let width = unknown.inputs.len() / unknown.rows().max(1);
    for row in unknown.inputs.chunks_exact_mut(width.max(1)) {
        row[width - MOTORS..].fill(0.0);
    }
    unknown
}

/// Least and largest friction of each motor that observers see which begin with each trajectory, once they have weighed, or at all where
/// none has. With room: a session longer than those of training is warmer, and beside what it knows the network goes on most evenly.
pub fn friction_known<'a>(card: &LoadCard, plays: usize, runs: impl IntoIterator<Item = &'a Trajectory>) -> [(f32, f32); MOTORS] {
    let weighed: Vec<Weighed> = runs.into_iter().map(|one| weigh(card, plays, [one], |_| true)).collect();
    let any = weighed.iter().any(|one| one.has_weighed.contains(&true));
    let mut known = [(0.0_f32, 0.0_f32); MOTORS];
    for one in &weighed {
        for (friction, _) in one.friction_nm.iter().zip(&one.has_weighed).filter(|(_, has_weighed)| !any || **has_weighed) {
            for ((least, largest), friction) in known.iter_mut().zip(friction) {
                *least = least.min(*friction);
                *largest = largest.max(*friction);
            }
        }
    }
    known.map(|(least, largest)| {
        let room = FRICTION_ROOM * (largest - least);
        (least - room, largest + room)
    })
}

struct Rows<'a> {
    width: usize,
    train: &'a [Trajectory],
}

impl<'a> Rows<'a> {
    fn all(&self) -> impl Iterator<Item = &'a [f32]> + Clone + use<'a> {
        let width = self.width;
        self.train.iter().flat_map(move |one| one.inputs.chunks_exact(width))
    }

    /// Mean speed of each motor, degrees/s, and over how many seconds.
    fn usual_speed(&self) -> ([f64; MOTORS], f64) {
        let (mut ways, mut seconds) = ([0.0; MOTORS], 0.0);
        for one in self.train {
            let rows: Vec<&[f32]> = one.inputs.chunks_exact(self.width).collect();
            for (rows, times) in rows.windows(2).zip(one.time_s.windows(2)) {
                let apart_s = times[1] - times[0];
                if apart_s <= APART_MAX_S {
                    seconds += apart_s;
                    for (motor, way) in ways.iter_mut().enumerate() {
                        *way += f64::from((rows[1][MPOS + motor] - rows[0][MPOS + motor]).abs());
                    }
                }
            }
        }
        (ways.map(|way| way / seconds), seconds)
    }

    /// Coefficients of each motor's expected torque, in the form of the card, and the standard deviation of what they leave, N·m.
    fn expected(&self) -> Option<([Vec<f32>; MOTORS], [f32; MOTORS])> {
        let inputs: Vec<usize> = EXPLAINING.into_iter().flatten().chain(FEATURES..self.width).collect();
        let of = |row: &[f32]| {
            let signs = row[MVEL..MVEL + MOTORS].iter().map(|speed| load::sign(*speed));
            let explaining = inputs.iter().map(|input| row[*input]).chain(signs).map(f64::from).collect();
            (explaining, std::array::from_fn(|motor| f64::from(row[TAU + motor])))
        };
        let found = regress(self.all().map(of))?;
        let left = |motor: usize| {
            let squares = self.all().map(of).map(|(explaining, torque)| {
                let terms = found[motor][1..].iter().zip(explaining).map(|(term, value)| term * value);
                (torque[motor] - found[motor][0] - terms.sum::<f64>()).powi(2)
            });
            mean(squares).sqrt() as f32
        };
        let noise_nm = std::array::from_fn(left);
        let rows = found.map(|terms| {
            let mut row = vec![0.0; load::expected_len(self.width - FEATURES)];
            row[0] = terms[0] as f32;
            for (input, term) in inputs.iter().copied().chain(self.width..).zip(&terms[1..]) {
                row[1 + input] = *term as f32;
            }
            row
        });
        Some((rows, noise_nm))
    }

    /// Coefficients of each motor's torque per kg at the tip, in the form of the card.
    fn pull(&self, arm: &Arm) -> Option<[[f32; 4]; MOTORS]> {
        let of = |row: &[f32]| {
            let joints = POSTURE.map(|feature| f64::from(row[feature]).to_radians());
            (row[..3].iter().map(|um| f64::from(*um)).collect(), arm.gravity.capstan_torque_per_tip_kg(&joints))
        };
        let found = regress(self.all().map(of))?;
        Some(found.map(|terms| std::array::from_fn(|term| terms[term] as f32)))
    }

    /// Mean square of each motor's pull, (N·m/kg)².
    fn usual_squares(&self, card: &LoadCard) -> [f64; MOTORS] {
        card.pull.map(|pull| mean(self.all().map(|row| (f64::from(pull[0]) + dot(&pull[1..], &row[..3])).powi(2))))
    }
}

fn dot(terms: &[f32], row: &[f32]) -> f64 {
    terms.iter().zip(row).map(|(term, value)| f64::from(*term) * f64::from(*value)).sum()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count)
}

/// Ridge regression of each output on the inputs and a constant: per output the constant, then the factors, in raw units. None without
/// rows.
fn regress(rows: impl Iterator<Item = (Vec<f64>, [f64; MOTORS])> + Clone) -> Option<[Vec<f64>; MOTORS]> {
    let joined = |(inputs, outputs): (Vec<f64>, [f64; MOTORS])| {
        DVector::from_iterator(inputs.len() + MOTORS, inputs.into_iter().chain(outputs))
    };
    let n = rows.clone().next()?.0.len();
    let count = rows.clone().count() as f64;
    let mean = rows.clone().map(joined).sum::<DVector<f64>>() / count;
    let mut scatter = DMatrix::<f64>::zeros(n + MOTORS, n + MOTORS);
    for row in rows {
        let off = joined(row) - &mean;
        scatter.ger(1.0 / count, &off, &off, 1.0);
    }
    // Each input by its own size; a constant one takes no part.
    let size = |input: usize| {
        let sd = scatter[(input, input)].sqrt();
        if sd > CONSTANT * mean[input].abs() { 1.0 / sd } else { 0.0 }
    };
    let sizes = DVector::from_fn(n, |input, _| size(input));
    let normal = DMatrix::from_fn(n, n, |r, c| {
        let constant = r == c && sizes[r] == 0.0;
        scatter[(r, c)] * sizes[r] * sizes[c] + if r == c { RIDGE } else { 0.0 } + f64::from(u8::from(constant))
    });
    let right = DMatrix::from_fn(n, MOTORS, |r, output| scatter[(r, n + output)] * sizes[r]);
    let solved = normal.cholesky()?.solve(&right);
    Some(std::array::from_fn(|output| {
        let terms: Vec<f64> = (0..n).map(|input| solved[(input, output)] * sizes[input]).collect();
        let constant = mean[n + output] - terms.iter().zip(mean.iter()).map(|(term, mean)| term * mean).sum::<f64>();
        [vec![constant], terms].concat()
    }))
}
