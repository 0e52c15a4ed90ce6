//! From records to messages: joins each message with its channel and schema, and counts what passed.
//!
//! The counts are compared with the file's own statistics. That finds a record that vanished (one flipped bit turns the
//! opcode of a chunk into that of an index) in a file whose writer left the checksum of the data section out.

use std::collections::BTreeMap;

use mcap::records::{self, Record, op};

use super::records::guarded;
use crate::error::Error;

/// One message as the file has it.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// Topic of its channel.
    pub topic: &'a str,
    /// Name of its schema, for instance `geometry_msgs/msg/PoseStamped`; empty without schema.
    pub type_name: &'a str,
    /// Encoding of its schema, for instance `ros2msg`; empty without schema.
    pub schema_encoding: &'a str,
    /// Encoding of its body, for instance `cdr`.
    pub message_encoding: &'a str,
    /// Counter of the publisher.
    pub sequence: u32,
    /// Time at which it was recorded, in ns.
    pub log_time_ns: u64,
    /// Time at which it was sent, in ns.
    pub publish_time_ns: u64,
    /// The body.
    pub data: &'a [u8],
}

/// Takes what a recording holds, in the order of the file.
pub trait Sink {
    /// A message.
    ///
    /// # Errors
    /// When its content cannot be used; reading stops.
    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), Error>;

    /// A channel, even if no message of it follows.
    fn channel(&mut self, _topic: &str, _type_name: &str, _schema_encoding: &str, _message_encoding: &str) {}

    /// A metadata record.
    fn metadata(&mut self, _name: &str, _record: &BTreeMap<String, String>) {}
}

/// What passed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// Messages.
    pub messages: u64,
    /// Metadata records.
    pub metadata: u64,
    /// Attachments.
    pub attachments: u64,
    /// Messages by channel.
    pub by_channel: BTreeMap<u16, u64>,
}

/// Why reading stopped.
#[derive(Debug)]
pub(super) enum Trouble {
    /// The bytes are not what was written: salvage may help.
    Damage(String),
    /// The bytes are right and their content cannot be used.
    Content(Error),
}

pub(super) struct Dispatch<'s> {
    sink: &'s mut dyn Sink,
    schemas: BTreeMap<u16, (String, String)>,
    channels: BTreeMap<u16, records::Channel>,
    pub tally: Tally,
    metadata_names: Vec<String>,
    statistics: Option<records::Statistics>,
    metadata_index: Vec<records::MetadataIndex>,
}

impl<'s> Dispatch<'s> {
    pub fn new(sink: &'s mut dyn Sink) -> Self {
        Self {
            sink,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            tally: Tally::default(),
            metadata_names: Vec::new(),
            statistics: None,
            metadata_index: Vec::new(),
        }
    }

    /// Takes a schema or a channel and lets everything else pass: a first look for definitions, before a salvage.
    pub fn define(&mut self, opcode: u8, body: &[u8]) -> Result<(), Trouble> {
        if matches!(opcode, op::SCHEMA | op::CHANNEL) { self.record(opcode, body) } else { Ok(()) }
    }

    pub fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), Trouble> {
        if opcode == op::MESSAGE {
            return self.message(body);
        }
        let record = guarded(|| mcap::parse_record(opcode, body)).map_err(Trouble::Damage)?;
        match record.map_err(|error| Trouble::Damage(format!("record {opcode:#04x}: {error}")))? {
            Record::Schema { header, .. } => {
                self.schemas.entry(header.id).or_insert((header.name, header.encoding));
            }
            Record::Channel(channel) => self.channel(channel),
            Record::Metadata(metadata) => {
                self.tally.metadata += 1;
                self.sink.metadata(&metadata.name, &metadata.metadata);
                self.metadata_names.push(metadata.name);
            }
            Record::Attachment { .. } => self.tally.attachments += 1,
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            Record::MetadataIndex(index) => self.metadata_index.push(index),
            _ => {}
        }
        Ok(())
    }

    fn channel(&mut self, channel: records::Channel) {
        if self.channels.contains_key(&channel.id) {
            return;
        }
        let (type_name, encoding) = schema_of(&self.schemas, &channel);
        self.sink.channel(&channel.topic, type_name, encoding, &channel.message_encoding);
        self.channels.insert(channel.id, channel);
    }

    fn message(&mut self, body: &[u8]) -> Result<(), Trouble> {
        let damage = |what: String| Trouble::Damage(what);
        let Some((head, data)) = body.split_first_chunk::<22>() else {
            return Err(damage(format!("message record of {} bytes, its header alone has 22", body.len())));
        };
        let id = u16::from_le_bytes([head[0], head[1]]);
        let u64_at = |at: usize| head[at..at + 8].iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        let Some(channel) = self.channels.get(&id) else {
            return Err(damage(format!("a message belongs to channel {id}, which nothing defines")));
        };
        if channel.schema_id != 0 && !self.schemas.contains_key(&channel.schema_id) {
            return Err(damage(format!(
                "topic {} has schema {}, which nothing defines",
                channel.topic, channel.schema_id
            )));
        }
        let (type_name, schema_encoding) = schema_of(&self.schemas, channel);
        let message = RawMessage {
            topic: &channel.topic,
            type_name,
            schema_encoding,
            message_encoding: &channel.message_encoding,
            sequence: u32::from_le_bytes([head[2], head[3], head[4], head[5]]),
            log_time_ns: u64_at(6),
            publish_time_ns: u64_at(14),
            data,
        };
        self.sink.message(&message).map_err(Trouble::Content)?;
        self.tally.messages += 1;
        *self.tally.by_channel.entry(id).or_insert(0) += 1;
        Ok(())
    }

    /// Compares what passed with what the summary promises.
    pub fn agree(&self) -> Result<(), Trouble> {
        let differ = |what: &str, read: u64, promised: u64| {
            Err(Trouble::Damage(format!("{read} {what} read, the statistics of the file say {promised}")))
        };
        if let Some(promised) = &self.statistics {
            if self.tally.messages != promised.message_count {
                return differ("messages", self.tally.messages, promised.message_count);
            }
            for (id, count) in &promised.channel_message_counts {
                let read = self.tally.by_channel.get(id).copied().unwrap_or(0);
                if read != *count {
                    return differ(&format!("messages on channel {id}"), read, *count);
                }
            }
            if self.tally.metadata != u64::from(promised.metadata_count) {
                return differ("metadata records", self.tally.metadata, u64::from(promised.metadata_count));
            }
            if self.tally.attachments != u64::from(promised.attachment_count) {
                return differ("attachments", self.tally.attachments, u64::from(promised.attachment_count));
            }
        }
        match self.metadata_index.iter().find(|index| !self.metadata_names.contains(&index.name)) {
            Some(index) => {
                let what = format!("the index names a metadata record `{}`, which is not there", index.name);
                Err(Trouble::Damage(what))
            }
            None => Ok(()),
        }
    }
}

fn schema_of<'a>(schemas: &'a BTreeMap<u16, (String, String)>, channel: &records::Channel) -> (&'a str, &'a str) {
    schemas.get(&channel.schema_id).map_or(("", ""), |(name, encoding)| (name, encoding))
}
