//! One motor and the cable to its joint: what of the plant belongs to one joint alone.

use crate::physics::{
    Backlash, CableCreep, CableHysteresis, CableStretch, CoulombFriction, LoadDependentFriction, MotorTorqueScale,
    PulleyEccentricity, StribeckFriction, ThermalDrift, TorqueRipple, TransmissionRatio, ViscousFriction, smooth_sign,
};

use super::DriveNumbers;
use super::dragged::Held;
use super::rub::Rub;
use super::timed::{Timed, on};

/// Nominal numbers and all effects of one drive.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drive {
    pub(crate) nominal: DriveNumbers,
    pub(crate) coulomb: Vec<Timed<CoulombFriction>>,
    pub(crate) viscous: Vec<Timed<ViscousFriction>>,
    pub(crate) stribeck: Vec<Timed<StribeckFriction>>,
    pub(crate) load: Vec<Timed<LoadDependentFriction>>,
    /// Friction before the cable, in units of the joint.
    pub(crate) on_motor: Vec<Timed<Rub>>,
    pub(crate) backlash: Vec<Timed<Backlash>>,
    pub(crate) stretch: Vec<Timed<CableStretch>>,
    /// With the place of the memory in the plant's auxiliary state; at most one.
    pub(crate) hysteresis: Vec<(Timed<CableHysteresis>, usize)>,
    pub(crate) creep: Vec<(Timed<CableCreep>, usize)>,
    pub(crate) thermal: Vec<(Timed<ThermalDrift>, usize)>,
    pub(crate) ripple: Vec<Timed<TorqueRipple>>,
    pub(crate) scale: Vec<Timed<MotorTorqueScale>>,
    pub(crate) ratio: Vec<Timed<TransmissionRatio>>,
    pub(crate) eccentricity: Vec<Timed<PulleyEccentricity>>,
    /// Sum of the offsets that act now, joint units.
    pub(crate) offset: f64,
    /// Joint friction that holds at rest.
    pub(crate) stiction: Option<Stiction>,
    /// What the motor drags along.
    pub(crate) dragged: Option<Held>,
}

/// Friction whose sign is a memory instead of a function of the speed (Dahl 1968): a joint that stands keeps it, so it does
/// not creep under load as with a smoothed sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stiction {
    /// Travel over which the sign turns, rad or m.
    pub(crate) presliding: f64,
    /// Place of the memory.
    pub(crate) slot: usize,
}

impl Stiction {
    /// Rate of the sign. Over one step it turns at most once: at speed the travel of a step is longer than the presliding.
    #[inline]
    pub(crate) fn rate(&self, speed: f64, sign: f64, step_s: f64) -> f64 {
        (speed - speed.abs() * sign) / self.presliding.max(speed.abs() * step_s)
    }
}

/// What the cable does at one deflection.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Elastic {
    /// Torque on the joint's side, N·m or N.
    pub(crate) torque: f64,
    /// Slope, N·m/rad or N/m.
    pub(crate) stiffness: f64,
    /// N·m·s/rad or N·s/m.
    pub(crate) damping: f64,
}

/// Friction level and slopes of a joint at one speed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Friction {
    /// Torque that does not depend on the load, N·m or N.
    pub(crate) torque: f64,
    /// Torque per load.
    pub(crate) per_load: f64,
    /// Smoothed sign of the speed.
    pub(crate) sign: f64,
    /// Slope of the chord through the origin, torque per speed: never less than the tangent, so an implicit step that uses it
    /// does not overshoot standstill.
    pub(crate) slope: f64,
    /// Chord of the sign, 1 over speed.
    pub(crate) sign_slope: f64,
}

impl Drive {
    pub(crate) fn new(nominal: DriveNumbers) -> Self {
        Self {
            nominal,
            coulomb: Vec::new(),
            viscous: Vec::new(),
            stribeck: Vec::new(),
            load: Vec::new(),
            on_motor: Vec::new(),
            backlash: Vec::new(),
            stretch: Vec::new(),
            hysteresis: Vec::new(),
            creep: Vec::new(),
            thermal: Vec::new(),
            ripple: Vec::new(),
            scale: Vec::new(),
            ratio: Vec::new(),
            eccentricity: Vec::new(),
            offset: 0.0,
            stiction: None,
            dragged: None,
        }
    }

    /// Switches effects on and off; returns whether any was switched.
    pub(crate) fn at(&mut self, time_s: f64) -> bool {
        let mut switched = false;
        self.coulomb.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.viscous.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.stribeck.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.load.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.on_motor.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.backlash.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.stretch.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.hysteresis.iter_mut().for_each(|(effect, _)| switched |= effect.at(time_s));
        self.creep.iter_mut().for_each(|(effect, _)| switched |= effect.at(time_s));
        self.thermal.iter_mut().for_each(|(effect, _)| switched |= effect.at(time_s));
        self.ripple.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.scale.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.ratio.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.eccentricity.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        switched
    }

    /// Does the position that the motor gives differ from the one that the controller believes?
    pub(crate) fn is_shifted(&self) -> bool {
        !(self.ratio.is_empty() && self.eccentricity.is_empty()) || self.offset != 0.0
    }

    /// What is added to the position that the controller believes, joint units, and the slope of that.
    pub(crate) fn shift(&self, position: f64) -> (f64, f64) {
        let (mut shift, mut slope) = (self.offset, 0.0);
        for ratio in on(&self.ratio) {
            shift += ratio.shift(position - self.nominal.home);
            slope += ratio.e;
        }
        for pulley in on(&self.eccentricity) {
            let (value, rise) = pulley.shift(position);
            shift += value;
            slope += rise;
        }
        (shift, slope)
    }

    /// Cable at a deflection and its rate; `aux` holds the memories.
    #[inline]
    pub(crate) fn elastic(&self, deflection: f64, rate: f64, aux: &[f64]) -> Elastic {
        let mut taken = deflection;
        for (creep, slot) in &self.creep {
            if creep.on {
                taken -= aux[*slot];
            }
        }
        let mut contact = 1.0;
        let mut loose = false;
        for backlash in on(&self.backlash).filter(|backlash| backlash.b > 0.0) {
            loose = true;
            taken = backlash.elastic(taken);
            contact = f64::min(contact, backlash.contact(taken));
        }
        let radius = self.nominal.radius_m;
        let share = |known: f64| in_series(on(&self.stretch).map(|stretch| stretch.share(known, radius * taken)));
        let mut found = match self.hysteresis.iter().find(|(cable, _)| cable.on) {
            None => {
                let known = radius * radius * self.nominal.cable.at(0.0).stiffness_n_m;
                let share = if self.stretch.is_empty() { 1.0 } else { share(known) };
                let cable = self.nominal.cable.at(radius * share * taken);
                let damping = self.damping(radius * radius * cable.damping_ns_m, known, share, radius * taken);
                Elastic { torque: radius * cable.force_n, stiffness: share * radius * radius * cable.stiffness_n_m, damping }
            }
            Some((cable, slot)) => {
                let share = share(cable.effect.k);
                let nominal = radius * radius * self.nominal.cable.at(0.0).damping_ns_m;
                Elastic {
                    torque: cable.effect.force(share * taken, aux[*slot]),
                    stiffness: share * cable.effect.slope(rate, aux[*slot]),
                    damping: self.damping(nominal, cable.effect.k, share, radius * taken),
                }
            }
        };
        found.damping *= contact;
        let damped = found.torque + found.damping * rate;
        // A flank pushes, it never pulls.
        found.torque = if !loose || damped * taken > 0.0 { damped } else { 0.0 };
        found
    }

    /// Damping of the known cable and the springs in series with it at low frequency: each by the square of its share of the deflection.
    fn damping(&self, own: f64, known: f64, share: f64, stretch_m: f64) -> f64 {
        let mut damping = share * share * own;
        for stretch in on(&self.stretch) {
            let part = share * (1.0 / stretch.share(known, stretch_m) - 1.0);
            damping += part * part * stretch.d;
        }
        damping
    }

    /// Friction of motor and gearbox at a motor speed: N·m at the capstan, and the chord.
    #[inline]
    pub(crate) fn motor_friction(&self, speed: f64, warm: f64) -> (f64, f64) {
        let DriveNumbers { motor, ratio, gear, .. } = &self.nominal;
        let (sign, chord) = sign_and_chord(speed, motor.width);
        let (mut level, mut one_sided, mut viscous) = (motor.coulomb, 0.0, motor.viscous);
        for rub in on(&self.on_motor) {
            let own = rub.at(speed / ratio, sign * ratio.signum());
            level += gear / ratio.abs() * own.level;
            one_sided += gear / ratio * own.one_sided;
            viscous += gear / (ratio * ratio) * own.viscous;
        }
        (warm * (level * sign + one_sided) + viscous * speed, warm * level * chord + viscous)
    }

    /// Friction of the joint at its speed.
    #[inline]
    pub(crate) fn joint_friction(&self, speed: f64, warm: f64, aux: &[f64]) -> Friction {
        let joint = &self.nominal.joint;
        let (sign, chord) = match self.stiction {
            None => sign_and_chord(speed, joint.width),
            Some(stiction) => (aux[stiction.slot], 0.0),
        };
        let mut level = joint.coulomb;
        let mut one_sided = 0.0;
        let mut viscous = joint.viscous;
        let mut per_load = 0.0;
        for friction in on(&self.coulomb) {
            level += friction.f_c;
            one_sided += friction.torque(sign) - friction.f_c * sign;
        }
        for friction in on(&self.viscous) {
            viscous += friction.b;
        }
        for friction in on(&self.stribeck) {
            level += friction.level(speed);
        }
        for friction in on(&self.load) {
            level += friction.f_0;
            per_load += friction.mu_l;
        }
        Friction {
            torque: warm * (level * sign + one_sided) + viscous * speed,
            per_load: (warm * per_load).min(PER_LOAD_MAX),
            sign,
            slope: warm * level * chord + viscous,
            sign_slope: chord,
        }
    }

    /// Slope of the motor's friction at standstill with every effect acting.
    pub(crate) fn steepest_motor_friction(&self) -> f64 {
        let DriveNumbers { motor, ratio, gear, .. } = &self.nominal;
        let slope = |rub: &Timed<Rub>| {
            let (level, viscous) = rub.effect.most();
            gear / ratio.abs() * level / motor.width + gear / (ratio * ratio) * viscous
        };
        motor.coulomb / motor.width + motor.viscous + self.on_motor.iter().map(slope).sum::<f64>()
    }

    /// Damping of the cable, at most: its own, and what every effect adds.
    pub(crate) fn steepest_damping(&self) -> f64 {
        let area = self.nominal.radius_m * self.nominal.radius_m;
        let cable = self.nominal.cable.at(0.0);
        let (known, nominal) = (area * cable.stiffness_n_m, area * cable.damping_ns_m);
        let stiffest = self.hysteresis.iter().map(|(hysteresis, _)| hysteresis.effect.k).fold(known, f64::max);
        let added = |stretch: &Timed<CableStretch>| (1.0 - stretch.effect.share(stiffest, 0.0)).powi(2) * stretch.effect.d;
        nominal + self.stretch.iter().map(added).sum::<f64>()
    }

    /// Slope of the joint's friction at standstill with every effect acting.
    pub(crate) fn steepest_friction(&self) -> f64 {
        let joint = &self.nominal.joint;
        let coulomb: f64 = self.coulomb.iter().map(|friction| friction.effect.f_c * (1.0 + friction.effect.asymmetry.abs())).sum();
        let stribeck: f64 = self.stribeck.iter().map(|friction| friction.effect.f_s.max(friction.effect.f_c)).sum();
        let load: f64 = self.load.iter().map(|friction| friction.effect.f_0).sum();
        let viscous: f64 = self.viscous.iter().map(|friction| friction.effect.b).sum();
        // A sign with memory has no slope over the speed.
        let level = if self.stiction.is_some() { 0.0 } else { joint.coulomb + coulomb + stribeck + load };
        level / joint.width + joint.viscous + viscous
    }

    /// Capstan torque that acts for a commanded one, without ripple, N·m.
    pub(crate) fn applied(&self, commanded_nm: f64) -> f64 {
        on(&self.scale).fold(commanded_nm, |torque, amplifier| amplifier.torque(torque, self.nominal.torque_per_count_nm))
    }

    /// What ripple takes off at a motor angle, N·m at the capstan.
    #[inline]
    pub(crate) fn ripple(&self, motor_rad: f64) -> f64 {
        let joint_side: f64 = on(&self.ripple).map(|ripple| ripple.torque(motor_rad)).sum();
        joint_side * self.nominal.gear / self.nominal.ratio
    }
}

/// Friction per load of all effects together, warm or not: from 1 on a load would not move by whatever pulls at it.
const PER_LOAD_MAX: f64 = 0.95;

/// Share of the deflection that falls on the known cable, of springs in series with it, each of which alone leaves it so much.
pub(crate) fn in_series(shares: impl Iterator<Item = f64>) -> f64 {
    // Compliances over the known one's add up.
    let added: Option<(usize, f64, f64)> =
        shares.map(|share| (1, share, 1.0 / share - 1.0)).reduce(|all, one| (all.0 + 1, one.1, all.2 + one.2));
    match added {
        None => 1.0,
        Some((1, share, _)) => share,
        Some((_, _, compliance)) => 1.0 / (1.0 + compliance),
    }
}

/// Smoothed sign and its chord, sign over speed.
#[inline]
fn sign_and_chord(speed: f64, width: f64) -> (f64, f64) {
    let sign = smooth_sign(speed, width);
    let chord = if speed.abs() < 1e-9 * width { 1.0 / width } else { sign / speed };
    (sign, chord)
}

#[cfg(test)]
mod tests {
    use super::in_series;

    #[test]
    fn compliances_of_springs_in_series_add_up() {
        assert_eq!(in_series(std::iter::empty()), 1.0);
        assert_eq!(in_series([0.3].into_iter()), 0.3);
        // Known spring and two more of its stiffness: a third of the way each.
        assert!((in_series([0.5, 0.5].into_iter()) - 1.0 / 3.0).abs() < 1e-15);
        assert!((in_series([0.5, 0.25, 0.5].into_iter()) - 1.0 / 6.0).abs() < 1e-15);
    }
}
