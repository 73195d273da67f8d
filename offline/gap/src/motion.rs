//! Smoothed signals of one run: what every regressor is built from.

use crate::filter::Window;
use crate::robot::Robot;
use crate::run::Run;

/// How signals are smoothed and sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Standard deviation of the window, s: half power at 0.133/σ Hz.
    pub sigma_s: f64,
    /// Time between rows, s.
    pub step_s: f64,
}

impl Band {
    /// Slow content of a kilohertz recording: half power at 11 Hz, 50 rows a second. Above some 5 Hz elastic cables move
    /// motor and link apart, and stepped encoders rattle.
    pub const SLOW: Self = Self { sigma_s: 0.012, step_s: 0.02 };

    /// What a model learnt from another recording can follow: half power at 2.7 Hz.
    pub const LEARNT: Self = Self { sigma_s: 0.05, step_s: 0.02 };

    /// Fast motion: half power at 67 Hz, 500 rows a second.
    pub const FAST: Self = Self { sigma_s: 0.002, step_s: 0.002 };

    /// The band in which a run moves: the slow one, unless most of the motion of every joint that moves is faster.
    pub fn of(run: &Run, robot: &Robot) -> Self {
        let lost = |series: &[f64]| {
            let quick = Window::new(Self::FAST.sigma_s.max(1.5 * run.dt_s), run.dt_s).apply(series, 0);
            let slow = Window::new(Self::SLOW.sigma_s, run.dt_s).apply(series, 0);
            let mean = crate::series::mean(series);
            let size = |x: &mut dyn Iterator<Item = f64>| crate::series::rms(x);
            size(&mut quick.iter().zip(&slow).map(|(q, s)| q - s)) > 0.7 * size(&mut quick.iter().map(|q| q - mean))
        };
        let moving = || run.position.iter().enumerate().filter(|(j, series)| robot.moves(*j, series)).map(|(_, series)| series);
        if !run.points && moving().next().is_some() && moving().all(|series| lost(series)) { Self::FAST } else { Self::SLOW }
    }

    /// The same for a recording with a period of `dt_s`.
    #[must_use]
    pub fn for_period(self, dt_s: f64) -> Self {
        Self { sigma_s: self.sigma_s.max(if self == Self::FAST { 1.5 * dt_s } else { 0.5 * dt_s }), step_s: self.step_s.max(dt_s) }
    }
}

/// Smoothing of the velocity whose sign friction follows, s.
const QUICK_SIGMA_S: f64 = 0.005;
/// Smoothing of the deflection that carries a motor's motion over to its link, s.
const DEFLECTION_SIGMA_S: f64 = 0.05;

/// Times the noise of its measured acceleration (variances) above which a link is seen to shake on its cable: of white noise at the encoders, of
/// what the acceleration is in the quietest tenth of a run, of a wave in their counts.
const SEEN_TO_SHAKE: [f64; 3] = [2.0, 4.0, 1.0];
const QUIETEST: f64 = 0.1;

/// One run, smoothed.
#[derive(Debug, Clone)]
pub struct Motion {
    /// The signals as they came.
    pub run: Run,
    /// The window of all equations.
    pub window: Window,
    /// Motor-side joint position, velocity and acceleration, smoothed.
    pub position: Vec<Vec<f64>>,
    /// Its velocity.
    pub velocity: Vec<Vec<f64>>,
    /// Its acceleration.
    pub acceleration: Vec<Vec<f64>>,
    /// Velocity of the drives in joint units, smoothed.
    pub drive_velocity: Vec<Vec<f64>>,
    /// Its derivative.
    pub drive_acceleration: Vec<Vec<f64>>,
    /// Velocity of the drives, smoothed little: friction turns with it.
    pub quick_velocity: Vec<Vec<f64>>,
    /// The same of the joints, with which friction behind the cables turns; none where each drive moves its joint alone.
    quick_joint_velocity: Option<Vec<Vec<f64>>>,
    /// Torque at the joints, smoothed.
    pub torque: Option<Vec<Vec<f64>>>,
    /// `A⁻¹ m - q`, smoothed.
    pub deflection: Option<Vec<Vec<f64>>>,
    slow_deflection: Option<Vec<Vec<f64>>>,
    /// Accelerations of the motors that their links do not follow, of each joint; empty where nobody sees that.
    shaken: Vec<Vec<f64>>,
    sign_speeds: Vec<f64>,
    /// Samples that make rows.
    pub rows: Vec<usize>,
    /// Samples with a measured tip.
    pub tip_rows: Vec<usize>,
}

impl Motion {
    /// Smooths a run.
    pub fn new(run: Run, band: Band) -> Self {
        let band = band.for_period(run.dt_s);
        let over = |sigma_s: f64| if run.points { Window::identity() } else { Window::new(sigma_s, run.dt_s) };
        let window = over(band.sigma_s);
        let smooth = |set: &[Vec<f64>], derivative: usize| set.iter().map(|s| window.apply(s, derivative)).collect::<Vec<_>>();
        let quick = over(QUICK_SIGMA_S.min(band.sigma_s));
        let deflection = deflection_of(&run);
        let slow = over(DEFLECTION_SIGMA_S.max(band.sigma_s));
        let margin = window.margin();
        let step = ((band.step_s / run.dt_s).round() as usize).max(1);
        let usable = margin..run.len().saturating_sub(margin);
        // A row whose window touches what was not recorded says nothing.
        let mut bridged = Vec::with_capacity(run.len() + 1);
        bridged.push(0_usize);
        bridged.extend(run.mask.iter().scan(0, |sum, masked| {
            *sum += usize::from(*masked);
            Some(*sum)
        }));
        let seen = |i: usize| bridged[(i + margin + 1).min(run.len())] == bridged[i.saturating_sub(margin)];
        let mut rows: Vec<usize> = usable.clone().step_by(step).filter(|i| seen(*i)).collect();
        // The first two tell how far rows are apart.
        while rows.len() > 1 && rows[1] - rows[0] != step {
            rows.remove(0);
        }
        let tip_rows = run.tip.as_ref().map_or_else(Vec::new, |tip| {
            usable.clone().filter(|&i| seen(i) && tip.iter().all(|axis| axis[i].is_finite())).collect::<Vec<_>>()
        });
        // A tip at every sample is thinned like the rest.
        let tip_rows = if tip_rows.len() * 2 > usable.len() { tip_rows.into_iter().step_by(step).collect() } else { tip_rows };
        let quick_velocity: Vec<Vec<f64>> = run.drive.iter().map(|s| quick.apply(s, 1)).collect();
        Self {
            position: smooth(&run.position, 0),
            velocity: smooth(&run.position, 1),
            acceleration: smooth(&run.position, 2),
            drive_velocity: smooth(&run.drive, 1),
            drive_acceleration: smooth(&run.drive, 2),
            quick_joint_velocity: (run.drive != run.position).then(|| run.position.iter().map(|s| quick.apply(s, 1)).collect()),
            sign_speeds: quick_velocity.iter().map(|v| sign_speed(v)).collect(),
            quick_velocity,
            torque: run.torque.as_ref().map(|torque| smooth(torque, 0)),
            slow_deflection: deflection.as_ref().map(|d| d.iter().map(|s| slow.apply(s, 0)).collect()),
            deflection: deflection.as_ref().map(|d| smooth(d, 0)),
            shaken: Vec::new(),
            rows,
            tip_rows,
            window,
            run,
        }
    }

    /// How far the links shake on their cables, so that it is seen in the noise of the encoders: what of the second derivative of each joint's
    /// deflection may be believed at each sample, from 0 to 1. Empty where the joints have no encoders.
    pub fn shakes(&self) -> Vec<Vec<f64>> {
        let (Some(truth), [white, quiet, counts]) = (&self.run.truth, SEEN_TO_SHAKE) else { return Vec::new() };
        let slow = self.slow();
        let of_joint = |(j, (raw, quick)): (usize, (&Vec<f64>, Vec<f64>))| {
            let power = slow.apply(&quick.iter().map(|a| a * a).collect::<Vec<f64>>(), 0);
            // Of white noise third differences have 20 times its variance.
            let scatter = crate::series::rms(raw.windows(4).map(|d| d[3] - 3.0 * d[2] + 3.0 * d[1] - d[0])).powi(2) / 20.0;
            let steps =
                [&self.run.position[j], &truth[j]].map(|x| crate::series::resolution(x)).into_iter().filter(|q| q.is_finite());
            let least = (white * scatter * self.window.noise_gain(2))
                .max(quiet * crate::series::quantile(&mut power.clone(), QUIETEST))
                .max(counts * steps.map(|q| q * q / 12.0).sum::<f64>() * self.window.steepest().powi(2));
            power.into_iter().map(|power| if power > least { 1.0 - least / power } else { 0.0 }).collect()
        };
        let raw = deflection_of(&self.run).unwrap_or_default();
        raw.iter().zip(self.quick_deflection(&raw)).enumerate().map(of_joint).collect()
    }

    /// Deflection of each joint on the recording's clock, not smoothed; none where the joints have no encoders.
    pub(crate) fn raw_deflection(&self) -> Option<Vec<Vec<f64>>> {
        deflection_of(&self.run)
    }

    /// The window of what is so slow that link and motor accelerate alike.
    fn slow(&self) -> Window {
        Window::new(DEFLECTION_SIGMA_S.max(self.window.sigma_s()), self.run.dt_s)
    }

    /// Second derivatives of deflections, but for what is that slow.
    fn quick_deflection(&self, raw: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let slow = self.slow();
        let of_joint = |d: &Vec<f64>| self.window.apply(d, 2).iter().zip(slow.apply(d, 2)).map(|(all, slow)| all - slow).collect();
        raw.iter().map(of_joint).collect()
    }

    /// Takes off the links' acceleration what the deflections tell, as far as it is believed.
    pub fn shake(&mut self, believed: &[Vec<f64>]) {
        let quick = self.quick_deflection(&deflection_of(&self.run).unwrap_or_default());
        self.shaken = quick.into_iter().zip(believed).map(|(d, b)| d.iter().zip(b).map(|(d, b)| d * b).collect()).collect();
    }

    /// Position, velocity and acceleration of the links at a sample: the motors' motion, moved by the measured deflection
    /// where there is one. (The second derivative of a joint encoder is noise, but where its link is seen to shake; below 5 Hz link and motor
    /// accelerate alike.)
    pub fn link(&self, i: usize) -> State {
        let n = self.position.len();
        let at = |set: &[Vec<f64>]| (0..n).map(|j| set[j][i]).collect::<Vec<f64>>();
        let mut position = at(&self.position);
        if let Some(slow) = &self.slow_deflection {
            position.iter_mut().zip(slow).for_each(|(q, d)| *q -= d[i]);
        }
        let mut acceleration = at(&self.acceleration);
        acceleration.iter_mut().zip(&self.shaken).for_each(|(a, shaken)| *a -= shaken.get(i).copied().unwrap_or(0.0));
        State { position, velocity: at(&self.velocity), acceleration }
    }

    /// Samples from row to row.
    pub fn step(&self) -> usize {
        self.rows.get(1).map_or(1, |second| second - self.rows[0])
    }

    /// Autocovariance that white noise of variance 1 at the sensor has behind the window, from row to row, at lags 0 to 3.
    pub fn noise_of_rows(&self) -> Vec<f64> {
        self.window.autocovariance(self.step(), 3)
    }

    /// Speed below which the sign of the velocity is not known, rad/s or m/s: three standard deviations of the quick
    /// velocity's noise, estimated from its third differences.
    pub fn sign_speed(&self, joint: usize) -> f64 {
        self.sign_speeds[joint]
    }

    /// Velocity with which a joint's friction turns, smoothed little: that of its drive, or, behind the cable, its own.
    pub fn quick(&self, joint: usize, at_link: bool) -> &[f64] {
        let joints = self.quick_joint_velocity.as_ref().filter(|_| at_link);
        &joints.unwrap_or(&self.quick_velocity)[joint]
    }

    /// Force of bristles that bend over a travel before they slip, of their level: `z + t zd`, where t is the time in which
    /// their vibration settles (LuGre).
    pub fn bristle(&self, joint: usize, at_link: bool, travel: f64, settling_s: f64) -> Vec<f64> {
        self.bent(self.quick(joint, at_link), travel, settling_s)
    }

    /// The same of a velocity.
    pub(crate) fn bent(&self, velocity: &[f64], travel: f64, settling_s: f64) -> Vec<f64> {
        let mut state = 0.0;
        velocity
            .iter()
            .map(|v| {
                let moved = v * self.run.dt_s / travel;
                // Exact for a constant direction.
                let limit = v.signum();
                state = if moved == 0.0 { state } else { limit + (state - limit) * (-moved.abs()).exp() };
                state + settling_s / travel * (v - v.abs() * state)
            })
            .collect()
    }

    /// Sign of a drive's velocity at a sample, as steep as its noise allows.
    pub fn sign(&self, joint: usize, i: usize) -> f64 {
        (self.quick_velocity[joint][i] / self.sign_speeds[joint]).tanh()
    }

    /// The same of the joint's own velocity.
    pub fn sign_at_link(&self, joint: usize, i: usize) -> f64 {
        (self.quick(joint, true)[i] / self.sign_speeds[joint]).tanh()
    }
}

/// `A⁻¹ m - q` of each joint as recorded; none where the joints have no encoders.
fn deflection_of(run: &Run) -> Option<Vec<Vec<f64>>> {
    let of_joint = |(m, q): (&Vec<f64>, &Vec<f64>)| m.iter().zip(q).map(|(m, q)| m - q).collect();
    run.truth.as_ref().map(|truth| run.position.iter().zip(truth).map(of_joint).collect())
}

/// See [`Motion::sign_speed`].
fn sign_speed(v: &[f64]) -> f64 {
    let mut steps: Vec<f64> = v.windows(2).map(|p| (p[1] - p[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    let moving = v.iter().map(|v| v.abs()).fold(0.0, f64::max);
    (3.0 * steps.get(steps.len() / 4).copied().unwrap_or(0.0)).clamp(2e-3 * moving, 0.05 * moving + 1e-12)
}

/// State of all joints at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// rad or m.
    pub position: Vec<f64>,
    /// rad/s or m/s.
    pub velocity: Vec<f64>,
    /// rad/s² or m/s².
    pub acceleration: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that swings so many times a second for 4 s.
    fn swings(hz: f64) -> Vec<f64> {
        (0..4000_i32).map(|i| 0.2 * (std::f64::consts::TAU * hz * f64::from(i) * 1e-3).sin()).collect()
    }

    #[test]
    fn a_joint_that_stands_has_no_say_in_how_fast_a_run_moves() {
        let of = |hz: &[f64]| {
            let mut robot = Robot::of(&simulator::RobotModel::load("raven2-nominal").expect("built in"));
            robot.prismatic = vec![false; hz.len()];
            let position = hz.iter().map(|hz| swings(*hz)).collect();
            Band::of(&Run { position, ..Run::of_one_joint(&swings(1.0)) }, &robot)
        };
        assert_eq!(of(&[30.0, 30.0]), Band::FAST);
        assert_eq!(of(&[0.0, 30.0]), Band::FAST, "the first stands");
        assert_eq!(of(&[1.0, 30.0]), Band::SLOW, "the first moves slowly");
        assert_eq!(of(&[0.0, 0.0]), Band::SLOW);
    }

    #[test]
    fn a_link_that_shakes_beyond_the_noise_is_followed_and_another_is_not() {
        const HZ: f64 = 8.0;
        const SIZE: f64 = 5e-4;
        let mut random = 1_u64;
        let mut noise = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            1.7e-4 * ((random >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
        };
        let wave =
            |i: usize| if (1500..2500).contains(&i) { SIZE * (std::f64::consts::TAU * HZ * i as f64 * 1e-3).sin() } else { 0.0 };
        let motor = swings(0.5);
        let link = motor.iter().enumerate().map(|(i, q)| q - wave(i) + noise()).collect();
        let mut motion = Motion::new(Run { truth: Some(vec![link]), ..Run::of_one_joint(&motor) }, Band::SLOW);
        let of_motor: Vec<f64> = (0..4000).map(|i| motion.link(i).acceleration[0]).collect();
        let believed = motion.shakes();
        let mean = |of: std::ops::Range<usize>| crate::series::mean(&believed[0][of]);
        assert!(mean(300..1200) < 0.05 && mean(1700..2300) > 0.9, "{} {}", mean(300..1200), mean(1700..2300));
        motion.shake(&believed);
        let rms = |of: std::ops::Range<usize>| crate::series::rms(of.map(|i| motion.link(i).acceleration[0] - of_motor[i]));
        // What the window leaves of the wave's acceleration.
        let rate = std::f64::consts::TAU * HZ;
        let left = SIZE * rate * rate * (-0.5 * (rate * Band::SLOW.sigma_s).powi(2)).exp() / std::f64::consts::SQRT_2;
        assert!((rms(1700..2300) / left - 1.0).abs() < 0.2, "{} for {left}", rms(1700..2300));
        assert!(rms(300..1200) < 0.1 * left, "{}", rms(300..1200));
        assert!(Motion::new(Run::of_one_joint(&motor), Band::SLOW).shakes().is_empty(), "no encoder at the joint");
    }

    #[test]
    fn rows_whose_window_touches_a_hole_are_left_out() {
        let count = 2000_i32;
        let series: Vec<f64> = (0..count).map(|i| f64::from(i) * 1e-3).collect();
        let mut mask = vec![false; count as usize];
        mask[1000..1100].fill(true);
        mask[90] = true;
        let run = Run { tip: Some([series.clone(), series.clone(), series.clone()]), mask, ..Run::of_one_joint(&series) };
        let motion = Motion::new(run, Band::SLOW);
        let margin = motion.window.margin();
        for rows in [&motion.rows, &motion.tip_rows] {
            assert!(rows.iter().all(|&i| i.abs_diff(90) > margin && (i + margin < 1000 || i > 1099 + margin)), "{rows:?}");
        }
        // Every other row of the grid is there, and the first two are one step apart.
        let step = motion.rows[1] - motion.rows[0];
        assert_eq!(step, 20);
        assert!(motion.rows.iter().all(|i| (i - motion.rows[0]).is_multiple_of(step)));
        assert_eq!(
            motion.rows.len(),
            (margin..2000 - margin)
                .step_by(20)
                .filter(|i| i.abs_diff(90) > margin && (i + margin < 1000 || *i > 1099 + margin))
                .count()
        );
    }
}
