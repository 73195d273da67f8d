//! What is known only roughly of a model that no simulation has shown: its numbers within a lab's belief, or, learnt from a recording of
//! another day, its friction and zero points.

use arm::serial::{PARAMETERS, Workspace};

use crate::cell::Channel;
use crate::motion::Motion;
use crate::nominal::sign_series;
use crate::nuisance::Nuisance;
use crate::problem::Problem;
use crate::series::{range, rms};

impl Problem<'_> {
    /// The same, its model learnt from another recording of the robot, whose friction and zero points are not those of today.
    #[must_use]
    pub fn learnt_from_recording(mut self) -> Self {
        self.nuisances = drifting(&self);
        self.silence_nuisances();
        self = self.not_by_sample();
        self.from_recording = true;
        self
    }

    /// The same, its model believed but roughly: no simulation has shown what it stands for.
    #[must_use]
    pub fn believed_roughly(mut self) -> Self {
        self.nuisances = believed(&self);
        self.silence_nuisances();
        self
    }
}

/// Shares of a link's own numbers, and distances, within which a lab believes them.
const BELIEF: f64 = 0.3;
const BELIEF_M: f64 = 0.03;

/// Nuisances of every cell of a model that was not learnt from a simulation: inertia of links and rotors, constants.
fn believed(problem: &Problem) -> Vec<Nuisance> {
    let robot = problem.robot;
    let n = robot.joint_count();
    let links = PARAMETERS * n;
    let mut all = vec![Nuisance::default(); problem.cells.len()];
    let mut ws = Workspace::new(&robot.arm);
    let mut y = vec![0.0; n * links];
    for j in 0..n {
        let Some(c) = problem.cell(Channel::JointTorque, j) else { continue };
        let cell = &problem.cells[c];
        let mut columns = vec![vec![0.0; cell.rows.len()]; links];
        let (mut acceleration, mut torque) = (Vec::new(), Vec::new());
        for (row, &(r, i)) in cell.rows.iter().enumerate() {
            let motion = &problem.pairs[r].real;
            let state = motion.link(i);
            robot.arm.regressor(&mut ws, &state.position, &state.velocity, &state.acceleration, &mut y);
            for (k, column) in columns.iter_mut().enumerate() {
                column[row] = y[j * links + k];
            }
            acceleration.push(motion.drive_acceleration[j][i]);
            torque.push(motion.torque.as_ref().map_or(0.0, |t| t[j][i]));
        }
        let usual = rms(torque.into_iter());
        for (k, column) in columns.into_iter().enumerate() {
            let own = problem.nominal.inertial[k];
            let mass = problem.nominal.inertial[k / PARAMETERS * PARAMETERS];
            let spread = match k % PARAMETERS {
                0 => BELIEF * mass,
                1..=3 => BELIEF * own.abs() + BELIEF_M * mass,
                _ => own.abs() + 0.02 * mass,
            };
            all[c].push(column.into_iter().map(|x| spread * x).collect(), false);
        }
        let rotor = problem.nominal.drives[j][0];
        let inertia = if rotor > 0.0 { 0.5 * rotor } else { 0.1 * usual / rms(acceleration.iter().copied()).max(1e-12) };
        all[c].push(acceleration.into_iter().map(|a| inertia * a).collect(), false);
        all[c].push(vec![BELIEF * usual; cell.rows.len()], false);
    }
    // What measures the joints stands anew for every run.
    let runs = problem.pairs.len();
    for (c, cell) in problem.cells.iter().enumerate().filter(|(_, cell)| runs > 1 && cell.channel == Channel::Transmission) {
        let size = rms(cell.residual.iter().copied());
        for run in 0..runs {
            let mean = 1.0 / runs as f64;
            let of = |&(r, _): &(usize, usize)| size * (f64::from(u8::from(r == run)) - mean);
            all[c].push(cell.rows.iter().map(of).collect(), true);
        }
    }
    all
}

/// Shares of what was learnt by which friction, rotor and zero point of a drive differ from one day to the next.
const FRICTION_DRIFT: f64 = 0.4;
/// The same, of the usual torque.
const FRICTION_SHARE: f64 = 0.15;
const ZERO_DRIFT: f64 = 0.15;
/// The same of a drive's inertia, of all that it moves.
const INERTIA_DRIFT: f64 = 0.1;

/// Travel over which dry friction may turn round, shares of a joint's travel.
const TURNING: [f64; 3] = [0.003, 0.012, 0.05];

/// Sign of the motion that turns round over a share of the travel, smoothed.
fn turning(motion: &Motion, j: usize, share: f64) -> Vec<f64> {
    let (low, high) = range(motion.position[j].iter().copied());
    motion.window.apply(&motion.bristle(j, false, (share * (high - low)).max(1e-12), 0.0), 0)
}

/// Nuisances of every cell of a model that was learnt from another recording: friction, constants.
fn drifting(problem: &Problem) -> Vec<Nuisance> {
    let mut all = vec![Nuisance::default(); problem.cells.len()];
    for j in 0..problem.robot.joint_count() {
        let Some(c) = problem.cell(Channel::JointTorque, j) else { continue };
        let cell = &problem.cells[c];
        let [_, viscous, coulomb, _] = problem.nominal.drives[j];
        let signs: Vec<Vec<f64>> = problem.pairs.iter().map(|pair| sign_series(&pair.real, j)).collect();
        let usual = problem.nominal.usual_torque[j];
        let dry = (FRICTION_DRIFT * coulomb).max(FRICTION_SHARE * usual);
        all[c].push(cell.rows.iter().map(|&(r, i)| dry * signs[r][i]).collect(), false);
        for share in TURNING {
            let turned: Vec<Vec<f64>> = problem.pairs.iter().map(|pair| turning(&pair.real, j, share)).collect();
            all[c].push(cell.rows.iter().map(|&(r, i)| dry * turned[r][i]).collect(), false);
        }
        let velocity: Vec<f64> = cell.rows.iter().map(|&(r, i)| problem.pairs[r].real.drive_velocity[j][i]).collect();
        let wet = (FRICTION_DRIFT * viscous).max(FRICTION_SHARE * usual / rms(velocity.iter().copied()).max(1e-12));
        all[c].push(velocity.into_iter().map(|v| wet * v).collect(), false);
        all[c].push(vec![ZERO_DRIFT * usual; cell.rows.len()], false);
        // An elastic drive at another pace seems to have another inertia.
        let acceleration: Vec<f64> = cell.rows.iter().map(|&(r, i)| problem.pairs[r].real.drive_acceleration[j][i]).collect();
        let inertia = INERTIA_DRIFT * usual / rms(acceleration.iter().copied()).max(1e-12);
        all[c].push(acceleration.into_iter().map(|a| inertia * a).collect(), false);
    }
    all
}
