//! Webcams beside the robot: a thread for each, whose images go to the recorder's file with times on its clock.

use crate::clock::Clock;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
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
    /// Program that reads webcams which send no Motion JPEG; their images are stamped when they come
    #[arg(long)]
    ffmpeg: Option<PathBuf>,
}

/// An image on its way to the disk.
pub(crate) struct Image {
    /// Which camera, in the order asked for.
    pub camera: usize,
    /// Since 1970, ns.
    pub time_ns: u64,
    /// Counts those of its camera from 1.
    pub number: u32,
    pub jpeg: Vec<u8>,
}

/// What became of a camera so far.
#[derive(Default, Clone)]
pub(crate) struct Outcome {
    pub images: u32,
    /// Those that came while too many waited for the disk.
    pub missed: u32,
    /// Longest time without an image, from the beginning of the recording to its end, ns.
    pub longest_gap_ns: u64,
    /// Why it ended before the recording did.
    pub fault: Option<String>,
    last_ns: u64,
}

impl Outcome {
    fn nothing_until(&mut self, time_ns: u64) {
        self.longest_gap_ns = self.longest_gap_ns.max(time_ns.saturating_sub(self.last_ns));
        self.last_ns = time_ns;
    }
}

/// A camera that is open.
pub(crate) struct Webcam {
    pub name: String,
    outcome: Arc<Mutex<Outcome>>,
}

/// Whoever holds the lock only counts: what a thread that died left behind is whole.
fn locked(outcome: &Mutex<Outcome>) -> MutexGuard<'_, Outcome> {
    outcome.lock().unwrap_or_else(PoisonError::into_inner)
}

/// All webcams of a recording, running.
pub(crate) struct Webcams {
    pub all: Vec<Webcam>,
    clock: Clock,
    begin: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
}

impl Webcams {
    /// Opens them all, and where their images come from when [`Webcams::begin`] is called; those for which there is no room are counted.
    pub(crate) fn open(wish: &Wish, clock: Clock) -> Result<(Self, Receiver<Image>), String> {
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
        let (begin, stop) = (Arc::default(), Arc::default());
        let (images, arrived) = sync_channel(WAITING_MAX);
        // All at once: cameras take a second each to begin.
        let opening: Vec<_> = named
            .into_iter()
            .enumerate()
            .map(|(camera, (name, path))| {
                let (opened, is_open) = sync_channel(1);
                let outcome = Arc::default();
                let (ffmpeg, frames_per_s) = (wish.ffmpeg.clone(), wish.frames_per_s);
                let thread = Thread {
                    camera,
                    name: name.clone(),
                    clock,
                    begin: Arc::clone(&begin),
                    stop: Arc::clone(&stop),
                    images: images.clone(),
                    outcome: Arc::clone(&outcome),
                };
                // On its own: a camera that hangs holds nobody up.
                std::thread::spawn(move || thread.run(&path, ffmpeg.as_deref(), size_px, frames_per_s, &opened));
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
        Ok((Self { all, clock, begin, stop }, arrived))
    }

    /// From now on images are handed over.
    pub(crate) fn begin(&self) {
        let now_ns = self.clock.stamp(ravenpose_transport::now_ns());
        for webcam in &self.all {
            locked(&webcam.outcome).last_ns = now_ns;
        }
        self.begin.store(true, Ordering::Relaxed);
    }

    /// Tells them to end, and what became of each until now, by name. One that hangs is not waited for.
    pub(crate) fn stop(&self) -> Vec<(String, Outcome)> {
        self.stop.store(true, Ordering::Relaxed);
        let now_ns = self.clock.stamp(ravenpose_transport::now_ns());
        let one = |webcam: &Webcam| {
            let mut outcome = locked(&webcam.outcome);
            outcome.nothing_until(now_ns);
            (webcam.name.clone(), outcome.clone())
        };
        self.all.iter().map(one).collect()
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
    name: String,
    clock: Clock,
    begin: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    images: SyncSender<Image>,
    outcome: Arc<Mutex<Outcome>>,
}

impl Thread {
    fn run(
        &self,
        path: &Path,
        ffmpeg: Option<&Path>,
        size_px: [u32; 2],
        frames_per_s: f64,
        opened: &SyncSender<Result<(), String>>,
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
        let Some(fault) = source.and_then(|source| self.watch(source)) else { return };
        complain!("camera {}: {fault}; the recording goes on without it", self.name);
        locked(&self.outcome).fault = Some(fault);
    }

    /// Hands images over until it is told to stop; why it ended before, if it did.
    fn watch(&self, mut source: Box<dyn video::Source>) -> Option<String> {
        loop {
            let next = source.next();
            let came_ns = ravenpose_transport::now_ns();
            // Held until the image is handed over: what is counted at the end is with the writer by then.
            let mut outcome = locked(&self.outcome);
            if self.stop.load(Ordering::Relaxed) {
                return None;
            }
            let shot = match next {
                Ok(Some(shot)) => shot,
                Ok(None) => return Some(source.last_words().unwrap_or_else(|| "it ended by itself".to_owned())),
                Err(error) => return Some(error.to_string()),
            };
            if !self.begin.load(Ordering::Relaxed) {
                continue;
            }
            let time_ns = self.clock.stamp(shot.taken_ns.unwrap_or(came_ns));
            outcome.nothing_until(time_ns);
            let image = Image { camera: self.camera, time_ns, number: outcome.images + 1, jpeg: shot.jpeg };
            match self.images.try_send(image) {
                Err(TrySendError::Full(_)) => outcome.missed += 1,
                // A writer that is gone has failed, and says so itself.
                Ok(()) | Err(TrySendError::Disconnected(_)) => outcome.images += 1,
            }
        }
    }
}
