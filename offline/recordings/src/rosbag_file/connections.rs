//! The connections of a bag.

use std::collections::BTreeMap;

use super::framing::Fields;
use crate::ros::{Assembler, CHANNELS_MAX, KnownChannel, StateTopic, Stop, TEXT_MAX};
use crate::stream::Channel;

/// What is known so far.
#[derive(Debug, Default)]
pub(super) struct Connections {
    known: BTreeMap<u32, Connection>,
    state_topic: StateTopic,
    /// Text that is kept, bytes.
    text_bytes: usize,
}

#[derive(Debug)]
struct Connection {
    definition: String,
    channel: KnownChannel,
}

impl Connections {
    /// For people, by number.
    pub(super) fn shown(&self) -> Vec<Channel> {
        self.known.values().map(|connection| connection.channel.shown.clone()).collect()
    }

    /// A connection at this byte. Bags say it again at their end; it must say the same.
    pub(super) fn add(&mut self, fields: Fields<'_>, data: &[u8], at: u64) -> Result<(), Stop> {
        let refused = |what: String| Err(Stop::damage(at, what));
        let (Some(id), Some(topic)) = (fields.u32("conn"), fields.text("topic")) else {
            return refused("a connection does not fit the format".into());
        };
        let said = Fields(data);
        let (Some(type_name), Some(definition)) = (said.text("type"), said.text("message_definition")) else {
            return refused(format!("the connection of {topic} does not say the type of its messages"));
        };
        if let Some(known) = self.known.get(&id) {
            let shown = &known.channel.shown;
            let is_same = (&shown.topic, &shown.type_name, &known.definition) == (&topic, &type_name, &definition);
            return if is_same { Ok(()) } else { refused(format!("connection {id} is defined a second time, differently")) };
        }
        self.text_bytes = self.text_bytes.saturating_add(fields.0.len() + data.len());
        if self.known.len() == CHANNELS_MAX || self.text_bytes > TEXT_MAX {
            return refused(format!("more than {CHANNELS_MAX} connections or {TEXT_MAX} bytes of definitions"));
        }
        let channel = KnownChannel::ros1(topic, type_name, &definition, at, &mut self.state_topic)?;
        let _ = self.known.insert(id, Connection { definition, channel });
        Ok(())
    }

    /// A message at this byte; is it anything but metadata?
    pub(super) fn take(&mut self, fields: Fields<'_>, data: &[u8], at: u64, assembler: &mut Assembler) -> Result<bool, Stop> {
        let (Some(id), Some(time_ns)) = (fields.u32("conn"), fields.time_ns("time")) else {
            return Err(Stop::damage(at, "a message does not fit the format"));
        };
        let Some(connection) = self.known.get_mut(&id) else {
            return Err(Stop::damage(at, format!("a message of connection {id}, which is nowhere")));
        };
        connection.channel.take(assembler, time_ns, data, at)?;
        Ok(!connection.channel.is_metadata())
    }
}
