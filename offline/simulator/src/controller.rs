//! The control software: encoders in, amplifier commands out, once per millisecond (raven2-plant.md, section 5).

use arm::plant::Plant as PlantFile;
use arm::{Arm, JOINTS, Joints, Motors, Side};

/// RAVEN's controller of one arm in runlevel 3.
#[derive(Debug, Clone)]
pub struct Controller {
    arm: Arm,
    ki: Motors,
    period_s: f64,
    gravity_feedforward: bool,
    measured_motor_3: bool,
    filter: Option<SpeedFilter>,
    /// Sum of error times period, rad·s; never reset.
    integral: Motors,
    counts: Option<Motors>,
    ticks: u64,
}

/// What the controller knows and wants in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Joint positions from the measured motors, rad and m.
    pub joints: Joints,
    /// Measured motor angles, rad.
    pub motors: Motors,
    /// Commanded motor angles, rad.
    pub motors_d: Motors,
    /// Motor speeds, rad/s.
    pub speeds: Motors,
    /// Capstan torque before clipping, N·m.
    pub torque_nm: Motors,
    /// Amplifier commands.
    pub dac: [i32; JOINTS],
}

impl Controller {
    /// The controller of an arm with the plant file's gains.
    pub fn new(plant: &PlantFile, arm: Arm) -> Self {
        let filter = (plant.sampling.velocity_filter != "none").then(|| SpeedFilter::new(plant));
        Self {
            ki: plant.control.ki,
            period_s: plant.sampling.period_s,
            gravity_feedforward: plant.control.gravity_feedforward,
            measured_motor_3: plant.control.insertion_coupling_uses_measured_motor_3,
            filter,
            integral: [0.0; JOINTS],
            counts: None,
            ticks: 0,
            arm,
        }
    }

    /// Which arm.
    pub fn side(&self) -> Side {
        self.arm.side
    }

    /// One cycle: motor angles as the encoders see them, rad, and where the joints should be.
    pub fn tick(&mut self, seen: &Motors, joints_d: &Joints) -> Tick {
        let (motors, speeds) = self.measure(seen);
        let joints = self.arm.transmission.joints(&motors);
        let motors_d = if self.measured_motor_3 {
            self.arm.transmission.motors_at(joints_d, motors[2])
        } else {
            self.arm.transmission.motors(joints_d)
        };
        let mut torque_nm = self.arm.amplifiers.proportional_derivative(&motors_d, &motors, &speeds);
        for i in 0..JOINTS {
            self.integral[i] += (motors_d[i] - motors[i]) * self.period_s;
            torque_nm[i] += self.ki[i] * self.integral[i];
        }
        if self.gravity_feedforward {
            for (torque, gravity) in torque_nm.iter_mut().zip(self.arm.gravity.capstan_torque(&joints)) {
                *torque += gravity;
            }
        }
        let dac = std::array::from_fn(|i| self.arm.amplifiers.counts(i, torque_nm[i]));
        Tick { joints, motors, motors_d, speeds, torque_nm, dac }
    }

    /// One cycle in which amplifier commands come from a recording; the controller only measures.
    pub fn tick_open(&mut self, seen: &Motors, joints_d: &Joints, dac: &[i32; JOINTS]) -> Tick {
        let (motors, speeds) = self.measure(seen);
        let torque_nm = std::array::from_fn(|i| self.arm.amplifiers.torque(i, f64::from(dac[i])));
        let joints = self.arm.transmission.joints(&motors);
        let motors_d = self.arm.transmission.motors_at(joints_d, motors[2]);
        Tick { joints, motors, motors_d, speeds, torque_nm, dac: *dac }
    }

    /// Capstan torques that amplifier commands stand for, N·m.
    pub fn torque_of(&self, dac: &[i32; JOINTS]) -> Motors {
        std::array::from_fn(|i| self.arm.amplifiers.torque(i, f64::from(dac[i])))
    }

    /// Quantised angles and their differences. The first two ticks show no speed: there is nothing to difference.
    fn measure(&mut self, seen: &Motors) -> (Motors, Motors) {
        let encoders = &self.arm.encoders;
        let counts = seen.map(|angle| encoders.quantise(angle));
        let raw = match (self.ticks, self.counts) {
            (0 | 1, _) | (_, None) => [0.0; JOINTS],
            (_, Some(before)) => std::array::from_fn(|i| encoders.speed(counts[i], before[i])),
        };
        let speeds = match &mut self.filter {
            None => raw,
            Some(filter) => filter.pass(&raw),
        };
        self.counts = Some(counts);
        self.ticks += 1;
        (counts.map(|count| count * encoders.rad_per_count()), speeds)
    }
}

/// The low-pass that older builds of the control software have.
#[derive(Debug, Clone)]
struct SpeedFilter {
    b: [f64; 4],
    a: [f64; 3],
    inputs: [Motors; 4],
    outputs: [Motors; 3],
}

impl SpeedFilter {
    fn new(plant: &PlantFile) -> Self {
        let filter = &plant.sampling.alternative_filter;
        Self { b: filter.b, a: filter.a_feedback, inputs: [[0.0; JOINTS]; 4], outputs: [[0.0; JOINTS]; 3] }
    }

    fn pass(&mut self, speeds: &Motors) -> Motors {
        self.inputs.rotate_right(1);
        self.inputs[0] = *speeds;
        let out = std::array::from_fn(|i| {
            let forward: f64 = (0..4).map(|k| self.b[k] * self.inputs[k][i]).sum();
            forward + (0..3).map(|k| self.a[k] * self.outputs[k][i]).sum::<f64>()
        });
        self.outputs.rotate_right(1);
        self.outputs[0] = out;
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm::Raven2;

    #[test]
    fn a_constant_speed_passes_the_filter_unchanged_after_a_while() {
        let mut filter = SpeedFilter::new(Raven2::nominal().plant());
        let mut out = [0.0; JOINTS];
        for _ in 0..200 {
            out = filter.pass(&[1.0; JOINTS]);
        }
        // The published coefficients have four digits: their gain at standstill is 1 within a thousandth or so.
        assert!((out[0] - 1.0).abs() < 5e-3, "{}", out[0]);
    }

    #[test]
    fn the_integral_of_the_tool_axes_grows_without_limit() {
        let raven = Raven2::nominal();
        let mut controller = Controller::new(raven.plant(), raven.arm(Side::Gold));
        let home = *raven.arm(Side::Gold).limits.home();
        let motors = raven.arm(Side::Gold).transmission.motors(&home);
        let mut wanted = home;
        wanted[3] += 0.1;
        let first = controller.tick(&motors, &wanted);
        let mut last = first;
        for _ in 0..1000 {
            last = controller.tick(&motors, &wanted);
        }
        let grown = last.torque_nm[3] - first.torque_nm[3];
        let error = raven.plant().transmission.ratio[3] * 0.1;
        assert!((grown - 0.05 * error * 1.0).abs() < 1e-3, "{grown}");
    }
}
