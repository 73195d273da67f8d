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
    /// Circles that were in doubt would be needed, and have not been consistent for long enough.
    Waiting,
}

impl Lost {
    /// In words; `balls` are the colours in the order of the fixture.
    pub fn words(&self, balls: &[String; 3]) -> String {
        match self {
            Self::Images => "fewer than two cameras have an image".to_owned(),
            Self::Ball(ball) => format!("fewer than two cameras see the {} ball well enough", balls[*ball % 3]),
            Self::Fixture => "the balls found do not stand as the fixture holds them".to_owned(),
            Self::Doubtful => "what was measured contradicts itself".to_owned(),
            Self::Waiting => "too few circles have been consistent for some frames since they were in doubt".to_owned(),
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
    /// Names of the cameras, in the order of the views.
    pub cameras: Vec<String>,
    /// Colour names in the order of the fixture.
    pub balls: [String; 3],
    /// Exposure by which poses were moved back to the times of their frames, s.
    pub exposure_s: Option<f64>,
    /// When the rows' time is 0, s since 1970, where the recording says so.
    pub start_unix_s: Option<f64>,
}

/// Of the measured frames of which a camera has an image, as reciprocals, in how many it contradicts the others, or shows no ball where they see
/// it, if it has moved.
const CONTRADICTS: usize = 5;
const SHOWS_NONE: usize = 2;
/// Fewest such frames.
const MOVED_MIN: usize = 3;

impl Tracked {
    /// Cameras that do not fit the others too often: in how many frames, and of how many. None is told in paper mode, which keeps no views.
    pub fn moved(&self) -> impl Iterator<Item = (usize, [usize; 2])> {
        (0..self.cameras.len()).filter_map(|camera| {
            let (mut contradicts, mut shows_none, mut seen) = (0, 0, 0);
            for row in &self.rows {
                let is = |wanted: fn(&View) -> bool| row.views.iter().any(|own| own.get(camera).is_some_and(wanted));
                let odd = is(|view| matches!(view, View::Suspended(Suspended::Contradicts)));
                let none = !odd && !is(|view| matches!(view, View::Effective(_)));
                let image = is(|view| !matches!(view, View::Suspended(Suspended::NoImage)));
                contradicts += usize::from(odd);
                shows_none += usize::from(none && image);
                seen += usize::from(image);
            }
            let odd = contradicts + shows_none;
            let moved = contradicts * CONTRADICTS > seen || odd * SHOWS_NONE > seen;
            (odd >= MOVED_MIN && moved).then_some((camera, [odd, seen]))
        })
    }
}
