//! Where the joints are while the motors stand still.

use super::{Between, MEMORIES_MAX, Plant, State, Vector};

impl Plant {
    /// The state at rest with motors at given angles, rad: cables carry gravity, friction and dead bands carry nothing.
    /// Found by Newton steps on the static balance; play is then settled by the first milliseconds of any run.
    pub fn at_rest(&mut self, motors: &Vector) -> State {
        self.at_rest_with(motors, &State::ZERO.memories)
    }

    /// The same with what hysteresis, creep and warmth remember.
    pub fn at_rest_with(&mut self, motors: &Vector, memories: &[f64; MEMORIES_MAX]) -> State {
        let n = self.joints;
        let mut state = State { motors: *motors, memories: *memories, ..State::ZERO };
        let mut seen = [0.0; super::JOINTS_MAX];
        for i in 0..n {
            seen[i] = motors[i] / self.drives[i].nominal.ratio;
        }
        for i in 0..n {
            state.joints[i] = (0..n).map(|k| self.coupling_inverse[i][k] * seen[k]).sum();
        }
        // Where rigid motors put their joints.
        let mut held = seen;
        if self.shifted {
            self.shift(&mut held, &mut [0.0; super::JOINTS_MAX]);
        }
        let Some(coupling_inverse) = super::inverse(&self.coupling, n) else { return state };
        let mut gravity = [0.0; super::JOINTS_MAX];
        for _ in 0..50 {
            self.body.gravity(&mut self.workspace, &state.joints[..n], &mut gravity[..n]);
            let external = self.external(&state);
            // Torque that each cable must carry, and the deflection at which it does, from the present slope.
            let found = self.deflections(&state);
            let mut missing = [0.0; super::JOINTS_MAX];
            for i in 0..n {
                let carried: f64 = (0..n).map(|k| coupling_inverse[k][i] * (gravity[k] - external[k])).sum();
                let drive = &self.drives[i];
                if drive.nominal.between == Between::Rigid {
                    missing[i] = (0..n).map(|j| self.coupling[i][j] * state.joints[j]).sum::<f64>() - held[i];
                    continue;
                }
                let cable = drive.elastic(found.position[i], 0.0, &state.memories);
                let wanted = carried - cable.torque;
                // Inside a dead band the cable has a slope but no torque: step out of it.
                missing[i] = wanted / cable.stiffness.max(1e-9);
                if cable.torque == 0.0 && wanted != 0.0 {
                    let play: f64 = super::on(&drive.backlash).map(|backlash| backlash.b).sum();
                    missing[i] += wanted.signum() * (play / 2.0 - found.position[i].abs()).max(0.0);
                }
            }
            let mut largest = 0.0_f64;
            for i in 0..n {
                let step: f64 = (0..n).map(|k| coupling_inverse[i][k] * missing[k]).sum();
                state.joints[i] -= step;
                largest = largest.max(step.abs());
            }
            if largest < 1e-14 {
                break;
            }
        }
        state
    }

    /// Winds up what a turning motor drags along, and its cable beside it, at a state whose history is not known, under capstan torques, N·m: what
    /// the torque exceeds the motor's own friction and the cable's load by, as far as friction behind both holds it, in the share of the two.
    /// Where a motor stands, its friction may hold anything, and the least is taken. Other motors stay as they are.
    pub fn wind_up(&mut self, state: &mut State, torque_nm: &Vector) {
        let applied = self.applied(torque_nm);
        let n = self.joints;
        let found = self.deflections(state);
        let mut wound = [0.0; super::JOINTS_MAX];
        for i in 0..n {
            let drive = &self.drives[i];
            let Some(held) = drive.dragged else { continue };
            let nominal = &drive.nominal;
            let per_joint = nominal.gear / nominal.ratio;
            let cable = drive.elastic(found.position[i], 0.0, &state.memories);
            let free = applied[i] - per_joint * cable.torque;
            let speed = state.speeds[i];
            let excess = if speed.abs() > nominal.motor.width {
                free - drive.motor_friction(speed, 1.0).0
            } else {
                free - free.clamp(-nominal.motor.coulomb, nominal.motor.coulomb)
            };
            let joint = (per_joint * nominal.joint.coulomb).abs();
            state.memories[held.faded] = held.dragged.fades(speed);
            let level = held.dragged.level(state.memories[held.faded]);
            let share = (excess / (joint + level).max(1e-12)).clamp(-1.0, 1.0);
            state.memories[held.strain] = share * level / held.dragged.stiffness_nm_rad;
            wound[i] = share * joint / per_joint / cable.stiffness.max(1e-9);
        }
        for i in 0..n {
            state.joints[i] -= (0..n).map(|k| self.coupling_inverse[i][k] * wound[k]).sum::<f64>();
        }
    }
}
