//! What stands still behind the balls, and boards.

use crate::eye::{Eye, Sights};
use crate::random::Random;
use crate::rig::{Board, CORNERS, SQUARE_M};
use crate::scene::{PAINTS, Scene};
use nalgebra::Vector3;

/// An image of light, row by row; 1 is white.
#[derive(Debug, Clone)]
pub(crate) struct Plate {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) light: Vec<[f32; 3]>,
}

/// A blot of paint on the wall: an ellipse or a bar.
struct Blot {
    centre: [f64; 2],
    half: [f64; 2],
    turn: f64,
    round: bool,
    colour: [f64; 3],
}

impl Blot {
    /// How much of it covers a place: 1 inside, 0 outside, and a pixel between.
    fn cover(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let (sine, cosine) = self.turn.sin_cos();
        let (a, b) = ((dx * cosine + dy * sine) / self.half[0], (dy * cosine - dx * sine) / self.half[1]);
        let out = if self.round { a.hypot(b) } else { a.abs().max(b.abs()) };
        ((1.0 - out) * self.half[0].min(self.half[1]) + 0.5).clamp(0.0, 1.0)
    }
}

/// Distance of the places at which clouds are worked out, px.
const STEP: usize = 8;

/// The wall behind, as one camera sees it: cloudy grey, and blots in and near the colours of the balls.
pub(crate) fn wall(scene: &Scene, eye: &Eye, random: &mut Random) -> Plate {
    let [width, height] = eye.size_px.map(|n| n as usize);
    let scale = width as f64 / 1280.0;
    let clouds: Vec<[f64; 4]> = (0..24)
        .map(|_| {
            let size = random.between(60.0, 260.0) * scale;
            [random.share() * width as f64, random.share() * height as f64, size, random.between(-0.5, 0.5)]
        })
        .collect();
    let blots: Vec<Blot> = (0..scene.clutter)
        .map(|k| {
            let of_ball = random.share() < 0.8;
            let paint = if of_ball { scene.paint(k % 3) } else { PAINTS[random.bits() as usize % PAINTS.len()].1 };
            let size = random.between(12.0, 45.0) * scale;
            let round = random.share() < 0.7;
            Blot {
                centre: [random.share() * width as f64, random.share() * height as f64],
                half: if round { [size, size] } else { [size, size * random.between(0.3, 2.0)] },
                turn: random.between(0.0, 3.2),
                round,
                colour: paint.map(|c| (c * random.between(0.8, 1.1)).min(1.0)),
            }
        })
        .collect();
    let cloud_at = |x: f64, y: f64| -> f64 {
        let one = |[cx, cy, size, depth]: &[f64; 4]| depth * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * size * size)).exp();
        clouds.iter().map(one).sum()
    };
    // Clouds are smooth: every eighth place is worked out, and lines are drawn between.
    let columns = width / STEP + 2;
    let coarse: Vec<f64> =
        (0..columns * (height / STEP + 2)).map(|k| cloud_at((k % columns * STEP) as f64, (k / columns * STEP) as f64)).collect();
    let mut light = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let (at, a, b) = (row / STEP * columns + column / STEP, x / STEP as f64 % 1.0, y / STEP as f64 % 1.0);
            let cloud = (coarse[at] * (1.0 - a) + coarse[at + 1] * a) * (1.0 - b)
                + (coarse[at + columns] * (1.0 - a) + coarse[at + columns + 1] * a) * b;
            let grey = scene.background * (1.0 + cloud).clamp(0.1, 1.9);
            let mut colour = [grey; 3];
            for blot in &blots {
                let cover = blot.cover(x, y);
                if cover > 0.0 {
                    colour = std::array::from_fn(|k| colour[k] * (1.0 - cover) + 0.8 * blot.colour[k] * cover);
                }
            }
            light.push(colour.map(|v| (v * scene.brightness) as f32));
        }
    }
    Plate { width, height, light }
}

/// A board in front of darkness.
pub(crate) fn board(eye: &Eye, sights: &Sights, board: &Board) -> Plate {
    const SIDE: usize = 3;
    let [width, height] = eye.size_px.map(|n| n as usize);
    let normal = board.axes.column(2).into_owned();
    let offset = (board.origin_m - eye.place_m).dot(&normal);
    let mut light = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let mut sum = 0.0;
            for k in 0..SIDE * SIDE {
                let inside = |n: usize| (n as f64 + 0.5) / SIDE as f64;
                let direction = sights.direction(column, row, inside(k % SIDE), inside(k / SIDE));
                let distance = offset / direction.dot(&normal);
                let at = board.axes.transpose() * (eye.place_m + direction * distance - board.origin_m);
                sum += if distance > 0.0 { board_at(&at) } else { DARK };
            }
            light.push([(sum / (SIDE * SIDE) as f64) as f32; 3]);
        }
    }
    Plate { width, height, light }
}

const DARK: f64 = 0.03;

/// Brightness of a place on the board's plane.
fn board_at(at: &Vector3<f64>) -> f64 {
    // Squares reach one beyond the inner corners, and the white margin another three quarters.
    let (i, j) = ((at.x / SQUARE_M).floor(), (at.y / SQUARE_M).floor());
    let within = |value: f64, count: usize, margin: f64| value >= -1.0 - margin && value < count as f64 + margin;
    let (x, y) = (at.x / SQUARE_M, at.y / SQUARE_M);
    if within(x, CORNERS[0], 0.0) && within(y, CORNERS[1], 0.0) {
        return if (i + j).rem_euclid(2.0) < 0.5 { 0.05 } else { 0.85 };
    }
    if within(x, CORNERS[0], 0.75) && within(y, CORNERS[1], 0.75) { 0.85 } else { DARK }
}
