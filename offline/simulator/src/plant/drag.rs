//! What a drive drags along, step by step.

use super::dragged::Held;
use super::drive::Drive;

impl Drive {
    /// Torque of what it drags along, N·m at the capstan.
    #[inline]
    pub(crate) fn drag(&self, memories: &[f64]) -> f64 {
        self.dragged.map_or(0.0, |held| held.dragged.torque(memories[held.strain], memories[held.faded]))
    }

    /// Rates of its memories at a motor speed.
    #[inline]
    pub(crate) fn drag_rates(&self, speed: f64, memories: &[f64], rates: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            rates[strain] = speed;
            rates[faded] = (dragged.fades(speed) - memories[faded]) / dragged.memory_s;
        }
    }

    /// Lets it slip where it was strained beyond its level.
    #[inline]
    pub(crate) fn slip(&self, memories: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            memories[strain] = dragged.torque(memories[strain], memories[faded]) / dragged.stiffness_nm_rad;
        }
    }

    /// Carries its memories over a time at a constant motor speed.
    pub(crate) fn drag_on(&self, speed: f64, step_s: f64, memories: &mut [f64]) {
        if let Some(Held { dragged, strain, faded }) = self.dragged {
            memories[strain] += step_s * speed;
            memories[faded] += -(-step_s / dragged.memory_s).exp_m1() * (dragged.fades(speed) - memories[faded]);
            self.slip(memories);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::DriveNumbers;
    use crate::plant::dragged::Dragged;

    const CABLES: Dragged = Dragged { stiffness_nm_rad: 0.02, level_nm: 0.06, v_s_rad_s: 4.0, memory_s: 0.05 };

    fn drive() -> Drive {
        let robot = crate::Robot::nominal();
        let numbers: DriveNumbers = crate::robot_plant::base_drive(&robot, arm::Side::Gold, 2);
        let mut drive = Drive::new(numbers);
        drive.dragged = Some(Held { dragged: CABLES, strain: 0, faded: 1 });
        drive
    }

    #[test]
    fn it_pulls_like_a_spring_and_slips_at_its_level() {
        let (drive, mut memories) = (drive(), [0.0; 2]);
        // So slowly that nothing fades: 1 rad of motor in 1000 s.
        for _ in 0..1000 {
            drive.drag_on(1e-3, 1.0, &mut memories);
        }
        assert!((drive.drag(&memories) - 0.02).abs() < 1e-4, "{memories:?}");
        for _ in 0..9000 {
            drive.drag_on(1e-3, 1.0, &mut memories);
        }
        assert!((drive.drag(&memories) - 0.06).abs() < 1e-4, "{memories:?}");
        // It sits where it slipped to: one rad back, the spring has given up 0.02.
        for _ in 0..1000 {
            drive.drag_on(-1e-3, 1.0, &mut memories);
        }
        assert!((drive.drag(&memories) - 0.04).abs() < 1e-4, "{memories:?}");
    }

    #[test]
    fn its_level_fades_while_it_is_moved_and_comes_back() {
        let (drive, mut memories) = (drive(), [0.0; 2]);
        for _ in 0..1000 {
            drive.drag_on(8.0, 1e-3, &mut memories);
        }
        let slipping = drive.drag(&memories);
        assert!((slipping - 0.06 * (-2.0_f64).exp()).abs() < 1e-6, "{slipping}");
        for _ in 0..500 {
            drive.drag_on(0.0, 1e-3, &mut memories);
        }
        assert!(memories[1] < 1e-4 && (drive.drag(&memories) - slipping).abs() < 1e-12, "{memories:?}");
    }

    #[test]
    fn steps_of_the_plant_and_the_inverse_carry_it_alike() {
        let drive = drive();
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        for k in 0..4000 {
            let speed = 6.0 * (f64::from(k) * 2e-3).sin();
            drive.drag_on(speed, 1e-3, &mut a);
            let mut rates = [0.0; 2];
            drive.drag_rates(speed, &b, &mut rates);
            b.iter_mut().zip(rates).for_each(|(x, rate)| *x += 1e-3 * rate);
            drive.slip(&mut b);
            assert!((drive.drag(&a) - drive.drag(&b)).abs() < 1e-3, "row {k}: {a:?} {b:?}");
        }
    }
}
