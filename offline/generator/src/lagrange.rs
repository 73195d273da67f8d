//! Rigid-body motion from the Lagrangian: the mass matrix is the sum over links of their Jacobians, the velocity terms are
//! Christoffel symbols from its analytic derivatives, gravity is the slope of the potential. No recursion of forces anywhere.

use crate::arm::{Arm, Motion, rotation};
use nalgebra::{Matrix3, Vector3};

type V = Vector3<f64>;

/// Geometry and masses of an arm with `N` joints, ready for evaluation.
#[derive(Clone, Debug)]
pub struct Chain<const N: usize> {
    turns: [bool; N],
    fixed: [Matrix3<f64>; N],
    origin: [V; N],
    axis: [V; N],
    mass: [f64; N],
    centre: [V; N],
    inertia: [Matrix3<f64>; N],
    tip: V,
    gravity: V,
    load: f64,
    load_at: V,
}

/// Everything the plant needs of one posture.
#[derive(Clone, Debug)]
pub struct Posture<const N: usize> {
    /// Mass matrix, joint side.
    pub mass: [[f64; N]; N],
    /// Coriolis and centrifugal torque.
    pub coriolis: [f64; N],
    /// Torque that holds the arm against gravity.
    pub gravity: [f64; N],
}

/// Frames of one posture in the base frame.
#[derive(Clone, Debug)]
pub struct Frames<const N: usize> {
    axis: [V; N],
    origin: [V; N],
    turn: [Matrix3<f64>; N],
    place: [V; N],
}

impl<const N: usize> Chain<N> {
    /// The chain of an arm.
    ///
    /// # Panics
    ///
    /// Unless the arm has `N` joints.
    pub fn new(arm: &Arm) -> Self {
        assert_eq!(arm.size(), N);
        Self {
            turns: std::array::from_fn(|j| arm.joints[j].motion == Motion::Turns),
            fixed: std::array::from_fn(|j| rotation(arm.joints[j].rpy)),
            origin: std::array::from_fn(|j| V::from(arm.joints[j].xyz)),
            axis: std::array::from_fn(|j| V::from(arm.joints[j].axis)),
            mass: std::array::from_fn(|j| arm.links[j].mass),
            centre: std::array::from_fn(|j| arm.links[j].centre),
            inertia: std::array::from_fn(|j| arm.links[j].inertia),
            tip: V::from(arm.tip),
            gravity: arm.gravity(),
            load: 0.0,
            load_at: V::zeros(),
        }
    }

    /// A point mass at the last link: kg, and metres in the frame of that link.
    pub fn set_load(&mut self, mass: f64, at: V) {
        self.load = mass;
        self.load_at = at;
    }

    /// Gravity in the base frame, m/s^2.
    pub fn set_gravity(&mut self, gravity: V) {
        self.gravity = gravity;
    }

    /// Where every joint is.
    pub fn frames(&self, q: &[f64; N]) -> Frames<N> {
        let mut frames =
            Frames { axis: [V::zeros(); N], origin: [V::zeros(); N], turn: [Matrix3::identity(); N], place: [V::zeros(); N] };
        let (mut turn, mut at) = (Matrix3::identity(), V::zeros());
        for j in 0..N {
            at += turn * self.origin[j];
            turn *= self.fixed[j];
            frames.axis[j] = turn * self.axis[j];
            frames.origin[j] = at;
            if self.turns[j] {
                turn *= about(&self.axis[j], q[j]);
            } else {
                at += frames.axis[j] * q[j];
            }
            frames.turn[j] = turn;
            frames.place[j] = at;
        }
        frames
    }

    /// Tip in the base frame, m.
    pub fn tip(&self, q: &[f64; N]) -> V {
        let frames = self.frames(q);
        frames.place[N - 1] + frames.turn[N - 1] * self.tip
    }

    /// Joint torques of a force in newtons at the tip, base frame.
    pub fn tip_force(&self, q: &[f64; N], force: &V) -> [f64; N] {
        let frames = self.frames(q);
        let tip = frames.place[N - 1] + frames.turn[N - 1] * self.tip;
        std::array::from_fn(|j| self.sweep(&frames, j, &tip).dot(force))
    }

    /// Velocity of a point of a later link per unit velocity of joint `j`.
    fn sweep(&self, frames: &Frames<N>, j: usize, point: &V) -> V {
        if self.turns[j] { frames.axis[j].cross(&(point - frames.origin[j])) } else { frames.axis[j] }
    }

    /// Mass matrix, velocity terms and gravity.
    pub fn posture(&self, q: &[f64; N], v: &[f64; N]) -> Posture<N> {
        let frames = self.frames(q);
        let mut mass = [[0.0; N]; N];
        // slope[l][j][k] = d mass[j][k] / d q[l], j <= k; zero for l <= j, since turning a whole sub-chain changes nothing in it
        let mut slope = [[[0.0; N]; N]; N];
        let mut gravity = [0.0; N];
        for i in 0..N {
            let inertia = frames.turn[i] * self.inertia[i] * frames.turn[i].transpose();
            let point = frames.place[i] + frames.turn[i] * self.centre[i];
            self.add_body(&frames, i, self.mass[i], &point, Some(&inertia), &mut mass, &mut slope, &mut gravity);
        }
        if self.load != 0.0 {
            let point = frames.place[N - 1] + frames.turn[N - 1] * self.load_at;
            self.add_body(&frames, N - 1, self.load, &point, None, &mut mass, &mut slope, &mut gravity);
        }
        for j in 0..N {
            for k in 0..j {
                mass[j][k] = mass[k][j];
            }
        }
        Posture { mass, coriolis: christoffel(&slope, v), gravity }
    }

    /// Adds one body at `point` on link `i`.
    #[expect(clippy::too_many_arguments, reason = "three accumulators of one sum")]
    fn add_body(
        &self,
        frames: &Frames<N>,
        i: usize,
        body: f64,
        point: &V,
        inertia: Option<&Matrix3<f64>>,
        mass: &mut [[f64; N]; N],
        slope: &mut [[[f64; N]; N]; N],
        gravity: &mut [f64; N],
    ) {
        let mut sweep = [V::zeros(); N];
        let mut spin = [V::zeros(); N];
        for j in 0..=i {
            sweep[j] = self.sweep(frames, j, point);
            if self.turns[j] {
                spin[j] = frames.axis[j];
            }
            gravity[j] -= body * sweep[j].dot(&self.gravity);
        }
        for j in 0..=i {
            let inertia_spin = inertia.map_or(V::zeros(), |inertia| inertia * spin[j]);
            for k in j..=i {
                mass[j][k] += body * sweep[j].dot(&sweep[k]) + inertia_spin.dot(&spin[k]);
                for l in j + 1..=i {
                    // the joint before l swings its arm as the point moves; a joint after l is carried along as a whole
                    let change_j = spin[j].cross(&sweep[l]);
                    let change_k = if k <= l { spin[k].cross(&sweep[l]) } else { spin[l].cross(&sweep[k]) };
                    let mut sum = body * (change_j.dot(&sweep[k]) + sweep[j].dot(&change_k));
                    if let Some(inertia) = inertia
                        && self.turns[l]
                    {
                        if k > l {
                            sum += inertia_spin.dot(&spin[l].cross(&spin[k]));
                        }
                        sum += spin[j].dot(&spin[l].cross(&(inertia * spin[k]))) - inertia_spin.dot(&spin[l].cross(&spin[k]));
                    }
                    slope[l][j][k] += sum;
                }
            }
        }
    }

    /// Kinetic and potential energy, J.
    pub fn energy(&self, q: &[f64; N], v: &[f64; N]) -> (f64, f64) {
        let frames = self.frames(q);
        let (mut kinetic, mut potential) = (0.0, 0.0);
        let mut add = |i: usize, body: f64, point: V, inertia: Matrix3<f64>| {
            let (mut velocity, mut spin) = (V::zeros(), V::zeros());
            for j in 0..=i {
                velocity += self.sweep(&frames, j, &point) * v[j];
                if self.turns[j] {
                    spin += frames.axis[j] * v[j];
                }
            }
            kinetic += 0.5 * (body * velocity.norm_squared() + spin.dot(&(inertia * spin)));
            potential -= body * self.gravity.dot(&point);
        };
        for i in 0..N {
            let turn = frames.turn[i];
            let point = frames.place[i] + turn * self.centre[i];
            add(i, self.mass[i], point, turn * self.inertia[i] * turn.transpose());
        }
        add(N - 1, self.load, frames.place[N - 1] + frames.turn[N - 1] * self.load_at, Matrix3::zeros());
        (kinetic, potential)
    }
}

/// `sum_kl (dM_jk/dq_l - dM_kl/dq_j / 2) v_k v_l`.
fn christoffel<const N: usize>(slope: &[[[f64; N]; N]; N], v: &[f64; N]) -> [f64; N] {
    let at = |l: usize, j: usize, k: usize| slope[l][j.min(k)][j.max(k)];
    std::array::from_fn(|j| {
        let mut sum = 0.0;
        for k in 0..N {
            for l in 0..N {
                sum += (at(l, j, k) - 0.5 * at(j, k, l)) * v[k] * v[l];
            }
        }
        sum
    })
}

/// Turn by `angle` about a unit axis (Rodrigues).
pub fn about(axis: &V, angle: f64) -> Matrix3<f64> {
    let (sin, cos) = angle.sin_cos();
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * sin + cross * cross * (1.0 - cos)
}
