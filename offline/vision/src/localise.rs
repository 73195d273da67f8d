//! First poses of the cameras, and the paper's: one camera at a time by Levenberg-Marquardt on its ray equations.

use crate::camera::Camera;
use crate::chessboard::{self, Corners};
use crate::error::{Error, Result};
use crate::least_squares::minimise;
use crate::picture::{self, Plane};
use crate::plane_pose::{moved, plane_pose};
use crate::rig::{Chessboard, Placement, Rig, RigCamera};
use crate::table::Pick;
use nalgebra::{DVector, Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use std::path::Path;

/// What is known of one camera before its markers are adjusted.
#[derive(Debug, Clone)]
pub struct First {
    /// First pose.
    pub camera: Camera,
    /// Corners of its board image in the board's order, and the board's pose in the camera's frame.
    pub board: Option<(Vec<Point2<f64>>, Isometry3<f64>)>,
}

/// Points of a board in its own plane, in the order of its corners.
pub fn board_points_m(board: &Chessboard) -> Vec<[f64; 2]> {
    let [columns, rows] = board.inner_corners;
    let at = |k: usize| [(k % columns) as f64 * board.square_m, (k / columns) as f64 * board.square_m];
    (0..columns * rows).map(at).collect()
}

/// First poses of all cameras: from the board in `chessboard/NAME.*`, the right one of its orders chosen by the markers, or from the
/// approximate place in the rig.
///
/// # Errors
/// If a board image is absent, of another size, or the board is not found in it.
pub fn first_poses(rig: &Rig, folder: &Path, picks: &[Pick]) -> Result<Vec<First>> {
    let mut firsts = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        let own: Vec<&Pick> = picks.iter().filter(|pick| pick.camera == index).collect();
        firsts.push(match camera.placement {
            Placement::LookingAt(place, target) => {
                let made = Camera::looking_at(&camera.name, place, target, camera.intrinsics, rig.size_px);
                let camera = made.ok_or_else(|| {
                    Error::content(&rig.file, &camera.name, "position_mm and look_at_mm are one point", "give two points")
                })?;
                First { camera, board: None }
            }
            Placement::Board(origin, axes) => {
                let board = rig.chessboard.ok_or_else(|| {
                    Error::content(&rig.file, "chessboard", "absent", "give square_mm and inner_corners of the board")
                })?;
                let corners = board_corners(rig, &board, folder, camera)?;
                let world = Isometry3::from_parts(Translation3::from(origin.coords), UnitQuaternion::from(axes));
                from_board(rig, &board, &corners, camera, &world, &own).ok_or_else(|| {
                    Error::content(&rig.file, &camera.name, "no pose explains its chessboard", "retake the board image")
                })?
            }
        });
    }
    Ok(firsts)
}

fn board_corners(rig: &Rig, board: &Chessboard, folder: &Path, camera: &RigCamera) -> Result<Corners> {
    let images = folder.join("chessboard");
    let remedy = "take one, or give position_mm and look_at_mm in rig.toml";
    let file = picture::find(&images, &camera.name)
        .ok_or_else(|| Error::content(&images, &camera.name, "no image of the chessboard", remedy))?;
    let image = picture::read(&file, rig.size_px)?;
    let grey = Plane::of(&image, |[r, g, b]| 0.299 * r + 0.587 * g + 0.114 * b);
    chessboard::find(&grey, board.inner_corners).map_err(|seen| {
        let [columns, rows] = board.inner_corners;
        let what = format!("board of {columns} x {rows} inner corners not found ({seen} corners seen)");
        Error::content(&file, "chessboard", what, "show the whole board, sharp and evenly lit")
    })
}

fn from_board(
    rig: &Rig,
    board: &Chessboard,
    corners: &Corners,
    camera: &RigCamera,
    world: &Isometry3<f64>,
    picks: &[&Pick],
) -> Option<First> {
    let points = board_points_m(board);
    let candidates = corners.orders().into_iter().filter_map(|pixels| {
        let (pose, _) = plane_pose(&camera.intrinsics, &points, &pixels)?;
        let placed = camera_at(&camera.name, &(pose * world.inverse()), camera, rig.size_px);
        Some((marker_misfit(&placed, picks), First { camera: placed, board: Some((pixels, pose)) }))
    });
    candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, first)| first)
}

fn camera_at(name: &str, world_to_camera: &Isometry3<f64>, camera: &RigCamera, size_px: [u32; 2]) -> Camera {
    let rotation = world_to_camera.rotation.to_rotation_matrix();
    let centre = -(rotation.inverse() * world_to_camera.translation.vector);
    Camera { name: name.to_owned(), rotation, centre_m: Point3::from(centre), intrinsics: camera.intrinsics, size_px }
}

/// Median distance between marked and predicted pixels; markers behind the camera count as far off.
fn marker_misfit(camera: &Camera, picks: &[&Pick]) -> f64 {
    let mut distances: Vec<f64> =
        picks.iter().map(|pick| camera.project(&pick.position_m).map_or(1e6, |pixel| (pixel - pick.pixel).norm())).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}

/// The camera turned by a rotation vector in its own frame and shifted in the world.
pub fn displaced(camera: &Camera, by: &[f64]) -> Camera {
    let start = Isometry3::from_parts(Translation3::from(camera.centre_m.coords), UnitQuaternion::from(camera.rotation));
    let next = moved(&start, by);
    Camera { rotation: next.rotation.to_rotation_matrix(), centre_m: Point3::from(next.translation.vector), ..camera.clone() }
}

/// Steps of the differences for rotation vector (rad) and centre (m).
pub(crate) const POSE_STEPS: [f64; 6] = [1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6];

/// The paper's way: per camera, rotation and centre for which the ray of each marked pixel, as long as the marker is far, ends at the
/// marker. Equations (1) to (3) give three residuals per marker. Intrinsics stay what they are.
///
/// # Errors
/// Names a camera with fewer than four markers, or whose markers determine no pose.
pub fn paper_poses(rig: &Rig, firsts: &[First], picks: &[Pick]) -> Result<Vec<Camera>> {
    let mut cameras = Vec::new();
    for (index, first) in firsts.iter().enumerate() {
        let own: Vec<&Pick> = picks.iter().filter(|pick| pick.camera == index).collect();
        enough_markers(rig, index, own.len())?;
        let residuals = |x: &DVector<f64>| {
            let camera = displaced(&first.camera, x.as_slice());
            let rays = own.iter().flat_map(|pick| {
                let to_marker = pick.position_m - camera.centre_m;
                let miss: Vector3<f64> = camera.ray(pick.pixel).into_inner() * to_marker.norm() - to_marker;
                [miss.x, miss.y, miss.z]
            });
            Some(DVector::from_iterator(3 * own.len(), rays))
        };
        let minimum = minimise(DVector::zeros(6), &DVector::from_row_slice(&POSE_STEPS), 200, residuals)
            .filter(|minimum| minimum.parameters.iter().all(|value| value.is_finite()))
            .ok_or_else(|| {
                Error::content(&rig.file, &first.camera.name, "its markers determine no pose", "check its first pose")
            })?;
        cameras.push(displaced(&first.camera, minimum.parameters.as_slice()));
    }
    Ok(cameras)
}

/// A pose has six unknowns; four markers leave something to check it with.
pub(crate) fn enough_markers(rig: &Rig, camera: usize, count: usize) -> Result<()> {
    if count >= 4 {
        return Ok(());
    }
    let file = rig.file.with_file_name("markers.csv");
    let what = format!("{count} marker(s) are marked");
    Err(Error::content(&file, &rig.cameras[camera].name, what, "mark four at least, better all, in each image"))
}
