//! Dual unscented Kalman filter on the elastic cables of joints 1 to 3 (Haghighipanah 2015): one filter follows the links behind their
//! cables by encoders and torque, the other the cables' numbers by the truth, each with what the other believes. The published one runs
//! at the controller's rate along the motors' dynamics; here both run at the rows of the truth, at which the cables have settled.

use super::{POSTURE, Rival, rows};
use crate::data::Trajectory;
use arm::serial::{SerialArm, Workspace};
use arm::{Joints, Motors, RIGID_JOINTS, Raven2, Side};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use ravenpose::load::{MVEL, TAU};

const N: usize = RIGID_JOINTS;
/// Links: position, rate, and torque at the capstan that no model explains.
const STATE: usize = 3 * N;
/// Cables: offset of the joint, logarithm of the compliance, dry friction at the capstan; and how heavy the links are, times nominal.
const NUMBERS: usize = 3 * N + 1;
const MEASURED: usize = 2 * N;
/// Rows further apart than that are two runs, s.
const APART_S: f64 = 0.5;
/// Every so-manieth row of training moves the cables' numbers: neighbours say the same.
const EVERY: usize = 5;
/// Speed over which friction turns round, rad/s of the motor.
const TURN: f64 = 1.0;
/// How long an unexplained torque lasts, s.
const LASTS_S: f64 = 1.0;

/// Gaussian belief in some numbers.
#[derive(Debug, Clone, PartialEq)]
struct Belief<const D: usize> {
    mean: SVector<f64, D>,
    covariance: SMatrix<f64, D, D>,
}

impl<const D: usize> Belief<D> {
    fn new(mean: SVector<f64, D>, sd: &SVector<f64, D>) -> Self {
        Self { mean, covariance: SMatrix::from_diagonal(&sd.map(|sd| sd * sd)) }
    }

    /// The symmetric points of the unscented transform (Julier 1997, κ = 0), all of one weight.
    fn points(&self) -> Vec<SVector<f64, D>> {
        let Some(root) = (self.covariance * D as f64).cholesky() else { return vec![self.mean] };
        let root = root.l();
        root.column_iter().flat_map(|column| [self.mean + column, self.mean - column]).collect()
    }

    /// Takes in a measurement with the standard deviations of its noise; the rest of a belief that is no number is left as it was.
    fn measure<const M: usize>(
        &mut self,
        measured: &SVector<f64, M>,
        sd: &SVector<f64, M>,
        mut expect: impl FnMut(&SVector<f64, D>) -> SVector<f64, M>,
    ) {
        let points = self.points();
        let expected: Vec<SVector<f64, M>> = points.iter().map(&mut expect).collect();
        let weight = 1.0 / points.len() as f64;
        let mean = expected.iter().sum::<SVector<f64, M>>() * weight;
        let mut spread = SMatrix::<f64, M, M>::from_diagonal(&sd.map(|sd| sd * sd));
        let mut cross = SMatrix::<f64, D, M>::zeros();
        for (point, expected) in points.iter().zip(&expected) {
            let off = expected - mean;
            spread += off * off.transpose() * weight;
            cross += (point - self.mean) * off.transpose() * weight;
        }
        let Some(inverse) = spread.try_inverse() else { return };
        let gain = cross * inverse;
        let moved = self.mean + gain * (measured - mean);
        let left = self.covariance - gain * spread * gain.transpose();
        if moved.iter().chain(left.iter()).all(|number| number.is_finite()) {
            self.mean = moved;
            self.covariance = (left + left.transpose()) * 0.5;
        }
    }
}

/// What a row says of joints 1 to 3.
struct Seen {
    time_s: f64,
    /// All joints as reported, rad and m.
    joints: Joints,
    /// Capstan torque, N·m, and motor speed, rad/s.
    torque: [f64; N],
    speed: [f64; N],
}

impl Seen {
    /// Links 1 to 3 as the motors say them.
    fn motors(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.joints[..N])
    }
}

/// Three numbers of many.
fn three<const D: usize>(numbers: &SVector<f64, D>, from: usize) -> Vector3<f64> {
    numbers.fixed_rows::<N>(from).into_owned()
}

/// Positions and torques of one measurement.
fn beside(positions: Vector3<f64>, torque: Vector3<f64>) -> SVector<f64, MEASURED> {
    SVector::from_fn(|k, _| k.checked_sub(N).map_or_else(|| positions[k], |i| torque[i]))
}

/// The filter and what it needs of the arm.
pub struct Kalman {
    arm: arm::Arm,
    body: SerialArm,
    /// Joints 1 to 3 from their drives' positions in joint units.
    inverse: Matrix3<f64>,
    /// Capstan torque per torque of a drive in joint units.
    share: [f64; N],
    numbers: Belief<NUMBERS>,
}

impl Kalman {
    /// On an arm of a RAVEN-II as its control software knows it.
    pub fn of_raven(side: Side) -> Self {
        let (model, arm) = (Raven2::nominal(), Raven2::nominal().arm(side));
        let ratio = *arm.transmission.ratio();
        let inverse = Matrix3::from_fn(|joint, drive| {
            let mut motors = Motors::default();
            motors[drive] = ratio[drive];
            arm.transmission.joints(&motors)[joint]
        });
        let gear = model.plant().transmission.gear_big;
        let cable = &model.plant().cable;
        // Linear: 2 ke, at the radius of the joint's pulley.
        let compliance = |i: usize| 1.0 / (2.0 * cable.ke_n[i] * cable.joint_radius_m[i].powi(2));
        let mut mean = SVector::<f64, NUMBERS>::zeros();
        let mut sd = SVector::<f64, NUMBERS>::zeros();
        let offset = [0.02, 0.02, 0.005];
        for i in 0..N {
            (mean[i], sd[i]) = (0.0, offset[i]);
            (mean[N + i], sd[N + i]) = (compliance(i).ln(), 1.5);
            (mean[2 * N + i], sd[2 * N + i]) = (0.05, 0.03);
        }
        (mean[3 * N], sd[3 * N]) = (1.0, 0.1);
        Self {
            body: model.rigid_body(side),
            inverse,
            share: std::array::from_fn(|i| gear / ratio[i]),
            numbers: Belief::new(mean, &sd),
            arm,
        }
    }

    fn seen(one: &Trajectory) -> impl Iterator<Item = Seen> + '_ {
        rows(one).zip(&one.time_s).map(|(row, time_s)| Seen {
            time_s: *time_s,
            joints: POSTURE.map(|feature| f64::from(row[feature]).to_radians()),
            torque: std::array::from_fn(|i| f64::from(row[TAU + i])),
            speed: std::array::from_fn(|i| f64::from(row[MVEL + i]).to_radians()),
        })
    }

    /// Torque that the links ask of each drive, joint units, for their weight times nominal.
    fn drives(&self, ws: &mut Workspace, position: &Vector3<f64>, rate: &Vector3<f64>, weight: f64) -> Vector3<f64> {
        let mut load = [0.0; N];
        self.body.inverse_dynamics(ws, position.as_slice(), rate.as_slice(), &[0.0; N], None, &mut load);
        self.inverse.transpose() * Vector3::from(load) * weight
    }

    /// How far links stay behind their motors, rad and m: offset, and stretch of the cables under what they carry; and the torque that
    /// it takes at the capstans, N·m.
    fn carried(
        &self,
        ws: &mut Workspace,
        state: &SVector<f64, STATE>,
        numbers: &SVector<f64, NUMBERS>,
        speed: &[f64; N],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let drives = self.drives(ws, &three(state, 0), &three(state, N), numbers[3 * N]);
        let carried = Vector3::from_fn(|i, _| drives[i] + state[2 * N + i] / self.share[i]);
        let stretch = Vector3::from_fn(|i, _| numbers[N + i].exp() * carried[i]);
        let torque = Vector3::from_fn(|i, _| carried[i] * self.share[i] + numbers[2 * N + i] * (speed[i] / TURN).tanh());
        (three(numbers, 0) + self.inverse * stretch, torque)
    }

    /// Where the motors say that the links are, rad and m, and the torque at the capstans.
    fn measured(
        &self,
        ws: &mut Workspace,
        state: &SVector<f64, STATE>,
        numbers: &SVector<f64, NUMBERS>,
        speed: &[f64; N],
    ) -> SVector<f64, MEASURED> {
        let (behind, torque) = self.carried(ws, state, numbers, speed);
        beside(three(state, 0) + behind, torque)
    }

    /// The links at the first row: where the motors are.
    fn begun(seen: &Seen) -> Belief<STATE> {
        let mut mean = SVector::<f64, STATE>::zeros();
        mean.fixed_rows_mut::<N>(0).copy_from_slice(&seen.joints[..N]);
        Belief::new(mean, &SVector::from_column_slice(&[0.02, 0.02, 0.005, 0.5, 0.5, 0.05, 0.05, 0.05, 0.05]))
    }

    /// Time goes on: rates wander, what is unexplained fades.
    fn go_on(links: &mut Belief<STATE>, dt_s: f64) {
        let mut step = SMatrix::<f64, STATE, STATE>::identity();
        let kept = (-dt_s / LASTS_S).exp();
        let mut noise = SVector::<f64, STATE>::zeros();
        for i in 0..N {
            step[(i, N + i)] = dt_s;
            step[(2 * N + i, 2 * N + i)] = kept;
            let acceleration = if i == 2 { 0.3 } else { 3.0 };
            noise[N + i] = (acceleration * dt_s).powi(2);
            noise[2 * N + i] = 0.03_f64.powi(2) * (1.0 - kept * kept);
        }
        links.mean = step * links.mean;
        links.covariance = step * links.covariance * step.transpose() + SMatrix::from_diagonal(&noise);
    }

    /// Brings the links up to a row.
    fn follow(&self, ws: &mut Workspace, links: Option<(f64, Belief<STATE>)>, seen: &Seen) -> Belief<STATE> {
        let mut links = match links {
            Some((before_s, mut links)) if seen.time_s - before_s < APART_S => {
                Self::go_on(&mut links, seen.time_s - before_s);
                links
            }
            _ => Self::begun(seen),
        };
        let measured = beside(seen.motors(), seen.torque.into());
        let sd = SVector::from_column_slice(&[3e-4, 3e-4, 3e-5, 0.03, 0.03, 0.03]);
        let numbers = self.numbers.mean;
        links.measure::<MEASURED>(&measured, &sd, |state| self.measured(ws, state, &numbers, &seen.speed));
        links
    }

    /// What the truth moves the reported tip by if the links stand there, mm.
    fn shift(&self, joints: &Joints, links: &Vector3<f64>) -> Vector3<f64> {
        let mut there = *joints;
        there[..N].copy_from_slice(links.as_slice());
        (self.arm.kinematics.tip_position(&there) - self.arm.kinematics.tip_position(joints)) * 1e3
    }

    /// The cables' numbers, by the truth at a row and by its torque.
    fn learn(&mut self, ws: &mut Workspace, links: &Belief<STATE>, seen: &Seen, label: &[f32]) {
        let measured = beside(Vector3::from_fn(|axis, _| f64::from(label[axis])), seen.torque.into());
        // Play and memory of the cables, which it does not have, leave a millimetre.
        let sd = SVector::from_column_slice(&[1.0, 1.0, 1.0, 0.05, 0.05, 0.05]);
        let mut numbers = self.numbers.clone();
        // They wander slowly: else the first hundred rows would decide.
        numbers.covariance += SMatrix::from_diagonal(&SVector::from_fn(|k, _| {
            let sd: f64 = [2e-6, 1e-3, 1e-5, 1e-4][k / N];
            sd * sd
        }));
        numbers.measure::<MEASURED>(&measured, &sd, |numbers| {
            let (behind, torque) = self.carried(ws, &links.mean, numbers, &seen.speed);
            beside(self.shift(&seen.joints, &(seen.motors() - behind)), torque)
        });
        self.numbers = numbers;
    }
}

impl Rival for Kalman {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        let mut ws = Workspace::new(&self.body);
        for one in train {
            let mut links: Option<(f64, Belief<STATE>)> = None;
            for (k, (seen, label)) in Self::seen(one).zip(one.labels.chunks_exact(outputs.max(1))).enumerate() {
                let now = self.follow(&mut ws, links.take(), &seen);
                if k.is_multiple_of(EVERY) {
                    self.learn(&mut ws, &now, &seen, label);
                }
                links = Some((seen.time_s, now));
            }
        }
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        let mut ws = Workspace::new(&self.body);
        let mut links: Option<(f64, Belief<STATE>)> = None;
        let mut out = Vec::with_capacity(3 * one.rows());
        for seen in Self::seen(one) {
            let now = self.follow(&mut ws, links.take(), &seen);
            out.extend(self.shift(&seen.joints, &three(&now.mean, 0)).iter().map(|part| *part as f32));
            links = Some((seen.time_s, now));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ravenpose_wire::FEATURES;

    const OFFSET: [f64; N] = [0.012, -0.009, 0.002];
    const COMPLIANCE: [f64; N] = [1.2e-3, 2.5e-3, 1.5e-4];

    /// Rows of an arm at rest in changing postures, its links behind their motors by offset and weight alone.
    fn held(kalman: &Kalman, rows: usize, phase: f64) -> Trajectory {
        let mut numbers = kalman.numbers.mean;
        for i in 0..N {
            (numbers[i], numbers[N + i], numbers[2 * N + i]) = (OFFSET[i], COMPLIANCE[i].ln(), 0.0);
        }
        let mut ws = Workspace::new(&kalman.body);
        let mut one = Trajectory::default();
        for k in 0..rows {
            let t = k as f64 / 30.0;
            let links = Vector3::new(
                0.8 + 0.5 * (0.4 * t + phase).sin(),
                1.5 + 0.4 * (0.31 * t + phase).cos(),
                0.36 + 0.06 * (0.23 * t + phase).sin(),
            );
            let mut state = SVector::<f64, STATE>::zeros();
            state.fixed_rows_mut::<N>(0).copy_from(&links);
            let measured = kalman.measured(&mut ws, &state, &numbers, &[0.0; N]);
            let mut row = vec![0.0_f32; FEATURES];
            let mut joints = Joints::default();
            for i in 0..N {
                joints[i] = measured[i];
                row[POSTURE[i]] = measured[i].to_degrees() as f32;
                row[TAU + i] = measured[N + i] as f32;
            }
            one.time_s.push(t);
            one.inputs.extend(row);
            one.labels.extend(kalman.shift(&joints, &links).iter().map(|part| *part as f32));
        }
        one
    }

    #[test]
    fn offsets_and_soft_cables_are_found_and_taken_off() {
        for side in [Side::Gold, Side::Green] {
            let mut kalman = Kalman::of_raven(side);
            let train: Vec<Trajectory> = (0..3).map(|k| held(&kalman, 3000, f64::from(k))).collect();
            let test = held(&kalman, 600, 5.0);
            kalman.fit(&train, 3);
            let rms = |rest: &mut dyn Iterator<Item = f32>| (rest.map(|x| f64::from(x).powi(2)).sum::<f64>() / 600.0).sqrt();
            let raw = rms(&mut test.labels.iter().copied());
            let left = rms(&mut kalman.estimate(&test).iter().zip(&test.labels).map(|(a, b)| a - b));
            assert!(raw > 2.0 && left < 0.1 * raw, "{side:?}: {left} of {raw}");
            for (i, compliance) in COMPLIANCE.iter().enumerate().take(2) {
                let found = kalman.numbers.mean[N + i].exp();
                assert!((found / compliance - 1.0).abs() < 0.3, "joint {}: {found}", i + 1);
            }
        }
    }

    #[test]
    fn a_linear_measurement_is_taken_in_as_by_a_linear_filter() {
        let mut belief = Belief::new(SVector::<f64, 2>::new(1.0, -1.0), &SVector::<f64, 2>::new(2.0, 1.0));
        belief.measure::<1>(&SVector::<f64, 1>::new(4.0), &SVector::<f64, 1>::new(1.0), |x| SVector::<f64, 1>::new(x[0] + x[1]));
        // Gain (4, 1) / 6 for a surprise of 4.
        assert!((belief.mean - SVector::<f64, 2>::new(1.0 + 16.0 / 6.0, -1.0 + 4.0 / 6.0)).norm() < 1e-12);
        assert!((belief.covariance[(0, 0)] - (4.0 - 16.0 / 6.0)).abs() < 1e-12);
    }
}
