//! The controller of one joint: PD, or PID, on motor encoders, with gravity held by the laboratory's model of the arm.

use crate::arm::Drive;

/// Encoder counts per motor turn.
pub const COUNTS: f64 = 4000.0;

/// Samples per second of controller and recordings.
pub const RATE: f64 = 1000.0;

/// Share of a new difference in the velocity estimate, per sample.
const VELOCITY_SHARE: f64 = 0.25;

/// One motor encoder and the loop that is closed on it. Motor units: rad, N m before the gearbox.
#[derive(Clone, Debug)]
pub struct Loop {
    drive: Drive,
    stepped: bool,
    lost: f64,
    before: Option<(f64, f64)>,
    integral: f64,
    /// Position as the encoder shows it, rad.
    pub position: f64,
    /// Velocity as the controller estimates it, rad/s.
    pub velocity: f64,
    /// Factors of position and velocity gain.
    pub gains: (f64, f64),
}

impl Loop {
    /// `stepped`: the encoder shows whole counts; otherwise exact values, as a simulator has them.
    pub fn new(drive: &Drive, stepped: bool, speed: f64) -> Self {
        let drive = drive.clone();
        Self { drive, stepped, lost: 0.0, before: None, integral: 0.0, position: 0.0, velocity: speed, gains: (1.0, 1.0) }
    }

    /// Counts that went missing so far.
    pub fn lose(&mut self, counts: f64) {
        self.lost = counts;
    }

    /// Torque in N m from the true motor position, its command (both rad) and the torque that holds the arm.
    pub fn step(&mut self, truth: f64, command: f64, hold: f64) -> f64 {
        let count = std::f64::consts::TAU / COUNTS;
        let seen = if self.stepped { (truth / count).round() * count } else { truth } - self.lost * count;
        let (before, command_before) = self.before.unwrap_or((seen - self.velocity / RATE, command - self.velocity / RATE));
        self.velocity += VELOCITY_SHARE * ((seen - before) * RATE - self.velocity);
        self.position = seen;
        self.before = Some((seen, command));
        let error = command - seen;
        let wanted = (command - command_before) * RATE;
        let reach = self.drive.limit;
        self.integral = (self.integral + self.drive.ki * error / RATE).clamp(-0.1 * reach, 0.1 * reach);
        let torque = self.gains.0 * self.drive.kp * error + self.gains.1 * self.drive.kd * (wanted - self.velocity);
        (torque + self.integral + hold).clamp(-reach, reach)
    }
}
