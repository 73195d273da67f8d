//! Where the rim of a ball crosses the normals of its expected outline, to a fraction of a pixel.

use crate::camera::Intrinsics;
use image::RgbImage;
use nalgebra::{Point2, Unit, Vector2, Vector3};

/// Half length of a profile, px.
const REACH_PX: f64 = 5.0;

/// How closely a rim is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Detail {
    /// Normals round the outline.
    pub normals: usize,
    /// Distance of the samples along each, px.
    pub step_px: f64,
}

/// To find a rim.
pub const COARSE: Detail = Detail { normals: 60, step_px: 0.5 };
/// To measure it.
pub const FINE: Detail = Detail { normals: 120, step_px: 0.25 };

/// Least contrast of a rim, in grey levels.
const CONTRAST: f32 = 12.0;

/// A cone of rays that touch a sphere: the outline of a ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Direction to the sphere's centre, in the camera's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Half opening, rad: its sine is radius over distance.
    pub opening_rad: f64,
}

impl Cone {
    /// Of a sphere in the camera's frame; `None` if the camera is inside or the sphere behind.
    pub fn of_sphere(centre_m: &Vector3<f64>, radius_m: f64) -> Option<Self> {
        let distance = centre_m.norm();
        (distance > radius_m && centre_m.z > 0.0)
            .then(|| Self { axis: Unit::new_normalize(*centre_m), opening_rad: (radius_m / distance).asin() })
    }

    /// Of a circle in the image, as a start: its centre and radius are taken for those of the cone.
    pub fn of_circle(intrinsics: &Intrinsics, centre: Point2<f64>, radius_px: f64) -> Self {
        let axis = intrinsics.direction(centre);
        // Off the axis of the camera the outline is longer than wide; the mean of both is what a circle fits.
        let rim =
            |dx: f64, dy: f64| axis.angle(&intrinsics.direction(Point2::new(centre.x + dx * radius_px, centre.y + dy * radius_px)));
        Self { axis, opening_rad: 0.25 * (rim(1.0, 0.0) + rim(-1.0, 0.0) + rim(0.0, 1.0) + rim(0.0, -1.0)) }
    }

    /// Ray on the cone at an angle round its axis.
    pub fn ray(&self, angle_rad: f64) -> Vector3<f64> {
        let (a, b) = crosswise(&self.axis);
        let (sine, cosine) = angle_rad.sin_cos();
        self.axis.into_inner() * self.opening_rad.cos() + (a * cosine + b * sine) * self.opening_rad.sin()
    }
}

/// Two directions that complete an axis to a right-handed frame; the first as near to the image's u as can be.
pub fn crosswise(axis: &Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let b = axis.cross(&Vector3::x()).normalize();
    let a = b.cross(axis);
    (a, b)
}

/// A place on a rim.
#[derive(Debug, Clone, Copy)]
pub struct RimPoint {
    /// Angle round the cone's axis, rad.
    pub angle_rad: f64,
    /// Where the rim is.
    pub pixel: Point2<f64>,
    /// Outward normal of the outline in the image.
    pub normal: Vector2<f64>,
    /// Colour a few pixels inside.
    pub inside: [f32; 3],
    /// Colour a few pixels outside.
    pub outside: [f32; 3],
    /// From a quarter to three quarters of the change, px.
    pub width_px: f64,
}

/// What is found on one normal of an outline.
struct Crossing {
    offset_px: f64,
    inside: [f32; 3],
    outside: [f32; 3],
    width_px: f64,
}

/// Colour between pixels, bilinear; the border goes on outside.
pub fn colour_at(image: &RgbImage, x: f64, y: f64) -> [f32; 3] {
    let (w, h) = (image.width() as i64, image.height() as i64);
    let (x, y) = (x - 0.5, y - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (a, b) = ((x - x0) as f32, (y - y0) as f32);
    let raw: &[u8] = image.as_raw();
    let index = |dx: i64, dy: i64| {
        let column = (x0 as i64 + dx).clamp(0, w - 1);
        let row = (y0 as i64 + dy).clamp(0, h - 1);
        (3 * (row * w + column)) as usize
    };
    let (i00, i10, i01, i11) = (index(0, 0), index(1, 0), index(0, 1), index(1, 1));
    std::array::from_fn(|k| {
        let top = f32::from(raw[i00 + k]) * (1.0 - a) + f32::from(raw[i10 + k]) * a;
        let bottom = f32::from(raw[i01 + k]) * (1.0 - a) + f32::from(raw[i11 + k]) * a;
        top * (1.0 - b) + bottom * b
    })
}

/// Looks for the rim on normals of a cone's outline, as far as `search_px` to both sides.
pub fn rim(image: &RgbImage, intrinsics: &Intrinsics, cone: &Cone, detail: Detail, search_px: f64) -> Vec<RimPoint> {
    let count = detail.normals;
    let middle = intrinsics.pixel(&cone.axis);
    let at = |k: f64| intrinsics.pixel(&cone.ray(k * std::f64::consts::TAU / count as f64));
    (0..count)
        .filter_map(|k| {
            let pixel = at(k as f64)?;
            let (before, after) = (at(k as f64 - 0.5)?, at(k as f64 + 0.5)?);
            let along = after - before;
            let normal = Vector2::new(along.y, -along.x).try_normalize(1e-9)?;
            let outward = pixel - middle?;
            let normal = if normal.dot(&outward) < 0.0 { -normal } else { normal };
            let found = crossing(image, pixel, normal, detail.step_px, search_px)?;
            Some(RimPoint {
                angle_rad: k as f64 * std::f64::consts::TAU / count as f64,
                pixel: pixel + normal * found.offset_px,
                normal,
                inside: found.inside,
                outside: found.outside,
                width_px: found.width_px,
            })
        })
        .collect()
}

/// Offset along the normal at which the colour has changed by half, and the colours on both sides.
fn crossing(image: &RgbImage, pixel: Point2<f64>, normal: Vector2<f64>, step_px: f64, search_px: f64) -> Option<Crossing> {
    let reach = REACH_PX + search_px;
    let count = (2.0 * reach / step_px) as usize + 1;
    let samples: Vec<[f32; 3]> = (0..count)
        .map(|k| {
            let t = k as f64 * step_px - reach;
            colour_at(image, pixel.x + t * normal.x, pixel.y + t * normal.y)
        })
        .collect();
    // First the steepest place near the outline, then the levels on both sides of it.
    let lag = (1.5 / step_px) as usize;
    let change = |k: usize| (0..3).map(|c| (samples[k + lag][c] - samples[k - lag][c]).powi(2)).sum::<f32>();
    let from = ((reach - search_px) / step_px) as usize;
    let to = ((reach + search_px) / step_px) as usize;
    let steepest = (from..=to).max_by(|a, b| change(*a).total_cmp(&change(*b)))?;
    let mean = |from_px: f64, to_px: f64| {
        let first = (steepest as f64 + from_px / step_px).round() as usize;
        let last = (steepest as f64 + to_px / step_px).round() as usize;
        let n = (last - first + 1) as f32;
        std::array::from_fn::<f32, 3, _>(|c| samples[first..=last].iter().map(|s| s[c]).sum::<f32>() / n)
    };
    let (inside, outside) = (mean(-4.5, -2.5), mean(2.5, 4.5));
    let direction: [f32; 3] = std::array::from_fn(|c| outside[c] - inside[c]);
    let square: f32 = direction.iter().map(|d| d * d).sum();
    if square < CONTRAST * CONTRAST {
        return None;
    }
    let level = |k: usize| (0..3).map(|c| (samples[k][c] - inside[c]) * direction[c]).sum::<f32>() / square;
    // The crossing nearest to the steepest place.
    let span = (2.0 / step_px) as usize;
    let passes = |wanted: f32, near: f64| {
        let mut best: Option<f64> = None;
        for k in steepest - span..steepest + span {
            let (a, b) = (level(k), level(k + 1));
            if a <= wanted && b > wanted {
                let place = k as f64 + f64::from((wanted - a) / (b - a));
                if best.is_none_or(|old| (place - near).abs() < (old - near).abs()) {
                    best = Some(place);
                }
            }
        }
        best
    };
    let place = passes(0.5, steepest as f64)?;
    let width = passes(0.8, place).filter(|last| *last > place).map_or(f64::NAN, |last| (last - place) * step_px);
    Some(Crossing { offset_px: place * step_px - reach, inside, outside, width_px: width })
}
