//! What a drive remembers: hysteresis, creep, warmth.

use super::drive::{Drive, in_series};
use super::timed::on;

impl Drive {
    /// Rates of the memories of this drive, given the torque that the cable transmits.
    pub(crate) fn memories(&self, torque: f64, deflection_rate: f64, capstan_torque: f64, aux: &[f64], rates: &mut [f64]) {
        for (cable, slot) in &self.hysteresis {
            // Without contact the cable is not strained, and its memory stands.
            let strained = if self.backlash.is_empty() || torque != 0.0 { deflection_rate } else { 0.0 };
            let known = cable.effect.k;
            let share = in_series(on(&self.stretch).map(|stretch| stretch.share(known, 0.0)));
            rates[*slot] = if cable.on { cable.effect.memory_rate(share * strained, aux[*slot]) } else { 0.0 };
        }
        for (creep, slot) in &self.creep {
            rates[*slot] = if creep.on { creep.effect.rate(torque, aux[*slot]) } else { 0.0 };
        }
        for (drift, slot) in &self.thermal {
            let relative = capstan_torque / self.nominal.torque_ref_nm;
            rates[*slot] = if drift.on { drift.effect.rate(relative, aux[*slot]) } else { 0.0 };
        }
    }

    /// Strains the memory of a hysteresis by a change of the deflection.
    pub(crate) fn strain(&self, change: f64, aux: &mut [f64]) {
        for (cable, slot) in self.hysteresis.iter().filter(|(cable, _)| cable.on) {
            let known = cable.effect.k;
            let share = in_series(on(&self.stretch).map(|stretch| stretch.share(known, 0.0)));
            aux[*slot] += cable.effect.memory_rate(share * change, aux[*slot]);
        }
    }

    /// Carries creep and warmth over a time under constant torques, exactly.
    pub(crate) fn age(&self, torque: f64, capstan_torque: f64, step_s: f64, aux: &mut [f64]) {
        for (creep, slot) in self.creep.iter().filter(|(creep, _)| creep.on) {
            let share = -(-step_s / creep.effect.time_s).exp_m1();
            aux[*slot] += share * creep.effect.time_s * creep.effect.rate(torque, aux[*slot]);
        }
        let relative = capstan_torque / self.nominal.torque_ref_nm;
        for (drift, slot) in self.thermal.iter().filter(|(drift, _)| drift.on) {
            let share = -(-step_s / drift.effect.time_s).exp_m1();
            aux[*slot] += share * drift.effect.time_s * drift.effect.rate(relative, aux[*slot]);
        }
    }

    /// Capstan torque that must be commanded for one to act, N·m: the inverse of [`Self::applied`].
    pub(crate) fn commanded(&self, acting_nm: f64) -> f64 {
        let per_count = self.nominal.torque_per_count_nm;
        self.scale
            .iter()
            .rev()
            .filter(|scale| scale.on)
            .fold(acting_nm, |torque, scale| torque / scale.effect.kappa + scale.effect.d_0 * per_count)
    }

    /// What of the Coulomb friction is left as the motor is warm.
    #[inline]
    pub(crate) fn warm_share(&self, aux: &[f64]) -> f64 {
        let warm = self.thermal.iter().filter(|(drift, _)| drift.on);
        warm.fold(1.0, |share, (drift, slot)| share * drift.effect.share(aux[*slot]))
    }
}
