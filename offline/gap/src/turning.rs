//! How a simulator's friction turns round with the motion: over which speed, and how large it then is.

use crate::linear::least_squares;
use crate::motion::Motion;
use crate::nominal::{Evaluator, Nominal, sign_series};
use crate::robot::Robot;
use crate::series::rms;

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

/// Widths that are tried, shares of the RMS speed: from, to, how many.
const WIDTHS: (f64, f64, usize) = (1e-3, 0.3, 18);

impl Turning {
    /// The width at which the simulator's own torques are met best, with the friction that goes with it. The nominal model's
    /// sign is as steep as its sensors allow, which is the same in recording and simulation; a simulation needs its own.
    pub(crate) fn learn(robot: &Robot, nominal: &Nominal, sims: &[&Motion]) -> Vec<Self> {
        (0..robot.joint_count()).map(|j| Self::of_drive(robot, nominal, sims, j)).collect()
    }

    fn of_drive(robot: &Robot, nominal: &Nominal, sims: &[&Motion], j: usize) -> Self {
        let [_, viscous, coulomb, _] = nominal.drives[j];
        let rough = Self { viscous, coulomb, width: None };
        let sims: Vec<&&Motion> = sims.iter().filter(|sim| sim.torque.is_some()).collect();
        if sims.is_empty() || coulomb <= 0.0 {
            return rough;
        }
        let coupling = robot.coupling();
        let mut evaluator = Evaluator::new(robot, nominal);
        let (mut left, mut speed) = (Vec::new(), Vec::new());
        for sim in &sims {
            let torque = &sim.torque.as_ref().expect("filtered")[j];
            let signs: Vec<(f64, Vec<f64>)> = (0..robot.joint_count())
                .map(|d| (if d == j { 0.0 } else { coupling[(d, j)] * nominal.drives[d][2] }, sign_series(sim, d)))
                .collect();
            for &i in &sim.rows {
                let others: f64 = signs.iter().map(|(size, sign)| size * sign[i]).sum();
                left.push(torque[i] - evaluator.load(sim, i).motor[j] - others);
                speed.push(sim.drive_velocity[j][i]);
            }
        }
        let usual = rms(sims.iter().flat_map(|sim| sim.quick_velocity[j].iter().copied()));
        let (from, to, count) = WIDTHS;
        let tried = crate::hypothesis::geometric(from * usual, to * usual, count).into_iter().map(|width| {
            let sign: Vec<f64> = sims
                .iter()
                .flat_map(|sim| {
                    let raw: Vec<f64> = sim.quick_velocity[j].iter().map(|v| (v / width).tanh()).collect();
                    let smooth = sim.window.apply(&raw, 0);
                    sim.rows.iter().map(|&i| smooth[i]).collect::<Vec<_>>()
                })
                .collect();
            let theta = least_squares(&[&sign, &speed], &left);
            let misfit = rms((0..left.len()).map(|k| left[k] - theta[0] * sign[k] - theta[1] * speed[k]));
            (misfit, Self { viscous: viscous + theta[1], coulomb: theta[0], width: Some(width) })
        });
        tried.filter(|(_, turning)| turning.coulomb > 0.0).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(rough, |(_, best)| best)
    }
}
