//! Joint adjustment of all cameras (bundle adjustment; Triggs et al., "Bundle adjustment - a modern synthesis", 1999).
//!
//! Unknown are poses, intrinsics within the prior of the lens calibration, the true places of the markers within the lab's
//! measurement, and the pose of each camera's chessboard, whose corners say more about focal length and principal point than any
//! marker. The cost is robust at first; what then stands out is named, left out, and the rest adjusted again.

use crate::adjustment::{Bundle, PER_CAMERA, Priors};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::least_squares::Minimum;
use crate::localise::{First, board_points_m, enough_markers};
use crate::marks::{Contradiction, corner_rms, mark_scatter_px, worst_mark};
use crate::rig::Rig;
use crate::table::Pick;
use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

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

/// Nobody marks worse than this, px: beyond it something else is wrong.
const WORST_MARK_PX: f64 = 5.0;
/// Bearing deviation where it cannot be computed.
pub const UNKNOWN_BEARING_PX: f64 = 0.3;
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
