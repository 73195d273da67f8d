//! A channel of a file: its name in the list for people, and what to do with its messages.

use super::assembly::{Assembler, Role};
use super::container::Stop;
use crate::stream::Channel;

/// A channel whose messages may be met.
#[derive(Debug)]
pub(crate) struct KnownChannel {
    pub(crate) shown: Channel,
    role: Option<Role>,
}

impl KnownChannel {
    /// A channel at this byte, with ROS 1 messages of this definition.
    pub(crate) fn ros1(topic: String, type_name: String, definition: &str, at: u64) -> Result<Self, Stop> {
        let role = Role::of(&topic, &type_name, definition).map_err(|error| Stop::Refused {
            byte: at,
            what: format!("the definition of {type_name} on {topic} {error}"),
            remedy: "record with a message that has all fields of raven_2/raven_state",
        })?;
        let shown = Channel { topic, type_name, encoding: "ros1".to_owned(), messages: 0, is_read: role.is_some() };
        Ok(Self { shown, role })
    }

    /// A channel that is counted only.
    pub(crate) const fn other(topic: String, type_name: String, encoding: String) -> Self {
        Self { shown: Channel { topic, type_name, encoding, messages: 0, is_read: false }, role: None }
    }

    /// Has it metadata, nothing else?
    pub(crate) const fn is_metadata(&self) -> bool {
        matches!(self.role, Some(Role::Metadata))
    }

    /// Takes a message at this byte.
    pub(crate) fn take(&mut self, assembler: &mut Assembler, time_ns: u64, data: &[u8], at: u64) -> Result<(), Stop> {
        self.shown.messages += 1;
        let Some(role) = &self.role else { return Ok(()) };
        let taken = assembler.take(role, time_ns, data);
        taken.map_err(|error| Stop::damage(at, format!("message {} of {}: {error}", self.shown.messages, self.shown.topic)))
    }
}
