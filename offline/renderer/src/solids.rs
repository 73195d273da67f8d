//! What stands in the way of light: spheres, and bars with round ends.

use nalgebra::Vector3;

/// What a surface does to light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Paint {
    /// Red, green, blue that come back, 0 to 1.
    pub(crate) colour: [f64; 3],
    /// Strength of the highlight.
    pub(crate) shine: f64,
}

/// Something solid.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Solid {
    /// Centre and radius.
    Ball { centre_m: Vector3<f64>, radius_m: f64, paint: Paint },
    /// All within a radius of the line between two ends.
    Bar { ends_m: [Vector3<f64>; 2], radius_m: f64, paint: Paint },
}

/// Where a line meets something: distance, normal, paint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    pub(crate) distance_m: f64,
    pub(crate) normal: Vector3<f64>,
    pub(crate) paint: Paint,
}

impl Solid {
    pub(crate) fn hit(&self, from_m: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        match self {
            Self::Ball { centre_m, radius_m, paint } => {
                let distance_m = ball(from_m, direction, centre_m, *radius_m)?;
                Some(Hit { distance_m, normal: (from_m + direction * distance_m - centre_m) / *radius_m, paint: *paint })
            }
            Self::Bar { ends_m, radius_m, paint } => {
                let (distance_m, foot) = bar(from_m, direction, ends_m, *radius_m)?;
                Some(Hit { distance_m, normal: (from_m + direction * distance_m - foot) / *radius_m, paint: *paint })
            }
        }
    }

    /// A few spheres that hold it, for the part of the image it may be seen in.
    pub(crate) fn bounds(&self) -> Vec<(Vector3<f64>, f64)> {
        match self {
            Self::Ball { centre_m, radius_m, .. } => vec![(*centre_m, *radius_m)],
            Self::Bar { ends_m: [a, b], radius_m, .. } => {
                let pieces = ((b - a).norm() / 0.02).ceil().max(1.0);
                let reach = (b - a).norm() / pieces + radius_m;
                (0..=pieces as usize).map(|k| (a + (b - a) * (k as f64 / pieces), reach)).collect()
            }
        }
    }
}

/// Distance to the near side of a sphere.
fn ball(from_m: &Vector3<f64>, direction: &Vector3<f64>, centre_m: &Vector3<f64>, radius_m: f64) -> Option<f64> {
    let to = from_m - centre_m;
    let along = to.dot(direction);
    // From the foot of the perpendicular: exact also far from the sphere.
    let beside = to - direction * along;
    let half2 = radius_m * radius_m - beside.norm_squared();
    (half2 > 0.0 && along < 0.0).then(|| -along - half2.sqrt()).filter(|distance| *distance > 0.0)
}

/// Distance to a bar and the point of its line below the place that is met.
fn bar(from_m: &Vector3<f64>, direction: &Vector3<f64>, [a, b]: &[Vector3<f64>; 2], radius_m: f64) -> Option<(f64, Vector3<f64>)> {
    let line = b - a;
    let square = line.norm_squared();
    let to = from_m - a;
    let across = direction - line * (direction.dot(&line) / square);
    let off = to - line * (to.dot(&line) / square);
    let (p, q, r) = (across.norm_squared(), across.dot(&off), off.norm_squared() - radius_m * radius_m);
    let under = q * q - p * r;
    if under > 0.0 && p > 1e-12 {
        let distance = (-q - under.sqrt()) / p;
        let part = (to + direction * distance).dot(&line) / square;
        if distance > 0.0 && (0.0..=1.0).contains(&part) {
            return Some((distance, a + line * part));
        }
    }
    [a, b]
        .into_iter()
        .filter_map(|end| Some((ball(from_m, direction, end, radius_m)?, *end)))
        .min_by(|one, other| one.0.total_cmp(&other.0))
}
