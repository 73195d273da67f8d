//! One frame: from the images of all cameras to the pose of the end effector, or to the reason why there is none.

use crate::associate::{Tolerance, best_triple, hypotheses};
use crate::camera::Camera;
use crate::colour::ColourRange;
use crate::edge::{Cone, colour_at};
use crate::hough;
use crate::outcome::{Lost, Measured, Suspended, View};
use crate::pose::{closed_form, from_bearings};
use crate::rig::Fixture;
use crate::sphere::{Expectation, OpeningPrior, Sighting, sight};
use crate::triangulate::{Bearing, Located, weighted, whitened};
use image::RgbImage;
use nalgebra::{Isometry3, Matrix2, Point3, Unit, Vector3};

/// What all frames of a recording share.
#[derive(Debug)]
pub struct Scene<'a> {
    /// Cameras.
    pub cameras: &'a [Camera],
    /// How well each camera's own bearing is known in the work space, px.
    pub bearing_px: Vec<f64>,
    /// Fixture.
    pub fixture: &'a Fixture,
    /// Colours of its balls.
    pub ranges: [ColourRange; 3],
    /// Radii of outlines in the work space, per camera, px.
    pub radius_px: Vec<[f64; 2]>,
    /// How much wider than true outlines appear, px, and how well that is known.
    pub halo_px: [f64; 2],
}

/// Part of the border that has to have the ball's colour (the paper's colour check).
const BORDER: f64 = 0.25;
/// Circles looked for per colour and camera when nothing is known.
const CIRCLES: usize = 3;
/// How far the last round looks, px.
const FINAL_PX: f64 = 2.0;
/// A frame whose balls are further than this from the fixture is lost: half of what is called a wrong frame.
const MOST_RESIDUAL_M: f64 = 1.0e-3;
/// A frame whose position is known worse than this along any axis is lost.
const MOST_DEVIATION_M: f64 = 0.6e-3;

impl Scene<'_> {
    /// Measures a frame from nothing, or near an expected pose that is good to `near_px` pixels.
    ///
    /// # Errors
    /// Why the frame is lost.
    pub fn measure(&self, images: &[Option<RgbImage>], expected: Option<(&Isometry3<f64>, f64)>) -> Result<Measured, Lost> {
        if images.iter().flatten().count() < 2 {
            return Err(Lost::Images);
        }
        let guided = expected.and_then(|(pose, near_px)| {
            let rough = self.guided(images, pose, near_px).ok()?;
            self.guided(images, &rough.fitted.pose, FINAL_PX).and_then(trusted).ok()
        });
        if let Some(measured) = guided {
            return Ok(measured);
        }
        let rough = self.search(images)?;
        let better = self.guided(images, &rough, 5.0)?;
        self.guided(images, &better.fitted.pose, FINAL_PX).and_then(trusted)
    }

    /// Pose out of circles anywhere in the images.
    fn search(&self, images: &[Option<RgbImage>]) -> Result<Isometry3<f64>, Lost> {
        let tolerance = Tolerance::default();
        let by_camera = each(images, |camera, image| {
            std::array::from_fn(|ball| image.map_or_else(Vec::new, |image| self.circles(image, camera, ball)))
        });
        let mut all = [Vec::new(), Vec::new(), Vec::new()];
        for (ball, hypotheses_of_ball) in all.iter_mut().enumerate() {
            let sightings: Vec<Vec<Sighting>> = by_camera.iter().map(|own: &[Vec<Sighting>; 3]| own[ball].clone()).collect();
            *hypotheses_of_ball = hypotheses(self.cameras, &sightings, self.fixture.ball_radius_m, &tolerance);
            if hypotheses_of_ball.is_empty() {
                return Err(Lost::Ball(ball));
            }
        }
        let [x, y, z] = best_triple(&all, self.fixture, &tolerance).ok_or(Lost::Fixture)?;
        let points = [all[0][x].point_m, all[1][y].point_m, all[2][z].point_m];
        closed_form(&self.fixture.centres_m(), &points).ok_or(Lost::Fixture)
    }

    fn circles(&self, image: &RgbImage, camera: usize, ball: usize) -> Vec<Sighting> {
        let range = &self.ranges[ball];
        let Some(window) = hough::extent(image, range, 12) else { return Vec::new() };
        let found = hough::circles(image, window, range, self.radius_px[camera], CIRCLES);
        let expectation = Expectation { range, opening: None, search_px: &[6.0, 3.0, 2.0], hidden: &|_| false };
        let intrinsics = &self.cameras[camera].intrinsics;
        found
            .iter()
            .filter(|circle| circle.support > 0.08)
            .filter_map(|circle| {
                sight(image, intrinsics, Cone::of_circle(intrinsics, circle.centre, circle.radius_px), &expectation)
            })
            .filter(|s| s.radius_px > 0.9 * self.radius_px[camera][0] && s.radius_px < 1.1 * self.radius_px[camera][1])
            .collect()
    }

    /// Rims where an expected pose has them.
    fn guided(&self, images: &[Option<RgbImage>], pose: &Isometry3<f64>, near_px: f64) -> Result<Measured, Lost> {
        let centres = self.fixture.centres_m().map(|centre| pose * Point3::from(centre));
        let by_camera: Vec<[View; 3]> = each(images, |camera, image| {
            std::array::from_fn(|ball| match image {
                None => View::Suspended(Suspended::NoImage),
                Some(image) => self.view(image, camera, ball, &centres, near_px),
            })
        });
        let mut views: [Vec<View>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for of_camera in by_camera {
            for (ball, view) in of_camera.into_iter().enumerate() {
                views[ball].push(view);
            }
        }
        self.combined(views, pose)
    }

    fn view(&self, image: &RgbImage, camera: usize, ball: usize, centres: &[Point3<f64>; 3], near_px: f64) -> View {
        let own = &self.cameras[camera];
        let radius_m = self.fixture.ball_radius_m;
        let local = own.local(&centres[ball]);
        let Some(mut cone) = Cone::of_sphere(&local, radius_m) else { return View::Suspended(Suspended::NotFound) };
        let px_rad = 1.0 / own.intrinsics.focal_px[0];
        cone.opening_rad += self.halo_px[0] * px_rad;
        // What a nearer ball covers, with a margin for its own uncertain rim.
        let nearer: Vec<Cone> = (0..3)
            .filter(|other| *other != ball)
            .map(|other| own.local(&centres[other]))
            .filter(|other| other.norm() < local.norm())
            .filter_map(|other| Cone::of_sphere(&other, radius_m))
            .collect();
        let margin = (2.0 + 0.5 * near_px) * px_rad;
        let hidden = |direction: &Unit<Vector3<f64>>| nearer.iter().any(|n| n.axis.angle(direction) < n.opening_rad + margin);
        let deviation_rad = (self.halo_px[1].hypot(0.1) + 0.06 * near_px) * px_rad;
        let opening = Some(OpeningPrior { opening_rad: cone.opening_rad, deviation_rad });
        let search: &[f64] = if near_px > 2.0 { &[near_px, 2.5] } else { &[2.0, 1.8] };
        let expectation = Expectation { range: &self.ranges[ball], opening, search_px: search, hidden: &hidden };
        let Some(sighting) = sight(image, &own.intrinsics, cone, &expectation) else { return View::Suspended(Suspended::NotFound) };
        if sighting.cone.axis.angle(&cone.axis) > 1.5 * near_px * px_rad {
            return View::Suspended(Suspended::Motion);
        }
        if border_fraction(image, own, &sighting.cone, &self.ranges[ball]) < BORDER {
            return View::Suspended(Suspended::Colour);
        }
        View::Effective(sighting)
    }

    /// Places of the balls and pose out of views; views that contradict the others are suspended one by one.
    fn combined(&self, mut views: [Vec<View>; 3], pose: &Isometry3<f64>) -> Result<Measured, Lost> {
        let fixture_m = self.fixture.centres_m();
        loop {
            let bearings: [Vec<Bearing>; 3] = std::array::from_fn(|ball| self.bearings(&views[ball]));
            let mut balls = Vec::new();
            for (ball, own) in bearings.iter().enumerate() {
                let start = pose * Point3::from(fixture_m[ball]);
                balls.push(weighted(own, start).ok_or(Lost::Ball(ball))?);
            }
            let balls: [Located; 3] = std::array::from_fn(|ball| balls[ball]);
            let first = closed_form(&fixture_m, &balls.map(|ball| ball.point_m)).ok_or(Lost::Fixture)?;
            let fitted = from_bearings(&fixture_m, &bearings, &first).ok_or(Lost::Doubtful)?;
            if let Some((ball, camera)) = self.worst(&views, &fitted.pose) {
                views[ball][camera] = View::Suspended(Suspended::Contradicts);
                continue;
            }
            let square: f64 =
                (0..3).map(|k| (fitted.pose * Point3::from(fixture_m[k]) - balls[k].point_m).norm_squared()).sum::<f64>() / 3.0;
            return Ok(Measured { fitted, balls, residual_m: square.sqrt(), views });
        }
    }

    /// A measured frame without some of its views, by ball and camera.
    ///
    /// # Errors
    /// If too little is left.
    pub fn without(&self, measured: Measured, waiting: &[(usize, usize)]) -> Result<Measured, Lost> {
        let mut views = measured.views;
        for (ball, camera) in waiting {
            views[*ball][*camera] = View::Suspended(Suspended::Returning);
        }
        self.combined(views, &measured.fitted.pose).and_then(trusted)
    }

    fn bearings(&self, views: &[View]) -> Vec<Bearing<'_>> {
        let all = views.iter().enumerate().filter_map(|(camera, view)| match view {
            View::Effective(sighting) => Some(self.bearing(camera, sighting)),
            View::Suspended(_) => None,
        });
        all.collect()
    }

    fn bearing(&self, camera: usize, sighting: &Sighting) -> Bearing<'_> {
        let own = &self.cameras[camera];
        let variance = (self.bearing_px[camera] / own.intrinsics.focal_px[0]).powi(2);
        let covariance = sighting.covariance.fixed_view::<2, 2>(0, 0).into_owned() + Matrix2::identity() * variance;
        Bearing { camera: own, axis: sighting.cone.axis, covariance }
    }

    /// The view that contradicts the pose of all most, if it does so by more than four deviations.
    fn worst(&self, views: &[Vec<View>; 3], pose: &Isometry3<f64>) -> Option<(usize, usize)> {
        let mut worst: Option<(f64, (usize, usize))> = None;
        for (ball, centre) in self.fixture.centres_m().iter().enumerate() {
            for (camera, view) in views[ball].iter().enumerate() {
                let View::Effective(sighting) = view else { continue };
                let at = pose * Point3::from(*centre);
                let off = whitened(&self.bearing(camera, sighting), &at).map_or(f64::INFINITY, |(r, _)| r.norm());
                if off > 4.0 && worst.is_none_or(|(most, _)| off > most) {
                    worst = Some((off, (ball, camera)));
                }
            }
        }
        worst.map(|(_, at)| at)
    }

    /// Halo of the well visible outlines of a frame, px.
    pub fn halos_px(&self, measured: &Measured) -> Vec<f64> {
        let mut all = Vec::new();
        for (ball, views) in measured.views.iter().enumerate() {
            for (camera, view) in views.iter().enumerate() {
                let View::Effective(sighting) = view else { continue };
                let own = &self.cameras[camera];
                let local = own.local(&measured.balls[ball].point_m);
                if let Some(cone) = Cone::of_sphere(&local, self.fixture.ball_radius_m).filter(|_| sighting.visible > 0.6) {
                    all.push((sighting.cone.opening_rad - cone.opening_rad) * own.intrinsics.focal_px[0]);
                }
            }
        }
        all
    }
}

/// What is done with each camera's image; cameras are independent of one another: a thread each.
fn each<T: Send>(images: &[Option<RgbImage>], work: impl Fn(usize, Option<&RgbImage>) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let work = &work;
        let workers: Vec<_> =
            images.iter().enumerate().map(|(camera, image)| scope.spawn(move || work(camera, image.as_ref()))).collect();
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    })
}

/// What is measured too badly is lost.
fn trusted(measured: Measured) -> Result<Measured, Lost> {
    let deviation = (0..3).map(|k| measured.fitted.covariance[(3 + k, 3 + k)].sqrt()).fold(0.0, f64::max);
    if measured.residual_m < MOST_RESIDUAL_M && deviation < MOST_DEVIATION_M { Ok(measured) } else { Err(Lost::Doubtful) }
}

/// Part of a circle just inside an outline that has the ball's colour.
pub fn border_fraction(image: &RgbImage, camera: &Camera, cone: &Cone, range: &ColourRange) -> f64 {
    let inner = Cone { opening_rad: cone.opening_rad * 0.92, ..*cone };
    let holds = |k: i32| {
        let pixel = camera.intrinsics.pixel(&inner.ray(f64::from(k) * std::f64::consts::TAU / 72.0));
        pixel.is_some_and(|p| camera.sees(p) && range.holds(colour_at(image, p.x, p.y)))
    };
    f64::from((0..72).filter(|k| holds(*k)).count() as u32) / 72.0
}
