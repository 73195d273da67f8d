//! What there is to see, as a file says it. Every key may be left out.

use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// Where a camera stands.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Its optical centre, world, mm.
    pub position_mm: [f64; 3],
    /// What it looks at, world, mm.
    pub look_at_mm: [f64; 3],
}

/// A scene; lengths in mm, angles in degrees, shares between 0 and 1.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// Width and height of all images, px.
    pub resolution: [u32; 2],
    /// Frames per second.
    pub frames_per_s: f64,
    /// Cameras, evenly round the work space, if `camera` is empty.
    pub cameras: usize,
    /// Their distance from the vertical through the work space, mm.
    pub distance_mm: f64,
    /// Their height, mm; the middle of the work space is 244 mm high.
    pub height_mm: f64,
    /// Cameras at places of their own.
    pub camera: Vec<Place>,
    /// Focal length over image width.
    pub focal: f64,
    /// k1 of the lenses; k2 is half of its size with the other sign.
    pub distortion: f64,
    /// Colours of the balls at +x, +y, -x.
    pub balls: [String; 3],
    /// From end effector to each ball's centre, mm.
    pub ball_offset_mm: f64,
    /// Of each ball, mm.
    pub ball_radius_mm: f64,
    /// Direction towards the light.
    pub light: [f64; 3],
    /// Share of light that comes from everywhere.
    pub ambient: f64,
    /// Brightness of all: 1 is well lit.
    pub brightness: f64,
    /// Colour of the light: factors of red, green, blue.
    pub tint: [f64; 3],
    /// Brightness of what stands behind.
    pub background: f64,
    /// Coloured discs and bars behind, per camera.
    pub clutter: usize,
    /// A dark tool that swings between the cameras and the balls.
    pub tool: bool,
    /// Exponent of the camera's curve: 1 is straight, webcams have about 2.2.
    pub gamma: f64,
    /// Standard deviation of the lens's blur, px.
    pub blur_px: f64,
    /// Standard deviation of noise, grey levels.
    pub noise: f64,
    /// How long the shutter is open, ms. `t_s` of a frame is its beginning.
    pub exposure_ms: f64,
    /// Share of images that are black.
    pub black: f64,
    /// Share of images that are missing.
    pub missing: f64,
    /// Quality of the JPEG files, 1 to 100.
    pub jpeg_quality: u8,
    /// The frames' clock counts from here on the recording's, s: it is behind by this much.
    pub clock_offset_s: f64,
    /// How well the lab placed its boards: mm.
    pub board_error_mm: f64,
    /// And degrees.
    pub board_error_deg: f64,
    /// How well the lab measured the markers, mm.
    pub marker_error_mm: f64,
    /// How well they were marked, px.
    pub mark_error_px: f64,
    /// How well the lenses are known: share of the focal length.
    pub focal_error: f64,
    /// And px of the principal point.
    pub centre_error_px: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            resolution: [1280, 720],
            frames_per_s: 15.0,
            cameras: 4,
            distance_mm: 608.0,
            height_mm: 25.0,
            camera: Vec::new(),
            focal: 1.105,
            distortion: -0.05,
            balls: ["green".into(), "yellow".into(), "red".into()],
            ball_offset_mm: 38.0,
            ball_radius_mm: 20.0,
            light: [0.2, -0.3, 1.0],
            ambient: 0.55,
            brightness: 0.9,
            tint: [1.0; 3],
            background: 0.1,
            clutter: 0,
            tool: false,
            gamma: 1.0,
            blur_px: 0.7,
            noise: 1.5,
            exposure_ms: 0.0,
            black: 0.0,
            missing: 0.0,
            jpeg_quality: 92,
            clock_offset_s: 0.0,
            board_error_mm: 1.0,
            board_error_deg: 0.3,
            marker_error_mm: 0.15,
            mark_error_px: 0.6,
            focal_error: 0.001,
            centre_error_px: 1.0,
        }
    }
}

/// Names of colours and how they look in white light.
pub(crate) const PAINTS: [(&str, [f64; 3]); 7] = [
    ("red", [0.80, 0.12, 0.12]),
    ("orange", [0.90, 0.42, 0.06]),
    ("yellow", [0.85, 0.74, 0.10]),
    ("green", [0.10, 0.60, 0.22]),
    ("cyan", [0.10, 0.66, 0.72]),
    ("blue", [0.12, 0.24, 0.80]),
    ("magenta", [0.80, 0.16, 0.66]),
];

/// Built-in scenes.
const BUILT_IN: [(&str, &str); 3] = [
    ("easy", ""),
    ("occlusion", "tool = true\n"),
    ("hard", "tool = true\nlight = [1.0, 0.6, 0.1]\nambient = 0.35\nnoise = 5.0\nexposure_ms = 10.0\nclutter = 3\nblack = 0.02\n"),
];

impl Scene {
    /// A built-in scene (`easy`, `occlusion`, `hard`), or the file of that name.
    ///
    /// # Errors
    /// If the file cannot be read or holds a scene that cannot be.
    pub fn named(name: &str) -> Result<Self> {
        if let Some((_, text)) = BUILT_IN.iter().find(|(own, _)| *own == name) {
            return Self::parse(name, text);
        }
        let text = std::fs::read_to_string(Path::new(name)).map_err(|source| Error::Read { file: name.to_owned(), source })?;
        Self::parse(name, &text)
    }

    /// A scene as TOML; `name` is for messages.
    ///
    /// # Errors
    /// If it is no scene, or one that cannot be.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let wrong = |place: String, what: String, remedy: &str| {
            Err(Error::Scene { file: name.to_owned(), place, what, remedy: remedy.to_owned() })
        };
        let scene: Self = match toml::from_str(text) {
            Ok(scene) => scene,
            Err(error) => {
                let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
                let what = error.message().replace('\n', " ");
                return wrong(format!("line {line}"), what, "docs/vision.md lists the keys");
            }
        };
        match scene.fault() {
            Some((key, what)) => wrong(key.to_owned(), what, "docs/vision.md says what is possible"),
            None => Ok(scene),
        }
    }

    /// The first key whose value cannot be.
    fn fault(&self) -> Option<(&'static str, String)> {
        let ranges = [
            ("frames_per_s", self.frames_per_s, 0.1, 1000.0),
            ("distance_mm", self.distance_mm, 50.0, 20_000.0),
            ("height_mm", self.height_mm, -10_000.0, 10_000.0),
            ("focal", self.focal, 0.2, 20.0),
            ("distortion", self.distortion, -0.5, 0.5),
            ("ball_offset_mm", self.ball_offset_mm, 1.0, 1000.0),
            ("ball_radius_mm", self.ball_radius_mm, 1.0, 500.0),
            ("ambient", self.ambient, 0.0, 1.0),
            ("brightness", self.brightness, 0.0, 10.0),
            ("background", self.background, 0.0, 1.0),
            ("gamma", self.gamma, 0.2, 5.0),
            ("blur_px", self.blur_px, 0.0, 10.0),
            ("noise", self.noise, 0.0, 100.0),
            ("exposure_ms", self.exposure_ms, 0.0, 1000.0),
            ("black", self.black, 0.0, 1.0),
            ("missing", self.missing, 0.0, 1.0),
            ("jpeg_quality", f64::from(self.jpeg_quality), 1.0, 100.0),
            ("clock_offset_s", self.clock_offset_s, -1e6, 1e6),
            ("board_error_mm", self.board_error_mm, 0.0, 100.0),
            ("board_error_deg", self.board_error_deg, 0.0, 30.0),
            ("marker_error_mm", self.marker_error_mm, 0.0, 100.0),
            ("mark_error_px", self.mark_error_px, 0.0, 100.0),
            ("focal_error", self.focal_error, 0.0, 0.5),
            ("centre_error_px", self.centre_error_px, 0.0, 500.0),
        ];
        for (key, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                return Some((key, format!("{value} is not between {least} and {most}")));
            }
        }
        let count = if self.camera.is_empty() { self.cameras } else { self.camera.len() };
        if !(2..=16).contains(&count) {
            return Some(("cameras", format!("{count} cameras are not between 2 and 16")));
        }
        if self.resolution.iter().any(|side| !(64..=8192).contains(side)) {
            return Some(("resolution", format!("{} x {} px is not between 64 and 8192", self.resolution[0], self.resolution[1])));
        }
        if let Some(unknown) = self.balls.iter().find(|ball| PAINTS.iter().all(|(name, _)| name != ball)) {
            return Some(("balls", format!("unknown colour '{unknown}'; known are {}", PAINTS.map(|(name, _)| name).join(", "))));
        }
        let [a, b, c] = &self.balls;
        if a == b || b == c || a == c {
            return Some(("balls", "two balls of one colour".to_owned()));
        }
        if !self.light.iter().chain(&self.tint).all(|v| v.is_finite()) || self.light.iter().all(|v| *v == 0.0) {
            return Some(("light", "light and tint are three numbers each, light not all 0".to_owned()));
        }
        let far = |place: &Place| (0..3).map(|k| (place.position_mm[k] - place.look_at_mm[k]).powi(2)).sum::<f64>().sqrt();
        if self.camera.iter().any(|place| !(10.0..1e5).contains(&far(place))) {
            return Some(("camera", "position_mm is not 10 mm to 100 m from look_at_mm".to_owned()));
        }
        None
    }

    pub(crate) fn paint(&self, ball: usize) -> [f64; 3] {
        PAINTS.iter().find(|(name, _)| *name == self.balls[ball]).map_or([0.5; 3], |(_, colour)| *colour)
    }
}
