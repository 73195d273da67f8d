//! The plant read backwards: a motion is given, the torques are wanted.
//!
//! Inverse dynamics, friction and motors exactly; cables quasi-statically: a deflection is the one at which the cable carries
//! what the joint needs, its rate is neglected. What has a memory (hysteresis, creep, warmth, friction that holds) is carried
//! from sample to sample. Cheap: no time step is limited by a stiff cable.

use super::{Between, JOINTS_MAX, MEMORIES_MAX, Matrix, Plant, State, Vector, on};

/// Whose motion is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// That of the motors, rad.
    Motors,
    /// That of the joints, rad or m.
    Joints,
}

/// What is carried from one sample to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory {
    memories: [f64; MEMORIES_MAX],
    deflection: Vector,
}

impl Memory {
    /// At the beginning of a run.
    pub const NEW: Self = Self { memories: [0.0; MEMORIES_MAX], deflection: [0.0; JOINTS_MAX] };
}

/// What a motion needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needed {
    /// Torque to be commanded, N·m at the capstan.
    pub torque: Vector,
    /// Motors, rad.
    pub motors: Vector,
    /// Joints, rad or m.
    pub joints: Vector,
    /// Deflections of the cables, joint units.
    pub deflection: Vector,
    /// What the cables carry, N·m or N at the joint.
    pub cable: Vector,
}

/// Rounds in which deflection and posture find each other; each gains some three digits.
const ROUNDS: usize = 3;
/// Steps of the search for a deflection at most.
const STEPS: usize = 80;

impl Plant {
    /// Torques, and the other side of the cables, for position, rate and acceleration of one side; `step_s` is the time since the
    /// sample before.
    pub fn needed(&mut self, given: Given, motion: [&Vector; 3], memory: &mut Memory, step_s: f64) -> Needed {
        let n = self.joints;
        let Some(inverse) = super::inverse(&self.coupling, n) else { return Self::at_nothing(motion[0]) };
        let turned = |matrix: &Matrix, v: &Vector| -> Vector {
            std::array::from_fn(|i| if i < n { (0..n).map(|j| matrix[i][j] * v[j]).sum() } else { 0.0 })
        };
        let (seen, slope, motors) = match given {
            Given::Motors => self.seen(motion),
            Given::Joints => ([[0.0; JOINTS_MAX]; 3], [0.0; JOINTS_MAX], [[0.0; JOINTS_MAX]; 3]),
        };
        let mut deflection = memory.deflection;
        let mut needed = Self::at_nothing(motion[0]);
        let mut rates = [0.0; JOINTS_MAX];
        for _ in 0..if given == Given::Motors { ROUNDS } else { 1 } {
            let joints = match given {
                Given::Motors => {
                    let taut = std::array::from_fn(|i| seen[0][i] - deflection[i]);
                    [turned(&inverse, &taut), turned(&inverse, &seen[1]), turned(&inverse, &seen[2])]
                }
                Given::Joints => motion.map(|part| *part),
            };
            needed.joints = joints[0];
            rates = joints[1];
            let load = self.joint_load(&joints, memory);
            needed.cable = std::array::from_fn(|i| if i < n { (0..n).map(|k| inverse[k][i] * load[k]).sum() } else { 0.0 });
            for i in 0..n {
                deflection[i] = self.deflection_under(i, needed.cable[i], memory);
            }
        }
        needed.deflection = deflection;
        let (motors, slope) = match given {
            Given::Motors => (motors, slope),
            Given::Joints => self.motors_of(motion, &deflection),
        };
        needed.motors = motors[0];
        for (drive, speed) in self.drives.iter().zip(&motors[1]) {
            drive.drag_on(*speed, step_s, &mut memory.memories);
        }
        self.torques(&mut needed, &motors, &slope, memory);
        self.remember(&needed, &rates, memory, step_s);
        needed
    }

    fn at_nothing(position: &Vector) -> Needed {
        let zero = [0.0; JOINTS_MAX];
        Needed { torque: zero, motors: *position, joints: *position, deflection: zero, cable: zero }
    }

    /// Where motors put the ends of their cables, with rate and acceleration; slope of the shift; the motors.
    fn seen(&self, motion: [&Vector; 3]) -> ([Vector; 3], Vector, [Vector; 3]) {
        let n = self.joints;
        let over = |v: &Vector| std::array::from_fn(|i| if i < n { v[i] / self.drives[i].nominal.ratio } else { 0.0 });
        let mut seen: [Vector; 3] = motion.map(over);
        let mut slope = [0.0; JOINTS_MAX];
        if self.shifted {
            let (mut position, mut unused) = (seen[0], seen[1]);
            slope = self.shift(&mut position, &mut unused);
            let mut again = seen[0];
            self.shift(&mut again, &mut seen[1]);
            again = seen[0];
            self.shift(&mut again, &mut seen[2]);
            seen[0] = position;
        }
        (seen, slope, motion.map(|part| *part))
    }

    /// Motors that put the far ends of the cables at their deflections.
    fn motors_of(&self, motion: [&Vector; 3], deflection: &Vector) -> ([Vector; 3], Vector) {
        let n = self.joints;
        let by = |v: &Vector| -> Vector {
            std::array::from_fn(|i| if i < n { (0..n).map(|j| self.coupling[i][j] * v[j]).sum() } else { 0.0 })
        };
        let mut ends = motion.map(by);
        (0..n).filter(|i| self.drives[*i].nominal.between == Between::Cable).for_each(|i| ends[0][i] += deflection[i]);
        let (seen, _, slope) = self.unshifted(&ends[0], &[0.0; JOINTS_MAX]);
        ends[0] = seen;
        let motors = ends.map(|part| std::array::from_fn(|i| if i < n { part[i] * self.drives[i].nominal.ratio } else { 0.0 }));
        (motors, slope)
    }

    /// What cables and rigid motors must put on the joints: inertia, weight, friction, less what springs and contacts give.
    fn joint_load(&mut self, joints: &[Vector; 3], memory: &Memory) -> Vector {
        let n = self.joints;
        let [position, rate, acceleration] = joints;
        let mut load: Vector = [0.0; JOINTS_MAX];
        self.body.inverse_dynamics(&mut self.workspace, &position[..n], &rate[..n], &acceleration[..n], None, &mut load[..n]);
        let state = State { joints: *position, rates: *rate, memories: memory.memories, ..State::ZERO };
        let external = self.external(&state);
        for i in 0..n {
            let drive = &self.drives[i];
            let friction = drive.joint_friction(rate[i], drive.warm_share(&memory.memories), &memory.memories);
            load[i] *= 1.0 + friction.per_load * friction.sign * load[i].signum();
            load[i] += friction.torque - external[i];
            if drive.nominal.between == Between::Rigid {
                load[i] -= drive.elastic(drive.nominal.passive.rest - position[i], -rate[i], &memory.memories).torque;
            }
        }
        load
    }

    /// The deflection at which a cable carries a torque.
    fn deflection_under(&self, joint: usize, torque: f64, memory: &Memory) -> f64 {
        let drive = &self.drives[joint];
        if drive.nominal.between == Between::Rigid {
            return 0.0;
        }
        let before = memory.deflection[joint];
        let carried = |deflection: f64| {
            let mut memories = memory.memories;
            drive.strain(deflection - before, &mut memories);
            drive.elastic(deflection, 0.0, &memories)
        };
        let close = 1e-9 * torque.abs() + 1e-12;
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut at = before;
        for _ in 0..STEPS {
            let cable = carried(at);
            let missing = torque - cable.torque;
            if missing.abs() <= close {
                break;
            }
            if missing > 0.0 {
                low = at;
            } else {
                high = at;
            }
            let mut next = at + missing / cable.stiffness.max(1e-9);
            if cable.torque == 0.0 {
                // Inside a dead band: to its end first.
                let play: f64 = on(&drive.backlash).map(|backlash| backlash.b).sum();
                next += missing.signum() * play;
            }
            at = if next > low && next < high { next } else { f64::midpoint(low.max(at - 1.0), high.min(at + 1.0)) };
        }
        at
    }

    /// Torques of the motors, from what their cables carry.
    fn torques(&self, needed: &mut Needed, motors: &[Vector; 3], slope: &Vector, memory: &Memory) {
        let reaction = self.reaction(&needed.cable, slope);
        for i in 0..self.joints {
            let drive = &self.drives[i];
            let nominal = &drive.nominal;
            let (friction, _) = drive.motor_friction(motors[1][i], drive.warm_share(&memory.memories));
            let held = friction + drive.drag(&memory.memories);
            let acts = nominal.inertia * motors[2][i] + held + nominal.gear / nominal.ratio * reaction[i];
            needed.torque[i] = drive.commanded(acts + drive.ripple(motors[0][i]));
        }
    }

    /// Carries memories over the time since the sample before.
    fn remember(&self, needed: &Needed, rates: &Vector, memory: &mut Memory, step_s: f64) {
        for i in 0..self.joints {
            let drive = &self.drives[i];
            let (strain, torque) = match drive.nominal.between {
                Between::Cable => (needed.deflection[i] - memory.deflection[i], needed.cable[i]),
                Between::Rigid => (-rates[i] * step_s, 0.0),
            };
            drive.strain(strain, &mut memory.memories);
            drive.age(torque, drive.applied(needed.torque[i]), step_s, &mut memory.memories);
            if let Some(stiction) = drive.stiction {
                let sign = &mut memory.memories[stiction.slot];
                *sign = (*sign + step_s * stiction.rate(rates[i], *sign, step_s)).clamp(-1.0, 1.0);
            }
        }
        memory.deflection = needed.deflection;
    }
}
