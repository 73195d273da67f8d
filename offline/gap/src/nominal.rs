//! What the simulator believes: inverse dynamics and deflection, learnt from its own output where it is a black box.

use std::borrow::Borrow;

use arm::serial::{PARAMETERS, Workspace};
use nalgebra::{DMatrix, DVector};
use simulator::physics::smooth_sign;

use crate::linear::{dot, least_squares, solve};
use crate::motion::{Motion, State};
use crate::robot::Robot;
use crate::series::rms;
use crate::turning::Turn;

/// Columns per joint beside the links' parameters: rotor inertia, viscous, Coulomb, constant.
const DRIVE_COLUMNS: usize = 4;

/// Rounds between torque and deflection.
const ROUNDS: usize = 2;
/// Powers of a joint's own position with which springs and cables may pull.
const SPRINGS: usize = 3;

/// A nominal model.
#[derive(Debug, Clone)]
pub struct Nominal {
    /// The links' ten parameters each, as [`arm::serial::SerialArm::parameters`] orders them.
    pub inertial: Vec<f64>,
    /// Per joint: rotor inertia, viscous, Coulomb, constant, at the joint.
    pub drives: Vec<[f64; DRIVE_COLUMNS]>,
    /// Per drive, how its dry friction turns round.
    pub turns: Vec<Turn>,
    /// Per drive, in units of its joint: compliance of its cable (rad per N·m or m per N), and a constant.
    pub compliance: Vec<[f64; 2]>,
    /// Per joint: friction behind the cable, viscous and dry, which loads the cable beside the link.
    pub link_friction: Vec<[f64; 2]>,
    /// Speed over which the sign of that turns, rad/s or m/s; none: as steep as its noise allows.
    pub link_sign_width: Vec<Option<f64>>,
    /// Per drive, s: by how much its sensor and that of the joint come apart in time, as a share of the velocity in the deflection.
    pub late_s: Vec<f64>,
    /// Per joint: what springs and cables pull with the first, second and third power of its position. All 0 but where the
    /// model was learnt from a recording.
    pub springs: Vec<[f64; SPRINGS]>,
    /// RMS of the torque of the runs that it was learnt from, per joint; 0 where nothing was learnt.
    pub usual_torque: Vec<f64>,
    /// RMS of what the model leaves of the simulation's own torque, per joint; 0 where nothing was learnt.
    pub torque_error: Vec<f64>,
}

/// Torques at one row.
#[derive(Debug, Clone)]
pub struct Load {
    /// What the links ask of the cable, N·m or N.
    pub link: Vec<f64>,
    /// What the motor has to give, at the joint, N·m or N.
    pub motor: Vec<f64>,
}

impl Nominal {
    /// The robot's own numbers.
    pub fn of(robot: &Robot) -> Self {
        let n = robot.joint_count();
        let mut inertial = vec![0.0; PARAMETERS * n];
        robot.arm.parameters(&mut inertial);
        let known = |x: f64| if x.is_finite() { x } else { 0.0 };
        Self {
            inertial,
            drives: robot.drives.iter().map(|d| [known(d.rotor_inertia), d.viscous, d.coulomb, 0.0]).collect(),
            turns: vec![Turn::Steep; n],
            compliance: robot.drives.iter().map(|d| [1.0 / d.stiffness, 0.0]).collect(),
            link_friction: vec![[0.0; 2]; n],
            link_sign_width: vec![None; n],
            late_s: vec![0.0; n],
            springs: vec![[0.0; SPRINGS]; n],
            usual_torque: vec![0.0; n],
            torque_error: vec![0.0; n],
        }
    }

    /// Learns from the simulator's own runs what its recorded torque and deflection follow, starting from the robot's numbers.
    ///
    /// Torque alone does not tell the cable's load where friction is many times larger (a light tool on a stiff drive); the
    /// simulator's own deflection does, so both are fitted together, the compliance first from the robot's own weights.
    pub fn learn(robot: &Robot, runs: &[impl Borrow<Motion>]) -> Self {
        Self::learn_with(robot, runs, false)
    }

    /// The same, of a robot that may have springs and cables which no simulator has.
    pub fn learn_with(robot: &Robot, runs: &[impl Borrow<Motion>], springs: bool) -> Self {
        let runs: &[&Motion] = &runs.iter().map(Borrow::borrow).collect::<Vec<_>>();
        let mut nominal = Self::of(robot);
        for _ in 0..ROUNDS {
            nominal.learn_deflection(robot, runs);
            nominal.learn_torque(robot, runs, springs);
            // Noise of a recording passes for a law by which friction turns round.
            let turns = if springs { nominal.turns.clone() } else { Turn::learn(robot, &nominal, runs) };
            if turns != nominal.turns {
                nominal.turns = turns;
                nominal.learn_torque(robot, runs, springs);
            }
        }
        nominal.learn_deflection(robot, runs);
        nominal
    }

    fn learn_torque(&mut self, robot: &Robot, runs: &[&Motion], springs: bool) {
        let n = robot.joint_count();
        let (links, sprung) = (PARAMETERS * n, (PARAMETERS + DRIVE_COLUMNS) * n);
        let width = sprung + if springs { SPRINGS * n } else { 0 };
        let rows: usize = runs.iter().filter(|run| run.torque.is_some()).map(|run| run.rows.len()).sum();
        if rows < 4 * width {
            return;
        }
        let start = Self::of(robot);
        let coupling = robot.coupling();
        let mut gram = DMatrix::zeros(width, width);
        let mut right = DVector::zeros(width);
        let mut ws = Workspace::new(&robot.arm);
        let mut y = vec![0.0; n * links];
        // Rows in units of what the model will leave: a few percent of the torque, noise of the deflection.
        let torque_scale: Vec<f64> = (0..n)
            .map(|j| {
                0.05 * rms(runs
                    .iter()
                    .filter_map(|run| run.torque.as_ref().map(|t| (run, t)))
                    .flat_map(|(run, t)| run.rows.iter().map(move |&i| t[j][i])))
            })
            .collect();
        let deflection_scale: Vec<f64> = (0..n)
            .map(|j| {
                0.1 * rms(runs
                    .iter()
                    .filter_map(|run| run.deflection.as_ref().map(|d| (run, d)))
                    .flat_map(|(run, d)| run.rows.iter().map(move |&i| d[j][i])))
            })
            .collect();
        let mut row = vec![0.0; width];
        for run in runs {
            let Some(torque) = &run.torque else { continue };
            let signs: Vec<Vec<f64>> = (0..n).map(|j| self.dry_sign(run, j)).collect();
            let shares = robot.strain_shares();
            for &i in &run.rows {
                let state = run.link(i);
                robot.arm.regressor(&mut ws, &state.position, &state.velocity, &state.acceleration, &mut y);
                for j in 0..n {
                    let compliance = self.compliance[j][0];
                    if let Some(deflection) = &run.deflection
                        && compliance > 0.0
                    {
                        // What loads the drive's cable, and how far it gives way.
                        row.fill(0.0);
                        let (mut strain, mut rubbing) = (-self.late_s[j] * run.drive_velocity[j][i], 0.0);
                        for k in 0..n {
                            strain += coupling[(j, k)] * deflection[k][i];
                            rubbing += shares[(k, j)] * self.rubbing(run, k, i);
                            row.iter_mut().zip(&y[k * links..(k + 1) * links]).for_each(|(x, y)| *x += shares[(k, j)] * y);
                        }
                        let weight = compliance / deflection_scale[j].max(1e-12);
                        add(&mut gram, &mut right, &row[..links], strain / compliance - rubbing, weight);
                    }
                    row.fill(0.0);
                    row[..links].copy_from_slice(&y[j * links..(j + 1) * links]);
                    for d in (0..n).filter(|d| coupling[(*d, j)] != 0.0) {
                        let drive = [run.drive_acceleration[d][i], run.drive_velocity[d][i], signs[d][i], 1.0];
                        let carried = drive.map(|x| coupling[(d, j)] * x);
                        row[links + DRIVE_COLUMNS * d..][..DRIVE_COLUMNS].copy_from_slice(&carried);
                    }
                    if springs {
                        row[sprung + SPRINGS * j..][..SPRINGS].copy_from_slice(&powers(state.position[j]));
                    }
                    add(&mut gram, &mut right, &row, torque[j][i], 1.0 / torque_scale[j].max(1e-12));
                }
            }
        }
        // What a lab believes of its own links: a mass within a third, a centre within a few centimetres. Rows stand close,
        // so they count for a tenth.
        let mut prior = vec![0.0; width];
        for link in 0..n {
            let own = &start.inertial[PARAMETERS * link..PARAMETERS * (link + 1)];
            for k in 0..PARAMETERS {
                let spread = match k {
                    0 => 0.3 * own[0],
                    1..=3 => 0.3 * own[k].abs() + 0.03 * own[0],
                    _ => own[k].abs() + 0.02 * own[0],
                };
                prior[PARAMETERS * link + k] = own[k];
                gram[(PARAMETERS * link + k, PARAMETERS * link + k)] += 10.0 / spread.max(1e-4).powi(2);
                right[PARAMETERS * link + k] += 10.0 * own[k] / spread.max(1e-4).powi(2);
            }
        }
        for place in links..sprung {
            gram[(place, place)] *= 1.0 + 1e-9;
        }
        // Small powers pass for each other.
        for place in sprung..width {
            gram[(place, place)] *= 1.0 + 1e-4;
        }
        solve(&mut gram, &mut right);
        self.inertial.copy_from_slice(&right.as_slice()[..links]);
        for j in 0..n {
            self.drives[j].copy_from_slice(&right.as_slice()[links + DRIVE_COLUMNS * j..][..DRIVE_COLUMNS]);
        }
        for j in (0..n).filter(|_| springs) {
            self.springs[j].copy_from_slice(&right.as_slice()[sprung + SPRINGS * j..][..SPRINGS]);
        }
        self.usual_torque = torque_scale.iter().map(|s| s / 0.05).collect();
        self.torque_error = self.torque_left(robot, runs);
    }

    /// Sign of a drive's dry friction along a run, as it turns round and smoothed.
    pub fn dry_sign(&self, run: &Motion, drive: usize) -> Vec<f64> {
        self.turns[drive].along(run, drive)
    }

    fn torque_left(&self, robot: &Robot, runs: &[&Motion]) -> Vec<f64> {
        let mut evaluator = Evaluator::new(robot, self);
        let n = robot.joint_count();
        let coupling = robot.coupling();
        let mut left = vec![Vec::new(); n];
        for run in runs {
            let Some(torque) = &run.torque else { continue };
            let signs: Vec<Vec<f64>> = (0..n).map(|j| self.dry_sign(run, j)).collect();
            for &i in &run.rows {
                let load = evaluator.load(run, i);
                for j in 0..n {
                    let friction: f64 = (0..n).map(|d| coupling[(d, j)] * self.drives[d][2] * signs[d][i]).sum();
                    left[j].push(torque[j][i] - load.motor[j] - friction);
                }
            }
        }
        left.into_iter().map(|l| rms(l.into_iter())).collect()
    }

    /// Share of the torque of the runs that it was learnt from which the model does not explain, of a joint.
    pub fn not_understood(&self, joint: usize) -> f64 {
        self.torque_error[joint] / self.usual_torque[joint].max(1e-12)
    }

    /// Friction behind a joint's cable at a sample.
    fn rubbing(&self, run: &Motion, j: usize, i: usize) -> f64 {
        rubs(self.link_friction[j], self.link_sign_width[j], run, j, i)
    }

    /// Deflection `A⁻¹ m - q` of a joint under torques of the links: they load the cables, those give way, and other joints are read through
    /// them. `shares` is [`Robot::strain_shares`].
    pub fn deflection(&self, shares: &DMatrix<f64>, joint: usize, link: &[f64]) -> f64 {
        let joints = 0..link.len();
        joints.filter(|drive| shares[(joint, *drive)] != 0.0).map(|d| shares[(joint, d)] * self.strain(shares, d, link)).sum()
    }

    /// How far the cable of a drive gives way under torques of the links.
    pub fn strain(&self, shares: &DMatrix<f64>, drive: usize, link: &[f64]) -> f64 {
        let load: f64 = link.iter().enumerate().map(|(k, torque)| shares[(k, drive)] * torque).sum();
        self.compliance[drive][0] * load + self.compliance[drive][1]
    }

    /// What a compliance and the friction that was learnt leave of a strain, RMS.
    fn left_of(&self, strain: &Strain, compliance: f64, j: usize) -> f64 {
        // Of the robot's own friction nothing was learnt.
        let [viscous, dry] = if self.link_sign_width[j].is_some() { [0.0; 2] } else { self.link_friction[j] };
        let rubs = |k: usize| viscous * strain.rubbed[0][k] + dry * strain.rubbed[1][k];
        rms((0..strain.seen.len()).map(|k| strain.seen[k] - compliance * (strain.load[k] + rubs(k))))
    }

    fn learn_deflection(&mut self, robot: &Robot, runs: &[&Motion]) {
        let mut compliance = self.compliance.clone();
        let before = self.clone();
        let mut evaluator = Evaluator::new(robot, &before);
        let n = robot.joint_count();
        let (coupling, shares) = (robot.coupling(), robot.strain_shares());
        let mut strains = vec![Strain::default(); n];
        let own = |j: usize, run: &Motion, i: usize| {
            let [viscous, dry, width] = robot.drives[j].behind;
            rubs([viscous, dry], Some(width), run, j, i)
        };
        for run in runs {
            let Some(deflection) = &run.deflection else { continue };
            for &i in &run.rows {
                let at = evaluator.link(&run.link(i));
                for (j, strain) in strains.iter_mut().enumerate() {
                    strain.load.push((0..n).map(|k| shares[(k, j)] * at[k]).sum());
                    strain.seen.push((0..n).map(|k| coupling[(j, k)] * deflection[k][i]).sum());
                    strain.rubbed[0].push(run.velocity[j][i]);
                    strain.rubbed[1].push(run.sign_at_link(j, i));
                    if robot.simulates_itself {
                        strain.turning.push(run.drive_velocity[j][i]);
                        strain.with_own.push((0..n).map(|k| shares[(k, j)] * (at[k] + own(k, run, i))).sum());
                    }
                }
            }
        }
        for (j, strain) in strains.iter().enumerate() {
            let (x, y) = (&strain.load, &strain.seen);
            if x.len() < 40 || rms(y.iter().copied()) < 1e-12 {
                continue;
            }
            let cable = cable(x, &strain.rubbed, y);
            compliance[j] = [cable.as_ref().map_or(0.0, |cable| cable.compliance), 0.0];
            self.late_s[j] = 0.0;
            let Some(cable) = cable else { continue };
            if let Some(friction) = cable.friction {
                (self.link_friction[j], self.link_sign_width[j]) = (friction, None);
            }
            if robot.simulates_itself
                && let Some(behind) = strain.behind(robot.drives[j].behind, self.left_of(strain, compliance[j][0], j))
            {
                compliance[j][0] = behind.compliance;
                (self.link_friction[j], self.link_sign_width[j]) = (behind.friction, behind.sign_width);
                self.late_s[j] = behind.late_s;
            }
        }
        self.compliance = compliance;
    }
}

/// Friction behind a joint's cable at a sample: viscous and dry, whose sign turns over a speed; none: as steep as its noise allows.
fn rubs([viscous, dry]: [f64; 2], width: Option<f64>, run: &Motion, j: usize, i: usize) -> f64 {
    if viscous == 0.0 && dry == 0.0 {
        return 0.0;
    }
    let sign = width.map_or_else(|| run.sign_at_link(j, i), |width| smooth_sign(run.quick(j, true)[i], width));
    viscous * run.velocity[j][i] + dry * sign
}

/// A drive's cable, row by row.
#[derive(Debug, Clone, Default)]
struct Strain {
    /// What the links load it by.
    load: Vec<f64>,
    /// The same with the robot's own friction behind the cables.
    with_own: Vec<f64>,
    /// How far it gives way.
    seen: Vec<f64>,
    /// Velocity of the joint, and its sign.
    rubbed: [Vec<f64>; 2],
    /// Velocity of the drive.
    turning: Vec<f64>,
}

/// What a strain says of a cable and of what is behind it.
struct Behind {
    compliance: f64,
    friction: [f64; 2],
    sign_width: Option<f64>,
    late_s: f64,
}

impl Strain {
    /// The robot's own friction (viscous, dry, width), or dry friction alone, where they leave less than `least`: a sensor that comes late adds a
    /// share of the velocity, which passes for viscous friction, mostly of the wrong sign.
    fn behind(&self, [viscous, dry, width]: [f64; 3], mut least: f64) -> Option<Behind> {
        let mut best = None;
        let (left, at) = fitted(&[&self.load, &self.rubbed[1], &self.turning], &self.seen);
        if left < LATE * least && at[0] > 0.0 && at[1] > 0.0 {
            least = left;
            best = Some(Behind { compliance: at[0], friction: [0.0, at[1] / at[0]], sign_width: None, late_s: at[2] });
        }
        let (left, at) = fitted(&[&self.with_own, &self.turning], &self.seen);
        if viscous + dry > 0.0 && left < least && at[0] > 0.0 {
            best = Some(Behind { compliance: at[0], friction: [viscous, dry], sign_width: Some(width), late_s: at[1] });
        }
        best
    }
}

/// Share of the misfit of the load alone that friction behind the cable has to leave less than, and of that of friction alone.
const RUBS: f64 = 0.9;

/// Share of a deflection that its load has to leave less than, with the friction beside it.
const FOLLOWS: f64 = 0.8;

/// Share of the misfit that friction and a late sensor together have to leave less than.
const LATE: f64 = 0.7;

/// What is left of a series, RMS, and the coefficients of the columns.
fn fitted(columns: &[&[f64]], seen: &[f64]) -> (f64, Vec<f64>) {
    let at = least_squares(columns, seen);
    let told = |k: usize| columns.iter().zip(&at).map(|(c, theta)| theta * c[k]).sum::<f64>();
    (rms((0..seen.len()).map(|k| seen[k] - told(k))), at)
}

/// What a deflection says of a cable.
#[derive(Debug, PartialEq)]
struct Cable {
    compliance: f64,
    /// Viscous and dry, behind it.
    friction: Option<[f64; 2]>,
}

/// A cable from its deflection under a load, with the friction behind it (velocity and its sign) where that explains much beside the load and
/// takes energy away; none where the deflection follows neither: such a transmission is taken for rigid.
fn cable(load: &[f64], rubbed: &[Vec<f64>; 2], seen: &[f64]) -> Option<Cable> {
    let (alone, slope) = fitted(&[load], seen);
    let follows = |left: f64| left < FOLLOWS * rms(seen.iter().copied());
    let tries: [&[usize]; 3] = [&[0, 1], &[0], &[1]];
    for which in tries {
        let columns: Vec<&[f64]> = std::iter::once(load).chain(which.iter().map(|k| &rubbed[*k][..])).collect();
        let (left, at) = fitted(&columns, seen);
        let (unloaded, _) = fitted(&columns[1..], seen);
        if at.iter().all(|x| *x > 0.0) && left < RUBS * alone.min(unloaded) && follows(left) {
            let mut friction = [0.0; 2];
            for (k, theta) in which.iter().zip(at.iter().skip(1)) {
                friction[*k] = theta / at[0];
            }
            return Some(Cable { compliance: at[0], friction: Some(friction) });
        }
    }
    follows(alone).then(|| Cable { compliance: slope[0].max(0.0), friction: None })
}

/// One weighted row of a normal equation.
fn add(gram: &mut DMatrix<f64>, right: &mut DVector<f64>, row: &[f64], value: f64, weight: f64) {
    let square = weight * weight;
    for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        right[i] += square * a * value;
        for (j, b) in row.iter().enumerate() {
            gram[(i, j)] += square * a * b;
        }
    }
}

/// Evaluates a nominal model along runs.
pub struct Evaluator<'a> {
    robot: &'a Robot,
    nominal: &'a Nominal,
    ws: Workspace,
    regressor: Vec<f64>,
    coupling: DMatrix<f64>,
}

impl<'a> Evaluator<'a> {
    /// For a robot and what is believed of it.
    pub fn new(robot: &'a Robot, nominal: &'a Nominal) -> Self {
        let n = robot.joint_count();
        Self {
            robot,
            nominal,
            ws: Workspace::new(&robot.arm),
            regressor: vec![0.0; n * n * PARAMETERS],
            coupling: robot.coupling(),
        }
    }

    /// Torques of the links at a state; by the regressor, since learnt parameters need not be those of a possible body.
    pub fn link(&mut self, state: &State) -> Vec<f64> {
        self.robot.arm.regressor(&mut self.ws, &state.position, &state.velocity, &state.acceleration, &mut self.regressor);
        self.regressor.chunks_exact(self.nominal.inertial.len()).map(|row| dot(row, &self.nominal.inertial)).collect()
    }

    /// Load on the cables and motor torque at a sample, without the nominal Coulomb friction.
    pub fn load(&mut self, run: &Motion, i: usize) -> Load {
        let state = run.link(i);
        let link = self.link(&state);
        let n = link.len();
        let of_drive: Vec<f64> = (0..n)
            .map(|j| {
                let [rotor, viscous, _, constant] = self.nominal.drives[j];
                rotor * run.drive_acceleration[j][i] + viscous * run.drive_velocity[j][i] + constant
            })
            .collect();
        let spring = |j: usize| {
            let [stiffness, damping, rest] = self.robot.drives[j].ground;
            let ground = stiffness * (state.position[j] - rest) + damping * state.velocity[j];
            ground + dot(&self.nominal.springs[j], &powers(state.position[j]))
        };
        let motor =
            (0..n).map(|j| link[j] + spring(j) + (0..n).map(|d| self.coupling[(d, j)] * of_drive[d]).sum::<f64>()).collect();
        let link = link.iter().enumerate().map(|(j, x)| x + self.nominal.rubbing(run, j, i)).collect();
        Load { link, motor }
    }
}

/// First to third power.
fn powers(q: f64) -> [f64; SPRINGS] {
    [q, q * q, q * q * q]
}

/// Smoothed sign of a joint's velocity.
pub fn sign_series(run: &Motion, joint: usize) -> Vec<f64> {
    let raw: Vec<f64> = (0..run.quick_velocity[joint].len()).map(|i| run.sign(joint, i)).collect();
    run.window.apply(&raw, 0)
}

#[cfg(test)]
mod tests {
    use super::{Cable, cable};

    /// A load, a joint's velocity and its sign, row by row.
    fn motion() -> (Vec<f64>, [Vec<f64>; 2]) {
        let load = (0..400).map(|k| (0.031 * f64::from(k)).sin() + 0.1).collect();
        let velocity: Vec<f64> = (0..400).map(|k| (0.05 * f64::from(k)).cos()).collect();
        let sign = velocity.iter().map(|v| v.signum()).collect();
        (load, [velocity, sign])
    }

    #[test]
    fn a_cable_is_known_by_its_load_though_friction_behind_it_is_larger() {
        let (load, rubbed) = motion();
        let seen: Vec<f64> = (0..load.len()).map(|k| 2e-5 * (load[k] + 0.3 * rubbed[0][k] + 0.9 * rubbed[1][k])).collect();
        let Some(Cable { compliance, friction: Some([viscous, dry]) }) = cable(&load, &rubbed, &seen) else { panic!("rigid") };
        assert!((compliance / 2e-5 - 1.0).abs() < 1e-6 && (viscous - 0.3).abs() < 1e-6 && (dry - 0.9).abs() < 1e-6);
    }

    #[test]
    fn what_turns_with_the_velocity_alone_is_no_cable() {
        let (load, rubbed) = motion();
        let play: Vec<f64> = rubbed[1].iter().map(|sign| 1e-4 * sign).collect();
        assert_eq!(cable(&load, &rubbed, &play), None);
    }

    #[test]
    fn without_friction_none_is_told() {
        let (load, rubbed) = motion();
        let seen: Vec<f64> = load.iter().map(|load| 2e-5 * load).collect();
        let Some(Cable { compliance, friction: None }) = cable(&load, &rubbed, &seen) else { panic!("rigid, or rubs") };
        assert!((compliance / 2e-5 - 1.0).abs() < 1e-6);
    }
}
