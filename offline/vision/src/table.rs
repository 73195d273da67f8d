//! The small CSV files of a scene: `markers.csv` and `frames.csv`.

use crate::error::{Error, Result};
use nalgebra::{Point2, Point3};
use std::path::Path;

/// A marker that somebody marked in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct Pick {
    /// Name of the marker.
    pub marker: String,
    /// Where the lab measured it.
    pub position_m: Point3<f64>,
    /// Index of the camera in the rig.
    pub camera: usize,
    /// Where it was marked.
    pub pixel: Point2<f64>,
    /// Line in the file.
    pub line: usize,
}

/// A frame of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameTime {
    /// Number, also of the image files.
    pub frame: u64,
    /// Time.
    pub t_s: f64,
}

/// The frames of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Their numbers and times, rising.
    pub times: Vec<FrameTime>,
    /// When `t_s` is 0, s since 1970, where `# start_unix_s = ...` says so.
    pub start_unix_s: Option<f64>,
}

/// Columns of a CSV file by name, with the line of each row.
struct Rows {
    /// `# key = value`, with the line.
    metadata: Vec<(usize, String, String)>,
    header: Vec<String>,
    content: Vec<(usize, Vec<String>)>,
}

impl Rows {
    fn read(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(Error::read(file))?;
        let split = |line: &str| line.split(',').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let numbered = || text.lines().enumerate().map(|(k, line)| (k + 1, line.trim()));
        let metadata = numbered().filter_map(|(number, line)| {
            let (key, value) = line.strip_prefix('#')?.split_once('=')?;
            Some((number, key.trim().to_owned(), value.trim().to_owned()))
        });
        let mut lines = numbered().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let header = lines.next().map(|(_, line)| split(line)).unwrap_or_default();
        let content: Vec<_> = lines.map(|(number, line)| (number, split(line))).collect();
        for (number, cells) in &content {
            if cells.len() != header.len() {
                let what = format!("{} cells under {} names", cells.len(), header.len());
                return Err(Error::content(file, format!("line {number}"), what, "give each column a cell"));
            }
        }
        Ok(Self { metadata: metadata.collect(), header, content })
    }

    fn column(&self, file: &Path, name: &str) -> Result<usize> {
        self.header
            .iter()
            .position(|own| own == name)
            .ok_or_else(|| Error::content(file, "line 1", format!("no column {name}"), "see docs/vision.md for the columns"))
    }
}

fn number(file: &Path, line: usize, name: &str, cell: &str) -> Result<f64> {
    cell.parse::<f64>()
        .ok()
        .filter(|value| value.is_finite())
        .ok_or_else(|| Error::content(file, format!("line {line}"), format!("{name} is '{cell}'"), "give a number"))
}

/// Reads marked points; `cameras` are the names of the rig's cameras. A first column `object` with `kind` (vision-real) is read as
/// well: rows of kind `ball` are left out.
///
/// # Errors
/// If a column is absent, a cell is no number, a camera is unknown, a marker stands twice in one camera, or one marker has two places.
pub fn read_picks(file: &Path, cameras: &[String]) -> Result<Vec<Pick>> {
    read_objects(file, cameras, "marker")
}

/// As [`read_picks`], of another kind than `marker`.
///
/// # Errors
/// As [`read_picks`].
pub fn read_objects(file: &Path, cameras: &[String], kind: &str) -> Result<Vec<Pick>> {
    let rows = Rows::read(file)?;
    let name_at = rows.column(file, "marker").or_else(|_| rows.column(file, "object"))?;
    let kind_at = rows.column(file, "kind").ok();
    let numbers = ["x_mm", "y_mm", "z_mm", "u_px", "v_px"];
    let mut at = [0; 5];
    for (place, name) in at.iter_mut().zip(numbers) {
        *place = rows.column(file, name)?;
    }
    let camera_at = rows.column(file, "camera")?;
    let mut picks: Vec<Pick> = Vec::new();
    for (line, cells) in &rows.content {
        if kind_at.is_some_and(|k| cells[k] != kind) {
            continue;
        }
        let place = || format!("line {line}");
        let Some(camera) = cameras.iter().position(|own| *own == cells[camera_at]) else {
            let what = format!("camera '{}' is not in rig.toml", cells[camera_at]);
            return Err(Error::content(file, place(), what, format!("its cameras are {}", cameras.join(", "))));
        };
        let mut v = [0.0; 5];
        for k in 0..5 {
            v[k] = number(file, *line, numbers[k], &cells[at[k]])?;
        }
        let pick = Pick {
            marker: cells[name_at].clone(),
            position_m: Point3::new(v[0] * 1e-3, v[1] * 1e-3, v[2] * 1e-3),
            camera,
            pixel: Point2::new(v[3], v[4]),
            line: *line,
        };
        if let Some(other) = picks.iter().find(|other| other.marker == pick.marker && other.camera == camera) {
            let what = format!("marker {} is marked twice in {} (first in line {})", pick.marker, cameras[camera], other.line);
            return Err(Error::content(file, place(), what, "keep one of the two lines"));
        }
        if let Some(other) = picks.iter().find(|o| o.marker == pick.marker && (o.position_m - pick.position_m).norm() > 1e-7) {
            let what = format!("marker {} stands elsewhere in line {}", pick.marker, other.line);
            return Err(Error::content(file, place(), what, "give a marker the same x_mm, y_mm, z_mm in each line"));
        }
        picks.push(pick);
    }
    Ok(picks)
}

/// Where markers stand, by name.
pub type Places = std::collections::BTreeMap<String, Point3<f64>>;

/// Reads `marker,x_mm,y_mm,z_mm`: places of markers, marked or not.
///
/// # Errors
/// If a column is absent, a cell is no number, or a marker stands twice.
pub fn read_places(file: &Path) -> Result<Places> {
    let rows = Rows::read(file)?;
    let name_at = rows.column(file, "marker")?;
    let names = ["x_mm", "y_mm", "z_mm"];
    let at = [rows.column(file, names[0])?, rows.column(file, names[1])?, rows.column(file, names[2])?];
    let mut places = Places::new();
    for (line, cells) in &rows.content {
        let mut v = [0.0; 3];
        for k in 0..3 {
            v[k] = number(file, *line, names[k], &cells[at[k]])? * 1e-3;
        }
        if places.insert(cells[name_at].clone(), Point3::from(v)).is_some() {
            let what = format!("marker {} stands twice", cells[name_at]);
            return Err(Error::content(file, format!("line {line}"), what, "keep one of the lines"));
        }
    }
    Ok(places)
}

/// Reads the frames of a recording.
///
/// # Errors
/// If a column is absent, a cell or `# start_unix_s` is no number, a frame stands twice, or time or number does not rise.
pub fn read_frames(file: &Path) -> Result<Frames> {
    let rows = Rows::read(file)?;
    let start = rows.metadata.iter().find(|(_, key, _)| key == "start_unix_s");
    let start_unix_s = start.map(|(line, key, value)| number(file, *line, key, value)).transpose()?;
    let (frame_at, time_at) = (rows.column(file, "frame")?, rows.column(file, "t_s")?);
    let mut frames: Vec<FrameTime> = Vec::new();
    for (line, cells) in &rows.content {
        let place = format!("line {line}");
        let Ok(frame) = cells[frame_at].parse::<u64>() else {
            let what = format!("frame is '{}'", cells[frame_at]);
            return Err(Error::content(file, place, what, "give a whole number"));
        };
        let t_s = number(file, *line, "t_s", &cells[time_at])?;
        if frames.last().is_some_and(|last| last.frame >= frame || last.t_s >= t_s) {
            let what = format!("frame {frame} at {t_s} s is out of order");
            return Err(Error::content(file, place, what, "sort the frames; number and time have to rise"));
        }
        frames.push(FrameTime { frame, t_s });
    }
    if frames.is_empty() {
        return Err(Error::content(file, "line 2", "no frames", "list the frames of the recording"));
    }
    Ok(Frames { times: frames, start_unix_s })
}
