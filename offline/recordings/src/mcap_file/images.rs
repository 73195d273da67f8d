//! The images of one camera in an MCAP file, in the order of the file.

use std::path::Path;

use super::reader::McapSource;
use crate::ros::{COMPRESSED_IMAGE, camera_topic};
use crate::stream::{Damage, Source, StreamError};

/// An image and when it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StampedImage {
    /// Since 1970, on the clock of the file, ns.
    pub time_ns: i64,
    /// A JPEG file's content.
    pub jpeg: Vec<u8>,
}

/// A file being read for one camera's images. Memory: as [`McapSource`].
pub struct ImageSource {
    file: McapSource,
    camera: String,
    found: bool,
}

impl ImageSource {
    /// Opens a file for the images that `ravenpose record` writes of a camera of this name.
    ///
    /// # Errors
    /// As [`McapSource::open`].
    pub fn open(path: &Path, camera: &str) -> Result<Self, StreamError> {
        let mut file = McapSource::open(path)?;
        file.want_images(camera);
        Ok(Self { file, camera: camera.to_owned(), found: false })
    }

    /// Where the file is damaged, once its images have come to an end.
    pub fn damage(&self) -> Option<&Damage> {
        self.file.damage()
    }

    /// The next image; `None` at the end, or where damage begins.
    ///
    /// # Errors
    /// [`StreamError`] where the file cannot be read, or holds no image of this camera.
    pub fn next_image(&mut self) -> Result<Option<StampedImage>, StreamError> {
        let image = self.file.next_image()?;
        if image.is_none() && !self.found {
            let topics: Vec<String> = self
                .file
                .channels()
                .into_iter()
                .filter(|c| c.type_name == COMPRESSED_IMAGE.name && c.messages > 0)
                .map(|c| c.topic)
                .collect();
            let there = if topics.is_empty() { "no images".to_owned() } else { topics.join(", ") };
            return Err(StreamError {
                file: self.file.path().to_owned(),
                place: None,
                what: format!("holds no image on {}, but {there}", camera_topic(&self.camera)),
                remedy: "give the camera the name that it was recorded under".to_owned(),
            });
        }
        self.found = true;
        Ok(image.map(|(time_ns, jpeg)| StampedImage { time_ns, jpeg }))
    }
}
