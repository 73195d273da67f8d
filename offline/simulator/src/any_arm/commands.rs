//! Where an arm from a URDF is sent: reaches inside the limits that its file gives.

use arm::serial::JointKind;

use crate::model::RobotModel;
use crate::plant::{JOINTS_MAX, Vector};
use crate::random::Random;
use crate::trajectory::{Range, Trajectory, teleoperation_within};

/// Share of a known range that is left free at either end.
const MARGIN: f64 = 0.05;
/// Half the range where nothing is known, rad and m **(assumed)**.
const UNKNOWN: (f64, f64) = (0.5, 0.05);
/// Share of the largest speed that is asked for, where one is known.
const SPEED_SHARE: f64 = 0.25;
/// Time in which a joint crosses its range at its fastest, s: surgeons' speeds **(assumed)**.
const CROSSING_S: f64 = 1.5;

/// Range of each joint that trajectories use, rad or m; of no width beyond the arm's joints.
pub fn ranges(model: &RobotModel) -> [Range; JOINTS_MAX] {
    let mut out = [(0.0, 0.0); JOINTS_MAX];
    for (range, body) in out.iter_mut().zip(model.arm().bodies()) {
        let (joint, limits) = (&body.joint, &body.joint.limits);
        let half = if joint.kind == JointKind::Prismatic { UNKNOWN.1 } else { UNKNOWN.0 };
        let (low, high) = match (limits.lower.is_finite(), limits.upper.is_finite()) {
            (true, true) => (limits.lower, limits.upper),
            (true, false) => (limits.lower, limits.lower + 2.0 * half),
            (false, true) => (limits.upper - 2.0 * half, limits.upper),
            (false, false) => (-half, half),
        };
        *range = (low + MARGIN * (high - low), high - MARGIN * (high - low));
    }
    out
}

/// Fastest commanded speeds, rad/s or m/s.
pub fn speeds(model: &RobotModel) -> Vector {
    let (ranges, arm) = (ranges(model), model.arm());
    std::array::from_fn(|joint| {
        let known = arm.bodies().get(joint).map_or(f64::INFINITY, |body| body.joint.limits.velocity);
        ((ranges[joint].1 - ranges[joint].0) / CROSSING_S).min(SPEED_SHARE * known).max(f64::MIN_POSITIVE)
    })
}

/// Reaches as in teleoperation for a time, s, from a posture that the seed decides.
pub fn trajectory(model: &RobotModel, seed: u64, duration_s: f64) -> Trajectory<JOINTS_MAX> {
    let ranges = ranges(model);
    let mut random = Random::new(seed, 5);
    let start = ranges.map(|(low, high)| random.between(low + 0.3 * (high - low), high - 0.3 * (high - low)));
    teleoperation_within(seed, start, &ranges, &speeds(model), duration_s)
}
