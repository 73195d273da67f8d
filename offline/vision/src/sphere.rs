//! Direction to a ball's centre from its rim: the cone of rays that touch the sphere, fitted to the rim, whose image is an ellipse
//! and not a circle about the image of the centre.

use crate::camera::Intrinsics;
use crate::colour::ColourRange;
use crate::edge::{COARSE, Cone, FINE, RimPoint, crosswise, rim};
use image::RgbImage;
use nalgebra::{Matrix3, Point2, Unit, Vector3};

/// Least part of the rim that carries a fit.
const LEAST_VISIBLE: f64 = 0.2;
/// Least part of the circle, in sectors of 30 degrees, that they have to stand in.
const LEAST_SECTORS: u32 = 4;
/// Least scatter assumed of a rim point, px.
const LEAST_SCATTER_PX: f64 = 0.12;
/// Rim points 3 px apart share pixels: fewer of them are independent.
const INDEPENDENT: f64 = 0.5;

/// A ball as one camera sees it.
#[derive(Debug, Clone)]
pub struct Sighting {
    /// The fitted cone, in the camera's frame.
    pub cone: Cone,
    /// Covariance of the axis along both [`crosswise`] directions and of the opening, rad^2.
    pub covariance: Matrix3<f64>,
    /// Part of the rim that was used, 0 to 1.
    pub visible: f64,
    /// Scatter of the used rim points about the fit, px.
    pub scatter_px: f64,
    /// Where the axis meets the image.
    pub pixel: Point2<f64>,
    /// Half width of the outline, px.
    pub radius_px: f64,
    /// The used rim points.
    pub points: Vec<RimPoint>,
}

/// What is known of the opening of a cone before its rim is looked at.
#[derive(Debug, Clone, Copy)]
pub struct OpeningPrior {
    /// Expected, rad.
    pub opening_rad: f64,
    /// Standard deviation, rad.
    pub deviation_rad: f64,
}

/// What a fit is told.
pub struct Expectation<'a> {
    /// The ball's colour.
    pub range: &'a ColourRange,
    /// Of the opening, if the distance is known.
    pub opening: Option<OpeningPrior>,
    /// How far the rim is looked for on both sides of the outline, px; one entry per round.
    pub search_px: &'a [f64],
    /// Directions in the camera's frame in which something nearer hides the ball.
    pub hidden: &'a dyn Fn(&Unit<Vector3<f64>>) -> bool,
}

/// Fits a cone to the rim near a first one; `None` if too little of the rim is there.
pub fn sight(image: &RgbImage, intrinsics: &Intrinsics, first: Cone, expectation: &Expectation) -> Option<Sighting> {
    let mut cone = first;
    let mut last = None;
    for search_px in expectation.search_px {
        let detail = if *search_px > 2.2 { COARSE } else { FINE };
        let points: Vec<Ray> = rim(image, intrinsics, &cone, detail, *search_px)
            .into_iter()
            .filter(|point| expectation.range.holds(point.inside) && !expectation.range.holds(point.outside))
            .map(|point| Ray { direction: intrinsics.direction(point.pixel), point })
            .filter(|ray| !(expectation.hidden)(&ray.direction))
            .collect();
        let px_rad = 1.0 / intrinsics.focal_px[0];
        let start = if *search_px > 2.5 { consensus(&points, &cone, px_rad, *search_px) } else { cone };
        let fit = settle(&points, start, expectation.opening, px_rad, detail.normals)?;
        cone = fit.cone;
        last = Some(fit);
    }
    let fit = last?;
    let pixel = intrinsics.pixel(&fit.cone.axis)?;
    let (a, _) = crosswise(&fit.cone.axis);
    let edge = intrinsics.pixel(&(fit.cone.axis.into_inner() * fit.cone.opening_rad.cos() + a * fit.cone.opening_rad.sin()))?;
    Some(Sighting {
        cone: fit.cone,
        covariance: fit.covariance,
        visible: fit.points.len() as f64 / FINE.normals as f64,
        scatter_px: fit.scatter_px,
        pixel,
        radius_px: (edge - pixel).norm(),
        points: fit.points,
    })
}

struct Ray {
    direction: Unit<Vector3<f64>>,
    point: RimPoint,
}

struct Fit {
    cone: Cone,
    covariance: Matrix3<f64>,
    scatter_px: f64,
    points: Vec<RimPoint>,
}

/// Offset of a ray from a cone, rad, and its angle round the axis.
fn offset(cone: &Cone, direction: &Unit<Vector3<f64>>) -> (f64, f64) {
    offset_in(cone, crosswise(&cone.axis), direction)
}

fn offset_in(cone: &Cone, (a, b): (Vector3<f64>, Vector3<f64>), direction: &Unit<Vector3<f64>>) -> (f64, f64) {
    let (x, y) = (direction.dot(&a), direction.dot(&b));
    (x.hypot(y).atan2(direction.dot(&cone.axis)) - cone.opening_rad, y.atan2(x))
}

fn shifted(cone: &Cone, by: &Vector3<f64>) -> Cone {
    let (a, b) = crosswise(&cone.axis);
    let axis = Unit::new_normalize(cone.axis.into_inner() + a * by.x + b * by.y);
    Cone { axis, opening_rad: (cone.opening_rad + by.z).max(1e-6) }
}

/// The cone through three rim points that most of the others agree with; the first one if none does better.
fn consensus(points: &[Ray], first: &Cone, px_rad: f64, search_px: f64) -> Cone {
    let agree =
        |cone: &Cone| points.iter().filter(|ray| (cone.axis.angle(&ray.direction) - cone.opening_rad).abs() < 0.8 * px_rad).count();
    let mut best = (agree(first), *first);
    if points.len() < 6 {
        return *first;
    }
    // A fixed sequence: the same image gives the same answer.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % points.len()
    };
    for _ in 0..80 {
        let chosen = [next(), next(), next()];
        let mut matrix = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (row, index) in chosen.iter().enumerate() {
            let (off, angle) = offset(first, &points[*index].direction);
            matrix.set_row(row, &Vector3::new(angle.cos(), angle.sin(), 1.0).transpose());
            right[row] = off;
        }
        if matrix.determinant().abs() < 0.3 {
            continue;
        }
        let Some(by) = matrix.lu().solve(&right) else { continue };
        if by.norm() > 3.0 * search_px * px_rad {
            continue;
        }
        let cone = shifted(first, &by);
        let count = agree(&cone);
        if count > best.0 {
            best = (count, cone);
        }
    }
    best.1
}

/// Gauss-Newton with Tukey's weights, the scale from the scatter itself.
fn settle(points: &[Ray], start: Cone, prior: Option<OpeningPrior>, px_rad: f64, normals: usize) -> Option<Fit> {
    let mut cone = start;
    let least = LEAST_VISIBLE * normals as f64;
    let mut cut_px = 1.5;
    let mut last = None;
    for _ in 0..12 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let (mut used, mut square, mut weights, mut sectors) = (Vec::new(), 0.0, 0.0, 0_u32);
        let frame = crosswise(&cone.axis);
        for ray in points {
            let (off, angle) = offset_in(&cone, frame, &ray.direction);
            let ratio = off / px_rad / cut_px;
            if ratio.abs() >= 1.0 {
                continue;
            }
            let weight = (1.0 - ratio * ratio).powi(2);
            let row = Vector3::new(angle.cos(), angle.sin(), 1.0);
            normal += row * row.transpose() * weight;
            right += row * (weight * off);
            square += weight * (off / px_rad).powi(2);
            weights += weight;
            sectors |= 1 << (((angle / std::f64::consts::TAU + 0.5) * 12.0) as u32 % 12);
            used.push(ray.point);
        }
        if (used.len() as f64) < least || sectors.count_ones() < LEAST_SECTORS || weights < 0.3 * least {
            return None;
        }
        let scatter_px = (square / weights).sqrt();
        let variance = (scatter_px.max(LEAST_SCATTER_PX) * px_rad).powi(2) / INDEPENDENT;
        let (mut information, mut pull) = (normal / variance, right / variance);
        if let Some(prior) = prior {
            let weight = prior.deviation_rad.powi(-2);
            information[(2, 2)] += weight;
            pull.z += weight * (prior.opening_rad - cone.opening_rad);
        }
        let covariance = information.try_inverse()?;
        let by = covariance * pull;
        cone = shifted(&cone, &by);
        cut_px = (4.0 * scatter_px).clamp(0.5, 1.5);
        let done = by.norm() < 1e-4 * px_rad;
        last = Some(Fit { cone, covariance, scatter_px, points: used });
        if done {
            break;
        }
    }
    last
}
