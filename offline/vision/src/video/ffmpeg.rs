//! Other videos, and webcams that send no Motion JPEG, through the program ffmpeg, as Motion JPEG on a pipe.

use super::avi::Avi;
use super::{Shot, Source};
use crate::error::{Error, Result};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};

/// Made of whatever comes, with all of its colours.
const JPEG: [&str; 6] = ["-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj444p"];

struct Piped {
    path: PathBuf,
    child: Child,
    words: Words,
    avi: Avi<BufReader<ChildStdout>>,
    live: bool,
    shots: u64,
}

/// A video file of any format.
pub(super) fn file(path: &Path, program: &Path) -> Result<Box<dyn Source>> {
    let name = path.display().to_string();
    let mut arguments = vec!["-i", &name, "-an"];
    arguments.extend(JPEG);
    start(path, program, &arguments, false)
}

/// A webcam that sends no Motion JPEG: JPEG is made of what it sends.
pub(super) fn webcam(path: &Path, program: &Path, [w, h]: [u32; 2], frames_per_s: f64) -> Result<Box<dyn Source>> {
    let (name, size, rate) = (path.display().to_string(), format!("{w}x{h}"), format!("{frames_per_s}"));
    let input = ["-f", "v4l2", "-video_size", &size, "-framerate", &rate, "-i", &name];
    let mut arguments = vec!["-fflags", "nobuffer"];
    arguments.extend(input);
    arguments.extend(JPEG);
    arguments.extend(["-flush_packets", "1"]);
    start(path, program, &arguments, true)
}

fn start(path: &Path, program: &Path, arguments: &[&str], live: bool) -> Result<Box<dyn Source>> {
    let mut command = Command::new(program);
    command.args(["-nostdin", "-v", "error"]).args(arguments).args(["-f", "avi", "-"]);
    let started = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = started.map_err(|error| {
        let what = format!("{} is needed for it and cannot be started: {error}", program.display());
        Error::content(path, "video", what, "install ffmpeg, or give an AVI file of Motion JPEG")
    })?;
    let Some(output) = child.stdout.take() else {
        return Err(Error::content(path, "video", "no pipe from ffmpeg", "try again"));
    };
    let mut words = Words::of(child.stderr.take());
    match Avi::open(path, BufReader::new(output)) {
        Ok(avi) => Ok(Box::new(Piped { path: path.to_owned(), child, words, avi, live, shots: 0 })),
        Err(_) => Err(fault(path, &mut child, &mut words)),
    }
}

/// What the program says, read all the time: a full pipe would stop it.
struct Words(Option<JoinHandle<String>>);

impl Words {
    fn of(stderr: Option<ChildStderr>) -> Self {
        let last_line = move |stderr: ChildStderr| {
            let mut last = String::new();
            for line in BufReader::new(stderr).split(b'\n').map_while(std::result::Result::ok) {
                let line = String::from_utf8_lossy(&line).trim().to_owned();
                last = if line.is_empty() { last } else { line };
            }
            last
        };
        Self(stderr.map(|stderr| std::thread::spawn(move || last_line(stderr))))
    }

    /// The last line. Ends the program, which may still run.
    fn last(&mut self, child: &mut Child) -> Option<String> {
        end(child);
        self.0.take()?.join().ok().filter(|line| !line.is_empty())
    }
}

/// A webcam goes on for ever, and a program that sends no video may too.
fn end(child: &mut Child) {
    drop(child.kill());
    drop(child.wait());
}

/// What the program said, in one line.
fn fault(path: &Path, child: &mut Child, words: &mut Words) -> Error {
    let said = words.last(child).unwrap_or_else(|| "nothing came".to_owned());
    Error::content(path, "ffmpeg", said, "check that it is a video, or a camera that nobody else uses")
}

impl Source for Piped {
    fn next(&mut self) -> Result<Option<Shot>> {
        match self.avi.next()? {
            Some(mut shot) => {
                self.shots += 1;
                if self.live {
                    // When it came: webcams send an image as soon as it is read out.
                    shot.t_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
                }
                Ok(Some(shot))
            }
            None if self.shots == 0 => Err(fault(&self.path, &mut self.child, &mut self.words)),
            None => Ok(None),
        }
    }

    fn live(&self) -> bool {
        self.live
    }

    fn last_words(&mut self) -> Option<String> {
        self.words.last(&mut self.child)
    }
}

impl Drop for Piped {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}
