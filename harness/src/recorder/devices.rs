//! The decoders of a cell. What they find waits until the answer is on its way: writing it down comes second.

use super::heard::Heard;
use super::session::Recorder;
use crate::cell::Cell;
use crate::error::Error;
use drivers::ft::{AnySensor, Event as SensorEvent, Sample, Sensor, netft_tcp};
use drivers::rsi::{
    Corrections, EthernetConfig, Event as RobotEvent, Frame, Frames, Host, HostOptions, Malformed, Root, Telegram,
    split,
};
use sim_core::time::Nanos;
use std::io::Write;

/// What was found, in order.
#[derive(Debug, Clone)]
enum Note {
    Frame(usize, Box<Frame>),
    /// The flag: the controller takes replies of its type.
    Reply(usize, Nanos, Telegram, bool),
    Sample(Sample),
    SensorRestarted,
    Event(Nanos, String, &'static str, String),
}

/// Decoders of all that a cell's wires carry.
#[derive(Debug, Clone)]
pub struct Devices {
    hosts: Vec<Host>,
    /// Streams from and to each robot, where it speaks TCP.
    streams: Vec<[Frames; 2]>,
    sensor: AnySensor,
    heard: Heard,
    /// Names of the robots.
    names: Vec<String>,
    notes: Vec<Note>,
}

/// Which way bytes go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the robot controller.
    FromRobot,
    /// To the robot controller.
    ToRobot,
}

impl Devices {
    /// The decoders that a cell asks for. `answers` is whether this program is the one that answers the robots.
    ///
    /// # Errors
    /// When a configuration of a robot or the sensor cannot be used, or is one that moves the robot on a lost packet.
    pub fn of(cell: &Cell, answers: bool) -> Result<Self, Error> {
        let mut hosts = Vec::new();
        let mut streams = Vec::new();
        for (nth, robot) in cell.config.robots.iter().enumerate() {
            let (config, mode) = (cell.ethernet(nth)?, robot.mode.into());
            if answers {
                config.check(mode).map_err(|dangerous| {
                    Error::new(dangerous.to_string())
                        .file(&cell.rsi[nth].file)
                        .help("correct HOLDON, or record without taking part: --as tap")
                })?;
            }
            streams.push([Frames::new(config.length_prefix), Frames::new(config.length_prefix)]);
            let options = HostOptions { decimals: robot.decimals, mode, answers, ..HostOptions::default() };
            hosts.push(Host::new(config, options));
        }
        let sensor = cell.sensor()?.sensor().map_err(|error| cell.sensor_error(&error))?;
        let names = cell.config.robots.iter().map(|robot| robot.name.clone()).collect();
        Ok(Devices { hosts, streams, sensor, heard: Heard::default(), names, notes: Vec::new() })
    }

    /// What has come from the sensor.
    pub fn heard(&self) -> &Heard {
        &self.heard
    }

    /// The configuration by which a robot speaks.
    pub fn config(&self, robot: usize) -> &EthernetConfig {
        self.hosts[robot].config()
    }

    /// A datagram between a robot controller and its PC. True: there is a fresh frame in it.
    pub fn datagram(&mut self, robot: usize, way: Way, at: Nanos, bytes: &[u8]) -> bool {
        self.documents(robot, way, at, split(bytes))
    }

    /// A robot has connected anew: what waits for its end will not get it.
    pub fn connected(&mut self, robot: usize) {
        self.streams[robot] = std::array::from_fn(|_| Frames::new(self.hosts[robot].config().length_prefix));
    }

    /// A piece of the stream between them; `is_new` where it does not follow on what came before.
    pub fn stream(&mut self, robot: usize, way: Way, at: Nanos, bytes: &[u8], is_new: bool) -> bool {
        let prefix = self.hosts[robot].config().length_prefix;
        let frames = &mut self.streams[robot][usize::from(way == Way::ToRobot)];
        if is_new {
            *frames = Frames::new(prefix);
        }
        let documents = frames.documents(bytes);
        self.documents(robot, way, at, documents)
    }

    fn documents(&mut self, robot: usize, way: Way, at: Nanos, documents: Vec<Result<Vec<u8>, Malformed>>) -> bool {
        let mut is_fresh = false;
        for document in documents {
            match way {
                Way::FromRobot => is_fresh |= self.heard_from_robot(robot, at, document),
                Way::ToRobot => self.heard_for_robot(robot, at, document),
            }
        }
        is_fresh
    }

    fn heard_from_robot(&mut self, robot: usize, at: Nanos, document: Result<Vec<u8>, Malformed>) -> bool {
        let (mut events, host) = (Vec::new(), &mut self.hosts[robot]);
        let frame = match document {
            Ok(document) => host.receive(at, &document, &mut events),
            Err(malformed) => {
                host.malformed(malformed, &mut events);
                None
            }
        };
        self.robot_events(robot, at, &events);
        let is_fresh = frame.is_some();
        self.notes.extend(frame.map(|frame| Note::Frame(robot, Box::new(frame))));
        is_fresh
    }

    fn heard_for_robot(&mut self, robot: usize, at: Nanos, document: Result<Vec<u8>, Malformed>) {
        let name = self.names[robot].clone();
        let mut event = |class, text| self.notes.push(Note::Event(at, name.clone(), class, text));
        match document.and_then(|document| Telegram::decode(&document)) {
            Ok(telegram) if telegram.root == Root::Sen => {
                let wanted = &self.hosts[robot].config().sentype;
                let is_of_type = telegram.kind == *wanted;
                if !is_of_type {
                    let kind = &telegram.kind;
                    let text = format!("a reply of type {kind:?}: the controller takes {wanted:?} and drops others");
                    event("reply-type", text);
                }
                self.notes.push(Note::Reply(robot, at, telegram, is_of_type));
            }
            Ok(_) => event("reply-malformed", "a <Rob> on its way to the robot".to_owned()),
            Err(malformed) => event("reply-malformed", malformed.to_string()),
        }
    }

    /// The reply with zero corrections that the newest frame wants, or that a repeated one wants again.
    ///
    /// # Errors
    /// When the configuration takes no reply.
    pub fn answer(&mut self, robot: usize, is_fresh: bool) -> Result<Option<Vec<u8>>, Error> {
        let host = &mut self.hosts[robot];
        if host.config().only_send {
            return Ok(None);
        }
        if !is_fresh {
            return Ok(host.repeat().map(<[u8]>::to_vec));
        }
        let reply = host.reply(&Corrections::none());
        reply.map(Some).map_err(|error| Error::new(error.to_string()).place(format!("robot {}", self.names[robot])))
    }

    /// A document as it goes on a stream.
    pub fn framed(&self, robot: usize, document: &[u8]) -> Vec<u8> {
        self.streams[robot][0].wrap(document)
    }

    /// What to send so that the sensor streams, or stops.
    pub fn sensor_requests(&mut self, starts: bool) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        if starts {
            self.sensor.start(&mut out)
        } else {
            self.sensor.stop(&mut out)
        }
        out
    }

    /// The requests that set the sensor's zero at its present load, and make it stream.
    ///
    /// # Errors
    /// Where its protocol has no such request.
    pub fn sensor_bias(&mut self, at: Nanos) -> Result<Vec<Vec<u8>>, Error> {
        let (mut out, mut events) = (Vec::new(), Vec::new());
        self.sensor.bias(true, &mut out, &mut events).map_err(|error| {
            let help = "leave --bias out, or set its zero with the tools of its maker before";
            Error::new(error.to_string()).place("argument --bias").help(help)
        })?;
        self.sensor_events(at, events);
        Ok(out)
    }

    /// Bytes that somebody else sends to the sensor.
    pub fn asked(&mut self, at: Nanos, bytes: &[u8]) {
        let mut events = Vec::new();
        self.sensor.overhear(bytes, &mut events);
        self.sensor_events(at, events);
    }

    /// The same on the connection beside its datagrams that an ATI Net F/T has.
    pub fn asked_beside(&mut self, at: Nanos, bytes: &[u8]) {
        if matches!(self.sensor, AnySensor::Rdt(_)) {
            self.sensor_events(at, netft_tcp::overhear(bytes));
        }
    }

    /// Bytes from the sensor.
    pub fn sensed(&mut self, at: Nanos, bytes: &[u8]) {
        let mut events = Vec::new();
        self.sensor.receive(at, bytes, &mut events);
        self.heard.take(bytes.len(), &events);
        self.sensor_events(at, events);
    }

    /// Something that the network said.
    pub fn event(&mut self, at: Nanos, source: &str, class: &'static str, text: String) {
        self.notes.push(Note::Event(at, source.to_owned(), class, text));
    }

    /// Time passes: silences are noticed. What the sensor is to be asked again comes out.
    pub fn tick(&mut self, now: Nanos) -> Vec<Vec<u8>> {
        for robot in 0..self.hosts.len() {
            let mut events = Vec::new();
            self.hosts[robot].tick(now, &mut events);
            self.robot_events(robot, now, &events);
        }
        let (mut events, mut requests) = (Vec::new(), Vec::new());
        self.sensor.tick(now, &mut requests, &mut events);
        self.sensor_events(now, events);
        requests
    }

    /// Writes down what was found since the last time.
    ///
    /// # Errors
    /// When the session does not take it.
    pub fn write<W: Write>(&mut self, recorder: &mut Recorder<W>) -> Result<(), Error> {
        for note in self.notes.drain(..) {
            match note {
                Note::Frame(robot, frame) => recorder.frame(robot, &frame)?,
                Note::Reply(robot, at, telegram, is_of_type) => recorder.reply(robot, at, &telegram, is_of_type)?,
                Note::Sample(sample) => recorder.sample(&sample)?,
                Note::SensorRestarted => recorder.sensor_restarted(),
                Note::Event(at, source, class, text) => recorder.event(at, &source, class, &text)?,
            }
        }
        Ok(())
    }

    fn robot_events(&mut self, robot: usize, at: Nanos, events: &[RobotEvent]) {
        let note = |event: &RobotEvent| Note::Event(at, self.names[robot].clone(), event.class(), event.to_string());
        self.notes.extend(events.iter().map(note));
    }

    fn sensor_events(&mut self, at: Nanos, events: Vec<SensorEvent>) {
        for event in events {
            if matches!(event, SensorEvent::ClockRestart { .. }) {
                self.notes.push(Note::SensorRestarted);
            }
            self.notes.push(match event {
                SensorEvent::Sample(sample) => Note::Sample(sample),
                other => Note::Event(at, "ft".to_owned(), other.class(), other.to_string()),
            });
        }
    }
}
