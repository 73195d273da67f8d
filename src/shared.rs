//! What the loop and the ordinary thread share: a few atomics and a bounded ring of events. No lock anywhere.

use crate::cycle::Counters;
use heapless::spsc::{Consumer, Producer, Queue};
use ravenpose_wire::{ARMS, CorrectedPose};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// Events that fit into the ring; what comes while it is full is counted and dropped.
const EVENTS: usize = 256;
/// Names of the counters, in the order of [`Shared::counters`].
pub const COUNTER_NAMES: [&str; 15] = [
    "cycles",
    "accepted",
    "published",
    "lost",
    "skipped",
    "duplicates",
    "out_of_order",
    "refused",
    "sources",
    "late",
    "overruns",
    "receive_failures",
    "send_failures",
    "readers_left_out",
    "events_dropped",
];

/// Written by one side, read by the other.
#[derive(Debug, Default)]
pub struct Shared {
    /// Ordinary thread to loop: end.
    pub stop: AtomicBool,
    /// Ordinary thread to loop: leave and open the link anew.
    pub reopen: AtomicBool,
    /// Ordinary thread to loop: leave and open another reader of states.
    pub another_reader: AtomicBool,
    /// Moves once per turn of the loop, whether or not a state came.
    pub heartbeat: AtomicU64,
    /// Status (upper half) and flags (lower half) of each arm's last estimate.
    pub arms: [AtomicU64; ARMS],
    counters: [AtomicU64; COUNTER_NAMES.len()],
}

/// Failures of the link, counted by the loop beside the cycle's own counters.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinkCounters {
    /// A publisher's memory could not be mapped.
    pub receive_failures: u64,
    /// A pose could not be handed over.
    pub send_failures: u64,
    /// A reader could not be connected: it gets no pose.
    pub readers_left_out: u64,
    /// Events that found the ring full.
    pub events_dropped: u64,
}

impl Shared {
    /// Makes the loop's counters visible.
    pub fn show(&self, cycle: &Counters, link: &LinkCounters) {
        let values = [
            cycle.cycles,
            cycle.accepted,
            cycle.published,
            cycle.lost,
            cycle.skipped,
            cycle.duplicates,
            cycle.out_of_order,
            cycle.refused,
            cycle.sources,
            cycle.late,
            cycle.overruns,
            link.receive_failures,
            link.send_failures,
            link.readers_left_out,
            link.events_dropped,
        ];
        for (to, from) in self.counters.iter().zip(values) {
            to.store(from, Relaxed);
        }
    }

    /// The counters, in the order of [`COUNTER_NAMES`].
    pub fn counters(&self) -> [u64; COUNTER_NAMES.len()] {
        std::array::from_fn(|index| self.counters[index].load(Relaxed))
    }

    /// Makes the arms' status visible.
    pub fn show_arms(&self, pose: &CorrectedPose) {
        for (to, arm) in self.arms.iter().zip(&pose.arm) {
            to.store(u64::from(arm.status) << 32 | u64::from(arm.flags), Relaxed);
        }
    }

    /// Status and flags of an arm's last estimate.
    pub fn arm(&self, index: usize) -> (u32, u32) {
        let packed = self.arms[index].load(Relaxed);
        ((packed >> 32) as u32, packed as u32)
    }
}

/// Something worth a line in the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// An arm's status or reasons changed.
    Arm {
        /// 0 gold, 1 green.
        arm: usize,
        /// New status.
        status: u32,
        /// New flags.
        flags: u32,
        /// The state at which it happened.
        sequence: u64,
    },
    /// A control process appeared or was restarted.
    Source {
        /// Its id.
        id: u64,
        /// The state at which it happened.
        sequence: u64,
    },
    /// States were lost.
    Lost {
        /// All losses so far.
        total: u64,
        /// The state before which they are missing.
        sequence: u64,
    },
    /// Messages were refused.
    Refused {
        /// All refusals so far.
        total: u64,
    },
    /// An answer exceeded its budget.
    Late {
        /// How long it took, ns.
        took_ns: i64,
        /// The state that it answered.
        sequence: u64,
    },
    /// The link failed.
    Link {
        /// Failures to receive so far.
        receive: u64,
        /// Failures to send so far.
        send: u64,
        /// Failures to connect a reader so far.
        readers: u64,
    },
    /// The link was opened anew.
    Reopened,
}

impl Event {
    /// Events of one kind are reported together, at most one line per second.
    pub fn kind(&self) -> usize {
        match self {
            Self::Arm { arm, .. } => *arm,
            Self::Source { .. } => 2,
            Self::Lost { .. } => 3,
            Self::Refused { .. } => 4,
            Self::Late { .. } => 5,
            Self::Link { .. } => 6,
            Self::Reopened => 7,
        }
    }

    /// Number of kinds.
    pub const KINDS: usize = 8;
}

/// The loop's end of the event ring.
pub type EventSender = Producer<'static, Event>;
/// The ordinary thread's end of the event ring.
pub type EventReceiver = Consumer<'static, Event>;

/// A bounded event ring. It lives as long as the process.
pub fn events() -> (EventSender, EventReceiver) {
    Box::leak(Box::new(Queue::<Event, EVENTS>::new())).split()
}
