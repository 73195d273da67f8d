//! A rig drawn from a seed: what is true, and what the lab believes of it.

use crate::eye::{Eye, Lens};
use crate::random::Random;
use crate::scene::Scene;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Middle of the work space, m.
pub(crate) const WORKSPACE_M: Vector3<f64> = Vector3::new(0.0, 0.0, 0.244);
/// Inner corners of the board along its x and y axes, and the side of its squares.
pub(crate) const CORNERS: [usize; 2] = [8, 6];
pub(crate) const SQUARE_M: f64 = 0.009;

/// A flat board: place of the first inner corner, and its axes as columns (z away from who looks at it).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Board {
    pub(crate) origin_m: Vector3<f64>,
    pub(crate) axes: Matrix3<f64>,
}

/// A camera with its board, both as they are and as the lab has them.
#[derive(Debug, Clone)]
pub(crate) struct Station {
    pub(crate) eye: Eye,
    pub(crate) board: Board,
    pub(crate) believed_lens: Lens,
    pub(crate) believed_board: Board,
}

/// A marker: true place and measured one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Marker {
    pub(crate) true_m: Vector3<f64>,
    pub(crate) measured_m: Vector3<f64>,
}

/// All of it.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub(crate) stations: Vec<Station>,
    pub(crate) markers: Vec<Marker>,
}

impl Rig {
    pub(crate) fn drawn(scene: &Scene, seed: u64) -> Self {
        let mut random = Random::new(seed, 1);
        let places = places(scene, &mut random);
        let stations = places.iter().enumerate().map(|(k, place)| station(scene, k, place, &mut random)).collect();
        // Two heights of four corners and four sides, as on the paper's frame.
        let feet = [(127.0, -127.0), (60.0, -140.0), (127.0, 127.0), (60.0, 140.0)];
        let feet = feet.into_iter().chain(feet.map(|(x, y)| (-x, -y)));
        let markers = feet
            .flat_map(|(x, y)| [279.4, 215.9].map(|z| Vector3::new(x, y, z) * 1e-3))
            .map(|true_m| Marker { true_m, measured_m: true_m + noise(&mut random) * (scene.marker_error_mm * 1e-3) })
            .collect();
        Self { stations, markers }
    }
}

fn noise(random: &mut Random) -> Vector3<f64> {
    Vector3::new(random.normal(), random.normal(), random.normal())
}

/// Where cameras stand and look, m.
fn places(scene: &Scene, random: &mut Random) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    if !scene.camera.is_empty() {
        return scene
            .camera
            .iter()
            .map(|place| (Vector3::from(place.position_mm) * 1e-3, Vector3::from(place.look_at_mm) * 1e-3))
            .collect();
    }
    (0..scene.cameras)
        .map(|k| {
            let turn = std::f64::consts::TAU * (k as f64 + 0.5) / scene.cameras as f64 - std::f64::consts::FRAC_PI_2;
            let place = Vector3::new(turn.cos(), turn.sin(), 0.0) * scene.distance_mm + Vector3::z() * scene.height_mm;
            (place * 1e-3 + noise(random) * 0.01, WORKSPACE_M + noise(random) * 0.006)
        })
        .collect()
}

fn station(scene: &Scene, index: usize, (place_m, target_m): &(Vector3<f64>, Vector3<f64>), random: &mut Random) -> Station {
    let width = f64::from(scene.resolution[0]);
    let [cx, cy] = scene.resolution.map(|side| f64::from(side) / 2.0);
    let k1 = scene.distortion * random.between(0.7, 1.3);
    let lens = Lens {
        focal_px: scene.focal * width * random.between(0.995, 1.005),
        centre_px: [cx + 0.006 * width * random.normal(), cy + 0.006 * width * random.normal()],
        bend: [k1, -0.5 * k1, 4e-4 * random.normal(), 4e-4 * random.normal()],
    };
    let eye = Eye {
        name: format!("cam{index}"),
        axes: facing(&(target_m - place_m), random.normal() * 0.02),
        place_m: *place_m,
        lens,
        size_px: scene.resolution,
    };
    let believed_lens = Lens {
        focal_px: lens.focal_px * (1.0 + scene.focal_error * random.normal()),
        centre_px: lens.centre_px.map(|centre| centre + scene.centre_error_px * random.normal()),
        bend: [lens.bend[0] + 0.001 * random.normal(), lens.bend[1] + 0.001 * random.normal(), lens.bend[2], lens.bend[3]],
    };
    let board = board(&eye, target_m, random);
    let slip = Rotation3::new(noise(random) * (scene.board_error_deg.to_radians() / 3.0_f64.sqrt()));
    let believed_board = Board {
        origin_m: board.origin_m + noise(random) * (scene.board_error_mm * 1e-3 / 3.0_f64.sqrt()),
        axes: slip.matrix() * board.axes,
    };
    Station { eye, board, believed_lens, believed_board }
}

/// Axes of an eye that looks along a direction, upright but for a roll.
fn facing(direction: &Vector3<f64>, roll_rad: f64) -> Matrix3<f64> {
    let forward = direction.normalize();
    let up = if forward.z.abs() > 0.99 { Vector3::y() } else { Vector3::z() };
    let right = forward.cross(&up).normalize();
    let down = forward.cross(&right);
    let upright = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    Rotation3::from_axis_angle(&Vector3::z_axis(), roll_rad).matrix() * upright
}

/// A board held between an eye and the work space, leaning, and large enough in the image.
fn board(eye: &Eye, target_m: &Vector3<f64>, random: &mut Random) -> Board {
    let lean = Rotation3::from_euler_angles(random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(-0.4, 0.4));
    // The board's axes in the eye's frame: its x to the right, y up, so that z comes towards the eye.
    let upright = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    let axes = eye.axes.transpose() * (lean.matrix() * upright);
    // Half of the image's height, or nearer than the work space in any case.
    let height = SQUARE_M * (CORNERS[0] + 3) as f64;
    let wanted_m = height * eye.lens.focal_px / (0.55 * f64::from(eye.size_px[1]));
    let distance_m = wanted_m.min(0.8 * (target_m - eye.place_m).norm());
    let forward = eye.axes.row(2).transpose();
    let middle = eye.place_m + forward * distance_m;
    let half = Vector3::new((CORNERS[0] - 1) as f64, (CORNERS[1] - 1) as f64, 0.0) * (SQUARE_M / 2.0);
    Board { origin_m: middle - axes * half, axes }
}
