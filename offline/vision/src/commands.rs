//! What the command line does: folders and files in, results and the text of files out.

use crate::adjustment::Priors;
use crate::bundle::{self, UNKNOWN_BEARING_PX, reprojection_rms_px};
use crate::cameras_file::{self, KnownCamera};
use crate::error::{Error, Result};
use crate::localise;
use crate::marks::Contradiction;
use crate::outcome::Tracked;
use crate::rig::{self, Rig};
use crate::table::read_picks;
use crate::track::{self, Mode};
use std::fmt::Write as _;
use std::path::Path;

/// A calibrated rig.
#[derive(Debug)]
pub struct Calibrated {
    /// Cameras in the order of `rig.toml`.
    pub cameras: Vec<KnownCamera>,
    /// Marks and markers that were left out because they contradict the rest.
    pub contradictions: Vec<Contradiction>,
    /// What a careful reader should know.
    pub remarks: Vec<String>,
    /// In words, for `cameras.toml`.
    pub method: String,
}

/// Finds the cameras of a rig folder.
///
/// # Errors
/// If its files are absent or not sound, a board is not found, or the marks do not determine the cameras.
pub fn calibrate(folder: &Path, mode: Mode) -> Result<Calibrated> {
    let rig = rig::read(folder)?;
    let names: Vec<String> = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
    let mut picks = read_picks(&folder.join("markers.csv"), &names)?;
    for pick in &mut picks {
        pick.pixel += nalgebra::Vector2::repeat(0.5 - rig.first_pixel);
    }
    let firsts = localise::first_poses(&rig, folder, &picks)?;
    let mut calibrated = match mode {
        Mode::Default => jointly(&rig, &firsts, &picks)?,
        Mode::Paper => one_by_one(&rig, &firsts, &picks)?,
    };
    remark(&rig, &firsts, &picks, &mut calibrated)?;
    Ok(calibrated)
}

fn jointly(rig: &Rig, firsts: &[localise::First], picks: &[crate::table::Pick]) -> Result<Calibrated> {
    let found = bundle::adjust(rig, firsts, picks, &Priors::default())?;
    let known = |index: usize| KnownCamera {
        camera: found.cameras[index].clone(),
        reprojection_rms_px: found.reprojection_rms_px[index],
        bearing_px: found.bearing_px.get(index).copied().unwrap_or(UNKNOWN_BEARING_PX).max(0.01),
        centre_deviation_m: found.centre_deviation_m.as_ref().map(|all| [all[index].x, all[index].y, all[index].z]),
    };
    Ok(Calibrated {
        cameras: (0..firsts.len()).map(known).collect(),
        contradictions: found.contradictions,
        remarks: Vec::new(),
        method: "joint adjustment of poses, lenses, markers and boards".to_owned(),
    })
}

fn one_by_one(rig: &Rig, firsts: &[localise::First], picks: &[crate::table::Pick]) -> Result<Calibrated> {
    let cameras = localise::paper_poses(rig, firsts, picks)?;
    let rms = reprojection_rms_px(&cameras, picks);
    let known = |(camera, rms): (crate::Camera, f64)| KnownCamera {
        camera,
        reprojection_rms_px: rms,
        bearing_px: UNKNOWN_BEARING_PX,
        centre_deviation_m: None,
    };
    Ok(Calibrated {
        cameras: cameras.into_iter().zip(rms).map(known).collect(),
        contradictions: Vec::new(),
        remarks: Vec::new(),
        method: "paper: each camera by itself on the ray equations, lenses as given".to_owned(),
    })
}

/// Markers this far off, RMS, are not explained by careless marking.
const USELESS_PX: f64 = 8.0;
/// Of a camera's marks, as its reciprocal, from which share on it is not single ones that are wrong.
const MANY: usize = 4;
/// No board lies so badly that it puts a camera this far from where it is.
const FROM_BOARD_M: f64 = 0.1;

/// Says what is odd, and refuses what cannot be used.
fn remark(rig: &Rig, firsts: &[localise::First], picks: &[crate::table::Pick], calibrated: &mut Calibrated) -> Result<()> {
    for (index, (known, first)) in calibrated.cameras.iter().zip(firsts).enumerate() {
        let (camera, file) = (&known.camera, rig.file.with_file_name("markers.csv"));
        let marked = picks.iter().filter(|pick| pick.camera == index).count();
        let left_out = calibrated.contradictions.iter().filter(|odd| odd.camera.as_ref() == Some(&camera.name)).count();
        if left_out * MANY > marked {
            let what = format!("{left_out} of its {marked} marks contradict the rest");
            let remedy = "mark them in images of the size that the rig says, and name the markers as they are";
            return Err(Error::content(&file, &camera.name, what, remedy));
        }
        let off_m = (camera.centre_m - first.camera.centre_m).norm();
        if first.board.is_some() && off_m > FROM_BOARD_M {
            let what = format!("the marks place it {:.0} mm from where its chessboard does", off_m * 1e3);
            let remedy =
                "check the places of the markers (mm), the size of the images that were marked, and the board's square and place";
            return Err(Error::content(&file, &camera.name, what, remedy));
        }
    }
    let cameras: Vec<crate::Camera> = calibrated.cameras.iter().map(|known| known.camera.clone()).collect();
    if bundle::collinear(&cameras) {
        let what = "all cameras stand on one line: along it balls are placed badly".to_owned();
        calibrated.remarks.push(format!("{}: {what}; move one camera off the line", rig.file.display()));
    }
    for known in &calibrated.cameras {
        if known.reprojection_rms_px > USELESS_PX {
            let what = format!("its markers are {:.0} px RMS from where they should be", known.reprojection_rms_px);
            return Err(Error::content(&rig.file, &known.camera.name, what, "check intrinsics, board pose and marks"));
        }
        if known.reprojection_rms_px > 3.0 {
            let what = format!("markers {:.1} px RMS off", known.reprojection_rms_px);
            calibrated.remarks.push(format!("{}: {}: {what}; check intrinsics and marks", rig.file.display(), known.camera.name));
        }
    }
    Ok(())
}

/// The text of `cameras.toml`.
pub fn cameras_text(calibrated: &Calibrated) -> String {
    cameras_file::text(&calibrated.cameras, &calibrated.method)
}

/// Measures the recording of a scene folder; `progress` is told frames done and in all.
///
/// # Errors
/// If files are absent or not sound, or the cameras are of another rig.
pub fn track(cameras: &Path, folder: &Path, mode: Mode, progress: &mut dyn FnMut(usize, usize)) -> Result<Tracked> {
    let rig = rig::read(folder)?;
    let known = cameras_file::read(cameras, &rig)?;
    let bearing_px: Vec<f64> = known.iter().map(|known| known.bearing_px).collect();
    let cameras: Vec<crate::Camera> = known.into_iter().map(|known| known.camera).collect();
    track::track(&cameras, &bearing_px, &rig, folder, mode, progress)
}

/// A page of what was found and suspended in the frames of a measured recording ([`crate::overlay`]).
///
/// # Errors
/// If files cannot be read.
pub fn overlay_text(cameras: &Path, folder: &Path, tracked: &Tracked) -> Result<String> {
    let rig = rig::read(folder)?;
    let cameras: Vec<crate::Camera> = cameras_file::read(cameras, &rig)?.into_iter().map(|known| known.camera).collect();
    crate::overlay::sheet(&cameras, &rig, folder, tracked)
}

/// The columns of `truth.csv` by ball are named after its colours in this order where it has them (the contract's order).
const ORDER: [&str; 3] = ["green", "yellow", "red"];

/// The text of `truth.csv`; pose cells of a lost frame are empty. `# start_unix_s` stands before them where the recording has it.
pub fn truth_text(tracked: &Tracked) -> String {
    let mut order: Vec<usize> = ORDER.iter().filter_map(|name| tracked.balls.iter().position(|ball| ball == name)).collect();
    order.extend((0..3).filter(|k| !ORDER.contains(&tracked.balls[*k].as_str())));
    // Writing to a String cannot fail.
    let mut text = String::new();
    if let Some(start_unix_s) = tracked.start_unix_s {
        let _ = writeln!(text, "# start_unix_s = {start_unix_s:.6}");
    }
    text.push_str("frame,t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz");
    for ball in &order {
        let name = &tracked.balls[*ball];
        let _ = write!(text, ",{name}_x_mm,{name}_y_mm,{name}_z_mm");
    }
    for ball in &order {
        let _ = write!(text, ",cameras_{}", tracked.balls[*ball]);
    }
    text.push_str(",residual_mm,status\n");
    for row in &tracked.rows {
        let _ = write!(text, "{},{:.6}", row.frame, row.t_s);
        if let Ok(found) = &row.found {
            let p = found.pose.translation.vector * 1e3;
            let q = found.pose.rotation.quaternion();
            let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
            let _ = write!(text, ",{:.4},{:.4},{:.4}", p.x, p.y, p.z);
            let _ = write!(text, ",{:.6},{:.6},{:.6},{:.6}", sign * q.w, sign * q.i, sign * q.j, sign * q.k);
            for ball in &order {
                let b = found.balls_m[*ball];
                let _ = write!(text, ",{:.4},{:.4},{:.4}", b.x * 1e3, b.y * 1e3, b.z * 1e3);
            }
            for ball in &order {
                let _ = write!(text, ",{}", found.cameras[*ball]);
            }
            let _ = writeln!(text, ",{:.4},ok", found.residual_m * 1e3);
        } else {
            text.push_str(&",".repeat(3 + 4 + 9 + 3 + 1));
            text.push_str(",lost\n");
        }
    }
    text
}
