//! What can go wrong when a link is opened or used.

use crate::Settings;
use ravenpose_wire::ICEORYX2_VERSION;
use std::fmt::Debug;
use thiserror::Error;

/// Each message is one line that says what happened and what to do.
#[derive(Debug, Error)]
pub enum TransportError {
    /// A prefix or root that cannot be a file name.
    #[error("transport {what} {value:?} is not usable as a file name; use letters, digits, '_' and '-'")]
    Settings {
        /// `prefix` or `root`.
        what: String,
        /// As given.
        value: String,
    },
    /// A root that depends on the working directory.
    #[error("transport root {root:?} is not absolute: who starts elsewhere would meet nobody; give a path from / on")]
    Relative {
        /// As given.
        root: String,
    },
    /// Names too long for the socket that a service with `wait = "event"` listens at.
    #[error(
        "transport prefix {prefix:?} and root {root:?} together have more than the {most} bytes that wait = \"event\" leaves them; give a shorter root"
    )]
    TooLong {
        /// Prefix of the files.
        prefix: String,
        /// Root directory.
        root: String,
        /// Bytes that both may have together.
        most: usize,
    },
    /// iceoryx2 could not make this process known.
    #[error(
        "shared memory under {root} cannot be used ({cause}); all parties must run as the same user, check the owner of {root} and of /dev/shm/{prefix}*"
    )]
    Node {
        /// Root directory.
        root: String,
        /// Prefix of the files.
        prefix: String,
        /// iceoryx2's own name for the failure.
        cause: String,
    },
    /// Shared memory is too full; going on would end in SIGBUS.
    #[error(
        "{place} has {free_kib} KiB of free shared memory, {needed_kib} KiB are needed; remove what is not needed there, or: mount -o remount,size=1G {place}"
    )]
    Room {
        /// Where it is mounted.
        place: &'static str,
        /// Wanted, KiB.
        needed_kib: u64,
        /// Left, KiB.
        free_kib: u64,
    },
    /// The service exists but is not ours.
    #[error("service {service} exists with other contents than {expected} ({cause}); stop the program that made it, or update it")]
    Foreign {
        /// Service name.
        service: &'static str,
        /// Payload type name.
        expected: &'static str,
        /// iceoryx2's own name for the failure.
        cause: String,
    },
    /// The service could not be opened.
    #[error(
        "service {service} cannot be opened ({cause}); all parties must have iceoryx2 {version} and run as the same user; if no party runs, remove /dev/shm/{prefix}*"
    )]
    Service {
        /// Service name.
        service: &'static str,
        /// iceoryx2's own name for the failure.
        cause: String,
        /// The version of this build.
        version: &'static str,
        /// Prefix of the files.
        prefix: String,
    },
    /// Another publisher or too many readers are alive.
    #[error("service {service} has no free place for another {role} ({cause}); stop the one that runs")]
    Full {
        /// Service name.
        service: &'static str,
        /// `publisher` or `reader`.
        role: &'static str,
        /// iceoryx2's own name for the failure.
        cause: String,
    },
    /// A loan was asked for while as many as allowed are out.
    #[error("service {service}: no free message to write into ({cause}); send or drop the previous one first")]
    Loan {
        /// Service name.
        service: &'static str,
        /// iceoryx2's own name for the failure.
        cause: &'static str,
    },
    /// A message could not be handed over to every reader.
    #[error("service {service}: a reader could not be reached")]
    Send {
        /// Service name.
        service: &'static str,
    },
    /// A publisher's memory could not be mapped.
    #[error("service {service}: the memory of a publisher cannot be mapped")]
    Receive {
        /// Service name.
        service: &'static str,
    },
}

impl TransportError {
    pub(crate) fn service(service: &'static str, settings: &Settings, cause: &impl Debug) -> Self {
        Self::Service { service, cause: format!("{cause:?}"), version: ICEORYX2_VERSION, prefix: settings.prefix.clone() }
    }
}
