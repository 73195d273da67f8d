//! Frames of a scene out of several videos: at each moment of a common grid, the nearest image of each camera.

use super::{Shot, Source};
use crate::error::{Error, Result};
use crate::rig::Rig;
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;

/// Images that may wait between a camera and the disk; more are waited for, or lost by the camera itself.
const WAITING: usize = 64;

/// What was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Frames.
    pub frames: usize,
    /// Images per camera, in the order of the rig.
    pub images: Vec<usize>,
    /// Images per camera that could not be decoded and are left out.
    pub damaged: Vec<usize>,
    /// Cameras that ended before another, by their place in the rig: when, s after the first frame, and what they said.
    pub ended: Vec<(usize, f64, Option<String>)>,
}

/// A source that goes on for so long after another has ended, s, is no longer of one length with it.
const LONGER_S: f64 = 1.0;

/// Writes `rig.toml`, `frames.csv` and `frames/NAME/` of a new scene folder from a source per camera of the rig (`None`: no images
/// of this camera). It ends with the first video that does, with the last of webcams and of recordings, or after `seconds`. `progress` is told frames done and in all, 0 if
/// nobody knows.
///
/// # Errors
/// If the folder holds something, a source breaks, an image has another size than the rig says, or nothing was recorded.
pub fn record(
    rig: &Rig,
    sources: Vec<Option<Box<dyn Source>>>,
    frames_per_s: f64,
    seconds: Option<f64>,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Recorded> {
    if out.is_file() || std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(Error::content(out, "folder", "is not empty", "give a new folder"));
    }
    if out.file_name().is_none() {
        return Err(Error::content(out, "folder", "has no name of its own to be renamed to", "give a new folder by its name"));
    }
    if !(0.01..=1000.0).contains(&frames_per_s) || seconds.is_some_and(|s| !(s > 0.0 && s < 1e6)) {
        let what = format!("{frames_per_s} frames/s for {seconds:?} s");
        return Err(Error::content(out, "rate", what, "give 0.01 to 1000 frames/s and a positive length"));
    }
    let aside = out.with_extension(format!("part{}", std::process::id()));
    let made = all(rig, sources, frames_per_s, seconds, &aside, progress)
        .and_then(|recorded| std::fs::rename(&aside, out).map_err(Error::write(out)).map(|()| recorded));
    if made.is_err() {
        // What is left of it is of no use to anybody.
        drop(std::fs::remove_dir_all(&aside));
    }
    made
}

fn all(
    rig: &Rig,
    sources: Vec<Option<Box<dyn Source>>>,
    frames_per_s: f64,
    seconds: Option<f64>,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Recorded> {
    // Of a recording, or while it is made, a camera may fail long before the others; videos that somebody chose end together.
    let until_last = sources.iter().flatten().all(|source| source.since_1970());
    let since_1970 = sources.iter().flatten().any(|source| source.since_1970());
    let mut tracks: Vec<Option<Track>> = sources.into_iter().map(|source| source.map(Track::start)).collect();
    for (camera, _) in rig.cameras.iter().zip(&tracks).filter(|(_, track)| track.is_some()) {
        let folder = out.join("frames").join(&camera.name);
        std::fs::create_dir_all(&folder).map_err(Error::write(&folder))?;
    }
    // From when all of them have something to show.
    let mut from_s = 0.0_f64;
    for track in tracks.iter_mut().flatten() {
        from_s = from_s.max(track.fetch()?.unwrap_or(0.0));
    }
    let step_s = 1.0 / frames_per_s;
    let most = seconds.map_or(0, |seconds| (seconds * frames_per_s).round().max(1.0) as usize);
    let mut list = String::new();
    if since_1970 {
        let _ = writeln!(list, "# start_unix_s = {from_s:.6}");
    }
    list.push_str("frame,t_s\n");
    let (mut images, mut damaged) = (vec![0; tracks.len()], vec![0; tracks.len()]);
    let mut frames = 0;
    while most == 0 || frames < most {
        let t_s = from_s + frames as f64 * step_s;
        let mut over = until_last;
        for (index, track) in tracks.iter_mut().enumerate() {
            let Some(track) = track else { continue };
            let (shot, ended) = track.nearest(t_s, 0.5 * step_s)?;
            over = if until_last { over && ended } else { over || ended };
            let Some(shot) = shot else { continue };
            let name = &rig.cameras[index].name;
            let file = out.join("frames").join(name).join(format!("{frames:06}.jpg"));
            // A camera that fell out while it wrote must not cost the other images.
            if let Some(damage) = damage(&shot.jpeg, rig, name)? {
                if images[index] == 0 {
                    return Err(Error::content(&rig.file, name, damage, "record it anew"));
                }
                damaged[index] += 1;
                continue;
            }
            std::fs::write(&file, &shot.jpeg).map_err(Error::write(&file))?;
            images[index] += 1;
        }
        if over {
            break;
        }
        let _ = writeln!(list, "{frames},{:.6}", t_s - if since_1970 { from_s } else { 0.0 });
        frames += 1;
        progress(frames, most);
    }
    if frames == 0 {
        return Err(Error::content(out, "frames", "the videos hold no common time", "give videos that begin together"));
    }
    // Images of a frame that one camera no longer has are of no frame.
    for (index, camera) in rig.cameras.iter().enumerate() {
        let file = out.join("frames").join(&camera.name).join(format!("{frames:06}.jpg"));
        images[index] -= usize::from(std::fs::remove_file(file).is_ok());
    }
    let ended = ended(tracks, from_s, from_s + frames as f64 * step_s)?;
    let rig_file = out.join("rig.toml");
    std::fs::copy(&rig.file, &rig_file).map_err(Error::write(&rig_file))?;
    let times = out.join("frames.csv");
    std::fs::write(&times, list).map_err(Error::write(&times))?;
    Ok(Recorded { frames, images, damaged, ended })
}

/// Which cameras ended before another that went on for longer, and what they said.
fn ended(tracks: Vec<Option<Track>>, from_s: f64, until_s: f64) -> Result<Vec<(usize, f64, Option<String>)>> {
    let mut tracks: Vec<(usize, Track)> =
        tracks.into_iter().enumerate().filter_map(|(index, track)| Some((index, track?))).collect();
    for (_, track) in &mut tracks {
        while !track.live && track.last_s < until_s + LONGER_S && track.fetch()?.is_some() {
            track.take();
        }
    }
    let longest_s = tracks.iter().map(|(_, track)| track.last_s).fold(f64::NEG_INFINITY, f64::max);
    let early = tracks.into_iter().filter(|(_, track)| track.over && track.last_s + LONGER_S <= longest_s);
    Ok(early.map(|(index, track)| (index, track.last_s - from_s, track.thread.join().ok().flatten())).collect())
}

/// What is wrong with an image that cannot be read. One of another size makes all that follows wrong, and is an error.
fn damage(jpeg: &[u8], rig: &Rig, camera: &str) -> Result<Option<String>> {
    let reader = image::ImageReader::with_format(Cursor::new(jpeg), image::ImageFormat::Jpeg);
    let [w, h] = rig.size_px;
    match reader.into_dimensions() {
        Ok(size) if size == (w, h) => Ok(None),
        Ok((a, b)) => {
            let what = format!("its video has {a} x {b} px");
            Err(Error::content(&rig.file, camera, what, format!("the rig says {w} x {h}: record in the size that was calibrated")))
        }
        Err(error) => Ok(Some(format!("an image of its video is no JPEG: {error}").replace('\n', " "))),
    }
}

/// A source that is read ahead in a thread of its own: live ones do not wait.
struct Track {
    shots: Receiver<Result<Shot>>,
    held: Option<Shot>,
    ahead: Option<Shot>,
    over: bool,
    live: bool,
    /// When its last image was taken, of those that were looked at.
    last_s: f64,
    /// Ends with what the source said at its end.
    thread: JoinHandle<Option<String>>,
}

impl Track {
    fn start(mut source: Box<dyn Source>) -> Self {
        let (sender, shots) = sync_channel(WAITING);
        let live = source.live();
        let thread = std::thread::spawn(move || {
            while let Some(shot) = source.next().transpose() {
                let fault = shot.is_err();
                // Nobody listens any more: the recording is over.
                if sender.send(shot).is_err() || fault {
                    return None;
                }
            }
            source.last_words()
        });
        Self { shots, held: None, ahead: None, over: false, live, last_s: f64::NEG_INFINITY, thread }
    }

    /// When the next image was taken; it is fetched and not taken.
    fn fetch(&mut self) -> Result<Option<f64>> {
        if self.ahead.is_none() && !self.over {
            self.ahead = self.shots.recv().ok().transpose()?;
            self.over = self.ahead.is_none();
        }
        Ok(self.ahead.as_ref().map(|shot| shot.t_s))
    }

    /// Takes the image that was fetched.
    fn take(&mut self) -> Option<Shot> {
        let shot = self.ahead.take()?;
        self.last_s = shot.t_s;
        Some(shot)
    }

    /// The image nearest to a time, if it is within a tolerance and was not the nearest before; and whether the source has ended
    /// before that time.
    fn nearest(&mut self, t_s: f64, tolerance_s: f64) -> Result<(Option<Shot>, bool)> {
        while let Some(next_s) = self.fetch()? {
            let nearer = self.held.as_ref().is_none_or(|held| (next_s - t_s).abs() <= (held.t_s - t_s).abs());
            if !nearer {
                break;
            }
            self.held = self.take();
        }
        let shot = self.held.take_if(|held| (held.t_s - t_s).abs() <= tolerance_s);
        let ended = self.over && shot.is_none() && self.held.as_ref().is_none_or(|held| held.t_s < t_s);
        Ok((shot, ended))
    }
}
