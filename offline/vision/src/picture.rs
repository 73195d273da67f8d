//! Images of a scene as planes of numbers.

use crate::error::{Error, Result};
use image::{ImageError, RgbImage};
use std::path::{Path, PathBuf};

/// Endings that are looked for, in this order.
const ENDINGS: [&str; 3] = ["jpg", "jpeg", "png"];

/// A plane of numbers, row by row.
#[derive(Debug, Clone)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values.
    pub values: Vec<f32>,
}

impl Plane {
    /// Of one value per pixel of an image.
    pub fn of(image: &RgbImage, value: impl Fn([f32; 3]) -> f32) -> Self {
        let values = image.pixels().map(|p| value([f32::from(p.0[0]), f32::from(p.0[1]), f32::from(p.0[2])])).collect();
        Self { width: image.width() as usize, height: image.height() as usize, values }
    }

    /// Value of a pixel; the border goes on outside.
    pub fn at(&self, x: i64, y: i64) -> f32 {
        let x = x.clamp(0, self.width as i64 - 1) as usize;
        let y = y.clamp(0, self.height as i64 - 1) as usize;
        self.values[y * self.width + x]
    }

    /// Value between pixels, bilinear.
    pub fn sample(&self, x: f64, y: f64) -> f32 {
        let (x0, y0) = (x.floor(), y.floor());
        let (a, b) = ((x - x0) as f32, (y - y0) as f32);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let top = self.at(x0, y0) * (1.0 - a) + self.at(x0 + 1, y0) * a;
        let bottom = self.at(x0, y0 + 1) * (1.0 - a) + self.at(x0 + 1, y0 + 1) * a;
        top * (1.0 - b) + bottom * b
    }

    /// Smoothed by a Gaussian.
    #[must_use]
    pub fn blurred(&self, sigma_px: f64) -> Self {
        let radius = (3.0 * sigma_px).ceil() as i64;
        let kernel: Vec<f32> = (-radius..=radius).map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp() as f32).collect();
        let total: f32 = kernel.iter().sum();
        let (w, h) = (self.width as i64, self.height as i64);
        let mut across = vec![0.0_f32; self.values.len()];
        for y in 0..h {
            let row = &self.values[(y * w) as usize..((y + 1) * w) as usize];
            for x in 0..w {
                let sum: f32 = kernel
                    .iter()
                    .enumerate()
                    .map(|(k, weight)| weight * row[(x + k as i64 - radius).clamp(0, w - 1) as usize])
                    .sum();
                across[(y * w + x) as usize] = sum / total;
            }
        }
        let mut values = vec![0.0_f32; self.values.len()];
        for y in 0..h {
            for (k, weight) in kernel.iter().enumerate() {
                let from = ((y + k as i64 - radius).clamp(0, h - 1) * w) as usize;
                let to = (y * w) as usize;
                for x in 0..w as usize {
                    values[to + x] += weight / total * across[from + x];
                }
            }
        }
        Self { width: self.width, height: self.height, values }
    }
}

/// The image of a name in a folder, whatever its ending; `None` if there is none.
pub fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    ENDINGS.iter().map(|ending| folder.join(format!("{name}.{ending}"))).find(|path| path.is_file())
}

/// Reads an image of a size.
///
/// # Errors
/// If it cannot be read, is no image, or has another size.
pub fn read(file: &Path, size_px: [u32; 2]) -> Result<RgbImage> {
    read_unless_damaged(file, size_px)?.map_err(|damage| no_image(file, damage))
}

/// Is there no end marker after the last scan of a JPEG? Cameras may pad behind it.
fn is_jpeg_without_end(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    bytes.starts_with(&[0xff, 0xd8]) && last([0xff, 0xd9]) < last([0xff, 0xda])
}

fn no_image(file: &Path, what: String) -> Error {
    Error::content(file, "image", what, "give a JPEG or PNG")
}

/// The same, where an image that was cut off is no error: it is what is wrong with it, in one line.
///
/// # Errors
/// If it cannot be read, never was an image, or has another size.
pub fn read_unless_damaged(file: &Path, size_px: [u32; 2]) -> Result<std::result::Result<RgbImage, String>> {
    let bytes = std::fs::read(file).map_err(Error::read(file))?;
    let image = match image::load_from_memory(&bytes) {
        Ok(image) => image.into_rgb8(),
        Err(error) => {
            let what = error.to_string().replace('\n', " ");
            let is_cut = matches!(error, ImageError::Decoding(_) | ImageError::IoError(_)) && image::guess_format(&bytes).is_ok();
            return if is_cut || bytes.is_empty() { Ok(Err(what)) } else { Err(no_image(file, what)) };
        }
    };
    // The decoder fills with grey what a JPEG lacks.
    if is_jpeg_without_end(&bytes) {
        return Ok(Err("the JPEG has no end".to_owned()));
    }
    if [image.width(), image.height()] != size_px {
        let what = format!("{} x {} px", image.width(), image.height());
        return Err(Error::content(file, "size", what, format!("rig.toml says {} x {}", size_px[0], size_px[1])));
    }
    Ok(Ok(image))
}
