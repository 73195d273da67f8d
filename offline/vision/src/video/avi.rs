//! AVI files of Motion JPEG (Microsoft, "AVI RIFF File Reference"), read from front to back: pipes have no other way.

use super::{Shot, Source};
use crate::error::{Error, Result};
use std::io::Read;
use std::path::{Path, PathBuf};

/// No image of a webcam is larger.
const LARGEST: u32 = 64 << 20;

/// A file or pipe whose head has been read.
pub struct Avi<R> {
    path: PathBuf,
    reader: R,
    /// Number of the video among the streams, and the code of its format.
    stream: usize,
    code: [u8; 4],
    frame_s: f64,
    index: u64,
}

impl<R: Read> Avi<R> {
    /// Reads the head, up to where images begin.
    ///
    /// # Errors
    /// If it is no AVI file, or holds no video.
    pub fn open(path: &Path, mut reader: R) -> Result<Self> {
        let bad = |what: &str| Error::content(path, "AVI", what, "give an AVI file of Motion JPEG, or install ffmpeg for others");
        let mut head = [0; 12];
        reader.read_exact(&mut head).map_err(|_| bad("is too short for a video"))?;
        if &head[..4] != b"RIFF" || &head[8..] != b"AVI " {
            return Err(bad("is no AVI file"));
        }
        let mut avi = Self { path: path.to_owned(), reader, stream: 0, code: [0; 4], frame_s: 0.0, index: 0 };
        let mut streams = 0;
        loop {
            let (id, size) = avi.chunk().ok_or_else(|| bad("ends within its head"))?;
            match &id {
                b"LIST" => {
                    let kind = avi.content(4).ok_or_else(|| bad("ends within its head"))?;
                    if kind == b"movi" {
                        break;
                    }
                    if kind != b"hdrl" && kind != b"strl" {
                        avi.skip(size.saturating_sub(4)).ok_or_else(|| bad("ends within its head"))?;
                    }
                }
                b"strh" if (32..1024).contains(&size) => {
                    let content = avi.content(size).ok_or_else(|| bad("ends within its head"))?;
                    if &content[..4] == b"vids" && avi.frame_s == 0.0 {
                        avi.stream = streams;
                        avi.code = [content[4], content[5], content[6], content[7]];
                        avi.frame_s = f64::from(number(&content[20..])) / f64::from(number(&content[24..]));
                    }
                    streams += 1;
                }
                _ => avi.skip(size).ok_or_else(|| bad("ends within its head"))?,
            }
        }
        if !(1e-4..=1e4).contains(&avi.frame_s) {
            return Err(bad("holds no video with a frame rate"));
        }
        Ok(avi)
    }

    /// Are its images JPEG?
    pub fn is_motion_jpeg(&self) -> bool {
        [*b"MJPG", *b"mjpg", *b"JPEG", *b"jpeg"].contains(&self.code)
    }

    /// Name and size of the next chunk; `None` at the end.
    fn chunk(&mut self) -> Option<([u8; 4], u32)> {
        let mut head = [0; 8];
        self.reader.read_exact(&mut head).ok()?;
        Some(([head[0], head[1], head[2], head[3]], number(&head[4..])))
    }

    fn content(&mut self, size: u32) -> Option<Vec<u8>> {
        let mut content = Vec::new();
        // Grows with what is there: a false size costs nothing.
        self.reader.by_ref().take(u64::from(size)).read_to_end(&mut content).ok()?;
        (content.len() == size as usize).then_some(())?;
        if size % 2 == 1 {
            // The last chunk of a file may lack its even end.
            drop(self.reader.read_exact(&mut [0]));
        }
        Some(content)
    }

    fn skip(&mut self, size: u32) -> Option<()> {
        let all = u64::from(size) + u64::from(size % 2);
        (std::io::copy(&mut self.reader.by_ref().take(all), &mut std::io::sink()).ok()? == all).then_some(())
    }
}

fn number(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

impl<R: Read + Send> Source for Avi<R> {
    fn next(&mut self) -> Result<Option<Shot>> {
        let own = format!("{:02}d", self.stream).into_bytes();
        loop {
            let Some((id, size)) = self.chunk() else { return Ok(None) };
            let read = if [*b"LIST", *b"RIFF"].contains(&id) {
                // Lists of images, and further parts of a long file: what they hold comes next.
                self.content(4).map(|_| ())
            } else if id[..3] == own[..] {
                if size > LARGEST {
                    let what = format!("image {} of {size} bytes", self.index);
                    return Err(Error::content(&self.path, "AVI", what, "the file is damaged: record it anew"));
                }
                let jpeg = self.content(size);
                let t_s = self.index as f64 * self.frame_s;
                self.index += 1;
                match jpeg {
                    // Nothing: the image before is shown once more, which is no measurement.
                    Some(jpeg) if jpeg.is_empty() => Some(()),
                    Some(jpeg) => return Ok(Some(Shot { t_s, taken_ns: None, jpeg })),
                    None => None,
                }
            } else {
                self.skip(size)
            };
            // A recording that was cut off ends with its last whole image.
            if read.is_none() {
                return Ok(None);
            }
        }
    }
}
