//! A bell beside `raven/state`, for the service's event mode. Ringing costs the publisher one system call per message while somebody
//! listens, and none while nobody does.
//!
//! This module contains `unsafe`: waiting for the descriptor of the listener's socket.

use crate::{Settings, TransportError};
use iceoryx2::node::Node;
use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::prelude::{FileDescriptorBased as _, ServiceName, ipc};
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError, EventOpenOrCreateError};
use ravenpose_wire::STATE_SERVICE;
use std::time::Duration;

type EventFactory = iceoryx2::service::port_factory::event::PortFactory<ipc::Service>;

fn open(settings: &Settings) -> Result<(EventFactory, Node<ipc::Service>), TransportError> {
    let node = crate::link::node(settings)?;
    let name = ServiceName::new(STATE_SERVICE).map_err(|cause| TransportError::service(STATE_SERVICE, settings, &cause))?;
    let service = crate::link::retried(|| node.service_builder(&name).event().open_or_create(), passes)
        .map_err(|cause| TransportError::service(STATE_SERVICE, settings, &cause))?;
    Ok((service, node))
}

/// Is it what another party at work on the same service looks like?
fn passes(cause: EventOpenOrCreateError) -> bool {
    matches!(
        cause,
        EventOpenOrCreateError::SystemInFlux
            | EventOpenOrCreateError::EventCreateError(
                EventCreateError::HangsInCreation
                    | EventCreateError::IsBeingCreatedByAnotherInstance
                    | EventCreateError::AlreadyExists,
            )
            | EventOpenOrCreateError::EventOpenError(
                EventOpenError::DoesNotExist
                    | EventOpenError::HangsInCreation
                    | EventOpenError::IsMarkedForDestruction
                    | EventOpenError::ServiceInCorruptedState,
            )
    )
}

/// Wakes the service after a state was sent.
pub struct Bell {
    notifier: iceoryx2::port::notifier::Notifier<ipc::Service>,
    _opened: (EventFactory, Node<ipc::Service>),
}

impl Bell {
    /// Opens the bell.
    ///
    /// # Errors
    /// [`TransportError::Service`] or [`TransportError::Full`].
    pub fn open(settings: &Settings) -> Result<Self, TransportError> {
        let opened = open(settings)?;
        let notifier = opened.0.notifier_builder().create().map_err(|cause| match cause {
            NotifierCreateError::ExceedsMaxSupportedNotifiers => {
                TransportError::Full { service: STATE_SERVICE, role: "notifier", cause: format!("{cause:?}") }
            }
            _ => TransportError::service(STATE_SERVICE, settings, &cause),
        })?;
        Ok(Self { notifier, _opened: opened })
    }

    /// Rings; returns whether anybody listens. Never blocks, and makes no system call while nobody does.
    pub fn ring(&self) -> bool {
        self.notifier.notify().is_ok_and(|listeners| listeners > 0)
    }
}

/// Prefix and root together, in bytes, that a listener may have: its socket is a file under the root, and Linux keeps 108 bytes for the
/// path of one. Beside both stands a number of up to 39 digits, and `.event`.
const NAME_MAX: usize = 108 - 39 - 6;

/// Rings that are taken off at once, at most: a socket keeps no more by the kernel's default (`net.unix.max_dgram_qlen`).
const RINGS: usize = 16;

/// Waits for the bell.
pub struct Listener {
    port: iceoryx2::port::listener::Listener<ipc::Service>,
    descriptor: i32,
    _opened: (EventFactory, Node<ipc::Service>),
}

impl Listener {
    /// Can its socket have a name?
    ///
    /// # Errors
    /// [`TransportError::TooLong`].
    pub fn check(settings: &Settings) -> Result<(), TransportError> {
        let (Settings { prefix, root }, most) = (settings, NAME_MAX);
        if prefix.len() + root.len() > most {
            return Err(TransportError::TooLong { prefix: prefix.clone(), root: root.clone(), most });
        }
        Ok(())
    }

    /// Opens the listening end.
    ///
    /// # Errors
    /// As [`Listener::check`]; [`TransportError::Service`] or [`TransportError::Full`].
    pub fn open(settings: &Settings) -> Result<Self, TransportError> {
        Self::check(settings)?;
        let opened = open(settings)?;
        let listener = opened.0.listener_builder().create().map_err(|cause| match cause {
            ListenerCreateError::ExceedsMaxSupportedListeners => {
                TransportError::Full { service: STATE_SERVICE, role: "listener", cause: format!("{cause:?}") }
            }
            _ => TransportError::service(STATE_SERVICE, settings, &cause),
        })?;
        // SAFETY: the descriptor is only waited for, and the listener that owns it lives as long as its copy here.
        let descriptor = unsafe { listener.file_descriptor().native_handle() };
        let opened = Self { port: listener, descriptor, _opened: opened };
        // The first look makes the socket one that never blocks: no later one has to.
        opened.take_off();
        Ok(opened)
    }

    /// Waits for a ring, at most `timeout`; returns whether it rang. Allocates nothing, and makes two system calls, one more for each further ring.
    ///
    /// The port's own wait has the timeout of its socket, which the kernel counts in timer ticks, and takes less than a microsecond for no timeout at all.
    pub fn wait(&self, timeout: Duration) -> bool {
        let timeout = libc::timespec {
            tv_sec: timeout.as_secs().try_into().unwrap_or(libc::time_t::MAX),
            tv_nsec: timeout.subsec_nanos().into(),
        };
        let mut socket = libc::pollfd { fd: self.descriptor, events: libc::POLLIN, revents: 0 };
        // SAFETY: one valid pollfd and a valid timespec, for the duration of the call; no signal mask.
        let ready = unsafe { libc::ppoll(&raw mut socket, 1, &raw const timeout, std::ptr::null()) };
        ready > 0 && self.take_off()
    }

    /// Takes off what has rung.
    fn take_off(&self) -> bool {
        (0..RINGS).take_while(|_| matches!(self.port.try_wait_one(), Ok(Some(_)))).count() > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::own::Own;
    use std::sync::mpsc;
    use std::time::Instant;

    #[test]
    fn a_wait_ends_in_its_time_however_short_and_with_a_ring() {
        let link = Own::new("bell");
        let settings = &link.0;
        let (ended, waited) = mpsc::channel();
        let (rang, all_rung) = mpsc::channel::<()>();
        let own = settings.clone();
        let waiting = std::thread::spawn(move || {
            let listener = Listener::open(&own).expect("listener");
            for nanos in [0, 1, 20, 400, 999, 1_000, 1_500_000] {
                let begun = Instant::now();
                assert!(!listener.wait(Duration::from_nanos(nanos)), "nobody rang");
                assert!(begun.elapsed() >= Duration::from_nanos(nanos));
                ended.send(nanos).expect("the test waits");
            }
            ended.send(u64::MAX).expect("the test waits");
            let woken = listener.wait(Duration::from_mins(1));
            // It hears the other rings as well.
            let _ = all_rung.recv();
            woken
        });
        for _ in 0..8 {
            waited.recv_timeout(Duration::from_secs(20)).expect("every wait ends");
        }
        let bell = Bell::open(settings).expect("bell");
        let rings = (0..3).filter(|_| bell.ring()).count();
        drop(rang);
        assert_eq!(rings, 3);
        assert!(waiting.join().expect("the listener's thread"));
    }
}
