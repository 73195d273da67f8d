//! Webcams beside the robot: a thread for each, whose images go to the recorder's file with times on its clock.

use super::record::Clock;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;
use vision::video;

/// Images that may wait for the disk, of all cameras: some 50 MB.
const WAITING_MAX: usize = 256;
/// A camera that has not begun by then is not there.
const PATIENCE: Duration = Duration::from_secs(20);

/// What a person asks of the webcams.
#[derive(Debug, clap::Args)]
pub(crate) struct Wish {
    /// NAME=/dev/videoN: record this webcam's images too; once for each
    #[arg(long = "camera", value_name = "NAME=DEVICE")]
    cameras: Vec<String>,
    /// Size of the images
    #[arg(long, default_value = "1280x720", value_name = "WxH")]
    image_size: String,
    /// Images per second
    #[arg(long, default_value_t = 15.0)]
    frames_per_s: f64,
    /// Program that reads webcams
    #[arg(long, default_value = "ffmpeg")]
    ffmpeg: PathBuf,
}

/// An image on its way to the disk; while it exists it counts as waiting.
pub(crate) struct Image {
    /// Which camera, in the order asked for.
    pub camera: usize,
    /// Since 1970, ns.
    pub time_ns: u64,
    /// Counts those of its camera from 1.
    pub number: u32,
    pub jpeg: Vec<u8>,
    pub waiting: Waiting,
}

/// One of those that wait.
pub(crate) struct Waiting(Arc<AtomicUsize>);

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What became of a camera.
#[derive(Default)]
pub(crate) struct Outcome {
    pub images: u32,
    /// Those that came while too many waited for the disk.
    pub missed: u32,
    /// Longest time between two images, or before the first, ns.
    pub longest_gap_ns: u64,
    /// Why it ended before the recording did.
    pub fault: Option<String>,
}

/// A camera that is open.
pub(crate) struct Webcam {
    pub name: String,
    outcome: Receiver<Outcome>,
}

/// All webcams of a recording, running.
pub(crate) struct Webcams {
    pub all: Vec<Webcam>,
    begin: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
}

impl Webcams {
    /// Opens them all; each hands its images to `send` from when [`Webcams::begin`] is called.
    pub(crate) fn open(wish: &Wish, clock: Clock, send: &(impl Fn(Image) + Clone + Send + 'static)) -> Result<Self, String> {
        let size_px = size(&wish.image_size)?;
        if !(wish.frames_per_s >= 0.1 && wish.frames_per_s <= 1000.0) {
            return Err(format!("--frames-per-s {}: must be from 0.1 to 1000", wish.frames_per_s));
        }
        let mut named: Vec<(String, PathBuf)> = Vec::new();
        for camera in &wish.cameras {
            let (name, path) =
                camera.split_once('=').ok_or_else(|| format!("--camera {camera}: is not NAME=DEVICE; write cam0=/dev/video0"))?;
            if name.is_empty() || !name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte)) {
                return Err(format!("--camera {camera}: a name has letters, digits, _ and - only; write cam0=/dev/video0"));
            }
            if named.iter().any(|(other, _)| other == name) {
                return Err(format!("--camera {camera}: {name} is there already; give each camera a name of its own"));
            }
            if !path.starts_with("/dev/") {
                return Err(format!(
                    "--camera {camera}: is no webcam; give /dev/videoN here, and video files to `ravenpose vision record`"
                ));
            }
            named.push((name.to_owned(), PathBuf::from(path)));
        }
        let (begin, stop, waiting) = (Arc::default(), Arc::default(), Arc::new(AtomicUsize::new(0)));
        // All at once: cameras take a second each to begin.
        let opening: Vec<_> = named
            .into_iter()
            .enumerate()
            .map(|(camera, (name, path))| {
                let (opened, is_open) = sync_channel(1);
                let (ended, outcome) = sync_channel(1);
                let (ffmpeg, frames_per_s) = (wish.ffmpeg.clone(), wish.frames_per_s);
                let thread =
                    Thread { camera, clock, begin: Arc::clone(&begin), stop: Arc::clone(&stop), waiting: Arc::clone(&waiting) };
                let send = send.clone();
                // On its own: a camera that hangs holds nobody up.
                std::thread::spawn(move || thread.run(&path, &ffmpeg, size_px, frames_per_s, &opened, &ended, &send));
                (name, is_open, outcome)
            })
            .collect();
        let mut all = Vec::new();
        for (name, is_open, outcome) in opening {
            match is_open.recv_timeout(PATIENCE) {
                Ok(Ok(())) => all.push(Webcam { name, outcome }),
                Ok(Err(fault)) => return Err(fault),
                Err(_) => {
                    return Err(format!("camera {name}: nothing came for {} s; unplug it and plug it in", PATIENCE.as_secs()));
                }
            }
        }
        Ok(Self { all, begin, stop })
    }

    /// From now on images are handed over.
    pub(crate) fn begin(&self) {
        self.begin.store(true, Ordering::Relaxed);
    }

    /// Tells them to end; [`Webcams::outcomes`] then waits for it. Images handed over so far are with the disk.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// What became of each, by name.
    pub(crate) fn outcomes(self) -> Vec<(String, Outcome)> {
        let hung = || Outcome { fault: Some("it hangs".to_owned()), ..Outcome::default() };
        let one = |webcam: Webcam| {
            let outcome = webcam.outcome.recv_timeout(Duration::from_secs(2)).unwrap_or_else(|_| hung());
            (webcam.name, outcome)
        };
        self.all.into_iter().map(one).collect()
    }
}

/// `1280x720`
fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parts
        .filter(|size| size.iter().all(|side| (1..=16_384).contains(side)))
        .ok_or_else(|| format!("--image-size {text}: must be WxH, as 1280x720"))
}

struct Thread {
    camera: usize,
    clock: Clock,
    begin: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    waiting: Arc<AtomicUsize>,
}

impl Thread {
    #[expect(clippy::too_many_arguments, reason = "the start of a thread")]
    fn run(
        &self,
        path: &Path,
        ffmpeg: &Path,
        size_px: [u32; 2],
        frames_per_s: f64,
        opened: &SyncSender<Result<(), String>>,
        ended: &SyncSender<Outcome>,
        send: &impl Fn(Image),
    ) {
        let source = video::open(path, ffmpeg, size_px, frames_per_s).map_err(|error| error.to_string());
        let (source, said) = match source {
            Ok(source) => (Some(source), Ok(())),
            Err(fault) => (None, Err(fault)),
        };
        // Nobody waits any more: another camera is not there.
        if opened.send(said).is_err() {
            return;
        }
        if let Some(source) = source {
            // As above: the recording may have ended without this one.
            drop(ended.send(self.watch(source, send)));
        }
    }

    fn watch(&self, mut source: Box<dyn video::Source>, send: &impl Fn(Image)) -> Outcome {
        let mut outcome = Outcome::default();
        let mut last_ns = None;
        loop {
            let next = source.next();
            let time_ns = self.clock.stamp(ravenpose_transport::now_ns());
            if self.stop.load(Ordering::Relaxed) {
                return outcome;
            }
            let shot = match next {
                Ok(Some(shot)) => shot,
                Ok(None) => {
                    outcome.fault = Some("it ended by itself".to_owned());
                    return outcome;
                }
                Err(error) => {
                    outcome.fault = Some(error.to_string());
                    return outcome;
                }
            };
            if !self.begin.load(Ordering::Relaxed) {
                continue;
            }
            outcome.longest_gap_ns = outcome.longest_gap_ns.max(time_ns.saturating_sub(*last_ns.get_or_insert(time_ns)));
            last_ns = Some(time_ns);
            if self.waiting.fetch_add(1, Ordering::Relaxed) >= WAITING_MAX {
                self.waiting.fetch_sub(1, Ordering::Relaxed);
                outcome.missed += 1;
                continue;
            }
            outcome.images += 1;
            let waiting = Waiting(Arc::clone(&self.waiting));
            send(Image { camera: self.camera, time_ns, number: outcome.images, jpeg: shot.jpeg, waiting });
        }
    }
}
