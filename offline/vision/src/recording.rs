//! The frames of a recording, image by image.

use crate::error::{Error, Result};
use crate::picture;
use crate::rig::Rig;
use crate::table::{FrameTime, Frames, read_frames};
use image::RgbImage;
use std::path::{Path, PathBuf};

/// A channel this dark everywhere is a frame that the camera lost.
const BLACK: u8 = 24;

/// A recording as a folder holds it.
#[derive(Debug)]
pub struct Recording {
    /// Times of its frames.
    pub frames: Vec<FrameTime>,
    /// When their time is 0, s since 1970, where it is known.
    pub start_unix_s: Option<f64>,
    folder: PathBuf,
    names: Vec<String>,
    size_px: [u32; 2],
}

impl Recording {
    /// Opens a recording: `frames.csv` and a folder of images for two cameras at least.
    ///
    /// # Errors
    /// If the list of frames is not sound, or fewer than two cameras have images.
    pub fn open(rig: &Rig, folder: &Path) -> Result<Self> {
        let Frames { times, start_unix_s } = read_frames(&folder.join("frames.csv"))?;
        let names: Vec<String> = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
        let images = folder.join("frames");
        let there = names.iter().filter(|name| images.join(name).is_dir()).count();
        if there < 2 {
            let what = format!("{there} of {} cameras have a folder of images", names.len());
            return Err(Error::content(&images, names.join(", "), what, "give frames/NAME/ for two cameras at least"));
        }
        Ok(Self { frames: times, start_unix_s, folder: images, names, size_px: rig.size_px })
    }

    /// Images of a frame by camera; `None` where one is missing, damaged or black, with what is to be said about it.
    ///
    /// # Errors
    /// If an image cannot be read, never was one, or has another size.
    pub fn images(&self, frame: &FrameTime) -> Result<Vec<(Option<RgbImage>, Option<String>)>> {
        let read = |name: &String| -> Result<(Option<RgbImage>, Option<String>)> {
            let number = format!("{:06}", frame.frame);
            let Some(file) = picture::find(&self.folder.join(name), &number) else {
                return Ok((None, Some(format!("{}: no image of frame {}", self.folder.join(name).display(), frame.frame))));
            };
            // A camera that fell out while it wrote must not cost the other frames.
            let image = match picture::read_unless_damaged(&file, self.size_px)? {
                Ok(image) => image,
                Err(damage) => return Ok((None, Some(format!("{}: {damage}", file.display())))),
            };
            if image.as_raw().iter().step_by(97).all(|value| *value < BLACK) {
                return Ok((None, Some(format!("{}: black", file.display()))));
            }
            Ok((Some(image), None))
        };
        // Decoding is a good part of all work; a thread per camera.
        std::thread::scope(|scope| {
            let readers: Vec<_> = self.names.iter().map(|name| scope.spawn(move || read(name))).collect();
            readers.into_iter().map(|reader| reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        })
    }

    /// Images spread over the recording, to learn colours from: at most `count` frames, or the first that has any.
    ///
    /// # Errors
    /// As [`Self::images`], and where no frame has one.
    pub fn sample(&self, count: usize) -> Result<Vec<RgbImage>> {
        let step = self.frames.len().div_ceil(count.max(1)).max(1);
        let mut all = Vec::new();
        for frame in self.frames.iter().step_by(step) {
            all.extend(self.images(frame)?.into_iter().filter_map(|(image, _)| image));
        }
        let mut frames = self.frames.iter();
        while all.is_empty() {
            let Some(frame) = frames.next() else {
                let what = "no image of any frame can be used";
                return Err(Error::content(&self.folder, "images", what, "look at them: are they cut off, or black?"));
            };
            all.extend(self.images(frame)?.into_iter().filter_map(|(image, _)| image));
        }
        Ok(all)
    }
}
