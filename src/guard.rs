//! Admission of the 118 inputs, before any arithmetic on them.
//!
//! The network cannot be trusted to show a bad input: sigmoids saturate, and some runtimes turn NaN into a plausible number. So every
//! feature is compared with what the robot can produce at all ([`IMPOSSIBLE`]), with the range the model was trained on, and the
//! features together with the trained domain by one scalar distance.

use ravenpose_wire::{FEATURES, RavenState, flag};

/// Closed interval of a feature; outside of it the robot cannot be (units as published).
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// First feature.
    pub start: usize,
    /// Number of features.
    pub count: usize,
    /// Smallest possible value.
    pub min: f32,
    /// Largest possible value.
    pub max: f32,
}

const fn limit(start: usize, count: usize, min: f32, max: f32) -> Limit {
    Limit { start, count, min, max }
}

/// Limits that no RAVEN-II can leave, with a margin for homing errors. Sources: `raven2-plant.md` section 4 (hard stops), section 3
/// (ratios), `raven2-plant.toml` (`dac_trip`, encoder), motor no-load speed 7580 rpm = 45,480 deg/s with a missed cycle in mind.
pub const IMPOSSIBLE: [Limit; 31] = [
    limit(0, 6, -500_000.0, 500_000.0), // pos, pos_d: the tip is within 0.5 m of the remote centre
    limit(6, 18, -1.001, 1.001),        // ori, ori_d
    limit(24, 8, -8_000_000.0, 8_000_000.0), // encVals: short of the wrap of a 24-bit counter
    limit(32, 8, -20_000.0, 20_000.0),  // dac_val: above it the controller stops the robot
    limit(40, 8, -100.0, 100.0),        // tau
    limit(48, 8, -200_000.0, 200_000.0), // mpos: the longest travel is 0.6 m x 2158.6 rad/m = 74,000 deg, plus coupling
    limit(56, 1, -10.0, 100.0),         // jpos: stops 0 and 90 deg, 10 deg of homing error
    limit(57, 1, 35.0, 147.5),          // stops 45 and 137.5 deg
    limit(58, 1, 10.3, 34.4),           // 0.18 to 0.6 m (stops 0.23 and 0.562 m) x 57.29578
    limit(59, 1, -720.0, 720.0),        // slot 3 belongs to no joint
    limit(60, 1, -360.0, 360.0),        // stop 330 deg
    limit(61, 1, -120.0, 120.0),        // stop 100 deg
    limit(62, 2, -140.0, 140.0),        // stops 120 deg
    limit(64, 8, -100_000.0, 100_000.0), // mvel
    limit(72, 2, -900.0, 900.0),        // jvel: mvel / ratio
    limit(74, 1, -50.0, 50.0),          // 0.87 m/s
    limit(75, 1, -720.0, 720.0),        // slot 3
    limit(76, 4, -20_000.0, 20_000.0),  // published as 0
    limit(80, 8, -200_000.0, 200_000.0), // mpos_d
    limit(88, 1, -10.0, 100.0),         // jpos_d, as jpos
    limit(89, 1, 35.0, 147.5),
    limit(90, 1, 10.3, 34.4),
    limit(91, 1, -720.0, 720.0),
    limit(92, 1, -360.0, 360.0),
    limit(93, 1, -120.0, 120.0),
    limit(94, 2, -140.0, 140.0),
    limit(96, 1, -7.0, 7.0),                  // grasp_d, rad
    limit(97, 8, -8_000_000.0, 8_000_000.0),  // encoffsets
    limit(105, 6, -1_000_000.0, 1_000_000.0), // jac_vel
    limit(111, 6, -1_000_000.0, 1_000_000.0), // jac_f
    limit(117, 1, 0.0, 0.1),                  // dt, s
];

/// Features compared at once, for vector registers.
const LANES: usize = 8;
/// First of the nine numbers of the reported orientation.
const ORIENTATION: usize = 6;
/// By how much products of its rows may be off those of a rotation: logs keep a few digits.
const OF_ROTATION: f32 = 0.05;

/// The region that a model was trained on, from the model's metadata.
#[derive(Debug, Clone)]
pub struct Domain {
    /// Smallest value of each feature in training.
    pub min: [f32; FEATURES],
    /// Largest value of each feature in training.
    pub max: [f32; FEATURES],
    /// Centre of the trained domain.
    pub center: [f32; FEATURES],
    /// Weight of each feature in the distance; 0 leaves it out.
    pub weight: [f32; FEATURES],
    /// Distance at the edge of the domain; the score is distance / limit.
    pub limit: f32,
}

/// Which states a model may be used with, whatever the features are. An empty list allows every one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Allowed {
    /// Run levels of the controller.
    pub runlevels: Vec<i32>,
    /// Numbers of the arm's board (`type` of the state): another board is another arm.
    pub boards: Vec<i32>,
}

impl Allowed {
    /// May this arm of this state be corrected?
    pub fn allows(&self, state: &RavenState, arm: usize) -> bool {
        let is_in = |list: &[i32], value: Option<&i32>| list.is_empty() || value.is_some_and(|value| list.contains(value));
        is_in(&self.runlevels, Some(&state.runlevel)) && is_in(&self.boards, state.type_.get(arm))
    }
}

/// What the guard found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Reasons for fallback, bits of [`flag`]; 0 if admitted.
    pub reasons: u32,
    /// Distance from the trained domain, 1 at its edge; -1 where it was not computed.
    pub score: f32,
}

/// Checks the inputs of one arm.
#[derive(Debug, Clone)]
pub struct Guard {
    min: [f32; FEATURES],
    max: [f32; FEATURES],
    domain: Option<Box<Domain>>,
}

impl Guard {
    /// A guard for a model's domain, or with the robot's own limits alone.
    pub fn new(domain: Option<Domain>) -> Self {
        let mut guard = Self { min: [0.0; FEATURES], max: [0.0; FEATURES], domain: domain.map(Box::new) };
        for limit in &IMPOSSIBLE {
            for feature in limit.start..limit.start + limit.count {
                guard.min[feature] = limit.min;
                guard.max[feature] = limit.max;
            }
        }
        guard
    }

    /// The closed interval of what the robot can produce, for one feature.
    pub fn possible(&self, feature: usize) -> (f32, f32) {
        (self.min[feature], self.max[feature])
    }

    /// Checks one arm's features.
    pub fn check(&self, features: &[f32; FEATURES]) -> Verdict {
        let mut possible = is_inside(features, &self.min, &self.max);
        // The limits are finite: what is inside is so.
        if !possible && !features.iter().all(|value| value.is_finite()) {
            return Verdict { reasons: flag::INPUT_NOT_FINITE, score: -1.0 };
        }
        possible &= features[ORIENTATION..].first_chunk().is_some_and(is_orientation);
        let mut verdict = Verdict { reasons: if possible { 0 } else { flag::INPUT_IMPOSSIBLE }, score: -1.0 };
        if let Some(domain) = &self.domain {
            domain.check(features, &mut verdict);
        }
        verdict
    }
}

/// Is each feature in its closed interval? NaN is in none.
fn is_inside(features: &[f32; FEATURES], min: &[f32; FEATURES], max: &[f32; FEATURES]) -> bool {
    let is_in = |value: f32, min: f32, max: f32| u32::from(value >= min) & u32::from(value <= max);
    let (values, rest) = features.as_chunks::<LANES>();
    let ((min, least), (max, most)) = (min.as_chunks::<LANES>(), max.as_chunks::<LANES>());
    let mut inside = [1; LANES];
    for ((values, min), max) in values.iter().zip(min).zip(max) {
        for lane in 0..LANES {
            inside[lane] &= is_in(values[lane], min[lane], max[lane]);
        }
    }
    let rest = rest.iter().zip(least).zip(most).fold(1, |all, ((value, min), max)| all & is_in(*value, *min, *max));
    inside.iter().fold(rest, |all, lane| all & lane) == 1
}

/// Is it a rotation, right-handed? Nine zeros are a log that does not say.
fn is_orientation(numbers: &[f32; 9]) -> bool {
    let [ax, ay, az, bx, by, bz, cx, cy, cz] = *numbers;
    let lengths = [ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz];
    if lengths == [0.0; 3] {
        return true;
    }
    let volume = (ay * bz - az * by) * cx + (az * bx - ax * bz) * cy + (ax * by - ay * bx) * cz;
    // Rows of length one span a volume of one only where they are at right angles.
    lengths.iter().chain([&volume]).all(|one| (one - 1.0).abs() <= OF_ROTATION)
}

impl Domain {
    #[expect(clippy::neg_cmp_op_on_partial_ord, reason = "written so that NaN fails")]
    fn check(&self, features: &[f32; FEATURES], verdict: &mut Verdict) {
        let (values, rest) = features.as_chunks::<LANES>();
        let ((centers, last_centers), (weights, last_weights)) =
            (self.center.as_chunks::<LANES>(), self.weight.as_chunks::<LANES>());
        let square = |value: f32, center: f32, weight: f32| ((value - center) * weight) * ((value - center) * weight);
        let mut lanes = [0.0_f32; LANES];
        for ((values, centers), weights) in values.iter().zip(centers).zip(weights) {
            for lane in 0..LANES {
                lanes[lane] += square(values[lane], centers[lane], weights[lane]);
            }
        }
        let rest =
            rest.iter().zip(last_centers).zip(last_weights).map(|((value, center), weight)| square(*value, *center, *weight));
        let squares = lanes.into_iter().chain(rest).sum::<f32>();
        verdict.score = squares.sqrt() / self.limit;
        if !is_inside(features, &self.min, &self.max) {
            verdict.reasons |= flag::OUT_OF_RANGE;
        }
        // Written so that a NaN score is outside.
        if !(verdict.score <= 1.0) {
            verdict.reasons |= flag::OUT_OF_DOMAIN;
        }
        if !verdict.score.is_finite() {
            verdict.score = f32::MAX;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn domain() -> Domain {
        Domain { min: [-10.0; FEATURES], max: [10.0; FEATURES], center: [0.0; FEATURES], weight: [0.1; FEATURES], limit: 5.0 }
    }

    /// Zeros, but for what no robot has: joints within their stops.
    fn features() -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        for feature in [57, 58, 89, 90] {
            features[feature] = Guard::new(None).possible(feature).0;
        }
        features
    }

    #[test]
    fn the_trained_range_is_exact_for_each_feature() {
        for feature in 0..FEATURES {
            let mut domain = domain();
            let value = features()[feature];
            domain.max = [200_000.0; FEATURES];
            domain.weight = [0.0; FEATURES];
            (domain.min[feature], domain.max[feature]) = (value, value);
            let guard = Guard::new(Some(domain));
            let mut tried = features();
            assert_eq!(guard.check(&tried).reasons & flag::OUT_OF_RANGE, 0, "{feature}");
            tried[feature] = value.next_up();
            assert_ne!(guard.check(&tried).reasons & flag::OUT_OF_RANGE, 0, "{feature}");
            tried[feature] = value.next_down();
            assert_ne!(guard.check(&tried).reasons & flag::OUT_OF_RANGE, 0, "{feature}");
        }
    }

    #[test]
    fn what_is_not_finite_is_said_of_each_feature() {
        for (feature, value) in (0..FEATURES).flat_map(|feature| [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|v| (feature, v)))
        {
            let mut tried = features();
            tried[feature] = value;
            assert_eq!(Guard::new(Some(domain())).check(&tried).reasons, flag::INPUT_NOT_FINITE, "{feature} {value}");
        }
        assert!(IMPOSSIBLE.iter().all(|limit| limit.min.is_finite() && limit.max.is_finite()));
    }

    #[test]
    fn an_orientation_is_a_rotation_or_not_reported() {
        let (sin, cos) = 0.7_f32.sin_cos();
        let turned = [cos, -sin, 0.0, 0.6 * sin, 0.6 * cos, -0.8, 0.8 * sin, 0.8 * cos, 0.6];
        let of = |change: &dyn Fn(&mut [f32])| {
            let mut tried = features();
            tried[6..15].copy_from_slice(&turned);
            change(&mut tried[6..15]);
            Guard::new(None).check(&tried).reasons
        };
        assert_eq!(of(&|_| {}), 0);
        assert_eq!(of(&|ori| ori.fill(0.0)), 0, "not reported");
        // Three digits, as some logs have it.
        assert_eq!(of(&|ori| ori.iter_mut().for_each(|part| *part = (*part * 1000.0).round() / 1000.0)), 0);
        let half = |ori: &mut [f32]| ori.iter_mut().for_each(|part| *part *= 0.5);
        let mirrored = |ori: &mut [f32]| ori[..3].iter_mut().for_each(|part| *part = -*part);
        let doubled = |ori: &mut [f32]| ori.copy_within(0..3, 3);
        let of_another = |ori: &mut [f32]| ori[..3].copy_from_slice(&[1.0, 0.0, 0.0]);
        for change in [&half as &dyn Fn(&mut [f32]), &mirrored, &doubled, &of_another] {
            assert_eq!(of(change), flag::INPUT_IMPOSSIBLE);
        }
    }

    #[test]
    fn features_that_are_plausible_alone_may_be_outside_together() {
        let mut domain = domain();
        domain.max = [200.0; FEATURES];
        domain.center = features();
        let guard = Guard::new(Some(domain));
        let mut tried = features();
        assert_eq!(guard.check(&tried), Verdict { reasons: 0, score: 0.0 });
        // 25 features at 10: the distance is 5 x 10 x 0.1 = 5, the edge.
        tried[97..105].fill(10.0);
        tried[40..57].fill(10.0);
        let edge = guard.check(&tried);
        assert!((edge.score - 1.0).abs() < 1e-6 && edge.reasons == 0, "{edge:?}");
        tried[32] = 5.0;
        let beyond = guard.check(&tried);
        assert!(beyond.score > 1.0);
        assert_eq!(beyond.reasons, flag::OUT_OF_DOMAIN);
    }

    #[test]
    fn a_distance_that_overflows_is_outside_and_finite() {
        let mut domain = domain();
        domain.weight = [f32::MAX; FEATURES];
        let verdict = Guard::new(Some(domain)).check(&features());
        assert_ne!(verdict.reasons & flag::OUT_OF_DOMAIN, 0);
        assert!(verdict.score.is_finite());
    }
}
