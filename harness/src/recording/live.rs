//! Writes a recording while it happens, so that whoever kills the program loses little.
//!
//! Messages are gathered in memory into a chunk; when the oldest of them is 0.1 s old, the chunk is closed and handed to the
//! system in one piece. What the system has is safe from the end of the program, not from the end of the power. A file that
//! ends early has no summary; the reader recovers it chunk by chunk (grade B).
//!
//! Memory: one chunk, and for the summary at the end an entry for each chunk, longer by each topic in it: 12 MB for an hour of five
//! topics, counted at the allocator; a whole process was seen to grow by 26 MB.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};
use std::rc::Rc;

use mcap::Writer;
use mcap::records::{MessageHeader, Metadata};

use super::mcap_write::{failed, options};
use super::session::{Pose, Wrench};
use super::{messages, schemas};
use crate::error::Error;

/// Age of the oldest message at which a chunk is closed: a third of what may be lost.
pub const CHUNK_AGE_NS: i64 = 100_000_000;

/// Length of a chunk before compression at which it is closed whatever the times are. Chosen: three seconds of a cell.
const CHUNK_LENGTH_MAX: u64 = 1 << 20;

/// A topic whose messages are JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JsonTopic<'t> {
    /// Topic.
    pub topic: &'t str,
    /// Name of its schema.
    pub name: &'static str,
    /// The JSON schema.
    pub schema: &'static str,
}

/// When a message came, and when its content was so; both in ns since 1970.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Times {
    /// Receipt by the host: `log_time`.
    pub received_ns: i64,
    /// As reconstructed: `header.stamp` and `publish_time`.
    pub stamp_ns: i64,
}

/// Where the library writes: memory, so that it never sees a failure.
#[derive(Debug, Clone, Default)]
struct Gathered {
    bytes: Rc<RefCell<Vec<u8>>>,
    at: u64,
}

impl Write for Gathered {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.borrow_mut().extend_from_slice(bytes);
        self.at += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Gathered {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.at),
            _ => Err(io::Error::new(io::ErrorKind::Unsupported, "a live recording is only appended to")),
        }
    }
}

/// A recording that grows.
pub struct LiveWriter<W: Write> {
    out: W,
    gathered: Gathered,
    writer: Writer<Gathered>,
    channels: BTreeMap<String, (u16, u32)>,
    oldest_ns: Option<i64>,
    written: u64,
}

impl<W: Write> LiveWriter<W> {
    /// Begins a recording with this `session` record; it is in `out` when this returns.
    ///
    /// # Errors
    /// When `out` does not take it.
    pub fn create(out: W, session: &BTreeMap<String, String>) -> Result<Self, Error> {
        let gathered = Gathered::default();
        let options = options().disable_seeking(true).chunk_size(Some(CHUNK_LENGTH_MAX));
        let writer = options.create(gathered.clone()).map_err(failed)?;
        let mut live = LiveWriter { out, gathered, writer, channels: BTreeMap::new(), oldest_ns: None, written: 0 };
        live.metadata("session", session)?;
        Ok(live)
    }

    /// Bytes that `out` has taken.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// A pose of the probe in the nozzle's frame.
    ///
    /// # Errors
    /// As [`Self::tick`], or when the time is outside what a stamp holds.
    pub fn pose(&mut self, topic: &str, times: Times, pose: &Pose) -> Result<(), Error> {
        let body = messages::encode(times.stamp_ns, "nozzle", &(pose.position_m, pose.orientation_xyzw));
        let id = self.channel(topic, messages::POSE, "ros2msg", "cdr", schemas::pose)?;
        self.message(topic, id, times, &body.map_err(|what| Error::new(what).place(format!("topic {topic}")))?)
    }

    /// A reading of the sensor, in its own axes.
    ///
    /// # Errors
    /// As [`Self::pose`].
    pub fn wrench(&mut self, topic: &str, times: Times, wrench: &Wrench) -> Result<(), Error> {
        let body = messages::encode(times.stamp_ns, "ft_sensor", &(wrench.force_n, wrench.torque_n_m));
        let id = self.channel(topic, messages::WRENCH, "ros2msg", "cdr", schemas::wrench)?;
        self.message(topic, id, times, &body.map_err(|what| Error::new(what).place(format!("topic {topic}")))?)
    }

    /// A message in JSON.
    ///
    /// # Errors
    /// As [`Self::tick`].
    pub fn json(&mut self, topic: &JsonTopic<'_>, times: Times, value: &serde_json::Value) -> Result<(), Error> {
        let id = self.channel(topic.topic, topic.name, "jsonschema", "json", || topic.schema.to_owned())?;
        self.message(topic.topic, id, times, value.to_string().as_bytes())
    }

    /// A metadata record; it is in `out` when this returns.
    ///
    /// # Errors
    /// As [`Self::tick`].
    pub fn metadata(&mut self, name: &str, record: &BTreeMap<String, String>) -> Result<(), Error> {
        let record = Metadata { name: name.to_owned(), metadata: record.clone() };
        self.writer.write_metadata(&record).map_err(failed)?;
        self.flush()
    }

    /// Time passes: a chunk that is old enough goes out, also when nothing more comes.
    ///
    /// # Errors
    /// When `out` does not take it: the disk is full. What it took before stays readable.
    pub fn tick(&mut self, now_ns: i64) -> Result<(), Error> {
        match self.oldest_ns {
            Some(oldest_ns) if now_ns.saturating_sub(oldest_ns) >= CHUNK_AGE_NS => self.flush(),
            _ => Ok(()),
        }
    }

    /// Ends the recording with its summary.
    ///
    /// # Errors
    /// As [`Self::tick`].
    pub fn finish(mut self) -> Result<W, Error> {
        self.writer.finish().map_err(failed)?;
        self.hand_over()?;
        // The library has nothing more to write: dropping it adds nothing.
        Ok(self.out)
    }

    fn channel(
        &mut self,
        topic: &str,
        type_name: &str,
        schema_encoding: &str,
        encoding: &str,
        schema: impl FnOnce() -> String,
    ) -> Result<u16, Error> {
        if let Some((id, _)) = self.channels.get(topic) {
            return Ok(*id);
        }
        let schema = self.writer.add_schema(type_name, schema_encoding, schema().as_bytes()).map_err(failed)?;
        let id = self.writer.add_channel(schema, topic, encoding, &BTreeMap::new()).map_err(failed)?;
        self.channels.insert(topic.to_owned(), (id, 0));
        Ok(id)
    }

    fn message(&mut self, topic: &str, id: u16, times: Times, body: &[u8]) -> Result<(), Error> {
        let unsigned = |time_ns: i64| {
            u64::try_from(time_ns).map_err(|_| {
                Error::new(format!("time {time_ns} ns is before 1970"))
                    .place(format!("topic {topic}"))
                    .help("set the clock of this computer, or correct the times of the capture")
            })
        };
        let (log_time, publish_time) = (unsigned(times.received_ns)?, unsigned(times.stamp_ns)?);
        let mut sequence = 0;
        if let Some((_, next)) = self.channels.get_mut(topic) {
            sequence = std::mem::replace(next, next.wrapping_add(1));
        }
        let header = MessageHeader { channel_id: id, sequence, log_time, publish_time };
        self.writer.write_to_known_channel(&header, body).map_err(failed)?;
        self.oldest_ns.get_or_insert(times.received_ns);
        if !self.gathered.bytes.borrow().is_empty() {
            self.hand_over()?;
        }
        self.tick(times.received_ns)
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.writer.flush().map_err(failed)?;
        self.oldest_ns = None;
        self.hand_over()
    }

    fn hand_over(&mut self) -> Result<(), Error> {
        let bytes = std::mem::take(&mut *self.gathered.bytes.borrow_mut());
        self.out.write_all(&bytes).and_then(|()| self.out.flush()).map_err(|error| {
            Error::new(format!("writing failed after {} bytes: {error}", self.written))
                .help("make room on the disk, or raise the limit on a file's length (ulimit -f); what was written before can be read")
        })?;
        self.written += bytes.len() as u64;
        Ok(())
    }
}
