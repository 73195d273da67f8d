//! Inner corners of a chessboard in an image: saddle points of the brightness, put in order by walking the grid.

use crate::picture::Plane;
use nalgebra::{Matrix2, Point2, Vector2};

/// Width of the smoothing in which corners are looked for, px.
const COARSE_PX: f64 = 2.5;
/// Radius of the ring on which a corner is told from others, px.
const RING_PX: f64 = 5.0;
/// Half side of the window in which a corner is made exact, px.
const WINDOW_PX: i64 = 6;

/// Corners found, row by row: `columns` to a row, in one of the orders the board's symmetry allows.
#[derive(Debug, Clone)]
pub struct Corners {
    /// Corners along the board's x axis.
    pub columns: usize,
    /// Corners along its y axis.
    pub rows: usize,
    /// `rows * columns` pixels.
    pub pixels: Vec<Point2<f64>>,
}

impl Corners {
    /// The four orders: as it is, turned by 180 degrees, and the two mirror images (which only the back of a board shows).
    pub fn orders(&self) -> [Vec<Point2<f64>>; 4] {
        let pick = |mirror_x: bool, mirror_y: bool| {
            let mut pixels = Vec::with_capacity(self.pixels.len());
            for row in 0..self.rows {
                for column in 0..self.columns {
                    let c = if mirror_x { self.columns - 1 - column } else { column };
                    let r = if mirror_y { self.rows - 1 - row } else { row };
                    pixels.push(self.pixels[r * self.columns + c]);
                }
            }
            pixels
        };
        [pick(false, false), pick(true, true), pick(true, false), pick(false, true)]
    }
}

/// Finds the inner corners; `Err` says how many of them were seen.
///
/// # Errors
/// The number of corners in the largest grid, if that is not the board.
pub fn find(grey: &Plane, inner_corners: [usize; 2]) -> Result<Corners, usize> {
    let wanted = inner_corners[0] * inner_corners[1];
    let smooth = grey.blurred(COARSE_PX);
    let saddles = saddles(&smooth, wanted);
    let mut best = 0;
    // A grid may be begun at any of its corners; a false saddle begins none.
    for seed in 0..saddles.len().min(wanted) {
        let grid = walk(&saddles, seed);
        best = best.max(grid.len());
        if grid.len() < wanted {
            continue;
        }
        if let Some(corners) = ordered(&grid, inner_corners) {
            let fine = grey.blurred(1.0);
            // From indices to the image's corner.
            let pixels = corners.iter().map(|corner| exact(&fine, *corner) + Vector2::new(0.5, 0.5)).collect();
            return Ok(Corners { columns: inner_corners[0], rows: inner_corners[1], pixels });
        }
    }
    Err(best)
}

/// Local minima of the Hessian's determinant that are strong beside the strongest ones.
fn saddles(plane: &Plane, wanted: usize) -> Vec<Point2<f64>> {
    let (w, h) = (plane.width as i64, plane.height as i64);
    let response = |x: i64, y: i64| {
        let v = |dx: i64, dy: i64| plane.at(x + dx, y + dy);
        let xx = v(1, 0) - 2.0 * v(0, 0) + v(-1, 0);
        let yy = v(0, 1) - 2.0 * v(0, 0) + v(0, -1);
        let xy = 0.25 * (v(1, 1) - v(1, -1) - v(-1, 1) + v(-1, -1));
        xy * xy - xx * yy
    };
    let mut all = vec![0.0_f32; plane.values.len()];
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            all[(y * w + x) as usize] = response(x, y);
        }
    }
    let mut peaks: Vec<(f32, Point2<f64>)> = Vec::new();
    for y in 3..h - 3 {
        for x in 3..w - 3 {
            let own = all[(y * w + x) as usize];
            let top = own > 0.0
                && (-3..=3).all(|dy: i64| {
                    (-3..=3).all(|dx: i64| {
                        let other = all[((y + dy) * w + x + dx) as usize];
                        other < own || (other == own && (dy, dx) >= (0, 0))
                    })
                });
            if top && symmetric(plane, x as f64, y as f64) {
                peaks.push((own, Point2::new(x as f64, y as f64)));
            }
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Half of the wanted corners are surely among the strongest; corners of one board are alike.
    let reference = peaks.get(wanted / 2).map_or(0.0, |peak| peak.0);
    peaks.retain(|peak| peak.0 > 0.2 * reference && peak.0 > 1e-3);
    peaks.truncate(4 * wanted);
    peaks.into_iter().map(|peak| peak.1).collect()
}

/// Round the meeting of four squares opposite sides look alike; round the outer corner of a single square they do not.
fn symmetric(plane: &Plane, x: f64, y: f64) -> bool {
    let ring: Vec<f32> = (0..16)
        .map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
            plane.sample(x + RING_PX * cosine, y + RING_PX * sine)
        })
        .collect();
    let range = ring.iter().copied().fold(f32::MIN, f32::max) - ring.iter().copied().fold(f32::MAX, f32::min);
    let unlike: f32 = (0..8).map(|k| (ring[k] - ring[k + 8]).abs()).sum::<f32>() / 8.0;
    unlike < 0.25 * range
}

type Grid = std::collections::BTreeMap<(i32, i32), Point2<f64>>;

/// Grows a grid from one saddle: steps go on as the last one, and bend with the perspective.
fn walk(saddles: &[Point2<f64>], seed: usize) -> Grid {
    let mut grid = Grid::new();
    let start = saddles[seed];
    let mut near: Vec<Vector2<f64>> = saddles.iter().map(|p| p - start).filter(|d| d.norm() > 1.0).collect();
    near.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let Some(first) = near.first().copied() else { return grid };
    let across = near.iter().take(8).find(|d| {
        let sine = (first.x * d.y - first.y * d.x).abs() / (first.norm() * d.norm());
        sine > 0.35 && d.norm() < 3.0 * first.norm()
    });
    let Some(second) = across.copied() else { return grid };
    let nearest = |at: Point2<f64>, tolerance: f64| {
        saddles
            .iter()
            .map(|p| ((p - at).norm(), *p))
            .filter(|(distance, _)| *distance < tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, p)| p)
    };
    grid.insert((0, 0), start);
    let mut open = vec![((0, 0), first, second)];
    while let Some((place, along, up)) = open.pop() {
        let here = grid[&place];
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let next = (place.0 + dx, place.1 + dy);
            if grid.contains_key(&next) || next.0.abs() > 60 || next.1.abs() > 60 {
                continue;
            }
            let step = along * f64::from(dx) + up * f64::from(dy);
            let Some(found) = nearest(here + step, 0.25 * step.norm()) else { continue };
            if grid.values().any(|other| *other == found) {
                continue;
            }
            let taken = found - here;
            grid.insert(next, found);
            let bend = |old: Vector2<f64>, sign: i32| if sign == 0 { old } else { taken * f64::from(sign) };
            open.insert(0, (next, bend(along, dx), bend(up, dy)));
        }
    }
    grid
}

/// Rows of the board out of a full grid, columns along the longer side as the board has them.
fn ordered(grid: &Grid, [columns, rows]: [usize; 2]) -> Option<Vec<Point2<f64>>> {
    let (x0, x1) = (grid.keys().map(|k| k.0).min()?, grid.keys().map(|k| k.0).max()?);
    let (y0, y1) = (grid.keys().map(|k| k.1).min()?, grid.keys().map(|k| k.1).max()?);
    let (w, h) = ((x1 - x0 + 1) as usize, (y1 - y0 + 1) as usize);
    if grid.len() != columns * rows {
        return None;
    }
    let at = |c: usize, r: usize| grid.get(&(x0 + c as i32, y0 + r as i32)).copied();
    let mut pixels = Vec::with_capacity(columns * rows);
    for r in 0..rows {
        for c in 0..columns {
            pixels.push(if (w, h) == (columns, rows) {
                at(c, r)?
            } else if (w, h) == (rows, columns) {
                at(r, c)?
            } else {
                return None;
            });
        }
    }
    Some(pixels)
}

/// The point whose connections to the pixels round it are perpendicular to their gradients (Foerstner and Guelch, 1987).
fn exact(plane: &Plane, start: Point2<f64>) -> Point2<f64> {
    let mut at = start;
    for _ in 0..20 {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for dy in -WINDOW_PX..=WINDOW_PX {
            for dx in -WINDOW_PX..=WINDOW_PX {
                let offset = Vector2::new(dx as f64, dy as f64);
                let p = at + offset;
                let gradient = Vector2::new(
                    f64::from(plane.sample(p.x + 0.5, p.y) - plane.sample(p.x - 0.5, p.y)),
                    f64::from(plane.sample(p.x, p.y + 0.5) - plane.sample(p.x, p.y - 0.5)),
                );
                let weight = (-offset.norm_squared() / 18.0).exp();
                let outer = gradient * gradient.transpose() * weight;
                normal += outer;
                right += outer * offset;
            }
        }
        let Some(step) = normal.try_inverse().map(|inverse| inverse * right) else { return start };
        if !step.iter().all(|v| v.is_finite()) || (at + step - start).norm() > 4.0 {
            return start;
        }
        at += step;
        if step.norm() < 1e-4 {
            break;
        }
    }
    at
}
