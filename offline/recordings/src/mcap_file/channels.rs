//! The schemas and channels of a file.

use std::collections::{BTreeMap, HashMap};

use super::records::{ChannelRecord, MessageRecord, Schema};
use crate::ros::{Assembler, CHANNELS_MAX, KnownChannel, StateTopic, Stop, TEXT_MAX, admit_encoding};
use crate::stream::Channel;

/// What is known so far.
#[derive(Debug, Default)]
pub(super) struct Channels {
    schemas: HashMap<u16, Schema>,
    known: BTreeMap<u16, (ChannelRecord, KnownChannel)>,
    state_topic: StateTopic,
    /// Text that is kept, bytes.
    text_bytes: usize,
}

impl Channels {
    pub(super) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// For people, by number.
    pub(super) fn shown(&self) -> Vec<Channel> {
        self.known.values().map(|(_, channel)| channel.shown.clone()).collect()
    }

    /// A schema at this byte. Files say it again; it must say the same.
    pub(super) fn add_schema(&mut self, schema: Schema, at: u64) -> Result<(), Stop> {
        match self.schemas.get(&schema.id) {
            Some(said) if *said == schema => return Ok(()),
            Some(_) => return Err(Stop::damage(at, format!("schema {} is defined a second time, differently", schema.id))),
            None => self.grant(schema.text.len() + schema.name.len(), at)?,
        }
        let _ = self.schemas.insert(schema.id, schema);
        Ok(())
    }

    /// A channel at this byte, likewise.
    pub(super) fn add_channel(&mut self, record: ChannelRecord, at: u64) -> Result<(), Stop> {
        match self.known.get(&record.id) {
            Some((said, _)) if *said == record => return Ok(()),
            Some(_) => return Err(Stop::damage(at, format!("channel {} is defined a second time, differently", record.id))),
            None if self.known.len() == CHANNELS_MAX => {
                return Err(Stop::damage(at, format!("more than {CHANNELS_MAX} channels")));
            }
            None => self.grant(record.topic.len() + record.encoding.len(), at)?,
        }
        let channel = self.open(&record, at)?;
        let _ = self.known.insert(record.id, (record, channel));
        Ok(())
    }

    /// A message at this byte.
    pub(super) fn take(&mut self, message: &MessageRecord<'_>, at: u64, assembler: &mut Assembler) -> Result<(), Stop> {
        let Some((_, channel)) = self.known.get_mut(&message.channel) else {
            return Err(Stop::damage(at, format!("a message of channel {}, which is nowhere", message.channel)));
        };
        channel.take(assembler, message.log_time_ns, message.data, at)
    }

    fn open(&mut self, record: &ChannelRecord, at: u64) -> Result<KnownChannel, Stop> {
        let (topic, encoding) = (record.topic.clone(), record.encoding.clone());
        let schema = self.schemas.get(&record.schema_id);
        // Schema 0 is none.
        if schema.is_none() && record.schema_id != 0 {
            return Err(Stop::damage(at, format!("channel {topic} has schema {}, which is nowhere", record.schema_id)));
        }
        let (name, schema_encoding, text) =
            schema.map_or(("", "", ""), |schema| (schema.name.as_str(), schema.encoding.as_str(), schema.text.as_str()));
        let foreign = |what| Stop::Refused {
            byte: at,
            what,
            remedy: "convert the file to ROS 1 messages, as `rosbag` and `mcap` of ROS 1 write them",
        };
        admit_encoding(&topic, name, &encoding).map_err(foreign)?;
        if encoding != "ros1" || schema.is_none() {
            return Ok(KnownChannel::other(topic, name.to_owned(), encoding));
        }
        admit_encoding(&topic, name, schema_encoding).map_err(foreign)?;
        KnownChannel::ros1(topic, name.to_owned(), text, at, &mut self.state_topic)
    }

    /// Counts text that is kept for good.
    fn grant(&mut self, bytes: usize, at: u64) -> Result<(), Stop> {
        self.text_bytes = self.text_bytes.saturating_add(bytes);
        if self.text_bytes > TEXT_MAX {
            return Err(Stop::damage(at, format!("more than {TEXT_MAX} bytes of schemas")));
        }
        Ok(())
    }
}
