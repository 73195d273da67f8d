//! `ravenpose vision`: where the cameras stand, and where the end effector is in their images.

use crate::progress::Progress;
use ::vision::commands::{self, Calibrated};
use ::vision::track::{Mode, Tracked};
use clap::Subcommand;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What to do.
#[derive(Subcommand)]
pub(crate) enum Wish {
    /// Poses and lenses of all cameras from their chessboards and hand-marked markers
    Calibrate {
        /// Folder with rig.toml, markers.csv and chessboard/
        rig: PathBuf,
        /// cameras.toml to write
        #[arg(long)]
        out: PathBuf,
        /// Each camera by itself, lenses as given, as in the paper
        #[arg(long)]
        paper: bool,
    },
    /// Pose of the end effector in each frame of a recording, or `lost`
    Track {
        /// cameras.toml of `vision calibrate`
        #[arg(long)]
        cameras: PathBuf,
        /// Folder with rig.toml, frames.csv and frames/
        scene: PathBuf,
        /// truth.csv to write
        #[arg(long)]
        out: PathBuf,
        /// Hough circles, midpoints, Nelder-Mead, as in the paper
        #[arg(long)]
        paper: bool,
    },
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    match wish {
        Wish::Calibrate { rig, out, paper } => calibrate(rig, out, mode(*paper)),
        Wish::Track { cameras, scene, out, paper } => track(cameras, scene, out, mode(*paper)),
    }
}

fn mode(paper: bool) -> Mode {
    if paper { Mode::Paper } else { Mode::Default }
}

fn calibrate(rig: &Path, out: &Path, mode: Mode) -> Result<ExitCode, String> {
    let found = commands::calibrate(rig, mode).map_err(|error| error.to_string())?;
    commands::write_cameras(&found, out).map_err(|error| error.to_string())?;
    let _ = crate::output::say(format_args!("{}", calibrated_words(&found)));
    for remark in &found.remarks {
        complain!("ravenpose: {remark}");
    }
    Ok(ExitCode::SUCCESS)
}

fn calibrated_words(found: &Calibrated) -> String {
    let mut lines = Vec::new();
    for known in &found.cameras {
        let c = known.camera.centre_m * 1e3;
        lines.push(format!(
            "{}: at {:.1}, {:.1}, {:.1} mm, markers {:.2} px RMS, work space seen to {:.2} px",
            known.camera.name, c.x, c.y, c.z, known.reprojection_rms_px, known.bearing_px
        ));
    }
    for odd in &found.contradictions {
        let what = odd.camera.as_ref().map_or_else(|| "its place".to_owned(), |camera| format!("its mark in {camera}"));
        lines.push(format!(
            "marker {} (markers.csv line {}): {what} contradicts the rest by {:.1} px and was left out",
            odd.marker, odd.line, odd.off_px
        ));
    }
    lines.join("\n") + "\n"
}

fn track(cameras: &Path, scene: &Path, out: &Path, mode: Mode) -> Result<ExitCode, String> {
    let mut progress = Progress::frames();
    let tracked = commands::track(cameras, scene, mode, &mut |done, all| progress.at(done as u64, all as u64));
    progress.end();
    let tracked = tracked.map_err(|error| error.to_string())?;
    commands::write_truth(&tracked, out).map_err(|error| error.to_string())?;
    let _ = crate::output::say(format_args!("{}", tracked_words(&tracked)));
    Ok(ExitCode::SUCCESS)
}

fn tracked_words(tracked: &Tracked) -> String {
    let measured = tracked.rows.iter().filter(|row| row.found.is_ok()).count();
    let mut lines = vec![format!("{measured} of {} frames measured", tracked.rows.len())];
    for row in tracked.rows.iter().filter(|row| row.found.is_err()) {
        if let Err(lost) = &row.found {
            lines.push(format!("frame {} lost: {}", row.frame, lost.words(&tracked.balls)));
        }
    }
    for remark in tracked.rows.iter().flat_map(|row| &row.remarks) {
        lines.push(remark.clone());
    }
    if let Some(exposure_s) = tracked.exposure_s {
        lines.push(format!("exposure {:.1} ms: poses moved back to its beginning", exposure_s * 1e3));
    }
    lines.join("\n") + "\n"
}
