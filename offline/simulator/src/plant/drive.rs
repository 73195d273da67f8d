//! One motor and the cable to its joint: what of the plant belongs to one joint alone.

use crate::physics::{
    Backlash, CableCreep, CableHysteresis, CableStretch, CoulombFriction, LoadDependentFriction, MotorTorqueScale,
    PulleyEccentricity, StribeckFriction, ThermalDrift, TorqueRipple, TransmissionRatio, ViscousFriction, smooth_sign,
};

use super::CableLaw;

/// An effect and the time in which it acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timed<T> {
    pub(crate) effect: T,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    pub(crate) on: bool,
}

impl<T> Timed<T> {
    pub(crate) fn new(effect: T, from_s: f64, to_s: f64) -> Self {
        Self { effect, from_s, to_s, on: from_s <= 0.0 }
    }

    /// Returns whether it was switched.
    pub(crate) fn at(&mut self, time_s: f64) -> bool {
        let before = std::mem::replace(&mut self.on, (self.from_s..self.to_s).contains(&time_s));
        before != self.on
    }
}

/// Effects that act now.
pub(crate) fn on<T>(effects: &[Timed<T>]) -> impl Iterator<Item = &T> {
    effects.iter().filter(|timed| timed.on).map(|timed| &timed.effect)
}

/// Friction of one side of a drive as the plant file has it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rubbing {
    /// N·m or N.
    pub coulomb: f64,
    /// Per rad/s or m/s.
    pub viscous: f64,
    /// Speed over which the sign is smoothed.
    pub width: f64,
}

/// What stands between a motor and its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// A cable: motor and joint move apart.
    #[default]
    Cable,
    /// Nothing that gives way: the motor turns with the joint, its inertia and friction act on it. The cable law, and what
    /// effects make of it, then lies between the joint and the ground (a benchmark's spring; of no stiffness for an arm).
    Rigid,
}

/// Spring and damper from a joint to the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Passive {
    /// N·m/rad or N/m.
    pub stiffness: f64,
    /// N·m·s/rad or N·s/m.
    pub damping: f64,
    /// Position at which the spring is at rest, rad or m.
    pub rest: f64,
}

impl Passive {
    /// Neither spring nor damper.
    pub const NONE: Self = Self { stiffness: 0.0, damping: 0.0, rest: 0.0 };
}

/// Nominal numbers of one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveNumbers {
    /// Motor rad per joint unit.
    pub ratio: f64,
    /// Shaft to capstan.
    pub gear: f64,
    /// Capstan N·m per motor rad/s².
    pub inertia: f64,
    /// Cable stretch per deflection, m per rad (joint 3: 1).
    pub radius_m: f64,
    /// Stretch to force.
    pub cable: CableLaw,
    /// Friction of motor and gearbox: N·m at the capstan, motor speed.
    pub motor: Rubbing,
    /// Friction of the joint: joint units.
    pub joint: Rubbing,
    /// Position at which a wrong ratio has no effect, joint units.
    pub home: f64,
    /// Capstan torque under which a motor warms up by one unit of heating, N·m.
    pub torque_ref_nm: f64,
    /// Capstan torque of one amplifier count, N·m.
    pub torque_per_count_nm: f64,
    /// What stands between motor and joint.
    pub between: Between,
    /// From the joint to the ground.
    pub passive: Passive,
}

/// Nominal numbers and all effects of one drive.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drive {
    pub(crate) nominal: DriveNumbers,
    pub(crate) coulomb: Vec<Timed<CoulombFriction>>,
    pub(crate) viscous: Vec<Timed<ViscousFriction>>,
    pub(crate) stribeck: Vec<Timed<StribeckFriction>>,
    pub(crate) load: Vec<Timed<LoadDependentFriction>>,
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
        }
    }

    /// Switches effects on and off; returns whether any was switched.
    pub(crate) fn at(&mut self, time_s: f64) -> bool {
        let mut switched = false;
        self.coulomb.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.viscous.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.stribeck.iter_mut().for_each(|effect| switched |= effect.at(time_s));
        self.load.iter_mut().for_each(|effect| switched |= effect.at(time_s));
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
        let share = |known: f64| on(&self.stretch).fold(1.0, |share, stretch| share * stretch.share(known, radius * taken));
        let mut found = match self.hysteresis.iter().find(|(cable, _)| cable.on) {
            None => {
                let known = radius * radius * self.nominal.cable.at(0.0).stiffness_n_m;
                let share = if self.stretch.is_empty() { 1.0 } else { share(known) };
                let cable = self.nominal.cable.at(radius * share * taken);
                let mut damping = radius * radius * cable.damping_ns_m;
                for stretch in on(&self.stretch) {
                    damping = stretch.damping(damping, share);
                }
                Elastic { torque: radius * cable.force_n, stiffness: share * radius * radius * cable.stiffness_n_m, damping }
            }
            Some((cable, slot)) => {
                let share = share(cable.effect.k);
                let nominal = radius * radius * self.nominal.cable.at(0.0).damping_ns_m;
                Elastic {
                    torque: cable.effect.force(share * taken, aux[*slot]),
                    stiffness: share * cable.effect.slope(rate, aux[*slot]),
                    damping: share * share * nominal,
                }
            }
        };
        found.damping *= contact;
        let damped = found.torque + found.damping * rate;
        // A flank pushes, it never pulls.
        found.torque = if !loose || damped * taken > 0.0 { damped } else { 0.0 };
        found
    }

    /// Rates of the memories of this drive, given the torque that the cable transmits.
    pub(crate) fn memories(&self, torque: f64, deflection_rate: f64, capstan_torque: f64, aux: &[f64], rates: &mut [f64]) {
        for (cable, slot) in &self.hysteresis {
            // Without contact the cable is not strained, and its memory stands.
            let strained = if self.backlash.is_empty() || torque != 0.0 { deflection_rate } else { 0.0 };
            let known = cable.effect.k;
            let share = on(&self.stretch).fold(1.0, |share, stretch| share * stretch.share(known, 0.0));
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
            let share = on(&self.stretch).fold(1.0, |share, stretch| share * stretch.share(known, 0.0));
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

    /// Friction of motor and gearbox at a motor speed: N·m at the capstan, and the chord.
    #[inline]
    pub(crate) fn motor_friction(&self, speed: f64, warm: f64) -> (f64, f64) {
        let motor = &self.nominal.motor;
        let (sign, chord) = sign_and_chord(speed, motor.width);
        let coulomb = warm * motor.coulomb;
        (coulomb * sign + motor.viscous * speed, coulomb * chord + motor.viscous)
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
            per_load: warm * per_load,
            sign,
            slope: warm * level * chord + viscous,
            sign_slope: chord,
        }
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

    /// Ripple at a motor angle, N·m at the capstan.
    #[inline]
    pub(crate) fn ripple(&self, motor_rad: f64) -> f64 {
        let joint_side: f64 = on(&self.ripple).map(|ripple| ripple.torque(motor_rad)).sum();
        joint_side * self.nominal.gear / self.nominal.ratio
    }
}

/// Smoothed sign and its chord, sign over speed.
#[inline]
fn sign_and_chord(speed: f64, width: f64) -> (f64, f64) {
    let sign = smooth_sign(speed, width);
    let chord = if speed.abs() < 1e-9 * width { 1.0 / width } else { sign / speed };
    (sign, chord)
}
