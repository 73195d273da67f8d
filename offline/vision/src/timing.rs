//! From where the end effector was in the middle of each exposure to where it was at the frame's time.

use crate::exposure::{Exposure, RimWidth, estimate};
use crate::outcome::{Found, Row, View};
use crate::rig::Timing;
use nalgebra::{Isometry3, Matrix6, Point3, UnitQuaternion, Vector3};

/// Frames whose rims are looked at; more say no more about one shutter.
const MOST_FRAMES: usize = 60;
/// Neighbours further away than this many usual frame times do not tell the velocity.
const FAR: f64 = 3.5;

/// A smaller misfit by this factor is a clear one.
const CLEARLY: f64 = 0.99;

/// Motion of the end effector at a frame: angular velocity in the world, rad/s, and velocity, m/s.
#[derive(Debug, Clone, Copy)]
struct Motion {
    turn_rad_s: Vector3<f64>,
    shift_m_s: Vector3<f64>,
}

/// Every so many frames are looked at in a recording of so many.
pub fn step(frames: usize) -> usize {
    frames.div_ceil(MOST_FRAMES).max(1)
}

/// Moves all poses of a recording to the times of their frames; answers what exposure was found.
pub fn to_frame_times(rows: &mut [Row], scene: &crate::frame::Scene, timing: &Timing) -> Option<f64> {
    if !timing.stamp_at_start {
        return None;
    }
    let motions: Vec<Option<Motion>> = (0..rows.len()).map(|k| motion(rows, k)).collect();
    let (exposure, indices, turning) = match timing.exposure_s {
        Some(typical_s) => (Exposure { typical_s, deviation_s: 0.0, different_s: Vec::new(), misfit: 0.0 }, Vec::new(), true),
        None => by_rims(rows, &motions, scene)?,
    };
    for (k, row) in rows.iter_mut().enumerate() {
        let (Ok(found), Some(motion)) = (&mut row.found, motions[k]) else { continue };
        let own = exposure.different_s.iter().find(|(index, _)| indices.get(*index) == Some(&k));
        let exposure_s = own.map_or(exposure.typical_s, |(_, own)| *own);
        // A box shutter is an assumption, good to a quarter of the shift.
        let unsure_s = 0.125 * exposure_s + 0.5 * exposure.deviation_s;
        moved_back(found, &motion, 0.5 * exposure_s, unsure_s, turning);
    }
    Some(exposure.typical_s)
}

/// Exposure, rows looked at, and whether turning smears rims too. A recording put together from steps is smeared along the end
/// effector's path only: the rims have to say clearly that turning smears them too.
fn by_rims(rows: &[Row], motions: &[Option<Motion>], scene: &crate::frame::Scene) -> Option<(Exposure, Vec<usize>, bool)> {
    let shifted = measured(rows, motions, scene, false);
    let turned = measured(rows, motions, scene, true);
    match (shifted, turned) {
        (Some(s), Some(t)) if t.0.misfit < CLEARLY * s.0.misfit => Some((t.0, t.1, true)),
        (Some(s), _) => Some((s.0, s.1, false)),
        (None, t) => t.map(|t| (t.0, t.1, true)),
    }
}

/// Velocity by the neighbours, on both sides where there are two.
fn motion(rows: &[Row], k: usize) -> Option<Motion> {
    let pose = |k: usize| rows.get(k).and_then(|row| row.found.as_ref().ok().map(|found| (row.t_s, found.pose)));
    let here = pose(k)?;
    let usual_s = (rows.last()?.t_s - rows.first()?.t_s) / (rows.len().max(2) - 1) as f64;
    let near = |other: Option<(f64, Isometry3<f64>)>| other.filter(|(t_s, _)| (t_s - here.0).abs() < FAR * usual_s);
    let before = near((0..k).rev().find_map(pose)).unwrap_or(here);
    let after = near((k + 1..rows.len()).find_map(pose)).unwrap_or(here);
    let time_s = after.0 - before.0;
    (time_s > 0.0).then(|| Motion {
        turn_rad_s: (after.1.rotation * before.1.rotation.inverse()).scaled_axis() / time_s,
        shift_m_s: (after.1.translation.vector - before.1.translation.vector) / time_s,
    })
}

/// Exposure by the rims of frames spread over the recording, and which rows these are.
fn measured(
    rows: &[Row],
    motions: &[Option<Motion>],
    scene: &crate::frame::Scene,
    turning: bool,
) -> Option<(Exposure, Vec<usize>)> {
    let step = rows.len().div_ceil(MOST_FRAMES).max(1);
    let indices: Vec<usize> =
        (0..rows.len()).step_by(step).filter(|k| !rows[*k].views.is_empty() && motions[*k].is_some()).collect();
    let cameras = scene.cameras.len();
    let mut widths = Vec::new();
    for (frame, k) in indices.iter().enumerate() {
        let (Ok(found), Some(motion)) = (&rows[*k].found, motions[*k]) else { continue };
        for (ball, views) in rows[*k].views.iter().enumerate() {
            let centre = found.pose * Point3::from(scene.fixture.centres_m()[ball]);
            let arm = centre.coords - found.pose.translation.vector;
            let turn = if turning { motion.turn_rad_s.cross(&arm) } else { Vector3::zeros() };
            let velocity_m_s = motion.shift_m_s + turn;
            for (camera, view) in views.iter().enumerate() {
                let (View::Effective(sighting), Some(by)) = (view, scene.cameras[camera].pixel_by_point(&centre)) else { continue };
                let velocity_px_s = by * velocity_m_s;
                widths.extend(sighting.points.iter().filter(|point| point.width_px.is_finite()).map(|point| RimWidth {
                    frame,
                    group: ball * cameras + camera,
                    normal: [point.normal.x as f32, point.normal.y as f32],
                    width_px: point.width_px as f32,
                    speed_px_s: velocity_px_s.dot(&point.normal) as f32,
                }));
            }
        }
    }
    Some((estimate(&widths, indices.len(), 3 * cameras)?, indices))
}

/// Moves a pose back in time along its motion, and adds what is not known of that to its covariance.
fn moved_back(found: &mut Found, motion: &Motion, by_s: f64, unsure_s: f64, turning: bool) {
    let turn_rad_s = if turning { motion.turn_rad_s } else { Vector3::zeros() };
    let turn = UnitQuaternion::from_scaled_axis(-turn_rad_s * by_s);
    let tip = found.pose.translation.vector;
    for ball in &mut found.balls_m {
        *ball = Point3::from(turn * (ball.coords - tip) + tip - motion.shift_m_s * by_s);
    }
    found.pose.rotation = turn * found.pose.rotation;
    found.pose.translation.vector -= motion.shift_m_s * by_s;
    if let Some(covariance) = &mut found.covariance {
        let mut along = nalgebra::Vector6::zeros();
        along.fixed_rows_mut::<3>(0).copy_from(&(motion.turn_rad_s * if turning { unsure_s } else { by_s }));
        along.fixed_rows_mut::<3>(3).copy_from(&(motion.shift_m_s * unsure_s));
        let extra: Matrix6<f64> = along * along.transpose();
        *covariance += extra;
    }
}
