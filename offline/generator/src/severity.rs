//! How large an effect is: RMS of what it changes in its main channel, over RMS of the noise there.

use crate::arm::Arm;
use crate::run::Signals;
use crate::table::FRAME;
use serde::{Deserialize, Serialize};

/// Residual space in which an effect is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Commanded motor torque.
    JointTorque,
    /// True joint position minus reported joint position.
    Transmission,
    /// True tip minus reported tip.
    EndEffector,
    /// The signal that comes late.
    Timing,
}

/// What to compare: a channel, and one joint of it or the one where most is seen.
#[derive(Clone, Debug)]
pub struct Place {
    /// Residual space.
    pub channel: Channel,
    /// Joint, counted from 0.
    pub joint: Option<usize>,
    /// Late signal, for `Channel::Timing`.
    pub signal: Option<String>,
}

/// RMS of `a - b` in each cell of a place.
fn rms(a: &Signals, b: &Signals, arm: &Arm, place: &Place) -> Vec<f64> {
    let joints: Vec<usize> = place.joint.map_or_else(|| (0..arm.size()).collect(), |j| vec![j]);
    let per_joint = |value: &dyn Fn(&Signals, usize, usize) -> f64| -> Vec<f64> {
        joints.iter().map(|&j| mean_square((0..a.tip.len()).map(|k| value(a, k, j) - value(b, k, j)))).collect()
    };
    let tip = |relative: bool| -> Vec<f64> {
        let error = |s: &Signals, k: usize, x: usize| s.tip[k][x] - if relative { s.reported_tip[k][x] } else { 0.0 };
        let frames = (0..a.tip.len()).step_by(FRAME).flat_map(|k| (0..3).map(move |x| (k, x)));
        vec![mean_square(frames.map(|(k, x)| error(a, k, x) - error(b, k, x)))]
    };
    match (place.channel, place.signal.as_deref()) {
        (Channel::JointTorque, _) | (Channel::Timing, Some("torque")) => per_joint(&|s, k, j| s.torque[k][j]),
        (Channel::Transmission, _) => per_joint(&|s, k, j| s.joint[k][j] - s.motor[k][j] / arm.drives[j].ratio),
        (Channel::EndEffector, _) => tip(true),
        (Channel::Timing, Some("joint")) => per_joint(&|s, k, j| s.joint[k][j]),
        (Channel::Timing, Some("motor")) => per_joint(&|s, k, j| s.joint[k][j] - s.motor[k][j] / arm.drives[j].ratio),
        (Channel::Timing, _) => tip(false),
    }
}

fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (sum / count.max(1) as f64).sqrt()
}

/// Largest ratio over the cells of a place, and the index of that cell.
pub fn ratio(with: &Signals, without: &Signals, noisy: &Signals, clean: &Signals, arm: &Arm, place: &Place) -> (f64, usize) {
    let effect = rms(with, without, arm, place);
    let noise = rms(noisy, clean, arm, place);
    let ratios = effect.iter().zip(&noise).map(|(effect, noise)| effect / noise.max(f64::MIN_POSITIVE));
    let (cell, ratio) = ratios.enumerate().fold((0, 0.0), |best, (cell, ratio)| if ratio > best.1 { (cell, ratio) } else { best });
    (ratio, place.joint.unwrap_or(cell))
}
