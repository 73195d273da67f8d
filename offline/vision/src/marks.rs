//! How good marks and corners are by what an adjustment leaves of them, and which mark contradicts all others.

use crate::adjustment::Bundle;
use crate::camera::Camera;
use crate::least_squares::Minimum;
use crate::localise::First;
use crate::table::Pick;

/// A mark or a marker that contradicts all others.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// Name of the marker.
    pub marker: String,
    /// Name of the camera; `None` if the marker's own place contradicts its images.
    pub camera: Option<String>,
    /// Line in `markers.csv`.
    pub line: usize,
    /// How far it is off, px.
    pub off_px: f64,
}

/// Marks further off than this many deviations are taken out and named.
const GATE: f64 = 4.5;

/// Standard deviation of a mark along each axis, by the median distance: one bad mark does not count. Each mark spends some of its
/// freedom on the unknowns.
pub(crate) fn mark_scatter_px(bundle: &Bundle, minimum: &Minimum) -> f64 {
    let x = minimum.parameters.as_slice();
    let distance = |pick: &&Pick| {
        let seen = bundle.camera(pick.camera, x).project(&bundle.marker(bundle.marker_of(pick), x))?;
        Some((seen - pick.pixel).norm())
    };
    let mut distances: Vec<f64> = bundle.picks.iter().filter_map(distance).collect();
    distances.sort_by(f64::total_cmp);
    let median = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
    let freedom = 1.0 - (6 * bundle.firsts.len() + 2 * bundle.markers.len()) as f64 / (2 * bundle.picks.len()).max(1) as f64;
    median / 1.177 / freedom.max(0.3).sqrt()
}

/// RMS of corners per camera, px.
pub(crate) fn corner_rms(bundle: &Bundle, minimum: &Minimum) -> Vec<f64> {
    let mut at = 2 * bundle.picks.len();
    let mut all = Vec::new();
    for (index, first) in bundle.firsts.iter().enumerate() {
        at += 7;
        let count = if first.board.is_some() { 2 * bundle.board_m.len() } else { 0 };
        let sum = minimum.residuals.rows(at, count).norm_squared();
        all.push(if count > 0 { (sum / count as f64).sqrt() * bundle.corner_px[index] } else { 0.0 });
        at += count;
    }
    all
}

/// The mark, or the marker, that contradicts most, if it does so beyond doubt.
pub(crate) fn worst_mark(bundle: &Bundle, minimum: &Minimum, firsts: &[First]) -> Option<Contradiction> {
    let x = minimum.parameters.as_slice();
    let cameras: Vec<Camera> = (0..firsts.len()).map(|k| bundle.camera(k, x)).collect();
    let mut worst: Option<(f64, Contradiction)> = None;
    let mut consider = |score: f64, made: Contradiction| {
        if score > GATE && worst.as_ref().is_none_or(|(most, _)| score > *most) {
            worst = Some((score, made));
        }
    };
    for pick in &bundle.picks {
        let seen = cameras[pick.camera].project(&bundle.marker(bundle.marker_of(pick), x))?;
        let off_px = (seen - pick.pixel).norm();
        let camera = Some(firsts[pick.camera].camera.name.clone());
        consider(off_px / bundle.priors.mark_px, Contradiction { marker: pick.marker.clone(), camera, line: pick.line, off_px });
    }
    for (index, (name, place)) in bundle.markers.iter().enumerate() {
        let views: Vec<&&Pick> = bundle.picks.iter().filter(|pick| pick.marker == *name).collect();
        let shift = bundle.marker(index, x) - place;
        if views.len() < 2 {
            continue;
        }
        let first = views[0];
        let off_px = cameras[first.camera].pixel_by_point(place).map_or(0.0, |by| (by * shift).norm());
        // A shift is drawn by one bad mark too; the mark's own residual is larger then.
        let made = Contradiction { marker: name.clone(), camera: None, line: first.line, off_px };
        consider(shift.norm() / bundle.priors.marker_m, made);
    }
    worst.map(|(_, contradiction)| contradiction)
}
