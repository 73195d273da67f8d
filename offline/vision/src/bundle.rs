//! Joint adjustment of all cameras (bundle adjustment; Triggs et al., "Bundle adjustment - a modern synthesis", 1999).
//!
//! Unknown are poses, intrinsics within the prior of the lens calibration, the true places of the markers within the lab's
//! measurement, and the pose of each camera's chessboard, whose corners say more about focal length and principal point than any
//! marker. The cost is robust at first; what then stands out is named, left out, and the rest adjusted again.

use crate::camera::{Camera, Intrinsics};
use crate::error::{Error, Result};
use crate::least_squares::{Minimum, minimise};
use crate::localise::{First, POSE_STEPS, board_points_m, displaced, enough_markers};
use crate::marks::{Contradiction, corner_rms, mark_scatter_px, worst_mark};
use crate::plane_pose::moved;
use crate::rig::Rig;
use crate::table::Pick;
use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector2, Vector3};

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

/// Cameras and how well they are known.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// In the rig's order.
    pub cameras: Vec<Camera>,
    /// RMS of marked minus predicted pixel over both axes, per camera.
    pub reprojection_rms_px: Vec<f64>,
    /// Standard deviation of each camera's centre along x, y, z; `None` where it was not computed (paper mode).
    pub centre_deviation_m: Option<Vec<Vector3<f64>>>,
    /// Covariance of each camera's rotation vector (rad) and centre (m).
    pub pose_covariance: Vec<DMatrix<f64>>,
    /// Standard deviation of where each camera sees the middle of the work space, px: what its pose and lens leave uncertain.
    pub bearing_px: Vec<f64>,
    /// What was left out.
    pub contradictions: Vec<Contradiction>,
}

const PER_CAMERA: usize = 13;
/// Nobody marks worse than this, px: beyond it something else is wrong.
const WORST_MARK_PX: f64 = 5.0;
/// Bearing deviation where it cannot be computed.
pub const UNKNOWN_BEARING_PX: f64 = 0.3;
pub(crate) struct Bundle<'a> {
    pub(crate) firsts: &'a [First],
    pub(crate) picks: Vec<&'a Pick>,
    pub(crate) markers: Vec<(String, Point3<f64>)>,
    pub(crate) board_m: Vec<[f64; 2]>,
    pub(crate) corner_px: Vec<f64>,
    pub(crate) priors: Priors,
    robust: bool,
}

impl Bundle<'_> {
    fn boards(&self) -> usize {
        self.firsts.iter().filter(|first| first.board.is_some()).count()
    }

    fn unknowns(&self) -> usize {
        PER_CAMERA * self.firsts.len() + 3 * self.markers.len() + 6 * self.boards()
    }

    fn steps(&self) -> DVector<f64> {
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

    fn residuals(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
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

    fn solve(&self, start: DVector<f64>) -> Option<Minimum> {
        minimise(start, &self.steps(), 60, |x| self.residuals(x))
    }
}

/// Residual whose square is Cauchy's cost with a scale of three deviations: a gross error pulls less and less.
fn softened(residual: Vector2<f64>) -> Vector2<f64> {
    let ratio = residual.norm_squared() / 9.0;
    if ratio < 1e-12 { residual } else { residual * (ratio.ln_1p() / ratio).sqrt() }
}

/// Adjusts all cameras together.
///
/// # Errors
/// If a camera has fewer than four marks, all cameras are collinear with nothing else to hold them, or the marks determine no pose.
pub fn adjust(rig: &Rig, firsts: &[First], picks: &[Pick], priors: &Priors) -> Result<Calibration> {
    let mut kept: Vec<&Pick> = picks.iter().collect();
    let mut contradictions = Vec::new();
    for _ in 0..picks.len() {
        for camera in 0..firsts.len() {
            enough_markers(rig, camera, kept.iter().filter(|pick| pick.camera == camera).count())?;
        }
        let (bundle, minimum) = settled(rig, firsts, &kept, priors)?;
        let worst = worst_mark(&bundle, &minimum, firsts);
        let Some(found) = worst else { return Ok(finished(&bundle, &minimum, contradictions)) };
        kept.retain(|pick| {
            pick.marker != found.marker || found.camera.as_ref().is_some_and(|name| *name != firsts[pick.camera].camera.name)
        });
        contradictions.push(found);
    }
    let file = rig.file.with_file_name("markers.csv");
    Err(Error::content(&file, "marks", "contradict one another", "mark them anew, and check the places of the markers"))
}

fn settled<'a>(rig: &Rig, firsts: &'a [First], picks: &[&'a Pick], priors: &Priors) -> Result<(Bundle<'a>, Minimum)> {
    let mut markers: Vec<(String, Point3<f64>)> = Vec::new();
    for pick in picks {
        if !markers.iter().any(|marker| marker.0 == pick.marker) {
            markers.push((pick.marker.clone(), pick.position_m));
        }
    }
    let board_m = rig.chessboard.as_ref().map(board_points_m).unwrap_or_default();
    let corner_px = vec![priors.corner_px; firsts.len()];
    let mut bundle = Bundle { firsts, picks: picks.to_vec(), markers, board_m, corner_px, priors: *priors, robust: true };
    let failed = || {
        let file = rig.file.with_file_name("markers.csv");
        Error::content(&file, "marks", "no place of the cameras explains them", "check first poses and marks")
    };
    let first = bundle.solve(DVector::zeros(bundle.unknowns())).ok_or_else(failed)?;
    // Corners are as good as they fit.
    for (index, rms) in corner_rms(&bundle, &first).into_iter().enumerate() {
        bundle.corner_px[index] = rms.max(priors.corner_px);
    }
    // So are marks: with real webcams they scatter by more than the lab thinks.
    let first = match mark_scatter_px(&bundle, &first) {
        scatter if scatter > 1.1 * priors.mark_px => {
            bundle.priors.mark_px = scatter.min(WORST_MARK_PX);
            bundle.solve(first.parameters).ok_or_else(failed)?
        }
        _ => first,
    };
    bundle.robust = false;
    let softened = bundle.solve(first.parameters).ok_or_else(failed)?;
    Ok((bundle, softened))
}

fn finished(bundle: &Bundle, minimum: &Minimum, contradictions: Vec<Contradiction>) -> Calibration {
    let x = minimum.parameters.as_slice();
    let cameras: Vec<Camera> = (0..bundle.firsts.len()).map(|k| bundle.camera(k, x)).collect();
    let covariance = minimum.covariance();
    let own: Vec<DMatrix<f64>> = covariance.iter().flat_map(|all| blocks(all, cameras.len())).collect();
    let pose_covariance: Vec<DMatrix<f64>> = own.iter().map(|block| block.view((0, 0), (6, 6)).into_owned()).collect();
    let bearing_px = own.iter().enumerate().map(|(index, block)| bearing_deviation_px(bundle, x, index, block)).collect();
    let centre_deviation_m =
        covariance.is_some().then(|| pose_covariance.iter().map(|c| Vector3::from_fn(|k, _| c[(3 + k, 3 + k)].sqrt())).collect());
    let kept: Vec<Pick> = bundle.picks.iter().map(|pick| (*pick).clone()).collect();
    let reprojection_rms_px = reprojection_rms_px(&cameras, &kept);
    Calibration { cameras, reprojection_rms_px, centre_deviation_m, pose_covariance, bearing_px, contradictions }
}

/// Deviation of the pixel of the work space's middle, by all unknowns of a camera together.
fn bearing_deviation_px(bundle: &Bundle, x: &[f64], index: usize, covariance: &DMatrix<f64>) -> f64 {
    let middle = bundle.markers.iter().map(|marker| marker.1.coords).sum::<Vector3<f64>>() / bundle.markers.len().max(1) as f64;
    let steps = bundle.steps();
    let mut by = DMatrix::zeros(2, PER_CAMERA);
    for k in 0..PER_CAMERA {
        let at = PER_CAMERA * index + k;
        let moved = |sign: f64| {
            let mut all = x.to_vec();
            all[at] += sign * steps[at];
            bundle.camera(index, &all).project(&Point3::from(middle))
        };
        let (Some(above), Some(below)) = (moved(1.0), moved(-1.0)) else { return UNKNOWN_BEARING_PX };
        by.set_column(k, &((above - below) / (2.0 * steps[at])));
    }
    ((&by * covariance * by.transpose()).trace() / 2.0).max(0.0).sqrt()
}

fn blocks(covariance: &DMatrix<f64>, cameras: usize) -> Vec<DMatrix<f64>> {
    (0..cameras).map(|k| covariance.view((PER_CAMERA * k, PER_CAMERA * k), (PER_CAMERA, PER_CAMERA)).into_owned()).collect()
}

/// RMS over both axes of marked minus predicted pixel, per camera, with the markers where the lab measured them.
pub fn reprojection_rms_px(cameras: &[Camera], picks: &[Pick]) -> Vec<f64> {
    let of = |(index, camera): (usize, &Camera)| {
        let squares: Vec<f64> = picks
            .iter()
            .filter(|pick| pick.camera == index)
            .filter_map(|pick| Some((camera.project(&pick.position_m)? - pick.pixel).norm_squared() / 2.0))
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    cameras.iter().enumerate().map(of).collect()
}

/// Are all camera centres on one line to within a hundredth of their spread?
pub fn collinear(cameras: &[Camera]) -> bool {
    let mean = cameras.iter().map(|camera| camera.centre_m.coords).sum::<Vector3<f64>>() / cameras.len().max(1) as f64;
    let spread: Matrix3<f64> = cameras.iter().map(|c| (c.centre_m.coords - mean) * (c.centre_m.coords - mean).transpose()).sum();
    let mut values: Vec<f64> = spread.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    cameras.len() > 2 && values[1].max(0.0).sqrt() < 0.01 * values[2].max(0.0).sqrt()
}
