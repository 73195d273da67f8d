//! Looks at the link as a newcomer finds it, in a thread of its own: that reads and writes files, on a disk that may hang, and whoever
//! feeds the watchdog must not wait for one.

use crate::writer::ends_within;
use ravenpose_transport::{Probe, Settings, TransportError};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Between two looks.
const PAUSE: Duration = Duration::from_secs(1);
/// How long the last look may take when the service ends.
const CLOSE_MAX: Duration = Duration::from_millis(200);

/// What a newcomer finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sight {
    /// Publishers of states.
    pub publishers: usize,
    /// Readers of states.
    pub readers: usize,
    /// Publishers of poses.
    pub poses: usize,
}

/// The thread that looks.
pub struct Eye {
    sights: Receiver<Result<Sight, String>>,
    /// Dropped, it ends the thread.
    open: Sender<()>,
    thread: JoinHandle<()>,
}

impl Eye {
    /// Begins to look, once a second.
    ///
    /// # Errors
    /// One line, where shared memory or a thread cannot be had.
    pub fn open(settings: &Settings) -> Result<Self, String> {
        let probe = Probe::open(settings).map_err(|error| error.to_string())?;
        let (open, closed) = channel();
        // One waits; who does not take it gets the next one later.
        let (sender, sights) = sync_channel(1);
        let settings = settings.clone();
        let thread = std::thread::Builder::new()
            .name("ravenpose-eye".to_owned())
            .spawn(move || {
                let mut probe = probe;
                while closed.recv_timeout(PAUSE) == Err(RecvTimeoutError::Timeout) {
                    let sight = look(&probe);
                    if !matches!(sight, Ok(Sight { readers: 1.., poses: 1.., .. })) {
                        // The probe itself may hang on what was removed.
                        if let Ok(another) = Probe::open(&settings) {
                            probe = another;
                        }
                    }
                    drop(sender.try_send(sight.map_err(|error| error.to_string())));
                }
            })
            .map_err(|cause| format!("the thread that watches the link cannot be started: {cause}"))?;
        Ok(Self { sights, open, thread })
    }

    /// What it saw since the last call, if it has looked.
    pub fn sight(&self) -> Option<Result<Sight, String>> {
        self.sights.try_iter().last()
    }

    /// Ends it, so that it leaves no files; a look that hangs is left to hang.
    pub fn close(self) {
        drop(self.open);
        ends_within(&self.thread, CLOSE_MAX);
    }
}

fn look(probe: &Probe) -> Result<Sight, TransportError> {
    let (publishers, readers) = probe.count::<RavenState>()?;
    let (poses, _) = probe.count::<CorrectedPose>()?;
    Ok(Sight { publishers, readers, poses })
}
