//! What the C handles hold.
//!
//! This module contains `unsafe`: the state on loan is written by C through a pointer.

use crate::Code;
use ravenpose_transport::{Bell, Loan, Probe, Reader, Settings, TransportError, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How often `wait` looks.
const LOOK_NS: i64 = 50_000;
/// Silence after which `wait` checks that its reader is still where a newcomer would find it.
const SILENCE_NS: i64 = 500_000_000;

/// No panic crosses into C.
pub(crate) fn guarded<R>(call: impl FnOnce() -> R) -> Result<R, Code> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|_| Code::Internal)
}

fn refused(error: &TransportError) -> (Code, String) {
    (Code::of(error), error.to_string())
}

/// The one publisher of states.
pub struct Publisher {
    /// Dropped before the port.
    loan: Option<Loan<RavenState>>,
    writer: Writer<RavenState>,
    bell: Bell,
    source_id: u64,
    next_sequence: u64,
    /// The number that the state on loan was given.
    lent: u64,
}

impl Publisher {
    pub(crate) fn open(settings: &Settings) -> Result<Self, (Code, String)> {
        let writer = Writer::open(settings).map_err(|error| refused(&error))?;
        let bell = Bell::open(settings).map_err(|error| refused(&error))?;
        writer.prepare();
        Ok(Self { loan: None, writer, bell, source_id: source_id(), next_sequence: 1, lent: 0 })
    }

    pub(crate) fn loan(&mut self) -> Result<*mut RavenState, Code> {
        if let Some(loan) = &mut self.loan {
            return Ok(loan.as_mut_ptr());
        }
        let mut loan = self.writer.loan().map_err(|error| Code::of(&error))?;
        let place = loan.as_mut_ptr();
        let mut state = RavenState::new();
        state.source_id = self.source_id;
        state.sequence = self.next_sequence;
        self.lent = self.next_sequence;
        // SAFETY: `place` is the loaned message, aligned and large enough, and nobody else sees it yet.
        unsafe { place.write(state) };
        self.loan = Some(loan);
        Ok(place)
    }

    pub(crate) fn send(&mut self) -> Code {
        let Some(mut loan) = self.loan.take() else { return Code::Loan };
        // SAFETY: `loan` wrote a whole state there; C may have changed its numbers, and any bits are valid in them.
        let state = unsafe { &mut *loan.as_mut_ptr() };
        if state.sequence == self.lent {
            // Not set by the caller: others may have been published meanwhile, and a number that falls is a new source.
            state.sequence = 0;
        }
        self.complete(state);
        // SAFETY: initialised, see above.
        let sent = unsafe { loan.send_written() };
        self.rung(sent)
    }

    pub(crate) fn publish(&mut self, state: &RavenState) -> Code {
        let mut state = *state;
        self.complete(&mut state);
        // A state on loan stays on loan.
        let sent = self.writer.loan().and_then(|loan| loan.send(&state));
        self.rung(sent)
    }

    fn complete(&mut self, state: &mut RavenState) {
        state.version = ravenpose_wire::STATE_VERSION;
        state.size = size_of::<RavenState>() as u32;
        state.source_id = self.source_id;
        if state.source_time_ns == 0 {
            state.source_time_ns = now_ns();
        }
        state.arms = state.connected();
        let sequence = if state.sequence == 0 { self.next_sequence } else { state.sequence };
        state.seal(sequence);
        self.next_sequence = sequence.wrapping_add(1);
    }

    fn rung(&self, sent: Result<usize, TransportError>) -> Code {
        match sent {
            Ok(_) => {
                // Costs a system call only while a service with wait = "event" listens.
                self.bell.ring();
                // The service has the state and works on it: what the next one needs is paid for now.
                self.writer.prepare();
                // Counted once, when the connection is tried: the others have the state.
                if self.writer.take_left_out() > 0 { Code::Send } else { Code::Ok }
            }
            Err(error) => Code::of(&error),
        }
    }

    pub(crate) fn readers(&self) -> u32 {
        self.writer.readers() as u32
    }
}

/// A number that no other run of a control process on this machine has: not zero.
fn source_id() -> u64 {
    use std::hash::{BuildHasher, RandomState};
    // The standard library's only source of randomness, seeded by the system.
    RandomState::new().hash_one((std::process::id(), now_ns())) | 1
}

/// A reader of poses.
pub struct PoseReader {
    reader: Reader<CorrectedPose>,
    settings: Settings,
    depth: usize,
    probe: Option<Probe>,
    /// When a pose last came, or the reader was last checked.
    heard_ns: i64,
}

impl PoseReader {
    pub(crate) fn open(settings: &Settings, depth: usize) -> Result<Self, (Code, String)> {
        let reader = Reader::open(settings, depth).map_err(|error| refused(&error))?;
        Ok(Self { reader, settings: settings.clone(), depth, probe: None, heard_ns: now_ns() })
    }

    pub(crate) fn latest(&mut self) -> Result<Option<CorrectedPose>, Code> {
        checked(self.reader.latest())
    }

    pub(crate) fn next(&mut self) -> Result<Option<CorrectedPose>, Code> {
        checked(self.reader.next())
    }

    pub(crate) fn wait(&mut self, timeout_ns: i64) -> Result<Option<CorrectedPose>, Code> {
        let start = now_ns();
        let deadline = start.saturating_add(timeout_ns.max(0));
        loop {
            let pose = self.latest()?;
            let now = now_ns();
            if pose.is_some() {
                self.heard_ns = now;
                return Ok(pose);
            }
            if now >= deadline {
                return Ok(None);
            }
            if now.saturating_sub(self.heard_ns) >= SILENCE_NS {
                self.heard_ns = now;
                self.reconnect();
            }
            sleep_until_ns((now + LOOK_NS).min(deadline));
        }
    }

    /// After the shared files were removed under us a new service runs beside the one that we listen to: go there.
    fn reconnect(&mut self) {
        if self.probe.is_none() {
            self.probe = Probe::open(&self.settings).ok();
        }
        let lost = self.probe.as_ref().is_some_and(|probe| {
            let found = probe.count::<CorrectedPose>();
            found.is_ok_and(|(publishers, readers)| readers == 0 || (publishers > 0 && self.reader.publishers() == 0))
        });
        if lost && let Ok(reader) = Reader::open(&self.settings, self.depth) {
            self.reader = reader;
            self.probe = None;
        }
    }
}

fn checked(taken: Result<Option<CorrectedPose>, TransportError>) -> Result<Option<CorrectedPose>, Code> {
    match taken {
        Ok(Some(pose)) if pose.admit().is_err() => Err(Code::Torn),
        Ok(pose) => Ok(pose),
        Err(error) => Err(Code::of(&error)),
    }
}
