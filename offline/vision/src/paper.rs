//! A frame as the paper measures it: Hough circles, rays through their centres, mean of midpoints, Nelder-Mead on cost (7).

use crate::camera::Camera;
use crate::edge::Cone;
use crate::frame::{Scene, border_fraction};
use crate::hough::{self, Circle, Window};
use crate::outcome::{Lost, Suspended};
use crate::pose::by_simplex;
use crate::triangulate::{Ray, mean_of_midpoints};
use crate::update::RETURN_FRAMES;
use image::RgbImage;
use nalgebra::{Isometry3, Point3};

/// Base and rate of the motion threshold: px, and radii per frame.
const MOTION: [f64; 2] = [8.0, 0.6];
/// A circle further than this from where the others have the ball contradicts them.
const CONTRADICTS_PX: f64 = 12.0;
/// Decay of the bounds on the radius towards the last one.
const DECAY: f64 = 0.5;
/// Hough centres are good to about a millimetre; balls further from the fixture than this are no measurement.
const MOST_RESIDUAL_M: f64 = 2.5e-3;

/// A measured frame.
#[derive(Debug, Clone)]
pub struct PaperFrame {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// Balls.
    pub balls_m: [Point3<f64>; 3],
    /// RMS distance between balls and fixture, m.
    pub residual_m: f64,
    /// Cameras that count, per ball.
    pub cameras: [usize; 3],
    /// Centres of the circles that count, by ball: camera and circle.
    pub circles: [Vec<(usize, Circle)>; 3],
}

#[derive(Debug, Clone)]
struct State {
    last: Option<Circle>,
    radius_px: [f64; 2],
    frames_since: u32,
    suspended: Option<(Suspended, u32)>,
}

/// The paper's tracker: its circles and their bounds.
#[derive(Debug)]
pub struct PaperTracker {
    states: Vec<[State; 3]>,
}

impl PaperTracker {
    /// At the beginning every circle may count, with the radii of the work space.
    pub fn new(scene: &Scene) -> Self {
        let state = |radius_px: [f64; 2]| State { last: None, radius_px, frames_since: 0, suspended: None };
        Self { states: scene.radius_px.iter().map(|bounds| std::array::from_fn(|_| state(*bounds))).collect() }
    }

    /// Measures the next frame.
    ///
    /// # Errors
    /// Why it is lost.
    pub fn measure(&mut self, scene: &Scene, images: &[Option<RgbImage>]) -> Result<PaperFrame, Lost> {
        if images.iter().flatten().count() < 2 {
            return Err(Lost::Images);
        }
        let mut circles: [Vec<(usize, Circle)>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for (camera, image) in images.iter().enumerate() {
            for (ball, own) in circles.iter_mut().enumerate() {
                let found = image.as_ref().ok_or(Suspended::NoImage).and_then(|image| self.circle(scene, image, camera, ball));
                let state = &mut self.states[camera][ball];
                state.frames_since += 1;
                match found {
                    Ok(circle) => own.push((camera, circle)),
                    Err(reason) => state.suspended = Some((reason, 0)),
                }
            }
        }
        let mut places = Vec::new();
        for (ball, own) in circles.iter_mut().enumerate() {
            let place = self.place(scene, ball, own);
            self.widen(scene, ball, own);
            places.push(place);
        }
        let mut balls_m = [Point3::origin(); 3];
        for (ball, place) in places.into_iter().enumerate() {
            balls_m[ball] = place.ok_or(Lost::Ball(ball))?;
        }
        let fixture_m = scene.fixture.centres_m();
        let pose = by_simplex(&fixture_m, &balls_m).ok_or(Lost::Fixture)?;
        let square = (0..3).map(|k| (pose * Point3::from(fixture_m[k]) - balls_m[k]).norm_squared()).sum::<f64>() / 3.0;
        if square.sqrt() > MOST_RESIDUAL_M {
            return Err(Lost::Doubtful);
        }
        Ok(PaperFrame { pose, balls_m, residual_m: square.sqrt(), cameras: std::array::from_fn(|k| circles[k].len()), circles })
    }

    fn circle(&self, scene: &Scene, image: &RgbImage, camera: usize, ball: usize) -> Result<Circle, Suspended> {
        let state = &self.states[camera][ball];
        let range = &scene.ranges[ball];
        let allowed_px = state.last.map(|last| MOTION[0] + MOTION[1] * last.radius_px * f64::from(state.frames_since + 1));
        let window = match (state.last, allowed_px) {
            (Some(last), Some(allowed)) => around(&last, allowed + state.radius_px[1] + 12.0, image),
            _ => hough::extent(image, range, 12).ok_or(Suspended::NotFound)?,
        };
        let found = hough::circles(image, window, range, state.radius_px, 1);
        let circle = *found.first().filter(|circle| circle.support > 0.15).ok_or(Suspended::NotFound)?;
        if let (Some(last), Some(allowed)) = (state.last, allowed_px)
            && (circle.centre - last.centre).norm() > allowed
        {
            return Err(Suspended::Motion);
        }
        let own: &Camera = &scene.cameras[camera];
        let cone = Cone::of_circle(&own.intrinsics, circle.centre, circle.radius_px);
        if border_fraction(image, own, &cone, range) < 0.25 {
            return Err(Suspended::Colour);
        }
        Ok(circle)
    }

    /// Mean of midpoints of the circles that count; those that contradict it are suspended, those that come back wait.
    fn place(&mut self, scene: &Scene, ball: usize, circles: &mut Vec<(usize, Circle)>) -> Option<Point3<f64>> {
        let returning = |states: &[[State; 3]], camera: usize| states[camera][ball].suspended.is_some();
        let mut waiting: Vec<(usize, Circle)> = circles.iter().copied().filter(|c| returning(&self.states, c.0)).collect();
        circles.retain(|c| !returning(&self.states, c.0));
        let off = |point: &Point3<f64>, c: &(usize, Circle)| {
            scene.cameras[c.0].project(point).map_or(f64::INFINITY, |pixel| (pixel - c.1.centre).norm())
        };
        let point = loop {
            let Some(point) = mean_of_midpoints(&rays(scene, circles)) else {
                // Too few count: those that wait are judged by one another, or they would wait for ever.
                let all = [circles.as_slice(), &waiting].concat();
                let point = mean_of_midpoints(&rays(scene, &all))?;
                if all.iter().all(|c| off(&point, c) < CONTRADICTS_PX) {
                    self.wait(ball, waiting);
                }
                return None;
            };
            let off = |c: &(usize, Circle)| off(&point, c);
            let worst = circles.iter().enumerate().max_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
            if off(worst.1) < CONTRADICTS_PX {
                waiting.retain(|c| off(c) < CONTRADICTS_PX);
                break point;
            }
            let (index, camera) = (worst.0, worst.1.0);
            self.states[camera][ball].suspended = Some((Suspended::Contradicts, 0));
            circles.remove(index);
        };
        self.wait(ball, waiting);
        Some(point)
    }

    /// One more consistent frame of these.
    fn wait(&mut self, ball: usize, waiting: Vec<(usize, Circle)>) {
        for (camera, circle) in waiting {
            if let Some((reason, frames)) = self.states[camera][ball].suspended {
                let frames = frames + 1;
                self.states[camera][ball].suspended = (frames < RETURN_FRAMES).then_some((reason, frames));
                self.states[camera][ball].last = Some(circle);
                self.states[camera][ball].frames_since = 0;
            }
        }
    }

    /// Bounds follow the circles that count and widen for the others.
    fn widen(&mut self, scene: &Scene, ball: usize, circles: &[(usize, Circle)]) {
        for (camera, states) in self.states.iter_mut().enumerate() {
            let state = &mut states[ball];
            let bounds = scene.radius_px[camera];
            if let Some((_, circle)) = circles.iter().find(|c| c.0 == camera) {
                state.last = Some(*circle);
                state.frames_since = 0;
                let goal = [0.85 * circle.radius_px, 1.15 * circle.radius_px];
                state.radius_px = std::array::from_fn(|k| DECAY * state.radius_px[k] + (1.0 - DECAY) * goal[k]);
            } else {
                state.radius_px = [(state.radius_px[0] - 2.0).max(bounds[0]), (state.radius_px[1] + 2.0).min(bounds[1])];
                if state.frames_since > RETURN_FRAMES {
                    state.last = None;
                }
            }
        }
    }
}

fn rays(scene: &Scene, circles: &[(usize, Circle)]) -> Vec<Ray> {
    let ray = |(camera, circle): &(usize, Circle)| {
        let own = &scene.cameras[*camera];
        Ray { origin_m: own.centre_m, direction: own.ray(circle.centre) }
    };
    circles.iter().map(ray).collect()
}

fn around(circle: &Circle, reach_px: f64, image: &RgbImage) -> Window {
    let from = |middle: f64, most: u32| (middle - reach_px).clamp(0.0, f64::from(most)) as u32;
    let to = |middle: f64, most: u32| (middle + reach_px).clamp(0.0, f64::from(most)) as u32;
    let (x, y) = (from(circle.centre.x, image.width()), from(circle.centre.y, image.height()));
    Window { x, y, width: to(circle.centre.x, image.width()) - x, height: to(circle.centre.y, image.height()) - y }
}
