//! A whole recording: frame after frame, with what the last ones say about the next.

use crate::camera::Camera;
use crate::colour;
use crate::edge::Cone;
use crate::error::{Error, Result};
use crate::frame::Scene;
use crate::outcome::{Found, Lost, Measured, Row, Tracked, View};
use crate::paper::{PaperFrame, PaperTracker};
use crate::recording::Recording;
use crate::rig::{Fixture, Rig};
use crate::timing;
use crate::update::Ledger;
use nalgebra::Point3;
use std::path::Path;

/// How a recording is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// Rims, weighted least squares, adjustment of all bearings.
    #[default]
    Default,
    /// Hough circles, midpoints, Nelder-Mead, as the paper.
    Paper,
}

/// Places of the work space that outlines may have, m from the point all cameras look at.
const WORKSPACE_M: f64 = 0.16;
/// Outlines that the halo is taken from.
const HALOS: usize = 600;
/// Frames from which colours are learnt.
const COLOUR_FRAMES: usize = 8;

/// Measures a recording; `progress` is told how many frames are done.
///
/// # Errors
/// If files are absent or not sound, or `cameras` do not fit the rig.
pub fn track(
    cameras: &[Camera],
    bearing_px: &[f64],
    rig: &Rig,
    folder: &Path,
    mode: Mode,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Tracked> {
    let fixture = rig.fixture.as_ref().ok_or_else(|| {
        Error::content(&rig.file, "fixture", "absent", "give ball_offset_mm, ball_radius_mm, x_ball, y_ball, neg_x_ball")
    })?;
    let recording = Recording::open(rig, folder)?;
    let images = recording.sample(COLOUR_FRAMES)?;
    let ranges = colour::learn(&fixture.balls, images.iter());
    drop(images);
    let mut scene = Scene {
        cameras,
        bearing_px: bearing_px.to_vec(),
        fixture,
        ranges,
        radius_px: radius_bounds_px(cameras, fixture),
        halo_px: [0.15, 0.25],
    };
    let mut ledger = Ledger::new(cameras.len(), mode == Mode::Paper);
    let mut paper = PaperTracker::new(&scene);
    let (mut rows, mut halos) = (Vec::new(), Vec::new());
    let frames = &recording.frames;
    let mut next = frames.first().map(|frame| recording.images(frame));
    for (index, frame) in frames.iter().enumerate() {
        let Some(read) = next.take() else { break };
        let (images, remarks): (Vec<_>, Vec<_>) = read?.into_iter().unzip();
        // The next frame is read while this one is measured.
        let (result, ahead) = std::thread::scope(|scope| {
            let reader = frames.get(index + 1).map(|frame| scope.spawn(|| recording.images(frame)));
            let result = match mode {
                Mode::Paper => paper.measure(&scene, &images).map(|frame| (of_paper(&frame), None)),
                Mode::Default => measured(&scene, &images, &mut ledger, frame.t_s).map(|m| (found(&m), Some(m))),
            };
            (result, reader.map(|reader| reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))))
        });
        next = ahead;
        let (found, views) = match result {
            Ok((found, Some(measured))) => {
                halos.extend(scene.halos_px(&measured));
                halos.drain(..halos.len().saturating_sub(HALOS));
                scene.halo_px = halo(&halos);
                (Ok(found), kept(measured.views, index % timing::step(frames.len()) == 0))
            }
            Ok((found, None)) => (Ok(found), Vec::new()),
            Err(lost) => (Err(lost), Vec::new()),
        };
        rows.push(Row { frame: frame.frame, t_s: frame.t_s, found, remarks: remarks.into_iter().flatten().collect(), views });
        progress(rows.len(), frames.len());
    }
    let exposure_s = match mode {
        Mode::Default => timing::to_frame_times(&mut rows, &scene, &rig.timing),
        Mode::Paper => None,
    };
    let names = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
    Ok(Tracked { rows, cameras: names, balls: fixture.balls.clone(), exposure_s, start_unix_s: recording.start_unix_s })
}

/// Views of a frame; the points of their rims are many and needed of few frames only.
fn kept(mut views: [Vec<View>; 3], points: bool) -> Vec<Vec<View>> {
    for view in views.iter_mut().flatten() {
        if let View::Effective(sighting) = view
            && !points
        {
            sighting.points = Vec::new();
        }
    }
    views.to_vec()
}

fn of_paper(frame: &PaperFrame) -> Found {
    Found { pose: frame.pose, covariance: None, balls_m: frame.balls_m, cameras: frame.cameras, residual_m: frame.residual_m }
}

fn measured(
    scene: &Scene,
    images: &[Option<image::RgbImage>],
    ledger: &mut Ledger,
    t_s: f64,
) -> std::result::Result<Measured, Lost> {
    let expected = ledger.expected(t_s);
    let mut waiting = Vec::new();
    let result = scene.measure(images, expected.as_ref().map(|(pose, near)| (pose, *near))).and_then(|measured| {
        waiting = ledger.waiting(&measured.views);
        if waiting.is_empty() { Ok(measured) } else { scene.without(measured, &waiting).map_err(|_| Lost::Waiting) }
    });
    match &result {
        Ok(measured) => ledger.measured(t_s, &measured.fitted.pose, &measured.views),
        // Together they are consistent, and after some frames of that they count.
        Err(_) => ledger.lost(&waiting),
    }
    result
}

fn found(measured: &Measured) -> Found {
    Found {
        pose: measured.fitted.pose,
        covariance: Some(measured.fitted.covariance),
        balls_m: measured.balls.map(|ball| ball.point_m),
        cameras: std::array::from_fn(|k| measured.views[k].iter().filter(|v| matches!(v, View::Effective(_))).count()),
        residual_m: measured.residual_m,
    }
}

/// Median halo of the last outlines, and how well it is known.
fn halo(halos: &[f64]) -> [f64; 2] {
    let mut sorted = halos.to_vec();
    sorted.sort_by(f64::total_cmp);
    if sorted.len() < 10 { [0.15, 0.25] } else { [sorted[sorted.len() / 2], 0.1] }
}

/// The point nearest to all optical axes: the middle of the work space.
pub fn workspace_m(cameras: &[Camera]) -> Option<Point3<f64>> {
    let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for camera in cameras {
        let axis = camera.rotation.inverse() * nalgebra::Vector3::z();
        let across = nalgebra::Matrix3::identity() - axis * axis.transpose();
        normal += across;
        right += across * camera.centre_m.coords;
    }
    Some(Point3::from(normal.try_inverse()? * right))
}

/// Least and largest radius of an outline in the work space, per camera.
pub fn radius_bounds_px(cameras: &[Camera], fixture: &Fixture) -> Vec<[f64; 2]> {
    let middle = workspace_m(cameras).unwrap_or_else(Point3::origin);
    let radius = |camera: &Camera, distance_m: f64| {
        let cone = Cone::of_sphere(&nalgebra::Vector3::new(0.0, 0.0, distance_m), fixture.ball_radius_m);
        cone.map_or(4000.0, |cone| cone.opening_rad.tan() * camera.intrinsics.focal_px[0])
    };
    let of = |camera: &Camera| {
        let distance = (middle - camera.centre_m).norm();
        let reach = WORKSPACE_M.min(0.5 * distance);
        [(radius(camera, distance + reach) - 1.0).max(3.0), (radius(camera, distance - reach) + 1.0).min(4000.0)]
    };
    cameras.iter().map(of).collect()
}
