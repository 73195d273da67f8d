//! Video in: files and live webcams, as JPEG images with times ([`record`] makes a scene's frames of them).
//!
//! AVI files of Motion JPEG and webcams that send it are read here; everything else through the program `ffmpeg`, which hands over the
//! same kind of AVI on a pipe.

pub mod avi;
mod ffmpeg;
pub mod record;
mod v4l2;

use crate::error::{Error, Result};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// An image of a video.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// When it was taken: since the beginning of a file, or on the clock that all live sources of a recording share.
    pub t_s: f64,
    /// The kernel's stamp of a webcam's image, `CLOCK_MONOTONIC`, ns: the moment in which the camera began it.
    pub taken_ns: Option<i64>,
    /// A JPEG file's content.
    pub jpeg: Vec<u8>,
}

/// Images in the order of their times.
pub trait Source: Send {
    /// The next image; `None` at the end.
    ///
    /// # Errors
    /// If the source breaks off in the wrong place.
    fn next(&mut self) -> Result<Option<Shot>>;

    /// Does it go on by itself, whether anybody reads or not?
    fn live(&self) -> bool {
        false
    }

    /// What it said before it came to an end, if anything. It is over then.
    fn last_words(&mut self) -> Option<String> {
        None
    }

    /// Are its times since 1970, by a clock that other sources share? Those of live ones are.
    fn since_1970(&self) -> bool {
        self.live()
    }
}

/// Opens a video file or, under `/dev/`, a webcam, which is asked for images of a size and rate. `ffmpeg` is the program for files other
/// than AVI of Motion JPEG, `ffmpeg` by itself if none is given; webcams are read through it only if one is given.
///
/// # Errors
/// If it is absent, no video, or the program is needed and not there.
pub fn open(path: &Path, ffmpeg: Option<&Path>, size_px: [u32; 2], frames_per_s: f64) -> Result<Box<dyn Source>> {
    let there = |what, remedy| if path.exists() { Ok(()) } else { Err(Error::content(path, "video", what, remedy)) };
    if path.starts_with("/dev") {
        let Some(program) = ffmpeg else { return v4l2::webcam(path, size_px, frames_per_s) };
        there("no such device", "plug the camera in, ls /dev/video* shows those there are")?;
        return ffmpeg::webcam(path, program, size_px, frames_per_s);
    }
    there("no such file", "check the path")?;
    let file = File::open(path).map_err(Error::read(path))?;
    match avi::Avi::open(path, BufReader::new(file)) {
        Ok(avi) if avi.is_motion_jpeg() => Ok(Box::new(avi)),
        _ => ffmpeg::file(path, ffmpeg.unwrap_or(Path::new("ffmpeg"))),
    }
}
