//! Marking markers by hand: `markers.csv` of a rig while somebody clicks, and the page to click in ([`server`]).

mod http;
pub mod server;

use crate::error::{Error, Result};
use crate::picture;
use crate::rig::{self, Rig};
use crate::table::{Pick, Places, read_picks, read_places};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Places of markers that are not marked in any image yet: `marker,x_mm,y_mm,z_mm`.
const PLACES: &str = "marker_places.csv";
/// Longest name of a marker.
const LONGEST: usize = 40;

/// A marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Name.
    pub name: String,
    /// Where the lab measured it, mm.
    pub place_mm: [f64; 3],
}

/// Where a marker is in an image; pixels count from the image's upper left corner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mark {
    /// Name of the camera.
    pub camera: String,
    /// Name of the marker.
    pub marker: String,
    /// Column and row.
    pub pixel: [f64; 2],
}

/// Puts the text of a file in its place; a reason where it cannot.
pub type Write = fn(&Path, &str) -> std::result::Result<(), String>;

/// What is marked in a rig so far; each change is written at once.
#[derive(Debug)]
pub struct Marking {
    write: Write,
    rig: Rig,
    folder: PathBuf,
    images: Vec<PathBuf>,
    markers: Vec<Marker>,
    marks: Vec<Mark>,
}

impl Marking {
    /// Opens a rig folder: images from `images/NAME.*` if that is given, else `markers/NAME.*`, the first of `frames/NAME/`, or
    /// `chessboard/NAME.*`; markers from `markers.csv` and `marker_places.csv`, where they exist, which `write` puts there anew.
    ///
    /// # Errors
    /// If the rig or its tables are not sound, or a camera has no image of the rig's size.
    pub fn open(folder: &Path, images: Option<&Path>, write: Write) -> Result<Self> {
        let rig = rig::read(folder)?;
        let names: Vec<String> = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
        let images = names.iter().map(|name| image_of(folder, images, name)).collect::<Result<Vec<_>>>()?;
        for image in &images {
            picture::read(image, rig.size_px)?;
        }
        let csv = folder.join("markers.csv");
        let picks = if csv.exists() { refuse_other_kinds(&csv).and_then(|()| read_picks(&csv, &names))? } else { Vec::new() };
        let shift = 0.5 - rig.first_pixel;
        let marks = picks.iter().map(|pick| Mark {
            camera: names[pick.camera].clone(),
            marker: pick.marker.clone(),
            pixel: [pick.pixel.x + shift, pick.pixel.y + shift],
        });
        let marks = marks.collect();
        let places = folder.join(PLACES);
        let mut known = if places.exists() { read_places(&places)? } else { Places::new() };
        known.extend(picks.iter().map(|pick: &Pick| (pick.marker.clone(), pick.position_m)));
        let markers = known.into_iter().map(|(name, at)| Marker { name, place_mm: [at.x, at.y, at.z].map(mm) }).collect();
        Ok(Self { write, rig, folder: folder.to_owned(), images, markers, marks })
    }

    /// How many marks there are.
    pub fn count(&self) -> usize {
        self.marks.len()
    }

    /// The file that is written.
    pub fn file(&self) -> PathBuf {
        self.folder.join("markers.csv")
    }

    /// All that the page shows, as JSON.
    pub fn json(&self) -> String {
        #[derive(Serialize)]
        struct All<'a> {
            size_px: [u32; 2],
            cameras: Vec<&'a str>,
            markers: &'a [Marker],
            marks: &'a [Mark],
        }
        let cameras = self.rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let all = All { size_px: self.rig.size_px, cameras, markers: &self.markers, marks: &self.marks };
        // Names and finite numbers only: nothing that JSON could not hold.
        serde_json::to_string(&all).unwrap_or_default()
    }

    /// The image of a camera.
    pub fn image(&self, camera: &str) -> Option<&Path> {
        self.rig.cameras.iter().position(|own| own.name == camera).map(|index| self.images[index].as_path())
    }

    /// Marks a marker in an image, in place of an older mark.
    ///
    /// # Errors
    /// If camera or marker is unknown, the pixel is outside the image, or the file cannot be written.
    pub fn set(&mut self, mark: Mark) -> std::result::Result<(), String> {
        if self.image(&mark.camera).is_none() {
            return Err(format!("camera '{}' is not in rig.toml", mark.camera));
        }
        if !self.markers.iter().any(|marker| marker.name == mark.marker) {
            return Err(format!("marker '{}' is unknown; add it with its place first", mark.marker));
        }
        let [w, h] = self.rig.size_px.map(f64::from);
        if !((0.0..=w).contains(&mark.pixel[0]) && (0.0..=h).contains(&mark.pixel[1])) {
            return Err(format!("pixel {:.1}, {:.1} is outside the image", mark.pixel[0], mark.pixel[1]));
        }
        let before = self.marks.clone();
        self.marks.retain(|old| old.camera != mark.camera || old.marker != mark.marker);
        self.marks.push(mark);
        self.save().inspect_err(|_| self.marks = before)
    }

    /// Takes a mark away; none is no fault.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn remove(&mut self, camera: &str, marker: &str) -> std::result::Result<(), String> {
        let before = self.marks.clone();
        self.marks.retain(|old| old.camera != camera || old.marker != marker);
        self.save().inspect_err(|_| self.marks = before)
    }

    /// Adds a marker, or corrects its place.
    ///
    /// # Errors
    /// If the name cannot stand in a table, the place is no number, or the file cannot be written.
    pub fn add(&mut self, marker: Marker) -> std::result::Result<(), String> {
        let sound = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if marker.name.is_empty() || marker.name.len() > LONGEST || !marker.name.chars().all(sound) {
            return Err(format!("a marker's name has 1 to {LONGEST} letters, digits, '-', '_' and '.'"));
        }
        if !marker.place_mm.iter().all(|v| v.is_finite() && v.abs() < 1e6) {
            return Err(format!("marker {}: its place is three numbers in mm", marker.name));
        }
        let before = self.markers.clone();
        match self.markers.iter_mut().find(|old| old.name == marker.name) {
            Some(old) => *old = marker,
            None => self.markers.push(marker),
        }
        self.save().inspect_err(|_| self.markers = before)
    }

    fn save(&self) -> std::result::Result<(), String> {
        let mut places = String::from("marker,x_mm,y_mm,z_mm\n");
        for Marker { name, place_mm: [x, y, z] } in &self.markers {
            let _ = writeln!(places, "{name},{x},{y},{z}");
        }
        (self.write)(&self.folder.join(PLACES), &places)?;
        (self.write)(&self.file(), &self.csv())
    }

    /// Rows camera by camera, in the order of the markers.
    fn csv(&self) -> String {
        let mut text = String::from("marker,x_mm,y_mm,z_mm,camera,u_px,v_px\n");
        let shift = self.rig.first_pixel - 0.5;
        for camera in &self.rig.cameras {
            for Marker { name, place_mm: [x, y, z] } in &self.markers {
                let own = self.marks.iter().filter(|mark| mark.camera == camera.name && mark.marker == *name);
                for Mark { pixel: [u, v], .. } in own {
                    let at = Point2::new(u + shift, v + shift);
                    let _ = writeln!(text, "{name},{x},{y},{z},{},{:.2},{:.2}", camera.name, at.x, at.y);
                }
            }
        }
        text
    }
}

/// Rows of other kinds would be lost with the first mark.
fn refuse_other_kinds(csv: &Path) -> Result<()> {
    let text = std::fs::read_to_string(csv).map_err(Error::read(csv))?;
    let head = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    if head.split(',').any(|name| ["kind", "object"].contains(&name.trim())) {
        let remedy = "move its balls elsewhere: marking writes marker,x_mm,y_mm,z_mm,camera,u_px,v_px";
        return Err(Error::content(csv, "line 1", "holds more than markers", remedy));
    }
    Ok(())
}

fn image_of(folder: &Path, given: Option<&Path>, name: &str) -> Result<PathBuf> {
    let frames = folder.join("frames").join(name);
    let first = || -> Option<PathBuf> {
        let mut all: Vec<PathBuf> = std::fs::read_dir(&frames).ok()?.filter_map(|entry| Some(entry.ok()?.path())).collect();
        all.retain(|path| path.extension().is_some_and(|ending| ["jpg", "jpeg", "png"].iter().any(|own| ending == *own)));
        all.sort();
        all.into_iter().next()
    };
    let found = match given {
        Some(given) => picture::find(given, name),
        None => {
            picture::find(&folder.join("markers"), name).or_else(first).or_else(|| picture::find(&folder.join("chessboard"), name))
        }
    };
    found.ok_or_else(|| {
        let place = given.unwrap_or(folder);
        Error::content(place, name, "no image of this camera", format!("give {name}.jpg or .png, or name its folder with --images"))
    })
}

/// As it was written: metres to millimetres without the last digits of a double.
fn mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}
