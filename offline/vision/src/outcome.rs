//! What a frame gives: circles that count or are suspended and why, a pose, or the reason why there is none.

use crate::pose::Fitted;
use crate::sphere::Sighting;
use crate::triangulate::Located;
use nalgebra::{Isometry3, Matrix6, Point3};

/// Why a camera does not take part in placing a ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suspended {
    /// No image, or a black one.
    NoImage,
    /// No circle was found, or too little of its rim.
    NotFound,
    /// Less than a quarter of its border has the ball's colour.
    Colour,
    /// It moved further than the ball can.
    Motion,
    /// It contradicts the other cameras.
    Contradicts,
    /// It has not been consistent for long enough.
    Returning,
}

impl Suspended {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::NoImage => "no image, or a black one",
            Self::NotFound => "not found, or too little of its rim",
            Self::Colour => "less than a quarter of its border has the ball's colour",
            Self::Motion => "further from where it was expected than the ball can move",
            Self::Contradicts => "contradicts the other cameras",
            Self::Returning => "has not been consistent for long enough",
        }
    }
}

/// One ball in one camera.
#[derive(Debug, Clone)]
pub enum View {
    /// It counts.
    Effective(Sighting),
    /// It does not, and why.
    Suspended(Suspended),
}

/// A measured frame.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Pose and covariance.
    pub fitted: Fitted,
    /// Balls, each from its own circles alone.
    pub balls: [Located; 3],
    /// RMS distance between the balls and where the pose has them, m.
    pub residual_m: f64,
    /// Views by ball and camera.
    pub views: [Vec<View>; 3],
}

/// Why a frame is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lost {
    /// Fewer than two cameras have an image.
    Images,
    /// A ball has fewer than two effective cameras (its index).
    Ball(usize),
    /// The balls found do not stand as the fixture holds them.
    Fixture,
    /// What was measured contradicts itself by more than can be trusted.
    Doubtful,
}

impl Lost {
    /// In words; `balls` are the colours in the order of the fixture.
    pub fn words(&self, balls: &[String; 3]) -> String {
        match self {
            Self::Images => "fewer than two cameras have an image".to_owned(),
            Self::Ball(ball) => format!("fewer than two cameras see the {} ball well enough", balls[*ball % 3]),
            Self::Fixture => "the balls found do not stand as the fixture holds them".to_owned(),
            Self::Doubtful => "what was measured contradicts itself".to_owned(),
        }
    }
}

/// A measured frame in either mode.
#[derive(Debug, Clone)]
pub struct Found {
    /// Pose of the end effector.
    pub pose: Isometry3<f64>,
    /// Covariance of rotation vector (rad) and position (m); the paper has none.
    pub covariance: Option<Matrix6<f64>>,
    /// Balls in the order of the fixture (+x, +y, -x).
    pub balls_m: [Point3<f64>; 3],
    /// Cameras that count, per ball.
    pub cameras: [usize; 3],
    /// RMS distance between balls and fixture, m.
    pub residual_m: f64,
}

/// A frame of the result.
#[derive(Debug, Clone)]
pub struct Row {
    /// Number.
    pub frame: u64,
    /// Time.
    pub t_s: f64,
    /// What was measured, or why not.
    pub found: std::result::Result<Found, Lost>,
    /// Images that were missing or black.
    pub remarks: Vec<String>,
    /// Views by ball and camera; empty in paper mode and in lost frames. Rim points are kept of frames spread over the recording.
    pub views: Vec<Vec<View>>,
}

/// A measured recording.
#[derive(Debug)]
pub struct Tracked {
    /// One row per frame.
    pub rows: Vec<Row>,
    /// Colour names in the order of the fixture.
    pub balls: [String; 3],
    /// Exposure by which poses were moved back to the times of their frames, s.
    pub exposure_s: Option<f64>,
    /// When the rows' time is 0, s since 1970, where the recording says so.
    pub start_unix_s: Option<f64>,
}
