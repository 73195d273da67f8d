//! What is asked of an effect before it is taken, beside those that were.

use super::explained::explained;
use super::{Scored, Search, price};
use crate::cell::Channel;
use crate::held_out::{left_without, noise_left, sized_in_a_row};
use crate::hypothesis::{Candidate, RIPPLE, WALL, are_parts, fades_within, rub_together, shaken};
use crate::intervals::OF_THE_LOAD;
use crate::noise::Noise;
use crate::parallel;
use crate::problem::Problem;
use crate::score::{Fit, Gain, Grams, Scorer};
use crate::series::rms;

/// Times its standard error over the blocks that the gain of an effect has to reach, or the ranks of the blocks theirs, which the largest
/// block does not sway; or the squared error that it explains,
const SEEN_OFTEN: f64 = 2.0;
const EXPLAINED_OFTEN: f64 = 3.0;
/// but for what is there so shortly that blocks cannot be told apart: there as many nats without the block that says most are enough, if it has
/// few coefficients and nothing else is said,
const SURE: f64 = 36.0;
const FEW: usize = 2;
/// but for what is met seldom by its nature: a wall, a load that changes sides.
const SELDOM: [&str; 2] = ["external_contact", "backlash"];
/// Share of the remaining squared error that no model's error explains, if every block says so (standard errors of what is explained; or of the ranks of
/// what they gain, if as good as nothing is left), and of the least amplitude what is enough then: what a wrong form leaves, another one explains in
/// part, or in some blocks.
const NEARLY_ALL: f64 = 0.9;
const EVERYWHERE: f64 = 5.0;
const ALL: f64 = 0.97;
const IN_EACH: f64 = 3.0;
const LESS_THEN: f64 = 0.4;
/// Share of what an effect explains that may be where the nominal model is wrong by far more, if it begins or ends on the way: in the opened
/// cases that were looked at it is 0.44 at most of what is there, and 0.77 at least of what is none.
const OF_THE_MODEL: f64 = 2.0 / 3.0;
/// Share of what an effect explains beside a ripple that may be where that shakes the cable, and times the share of those rows that it may be: in the
/// opened cases that were looked at it is 1.2 times at most of what is there, and mostly more than twice of what is none.
const OF_A_RIPPLE: f64 = 0.5;
const OFTENER: f64 = 1.6;
/// Of the largest effect's amplitude, from which on it is none of what a ripple leaves: of that a quarter is lost at most (docs/decisions/0025). What
/// rubs with the speed is large where a motor turns fast, and so shakes its cable.
const LEFT_OF_A_RIPPLE: f64 = 0.5;
/// Positions of the tip are published in whole micrometres: what does less than this to them (m RMS) is how they were computed.
const TIP_RESOLUTION: f64 = 2e-6;
/// No encoder tells less than this of a joint (rad or m RMS); a simulation without noise does.
const JOINT_RESOLUTION: f64 = 1e-7;

/// Least RMS of an effect in a channel, in its unit.
pub(super) fn resolution(channel: Channel) -> f64 {
    match channel {
        Channel::EndEffector => TIP_RESOLUTION,
        Channel::Transmission => JOINT_RESOLUTION,
        Channel::JointTorque => 0.0,
    }
}

/// How a candidate stands beside others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged {
    pub(super) gain: Gain,
    /// Largest share of a cell that it removes.
    pub(super) share: f64,
    /// Is most of what it explains there where the nominal model is wrong: by far more, if it begins or ends on the way, alone; or since a ripple
    /// beside it shakes the cable?
    pub(super) of_the_model: bool,
    /// Its RMS over the largest other effect's where it removes as much as is asked; infinite beside nothing.
    amplitude: f64,
    /// Is it the other part of what rubs at its joint?
    completes: bool,
}

/// Shares of the cells' squared errors, held out, that one fit leaves out and another has.
pub(super) fn shares(before: &Fit, after: &Fit) -> Vec<f64> {
    let sum = |fit: &Fit, c: usize| fit.held_out[c].iter().sum::<f64>();
    (0..before.held_out.len()).map(|c| 1.0 - sum(after, c) / sum(before, c).max(1e-300)).collect()
}

/// Measurement noise of every cell: white at the sensor, coloured by the window.
pub(super) fn window_noise(problem: &Problem) -> Vec<Noise> {
    let behind = problem.pairs[0].real.noise_of_rows();
    let white = problem.from_recording;
    let of = |tip: bool, rows: usize| if tip || white { Noise::default() } else { Noise::from_autocovariance(&behind, rows) };
    problem.cells.iter().map(|cell| of(cell.channel == Channel::EndEffector, cell.rows.len())).collect()
}

impl Search<'_, '_> {
    pub(super) fn judged(&mut self, base: &Grams, others: &[Candidate], scored: &Scored) -> Judged {
        let before = self.scorer.fit(base);
        let grams = self.scorer.extended(base, &scored.candidate.columns);
        let after = self.scorer.fit(&grams);
        let gain = self.significance(others, &scored.candidate);
        let shares = shares(&before, &after);
        let mut sized = sized_in_a_row(others.iter().chain([&scored.candidate]), &after.coefficients);
        let mut sizes: Vec<Vec<f64>> =
            sized.iter().map(|(own, theta)| (0..shares.len()).map(|c| own.varies_by(c, theta)).collect()).collect();
        let own = sizes.pop().unwrap_or_default();
        // A zero that is off is off by a constant: what else is there is no error of its form, unless it is one of the load of a cable that gives way in the
        // simulation already.
        let of_the_load = |own: &Candidate, theta: &[f64]| {
            let compliance = own.family.joints.first().map_or(0.0, |joint| self.problem.nominal.compliance[*joint][0]);
            own.family.physics == "cable_stretch" && theta.first().is_some_and(|x| x.abs() < OF_THE_LOAD * compliance)
        };
        for (size, other) in sizes.iter_mut().zip(others) {
            if other.family.physics == "joint_offset"
                && other.windows.is_none()
                && !sized.last().is_some_and(|(own, theta)| of_the_load(own, theta))
            {
                size.fill(0.0);
            }
        }
        let amplitude = (0..shares.len())
            .filter(|c| shares[*c] >= self.thresholds.share)
            .map(|c| own[c] / sizes.iter().map(|s| s[c]).fold(1e-300, f64::max))
            .fold(0.0, f64::max);
        let theta = &after.coefficients[after.coefficients.len() - scored.candidate.columns.len()..];
        let family = &scored.candidate.family;
        let practical = self.problem.practical.of(family.physics, &family.joints);
        let beyond = |c: usize| {
            let told = scored.candidate.effect(c, theta);
            !told.is_empty() && rms(self.problem.nuisances[c].without(&told).into_iter()) >= practical[c]
        };
        let enough =
            !self.problem.practical.is_known() || (0..shares.len()).any(|c| shares[c] >= self.thresholds.share && beyond(c));
        let begins_or_ends = others.is_empty() && scored.candidate.edges() > 0;
        let small = amplitude < LEFT_OF_A_RIPPLE;
        let ripples: Vec<&Candidate> = others.iter().filter(|other| small && other.family.physics == RIPPLE).collect();
        let of_the_model = (begins_or_ends || !ripples.is_empty()) && {
            let effects: Vec<Vec<f64>> = (0..shares.len()).map(|c| scored.candidate.effect(c, theta)).collect();
            let left = [self.scorer.left(base, &before), self.scorer.left(&grams, &after)];
            begins_or_ends && {
                let explained = explained(&left, &effects, |c| self.problem.is_within_a_miss(c, &effects[c]).collect());
                explained.within > OF_THE_MODEL * explained.all
            } || ripples.into_iter().any(|ripple| {
                let explained = explained(&left, &effects, |c| shaken(self.problem, c, ripple));
                explained.within > explained.all * OF_A_RIPPLE.max(OFTENER * explained.rows)
            })
        };
        let share = shares.into_iter().fold(0.0, f64::max);
        let amplitude = if others.is_empty() { f64::INFINITY } else { amplitude };
        let resolved = |c: usize| own[c] > 0.0 && own[c] >= resolution(self.problem.cells[c].channel);
        let of_simulation = family.joints.first().map_or(0.0, |joint| self.problem.nominal.drives[*joint][2]);
        let possible = sized.pop().is_none_or(|fading| fades_within(fading, of_simulation, &sized));
        let enough = enough && possible && (0..own.len()).any(resolved);
        let completes = completes(&scored.candidate, others);
        Judged { gain, share, of_the_model, amplitude: if enough { amplitude } else { -1.0 }, completes }
    }

    /// Gain of a candidate over the others with the noise that it leaves itself (Cochrane-Orcutt): by its autoregression, or
    /// by the number of rows that count as one; whichever says more. Noise that an effect only seems to explain stays in
    /// what it leaves, and is whitened away.
    fn significance(&self, others: &[Candidate], candidate: &Candidate) -> Gain {
        let all = |scorer: &Scorer| {
            let base = scorer.grams(others);
            let with = scorer.extended(&base, &candidate.columns);
            (base, with)
        };
        let (_, with) = all(&self.scorer);
        let noise = self.noise_left(others, candidate, &self.scorer.fit(&with));
        let shown = candidate.blocks(self.problem);
        let edges = candidate.blocks_of_edges(self.problem);
        let with_noise = |noise: Vec<Noise>| {
            let mut scorer = Scorer::new(self.problem, noise);
            let (base, with) = all(&scorer);
            let (before, after) = (scorer.fit(&base), scorer.fit(&with));
            scorer.temper(&with, &after);
            let mut gain = scorer.gain_in(&before, &after, |b| shown[b]);
            if candidate.edges() > 0 {
                let between = scorer.gain_in(&before, &after, |b| shown[b] && !edges[b]);
                gain.error = gain.error.min(between.error);
                gain.explained = gain.explained.max(between.explained);
                gain.ranks = gain.ranks.max(between.ranks);
            }
            gain
        };
        let (of_window, left) = parallel::both(|| with_noise(window_noise(self.problem)), || with_noise(noise));
        if left.nats > of_window.nats { left } else { of_window }
    }

    /// Autoregression of what a set leaves, per cell.
    pub(super) fn noise_left(&self, others: &[Candidate], candidate: &Candidate, fit: &Fit) -> Vec<Noise> {
        let all: Vec<&Candidate> = others.iter().chain([candidate]).collect();
        noise_left(self.problem, &sized_in_a_row(all.iter().copied(), &fit.coefficients))
    }

    /// What a set leaves of each cell.
    pub(super) fn residuals(&self, all: &[&Candidate], fit: &Fit) -> Vec<Vec<f64>> {
        let sized = sized_in_a_row(all.iter().copied(), &fit.coefficients);
        (0..self.problem.cells.len()).map(|c| left_without(self.problem, c, &sized)).collect()
    }

    pub(super) fn accepts(&self, scored: &Scored, judged: &Judged) -> bool {
        let alone = judged.amplitude.is_infinite();
        // In a window it is met for as long as that lasts; a wall is met seldom all the same.
        let family = &scored.candidate.family;
        let seldom = SELDOM.contains(&family.physics) && (scored.candidate.edges() == 0 || family.form == WALL);
        let short = alone && scored.candidate.edges() > 0 && scored.candidate.columns.len() <= FEW && judged.gain.least > SURE;
        judged.gain.nats - price(&scored.candidate) >= self.thresholds.nats
            && judged.gain.least >= 0.5 * self.thresholds.nats
            && (is_met_often(&judged.gain) || seldom || short)
            && judged.amplitude >= 0.0
            && !judged.of_the_model
            && (alone || (judged.share >= self.thresholds.share && judged.amplitude >= self.least_amplitude(judged)))
    }

    /// Of the largest effect's amplitude, what a further one has to have.
    fn least_amplitude(&self, judged: &Judged) -> f64 {
        if judged.completes && judged.gain.least > SURE {
            return 0.0;
        }
        let everywhere = judged.gain.explained >= EVERYWHERE || (judged.share >= ALL && judged.gain.ranks >= IN_EACH);
        let surely = judged.share >= NEARLY_ALL && everywhere;
        if surely { LESS_THEN * self.thresholds.amplitude } else { self.thresholds.amplitude }
    }
}

/// Is it what goes with the speed where others have only what rubs dry at that joint and time, or the other way round? However small it is, it is no
/// error of theirs: in 93 opened cases of one of the two alone, up to thirty times the noise, the other would remove a tenth of what is left at most, and
/// mostly far more than a fourth where both are there (docs/decisions/0031).
fn completes(own: &Candidate, others: &[Candidate]) -> bool {
    let mut beside = others.iter().filter(|other| rub_together(own, other)).peekable();
    beside.peek().is_some() && beside.all(|other| are_parts(own, other))
}

/// Does an effect show in more than a block or two: in their gains, their ranks, or the squared error that each explains?
fn is_met_often(gain: &Gain) -> bool {
    gain.nats > SEEN_OFTEN * gain.error || gain.ranks > SEEN_OFTEN || is_uneven(gain)
}

/// Is an effect accepted for what each block explains, though its gain is that of a few?
pub(crate) fn is_uneven(gain: &Gain) -> bool {
    gain.nats <= SEEN_OFTEN * gain.error && gain.explained > EXPLAINED_OFTEN
}
