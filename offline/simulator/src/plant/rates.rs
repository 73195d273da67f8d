//! How fast a plant can be: what limits the time step.

use super::{Between, JOINTS_MAX, Plant, Vector};

impl Plant {
    /// Largest rate at which friction and cable dampers pull a joint or motor to rest, 1/s, at joint positions: what limits an
    /// explicit step. Effects that start later count.
    pub fn fastest_rate(&mut self, joints: &Vector) -> f64 {
        let n = self.joints;
        let mut mass = [0.0; JOINTS_MAX * JOINTS_MAX];
        self.body.mass_matrix(&mut self.workspace, &joints[..n], &mut mass[..n * n]);
        let mut fastest = 0.0_f64;
        for i in 0..n {
            let drive = &self.drives[i];
            let nominal = &drive.nominal;
            let damping = drive.steepest_damping();
            let motor = drive.steepest_motor_friction();
            let link = drive.steepest_friction() + damping + nominal.passive.damping;
            if nominal.between == Between::Rigid {
                let armature = nominal.ratio * nominal.ratio / nominal.gear;
                fastest = fastest.max((link + armature * motor) / (mass[i * n + i] + armature * nominal.inertia));
                continue;
            }
            fastest = fastest.max(link / mass[i * n + i]);
            fastest = fastest.max((motor + nominal.gear / (nominal.ratio * nominal.ratio) * damping) / nominal.inertia);
        }
        fastest
    }

    /// Largest angular frequency with which a link or motor vibrates on its own cable or spring, rad/s, at joint positions.
    pub fn fastest_frequency(&mut self, joints: &Vector) -> f64 {
        let n = self.joints;
        let mut mass = [0.0; JOINTS_MAX * JOINTS_MAX];
        self.body.mass_matrix(&mut self.workspace, &joints[..n], &mut mass[..n * n]);
        self.add_armatures(&mut mass);
        let mut fastest = 0.0_f64;
        for (i, drive) in self.drives.iter().enumerate() {
            let nominal = &drive.nominal;
            let known = nominal.radius_m * nominal.radius_m * nominal.cable.at(0.0).stiffness_n_m;
            let stiffness = drive.hysteresis.iter().map(|(cable, _)| cable.effect.k).fold(known, f64::max);
            let motor = match nominal.between {
                Between::Cable => nominal.gear / (nominal.ratio * nominal.ratio * nominal.inertia),
                Between::Rigid => 0.0,
            };
            let link = 1.0 / mass[i * n + i];
            fastest = fastest.max(stiffness * (link + motor) + nominal.passive.stiffness * link);
        }
        fastest.sqrt()
    }

    /// The first joint that nothing with inertia hangs on at joint positions; none if all can be accelerated.
    pub fn massless(&mut self, joints: &Vector) -> Option<usize> {
        let n = self.joints;
        let mut mass = [0.0; JOINTS_MAX * JOINTS_MAX];
        self.body.mass_matrix(&mut self.workspace, &joints[..n], &mut mass[..n * n]);
        self.add_armatures(&mut mass);
        let largest = (0..n).map(|i| mass[i * n + i]).fold(0.0, f64::max);
        (0..n).find(|i| mass[i * n + i].is_nan() || mass[i * n + i] <= 1e-12 * largest)
    }
}
