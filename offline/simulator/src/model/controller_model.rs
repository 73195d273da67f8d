//! Gains of a robot's controller.

/// Gains of one joint, at the motor's shaft: N·m per rad of the motor (a force on the joint itself: N or N·m per joint unit).
///
/// `tau = kp e + ki ∫e + kd (velocity_share m_d' - m') + gravity_share g(q)`, `e = m_d - m`, and `g(q)` the motor torque that
/// holds the nominal arm, cables and coupling included, at the measured posture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ControllerNumbers {
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain.
    pub ki: f64,
    /// Derivative gain.
    pub kd: f64,
    /// How much of the commanded speed the derivative part follows: 0 damps the motion, 1 damps the error.
    pub velocity_share: f64,
    /// How much of the arm's weight is fed forward.
    pub gravity_share: f64,
}

/// A controller: one set of gains per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerModel {
    /// Time between two commands to the motors, s.
    pub period_s: f64,
    /// Cycles between measurement and use.
    pub delay_cycles: u32,
    /// Gains.
    pub joints: Vec<ControllerNumbers>,
}

/// Name of a gain, how to read it, how to write it.
pub(super) type Gain = (&'static str, fn(&ControllerNumbers) -> f64, fn(&mut ControllerNumbers, f64));

/// Arrays of `[controller]`, one number per joint.
pub(super) const GAINS: [Gain; 5] = [
    ("kp", |gains| gains.kp, |gains, value| gains.kp = value),
    ("ki", |gains| gains.ki, |gains, value| gains.ki = value),
    ("kd", |gains| gains.kd, |gains, value| gains.kd = value),
    ("velocity_share", |gains| gains.velocity_share, |gains, value| gains.velocity_share = value),
    ("gravity_share", |gains| gains.gravity_share, |gains, value| gains.gravity_share = value),
];
