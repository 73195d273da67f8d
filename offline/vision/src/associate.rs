//! Which circles of different cameras are the same ball: what does not meet in space, has the wrong size for its distance, or does not
//! stand as the fixture holds the balls is something else of that colour.

use crate::camera::Camera;
use crate::rig::Fixture;
use crate::sphere::Sighting;
use crate::triangulate::{Ray, midpoint};
use nalgebra::Point3;

/// How near the circles of a ball have to come to one another.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Between a circle and where the others place the ball, px.
    pub meet_px: f64,
    /// Between an outline's size and the one of its distance, relative.
    pub size: f64,
    /// Between two balls' distance and the fixture's, m.
    pub distance_m: f64,
}

impl Default for Tolerance {
    /// Rough sightings are good to a few pixels (2 mm) and their size to some percent; twice that.
    fn default() -> Self {
        Self { meet_px: 8.0, size: 0.09, distance_m: 5e-3 }
    }
}

/// A place of a ball and the circles that agree on it: camera and index of the sighting.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Mean of the pairs' midpoints.
    pub point_m: Point3<f64>,
    /// Circles.
    pub members: Vec<(usize, usize)>,
    /// Sum of the visible parts of their rims.
    pub score: f64,
}

/// Best hypotheses of one ball; `sightings` are those of each camera.
pub fn hypotheses(cameras: &[Camera], sightings: &[Vec<Sighting>], radius_m: f64, tolerance: &Tolerance) -> Vec<Hypothesis> {
    let rays: Vec<Vec<Ray>> = cameras
        .iter()
        .zip(sightings)
        .map(|(camera, all)| {
            let ray = |s: &Sighting| Ray { origin_m: camera.centre_m, direction: camera.rotation.inverse() * s.cone.axis };
            all.iter().map(ray).collect()
        })
        .collect();
    let mut found: Vec<Hypothesis> = Vec::new();
    for first in 0..cameras.len() {
        for second in first + 1..cameras.len() {
            for a in &rays[first] {
                for b in &rays[second] {
                    let Some(point_m) = midpoint(a, b) else { continue };
                    let made = gathered(cameras, sightings, &point_m, radius_m, tolerance);
                    let known = found.iter().any(|old| made.as_ref().is_some_and(|made| made.members == old.members));
                    if let Some(made) = made.filter(|_| !known) {
                        found.push(made);
                    }
                }
            }
        }
    }
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.truncate(5);
    found
}

fn gathered(
    cameras: &[Camera],
    sightings: &[Vec<Sighting>],
    point_m: &Point3<f64>,
    radius_m: f64,
    tolerance: &Tolerance,
) -> Option<Hypothesis> {
    let mut members = Vec::new();
    let mut score = 0.0;
    for (index, camera) in cameras.iter().enumerate() {
        let best = sightings[index]
            .iter()
            .enumerate()
            .filter_map(|(k, s)| Some((k, misfit(camera, s, point_m, radius_m, tolerance)?, s.visible)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, off, visible)) = best {
            members.push((index, k));
            score += visible * (1.2 - off);
        }
    }
    (members.len() >= 2).then_some(Hypothesis { point_m: *point_m, members, score })
}

/// How far a sighting is from a place, as part of what is tolerated; `None` beyond that.
fn misfit(camera: &Camera, sighting: &Sighting, point_m: &Point3<f64>, radius_m: f64, tolerance: &Tolerance) -> Option<f64> {
    let local = camera.local(point_m);
    let expected = crate::edge::Cone::of_sphere(&local, radius_m)?;
    let off = expected.axis.angle(&sighting.cone.axis) * camera.intrinsics.focal_px[0] / tolerance.meet_px;
    // Of a small arc the opening is not well known.
    let size_tolerance = tolerance.size + 3.0 * sighting.covariance[(2, 2)].sqrt() / expected.opening_rad;
    let size = (sighting.cone.opening_rad / expected.opening_rad - 1.0).abs() / size_tolerance;
    (off < 1.0 && size < 1.0).then_some(off.max(size))
}

/// The three hypotheses, one per ball, that stand as the fixture holds the balls and are best seen; their indices.
pub fn best_triple(all: &[Vec<Hypothesis>; 3], fixture: &Fixture, tolerance: &Tolerance) -> Option<[usize; 3]> {
    let centres = fixture.centres_m();
    let wanted = |a: usize, b: usize| (centres[a] - centres[b]).norm();
    let mut best: Option<(f64, [usize; 3])> = None;
    for (i, x) in all[0].iter().enumerate() {
        for (j, y) in all[1].iter().enumerate() {
            for (k, z) in all[2].iter().enumerate() {
                let points = [x.point_m, y.point_m, z.point_m];
                let off = |a: usize, b: usize| ((points[a] - points[b]).norm() - wanted(a, b)).abs() / tolerance.distance_m;
                let worst = off(0, 1).max(off(1, 2)).max(off(0, 2));
                let score = x.score + y.score + z.score - 0.5 * worst;
                if worst < 1.0 && best.is_none_or(|(most, _)| score > most) {
                    best = Some((score, [i, j, k]));
                }
            }
        }
    }
    best.map(|(_, indices)| indices)
}
