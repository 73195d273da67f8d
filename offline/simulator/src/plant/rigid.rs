//! Drives without a cable: the motor is part of the link.
//!
//! With `m = r C q` of a rigid motor `k`: its torque acts on the joints as `C_k^T r_k (tau_k - friction)`, its inertia as
//! `C_k^T r_k² J_k C_k` in the mass matrix. What the controller does not know (offsets, ratios, eccentric pulleys) changes
//! where the encoder shows the joint, not the torque: the shares of a few per cent that they would have in it are left out.

use super::{Between, JOINTS_MAX, Matrix, Plant, State, Vector};

/// Rounds of solving for the motor angle that an encoder shows; each gains as many digits as the shift's slope is small.
const ROUNDS: usize = 30;

impl Plant {
    fn is_rigid(&self, joint: usize) -> bool {
        self.drives[joint].nominal.between == Between::Rigid
    }

    /// Deflection per joint position.
    pub(super) fn paths(&self) -> Matrix {
        let mut path = self.coupling;
        for i in (0..self.joints).filter(|i| self.is_rigid(*i)) {
            path[i] = [0.0; JOINTS_MAX];
            path[i][i] = 1.0;
        }
        path
    }

    /// Torques without those of springs to the ground, which no motor feels.
    pub(super) fn of_cables(&self, torque: &Vector) -> Vector {
        let mut out = *torque;
        if self.rigid {
            (0..self.joints).filter(|i| self.is_rigid(*i)).for_each(|i| out[i] = 0.0);
        }
        out
    }

    /// Motor-side positions and rates of rigid drives follow the joints.
    pub(super) fn see_rigid(&self, state: &State, seen: &mut Vector, seen_rate: &mut Vector) {
        for i in (0..self.joints).filter(|i| self.is_rigid(*i)) {
            seen[i] = (0..self.joints).map(|j| self.coupling[i][j] * state.joints[j]).sum();
            seen_rate[i] = (0..self.joints).map(|j| self.coupling[i][j] * state.rates[j]).sum();
        }
    }

    /// The far end of a rigid drive's spring is where the spring to the ground is at rest.
    pub(super) fn ground(&self, seen: &mut Vector, seen_rate: &mut Vector) {
        for i in (0..self.joints).filter(|i| self.is_rigid(*i)) {
            (seen[i], seen_rate[i]) = (self.drives[i].nominal.passive.rest, 0.0);
        }
    }

    /// Adds what rigid motors push the joints with, and the slope of their friction over the joints' rates.
    pub(super) fn push_rigid(&self, state: &State, applied_nm: &Vector, push: &mut Vector, slope: &mut Vector) {
        *slope = [0.0; JOINTS_MAX];
        for i in (0..self.joints).filter(|i| self.is_rigid(*i)) {
            let drive = &self.drives[i];
            let (row, reach) = (&self.coupling[i], drive.nominal.ratio / drive.nominal.gear);
            let turned = |values: &Vector| drive.nominal.ratio * (0..self.joints).map(|j| row[j] * values[j]).sum::<f64>();
            let (friction, friction_slope) = drive.motor_friction(turned(&state.rates), drive.warm_share(&state.memories));
            let mut torque = applied_nm[i] - friction;
            if !drive.ripple.is_empty() {
                torque -= drive.ripple(turned(&state.joints));
            }
            for j in 0..self.joints {
                push[j] += row[j] * reach * torque;
                slope[j] += row[j] * row[j] * reach * drive.nominal.ratio * friction_slope;
            }
        }
    }

    /// Adds the inertia of rigid motors to the mass matrix.
    pub(super) fn add_armatures(&self, mass: &mut [f64]) {
        let n = self.joints;
        for k in (0..n).filter(|k| self.is_rigid(*k)) {
            let nominal = &self.drives[k].nominal;
            let armature = nominal.ratio * nominal.ratio * nominal.inertia / nominal.gear;
            for i in 0..n {
                for j in 0..n {
                    mass[i * n + j] += self.coupling[k][i] * armature * self.coupling[k][j];
                }
            }
        }
    }

    /// Puts the motors of rigid drives where their encoders show them for the joints of the state.
    pub fn follow(&self, state: &mut State) {
        if !self.rigid {
            return;
        }
        let n = self.joints;
        let mut wanted: Vector = std::array::from_fn(|i| state.motors[i] / self.drive_ratio(i));
        let mut rates: Vector = std::array::from_fn(|i| state.speeds[i] / self.drive_ratio(i));
        if self.shifted {
            self.shift(&mut wanted, &mut rates);
        }
        self.see_rigid(state, &mut wanted, &mut rates);
        let (seen, turning, _) = self.unshifted(&wanted, &rates);
        for i in (0..n).filter(|i| self.is_rigid(*i)) {
            (state.motors[i], state.speeds[i]) = (seen[i] * self.drive_ratio(i), turning[i] * self.drive_ratio(i));
        }
    }

    /// Motor-side positions and rates that a shift turns into the given ones, and the slope of the shift there.
    pub(super) fn unshifted(&self, shifted: &Vector, rates: &Vector) -> (Vector, Vector, Vector) {
        let (mut seen, mut turning, mut slope) = (*shifted, *rates, [0.0; JOINTS_MAX]);
        if self.shifted {
            for _ in 0..ROUNDS {
                let (mut found, mut found_rates) = (seen, turning);
                slope = self.shift(&mut found, &mut found_rates);
                for i in 0..self.joints {
                    seen[i] += shifted[i] - found[i];
                    turning[i] += rates[i] - found_rates[i];
                }
            }
        }
        (seen, turning, slope)
    }

    fn drive_ratio(&self, joint: usize) -> f64 {
        self.drives.get(joint).map_or(1.0, |drive| drive.nominal.ratio)
    }
}
