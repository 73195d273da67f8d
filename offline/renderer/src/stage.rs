//! The moving part of a scene, and how it looks from an eye.

use crate::backdrop::Plate;
use crate::eye::{Eye, Sights};
use crate::motion::Motion;
use crate::rig::WORKSPACE_M;
use crate::scene::Scene;
use crate::solids::{Hit, Paint, Solid};
use nalgebra::{Isometry3, Point3, Vector3};

/// Samples of a pixel along each side; each has a moment of the exposure of its own.
const SIDE: usize = 4;
/// Moments in the order of the samples: neighbours are far apart in time.
const MOMENTS: [usize; SIDE * SIDE] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];

/// What moves, and the light on it.
pub(crate) struct Stage<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) motion: &'a Motion,
    /// Frame of the motion to the world.
    pub(crate) placed: Isometry3<f64>,
    light: Vector3<f64>,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(scene: &'a Scene, motion: &'a Motion, placed: Isometry3<f64>) -> Self {
        Self { scene, motion, placed, light: Vector3::from(scene.light).normalize() }
    }

    /// Pose of the end effector in the world at a time of the recording.
    pub(crate) fn pose(&self, t_s: f64) -> Isometry3<f64> {
        self.placed * self.motion.at(t_s)
    }

    /// Ball centres in the world, at +x, +y, -x of the end effector.
    pub(crate) fn balls_m(&self, t_s: f64) -> [Vector3<f64>; 3] {
        let d = self.scene.ball_offset_mm * 1e-3;
        let pose = self.pose(t_s);
        [[d, 0.0, 0.0], [0.0, d, 0.0], [-d, 0.0, 0.0]].map(|at| (pose * Point3::from(at)).coords)
    }

    fn solids(&self, t_s: f64) -> Vec<Solid> {
        let radius_m = self.scene.ball_radius_mm * 1e-3;
        let tip = self.pose(t_s).translation.vector;
        let metal = Paint { colour: [0.16, 0.16, 0.17], shine: 0.3 };
        let mut all = Vec::new();
        for (ball, centre_m) in self.balls_m(t_s).into_iter().enumerate() {
            all.push(Solid::Ball { centre_m, radius_m, paint: Paint { colour: self.scene.paint(ball), shine: 0.5 } });
            all.push(Solid::Bar { ends_m: [tip, centre_m], radius_m: 0.0015, paint: metal });
        }
        all.push(Solid::Bar { ends_m: [tip, tip + Vector3::new(0.02, -0.01, 0.35)], radius_m: 0.004, paint: metal });
        if self.scene.tool {
            // It goes round the work space in ten seconds and swings twice a second.
            let round = t_s * 0.2 * std::f64::consts::PI;
            let swing = 0.35 * (t_s * 4.0 * std::f64::consts::PI).sin();
            let out = Vector3::new(round.cos(), round.sin(), 0.0);
            let side = Vector3::new(-round.sin(), round.cos(), 0.0);
            let top = WORKSPACE_M + out * 0.16 + Vector3::z() * 0.16;
            let hanging = (side * swing.sin() - Vector3::z() * swing.cos()) * 0.26;
            all.push(Solid::Bar {
                ends_m: [top, top + hanging],
                radius_m: 0.009,
                paint: Paint { colour: [0.07, 0.07, 0.09], shine: 0.2 },
            });
        }
        all
    }

    /// Light that a surface sends back.
    fn shade(&self, hit: &Hit, direction: &Vector3<f64>) -> [f64; 3] {
        let facing = hit.normal.dot(&self.light).max(0.0);
        let matt = self.scene.ambient + (1.0 - self.scene.ambient) * facing;
        let mirrored = hit.normal * (2.0 * hit.normal.dot(&self.light)) - self.light;
        let gloss = hit.paint.shine * (1.0 - self.scene.ambient) * (-mirrored.dot(direction)).max(0.0).powi(25);
        hit.paint.colour.map(|colour| (colour * matt + gloss) * self.scene.brightness)
    }

    /// Paints markers over a plate, as small white balls.
    pub(crate) fn paint_markers(
        &self,
        eye: &Eye,
        sights: &Sights,
        places_m: impl Iterator<Item = Vector3<f64>>,
        plate: &mut Plate,
    ) {
        let paint = Paint { colour: [0.9; 3], shine: 0.0 };
        let solids = vec![places_m.map(|centre_m| Solid::Ball { centre_m, radius_m: 0.002, paint }).collect()];
        self.paint_solids(eye, sights, &solids, plate);
    }

    /// Paints what moves over a plate.
    pub(crate) fn paint(&self, eye: &Eye, sights: &Sights, t_s: f64, plate: &mut Plate) {
        let exposure_s = self.scene.exposure_ms * 1e-3;
        let moments = if exposure_s > 0.0 { SIDE * SIDE } else { 1 };
        let moving: Vec<Vec<Solid>> =
            (0..moments).map(|k| self.solids(t_s + exposure_s * (k as f64 + 0.5) / moments as f64)).collect();
        self.paint_solids(eye, sights, &moving, plate);
    }

    fn paint_solids(&self, eye: &Eye, sights: &Sights, moving: &[Vec<Solid>], plate: &mut Plate) {
        for (block, near) in blocks(eye, moving, [plate.width, plate.height]) {
            for row in block[1]..block[3] {
                for column in block[0]..block[2] {
                    let own = &mut plate.light[row * plate.width + column];
                    *own = self.pixel(eye, sights, moving, &near, column, row, *own);
                }
            }
        }
    }

    /// Light of a pixel; `near` are the solids that may be seen in it.
    #[allow(clippy::too_many_arguments, reason = "the innermost loop; a struct for it would be filled once per pixel")]
    fn pixel(
        &self,
        eye: &Eye,
        sights: &Sights,
        moving: &[Vec<Solid>],
        near: &[usize],
        column: usize,
        row: usize,
        behind: [f32; 3],
    ) -> [f32; 3] {
        // Which solid a sample meets, and its light.
        let sample = |k: usize| -> (Option<usize>, [f32; 3]) {
            let inside = |n: usize| (n as f64 + 0.5) / SIDE as f64;
            let direction = sights.direction(column, row, inside(k % SIDE), inside(k / SIDE));
            let solids = &moving[MOMENTS[k] % moving.len()];
            let nearest = near
                .iter()
                .filter_map(|index| Some((*index, solids[*index].hit(&eye.place_m, &direction)?)))
                .min_by(|a, b| a.1.distance_m.total_cmp(&b.1.distance_m));
            // A sample that is too bright is cut off before it is averaged: highlights have sharp rims.
            nearest.map_or((None, behind), |(index, hit)| (Some(index), self.shade(&hit, &direction).map(|v| v.min(1.5) as f32)))
        };
        let mean = |samples: &[(Option<usize>, [f32; 3])]| {
            std::array::from_fn(|c| samples.iter().map(|(_, light)| light[c]).sum::<f32>() / samples.len() as f32)
        };
        // Most pixels lie within one surface: their corners say all.
        let corners = [0, SIDE - 1, SIDE * (SIDE - 1), SIDE * SIDE - 1].map(sample);
        if corners.iter().all(|corner| corner.0 == corners[0].0) {
            return mean(&corners);
        }
        mean(&std::array::from_fn::<_, { SIDE * SIDE }, _>(sample))
    }
}

/// Side of a block of pixels.
const BLOCK: usize = 16;

/// Blocks of the image in which anything may be seen, and which solids these are.
fn blocks(eye: &Eye, moving: &[Vec<Solid>], [width, height]: [usize; 2]) -> Vec<([usize; 4], Vec<usize>)> {
    let columns = width.div_ceil(BLOCK);
    let mut near = vec![Vec::<usize>::new(); columns * height.div_ceil(BLOCK)];
    for (index, (centre_m, radius_m)) in moving
        .iter()
        .flat_map(|solids| solids.iter().enumerate())
        .flat_map(|(index, solid)| solid.bounds().into_iter().map(move |b| (index, b)))
    {
        let Some(limits) = eye.box_of(&centre_m, radius_m) else { continue };
        let [x0, y0, x1, y1] = limits.map(|limit| limit as usize);
        for row in y0 / BLOCK..y1.div_ceil(BLOCK) {
            for own in &mut near[row * columns + x0 / BLOCK..row * columns + x1.div_ceil(BLOCK)] {
                if !own.contains(&index) {
                    own.push(index);
                }
            }
        }
    }
    let block = |k: usize| {
        let (x, y) = (k % columns * BLOCK, k / columns * BLOCK);
        [x, y, (x + BLOCK).min(width), (y + BLOCK).min(height)]
    };
    near.into_iter().enumerate().filter(|(_, own)| !own.is_empty()).map(|(k, own)| (block(k), own)).collect()
}
