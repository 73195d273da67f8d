//! Runs made up with a clock, a frame, noise and losses that are known.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};
use recordings::pairs::{Clock, Options, PairError, Paired, Reason, Reported, Rigid, Truth, pair};

/// SplitMix64 (Vigna).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    pub(crate) fn normal3(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }
}

/// What a run is made of.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) seed: u64,
    pub(crate) duration_s: f64,
    pub(crate) state_hz: f64,
    pub(crate) truth_hz: f64,
    pub(crate) offset_s: f64,
    pub(crate) drift: f64,
    /// Noise of the truth per axis, m.
    pub(crate) noise_m: f64,
    /// The arm's own slow error: standard deviation per axis, m, and correlation time, s.
    pub(crate) arm_error_m: f64,
    pub(crate) arm_error_s: f64,
    /// A constant error of the arm, m.
    pub(crate) arm_offset_m: Vector3<f64>,
    /// Share of frames that are lost, and that show something else.
    pub(crate) lost: f64,
    pub(crate) wrong: f64,
    pub(crate) motion: Motion,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Motion {
    Teleoperation,
    Still,
    Line,
    Circle,
    Loop,
}

impl Default for Case {
    fn default() -> Self {
        Self {
            seed: 1,
            duration_s: 60.0,
            state_hz: 1000.0,
            truth_hz: 15.0,
            offset_s: -0.6,
            drift: 0.0,
            noise_m: 0.5e-3,
            arm_error_m: 0.0,
            arm_error_s: 1.0,
            arm_offset_m: Vector3::zeros(),
            lost: 0.0,
            wrong: 0.0,
            motion: Motion::Teleoperation,
        }
    }
}

/// A made run with everything that is hidden from the code under test.
pub(crate) struct Run {
    pub(crate) t_s: Vec<f64>,
    pub(crate) position_m: [Vec<f64>; 3],
    pub(crate) truth: Truth,
    pub(crate) frame: Rigid,
    pub(crate) clock: Clock,
    pub(crate) lost: usize,
    pub(crate) wrong: Vec<usize>,
}

/// Tip over time: waves of several seconds, as a surgeon's hand has them.
pub(crate) struct Path {
    motion: Motion,
    waves: Vec<[(f64, f64, f64); 3]>,
}

impl Path {
    pub(crate) fn new(motion: Motion, random: &mut Random) -> Self {
        let waves = (0..7)
            .map(|_| std::array::from_fn(|_| (random.between(2e-3, 12e-3), random.between(0.04, 0.45), random.between(0.0, TAU))))
            .collect();
        Self { motion, waves }
    }

    fn wave(&self, axis: usize, t_s: f64) -> f64 {
        let sum: f64 = self.waves.iter().map(|wave| wave[axis].0 * (TAU * wave[axis].1 * t_s + wave[axis].2).sin()).sum();
        [-0.09, -0.02, 0.12][axis] + sum
    }

    pub(crate) fn at(&self, t_s: f64) -> Vector3<f64> {
        match self.motion {
            Motion::Teleoperation => Vector3::from_fn(|axis, _| self.wave(axis, t_s)),
            Motion::Still => Vector3::new(-0.09, -0.02, 0.12),
            Motion::Line => Vector3::new(-0.09, -0.02, 0.12) + Vector3::new(1.0, 2.0, -0.5) * self.wave(0, t_s),
            Motion::Circle => Vector3::new(0.03 * (2.0 * t_s).cos(), 0.03 * (2.0 * t_s).sin(), 0.1),
            // Closes after 2 s and has corners enough to know where on it one is.
            Motion::Loop => {
                let phase = std::f64::consts::PI * t_s;
                Vector3::new(
                    0.03 * phase.sin() + 0.008 * (2.0 * phase).cos(),
                    0.02 * (2.0 * phase).sin(),
                    0.1 + 0.015 * (3.0 * phase).cos(),
                )
            }
        }
    }
}

pub(crate) fn make(case: &Case) -> Run {
    let mut random = Random(case.seed.wrapping_mul(0x1234_5678_9abc_def1) + 77);
    let path = Path::new(case.motion, &mut random);
    let rotation = Rotation3::new(random.normal3());
    let translation = random.normal3() * 0.2;
    let frame = Rigid {
        rotation: std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)])),
        translation_m: translation.into(),
    };
    let rows = (case.duration_s * case.state_hz) as usize;
    let t_s: Vec<f64> = (0..rows).map(|i| 100.0 + i as f64 / case.state_hz).collect();
    // Published in whole micrometres, cut toward zero.
    let micrometres = |value: f64| (value * 1e6).trunc() / 1e6;
    let places: Vec<Vector3<f64>> = t_s.iter().map(|&t| path.at(t).map(micrometres)).collect();
    let position_m = std::array::from_fn(|axis| places.iter().map(|place| place[axis]).collect());
    let first_s = 100.0 - case.offset_s + 0.7;
    let count = ((case.duration_s - 1.4) * case.truth_hz) as usize;
    let reference_s = first_s + 0.5 * (count - 1) as f64 / case.truth_hz;
    let clock = Clock { offset_s: case.offset_s, drift: case.drift, reference_s };
    let keep = (-1.0 / case.truth_hz / case.arm_error_s).exp();
    let mut error = random.normal3() * case.arm_error_m;
    let (mut truth, mut lost, mut wrong) = (Truth::default(), 0, Vec::new());
    for i in 0..count {
        let t_truth_s = first_s + i as f64 / case.truth_hz;
        error = error * keep + random.normal3() * case.arm_error_m * (1.0 - keep * keep).sqrt();
        let noise = random.normal3() * case.noise_m;
        let place = path.at(clock.state_time_s(t_truth_s)) + error + case.arm_offset_m + noise;
        let mut seen = rotation.inverse() * (place - translation);
        if random.uniform() < case.lost {
            seen = Vector3::repeat(f64::NAN);
            lost += 1;
        } else if random.uniform() < case.wrong {
            seen += random.normal3().normalize() * random.between(0.02, 0.15);
            wrong.push(i);
        }
        truth.t_s.push(t_truth_s);
        truth.position_m.push(seen.into());
    }
    Run { t_s, position_m, truth, frame, clock, lost, wrong }
}

impl Run {
    pub(crate) fn reported(&self) -> Reported<'_> {
        let [x, y, z] = &self.position_m;
        Reported { t_s: &self.t_s, position_m: [x, y, z], quaternion: None, runlevel: None }
    }

    pub(crate) fn pair(&self, options: &Options) -> Result<Paired, PairError> {
        pair(&self.reported(), &self.truth, options)
    }

    /// Errors over standard errors: offset, drift, rotation about x, y, z, middle x, y, z.
    pub(crate) fn deviations(&self, paired: &Paired) -> [f64; 8] {
        let report = &paired.report;
        let offset = paired.clock.state_time_s(self.clock.reference_s) - self.clock.state_time_s(self.clock.reference_s);
        let matrix = |rigid: &Rigid| nalgebra::Matrix3::from_fn(|row, column| rigid.rotation[row][column]);
        let turned = Rotation3::from_matrix_unchecked(matrix(&paired.registration) * matrix(&self.frame).transpose()).scaled_axis();
        let middle = self.middle();
        let moved = Vector3::from(paired.registration.apply(middle)) - Vector3::from(self.frame.apply(middle));
        let drift = paired.clock.drift - self.clock.drift;
        [
            offset / report.clock.offset_sd_s,
            if report.clock.drift_fitted { drift / (report.clock.drift_sd_ppm * 1e-6) } else { 0.0 },
            turned[0] / report.registration.rotation_sd_rad[0],
            turned[1] / report.registration.rotation_sd_rad[1],
            turned[2] / report.registration.rotation_sd_rad[2],
            moved[0] / report.registration.centre_sd_m[0],
            moved[1] / report.registration.centre_sd_m[1],
            moved[2] / report.registration.centre_sd_m[2],
        ]
    }

    pub(crate) fn middle(&self) -> [f64; 3] {
        let seen: Vec<&[f64; 3]> =
            self.truth.position_m.iter().filter(|position| position.iter().all(|value| value.is_finite())).collect();
        std::array::from_fn(|axis| seen.iter().map(|position| position[axis]).sum::<f64>() / seen.len() as f64)
    }
}

pub(crate) fn dropped(paired: &Paired, reason: Reason) -> usize {
    paired.report.dropped.iter().find(|dropped| dropped.reason == reason).expect("every reason is listed").frames
}
