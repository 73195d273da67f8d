//! Where the end effector goes.

use crate::error::{Error, Result};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Poses at rising times; between them straight and evenly turning.
#[derive(Debug, Clone)]
pub struct Motion {
    t_s: Vec<f64>,
    poses: Vec<Isometry3<f64>>,
}

impl Motion {
    /// Of times, positions (m) and quaternions (w, x, y, z: end effector's axes into the frame of the positions). Rows without a
    /// number are left out. `name` is for messages.
    ///
    /// # Errors
    /// If fewer than two rows are left or time does not rise.
    pub fn new(name: &str, t_s: &[f64], position_m: [&[f64]; 3], quaternion: [&[f64]; 4]) -> Result<Self> {
        let wrong = |what: String, remedy: &str| Err(Error::Motion { recording: name.to_owned(), what, remedy: remedy.to_owned() });
        let mut motion = Self { t_s: Vec::new(), poses: Vec::new() };
        for (row, t) in t_s.iter().enumerate() {
            let value = |column: &&[f64]| column.get(row).copied().unwrap_or(f64::NAN);
            let p = position_m.each_ref().map(value);
            let q = quaternion.each_ref().map(value);
            let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !(t.is_finite() && p.iter().all(|v| v.is_finite()) && (length - 1.0).abs() < 0.1) {
                continue;
            }
            if motion.t_s.last().is_some_and(|last| last >= t) {
                return wrong(format!("time does not rise at {t} s"), "sort the recording by time");
            }
            motion.t_s.push(*t);
            motion.poses.push(Isometry3::from_parts(
                Translation3::new(p[0], p[1], p[2]),
                UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3])),
            ));
        }
        if motion.t_s.len() < 2 {
            return wrong(
                format!("{} rows with a true pose", motion.t_s.len()),
                "give a simulated recording with truth and orientation",
            );
        }
        Ok(motion)
    }

    /// A path that turns about, for scenes without a recording: 40 s, 100 mm/s and 80 degrees/s at most.
    pub fn wandering(seed: u64) -> Self {
        let phase = seed as f64 * 1.7;
        let pose = |t: f64| {
            let along = |size: f64, pace: f64, begun: f64| size * (pace * t + begun + phase).sin();
            let turn = UnitQuaternion::from_euler_angles(along(0.5, 1.3, 0.5), along(0.4, 0.9, 1.5), along(0.9, 0.7, 0.0) + phase);
            Isometry3::from_parts(Translation3::new(along(0.035, 1.9, 0.0), along(0.035, 1.5, 1.0), along(0.02, 1.1, 2.0)), turn)
        };
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-2).collect();
        Self { poses: t_s.iter().map(|t| pose(*t)).collect(), t_s }
    }

    /// First and last time, s.
    pub fn span_s(&self) -> [f64; 2] {
        [self.t_s[0], self.t_s[self.t_s.len() - 1]]
    }

    /// Pose at a time; before the first and after the last it stands.
    pub fn at(&self, t_s: f64) -> Isometry3<f64> {
        let next = self.t_s.partition_point(|own| *own <= t_s).clamp(1, self.t_s.len() - 1);
        let (from, to) = (self.t_s[next - 1], self.t_s[next]);
        let part = ((t_s - from) / (to - from)).clamp(0.0, 1.0);
        let (a, b) = (&self.poses[next - 1], &self.poses[next]);
        let place = a.translation.vector.lerp(&b.translation.vector, part);
        let turn = a.rotation.try_slerp(&b.rotation, part, 1e-9).unwrap_or(b.rotation);
        Isometry3::from_parts(Translation3::from(place), turn)
    }

    /// Middle of all places between two times.
    pub(crate) fn middle_m(&self, from_s: f64, to_s: f64) -> Vector3<f64> {
        let mut least = Vector3::repeat(f64::INFINITY);
        let mut most = Vector3::repeat(f64::NEG_INFINITY);
        for k in 0..=400 {
            let place = self.at(from_s + (to_s - from_s) * f64::from(k) / 400.0).translation.vector;
            least = least.inf(&place);
            most = most.sup(&place);
        }
        (least + most) / 2.0
    }
}
