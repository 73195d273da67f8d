//! How a simulator's friction turns round with the motion: over which speed or travel, and how large it then is.

use crate::hypothesis::geometric;
use crate::linear::least_squares;
use crate::motion::Motion;
use crate::nominal::{Evaluator, Nominal, sign_series};
use crate::pair::held;
use crate::robot::Robot;
use crate::series::{resolution, rms, robust_deviation};

/// How the sign of a drive's dry friction turns round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// As steep as its noise allows.
    Steep,
    /// Over a speed, rad/s or m/s.
    Speed(f64),
    /// Over a travel (rad or m) of bristles, with the time in which their vibration settles, s.
    Travel(f64, f64),
}

/// Speeds that are tried, in units of the RMS speed, and travels, in what that covers in a second: from, to, how many.
const WIDTHS: (f64, f64, usize) = (1e-3, 0.3, 18);
/// Times in which bristles settle, s.
const SETTLING_S: [f64; 2] = [0.0, 0.004];
/// Halvings of the step between two speeds or travels.
const HALVINGS: usize = 4;
/// A drive stands that moves by less than so many counts of its encoder, or standard deviations of its noise, in a time, s.
const STANDS: f64 = 3.0;
const STANDS_S: f64 = 0.1;
/// How far a sign may be off of which nothing is known.
const UNKNOWN: f64 = 2.0;
/// Share of what the steepest sign leaves that another one has to leave less than, and that of one drive at least.
const LEAVES: f64 = 0.7;
const NEEDED: f64 = 0.3;

impl Turn {
    /// Smoothed sign of a drive's dry friction along a run.
    pub(crate) fn along(self, run: &Motion, drive: usize) -> Vec<f64> {
        match self {
            Self::Steep => sign_series(run, drive),
            Self::Speed(width) => {
                let raw: Vec<f64> = run.quick_velocity[drive].iter().map(|v| (v / width).tanh()).collect();
                run.window.apply(&raw, 0)
            }
            Self::Travel(travel, settling_s) => run.window.apply(&run.bent(&run.drive_velocity[drive], travel, settling_s), 0),
        }
    }

    /// The samples at which the friction of a drive is not known to a share of it: where it is held; where it stands, as far as the counts of its encoder
    /// tell; and until its bristles have forgotten that.
    ///
    /// A controller lets a drive that stands tremble within a count, which relaxes its bristles as far as nobody sees.
    pub(crate) fn unknown(self, run: &Motion, drive: usize, share: f64) -> Vec<bool> {
        let mut unknown = held(run, drive);
        let (position, dt) = (&run.run.drive[drive], run.run.dt_s);
        let last = position.len().saturating_sub(1);
        let (ahead, margin) = (((0.5 * STANDS_S / dt) as usize).max(1), run.window.margin() / 2);
        let least = STANDS * known_to(position);
        let stands = |i: usize| (position[(i + ahead).min(last)] - position[i.saturating_sub(ahead)]).abs() < least;
        let mut not_known = 0.0;
        for i in 0..position.len() {
            not_known = match self {
                Self::Steep => break,
                Self::Speed(width) if stands(i) => least / STANDS_S / width,
                Self::Speed(_) => 0.0,
                Self::Travel(..) if i == 0 || stands(i) => UNKNOWN,
                Self::Travel(travel, _) => not_known * (-run.drive_velocity[drive][i].abs() * dt / travel).exp(),
            };
            if not_known > share {
                unknown[i.saturating_sub(margin)..=(i + margin).min(last)].fill(true);
            }
        }
        unknown
    }

    /// The turn of each drive that leaves least of the simulator's own torques, if one of them leaves far less than the steepest sign does: an arm that
    /// mostly stands creeps, and there the steepest sign is wrong by as much as there is friction, which then passes for other loads.
    pub(crate) fn learn(robot: &Robot, nominal: &Nominal, sims: &[&Motion]) -> Vec<Self> {
        let of_drive = |j: usize| {
            let drive = Drive::new(robot, nominal, sims, j)?;
            let widths = drive.widths();
            let travels = widths.iter().flat_map(|travel| SETTLING_S.map(|settling_s| Self::Travel(*travel, settling_s)));
            let tried = widths.iter().map(|speed| Self::Speed(*speed)).chain(travels).map(|turn| (drive.tried(turn).0, turn));
            let (left, best) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
            let share = left / drive.tried(Self::Steep).0;
            (share < LEAVES).then(|| (share, drive.refined((left, best))))
        };
        let learnt = crate::parallel::map(0..robot.joint_count(), of_drive);
        let is_needed = learnt.iter().flatten().any(|(share, _)| *share < NEEDED);
        learnt.into_iter().map(|of| of.filter(|_| is_needed).map_or(Self::Steep, |(_, turn)| turn)).collect()
    }
}

/// What the friction of a drive has to explain of the torques of simulations.
struct Drive<'m> {
    joint: usize,
    sims: Vec<&'m Motion>,
    left: Vec<f64>,
    speed: Vec<f64>,
}

impl<'m> Drive<'m> {
    /// None of a drive that has no dry friction, or without torques.
    fn new(robot: &Robot, nominal: &Nominal, sims: &[&'m Motion], joint: usize) -> Option<Self> {
        let sims: Vec<&Motion> = sims.iter().copied().filter(|sim| sim.torque.is_some()).collect();
        if sims.is_empty() || nominal.drives[joint][2] <= 0.0 {
            return None;
        }
        let coupling = robot.coupling();
        let mut evaluator = Evaluator::new(robot, nominal);
        let (mut left, mut speed) = (Vec::new(), Vec::new());
        for sim in &sims {
            let torque = &sim.torque.as_ref().expect("filtered")[joint];
            let signs: Vec<(f64, Vec<f64>)> = (0..robot.joint_count())
                .filter(|d| *d != joint && coupling[(*d, joint)] != 0.0)
                .map(|d| (coupling[(d, joint)] * nominal.drives[d][2], nominal.dry_sign(sim, d)))
                .collect();
            for &i in &sim.rows {
                let others: f64 = signs.iter().map(|(size, sign)| size * sign[i]).sum();
                left.push(torque[i] - evaluator.load(sim, i).motor[joint] - others);
                speed.push(sim.drive_velocity[joint][i]);
            }
        }
        Some(Self { joint, sims, left, speed })
    }

    /// Speeds to try, or travels.
    fn widths(&self) -> Vec<f64> {
        let usual = rms(self.sims.iter().flat_map(|sim| sim.quick_velocity[self.joint].iter().copied()));
        let (from, to, count) = WIDTHS;
        geometric(from * usual, to * usual, count)
    }

    /// The best turn between those that were tried, of its kind.
    fn refined(&self, (mut least, mut best): (f64, Turn)) -> Turn {
        let (from, to, count) = WIDTHS;
        let mut step = (to / from).powf(1.0 / (count - 1) as f64);
        for _ in 0..HALVINGS {
            step = step.sqrt();
            for times in [step, 1.0 / step] {
                let turn = match best {
                    Turn::Steep => best,
                    Turn::Speed(width) => Turn::Speed(times * width),
                    Turn::Travel(travel, settling_s) => Turn::Travel(times * travel, settling_s),
                };
                let (misfit, _) = self.tried(turn);
                if misfit < least {
                    (least, best) = (misfit, turn);
                }
            }
        }
        best
    }

    /// What a turn leaves, RMS, with its dry friction and what is to be added to the viscous one.
    fn tried(&self, turn: Turn) -> (f64, [f64; 2]) {
        let of_run = |sim: &&Motion| {
            let all = turn.along(sim, self.joint);
            sim.rows.iter().map(|&i| all[i]).collect::<Vec<f64>>()
        };
        let sign: Vec<f64> = self.sims.iter().flat_map(of_run).collect();
        let theta = least_squares(&[&sign, &self.speed], &self.left);
        let misfit = rms((0..self.left.len()).map(|k| self.left[k] - theta[0] * sign[k] - theta[1] * self.speed[k]));
        (misfit, [theta[0], theta[1]])
    }
}

/// Friction of one drive, joint units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Turning {
    /// N·m·s/rad or N·s/m.
    pub(crate) viscous: f64,
    /// N·m or N.
    pub(crate) coulomb: f64,
    /// Speed over which the sign turns, rad/s or m/s; none where nothing was learnt.
    pub(crate) width: Option<f64>,
}

impl Turning {
    /// The width at which the simulator's own torques are met best, with the friction that goes with it. The nominal model's
    /// sign may be as steep as its sensors allow, which is the same in recording and simulation; a simulation needs its own.
    pub(crate) fn learn(robot: &Robot, nominal: &Nominal, sims: &[&Motion]) -> Vec<Self> {
        let of_drive = |j: usize| {
            let [_, viscous, coulomb, _] = nominal.drives[j];
            let rough = Self { viscous, coulomb, width: None };
            let Some(drive) = Drive::new(robot, nominal, sims, j) else { return rough };
            let tried = drive.widths().into_iter().map(|width| {
                let (misfit, [coulomb, more]) = drive.tried(Turn::Speed(width));
                (misfit, Self { viscous: viscous + more, coulomb, width: Some(width) })
            });
            let best = tried.filter(|(_, turning)| turning.coulomb > 0.0).min_by(|a, b| a.0.total_cmp(&b.0));
            best.map_or(rough, |(_, best)| best)
        };
        (0..robot.joint_count()).map(of_drive).collect()
    }
}

/// What a position is known by: its least step, or its noise if that is more.
fn known_to(position: &[f64]) -> f64 {
    let noise = robust_deviation(position.windows(3).map(|x| x[0] - 2.0 * x[1] + x[2])) / 6.0_f64.sqrt();
    let step = resolution(position);
    if step.is_finite() { step.max(noise) } else { noise }
}

#[cfg(test)]
mod tests {
    use super::{Turn, known_to};
    use crate::motion::{Band, Motion};
    use crate::run::Run;

    /// Goes for a second, 0.05 rad/s, stands for one, goes on; read in counts of 20 µrad.
    fn goes_and_stands() -> Motion {
        let way = |i: i32| 0.05e-3 * f64::from(i.min(1000) + (i - 2000).max(0));
        let series: Vec<f64> = (0..3000).map(|i| (way(i) / 2e-5).round() * 2e-5).collect();
        Motion::new(Run::of_one_joint(&series), Band::SLOW)
    }

    #[test]
    fn friction_is_not_known_where_a_drive_stands_and_until_its_bristles_have_forgotten_that() {
        let motion = goes_and_stands();
        // 4e-4 rad at 0.05 rad/s is 8 ms; a hundredth of 2 is left after 4.6 times that.
        let unknown = Turn::Travel(4e-4, 0.0).unknown(&motion, 0, 0.02);
        assert!(unknown[1050..2000].iter().all(|u| *u), "stands");
        let known_from = 2000 + unknown[2000..].iter().position(|u| !u).expect("goes on");
        assert!((2040..2150).contains(&known_from), "{known_from}");
        assert!(unknown[known_from..2900].iter().all(|u| !u) && unknown[200..900].iter().all(|u| !u), "moves");
        // Ten times the travel takes ten times as long.
        let far = Turn::Travel(4e-3, 0.0).unknown(&motion, 0, 0.02);
        assert!(far[2000..2380].iter().all(|u| *u) && !far[2600]);
    }

    #[test]
    fn friction_that_turns_over_a_speed_is_known_at_once_and_where_that_is_large() {
        let motion = goes_and_stands();
        // 60 µrad in 0.1 s: a share of 0.15 of 4 mrad/s.
        let (rough, fine) = (Turn::Speed(4e-3).unknown(&motion, 0, 0.2), Turn::Speed(4e-3).unknown(&motion, 0, 0.1));
        assert!(fine[1100..1900].iter().all(|u| *u) && !fine[2150]);
        assert_eq!(rough, Turn::Steep.unknown(&motion, 0, 0.0), "only where it is held");
    }

    #[test]
    fn a_position_is_known_to_its_counts_or_to_its_noise() {
        let counts: Vec<f64> = (0..500).map(|i| (f64::from(i) * 0.013).floor() * 0.1).collect();
        assert!((known_to(&counts) - 0.1).abs() < 1e-12);
        // Uniform noise of a standard deviation of 0.29 behind digits.
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 * 1e4).round() / 1e4
        };
        let noisy: Vec<f64> = (0..5000).map(|_| noise()).collect();
        assert!((known_to(&noisy) - 0.29).abs() < 0.06, "{}", known_to(&noisy));
        assert_eq!(known_to(&[1.0, 1.0, 1.0]), 0.0);
    }
}
