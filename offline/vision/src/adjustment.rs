//! What a joint adjustment of all cameras moves, and what it is held against.

use crate::camera::{Camera, Intrinsics};
use crate::least_squares::{Minimum, minimise};
use crate::localise::{First, POSE_STEPS, displaced};
use crate::plane_pose::moved;
use crate::table::Pick;
use nalgebra::{DVector, Point3, Vector2, Vector3};

/// How far the given numbers can be trusted, as standard deviations.
#[derive(Debug, Clone, Copy)]
pub struct Priors {
    /// Least of a hand-marked pixel, px; what the marks of all cameras scatter by is taken where it is more.
    pub mark_px: f64,
    /// Of a marker's place along each axis, m.
    pub marker_m: f64,
    /// Of a focal length, relative.
    pub focal: f64,
    /// Of the principal point, px.
    pub centre_px: f64,
    /// Of k1, k2, p1, p2.
    pub distortion: [f64; 4],
    /// Least of a chessboard corner, px; what its own fit leaves is taken where it is more.
    pub corner_px: f64,
}

impl Default for Priors {
    /// Marks and markers as the lab states them; the lens as a calibration with a board repeats (focal length to 0.15 %, centre to
    /// 1.5 px); corners as the saddle finder repeats.
    fn default() -> Self {
        Self {
            mark_px: 0.6,
            marker_m: 0.15e-3,
            focal: 1.5e-3,
            centre_px: 1.5,
            distortion: [2e-3, 2e-3, 5e-5, 5e-5],
            corner_px: 0.05,
        }
    }
}

/// Unknowns of a camera.
pub(crate) const PER_CAMERA: usize = 13;

/// Cameras, marks, markers and boards, and how far what is given of them can be trusted.
pub(crate) struct Bundle<'a> {
    pub(crate) firsts: &'a [First],
    pub(crate) picks: Vec<&'a Pick>,
    pub(crate) markers: Vec<(String, Point3<f64>)>,
    pub(crate) board_m: Vec<[f64; 2]>,
    pub(crate) corner_px: Vec<f64>,
    pub(crate) priors: Priors,
    /// Do gross errors pull less?
    pub(crate) robust: bool,
}

impl Bundle<'_> {
    pub(crate) fn boards(&self) -> usize {
        self.firsts.iter().filter(|first| first.board.is_some()).count()
    }

    pub(crate) fn unknowns(&self) -> usize {
        PER_CAMERA * self.firsts.len() + 3 * self.markers.len() + 6 * self.boards()
    }

    pub(crate) fn steps(&self) -> DVector<f64> {
        let camera = POSE_STEPS.into_iter().chain([1e-2, 1e-3, 1e-3, 1e-5, 1e-5, 1e-6, 1e-6]);
        let all: Vec<f64> = (0..self.firsts.len()).flat_map(|_| camera.clone()).collect();
        let rest = vec![1e-6; 3 * self.markers.len() + 6 * self.boards()];
        DVector::from_vec([all, rest].concat())
    }

    pub(crate) fn camera(&self, index: usize, x: &[f64]) -> Camera {
        let own = &x[PER_CAMERA * index..PER_CAMERA * (index + 1)];
        let mut camera = displaced(&self.firsts[index].camera, &own[..6]);
        let was = camera.intrinsics;
        camera.intrinsics = Intrinsics {
            // One focal length for both axes moves: webcams have square pixels, and the prior keeps their ratio.
            focal_px: [was.focal_px[0] + own[6], was.focal_px[1] + own[6] * was.focal_px[1] / was.focal_px[0]],
            centre_px: [was.centre_px[0] + own[7], was.centre_px[1] + own[8]],
            distortion: std::array::from_fn(|k| was.distortion[k] + own[9 + k]),
        };
        camera
    }

    pub(crate) fn marker(&self, index: usize, x: &[f64]) -> Point3<f64> {
        let at = PER_CAMERA * self.firsts.len() + 3 * index;
        self.markers[index].1 + Vector3::new(x[at], x[at + 1], x[at + 2])
    }

    pub(crate) fn marker_of(&self, pick: &Pick) -> usize {
        self.markers.iter().position(|marker| marker.0 == pick.marker).unwrap_or(0)
    }

    pub(crate) fn residuals(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let x = x.as_slice();
        let cameras: Vec<Camera> = (0..self.firsts.len()).map(|k| self.camera(k, x)).collect();
        let mut all = Vec::new();
        for pick in &self.picks {
            let seen = cameras[pick.camera].project(&self.marker(self.marker_of(pick), x))?;
            let off = (seen - pick.pixel) / self.priors.mark_px;
            let off = if self.robust { softened(off) } else { off };
            all.extend([off.x, off.y]);
        }
        let mut board_at = PER_CAMERA * self.firsts.len() + 3 * self.markers.len();
        for (index, first) in self.firsts.iter().enumerate() {
            let own = &x[PER_CAMERA * index..PER_CAMERA * (index + 1)];
            let focal = self.priors.focal * first.camera.intrinsics.focal_px[0];
            all.extend([own[6] / focal, own[7] / self.priors.centre_px, own[8] / self.priors.centre_px]);
            all.extend((0..4).map(|k| own[9 + k] / self.priors.distortion[k]));
            let Some((pixels, pose)) = &first.board else { continue };
            let pose = moved(pose, &x[board_at..board_at + 6]);
            board_at += 6;
            for (point, pixel) in self.board_m.iter().zip(pixels) {
                let local = pose.rotation * Vector3::new(point[0], point[1], 0.0) + pose.translation.vector;
                let off = (cameras[index].intrinsics.pixel(&local)? - pixel) / self.corner_px[index];
                all.extend([off.x, off.y]);
            }
        }
        let from = PER_CAMERA * self.firsts.len();
        all.extend(x[from..from + 3 * self.markers.len()].iter().map(|shift| {
            let shift = shift / self.priors.marker_m;
            if self.robust { softened(Vector2::new(shift, 0.0)).x } else { shift }
        }));
        Some(DVector::from_vec(all))
    }

    pub(crate) fn solve(&self, start: DVector<f64>) -> Option<Minimum> {
        minimise(start, &self.steps(), 60, |x| self.residuals(x))
    }
}

/// Residual whose square is Cauchy's cost with a scale of three deviations: a gross error pulls less and less.
fn softened(residual: Vector2<f64>) -> Vector2<f64> {
    let ratio = residual.norm_squared() / 9.0;
    if ratio < 1e-12 { residual } else { residual * (ratio.ln_1p() / ratio).sqrt() }
}
