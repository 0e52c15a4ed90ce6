//! Writes a session as a recording that rosbag2, Foxglove, PlotJuggler and Rerun open, and that reads back the same.
//!
//! Equal sessions give equal bytes: one compression thread, our own library name, a fixed chunk length, messages in
//! order of time and, at one time, in a fixed order of topics. Times are those of the session, never the wall clock.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, WriteOptions, Writer};
use serde::Serialize;

use super::map::{AxisMap, Topics};
use super::session::{Pose, Series, Session, Twist, Wrench};
use super::{messages, schemas};
use crate::error::Error;

/// Length of a chunk before compression. A cut or a flipped bit costs at most one: about 0.8 s of a cell. Chosen.
const CHUNK_LENGTH: u64 = 128 << 10;

/// What a recording carries besides its signals, so that it can be made again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Luggage {
    /// Metadata records by name, each with its keys.
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    /// Files by name.
    pub files: Vec<(String, Vec<u8>)>,
}

/// A topic to write and the bodies of its messages, made when their turn comes.
struct Channel<'s> {
    topic: String,
    type_name: &'static str,
    schema: String,
    time_ns: &'s [i64],
    body: Box<dyn Fn(usize, i64) -> Result<Vec<u8>, String> + 's>,
}

/// Writes the session with the topics of the default map.
///
/// # Errors
/// When the output fails, or a time does not fit a ROS stamp.
pub fn write_mcap(session: &Session, out: impl Write + Seek) -> Result<(), Error> {
    write_mcap_with(session, &Luggage::default(), out)
}

/// The same, with metadata and files beside the session. The files bear the time of the first sample.
///
/// # Errors
/// As [`write_mcap`].
pub fn write_mcap_with(session: &Session, luggage: &Luggage, out: impl Write + Seek) -> Result<(), Error> {
    let mut writer = options().create(out).map_err(failed)?;
    let mut metadata = session.believed.clone();
    metadata.insert("kind".to_owned(), session.kind.id().to_owned());
    writer.write_metadata(&Metadata { name: "session".to_owned(), metadata }).map_err(failed)?;
    write_messages(&mut writer, session.start_ns, &channels(session))?;
    write_luggage(&mut writer, luggage, u64::try_from(session.start_ns).unwrap_or_default())?;
    writer.finish().map_err(failed)?;
    Ok(())
}

/// How every recording of ours is written.
pub(super) fn options() -> WriteOptions {
    let library = concat!("dockhil ", env!("CARGO_PKG_VERSION"));
    WriteOptions::new().profile("ros2").library(library).chunk_size(Some(CHUNK_LENGTH)).compression_threads(0)
}

pub(super) fn failed(error: mcap::McapError) -> Error {
    Error::new(format!("writing failed: {error}")).help("check the space on the disk")
}

pub(super) fn write_luggage<W: Write + Seek>(
    writer: &mut Writer<W>,
    luggage: &Luggage,
    time_ns: u64,
) -> Result<(), Error> {
    for (name, metadata) in &luggage.metadata {
        let record = Metadata { name: name.clone(), metadata: metadata.clone() };
        writer.write_metadata(&record).map_err(failed)?;
    }
    for (name, bytes) in &luggage.files {
        let media_type = if name.ends_with(".toml") { "application/toml" } else { "application/octet-stream" };
        let attachment = Attachment {
            log_time: time_ns,
            create_time: time_ns,
            name: name.clone(),
            media_type: media_type.to_owned(),
            data: bytes.into(),
        };
        writer.attach(&attachment).map_err(failed)?;
    }
    Ok(())
}

fn write_messages<W: Write + Seek>(
    writer: &mut Writer<W>,
    start_ns: i64,
    channels: &[Channel<'_>],
) -> Result<(), Error> {
    let mut ids = Vec::with_capacity(channels.len());
    for channel in channels {
        let schema = writer.add_schema(channel.type_name, "ros2msg", channel.schema.as_bytes()).map_err(failed)?;
        ids.push(writer.add_channel(schema, &channel.topic, "cdr", &BTreeMap::new()).map_err(failed)?);
    }
    let mut next = vec![0_usize; channels.len()];
    // The earliest sample comes next; of equal ones the first channel's, because min_by_key keeps the first.
    while let Some(turn) = (0..channels.len())
        .filter(|&i| next[i] < channels[i].time_ns.len())
        .min_by_key(|&i| channels[i].time_ns[next[i]])
    {
        let channel = &channels[turn];
        let index = next[turn];
        let stamp_ns = start_ns + channel.time_ns[index];
        let refuse = |what: String| {
            Error::new(what).place(format!("topic {}, sample {index}", channel.topic)).help("correct start_ns")
        };
        let body = (channel.body)(index, stamp_ns).map_err(refuse)?;
        let time_ns = u64::try_from(stamp_ns).map_err(|_| refuse(format!("time {stamp_ns} ns is before 1970")))?;
        let sequence = u32::try_from(index).map_err(|_| refuse(format!("sample {index} is beyond 32 bits")))?;
        let header = MessageHeader { channel_id: ids[turn], sequence, log_time: time_ns, publish_time: time_ns };
        writer.write_to_known_channel(&header, &body).map_err(failed)?;
        next[turn] += 1;
    }
    Ok(())
}

impl<'s> Channel<'s> {
    /// A series with ROS messages that begin with a header.
    fn of<T, B: Serialize>(
        topic: Option<String>,
        series: Option<&'s Series<T>>,
        (type_name, schema): (&'static str, String),
        frame: &'static str,
        body: impl Fn(&T) -> B + 's,
    ) -> Option<Self> {
        let (topic, series) = topic.zip(series)?;
        let body = move |i: usize, stamp_ns: i64| messages::encode(stamp_ns, frame, &body(&series.value[i]));
        Some(Channel { topic, type_name, schema, time_ns: &series.time_ns, body: Box::new(body) })
    }
}

fn channels(session: &Session) -> Vec<Channel<'_>> {
    let topics = Topics::default();
    let pose = |topic, series| {
        let type_and_schema = (messages::POSE, schemas::pose());
        Channel::of(topic, series, type_and_schema, "nozzle", |pose: &Pose| (pose.position_m, pose.orientation_xyzw))
    };
    let twist = |twist: &Twist| (twist.linear_m_per_s, twist.angular_rad_per_s);
    let sensed = |wrench: &Wrench| (wrench.force_n, wrench.torque_n_m);
    let applied = |force_n: &f64| (AxisMap::default().vector(*force_n), [0.0; 3]);
    let wrench = || (messages::WRENCH, schemas::wrench());
    let all = [
        pose(topics.commanded, session.commanded.as_ref()),
        pose(topics.measured, session.measured.as_ref()),
        Channel::of(topics.twist, session.twist.as_ref(), (messages::TWIST, schemas::twist()), "nozzle", twist),
        Channel::of(topics.sensed, session.sensed.as_ref(), wrench(), "ft_sensor", sensed),
        Channel::of(topics.applied, session.applied.as_ref(), wrench(), "nozzle", applied),
    ];
    all.into_iter().flatten().collect()
}
