//! Publisher and reader of one message type.
//!
//! This module contains `unsafe`: handing over a message that C has written in place.

use crate::{Settings, TransportError, now_ns, room};
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::port::{DegradationAction, DegradationCause};
use iceoryx2::prelude::{BackpressureStrategy, ServiceName, SignalHandlingMode, ZeroCopySend, ipc};
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use ravenpose_wire::{CorrectedPose, POSE_SERVICE, RavenState, STATE_SERVICE};
use std::cell::Cell;
use std::fmt::Debug;
use std::mem::MaybeUninit;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// A message with its service.
pub trait Message: ZeroCopySend + Copy + Debug + 'static {
    /// Name of the service.
    const SERVICE: &'static str;
    /// Name of the payload type.
    const TYPE: &'static str;
    /// Readers that may be alive at once.
    const MAX_READERS: usize;
}

impl Message for RavenState {
    const SERVICE: &'static str = STATE_SERVICE;
    const TYPE: &'static str = "RavenState.v1";
    const MAX_READERS: usize = 16;
}

impl Message for CorrectedPose {
    const SERVICE: &'static str = POSE_SERVICE;
    const TYPE: &'static str = "CorrectedPose.v1";
    const MAX_READERS: usize = 128;
}

/// Deepest queue that a reader may ask for: 256 ms of messages at 1 kHz, so that a recorder loses none on a machine that stops for as
/// long. The publisher has room for all of its readers' queues: 4 MB of states, 23 MB of poses.
pub const DEPTH_MAX: usize = 256;
/// Messages that a reader may hold.
const BORROWED_MAX: usize = 2;
/// Messages that a late reader gets.
const HISTORY: usize = 1;
/// Messages that a writer may hold.
const LOANED_MAX: usize = 2;

/// More than a service, its events, and the queues between its ports take in shared memory beside the messages: a quarter of a MiB, and for
/// each reader of as many as may come.
const ROOM_OF_SERVICE: u64 = 256 << 10;
const ROOM_OF_QUEUE: u64 = 64 << 10;

/// More than the messages of a writer take in shared memory: each has a head.
const fn room_of_messages<T: Message>() -> u64 {
    const HEAD: usize = 96;
    ((T::MAX_READERS * (DEPTH_MAX + BORROWED_MAX) + HISTORY + LOANED_MAX) * (size_of::<T>() + HEAD)) as u64
}

/// Shared memory that all parties together take at most, bytes.
pub const ROOM: u64 = ROOM_OF_SERVICE + room_of_writer::<RavenState>() + room_of_writer::<CorrectedPose>();

/// What a writer takes, with the queues of all readers that may come.
const fn room_of_writer<T: Message>() -> u64 {
    ROOM_OF_SERVICE + room_of_messages::<T>() + T::MAX_READERS as u64 * ROOM_OF_QUEUE
}

type Factory<T> = PortFactory<ipc::Service, T, ()>;

struct Opened<T: Message> {
    service: Factory<T>,
    /// Keeps this process known to its peers; dropped after the ports.
    _node: Node<ipc::Service>,
}

pub(crate) fn node(settings: &Settings) -> Result<Node<ipc::Service>, TransportError> {
    // The library prints through no logger of its own here; errors travel as values.
    iceoryx2::prelude::set_log_level(iceoryx2::prelude::LogLevel::Fatal);
    room::require(ROOM_OF_SERVICE)?;
    NodeBuilder::new()
        .config(&settings.iceoryx2()?)
        // Signals belong to the program, never to a library in the control process.
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(|cause| TransportError::Node {
            root: settings.root.clone(),
            prefix: settings.prefix.clone(),
            cause: format!("{cause:?}"),
        })
}

fn open<T: Message>(settings: &Settings) -> Result<Opened<T>, TransportError> {
    let node = node(settings)?;
    let name = ServiceName::new(T::SERVICE).map_err(|cause| TransportError::service(T::SERVICE, settings, &cause))?;
    let service = retried(
        || {
            node.service_builder(&name)
                .publish_subscribe::<T>()
                // Overflow drops the oldest: a slow reader never holds the writer up.
                .enable_safe_overflow(true)
                // A late reader gets the last message at once, and tells from its time how old it is.
                .history_size(HISTORY)
                .subscriber_max_buffer_size(DEPTH_MAX)
                .subscriber_max_borrowed_samples(BORROWED_MAX)
                .max_publishers(1)
                .max_subscribers(T::MAX_READERS)
                .max_nodes(T::MAX_READERS + 8)
                .open_or_create()
        },
        passes,
    )
    .map_err(|cause| match cause {
        PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(
            PublishSubscribeOpenError::IncompatibleTypes
            | PublishSubscribeOpenError::IncompatibleMessagingPattern
            | PublishSubscribeOpenError::IncompatibleAttributes
            | PublishSubscribeOpenError::IncompatibleOverflowBehavior
            | PublishSubscribeOpenError::DoesNotSupportRequestedMinBufferSize
            | PublishSubscribeOpenError::DoesNotSupportRequestedMinHistorySize
            | PublishSubscribeOpenError::DoesNotSupportRequestedMinSubscriberBorrowedSamples
            | PublishSubscribeOpenError::DoesNotSupportRequestedAmountOfPublishers
            | PublishSubscribeOpenError::DoesNotSupportRequestedAmountOfSubscribers
            | PublishSubscribeOpenError::DoesNotSupportRequestedAmountOfNodes,
        ) => TransportError::Foreign { service: T::SERVICE, expected: T::TYPE, cause: format!("{cause:?}") },
        _ => TransportError::service(T::SERVICE, settings, &cause),
    })?;
    Ok(Opened { service, _node: node })
}

/// Tries for a second: another party may be creating or removing the same service at this moment.
pub(crate) fn retried<R, E: Copy>(mut open: impl FnMut() -> Result<R, E>, passes: impl Fn(E) -> bool) -> Result<R, E> {
    const TRIES: u32 = 200;
    const PAUSE: Duration = Duration::from_millis(5);
    for _ in 1..TRIES {
        match open() {
            Err(cause) if passes(cause) => std::thread::sleep(PAUSE),
            done => return done,
        }
    }
    open()
}

/// Is it what another party at work on the same service looks like?
fn passes(cause: PublishSubscribeOpenOrCreateError) -> bool {
    matches!(
        cause,
        PublishSubscribeOpenOrCreateError::SystemInFlux
            | PublishSubscribeOpenOrCreateError::PublishSubscribeCreateError(
                PublishSubscribeCreateError::HangsInCreation
                    | PublishSubscribeCreateError::IsBeingCreatedByAnotherInstance
                    | PublishSubscribeCreateError::AlreadyExists,
            )
            | PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(
                PublishSubscribeOpenError::DoesNotExist
                    | PublishSubscribeOpenError::HangsInCreation
                    | PublishSubscribeOpenError::IsMarkedForDestruction
                    | PublishSubscribeOpenError::ServiceInCorruptedState,
            )
    )
}

/// Counts a connection that cannot be made: iceoryx2 by itself would say it only in a log that is off here.
fn counted(failures: &AtomicU64, cause: &DegradationCause) -> DegradationAction {
    if matches!(cause, DegradationCause::FailedToEstablishConnection) {
        failures.fetch_add(1, Relaxed);
    }
    DegradationAction::Ignore
}

/// What was counted since this was last asked. Nearly always nothing, and then only read.
fn take_count(failures: &AtomicU64) -> u64 {
    if failures.load(Relaxed) == 0 { 0 } else { failures.swap(0, Relaxed) }
}

/// The one publisher of a message type.
pub struct Writer<T: Message> {
    /// Taken while there was nothing else to do; dropped before the port.
    next: Cell<Option<Loan<T>>>,
    publisher: Publisher<ipc::Service, T, ()>,
    /// Readers that could not be connected, since last asked.
    left_out: Arc<AtomicU64>,
    opened: Opened<T>,
}

impl<T: Message> Writer<T> {
    /// Opens the service and takes its one publisher's place.
    ///
    /// # Errors
    /// Any [`TransportError`] of opening; [`TransportError::Room`] when shared memory is too full; [`TransportError::Full`] while another publisher is alive.
    pub fn open(settings: &Settings) -> Result<Self, TransportError> {
        let opened = open::<T>(settings)?;
        room::require(room_of_writer::<T>())?;
        let left_out = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&left_out);
        let publisher = opened
            .service
            .publisher_builder()
            // The others go on being served.
            .set_degradation_handler(move |cause, _| counted(&count, &cause))
            .max_loaned_samples(LOANED_MAX)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => {
                    TransportError::Full { service: T::SERVICE, role: "publisher", cause: format!("{cause:?}") }
                }
                _ => TransportError::service(T::SERVICE, settings, &cause),
            })?;
        // Queues to readers that came at the same moment; what fails here fails again, and is said, when sending.
        let _ = publisher.update_connections();
        room::take(settings)?;
        Ok(Self { next: Cell::new(None), publisher, left_out, opened })
    }

    /// Does of the next message what can be done before it is there: takes its place and brings that memory to this core. Readers had it
    /// last, and each line that comes from another core costs a tenth of a microsecond while it is written.
    pub fn prepare(&self) {
        let mut next = self.next.take().or_else(|| self.free().ok());
        if let Some(next) = &mut next {
            next.touch();
        }
        self.next.set(next);
    }

    /// While there is nothing to send: goes the ways that sending goes, so that their code and what they read are near. Sending looks at the
    /// places of all readers that may come, twice; so does taking a message. Readers that came meanwhile are connected here and now, most
    /// of them not while a message waits.
    pub fn keep_warm(&self) {
        // As when sending: a reader that cannot be connected is left out until readers come or go again, and counted.
        let _ = self.publisher.update_connections();
        // Given back at once. That there is none is said when sending.
        drop(self.free());
    }

    /// Takes a free message to write into, the prepared one if there is one. Nothing is visible to anybody before [`Loan::send`].
    ///
    /// # Errors
    /// [`TransportError::Loan`] while two loans are out.
    pub fn loan(&self) -> Result<Loan<T>, TransportError> {
        self.next.take().map_or_else(|| self.free(), Ok)
    }

    fn free(&self) -> Result<Loan<T>, TransportError> {
        self.publisher
            .loan_uninit()
            .map(|sample| Loan { sample })
            .map_err(|_| TransportError::Loan { service: T::SERVICE, cause: "all loans are out" })
    }

    /// Copies a message and hands it over; returns the number of readers that got it.
    ///
    /// # Errors
    /// As [`Writer::loan`] and [`Loan::send`].
    pub fn send(&self, message: &T) -> Result<usize, TransportError> {
        self.loan()?.send(message)
    }

    /// How often a reader could not be connected since this was last asked: no descriptor free, shared memory full. It gets nothing until
    /// readers come or go again, when it is tried once more.
    pub fn take_left_out(&self) -> u64 {
        take_count(&self.left_out)
    }

    /// Readers that want this message now, left out or not.
    pub fn readers(&self) -> usize {
        self.opened.service.dynamic_config().number_of_subscribers()
    }
}

/// A message being written.
pub struct Loan<T: Message> {
    sample: SampleMutUninit<ipc::Service, MaybeUninit<T>, ()>,
}

impl<T: Message> Loan<T> {
    /// Writes to all of it; whatever was there before is gone.
    fn touch(&mut self) {
        *self.sample.payload_mut() = MaybeUninit::zeroed();
    }

    /// Where the message will lie; uninitialised.
    pub fn as_mut_ptr(&mut self) -> *mut T {
        self.sample.payload_mut().as_mut_ptr()
    }

    /// Writes `message` and hands it over; returns the number of readers that got it.
    ///
    /// # Errors
    /// [`TransportError::Send`].
    pub fn send(self, message: &T) -> Result<usize, TransportError> {
        self.sample.write_payload(*message).send().map_err(|_| TransportError::Send { service: T::SERVICE })
    }

    /// Hands over what was written through [`Loan::as_mut_ptr`].
    ///
    /// # Errors
    /// [`TransportError::Send`].
    ///
    /// # Safety
    /// The whole message must have been initialised through [`Loan::as_mut_ptr`].
    pub unsafe fn send_written(self) -> Result<usize, TransportError> {
        // SAFETY: the caller promises that the payload is initialised.
        let sample = unsafe { self.sample.assume_init() };
        sample.send().map_err(|_| TransportError::Send { service: T::SERVICE })
    }
}

/// A reader of a message type.
pub struct Reader<T: Message> {
    subscriber: Subscriber<ipc::Service, T, ()>,
    /// Publishers that could not be connected and that nobody was told of yet.
    unreached: Arc<AtomicU64>,
    opened: Opened<T>,
    depth: usize,
}

impl<T: Message> Reader<T> {
    /// Opens the service with a queue of `depth` messages (1 to [`DEPTH_MAX`]); the oldest is dropped when it is full.
    ///
    /// # Errors
    /// Any [`TransportError`] of opening; [`TransportError::Room`] when shared memory is too full; [`TransportError::Full`] when all places are taken.
    pub fn open(settings: &Settings, depth: usize) -> Result<Self, TransportError> {
        let opened = open::<T>(settings)?;
        let depth = depth.clamp(1, DEPTH_MAX);
        room::require(ROOM_OF_SERVICE + ROOM_OF_QUEUE)?;
        let unreached = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&unreached);
        let subscriber = opened
            .service
            .subscriber_builder()
            .buffer_size(depth)
            .set_degradation_handler(move |cause, _| counted(&count, &cause))
            .create()
            .map_err(|cause| match cause {
                SubscriberCreateError::ExceedsMaxSupportedSubscribers => {
                    TransportError::Full { service: T::SERVICE, role: "reader", cause: format!("{cause:?}") }
                }
                _ => TransportError::service(T::SERVICE, settings, &cause),
            })?;
        // What fails here is counted, and said when taking.
        let _ = subscriber.update_connections();
        room::take(settings)?;
        Ok(Self { subscriber, unreached, opened, depth })
    }

    /// Gives every waiting message to `take`, oldest first, at most the queue's depth of them; returns how many.
    ///
    /// # Errors
    /// [`TransportError::Receive`] when a new publisher cannot be connected (no descriptor free, memory that cannot be mapped); what came
    /// before was taken. It is said once, and not tried again before publishers come or go: open another reader.
    pub fn drain(&self, mut take: impl FnMut(&T)) -> Result<usize, TransportError> {
        for count in 0..self.depth {
            match self.subscriber.receive() {
                Ok(Some(sample)) => take(sample.payload()),
                Ok(None) => return self.all_reached().map(|()| count),
                Err(_) => return Err(TransportError::Receive { service: T::SERVICE }),
            }
        }
        Ok(self.depth)
    }

    fn all_reached(&self) -> Result<(), TransportError> {
        if take_count(&self.unreached) == 0 { Ok(()) } else { Err(TransportError::Receive { service: T::SERVICE }) }
    }

    /// Is a message waiting? Also `true` when a publisher could not be connected: then taking tells so.
    pub fn has_message(&self) -> bool {
        self.subscriber.has_samples().unwrap_or(true) || self.unreached.load(Relaxed) > 0
    }

    /// The oldest waiting message, if any.
    ///
    /// # Errors
    /// As [`Reader::drain`].
    pub fn next(&self) -> Result<Option<T>, TransportError> {
        match self.subscriber.receive() {
            Ok(Some(sample)) => Ok(Some(*sample.payload())),
            Ok(None) => self.all_reached().map(|()| None),
            Err(_) => Err(TransportError::Receive { service: T::SERVICE }),
        }
    }

    /// The newest waiting message, if any; older ones are dropped.
    ///
    /// # Errors
    /// As [`Reader::drain`].
    pub fn latest(&self) -> Result<Option<T>, TransportError> {
        let mut newest = None;
        self.drain(|message| newest = Some(*message))?;
        Ok(newest)
    }

    /// Polls without a pause until `take` gives something, at most until `deadline_ns`.
    ///
    /// # Errors
    /// As [`Reader::drain`].
    pub fn wait<R>(
        &self,
        deadline_ns: i64,
        mut take: impl FnMut(&Self) -> Result<Option<R>, TransportError>,
    ) -> Result<Option<R>, TransportError> {
        loop {
            if let Some(result) = take(self)? {
                return Ok(Some(result));
            }
            if now_ns() >= deadline_ns {
                return Ok(None);
            }
            std::hint::spin_loop();
        }
    }

    /// Publishers connected now.
    pub fn publishers(&self) -> usize {
        self.opened.service.dynamic_config().number_of_publishers()
    }
}

/// Looks at the services as a newcomer finds them, from another thread than the ports'.
///
/// After the shared files were removed under running processes, old peers go on talking among themselves while newcomers make a
/// new service: nothing tells the old ones. A port that a newcomer cannot see must be opened anew.
pub struct Probe {
    node: Node<ipc::Service>,
    settings: Settings,
}

impl Probe {
    /// Joins as a node without ports.
    ///
    /// # Errors
    /// [`TransportError::Node`].
    pub fn open(settings: &Settings) -> Result<Self, TransportError> {
        node(settings).map(|node| Self { node, settings: settings.clone() })
    }

    /// Publishers and readers that a newcomer finds; zeros where there is no such service, or not all of its files.
    ///
    /// # Errors
    /// [`TransportError::Service`] where nobody can tell: a full disk, no descriptor free.
    pub fn count<T: Message>(&self) -> Result<(usize, usize), TransportError> {
        let name = ServiceName::new(T::SERVICE).map_err(|cause| TransportError::service(T::SERVICE, &self.settings, &cause))?;
        match self.node.service_builder(&name).publish_subscribe::<T>().open() {
            Ok(service) => {
                let peers = service.dynamic_config();
                Ok((peers.number_of_publishers(), peers.number_of_subscribers()))
            }
            Err(
                PublishSubscribeOpenError::DoesNotExist
                | PublishSubscribeOpenError::ServiceInCorruptedState
                | PublishSubscribeOpenError::HangsInCreation
                | PublishSubscribeOpenError::IsMarkedForDestruction,
            ) => Ok((0, 0)),
            Err(cause) => Err(TransportError::service(T::SERVICE, &self.settings, &cause)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::own::Own;

    /// Bytes of the files of a prefix: their lengths, and what was taken of them.
    fn shared(prefix: &str) -> (u64, u64) {
        use std::os::unix::fs::MetadataExt;
        let files = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        let ours = files.filter(|file| file.file_name().to_string_lossy().starts_with(prefix));
        ours.filter_map(|file| file.metadata().ok())
            .fold((0, 0), |(length, taken), file| (length + file.len(), taken + 512 * file.blocks()))
    }

    fn takes_no_more_room_than_it_asks_for<T: Message>() {
        let own = Own::new(&format!("room{}_", T::MAX_READERS));
        let settings = &own.0;
        let writer = Writer::<T>::open(settings).expect("writer");
        let (alone, taken) = shared(&settings.prefix);
        assert!(taken >= alone, "{taken} of {alone} bytes are taken");
        let asked = ROOM_OF_SERVICE + room_of_messages::<T>();
        assert!((asked / 2..asked).contains(&alone), "{alone} of {asked} bytes");
        let readers: Vec<_> = (0..T::MAX_READERS).map(|_| Reader::<T>::open(settings, DEPTH_MAX).expect("reader")).collect();
        // Whoever comes later makes the queue.
        writer.publisher.update_connections().expect("connected");
        let (length, taken) = shared(&settings.prefix);
        assert!(taken >= length, "{taken} of {length} bytes are taken");
        let of_queues = ROOM_OF_QUEUE * readers.len() as u64;
        assert!((alone + of_queues / 8..alone + of_queues).contains(&length), "{} of {of_queues} bytes", length - alone);
    }

    #[test]
    fn states_take_no_more_room_than_they_ask_for() {
        takes_no_more_room_than_it_asks_for::<RavenState>();
    }

    #[test]
    fn poses_take_no_more_room_than_they_ask_for() {
        takes_no_more_room_than_it_asks_for::<CorrectedPose>();
    }

    #[test]
    fn what_keeps_the_way_out_warm_is_seen_by_nobody_and_takes_no_place() {
        let own = Own::new("warm");
        let writer = Writer::<RavenState>::open(&own.0).expect("writer");
        let mut state = RavenState::new();
        for sequence in 1..=3 {
            // More often than there are places, without and with one taken beforehand; a reader that comes gets what was sent last.
            for prepared in [false, true] {
                if prepared {
                    writer.prepare();
                }
                for _ in 0..2 * RavenState::MAX_READERS * DEPTH_MAX {
                    writer.keep_warm();
                }
            }
            let reader = Reader::<RavenState>::open(&own.0, 4).expect("reader");
            writer.keep_warm();
            let last = reader.latest().expect("nothing failed").map(|state| state.sequence);
            assert_eq!(last, (sequence > 1).then_some(sequence - 1));
            state.seal(sequence);
            assert_eq!(writer.send(&state).expect("a place"), 1);
            assert_eq!(reader.latest().expect("nothing failed").map(|state| state.sequence), Some(sequence));
        }
    }
}
