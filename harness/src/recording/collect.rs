//! From messages to streams of samples: decodes the mapped topics, checks every number, and turns wrenches to the nozzle.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;

use super::dispatch::{RawMessage, Sink};
use super::map::{Clock, Map, Role};
use super::map_check::{clock_of, norm, roles};
use super::messages::{self, PairBody, PoseBody};
use super::session::{Pose, Twist, Wrench};
use crate::error::Error;

/// A quaternion in a message has length 1 within this; rounding of the sender. Chosen.
const UNIT_LENGTH_ERROR_MAX: f64 = 1e-3;

/// Samples as they came, with absolute times.
#[derive(Debug)]
pub(super) struct Stream<T> {
    pub time_ns: Vec<i64>,
    pub value: Vec<T>,
    /// Least and greatest `log_time - header.stamp`.
    pub skew_ns: Option<(i64, i64)>,
    last_stamp_ns: Option<i64>,
}

impl<T> Default for Stream<T> {
    fn default() -> Self {
        Self { time_ns: Vec::new(), value: Vec::new(), skew_ns: None, last_stamp_ns: None }
    }
}

impl<T> Stream<T> {
    /// A sample of a table, which has one clock.
    pub fn add(&mut self, time_ns: i64, value: T) {
        self.time_ns.push(time_ns);
        self.value.push(value);
    }
}

/// What a file has under a topic, mapped or not.
#[derive(Debug, Clone, Default)]
pub(super) struct TopicSeen {
    pub type_name: String,
    pub schema_encoding: String,
    pub message_encoding: String,
    pub messages: u64,
}

/// Everything that was read, before it is put in order.
pub(super) struct Collector<'m> {
    pub map: &'m Map,
    roles: Vec<(Role, &'m str)>,
    rotation_xyzw: [f64; 4],
    pub topics: BTreeMap<String, TopicSeen>,
    pub believed: BTreeMap<String, String>,
    pub commanded: Stream<Pose>,
    pub measured: Stream<Pose>,
    pub twist: Stream<Twist>,
    pub sensed: Stream<Wrench>,
    pub applied: Stream<f64>,
}

impl<'m> Collector<'m> {
    pub fn new(map: &'m Map) -> Self {
        Self {
            map,
            roles: roles(map),
            rotation_xyzw: map.sensor.rotation_xyzw(),
            topics: BTreeMap::new(),
            believed: BTreeMap::new(),
            commanded: Stream::default(),
            measured: Stream::default(),
            twist: Stream::default(),
            sensed: Stream::default(),
            applied: Stream::default(),
        }
    }

    fn pose(&mut self, role: Role, message: &RawMessage<'_>) -> Result<(), Error> {
        let clock = clock_of(self.map, role);
        let stream = if role == Role::Commanded { &mut self.commanded } else { &mut self.measured };
        let (stamp_ns, (position_m, orientation_xyzw)) = open::<PoseBody, _>(stream, message, messages::POSE)?;
        finite(stream, message, stamp_ns, "pose.position", &position_m)?;
        finite(stream, message, stamp_ns, "pose.orientation", &orientation_xyzw)?;
        let length = norm(&orientation_xyzw);
        if (length - 1.0).abs() > UNIT_LENGTH_ERROR_MAX {
            let what = format!("pose.orientation has length {length}, expected 1 within {UNIT_LENGTH_ERROR_MAX}");
            return Err(
                at(stream, message, stamp_ns, what).help("the sender must fill in a unit quaternion x, y, z, w")
            );
        }
        push(stream, clock, stamp_ns, message, Pose { position_m, orientation_xyzw })
    }

    fn twist(&mut self, message: &RawMessage<'_>) -> Result<(), Error> {
        let stream = &mut self.twist;
        let (stamp_ns, (linear, angular)) = open::<PairBody, _>(stream, message, messages::TWIST)?;
        finite(stream, message, stamp_ns, "twist.linear", &linear)?;
        finite(stream, message, stamp_ns, "twist.angular", &angular)?;
        let twist = Twist { linear_m_per_s: linear, angular_rad_per_s: angular };
        push(stream, clock_of(self.map, Role::Twist), stamp_ns, message, twist)
    }

    fn sensed(&mut self, message: &RawMessage<'_>) -> Result<(), Error> {
        let stream = &mut self.sensed;
        let (stamp_ns, reported) = open_wrench(stream, message)?;
        let wrench = self.map.sensor.convert(self.rotation_xyzw, reported);
        push(stream, clock_of(self.map, Role::Sensed), stamp_ns, message, wrench)
    }

    fn applied(&mut self, message: &RawMessage<'_>) -> Result<(), Error> {
        let stream = &mut self.applied;
        let (stamp_ns, reported) = open_wrench(stream, message)?;
        let force_n = self.map.axis.along(reported.force_n);
        push(stream, clock_of(self.map, Role::Applied), stamp_ns, message, force_n)
    }
}

impl Sink for Collector<'_> {
    fn channel(&mut self, topic: &str, type_name: &str, schema_encoding: &str, message_encoding: &str) {
        self.topics.entry(topic.to_owned()).or_insert_with(|| TopicSeen {
            type_name: type_name.to_owned(),
            schema_encoding: schema_encoding.to_owned(),
            message_encoding: message_encoding.to_owned(),
            messages: 0,
        });
    }

    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), Error> {
        if let Some(seen) = self.topics.get_mut(message.topic) {
            seen.messages += 1;
        }
        match self.roles.iter().find(|(_, topic)| *topic == message.topic).map(|(role, _)| *role) {
            Some(role @ (Role::Commanded | Role::Measured)) => self.pose(role, message),
            Some(Role::Twist) => self.twist(message),
            Some(Role::Sensed) => self.sensed(message),
            Some(Role::Applied) => self.applied(message),
            None => Ok(()),
        }
    }

    fn metadata(&mut self, name: &str, record: &BTreeMap<String, String>) {
        if name == "session" {
            self.believed.extend(record.iter().map(|(key, value)| (key.clone(), value.clone())));
        }
    }
}

/// Checks encoding and type, and decodes.
fn open<B: DeserializeOwned, T>(
    stream: &Stream<T>,
    message: &RawMessage<'_>,
    type_name: &str,
) -> Result<(i64, B), Error> {
    let refuse =
        |what: String, help: String| Err(Error::new(what).place(format!("topic {}", message.topic)).help(help));
    if message.message_encoding != "cdr" {
        let what = format!("the messages are encoded as `{}`, only `cdr` is read", message.message_encoding);
        return refuse(what, "record with the rosbag2 plugin for mcap and serialization_format: cdr".to_owned());
    }
    if !messages::is_type(message.type_name, type_name) {
        let what = format!("the messages are of type `{}`, expected `{type_name}`", message.type_name);
        return refuse(what, "map another topic to this role: [topics] in the map given with --map".to_owned());
    }
    messages::decode(message.data).map_err(|what| {
        let log_ns = i64::try_from(message.log_time_ns).unwrap_or(i64::MAX);
        at(stream, message, log_ns, what).help(format!("the sender must write {type_name} as plain cdr"))
    })
}

fn open_wrench<T>(stream: &Stream<T>, message: &RawMessage<'_>) -> Result<(i64, Wrench), Error> {
    let (stamp_ns, (force_n, torque_n_m)) = open::<PairBody, _>(stream, message, messages::WRENCH)?;
    finite(stream, message, stamp_ns, "wrench.force", &force_n)?;
    finite(stream, message, stamp_ns, "wrench.torque", &torque_n_m)?;
    Ok((stamp_ns, Wrench { force_n, torque_n_m }))
}

fn finite<T>(
    stream: &Stream<T>,
    message: &RawMessage<'_>,
    stamp_ns: i64,
    field: &str,
    parts: &[f64],
) -> Result<(), Error> {
    let Some(bad) = parts.iter().position(|part| !part.is_finite()) else { return Ok(()) };
    let axis = ["x", "y", "z", "w"].get(bad).copied().unwrap_or("?");
    let what = format!("{field}.{axis} is {}, expected a finite number", parts[bad]);
    Err(at(stream, message, stamp_ns, what)
        .help("cut the recording before this time, or find why the sender had no number"))
}

/// An error with topic, index and time.
fn at<T>(stream: &Stream<T>, message: &RawMessage<'_>, time_ns: i64, what: String) -> Error {
    let since_s = time_ns.saturating_sub(stream.time_ns.first().copied().unwrap_or(time_ns)) as f64 * 1e-9;
    let index = stream.value.len();
    Error::new(what).place(format!("topic {}, message {index}, t = {since_s:.6} s after its first", message.topic))
}

fn push<T>(
    stream: &mut Stream<T>,
    clock: Clock,
    stamp_ns: i64,
    message: &RawMessage<'_>,
    value: T,
) -> Result<(), Error> {
    let signed = |time_ns: u64, name: &str| {
        i64::try_from(time_ns)
            .map_err(|_| at(stream, message, stamp_ns, format!("{name} = {time_ns} ns is beyond the year 2262")))
    };
    let log_ns = signed(message.log_time_ns, "log_time")?;
    let time_ns = match clock {
        Clock::Header => stamp_ns,
        Clock::Log => log_ns,
        Clock::Publish => signed(message.publish_time_ns, "publish_time")?,
    };
    if clock == Clock::Header && stamp_ns == 0 && stream.last_stamp_ns == Some(0) {
        let what = "header.stamp is 0 in successive messages: the sender does not set it".to_owned();
        return Err(at(stream, message, log_ns, what)
            .help("use the recorder's clock: clock = \"log\" in the map given with --map"));
    }
    let skew_ns = log_ns.saturating_sub(stamp_ns);
    stream.skew_ns =
        stream.skew_ns.map_or(Some((skew_ns, skew_ns)), |(least, most)| Some((least.min(skew_ns), most.max(skew_ns))));
    stream.last_stamp_ns = Some(stamp_ns);
    stream.time_ns.push(time_ns);
    stream.value.push(value);
    Ok(())
}
