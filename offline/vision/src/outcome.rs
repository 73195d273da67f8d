//! What a frame gives: circles that count or are suspended and why, a pose, or the reason why there is none.

use crate::pose::Fitted;
use crate::sphere::Sighting;
use crate::triangulate::Located;

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
