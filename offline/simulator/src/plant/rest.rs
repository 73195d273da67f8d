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

    /// A state in which motors at given angles, rad, turn at given speeds, rad/s, under capstan torques, N·m: what a motor's torque exceeds its
    /// own friction by winds up its cable, as far as the friction of its joint holds that, and what it drags along, in the share of the two.
    /// Where a motor stands, its friction may hold anything, and the least is taken.
    pub fn under_way(&mut self, motors: &Vector, speeds: &Vector, torque_nm: &Vector) -> State {
        let applied = self.applied(torque_nm);
        let mut state = self.at_rest(motors);
        let n = self.joints;
        state.speeds = *speeds;
        let over = |i: usize| speeds[i] / self.drives[i].nominal.ratio;
        state.rates =
            std::array::from_fn(|i| if i < n { (0..n).map(|k| self.coupling_inverse[i][k] * over(k)).sum() } else { 0.0 });
        let found = self.deflections(&state);
        let mut wound = [0.0; super::JOINTS_MAX];
        for i in 0..n {
            let drive = &self.drives[i];
            let nominal = &drive.nominal;
            if nominal.between == Between::Rigid {
                continue;
            }
            let cable = drive.elastic(found.position[i], 0.0, &state.memories);
            let per_joint = nominal.gear / nominal.ratio;
            let free = applied[i] - per_joint * cable.torque;
            let (rubs, _) = drive.motor_friction(speeds[i], 1.0);
            let turns = speeds[i].abs() > nominal.motor.width;
            let most = nominal.motor.coulomb;
            let excess = if turns { free - rubs } else { free - free.clamp(-most, most) };
            let joint = (per_joint * drive.joint_friction(nominal.joint.width * 5.0, 1.0, &state.memories).torque).abs();
            let mut dragged = 0.0;
            if let Some(held) = drive.dragged {
                state.memories[held.faded] = held.dragged.fades(speeds[i]);
                dragged = held.dragged.level(state.memories[held.faded]);
            }
            let excess = excess.clamp(-joint - dragged, joint + dragged);
            let share = excess / (joint + dragged).max(1e-12);
            if let Some(held) = drive.dragged {
                state.memories[held.strain] = share * dragged / held.dragged.stiffness_nm_rad;
            }
            wound[i] = share * joint / per_joint / cable.stiffness.max(1e-9);
        }
        for i in 0..n {
            state.joints[i] -= (0..n).map(|k| self.coupling_inverse[i][k] * wound[k]).sum::<f64>();
        }
        state
    }
}
