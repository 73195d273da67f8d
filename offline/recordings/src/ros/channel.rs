//! A channel of a file: its name in the list for people, and what to do with its messages.

use super::assembly::{Assembler, Role};
use super::container::Stop;
use super::definitions::RAVEN_STATE;
use crate::stream::Channel;

/// A channel whose messages may be met.
#[derive(Debug)]
pub(crate) struct KnownChannel {
    pub(crate) shown: Channel,
    role: Option<Role>,
}

/// The topic that the states of a file come from: the first one of their type. The lab's launch file throttles `/ravenstate` to
/// `/ravenstate_100hz`; from both of them every tenth state would come twice.
#[derive(Debug, Default)]
pub(crate) struct StateTopic(Option<String>);

impl StateTopic {
    /// Are the states of this topic of another one already?
    fn is_elsewhere(&mut self, topic: &str, type_name: &str) -> bool {
        type_name == RAVEN_STATE.name && self.0.get_or_insert_with(|| topic.to_owned()) != topic
    }
}

impl KnownChannel {
    /// A channel at this byte, with ROS 1 messages of this definition.
    pub(crate) fn ros1(
        topic: String,
        type_name: String,
        definition: &str,
        at: u64,
        state_topic: &mut StateTopic,
    ) -> Result<Self, Stop> {
        if state_topic.is_elsewhere(&topic, &type_name) {
            return Ok(Self::other(topic, type_name, "ros1".to_owned()));
        }
        let role = Role::of(&topic, &type_name, definition).map_err(|error| Stop::Refused {
            byte: at,
            what: format!("the definition of {type_name} on {topic} {error}"),
            remedy: "record with a message that has all fields of raven_2/raven_state",
        })?;
        // Images are read by those who ask for them, never as records.
        let is_read = role.as_ref().is_some_and(|role| !matches!(role, Role::Image(_)));
        let shown = Channel { topic, type_name, encoding: "ros1".to_owned(), messages: 0, is_read };
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
