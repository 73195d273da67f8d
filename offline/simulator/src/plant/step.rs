//! Time steps.

use super::evaluate::Evaluation;
use super::solve::{back_substitute, cholesky};
use super::{Between, JOINTS_MAX, MEMORIES_MAX, Passive, Plant, State, Vector};

/// How a step is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The classical explicit Runge-Kutta method of fourth order: the nominal plant's.
    Rk4,
    /// ROS2, a linearly implicit method of second order, L-stable, which keeps its order with an approximate Jacobian
    /// (Verwer, Spee, Blom, Hundsdorfer 1999). Cables and friction enter the Jacobian, geometry does not: a sharp friction or
    /// a stiff cable needs no smaller step.
    Rosenbrock,
}

/// Twice the joints: links and motors.
const BOTH: usize = 2 * JOINTS_MAX;

/// 1 - 1/√2.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

impl Plant {
    /// Moves a state on by `duration_s` under constant capstan torques, N·m, in equal steps no longer than the plant's.
    pub fn advance(&mut self, state: &mut State, torque_nm: &Vector, duration_s: f64) {
        let applied = self.applied(torque_nm);
        let steps = (duration_s / self.step_s - 1e-9).ceil().max(1.0);
        let step_s = duration_s / steps;
        for _ in 0..steps as u64 {
            match self.method {
                Method::Rk4 => self.rk4(state, &applied, step_s),
                Method::Rosenbrock => self.rosenbrock(state, &applied, step_s),
            }
            self.drives.iter().for_each(|drive| drive.slip(&mut state.memories));
        }
        self.follow(state);
    }

    fn rk4(&mut self, state: &mut State, applied: &Vector, h: f64) {
        let start = *state;
        let mut sum = Slope::ZERO;
        let mut at = start;
        for (weight, next) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)] {
            let slope = self.slope(&at, applied);
            sum.add(&slope, weight);
            if next > 0.0 {
                at = start.moved(&slope, next * h);
            }
        }
        *state = start.moved(&sum, h / 6.0);
    }

    fn slope(&mut self, state: &State, applied: &Vector) -> Slope {
        let mut evaluation = Evaluation::ZERO;
        self.evaluate(state, applied, &mut evaluation);
        let (joints, motors) = self.accelerations_of(&evaluation);
        Slope { joints: state.rates, rates: joints, motors: state.speeds, speeds: motors, memories: evaluation.memory_rates }
    }

    /// Motor rows are divided by the gear, which makes the cables' matrix symmetric: one Cholesky factor serves both stages.
    fn rosenbrock(&mut self, state: &mut State, applied: &Vector, h: f64) {
        let n = self.joints;
        let mut first = Evaluation::ZERO;
        self.evaluate(state, applied, &mut first);
        let linear = Linear::new(self, &first);
        let Some(factor) = linear.factor(GAMMA * h) else {
            // A mass matrix that is not positive definite: identified inertias may be. The explicit step still exists.
            return self.rk4(state, applied, h);
        };
        let speeds = stacked(&state.rates, &state.speeds, n);
        let mut k1 = linear.forces(self, &first);
        subtract(&mut k1, &linear.stiff(&speeds), GAMMA * h);
        factor.solve(&mut k1, n);
        let k1_position = sum(&speeds, &k1, GAMMA * h);

        let mut second_state = *state;
        apply(&mut second_state, &k1_position, &k1, h, n);
        for i in 0..self.memories {
            second_state.memories[i] += h * first.memory_rates[i];
        }
        let mut second = Evaluation::ZERO;
        self.evaluate(&second_state, applied, &mut second);
        let (joints, motors) = self.accelerations_of(&second);
        let second_speeds = stacked(&second_state.rates, &second_state.speeds, n);
        let r_speed = sum(&stacked(&joints, &motors, n), &k1, -2.0);
        let r_position = sum(&second_speeds, &k1_position, -2.0);
        let mut k2 = linear.weigh(&r_speed);
        subtract(&mut k2, &linear.stiff(&r_position), GAMMA * h);
        factor.solve(&mut k2, n);
        let k2_position = sum(&r_position, &k2, GAMMA * h);

        apply(state, &k1_position, &k1, 1.5 * h, n);
        apply(state, &k2_position, &k2, 0.5 * h, n);
        for i in 0..self.memories {
            state.memories[i] += 0.5 * h * (first.memory_rates[i] + second.memory_rates[i]);
        }
    }
}

/// Rates of a whole state.
struct Slope {
    joints: Vector,
    rates: Vector,
    motors: Vector,
    speeds: Vector,
    memories: [f64; MEMORIES_MAX],
}

impl Slope {
    const ZERO: Self = Self {
        joints: [0.0; JOINTS_MAX],
        rates: [0.0; JOINTS_MAX],
        motors: [0.0; JOINTS_MAX],
        speeds: [0.0; JOINTS_MAX],
        memories: [0.0; MEMORIES_MAX],
    };

    fn add(&mut self, other: &Self, weight: f64) {
        for i in 0..JOINTS_MAX {
            self.joints[i] += weight * other.joints[i];
            self.rates[i] += weight * other.rates[i];
            self.motors[i] += weight * other.motors[i];
            self.speeds[i] += weight * other.speeds[i];
        }
        for (sum, rate) in self.memories.iter_mut().zip(&other.memories) {
            *sum += weight * rate;
        }
    }
}

impl State {
    fn moved(&self, slope: &Slope, h: f64) -> Self {
        let mut out = *self;
        for i in 0..JOINTS_MAX {
            out.joints[i] += h * slope.joints[i];
            out.rates[i] += h * slope.rates[i];
            out.motors[i] += h * slope.motors[i];
            out.speeds[i] += h * slope.speeds[i];
        }
        for (memory, rate) in out.memories.iter_mut().zip(&slope.memories) {
            *memory += h * rate;
        }
        out
    }
}

type Both = [f64; BOTH];

fn stacked(links: &Vector, motors: &Vector, n: usize) -> Both {
    let mut out = [0.0; BOTH];
    out[..n].copy_from_slice(&links[..n]);
    out[n..2 * n].copy_from_slice(&motors[..n]);
    out
}

fn sum(a: &Both, b: &Both, weight: f64) -> Both {
    std::array::from_fn(|i| a[i] + weight * b[i])
}

fn subtract(a: &mut Both, b: &Both, weight: f64) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a -= weight * b);
}

fn apply(state: &mut State, positions: &Both, speeds: &Both, h: f64, n: usize) {
    for i in 0..n {
        state.joints[i] += h * positions[i];
        state.motors[i] += h * positions[n + i];
        state.rates[i] += h * speeds[i];
        state.speeds[i] += h * speeds[n + i];
    }
}

/// Mass, stiffness and damping of links and motors at one state, motor rows over the gear.
struct Linear<'a> {
    n: usize,
    evaluation: &'a Evaluation,
    /// `P`: deflection per motion of links and motors; `[i][..n]` is -C, `[i][n + i]` 1 over the ratio.
    motion: [[f64; BOTH]; JOINTS_MAX],
    /// Springs and dampers of the joints to the ground.
    passive: [Passive; JOINTS_MAX],
    /// Inertia of the motors over their gear.
    inertia: Vector,
    motor_slope: Vector,
}

impl<'a> Linear<'a> {
    fn new(plant: &Plant, evaluation: &'a Evaluation) -> Self {
        let n = plant.joints;
        let mut motion = [[0.0; BOTH]; JOINTS_MAX];
        let mut passive = [Passive::NONE; JOINTS_MAX];
        let (mut inertia, mut motor_slope) = ([0.0; JOINTS_MAX], [0.0; JOINTS_MAX]);
        for i in 0..n {
            let nominal = &plant.drives[i].nominal;
            for j in 0..n {
                motion[i][j] = -plant.path[i][j];
            }
            motion[i][n + i] = if nominal.between == Between::Rigid { 0.0 } else { 1.0 / nominal.ratio };
            passive[i] = nominal.passive;
            inertia[i] = nominal.inertia / nominal.gear;
            motor_slope[i] = evaluation.motor_slope[i] / nominal.gear;
        }
        Self { n, evaluation, motion, passive, inertia, motor_slope }
    }

    /// Forces, motor rows over the gear.
    fn forces(&self, plant: &Plant, evaluation: &Evaluation) -> Both {
        let mut out = [0.0; BOTH];
        for i in 0..self.n {
            out[i] = evaluation.drive[i] - evaluation.bias[i];
            out[self.n + i] = evaluation.motor[i] / plant.drives[i].nominal.gear;
        }
        out
    }

    /// `P^T K P u`.
    fn stiff(&self, u: &Both) -> Both {
        let mut out = [0.0; BOTH];
        for i in 0..self.n {
            let row = &self.motion[i];
            let pull = self.evaluation.stiffness[i] * (0..2 * self.n).map(|k| row[k] * u[k]).sum::<f64>();
            for k in 0..2 * self.n {
                out[k] += row[k] * pull;
            }
            out[i] += self.passive[i].stiffness * u[i];
        }
        out
    }

    /// Mass times accelerations.
    fn weigh(&self, a: &Both) -> Both {
        let n = self.n;
        let mut out = [0.0; BOTH];
        for i in 0..n {
            out[i] = (0..n).map(|j| self.evaluation.mass[i * n + j] * a[j]).sum();
            out[n + i] = self.inertia[i] * a[n + i];
        }
        out
    }

    /// Cholesky factor of `mass + gh (P^T B P + slopes) + gh² P^T K P`; none where the mass matrix is not positive definite.
    fn factor(&self, gh: f64) -> Option<Factor> {
        let n = self.n;
        let mut matrix = [[0.0; BOTH]; BOTH];
        for i in 0..n {
            for j in 0..=i {
                matrix[i][j] = self.evaluation.mass[i * n + j];
            }
            matrix[i][i] += gh * (self.evaluation.joint_slope[i] + self.passive[i].damping) + gh * gh * self.passive[i].stiffness;
            matrix[n + i][n + i] = self.inertia[i] + gh * self.motor_slope[i];
        }
        for i in 0..n {
            let row = &self.motion[i];
            let weight = gh * self.evaluation.damping[i] + gh * gh * self.evaluation.stiffness[i];
            for k in 0..2 * n {
                let scaled = weight * row[k];
                for l in 0..=k {
                    matrix[k][l] += scaled * row[l];
                }
            }
        }
        cholesky(&mut matrix, 2 * n).then_some(Factor { lower: matrix })
    }
}

struct Factor {
    lower: [[f64; BOTH]; BOTH],
}

impl Factor {
    fn solve(&self, b: &mut Both, n: usize) {
        back_substitute(&self.lower, 2 * n, b);
    }
}
