//! A measured recording against the truth, as the paper's Table I: error per axis and in space, RMS and standard deviation.

use crate::camera::{Camera, Intrinsics};
use crate::edge::Cone;
use crate::error::{Error, Result};
use crate::outcome::Tracked;
use crate::pose::from_bearings;
use crate::rig::Fixture;
use crate::triangulate::Bearing;
use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, Quaternion, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::path::Path;

/// The true pose of a frame.
#[derive(Debug, Clone, Copy)]
pub struct TruePose {
    /// Number.
    pub frame: u64,
    /// End effector, m.
    pub position_m: Vector3<f64>,
    /// End effector's axes into the world.
    pub rotation: UnitQuaternion<f64>,
}

/// Errors of one kind: x, y, z, and in space.
#[derive(Debug, Clone, Copy)]
pub struct Spread {
    /// Root mean square, mm.
    pub rms_mm: [f64; 4],
    /// Standard deviation, mm.
    pub sd_mm: [f64; 4],
    /// Largest, mm, in space.
    pub worst_mm: f64,
}

/// What a measurement reaches.
#[derive(Debug, Clone, Copy)]
pub struct Accuracy {
    /// Of single balls.
    pub ball: Spread,
    /// Of the end effector.
    pub end_effector: Spread,
    /// RMS angle between measured and true orientation, degrees.
    pub orientation_deg: f64,
    /// Frames measured.
    pub measured: usize,
    /// Frames in all.
    pub frames: usize,
    /// Frames whose position is off by more than 2 mm.
    pub wrong: usize,
}

/// Reads a truth file: `frame`, `x_mm`, `y_mm`, `z_mm`, `qw`, `qx`, `qy`, `qz`.
///
/// # Errors
/// If it cannot be read or a row is not sound.
pub fn read_truth(file: &Path) -> Result<Vec<TruePose>> {
    let text = std::fs::read_to_string(file).map_err(Error::read(file))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let names = ["frame", "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"];
    let mut poses = Vec::new();
    for (k, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let mut v = [0.0; 8];
        for (value, name) in v.iter_mut().zip(names) {
            let cell = header.iter().position(|own| *own == name).and_then(|at| cells.get(at)).and_then(|c| c.parse::<f64>().ok());
            *value = cell.ok_or_else(|| {
                Error::content(file, format!("line {}", k + 2), format!("no number for {name}"), "give a number in each row")
            })?;
        }
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(v[4], v[5], v[6], v[7]));
        poses.push(TruePose { frame: v[0] as u64, position_m: Vector3::new(v[1], v[2], v[3]) * 1e-3, rotation });
    }
    Ok(poses)
}

/// Reads the true cameras of a rendered scene (`cameras_true.json`: per camera C in mm, R, f, c, k), in the order of `names`.
///
/// # Errors
/// If it cannot be read or does not hold 19 numbers per camera.
pub fn read_true_cameras(file: &Path, names: &[String], size_px: [u32; 2]) -> Result<Vec<Camera>> {
    let text = std::fs::read_to_string(file).map_err(Error::read(file))?;
    let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let numbers: Vec<f64> = text.split(|c: char| !is_number(c)).filter_map(|token| token.parse().ok()).collect();
    if numbers.len() != 19 * names.len() {
        let what = format!("{} numbers for {} cameras", numbers.len(), names.len());
        return Err(Error::content(file, "cameras", what, "give C, R, f, c and k of each camera"));
    }
    let camera = |(name, n): (&String, &[f64])| Camera {
        name: name.clone(),
        rotation: Rotation3::from_matrix(&Matrix3::from_row_slice(&n[3..12])),
        centre_m: Point3::new(n[0], n[1], n[2]) * 1e-3,
        intrinsics: Intrinsics { focal_px: [n[12]; 2], centre_px: [n[13], n[14]], distortion: [n[15], n[16], n[17], n[18]] },
        size_px,
    };
    Ok(names.iter().zip(numbers.chunks(19)).map(camera).collect())
}

/// Error of the end effector that the cameras alone make: with circles as the true cameras would see them.
pub fn of_cameras(cameras: &[Camera], true_cameras: &[Camera], truth: &[TruePose], fixture: &Fixture) -> Option<Spread> {
    let error = |own: &TruePose| {
        let pose = Isometry3::from_parts(Translation3::from(own.position_m), own.rotation);
        let mut bearings: [Vec<Bearing>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for (views, centre) in bearings.iter_mut().zip(fixture.centres_m()) {
            for (camera, real) in cameras.iter().zip(true_cameras) {
                let cone = Cone::of_sphere(&real.local(&(pose * Point3::from(centre))), fixture.ball_radius_m)?;
                // What the true camera sees, put through the lens that is believed.
                let axis: Unit<Vector3<f64>> = camera.intrinsics.direction(real.intrinsics.pixel(&cone.axis)?);
                views.push(Bearing { camera, axis, covariance: Matrix2::identity() * 1e-8 });
            }
        }
        let found = from_bearings(&fixture.centres_m(), &bearings, &pose)?;
        Some((found.pose.translation.vector - own.position_m) * 1e3)
    };
    spread(&truth.iter().filter_map(error).collect::<Vec<_>>())
}

/// Compares frames of the same number; `None` if no measured frame has a truth.
pub fn compare(tracked: &Tracked, truth: &[TruePose], fixture: &Fixture) -> Option<Accuracy> {
    let (mut balls, mut tips, mut angles) = (Vec::new(), Vec::new(), Vec::new());
    for row in &tracked.rows {
        let (Ok(found), Some(own)) = (&row.found, truth.iter().find(|own| own.frame == row.frame)) else { continue };
        tips.push((found.pose.translation.vector - own.position_m) * 1e3);
        angles.push(found.pose.rotation.angle_to(&own.rotation).to_degrees());
        for (ball, centre) in found.balls_m.iter().zip(fixture.centres_m()) {
            balls.push((ball.coords - (own.rotation * centre + own.position_m)) * 1e3);
        }
    }
    let end_effector = spread(&tips)?;
    Some(Accuracy {
        ball: spread(&balls)?,
        end_effector,
        orientation_deg: (angles.iter().map(|a| a * a).sum::<f64>() / angles.len() as f64).sqrt(),
        measured: tips.len(),
        frames: tracked.rows.len(),
        wrong: tips.iter().filter(|tip| tip.norm() > 2.0).count(),
    })
}

fn spread(errors_mm: &[Vector3<f64>]) -> Option<Spread> {
    if errors_mm.is_empty() {
        return None;
    }
    let count = errors_mm.len() as f64;
    let column = |k: usize| errors_mm.iter().map(move |e| if k < 3 { e[k] } else { e.norm() });
    let rms = |k: usize| (column(k).map(|v| v * v).sum::<f64>() / count).sqrt();
    let mean = |k: usize| column(k).sum::<f64>() / count;
    let sd = |k: usize| (column(k).map(|v| (v - mean(k)).powi(2)).sum::<f64>() / count).sqrt();
    Some(Spread { rms_mm: std::array::from_fn(rms), sd_mm: std::array::from_fn(sd), worst_mm: column(3).fold(0.0, f64::max) })
}

/// Lines of a table for one measurement, under a name.
pub fn lines(name: &str, accuracy: &Accuracy) -> String {
    format!("{}{}", line(name, "single ball", &accuracy.ball), line(name, "end effector", &accuracy.end_effector))
}

/// One line of the table.
pub fn line(name: &str, what: &str, spread: &Spread) -> String {
    let cells = |v: &[f64; 4]| v.map(|x| format!("{x:.3}")).join(" | ");
    format!("| {name} | {what} | {} | {} | {:.3} |\n", cells(&spread.rms_mm), cells(&spread.sd_mm), spread.worst_mm)
}

/// Head of the table that [`lines`] fills.
pub const HEAD: &str = "| scene | what | RMS x | y | z | 3D (mm) | SD x | y | z | 3D (mm) | worst (mm) |\n\
                        | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
