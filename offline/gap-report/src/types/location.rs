//! Where an effect shows: channel, joint, regime, time, region.

use serde::{Deserialize, Serialize};

use super::{Channel, Extra};
use crate::names::names;

/// Where an effect shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Location {
    /// Channel in which it shows best.
    pub channel: Channel,
    /// Names of the joints, each once; empty: not tied to a joint. For `joint_coupling` first the joint that is moved, then
    /// the one that moves it.
    pub joint: Vec<String>,
    /// Part of the machine.
    pub subsystem: Subsystem,
    /// Conditions under which it shows, at least one.
    pub regime: Vec<Regime>,
    /// Times in which it shows; empty: the whole of every recording.
    pub time_intervals: Vec<Interval>,
    /// Region in which it shows.
    pub workspace_region: Region,
    /// Share of the excess residual energy of the channel, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_share: Option<f64>,
    /// Probability that the place is right, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confidence: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Location {
    /// Everywhere and always in a channel, in one regime.
    pub fn new(channel: Channel, joint: impl IntoIterator<Item = String>, subsystem: Subsystem, regime: Regime) -> Self {
        Self {
            channel,
            joint: joint.into_iter().collect(),
            subsystem,
            regime: vec![regime],
            time_intervals: Vec::new(),
            workspace_region: Region::all(),
            energy_share: None,
            confidence: None,
            extra: Extra::default(),
        }
    }
}

names! {
    /// Part of the machine.
    Subsystem {
        /// Motor.
        Motor "motor",
        /// Its amplifier.
        Amplifier "amplifier",
        /// Gearbox.
        Gearbox "gearbox",
        /// Cable.
        Cable "cable",
        /// Pulley.
        Pulley "pulley",
        /// Joint.
        Joint "joint",
        /// Link.
        Link "link",
        /// Tool.
        Tool "tool",
        /// Base.
        Base "base",
        /// Sensor at the robot.
        Sensor "sensor",
        /// Camera or tracker.
        Camera "camera",
        /// Clocks.
        Clock "clock",
        /// Controller.
        Controller "controller",
        /// Outside the robot.
        Environment "environment",
        /// Nobody can say.
        Unknown "unknown",
    }
}

names! {
    /// What a condition depends on.
    Feature {
        /// Nothing: always.
        All "all",
        /// Direction of motion.
        VelocitySign "velocity_sign",
        /// Time or travel since a reversal.
        Reversal "reversal",
        /// Speed.
        Speed "speed",
        /// Load.
        Load "load",
        /// Posture.
        Posture "posture",
        /// Angle of the motor.
        MotorAngle "motor_angle",
        /// Time.
        Time "time",
        /// Heating by the motor's current.
        TemperatureProxy "temperature_proxy",
        /// Frequency.
        Frequency "frequency",
        /// Motion of another joint.
        OtherJoint "other_joint",
        /// Touching something.
        Contact "contact",
    }
}

/// A condition under which an effect shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Regime {
    /// What it depends on.
    pub feature: Feature,
    /// In words, such as `within 40 ms of a reversal`.
    pub condition: String,
    /// Range of the feature, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Unit of the range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Share of the excess residual energy under this condition, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_share: Option<f64>,
    /// False discovery rate at which the condition counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_value: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Regime {
    /// A condition in words.
    pub fn new(feature: Feature, condition: impl Into<String>) -> Self {
        let condition = condition.into();
        Self { feature, condition, range: None, unit: None, energy_share: None, q_value: None, extra: Extra::default() }
    }

    /// Always.
    pub fn all() -> Self {
        Self::new(Feature::All, "always")
    }
}

/// A stretch of time in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The run.
    pub run: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// 95 % interval of the start, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_ci95_s: Option<[f64; 2]>,
    /// 95 % interval of the end, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_ci95_s: Option<[f64; 2]>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Interval {
    /// From `start_s` to `end_s` of a run.
    pub fn new(run: impl Into<String>, start_s: f64, end_s: f64) -> Self {
        Self { run: run.into(), start_s, end_s, start_ci95_s: None, end_ci95_s: None, extra: Extra::default() }
    }
}

names! {
    /// Shape of a region.
    RegionKind {
        /// Everywhere.
        All "all",
        /// Box in space.
        Box "box",
        /// Box in joint positions.
        JointBox "joint_box",
        /// Sphere.
        Sphere "sphere",
    }
}

/// A region in space or of joint positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Its shape.
    pub kind: RegionKind,
    /// Frame of its coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<String>,
    /// Names of its axes, or joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<String>>,
    /// Lower limits, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Vec<f64>>,
    /// Upper limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Vec<f64>>,
    /// Centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre: Option<Vec<f64>>,
    /// Radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Unit of all of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Share of the excess residual energy inside, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_share: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Region {
    /// Everywhere.
    pub fn all() -> Self {
        Self {
            kind: RegionKind::All,
            frame: None,
            axes: None,
            min: None,
            max: None,
            centre: None,
            radius: None,
            unit: None,
            energy_share: None,
            extra: Extra::default(),
        }
    }

    /// Of the tip in the base frame, m: limits along some of its axes.
    pub fn tip_box(axes: Vec<String>, min: Vec<f64>, max: Vec<f64>) -> Self {
        let (frame, unit) = (Some("base".to_owned()), Some("m".to_owned()));
        Self { kind: RegionKind::Box, frame, axes: Some(axes), min: Some(min), max: Some(max), unit, ..Self::all() }
    }

    /// Between two joint positions, one entry per joint, in rad or m as the joints have it.
    pub fn joint_box(joints: Vec<String>, min: Vec<f64>, max: Vec<f64>, unit: impl Into<String>) -> Self {
        let unit = Some(unit.into());
        Self { kind: RegionKind::JointBox, axes: Some(joints), min: Some(min), max: Some(max), unit, ..Self::all() }
    }
}
