//! A bell beside `raven/state`, for the service's event mode. Ringing costs the publisher one system call per message while somebody
//! listens, and none while nobody does.

use crate::{Settings, TransportError};
use iceoryx2::node::Node;
use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::prelude::{ServiceName, ipc};
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

/// Waits for the bell.
pub struct Listener {
    listener: iceoryx2::port::listener::Listener<ipc::Service>,
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
        Ok(Self { listener, _opened: opened })
    }

    /// Waits for one ring, at most `timeout`; returns whether it rang.
    pub fn wait(&self, timeout: Duration) -> bool {
        matches!(self.listener.timed_wait_one(timeout), Ok(Some(_)))
    }
}
