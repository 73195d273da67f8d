//! The thread that touches the disk and the log, and nothing else does once the service runs: a disk or a pipe that hangs holds up
//! neither the loop nor the watchdog.

use crate::histogram::Histograms;
use crate::report::{self, Log};
use crate::say;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What may wait for the disk; what does not fit is offered again a second later.
const WAITING: usize = 32;

/// Something to write.
enum Job {
    Stats(Vec<u8>),
    Log { interval: Box<Histograms>, total: Box<Histograms>, length: Duration },
    Line(String),
}

/// The near end: never blocks.
pub struct Writer {
    jobs: Option<SyncSender<Job>>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system's, when there can be no further thread.
    pub fn start(stats_path: PathBuf, log: Option<Log>) -> io::Result<Self> {
        let (jobs, waiting) = sync_channel(WAITING);
        let thread = std::thread::Builder::new()
            .name("ravenpose-writer".to_owned())
            .spawn(move || write_all(&waiting, &stats_path, log.as_ref()))?;
        Ok(Self { jobs: Some(jobs), thread: Some(thread) })
    }

    /// Offers statistics; what the disk is too slow for is dropped, newer ones come each second.
    pub fn stats(&self, bytes: Vec<u8>) {
        let _ = self.offer(Job::Stats(bytes));
    }

    /// Offers an interval; `false` if the disk is too slow now: keep it and offer it again.
    pub fn log(&self, interval: &Histograms, total: &Histograms, length: Duration) -> bool {
        self.offer(Job::Log { interval: Box::new(interval.clone()), total: Box::new(total.clone()), length })
    }

    /// Offers a line for the log; a log that hangs holds nobody up, and what does not fit is dropped.
    pub fn line(&self, text: String) {
        let _ = self.offer(Job::Line(text));
    }

    fn offer(&self, job: Job) -> bool {
        self.jobs
            .as_ref()
            .is_some_and(|jobs| !matches!(jobs.try_send(job), Err(TrySendError::Full(_) | TrySendError::Disconnected(_))))
    }

    /// Waits until everything offered is written, at most `patience`; returns whether it was.
    pub fn finish(mut self, patience: Duration) -> bool {
        self.jobs = None;
        let Some(thread) = self.thread.take() else { return false };
        ends_within(&thread, patience) && thread.join().is_ok()
    }
}

/// Does a thread end by itself in this time?
pub(crate) fn ends_within<T>(thread: &JoinHandle<T>, patience: Duration) -> bool {
    let asked = Instant::now();
    while !thread.is_finished() && asked.elapsed() < patience {
        std::thread::sleep(Duration::from_millis(1));
    }
    thread.is_finished()
}

fn write_all(jobs: &Receiver<Job>, stats_path: &Path, log: Option<&Log>) {
    let mut complained = [false; 3];
    // What could not be written goes out with the next interval.
    let mut unwritten: Option<(Histograms, Duration)> = None;
    for job in jobs {
        match job {
            Job::Stats(bytes) => complain_once(&mut complained[0], "statistics", report::write_whole(stats_path, &bytes)),
            Job::Log { interval, total, length } => {
                let Some(log) = log else { continue };
                let (mut whole, mut long) = unwritten.take().unwrap_or_else(|| (Histograms::new(), Duration::ZERO));
                whole.add(&interval);
                long += length;
                let appended = log.append(&whole, long);
                if appended.is_err() {
                    unwritten = Some((whole, long));
                }
                complain_once(&mut complained[1], "the histogram log", appended);
                complain_once(&mut complained[2], "histograms", log.summarise(&total));
            }
            Job::Line(text) => say(&text),
        }
    }
}

fn complain_once(complained: &mut bool, what: &str, written: io::Result<()>) {
    match written {
        Ok(()) => *complained = false,
        Err(cause) if !*complained => {
            *complained = true;
            say(&format!("{what} cannot be written ({cause}); the loop goes on, and it is tried again"));
        }
        Err(_) => {}
    }
}
