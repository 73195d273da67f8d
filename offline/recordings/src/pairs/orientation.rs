//! Orientation labels, where both streams have orientations. The fixture sits on the instrument in some constant rotation: known, or
//! estimated with them, and then it takes up any constant orientation error of the arm.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::drop::Judged;
use super::rigid::Rigid;
use super::track::{Found, Place, find, median};
use super::{Options, Reported, Truth};

/// Labels of the pairs and the mounting.
pub(super) struct Orientations {
    /// Per pair; none where either orientation is missing.
    pub(super) labels: Vec<Option<Label>>,
    /// Rotation of the fixture on the end effector: fixture axes in end-effector axes, rows.
    pub(super) mounting: [[f64; 3]; 3],
}

/// Of one pair.
#[derive(Clone, Copy)]
pub(super) struct Label {
    /// Rotation vector from the reported to the true orientation, frame 0, rad.
    pub(super) turn_rad: [f64; 3],
    /// True orientation of the end effector in frame 0: w, x, y, z.
    pub(super) truth_wxyz: [f64; 4],
}

/// None where a stream has no orientation, or no pair has both.
pub(super) fn labels(
    reported: &Reported<'_>,
    truth: &Truth,
    kept: &[Judged],
    rigid: &Rigid,
    options: &Options,
) -> Option<Orientations> {
    let (columns, seen) = (reported.quaternion?, truth.quaternion.as_ref()?);
    let turn = Rotation3::from_matrix_unchecked(rigid.matrix());
    let mut place = Place::default();
    let both: Vec<Option<(Rotation3<f64>, Rotation3<f64>)>> = kept
        .iter()
        .map(|one| {
            let arm = interpolated(reported.t_s, columns, one.state_time_s, options.gap_max_s, &mut place)?;
            Some((arm, turn * unit(seen[one.frame])?.to_rotation_matrix()))
        })
        .collect();
    let relative: Vec<Rotation3<f64>> = both.iter().flatten().map(|(arm, camera)| arm.inverse() * camera).collect();
    if relative.is_empty() {
        return None;
    }
    let mounting = if options.mounting_known { Rotation3::identity() } else { mean(&relative)? };
    let label = |(arm, camera): (Rotation3<f64>, Rotation3<f64>)| {
        let truth = camera * mounting.inverse();
        let q = UnitQuaternion::from_rotation_matrix(&truth);
        Label { turn_rad: (truth * arm.inverse()).scaled_axis().into(), truth_wxyz: [q.w, q.i, q.j, q.k] }
    };
    let row = |row: usize| std::array::from_fn(|column| mounting.matrix()[(row, column)]);
    Some(Orientations { labels: both.into_iter().map(|pair| pair.map(label)).collect(), mounting: [row(0), row(1), row(2)] })
}

fn unit(wxyz: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let norm = wxyz.iter().map(|value| value * value).sum::<f64>().sqrt();
    let [w, x, y, z] = wxyz;
    // Published quaternions are rounded; one that is far from a unit is none.
    ((norm - 1.0).abs() < 0.05).then(|| UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
}

fn interpolated(times: &[f64], columns: [&[f64]; 4], t_s: f64, gap_max_s: f64, place: &mut Place) -> Option<Rotation3<f64>> {
    let Found::Between { row, share } = find(times, t_s, gap_max_s, place) else { return None };
    let (from, to) = (unit(columns.map(|column| column[row])), unit(columns.map(|column| column[row + 1])));
    let turned = match share {
        0.0 => from?,
        1.0 => to?,
        _ => from?.nlerp(&same_half(&from?, &to?), share),
    };
    Some(turned.to_rotation_matrix())
}

/// The same rotation as `b`, with the sign that is nearer to `a`.
fn same_half(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if a.coords.dot(&b.coords) < 0.0 { UnitQuaternion::new_unchecked(-b.into_inner()) } else { *b }
}

/// Mean rotation (chordal), twice without those further than three times the median angle.
fn mean(rotations: &[Rotation3<f64>]) -> Option<Rotation3<f64>> {
    let mut best = chordal(rotations)?;
    for _ in 0..2 {
        let angles: Vec<f64> = rotations.iter().map(|rotation| (best.inverse() * rotation).angle()).collect();
        let most = 3.0 * median(&mut angles.clone())?;
        let near: Vec<Rotation3<f64>> =
            rotations.iter().zip(&angles).filter(|(_, angle)| **angle <= most).map(|(rotation, _)| *rotation).collect();
        best = chordal(&near)?;
    }
    Some(best)
}

fn chordal(rotations: &[Rotation3<f64>]) -> Option<Rotation3<f64>> {
    if rotations.is_empty() {
        return None;
    }
    let svd = rotations.iter().map(|rotation| *rotation.matrix()).sum::<Matrix3<f64>>().svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let handed = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Some(Rotation3::from_matrix_unchecked(u * handed * v_t))
}
