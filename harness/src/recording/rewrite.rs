//! Copies a recording message by message and replaces the numbers of some.
//!
//! What nobody replaces keeps its bytes, its times and its counter. A replaced message keeps everything but its numbers: stamp,
//! frame and byte order are those of the original, and the numbers are written over the old ones, where they stand. Schemas,
//! channels, metadata and attached files are carried over.
//!
//! Not kept: where a chunk begins and how it is compressed, and records of a private kind. Bytes are read by the strict reader, with
//! its limits: a flipped bit in a length is damage, and asks for no memory.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::Writer;
use mcap::records::{Metadata, Record};

use super::dispatch::Trouble;
use super::map::Clock;
use super::mcap_write::{Luggage, failed, options, write_luggage};
use super::messages;
use super::records::{guarded, pump, strict};
use crate::error::Error;

/// A message of a stamped pose, twist or wrench.
#[derive(Debug, Clone, PartialEq)]
pub struct Stamped<'a> {
    /// Topic of its channel.
    pub topic: &'a str,
    /// Its place among the messages of its topic, from 0.
    pub index: usize,
    /// `header.stamp`, in ns.
    pub stamp_ns: i64,
    /// `log_time`, in ns.
    pub log_ns: u64,
    /// `publish_time`, in ns.
    pub publish_ns: u64,
    /// Its numbers in the order of the message: seven of a pose, six of a twist or wrench.
    pub numbers: Vec<f64>,
}

impl Stamped<'_> {
    /// The time by one of its clocks, in ns.
    pub fn time_ns(&self, clock: Clock) -> Option<i64> {
        match clock {
            Clock::Header => Some(self.stamp_ns),
            Clock::Log => i64::try_from(self.log_ns).ok(),
            Clock::Publish => i64::try_from(self.publish_ns).ok(),
        }
    }
}

/// What a copy holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Copied {
    /// All messages.
    pub messages: usize,
    /// Those whose numbers were replaced.
    pub replaced: usize,
}

/// Metadata records and attached files of a recording.
///
/// # Errors
/// When the bytes are no whole recording.
pub fn luggage(bytes: &[u8]) -> Result<Luggage, Error> {
    let mut found = Luggage::default();
    each_record(bytes, &mut |record| {
        match record {
            Record::Metadata(Metadata { name, metadata }) => found.metadata.push((name, metadata)),
            Record::Attachment { header, data, .. } => found.files.push((header.name, data.into_owned())),
            _ => {}
        }
        Ok(())
    })?;
    Ok(found)
}

/// Hands on every record, those of chunks too, with every checksum validated.
fn each_record(bytes: &[u8], each: &mut dyn FnMut(Record<'_>) -> Result<(), Error>) -> Result<(), Error> {
    let pumped = pump(&mut &*bytes, strict(), &mut |opcode, body| {
        let record = guarded(|| mcap::parse_record(opcode, body)).map_err(Trouble::Damage)?;
        let record = record.map_err(|error| Trouble::Damage(format!("record {opcode:#04x}: {error}")))?;
        each(record).map_err(Trouble::Content)
    });
    pumped.map_err(|trouble| match trouble {
        Trouble::Content(error) => error,
        Trouble::Damage(what) => Error::new(format!("cannot be copied: {what}"))
            .help("only a whole recording can be copied; copy the file again"),
    })
}

/// Copies a recording. `replace` says the new numbers of a message, or `None` to keep it as it is. Metadata records and files of
/// `added` take the place of those of the same name; `left_out` names metadata records that are not carried over.
///
/// # Errors
/// When the bytes are no whole recording, or writing fails.
pub fn rewrite(
    bytes: &[u8],
    replace: &mut dyn FnMut(&Stamped<'_>) -> Option<Vec<f64>>,
    added: &Luggage,
    left_out: &[&str],
    out: impl Write + Seek,
) -> Result<Copied, Error> {
    let mut copy = Copy::default();
    let mut writer = options().create(out).map_err(failed)?;
    let (mut kept, mut first_ns) = (Luggage::default(), None);
    each_record(bytes, &mut |record| {
        match record {
            Record::Schema { header, data } => {
                writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data).map_err(failed)?;
                copy.types.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let (id, schema) = (channel.id, channel.schema_id);
                writer
                    .add_channel_with_id(id, schema, &channel.topic, &channel.message_encoding, &channel.metadata)
                    .map_err(failed)?;
                copy.channels.entry(id).or_insert((channel.topic, schema, 0));
            }
            Record::Message { header, data } => {
                first_ns.get_or_insert(header.log_time);
                copy.message(&mut writer, &header, &data, replace)?;
            }
            Record::Metadata(Metadata { name, metadata }) if !left_out.contains(&name.as_str()) => {
                kept.metadata.push((name, metadata));
            }
            Record::Attachment { header, data, .. } => kept.files.push((header.name, data.into_owned())),
            _ => {}
        }
        Ok(())
    })?;
    kept.metadata.retain(|(name, _)| added.metadata.iter().all(|(other, _)| other != name));
    kept.files.retain(|(name, _)| added.files.iter().all(|(other, _)| other != name));
    for luggage in [&kept, added] {
        write_luggage(&mut writer, luggage, first_ns.unwrap_or_default())?;
    }
    writer.finish().map_err(failed)?;
    Ok(copy.copied)
}

/// What is known of the recording while it is copied.
#[derive(Default)]
struct Copy {
    /// Names of the schemas.
    types: BTreeMap<u16, String>,
    /// Topic, schema, and messages so far.
    channels: BTreeMap<u16, (String, u16, usize)>,
    copied: Copied,
}

impl Copy {
    fn message<W: Write + Seek>(
        &mut self,
        writer: &mut Writer<W>,
        header: &mcap::records::MessageHeader,
        data: &[u8],
        replace: &mut dyn FnMut(&Stamped<'_>) -> Option<Vec<f64>>,
    ) -> Result<(), Error> {
        self.copied.messages += 1;
        let channel = self.channels.get_mut(&header.channel_id);
        let named = channel.and_then(|(topic, schema, next)| {
            let index = *next;
            *next += 1;
            Some((topic.as_str(), index, self.types.get(schema)?.as_str()))
        });
        let new = named.and_then(|(topic, index, type_name)| {
            let (stamp_ns, numbers) = messages::numbers(type_name, data)?;
            let (log_ns, publish_ns) = (header.log_time, header.publish_time);
            replace(&Stamped { topic, index, stamp_ns, log_ns, publish_ns, numbers })
        });
        let changed = new.and_then(|numbers| messages::with_numbers(data, &numbers));
        self.copied.replaced += usize::from(changed.is_some());
        writer.write_to_known_channel(header, changed.as_deref().unwrap_or(data)).map_err(failed)
    }
}
