//! Result codes of the C interface.

use ravenpose_transport::TransportError;
use std::ffi::CStr;

/// What a call of the C interface came to. Zero and above: no error.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// Done.
    Ok = 0,
    /// No pose has come since the last one taken.
    NothingNew = 1,
    /// The raw position or orientation was given: there is no correction that may be used.
    Raw = 2,
    /// A pointer that must not be null is.
    Null = -1,
    /// The program was compiled against another version.
    Version = -2,
    /// An argument is out of range or not UTF-8.
    Argument = -3,
    /// Shared memory cannot be used.
    Transport = -4,
    /// Another publisher is alive, or all readers' places are taken.
    Full = -5,
    /// A service of this name has other contents.
    Foreign = -6,
    /// `send` without a `loan`, or no free message.
    Loan = -7,
    /// A reader could not be reached; the others have the state.
    Send = -8,
    /// A publisher's memory cannot be mapped.
    Receive = -9,
    /// A message of another layout, or torn.
    Torn = -10,
    /// A defect of this library; the call had no effect.
    Internal = -11,
    /// The arm is not connected.
    Absent = -12,
}

const TEXTS: [(Code, &CStr); 15] = [
    (Code::Ok, c"done"),
    (Code::NothingNew, c"no new pose since the last one taken"),
    (Code::Raw, c"raw: there is no correction that may be used now"),
    (Code::Null, c"a pointer that must not be null is null"),
    (Code::Version, c"version mismatch: compile the program against the installed ravenpose.h"),
    (Code::Argument, c"an argument is out of range or not UTF-8"),
    (Code::Transport, c"shared memory cannot be used: all parties must run as the same user with the same iceoryx2 version"),
    (Code::Full, c"no free place: another publisher is alive, or all readers' places are taken"),
    (Code::Foreign, c"a service of this name exists with other contents: stop the program that made it, or update it"),
    (Code::Loan, c"no state is on loan, or no free message: call loan before send"),
    (Code::Send, c"a reader could not be reached"),
    (Code::Receive, c"a publisher's memory cannot be mapped"),
    (Code::Torn, c"a message of another layout, or torn"),
    (Code::Internal, c"internal error: please report it"),
    (Code::Absent, c"the arm is not connected"),
];

impl Code {
    pub(crate) fn text(self) -> &'static str {
        text(self as i32).to_str().unwrap_or("unknown")
    }

    pub(crate) fn of(error: &TransportError) -> Self {
        match error {
            TransportError::Settings { .. } | TransportError::Relative { .. } | TransportError::TooLong { .. } => Self::Argument,
            TransportError::Node { .. } | TransportError::Room { .. } | TransportError::Service { .. } => Self::Transport,
            TransportError::Foreign { .. } => Self::Foreign,
            TransportError::Full { .. } => Self::Full,
            TransportError::Loan { .. } => Self::Loan,
            TransportError::Send { .. } => Self::Send,
            TransportError::Receive { .. } => Self::Receive,
        }
    }
}

pub(crate) fn text(code: i32) -> &'static CStr {
    TEXTS.iter().find(|(known, _)| *known as i32 == code).map_or(c"unknown code", |(_, text)| text)
}
