//! Readings that are none: what a bus, a slow source or a tracker wrote in place of one. They mimic physics: a motor position that is wrong for a
//! millisecond is an acceleration, and so a link that is too light; a value that is written again until the next one comes is a delay.

use crate::series::{quantile, rms};

/// Longest excursion that no motion makes, s; a single reading is one at any rate.
const AWAY_S: f64 = 0.005;
/// The same of one that bends at each of its readings as much as a jump, in longest excursions.
const JAGGED: usize = 4;
/// A jump that no motion makes, of the difference that 95 % of the steps do not have from the one before.
const JUMP: f64 = 4.0;
/// An excursion comes back to where it left, but for this share of itself.
const BACK: f64 = 0.25;
/// Where more readings than this share leave and come back, or are repeated, that is how the signal is.
const RARE: f64 = 0.02;
/// Fewest rows with one value that are a stall; fewer may be alike by chance.
const STALLED: usize = 4;
/// Longest stall, and longest time from one reading of a slow source to the next, s: more is a joint that stood.
const STALL_S: f64 = 0.2;
/// Speeds within this of one another are one motion, which went on while the reading did not.
const GOES_ON: f64 = 3.0;
/// Share of rows, of those in motion, that come at one period where the source is a slow one.
const PERIODIC: f64 = 0.6;
/// Steps of counts that come one by one are alike; of others, at least this share is larger than the least ones by so much.
const STEPS: f64 = 0.3;
const LARGER: f64 = 1.5;
/// Of a signal whose least steps but for a tenth are so many times its resolution no two readings are alike by chance.
const FINER: f64 = 20.0;
/// Share of its usual distance from the origin that a tip never comes nearer to it, where 0, 0, 0 is no place but a frame that was lost.
const NEVER_NEARER: f64 = 0.1;

/// Why something is no reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// A tip at 0, 0, 0 to the last digit.
    AtZero,
    /// It leaves the motion and comes back at once.
    Away,
    /// The same as the one before in the middle of a motion.
    Stalled,
    /// The same as the one before, since the next comes so many rows after it.
    Slow(usize),
}

/// Readings of a column, or of the tip, that were taken as none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoReadings {
    /// What it is of.
    pub of: String,
    /// Why.
    pub why: Why,
    /// How many.
    pub count: usize,
}

impl NoReadings {
    /// Rows from one reading to the next of a slow source.
    pub fn period(&self) -> Option<usize> {
        if let Why::Slow(period) = self.why { Some(period) } else { None }
    }
}

/// What a column is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A place, which goes on while anything moves.
    Place,
    /// Something that may jump, and stay the same.
    Force,
    /// What was asked for: no reading at all.
    Command,
}

/// A tip without what some trackers write where they lost it, and in how many rows they did.
pub(crate) fn without_zeros(tip: &mut [Vec<f64>]) -> Option<NoReadings> {
    let distance = |tip: &[Vec<f64>], i: usize| tip.iter().map(|axis| axis[i].powi(2)).sum::<f64>().sqrt();
    let (zero, elsewhere): (Vec<usize>, Vec<usize>) =
        (0..tip[0].len()).filter(|i| distance(tip, *i).is_finite()).partition(|i| distance(tip, *i) == 0.0);
    let usual = rms(elsewhere.iter().map(|i| distance(tip, *i)));
    if elsewhere.iter().any(|i| distance(tip, *i) < NEVER_NEARER * usual) {
        return None;
    }
    erased(tip, zero, "the tip", Why::AtZero)
}

/// Takes out of series that were read together (of one column, or of the three axes of the tip; NaN where there is none), rows about `dt_s` apart,
/// what is no reading, and says what.
pub(crate) fn without_false(set: &mut [Vec<f64>], dt_s: f64, of: &str, kind: Kind) -> Vec<NoReadings> {
    if kind == Kind::Command {
        return Vec::new();
    }
    let mut all = Vec::new();
    // Before places are compared, since a wrong one makes two of the one that it stands in; and after, when what was repeated is one reading.
    let mut apart = away_of(set, dt_s, kind);
    erase(set, &apart);
    if kind == Kind::Place {
        if let Some((period, rows)) = Levels::of(set).slow(dt_s) {
            all.extend(erased(set, rows, of, Why::Slow(period)));
        }
        let stalls = Levels::of(set).stalls(set, dt_s);
        all.extend(erased(set, stalls, of, Why::Stalled));
        apart.extend(away_of(set, dt_s, kind));
    }
    all.extend(erased(set, apart, of, Why::Away));
    all
}

/// Takes out of a force or a command what only repeats it, where it was written as seldom as the places beside it, a new one every `period` rows. By
/// itself it may stay the same; beside places that are taken as they were read, one that is held comes late.
pub(crate) fn without_repeats(set: &mut [Vec<f64>], dt_s: f64, of: &str, period: usize) -> Option<NoReadings> {
    let (own, rows) = Levels::of(set).slow(dt_s)?;
    if own == period { erased(set, rows, of, Why::Slow(period)) } else { None }
}

/// Rows in which some series of a set leaves its motion and comes back.
fn away_of(set: &[Vec<f64>], dt_s: f64, kind: Kind) -> Vec<usize> {
    set.iter().flat_map(|series| away(series, dt_s, kind)).collect()
}

/// Makes rows of a set NaN.
fn erase(set: &mut [Vec<f64>], rows: &[usize]) {
    for series in set {
        for row in rows {
            series[*row] = f64::NAN;
        }
    }
}

/// The same, and what to say of it.
fn erased(set: &mut [Vec<f64>], mut rows: Vec<usize>, of: &str, why: Why) -> Option<NoReadings> {
    rows.sort_unstable();
    rows.dedup();
    erase(set, &rows);
    (!rows.is_empty()).then(|| NoReadings { of: of.to_owned(), why, count: rows.len() })
}

/// A series' readings: the rows and what stands there.
fn readings(series: &[f64]) -> (Vec<usize>, Vec<f64>) {
    series.iter().copied().enumerate().filter(|(_, x)| x.is_finite()).unzip()
}

/// The jump that no motion of this series makes: some times what its steps usually differ by, or its least one.
fn jump(values: &[f64]) -> f64 {
    let mut off: Vec<f64> = values.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    let least = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    JUMP * quantile(&mut off, 0.95).max(least)
}

/// Rows in which a series leaves its motion and comes back; none where they are not rare.
fn away(series: &[f64], dt_s: f64, kind: Kind) -> Vec<usize> {
    let (rows, values) = readings(series);
    let least = jump(&values);
    let mut apart: Vec<f64> = rows.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect();
    let readings_in = |time_s: f64| ((time_s / (dt_s * quantile(&mut apart, 0.5)).max(1e-9)) as usize).max(1);
    let [longest, held] = [AWAY_S, if kind == Kind::Place { STALL_S } else { AWAY_S }].map(readings_in);
    let mut out = Vec::new();
    let mut i = 2;
    while i + 2 < values.len() {
        match is_back(&values, i, [longest, held], least) {
            Some(back) => {
                out.extend(&rows[i..back]);
                i = back + 2;
            }
            None => i += 1,
        }
    }
    if out.len() as f64 > RARE * values.len() as f64 { Vec::new() } else { out }
}

/// Where a series is back that jumps away at a reading, after so many readings at most; some times as many if it bends at each, as of many words in a
/// row that are wrong; or so many if the later ones are one value, as of one that is wrong for a while. (A motion that bends lies on the other side of
/// the line between two of its places than one that jumps.)
fn is_back(values: &[f64], i: usize, [longest, held]: [usize; 2], least: f64) -> Option<usize> {
    let before = values[i - 1] - values[i - 2];
    let jump = values[i] - values[i - 1] - before;
    if jump.abs() <= least {
        return None;
    }
    let same = values.get(i + longest - 1).map_or(0, |word| values[i + longest..].iter().take_while(|x| *x == word).count());
    let jagged = values[i - 1..].windows(3).take_while(|w| (w[2] - 2.0 * w[1] + w[0]).abs() > least).count();
    let last = (i + (longest + same).min(held).max(jagged.min(JAGGED * longest))).min(values.len() - 2);
    let is_at = |back: usize, small: f64| {
        let after = values[back + 1] - values[back];
        let off = |k: usize| values[k] - values[i - 1] - (k + 1 - i) as f64 * 0.5 * (before + after);
        off(i) / jump > 0.5 && off(back).abs() < small && (after - before).abs() < small
    };
    // A smaller wrong word behind a large one is not the way back, if there is a way all the way back.
    let roughly = BACK * jump.abs();
    [roughly.min(least), roughly].into_iter().find_map(|small| (i + 1..=last).find(|&back| is_at(back, small)))
}

/// One place and how long it was read.
struct Level {
    /// Its first reading, among those that are there.
    first: usize,
    /// Readings that are it.
    count: usize,
}

/// A set of series as places that follow one another.
struct Levels {
    /// Rows of the readings.
    rows: Vec<usize>,
    /// The places.
    all: Vec<Level>,
    /// How far the next one is from each but the last.
    steps: Vec<f64>,
}

impl Levels {
    fn of(set: &[Vec<f64>]) -> Self {
        let rows: Vec<usize> = (0..set[0].len()).filter(|i| set.iter().all(|series| series[*i].is_finite())).collect();
        let mut all: Vec<Level> = Vec::new();
        for (k, row) in rows.iter().enumerate() {
            match all.last_mut() {
                Some(level) if set.iter().all(|series| series[rows[level.first]] == series[*row]) => level.count += 1,
                _ => all.push(Level { first: k, count: 1 }),
            }
        }
        let between = |pair: &[Level]| {
            let [a, b] = [&pair[0], &pair[1]].map(|level| rows[level.first]);
            set.iter().map(|series| (series[b] - series[a]).powi(2)).sum::<f64>().sqrt()
        };
        let steps = all.windows(2).map(between).collect();
        Self { rows, all, steps }
    }

    /// Steps above this are not the least ones.
    fn larger(&self) -> f64 {
        LARGER * quantile(&mut self.steps.clone(), 0.1)
    }

    /// Is its resolution far finer than its steps, so that nothing is repeated by chance?
    fn is_continuous(&self) -> bool {
        let least = self.steps.iter().copied().fold(f64::INFINITY, f64::min);
        self.larger() > FINER * least
    }

    /// If a new reading comes only every few rows, whatever the speed: how many, and the rows that only repeat it. Counts that come one by one
    /// are no slow source: of these the steps are all alike, and how long each lasts is not.
    fn slow(&self, dt_s: f64) -> Option<(usize, Vec<usize>)> {
        // Longer than that nothing is between two readings: it stood.
        let short = self.all.iter().filter(|level| level.count as f64 * dt_s <= STALL_S);
        let mut lengths: Vec<usize> = short.flat_map(|level| std::iter::repeat_n(level.count, level.count)).collect();
        lengths.sort_unstable();
        let period = lengths.get(lengths.len() / 2).copied().filter(|period| *period >= 2)?;
        let in_motion = self.all.iter().filter(|level| level.count < 4 * period);
        let near = |level: &&Level| level.count.abs_diff(period) <= period / 20 + usize::from(period > 4);
        let rows = |levels: &mut dyn Iterator<Item = &Level>| levels.map(|level| level.count).sum::<usize>() as f64;
        let (moving, periodic) = (rows(&mut in_motion.clone()), rows(&mut in_motion.clone().filter(near)));
        let larger = self.larger();
        let large = self.steps.iter().filter(|step| **step > larger).count() as f64;
        if periodic < PERIODIC * moving || large < STEPS * self.steps.len() as f64 {
            return None;
        }
        // What stands for long has been read again and again. After that, or after a row that is not there, a reading that does not last may be an
        // old one.
        let is_new = |k: usize| {
            let (level, before) = (&self.all[k], k.checked_sub(1).map(|k| &self.all[k]));
            let next_to = before.is_some_and(|before| {
                before.count < 4 * period && self.rows[level.first] == self.rows[before.first + before.count - 1] + 1
            });
            next_to || level.count >= period
        };
        let moving = (0..self.all.len()).filter(|k| self.all[*k].count < 4 * period);
        // One that lasts for two periods was read twice: slow motions take longer than that from count to count.
        let again = moving.flat_map(|k| {
            let Level { first, count } = self.all[k];
            (0..count).filter(move |since| !is_new(k) || since % period != 0).map(move |since| first + since)
        });
        Some((period, again.map(|k| self.rows[k]).collect()))
    }

    /// Rows that repeat the one before: of what has noise, which hardly ever does, all that are not followed by a least step (there it stood);
    /// elsewhere those in a motion that goes on. Where one stall follows another and the motion goes on over both only, the reading between them is
    /// an old one as well.
    fn stalls(&self, set: &[Vec<f64>], dt_s: f64) -> Vec<usize> {
        let jumps: Vec<f64> = set.iter().map(|series| jump(&readings(series).1)).collect();
        let row = |level: usize| self.rows[self.all[level].first];
        let step = |from: usize, to: usize| set.iter().map(move |series| series[row(to)] - series[row(from)]).collect::<Vec<_>>();
        let length = |vector: &[f64]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Distance to another place per row.
        let speed = |from: usize, to: usize| {
            let rows = (row(to) - row(from)) as f64;
            step(from, to).into_iter().map(|x| x / rows).collect::<Vec<f64>>()
        };
        let goes_on = |from: usize, to: usize| {
            let (before, here, after) = (speed(from - 1, from), speed(from, to), speed(to, to + 1));
            let mean: Vec<f64> = before.iter().zip(&after).map(|(a, b)| 0.5 * (a + b)).collect();
            let along: f64 = here.iter().zip(&mean).map(|(a, b)| a * b).sum();
            let ratio = length(&here) / length(&mean);
            along > 0.5 * length(&here) * length(&mean) && (1.0 / GOES_ON..GOES_ON).contains(&ratio)
        };
        let in_motion = |from: usize, to: usize| {
            let rows = self.all[from..to].iter().map(|level| level.count).sum::<usize>();
            let jumps_from = |level: usize| step(level, level + 1).iter().zip(&jumps).any(|(x, jump)| x.abs() > *jump);
            rows as f64 * dt_s <= STALL_S && (from..to).all(jumps_from) && goes_on(from, to)
        };
        let (last, larger) = (self.all.len().saturating_sub(2), self.larger());
        let again: Vec<usize> =
            (1..last).filter(|level| self.all[*level].count >= STALLED && self.steps[*level] > larger).collect();
        let rows = again.iter().map(|level| self.all[*level].count).sum::<usize>() as f64;
        let are_asked = rows > RARE * self.rows.len() as f64 || !self.is_continuous();
        let of = |from: usize, to: usize| self.all[from].first + 1..self.all[to - 1].first + self.all[to - 1].count;
        let alone = again.iter().filter(|level| !are_asked || in_motion(**level, **level + 1)).map(|level| of(*level, *level + 1));
        let is_over_both = |one: usize| !(in_motion(one, one + 1) && in_motion(one + 1, one + 2)) && in_motion(one, one + 2);
        let both =
            again.windows(2).filter(|pair| pair[1] == pair[0] + 1 && is_over_both(pair[0])).map(|pair| of(pair[0], pair[0] + 2));
        alone.chain(both).flatten().map(|k| self.rows[k]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion of 6 s at 1 kHz.
    fn motion() -> Vec<f64> {
        (0..6000).map(|i| (i as f64 * 2e-3).sin() + 0.2 * (i as f64 * 9e-3).sin()).collect()
    }

    /// Noise of deviation 1, the same every time.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    fn noisy(deviation: f64) -> Vec<f64> {
        motion().iter().zip(noise(6000)).map(|(x, e)| x + deviation * e).collect()
    }

    /// In counts of an encoder.
    fn counted(series: &[f64], count: f64) -> Vec<f64> {
        series.iter().map(|x| (x / count).round() * count).collect()
    }

    /// Rows that were taken out of a place read every millisecond, and why.
    fn taken(series: &[f64]) -> (Vec<usize>, Vec<Why>) {
        let mut set = [series.to_vec()];
        let why = without_false(&mut set, 0.001, "mpos_1_rad", Kind::Place);
        let rows: Vec<usize> = (0..series.len()).filter(|i| set[0][*i].is_nan()).collect();
        assert_eq!(why.iter().map(|one| one.count).sum::<usize>(), rows.len());
        (rows, why.iter().map(|one| one.why).collect())
    }

    #[test]
    fn many_wrong_readings_in_a_row_are_none_though_one_of_them_is_right() {
        // As a torque was read: seven rows, the fourth of which is right.
        let mut series: Vec<f64> = motion().iter().zip(noise(6000)).map(|(x, e)| 0.01 * x + 5e-4 * e).collect();
        for (row, by) in [(3000, 0.44), (3001, 0.07), (3002, 0.21), (3004, 0.15), (3005, 0.35), (3006, -0.31)] {
            series[row] += by;
        }
        let mut set = [series];
        let why = without_false(&mut set, 0.001, "tau_3_nm", Kind::Force);
        assert_eq!(why, [NoReadings { of: "tau_3_nm".to_owned(), why: Why::Away, count: 7 }]);
        assert!(set[0][3000..3007].iter().all(|x| x.is_nan()));
        // A push that comes and goes within as long is something: its readings go one way, then the other.
        let pushed = |i: usize| if (3000..3012).contains(&i) { (6.0 - (i as f64 - 3006.0).abs()) * 0.05 } else { 0.0 };
        let mut set = [motion().iter().enumerate().map(|(i, x)| 0.01 * x + pushed(i)).collect::<Vec<f64>>()];
        assert_eq!(without_false(&mut set, 0.001, "tau_3_nm", Kind::Force), []);
    }

    #[test]
    fn what_leaves_a_motion_and_is_back_at_once_is_no_reading() {
        for mut series in [motion(), noisy(1e-4), counted(&motion(), 1e-3), counted(&noisy(1e-4), 1e-4)] {
            assert_eq!(taken(&series), (Vec::new(), Vec::new()));
            // In the middle of a motion, where it turns round, several in a row, unlike, to both sides; a word that is wrong for 40 ms.
            for (row, by) in [(500, 0.1), (1234, -0.3), (2718, 0.05), (2719, -0.2), (2720, 0.07), (4000, -2.0)] {
                series[row] += by;
            }
            series[5000..5040].fill(0.0);
            let rows: Vec<usize> = [500, 1234, 2718, 2719, 2720, 4000].into_iter().chain(5000..5040).collect();
            assert_eq!(taken(&series), (rows, vec![Why::Away]));
        }
    }

    #[test]
    fn small_wrong_words_behind_a_large_one_are_none() {
        let mut torque = noisy(0.01);
        for (row, by) in [(3000, 6.0), (3001, 1.0), (3002, 1.2)] {
            torque[row] += by;
        }
        let mut set = [torque];
        let why = without_false(&mut set, 0.001, "tau_3_nm", Kind::Force);
        assert_eq!(why, [NoReadings { of: "tau_3_nm".to_owned(), why: Why::Away, count: 3 }]);
        assert!(set[0][3000..3003].iter().all(|x| x.is_nan()));
    }

    #[test]
    fn what_stays_away_or_happens_often_is_a_reading() {
        let mut steps = noisy(1e-4);
        steps[3000..].iter_mut().for_each(|x| *x += 0.1);
        assert_eq!(taken(&steps).0, Vec::<usize>::new());
        let often: Vec<f64> = noisy(1e-4).iter().enumerate().map(|(i, x)| if i % 30 == 7 { x + 0.1 } else { *x }).collect();
        assert_eq!(taken(&often).0, Vec::<usize>::new());
        // It stands, goes, and stands: without noise there is nothing to measure a bend against.
        let goes = |i: usize| ((i as f64 - 2000.0) / 500.0).clamp(0.0, 1.0);
        let gently: Vec<f64> = (0..6000).map(|i| goes(i).powi(2) * (3.0 - 2.0 * goes(i))).collect();
        assert_eq!(taken(&gently).0, Vec::<usize>::new());
        assert_eq!(taken(&counted(&gently, 1e-3)).0, Vec::<usize>::new());
    }

    #[test]
    fn a_reading_that_stands_still_in_a_motion_is_none() {
        let rows: Vec<usize> = (1001..1020).chain(3301..3330).collect();
        for mut series in [noisy(1e-4), counted(&motion(), 1e-4)] {
            let [a, b] = [1000, 3300].map(|i| series[i]);
            series[1000..1020].fill(a);
            series[3300..3330].fill(b);
            assert_eq!(taken(&series), (rows.clone(), vec![Why::Stalled]));
        }
    }

    #[test]
    fn a_reading_between_two_stalls_that_is_an_old_one_is_none() {
        for mut series in [noisy(1e-4), counted(&motion(), 1e-4)] {
            // The second stall begins before the first one ends, and holds what was read then.
            let [first, second] = [1000, 1018].map(|i| series[i]);
            series[1000..1027].fill(first);
            series[1027..1032].fill(second);
            assert_eq!(taken(&series), ((1001..1032).collect(), vec![Why::Stalled]));
        }
        // Two stalls with a reading of that instant between them.
        let mut series = counted(&motion(), 1e-4);
        let [first, second] = [1000, 1027].map(|i| series[i]);
        series[1000..1027].fill(first);
        series[1027..1040].fill(second);
        assert_eq!(taken(&series), ((1001..1027).chain(1028..1040).collect(), vec![Why::Stalled]));
    }

    #[test]
    fn a_slow_source_is_known_by_its_period_and_counts_are_none() {
        for every in [2, 5, 10, 33] {
            let source = noisy(1e-4);
            let series: Vec<f64> = (0..6000).map(|i| source[i / every * every]).collect();
            let (rows, why) = taken(&series);
            assert_eq!(rows, (0..6000).filter(|i| i % every != 0).collect::<Vec<_>>());
            assert_eq!(why, [Why::Slow(every)]);
        }
        // It goes, and then stands for longer.
        let mut stands = noisy(1e-4);
        stands.extend(vec![stands[5999]; 12_000]);
        assert_eq!(taken(&stands).0, Vec::<usize>::new());
        // One count every seven rows: the motion is slow, not the source.
        let slow: Vec<f64> = (0..6000).map(|i| (i / 7) as f64 * 1e-3).collect();
        assert_eq!(taken(&slow).0, Vec::<usize>::new());
    }

    #[test]
    fn a_force_may_stay_the_same_but_not_be_elsewhere_for_an_instant() {
        let mut torque = noisy(0.01);
        let held = torque[100];
        torque[100..200].fill(held);
        torque[3000] = 9.0;
        let mut set = [torque];
        let why = without_false(&mut set, 0.001, "tau_1_nm", Kind::Force);
        assert_eq!(why, [NoReadings { of: "tau_1_nm".to_owned(), why: Why::Away, count: 1 }]);
        assert!(set[0][3000].is_nan() && set[0][150] == held);
    }

    #[test]
    fn frames_of_a_camera_are_what_is_beside_one_another() {
        // Every twentieth row; in one a ball was mistaken.
        let frames = |axis: usize| {
            noisy(1e-4).iter().enumerate().map(|(i, x)| if i % 20 == 0 { x + axis as f64 } else { f64::NAN }).collect()
        };
        let mut tip: [Vec<f64>; 3] = std::array::from_fn(frames);
        tip[1][2400] += 0.5;
        let why = without_false(&mut tip, 0.001, "the tip", Kind::Place);
        assert_eq!(why, [NoReadings { of: "the tip".to_owned(), why: Why::Away, count: 1 }]);
        assert!(tip.iter().all(|axis| axis[2400].is_nan() && axis[2380].is_finite() && axis[2420].is_finite()));
    }
}
