//! Made-up motion for when no recording is at hand: smooth sums of sines round the home pose, both arms, all joints, and
//! everything that a controller would report about it. The same seed gives the same states on every machine of one
//! floating-point library.

use arm::{Arm, JOINTS, Joints, Motors, Raven2, Side};
use ravenpose_wire::RavenState;

use crate::sample::{self, ArmSample, Cycle};
use crate::states::{Arms, States};

/// Sines per joint.
const WAVES: usize = 4;

/// Slowest and fastest sine, Hz: hand motion, and slow enough that no amplifier is clipped for long.
const FREQUENCY_HZ: (f64, f64) = (0.02, 0.2);

/// Share of the way from home to the nearer limit that the sines reach together at most.
const REACH: f64 = 0.5;

/// Largest insertion at which the pose is far from the remote centre of motion (raven2-plant.md, section 2), m.
const INSERTION_MAX_M: f64 = 0.44;

/// Longest synthetic recording, s: two hours, some 8 GB of states.
pub const DURATION_MAX_S: f64 = 7200.0;

/// The duration is not usable.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("synthetic motion of {duration_s} s cannot be made; ask for more than 0 and at most {DURATION_MAX_S} s")]
pub struct DurationError {
    /// What was asked for, s.
    pub duration_s: f64,
}

/// Synthetic states at 1 kHz.
///
/// # Errors
/// [`DurationError`] for a duration that is not in `0..=DURATION_MAX_S` or shorter than one period.
pub fn states(seed: u64, duration_s: f64, arms: Arms) -> Result<States, DurationError> {
    let motion = Synthetic::new(seed, arms);
    let count = (duration_s / motion.period_s).round();
    if !(1.0..=DURATION_MAX_S / motion.period_s).contains(&count) {
        return Err(DurationError { duration_s });
    }
    let states = (0..count as u64).map(|index| motion.state(index)).collect();
    let notes = vec![format!(
        "Synthetic motion, seed {seed}: sums of sines round the home pose with the nominal arm, friction and controller; no recording."
    )];
    Ok(States { states, notes })
}

/// A synthetic motion; any cycle of it can be asked for.
#[derive(Debug, Clone)]
pub struct Synthetic {
    period_s: f64,
    arms: Vec<MovingArm>,
}

impl Synthetic {
    /// The motion that belongs to a seed. An arm moves the same whether the other one is shown or not.
    pub fn new(seed: u64, arms: Arms) -> Self {
        let raven = Raven2::nominal();
        let arms = arms.sides().iter().map(|side| MovingArm::new(raven, *side, seed)).collect();
        Self { period_s: raven.plant().sampling.period_s, arms }
    }

    /// State of a cycle, counted from 0.
    pub fn state(&self, index: u64) -> RavenState {
        let period_ns = (self.period_s * 1e9).round() as i64;
        let since_start_ns = index as i64 * period_ns;
        let cycle = Cycle { index, since_start_ns, stamp_ns: since_start_ns, dt_ns: period_ns };
        let mut state = sample::state_of(&cycle);
        for moving in &self.arms {
            sample::put(&mut state, &moving.arm, &moving.sample(index, self.period_s));
        }
        state
    }
}

/// One sine.
#[derive(Debug, Clone, Copy)]
struct Wave {
    amplitude: f64,
    rate_rad_s: f64,
    phase: f64,
}

#[derive(Debug, Clone)]
struct MovingArm {
    arm: Arm,
    waves: [[Wave; WAVES]; JOINTS],
    /// Friction as the motors feel it, N·m at the capstan: Coulomb, and per rad/s.
    friction: [(f64, f64); JOINTS],
    kp: Motors,
    kd: Motors,
}

impl MovingArm {
    fn new(raven: &Raven2, side: Side, seed: u64) -> Self {
        let arm = raven.arm(side);
        let plant = raven.plant();
        let mut random = SplitMix(seed ^ (side.index() as u64 + 1).wrapping_mul(0xa076_1d64_78bd_642f));
        let waves = std::array::from_fn(|joint| waves(reach(&arm, joint), &mut random));
        let friction = std::array::from_fn(|i| match i.checked_sub(3) {
            None => (plant.friction.motor_coulomb_nm[i], plant.friction.motor_viscous_nm_s[i]),
            Some(tool) => (plant.tool_axes.motor_coulomb_nm[tool], plant.tool_axes.motor_viscous_nm_s[tool]),
        });
        let kd = match side {
            Side::Gold => plant.control.kd_gold,
            Side::Green => plant.control.kd_green,
        };
        Self { arm, waves, friction, kp: plant.control.kp, kd }
    }

    /// Joint positions and rates at a time.
    fn motion(&self, time_s: f64) -> (Joints, Joints) {
        let home = self.arm.limits.home();
        let sum =
            |joint: usize, part: fn(&Wave, f64) -> f64| -> f64 { self.waves[joint].iter().map(|wave| part(wave, time_s)).sum() };
        let position = |wave: &Wave, t: f64| wave.amplitude * (wave.rate_rad_s * t + wave.phase).sin();
        let rate = |wave: &Wave, t: f64| wave.amplitude * wave.rate_rad_s * (wave.rate_rad_s * t + wave.phase).cos();
        (std::array::from_fn(|joint| home[joint] + sum(joint, position)), std::array::from_fn(|joint| sum(joint, rate)))
    }

    /// What the controller reports in a cycle: the motors one period ago through the encoders (raven2-plant.md, section 5).
    fn sample(&self, index: u64, period_s: f64) -> ArmSample {
        let time_s = index as f64 * period_s;
        let (counts, counts_before) = (self.counts(time_s - period_s), self.counts(time_s - 2.0 * period_s));
        let encoders = &self.arm.encoders;
        let motors = counts.map(|count| count * encoders.rad_per_count());
        let motor_speeds: Motors = std::array::from_fn(|i| encoders.speed(counts[i], counts_before[i]));
        let joints = self.arm.transmission.joints(&motors);
        let motors_d = self.commanded(time_s);
        let mut torque_nm = self.arm.amplifiers.proportional_derivative(&motors_d, &motors, &motor_speeds);
        for (torque, gravity) in torque_nm.iter_mut().zip(self.arm.gravity.capstan_torque(&joints)) {
            *torque += gravity;
        }
        let dac = std::array::from_fn(|i| self.arm.amplifiers.counts(i, torque_nm[i]));
        let joints_d = self.joints_of_command(&motors_d, motors[2]);
        let encoder_offsets = sample::ENCODER_OFFSETS[self.arm.side.index()];
        ArmSample { joints, joints_d, motors, motors_d, motor_speeds, torque_nm, dac, encoder_offsets }
    }

    fn counts(&self, time_s: f64) -> Motors {
        let motors = self.arm.transmission.motors(&self.motion(time_s).0);
        motors.map(|angle| self.arm.encoders.quantise(angle))
    }

    /// The command under which the controller would push against friction just so that the arm moves as it does.
    fn commanded(&self, time_s: f64) -> Motors {
        let (joints, rates) = self.motion(time_s);
        let motors = self.arm.transmission.motors(&joints);
        let speeds = self.arm.transmission.motors(&rates);
        std::array::from_fn(|i| {
            let (coulomb, viscous) = self.friction[i];
            let push_nm = coulomb * speeds[i].tanh() + (viscous + self.kd[i]) * speeds[i];
            motors[i] + push_nm / self.kp[i]
        })
    }

    /// Joints that a motor command stands for; its tool motors were computed with the measured motor 3.
    fn joints_of_command(&self, motors_d: &Motors, motor_3_measured: f64) -> Joints {
        let mut joints = self.arm.transmission.joints(motors_d);
        let mut with_measured = *motors_d;
        with_measured[2] = motor_3_measured;
        joints[3..].copy_from_slice(&self.arm.transmission.joints(&with_measured)[3..]);
        joints
    }
}

/// Largest excursion of a joint from home.
fn reach(arm: &Arm, joint: usize) -> f64 {
    let (home, min, max) = (arm.limits.home()[joint], arm.limits.min()[joint], arm.limits.max()[joint]);
    let max = if joint == 2 { max.min(INSERTION_MAX_M) } else { max };
    REACH * (home - min).min(max - home)
}

fn waves(reach: f64, random: &mut SplitMix) -> [Wave; WAVES] {
    let shares: [f64; WAVES] = std::array::from_fn(|_| 0.2 + random.share());
    let whole: f64 = shares.iter().sum();
    shares.map(|share| Wave {
        amplitude: reach * share / whole,
        rate_rad_s: std::f64::consts::TAU * (FREQUENCY_HZ.0 + (FREQUENCY_HZ.1 - FREQUENCY_HZ.0) * random.share()),
        phase: std::f64::consts::TAU * random.share(),
    })
}

/// SplitMix64 (Steele, Lea, Flood 2014): a few lines, the same numbers for ever.
struct SplitMix(u64);

impl SplitMix {
    /// A number in `0..1`.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
