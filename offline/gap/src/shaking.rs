//! What cables bear beyond the nominal model, from a simulation's own deflections. Elastic joints shake each other after a fast motion: their links
//! accelerate in ways that no motor shows, so that the nominal model, which has its accelerations from the motors, says neither what their torques
//! are nor what their cables bear.

use crate::motion::Motion;
use crate::nominal::{Load, Nominal};
use crate::pair::{Pair, held};
use crate::robot::Robot;
use crate::series::{resolution, rms, robust_deviation};

/// Times its usual size above which the nominal model does not hold for the simulation,
const BEYOND: f64 = 10.0;
/// and for how long before and after, s.
const MARGIN_S: f64 = 0.06;
/// Moving rows below which nobody knows what is usual.
const ENOUGH: usize = 20;
/// Noise of a simulation's deflection, as a share of it, up to which it says what its cable bears wherever it is: what remembers its load counts
/// every turn of it, and noise turns with each row.
const QUIET: f64 = 0.01;
/// Share of its deflection that the nominal model may usually miss then: what misses more has other reasons than its load.
const OTHERWISE: f64 = 0.1;

/// Where the joints of a simulation shake each other.
#[derive(Debug, Clone, Default)]
pub struct Shaking {
    /// What the cable of each drive bears beyond its nominal load at each row, N·m or N: 0 where nobody knows better. Empty where recording or
    /// simulation have no encoders at the joints.
    borne: Vec<Vec<f64>>,
    /// Rows at which some cable shakes.
    somewhere: Vec<bool>,
}

impl Shaking {
    /// Of a simulation whose nominal loads are these. The recording has to show that its joints give way as well.
    pub fn new(robot: &Robot, nominal: &Nominal, pair: &Pair, loads: Option<&[Load]>) -> Self {
        let (Some(sim), Some(loads), Some(_)) = (&pair.sim, loads, &pair.real.deflection) else { return Self::default() };
        let Some(seen) = &sim.deflection else { return Self::default() };
        let raw = sim.raw_deflection().unwrap_or_default();
        let (coupling, shares) = (robot.coupling(), robot.strain_shares());
        let n = robot.joint_count();
        let mut somewhere = vec![false; pair.real.rows.len()];
        let of_drive = |drive: usize| -> Vec<f64> {
            let compliance = nominal.compliance[drive][0];
            if compliance <= 0.0 {
                return vec![0.0; pair.real.rows.len()];
            }
            let strain =
                |deflection: &[Vec<f64>], i: usize| -> f64 { (0..n).map(|j| coupling[(drive, j)] * deflection[j][i]).sum() };
            let strained: Vec<f64> = loads.iter().map(|load| nominal.strain(&shares, drive, &load.link)).collect();
            let missed = |(&i, strained): (&usize, &f64)| -> f64 {
                strain(seen, i) - nominal.late_s[drive] * sim.drive_velocity[drive][i] - strained
            };
            let missed: Vec<f64> = pair.real.rows.iter().zip(&strained).map(missed).collect();
            let shaken = far_off(&missed, pair, sim, drive, 0.0);
            somewhere.iter_mut().zip(&shaken).for_each(|(some, own)| *some |= own);
            let usually = robust_deviation(missed.iter().copied());
            let whole: Vec<f64> = (0..raw.first().map_or(0, Vec::len)).map(|i| strain(&raw, i)).collect();
            let is_its_load = usually <= OTHERWISE * rms(strained.iter().copied()) && is_quiet(&whole);
            missed
                .iter()
                .zip(shaken)
                .map(|(missed, shaken)| if shaken || is_its_load { missed / compliance } else { 0.0 })
                .collect()
        };
        let borne = (0..n).map(of_drive).collect();
        Self { borne, somewhere }
    }

    /// What the cable of a drive bears beyond its nominal load at a row, N·m or N.
    pub fn borne(&self, drive: usize, row: usize) -> f64 {
        self.borne.get(drive).map_or(0.0, |rows| rows[row])
    }

    /// The rows at which the torque of a joint says nothing, from what the model misses of the simulation's and from the noise of the residual:
    /// what the model says of the recording there is no better.
    pub fn rows<'s>(&'s self, missed: &[f64], pair: &Pair, joint: usize, noise: f64) -> impl Iterator<Item = usize> + use<'s> {
        let shaken = pair.sim.as_ref().map_or_else(Vec::new, |sim| far_off(missed, pair, sim, joint, noise));
        self.somewhere.iter().zip(shaken).enumerate().filter(|(_, (some, own))| **some && *own).map(|(row, _)| row)
    }
}

/// Is the noise of a series small beside it? Fourth differences hold little else; of the steps in which a slow one is printed they hold little.
fn is_quiet(series: &[f64]) -> bool {
    let differences = series.windows(5).map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]);
    // Of white noise they are larger by the root of 1 + 16 + 36 + 16 + 1.
    let scatter = rms(differences) / 70.0_f64.sqrt();
    let step = resolution(series);
    let printed = if step.is_finite() { step / 12.0_f64.sqrt() } else { 0.0 };
    scatter.max(printed) <= QUIET * rms(series.iter().copied())
}

/// Rows at which something is missed by far more than usually where the drive moves, and than `least`, with a margin; of a drive that is held
/// nothing is asked.
fn far_off(missed: &[f64], pair: &Pair, sim: &Motion, drive: usize, least: f64) -> Vec<bool> {
    let rows = &pair.real.rows;
    let held = held(sim, drive);
    let held: Vec<bool> = rows.iter().map(|i| held[*i]).collect();
    let margin = (MARGIN_S / pair.real.run.dt_s).round() as usize;
    marked(missed, &held, least, |k, other| rows[k].abs_diff(rows[other]) <= margin)
}

fn marked(missed: &[f64], held: &[bool], least: f64, near: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let moving: Vec<f64> = missed.iter().zip(held).filter(|(_, held)| !**held).map(|(missed, _)| *missed).collect();
    let mut marked = vec![false; missed.len()];
    if moving.len() < ENOUGH {
        return marked;
    }
    let limit = BEYOND * robust_deviation(moving.into_iter()).max(least);
    for k in (0..missed.len()).filter(|k| !held[*k] && missed[*k].abs() > limit) {
        let (before, after) = ((0..=k).rev(), k..missed.len());
        before.take_while(|other| near(k, *other)).for_each(|other| marked[other] = true);
        after.take_while(|other| near(k, *other)).for_each(|other| marked[other] = true);
    }
    marked
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small misses in turn, with a large one at a row.
    fn missed(count: usize, at: usize) -> Vec<f64> {
        (0..count).map(|k| if k == at { -30.0 } else { [1.0, -1.0][k % 2] }).collect()
    }

    fn rows(marked: &[bool]) -> Vec<usize> {
        (0..marked.len()).filter(|k| marked[*k]).collect()
    }

    #[test]
    fn noise_is_told_from_what_shakes() {
        // At 1 kHz, about a constant, with or without the steps of a sensor: at 10 Hz they differ from row to row, at 0.2 Hz they seldom do.
        let shakes = |hz: f64, i: u32| 2.0 + (0.001 * f64::from(i) * hz * std::f64::consts::TAU).sin();
        let sensed = |hz: f64, step: f64| (0..10_000).map(|i| (shakes(hz, i) / step).round() * step).collect::<Vec<f64>>();
        for hz in [10.0, 0.2] {
            assert!(is_quiet(&sensed(hz, 1e-6)), "{hz} Hz");
            assert!(!is_quiet(&sensed(hz, 0.1)), "{hz} Hz");
        }
        assert!(is_quiet(&[]));
    }

    #[test]
    fn rows_far_off_are_marked_with_a_margin_that_ends_at_a_hole() {
        let near = |k: usize, other: usize| k.abs_diff(other) <= 2;
        let moving = vec![false; 50];
        assert_eq!(rows(&marked(&missed(50, 20), &moving, 0.0, near)), [18, 19, 20, 21, 22]);
        assert_eq!(rows(&marked(&missed(50, 0), &moving, 0.0, near)), [0, 1, 2]);
        assert_eq!(rows(&marked(&missed(50, 49), &moving, 0.0, near)), [47, 48, 49]);
        let before_hole = |k: usize, other: usize| near(k, other) && (k < 21) == (other < 21);
        assert_eq!(rows(&marked(&missed(50, 20), &moving, 0.0, before_hole)), [18, 19, 20]);
        // Ten times the noise is more than that.
        assert!(rows(&marked(&missed(50, 20), &moving, 4.0, near)).is_empty());
    }

    #[test]
    fn a_drive_that_is_held_and_a_few_rows_say_nothing_of_what_is_usual() {
        let near = |k: usize, other: usize| k == other;
        assert!(rows(&marked(&missed(50, 20), &[true; 50], 0.0, near)).is_empty());
        assert!(rows(&marked(&missed(ENOUGH - 1, 5), &[false; ENOUGH - 1], 0.0, near)).is_empty());
        assert!(rows(&marked(&[], &[], 0.0, near)).is_empty());
        // It rests most of the time, and misses nothing there: moving is not shaking.
        let rests: Vec<f64> = (0..200).map(|k| if k < 150 { 0.0 } else { [1.0, -1.0][k % 2] }).collect();
        let held: Vec<bool> = (0..200).map(|k| k < 150).collect();
        assert!(rows(&marked(&rests, &held, 0.0, near)).is_empty());
        assert_eq!(rows(&marked(&rests, &[false; 200], 0.0, near)).len(), 50);
    }
}
