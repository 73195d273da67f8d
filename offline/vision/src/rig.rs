//! `rig.toml`: what the lab measured of its cameras, its chessboard and its fixture. Millimetres in the file, metres here.

use crate::camera::Intrinsics;
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A board with inner corners on a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chessboard {
    /// Side of a square.
    pub square_m: f64,
    /// Inner corners along the board's x and y axes.
    pub inner_corners: [usize; 2],
}

/// Three balls round the end effector, each at the same distance from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// From end effector to the centre of each ball.
    pub ball_offset_m: f64,
    /// Of each ball.
    pub ball_radius_m: f64,
    /// Colour names of the balls at +x, +y and -x.
    pub balls: [String; 3],
}

impl Fixture {
    /// Ball centres in the end effector's frame, in the order of `balls`.
    pub fn centres_m(&self) -> [Vector3<f64>; 3] {
        let d = self.ball_offset_m;
        [Vector3::new(d, 0.0, 0.0), Vector3::new(0.0, d, 0.0), Vector3::new(-d, 0.0, 0.0)]
    }
}

/// Where the lab believes something of a camera to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Pose of the chessboard in its image: first inner corner, and the board's axes as columns.
    Board(Point3<f64>, Rotation3<f64>),
    /// Approximate place of the camera, and a point it looks at.
    LookingAt(Point3<f64>, Point3<f64>),
}

/// One camera of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct RigCamera {
    /// Name, also of its folders and files.
    pub name: String,
    /// From a calibration of the lens alone.
    pub intrinsics: Intrinsics,
    /// What its pose starts from.
    pub placement: Placement,
}

/// What the times of the frames mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// They are when the exposure began (else: its middle).
    pub stamp_at_start: bool,
    /// How long it took, if the lab knows.
    pub exposure_s: Option<f64>,
}

/// The rig as the lab describes it.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Where it was read.
    pub file: PathBuf,
    /// Width and height of all images.
    pub size_px: [u32; 2],
    /// The board, if there is one.
    pub chessboard: Option<Chessboard>,
    /// The balls, if there are any.
    pub fixture: Option<Fixture>,
    /// The cameras in the order of the file.
    pub cameras: Vec<RigCamera>,
    /// Of the recordings made with it.
    pub timing: Timing,
    /// Where the centre of the first pixel lies in the lab's pixel coordinates: 0.5, or 0 as OpenCV counts.
    pub first_pixel: f64,
}

#[derive(Deserialize)]
struct RawRig {
    first_pixel: Option<f64>,
    timing: Option<RawTiming>,
    resolution: [u32; 2],
    chessboard: Option<RawBoard>,
    fixture: Option<RawFixture>,
    #[serde(default)]
    camera: Vec<RawCamera>,
}

#[derive(Deserialize)]
struct RawTiming {
    stamp: Option<String>,
    exposure_ms: Option<f64>,
}

#[derive(Deserialize)]
struct RawBoard {
    square_mm: f64,
    inner_corners: [usize; 2],
}

#[derive(Deserialize)]
struct RawFixture {
    ball_offset_mm: f64,
    ball_radius_mm: f64,
    x_ball: String,
    y_ball: String,
    neg_x_ball: String,
}

#[derive(Deserialize)]
struct RawCamera {
    name: String,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 4],
    chessboard_origin_mm: Option<[f64; 3]>,
    chessboard_rotation: Option<[[f64; 3]; 3]>,
    position_mm: Option<[f64; 3]>,
    look_at_mm: Option<[f64; 3]>,
}

/// Reads `rig.toml` of a folder.
///
/// # Errors
/// If it is absent, not TOML, or holds what no rig can have.
pub fn read(folder: &Path) -> Result<Rig> {
    let file = folder.join("rig.toml");
    let text = std::fs::read_to_string(&file).map_err(Error::read(&file))?;
    let raw: RawRig = toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        Error::content(&file, format!("line {line}"), error.message().replace('\n', " "), "see docs/vision.md for the keys")
    })?;
    let size_px = raw.resolution;
    if size_px.iter().any(|&side| !(16..=20_000).contains(&side)) {
        let what = format!("{} x {} px is no image", size_px[0], size_px[1]);
        return Err(Error::content(&file, "resolution", what, "give width and height of the images in px"));
    }
    let chessboard = raw.chessboard.map(|board| checked_board(&file, &board)).transpose()?;
    let fixture = raw.fixture.map(|fixture| checked_fixture(&file, fixture)).transpose()?;
    let first_pixel = raw.first_pixel.unwrap_or(0.5);
    if first_pixel != 0.0 && first_pixel != 0.5 {
        let what = format!("{first_pixel}");
        return Err(Error::content(&file, "first_pixel", what, "say 0.5 (counted from the corner) or 0.0 (as OpenCV)"));
    }
    let mut cameras: Vec<RigCamera> = Vec::new();
    for camera in raw.camera {
        let mut camera = checked_camera(&file, size_px, camera)?;
        camera.intrinsics.centre_px = camera.intrinsics.centre_px.map(|v| v + 0.5 - first_pixel);
        if cameras.iter().any(|other| other.name == camera.name) {
            return Err(Error::content(&file, &camera.name, "stands twice", "give each camera a name of its own"));
        }
        cameras.push(camera);
    }
    if cameras.len() < 2 {
        let what = format!("{} camera(s)", cameras.len());
        return Err(Error::content(&file, "camera", what, "a place in space takes two cameras at least"));
    }
    let timing = checked_timing(&file, raw.timing)?;
    Ok(Rig { file, size_px, chessboard, fixture, cameras, timing, first_pixel })
}

fn checked_timing(file: &Path, raw: Option<RawTiming>) -> Result<Timing> {
    let Some(raw) = raw else { return Ok(Timing { stamp_at_start: true, exposure_s: None }) };
    let stamp_at_start = match raw.stamp.as_deref() {
        None | Some("exposure_start") => true,
        Some("exposure_middle") => false,
        Some(other) => {
            let what = format!("stamp is '{other}'");
            return Err(Error::content(file, "timing", what, "say exposure_start or exposure_middle"));
        }
    };
    if raw.exposure_ms.is_some_and(|ms| !(0.0..=1000.0).contains(&ms)) {
        return Err(Error::content(file, "timing", "exposure_ms is not between 0 and 1000", "give it in milliseconds"));
    }
    Ok(Timing { stamp_at_start, exposure_s: raw.exposure_ms.map(|ms| ms * 1e-3) })
}

fn checked_board(file: &Path, board: &RawBoard) -> Result<Chessboard> {
    let [columns, rows] = board.inner_corners;
    let sound = board.square_mm > 0.0 && board.square_mm < 1e4 && (3..=50).contains(&columns) && (3..=50).contains(&rows);
    if !sound {
        let what = format!("squares of {} mm, {columns} x {rows} inner corners", board.square_mm);
        return Err(Error::content(file, "chessboard", what, "give the side in mm and 3 to 50 inner corners each way"));
    }
    Ok(Chessboard { square_m: board.square_mm * 1e-3, inner_corners: board.inner_corners })
}

fn checked_fixture(file: &Path, raw: RawFixture) -> Result<Fixture> {
    let sound = |value: f64| value > 0.1 && value < 1e4;
    if !sound(raw.ball_offset_mm) || !sound(raw.ball_radius_mm) {
        let what = format!("balls of radius {} mm at {} mm", raw.ball_radius_mm, raw.ball_offset_mm);
        return Err(Error::content(file, "fixture", what, "give both in mm"));
    }
    let balls = [raw.x_ball, raw.y_ball, raw.neg_x_ball];
    if balls[0] == balls[1] || balls[1] == balls[2] || balls[0] == balls[2] {
        return Err(Error::content(file, "fixture", "two balls of one colour", "use three colours"));
    }
    for ball in &balls {
        if crate::colour::nominal_hue_deg(ball).is_none() {
            let what = format!("unknown colour '{ball}'");
            return Err(Error::content(file, "fixture", what, format!("known are {}", crate::colour::NAMES.join(", "))));
        }
    }
    Ok(Fixture { ball_offset_m: raw.ball_offset_mm * 1e-3, ball_radius_m: raw.ball_radius_mm * 1e-3, balls })
}

fn checked_camera(file: &Path, size_px: [u32; 2], raw: RawCamera) -> Result<RigCamera> {
    let bad = |what: String, remedy: &str| Error::content(file, &raw.name, what, remedy);
    if raw.name.is_empty() || raw.name.contains(['/', '\\']) || raw.name.starts_with('.') {
        return Err(bad("is no name of a camera".into(), "use letters and digits"));
    }
    let intrinsics = Intrinsics { focal_px: [raw.fx, raw.fy], centre_px: [raw.cx, raw.cy], distortion: raw.distortion };
    if let Some(what) = absurdity(&intrinsics, size_px) {
        return Err(bad(what, "calibrate the lens anew, or take the image centre and no distortion"));
    }
    let placement = match (raw.chessboard_origin_mm, raw.chessboard_rotation, raw.position_mm, raw.look_at_mm) {
        (_, _, Some(position), Some(target)) => Placement::LookingAt(metres(position), metres(target)),
        (Some(origin), Some(rows), _, _) => {
            let axes = Matrix3::from_fn(|r, c| rows[r][c]);
            let off = (axes * axes.transpose() - Matrix3::identity()).norm();
            if !(off < 0.02 && axes.determinant() > 0.0) {
                return Err(bad("chessboard_rotation is no rotation".into(), "its columns are the board's axes in the world"));
            }
            Placement::Board(metres(origin), Rotation3::from_matrix(&axes))
        }
        _ => {
            let remedy = "give chessboard_origin_mm and chessboard_rotation, or position_mm and look_at_mm";
            return Err(bad("nothing says where it stands".into(), remedy));
        }
    };
    let finite = match &placement {
        Placement::Board(origin, _) => origin.iter().all(|v| v.is_finite()),
        Placement::LookingAt(place, target) => place.iter().chain(target.iter()).all(|v| v.is_finite()) && place != target,
    };
    if !finite {
        return Err(bad("its place is no number or the point it looks at".into(), "give three numbers in mm"));
    }
    Ok(RigCamera { name: raw.name, intrinsics, placement })
}

fn metres(mm: [f64; 3]) -> Point3<f64> {
    Point3::new(mm[0] * 1e-3, mm[1] * 1e-3, mm[2] * 1e-3)
}

/// What no lens of a camera can have: a view wider than 150 or narrower than 2 degrees, a principal point outside the middle half
/// of the image, or a distortion that folds the image.
pub fn absurdity(intrinsics: &Intrinsics, size_px: [u32; 2]) -> Option<String> {
    let width = f64::from(size_px[0]);
    let height = f64::from(size_px[1]);
    let [fx, fy] = intrinsics.focal_px;
    let [cx, cy] = intrinsics.centre_px;
    if !(fx > 0.13 * width && fx < 30.0 * width && (fx / fy - 1.0).abs() < 0.2) {
        return Some(format!("focal lengths of {fx} and {fy} px with images {width} px wide"));
    }
    if !((cx - width / 2.0).abs() < width / 4.0 && (cy - height / 2.0).abs() < height / 4.0) {
        return Some(format!("principal point ({cx}, {cy}) px in images of {width} x {height} px"));
    }
    let [k1, k2, p1, p2] = intrinsics.distortion;
    let corner2 = (width * width + height * height) / (4.0 * fx * fx);
    let slope = |r2: f64| 1.0 + r2 * (3.0 * k1 + 5.0 * k2 * r2);
    let folds = |r2: f64| slope(r2).is_nan() || slope(r2) <= 0.05;
    if folds(corner2) || folds(corner2 / 2.0) || !(p1.abs() < 0.1 && p2.abs() < 0.1) {
        return Some(format!("distortion [{k1}, {k2}, {p1}, {p2}] folds the image"));
    }
    None
}
