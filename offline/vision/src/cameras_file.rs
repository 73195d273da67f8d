//! `cameras.toml`: the cameras of a rig as `calibrate` found them. Millimetres in the file, metres here.

use crate::camera::{Camera, Intrinsics};
use crate::error::{Error, Result};
use crate::rig::{Rig, absurdity};
use nalgebra::{Matrix3, Point3, Rotation3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A camera and how well it is known.
#[derive(Debug, Clone)]
pub struct KnownCamera {
    /// The camera.
    pub camera: Camera,
    /// RMS of marked minus predicted pixel over both axes.
    pub reprojection_rms_px: f64,
    /// Standard deviation of where it sees the middle of the work space, px.
    pub bearing_px: f64,
    /// Standard deviation of its centre along x, y, z, m.
    pub centre_deviation_m: Option<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
struct RawFile {
    resolution: [u32; 2],
    #[serde(default)]
    method: String,
    camera: Vec<RawCamera>,
}

#[derive(Serialize, Deserialize)]
struct RawCamera {
    name: String,
    rotation: [[f64; 3]; 3],
    centre_mm: [f64; 3],
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    distortion: [f64; 4],
    reprojection_rms_px: f64,
    bearing_px: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre_deviation_mm: Option<[f64; 3]>,
}

/// The text of a file.
pub fn text(cameras: &[KnownCamera], method: &str) -> String {
    let size_px = cameras.first().map_or([0, 0], |known| known.camera.size_px);
    let camera = |known: &KnownCamera| {
        let (own, matrix) = (&known.camera, known.camera.rotation.matrix());
        RawCamera {
            name: own.name.clone(),
            rotation: std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)])),
            centre_mm: std::array::from_fn(|k| own.centre_m[k] * 1e3),
            fx: own.intrinsics.focal_px[0],
            fy: own.intrinsics.focal_px[1],
            cx: own.intrinsics.centre_px[0],
            cy: own.intrinsics.centre_px[1],
            distortion: own.intrinsics.distortion,
            reprojection_rms_px: known.reprojection_rms_px,
            bearing_px: known.bearing_px,
            centre_deviation_mm: known.centre_deviation_m.map(|d| d.map(|v| v * 1e3)),
        }
    };
    let file = RawFile { resolution: size_px, method: method.to_owned(), camera: cameras.iter().map(camera).collect() };
    let head = "# Cameras as found by `ravenpose vision calibrate`. rotation: rows, world to camera (x right, y down, z forward);\n\
                # pixels are counted from the image's upper left corner: the centre of the first one is (0.5, 0.5).\n";
    // Numbers and names only: nothing that TOML could not hold.
    format!("{head}{}", toml::to_string(&file).unwrap_or_default())
}

/// Reads the cameras of a rig, in the rig's order.
///
/// # Errors
/// If the file is absent, not sound, or of another rig.
pub fn read(file: &Path, rig: &Rig) -> Result<Vec<KnownCamera>> {
    let text = std::fs::read_to_string(file).map_err(Error::read(file))?;
    let raw: RawFile = toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let what = error.message().replace('\n', " ");
        Error::content(file, format!("line {line}"), what, "make it with ravenpose vision calibrate")
    })?;
    if raw.resolution != rig.size_px {
        let what = format!("{} x {} px", raw.resolution[0], raw.resolution[1]);
        let remedy = format!("the scene's rig.toml says {} x {}; calibrate that rig", rig.size_px[0], rig.size_px[1]);
        return Err(Error::content(file, "resolution", what, remedy));
    }
    let names = || raw.camera.iter().map(|camera| camera.name.clone()).collect::<Vec<_>>().join(", ");
    rig.cameras
        .iter()
        .map(|wanted| {
            let Some(own) = raw.camera.iter().find(|camera| camera.name == wanted.name) else {
                let what = format!("camera {} of the scene is not in it", wanted.name);
                return Err(Error::content(file, "camera", what, format!("it holds {}", names())));
            };
            known(file, own, raw.resolution)
        })
        .collect()
}

fn known(file: &Path, raw: &RawCamera, size_px: [u32; 2]) -> Result<KnownCamera> {
    let bad = |what: &str| Error::content(file, &raw.name, what, "make the file anew with ravenpose vision calibrate");
    let matrix = Matrix3::from_fn(|r, c| raw.rotation[r][c]);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    if !(off < 1e-3 && matrix.determinant() > 0.0) {
        return Err(bad("rotation is no rotation"));
    }
    let intrinsics = Intrinsics { focal_px: [raw.fx, raw.fy], centre_px: [raw.cx, raw.cy], distortion: raw.distortion };
    if let Some(what) = absurdity(&intrinsics, size_px) {
        return Err(bad(&what));
    }
    if !(raw.bearing_px > 0.0 && raw.bearing_px < 1e3 && raw.centre_mm.iter().all(|v| v.is_finite())) {
        return Err(bad("bearing_px or centre_mm is no number"));
    }
    let camera = Camera {
        name: raw.name.clone(),
        rotation: Rotation3::from_matrix(&matrix),
        centre_m: Point3::from(raw.centre_mm.map(|v| v * 1e-3)),
        intrinsics,
        size_px,
    };
    Ok(KnownCamera {
        camera,
        reprojection_rms_px: raw.reprojection_rms_px,
        bearing_px: raw.bearing_px,
        centre_deviation_m: raw.centre_deviation_mm.map(|d| d.map(|v| v * 1e-3)),
    })
}
