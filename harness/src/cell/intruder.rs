//! Whoever disturbs the sockets of a cell: strangers, a second client of the sensor, ports that close. What each fault means:
//! [`super::net_faults`].

use super::link::{Calling, bind_again, failed, towards};
use super::net_faults::NetFaults;
use super::sensor_link::SensorPort;
use super::virtual_cell::{Line, Moment, Packet};
use super::wires::Robot;
use crate::error::Error;
use drivers::fault::{Needs, Stream};
use drivers::net::{Arrival, Clock, Endpoint, Lock};
use drivers::rsi::{Telegram, Transport};
use sim_core::time::Nanos;
use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::time::Duration;

/// How long the sensor's port stays closed. Chosen: a reader asks again every 100 ms.
const CLOSED: Nanos = Nanos(250_000_000);
/// How long a stranger may take to connect. Chosen.
const CONNECT: Duration = Duration::from_secs(1);
/// Stamps that are remembered: an answer is at most some cycles late.
const UNANSWERED_MAX: usize = 1024;
/// What a stranger says where nobody has said anything yet.
const STRANGE: &[u8] = b"<Sen Type=\"Stranger\"></Sen>";

/// See the module.
#[derive(Default)]
pub(super) struct Intruder {
    pub faults: NetFaults,
    /// By stream and robot: one stranger sends again from the same port.
    strangers: BTreeMap<(Stream, usize), Calling>,
    thief: Option<Endpoint>,
    /// The thief has the sensor's stream.
    pub holds_stream: bool,
    /// The sensor's port is closed until then.
    closed_until: Option<Nanos>,
    /// The computer's request met the closed port, and it has not asked again.
    unheard: bool,
    /// Robots whose port is closed in this cycle.
    closed: BTreeSet<usize>,
    /// Stamps of frames whose answers met a closed port.
    unanswered: BTreeSet<(usize, u64)>,
    answers: BTreeMap<usize, Vec<u8>>,
    request: Option<Vec<u8>>,
    requests: u64,
    /// The computer has answered a stranger: it may answer nobody else.
    pub is_taken: bool,
    pub events: BTreeMap<&'static str, u64>,
}

/// The sockets of the cell, for those who disturb them.
pub(super) struct Sockets<'s> {
    pub clock: Clock<'s>,
    pub robots: &'s mut [Robot],
    pub sensor: &'s mut SensorPort,
}

impl Intruder {
    /// An answer for a robot: whether it is heard, or met a closed port and came all the same, since the computer was slow.
    pub fn hears(&mut self, nth: usize, bytes: &[u8]) -> bool {
        let stamp = || Telegram::decode(bytes).ok()?.ipoc().map(|ipoc| ipoc.value);
        if !self.unanswered.is_empty() && stamp().is_some_and(|stamp| self.unanswered.contains(&(nth, stamp))) {
            return false;
        }
        if !self.faults.is_empty() {
            self.answers.insert(nth, bytes.to_vec());
        }
        true
    }

    /// A request at the sensor's port: whether it is heard.
    pub fn asked(&mut self, from: SocketAddr, bytes: &[u8], sockets: &mut Sockets<'_>) -> Result<bool, Error> {
        let number = self.requests;
        self.requests += 1;
        if self.faults.request(Stream::FtRequest, number).is_some() {
            let Some(sensor) = sockets.sensor.datagrams() else { return Ok(true) };
            sensor.refuse().map_err(failed)?;
            self.closed_until = Some((sockets.clock)() + CLOSED);
            self.unheard = true;
            return Ok(false);
        }
        self.holds_stream = self.thief.as_ref().is_some_and(|thief| thief.local().port() == from.port());
        self.unheard = false;
        if !self.holds_stream {
            self.request = Some(bytes.to_vec());
        }
        Ok(true)
    }

    /// Opens the sensor's port again when its time has come.
    pub fn tick(&mut self, sockets: &mut Sockets<'_>) -> Result<(), Error> {
        if self.closed_until.is_some_and(|until| (sockets.clock)() >= until) {
            self.closed_until = None;
            let sensor = sockets.sensor.datagrams();
            sensor.map_or(Ok(()), |sensor| bind_again(sensor, Lock::Latest)).map_err(failed)?;
        }
        Ok(())
    }

    /// Whether the computer is without the sensor and must ask for it again, before time goes on.
    pub fn awaits_request(&self) -> bool {
        self.unheard || self.holds_stream
    }

    /// Whether the next packets may have no answer.
    pub fn is_in_doubt(&self) -> bool {
        self.is_taken || !self.closed.is_empty()
    }

    /// Opens the robots' ports that were closed in the cycle before.
    pub fn open(&mut self, sockets: &mut Sockets<'_>) -> Result<(), Error> {
        for nth in std::mem::take(&mut self.closed) {
            sockets.robots[nth].link.open()?;
        }
        for stranger in self.strangers.values_mut() {
            let mut arrivals = Vec::new();
            stranger.receive(sockets.clock, &mut arrivals)?;
            let answers = arrivals.iter().filter(|arrival| matches!(arrival, Arrival::Bytes { .. })).count() as u64;
            if answers > 0 {
                self.is_taken = true;
                *self.events.entry("cell-stranger-answered").or_default() += answers;
            }
        }
        Ok(())
    }

    /// Does what is due before the packets of this moment are sent.
    pub fn disturb(&mut self, moment: &Moment, packets: &[Packet], sockets: &mut Sockets<'_>) -> Result<(), Error> {
        let sent = |line: Line| packets.iter().find(|packet| packet.line == line).map(|packet| packet.bytes.clone());
        for nth in 0..sockets.robots.len() {
            let frame = sent(Line::Robot(nth));
            for due in self.faults.due(Needs::ForeignSocket, Stream::RsiFrame, nth, moment) {
                let Some(frame) = &frame else { continue };
                let robot = &sockets.robots[nth];
                let to = (robot.address, robot.link.transport());
                self.strange(due, (Stream::RsiFrame, nth), to, &robot.framed(frame), sockets.clock)?;
            }
            for due in self.faults.due(Needs::ForeignSocket, Stream::RsiReply, nth, moment) {
                let answer = self.answers.get(&nth).map_or(STRANGE, Vec::as_slice).to_vec();
                let Some(robot) = sockets.robots[nth].link.local() else { continue };
                self.strange(due, (Stream::RsiReply, nth), (robot, Transport::Udp), &answer, sockets.clock)?;
            }
            for due in self.faults.due(Needs::ClosedPort, Stream::RsiReply, nth, moment) {
                let stamp = frame.as_deref().and_then(|frame| Telegram::decode(frame).ok()?.ipoc());
                let Some(stamp) = stamp else { continue };
                sockets.robots[nth].link.refuse()?;
                self.unanswered.insert((nth, stamp.value));
                if self.unanswered.len() > UNANSWERED_MAX {
                    self.unanswered.pop_first();
                }
                self.closed.insert(nth);
                self.faults.count(due);
            }
        }
        for due in self.faults.due(Needs::ForeignSocket, Stream::Ft, 0, moment) {
            let reader = sockets.sensor.datagrams().and_then(|sensor| sensor.peer());
            let (Some(record), Some(reader)) = (sent(Line::Sensor), reader) else { continue };
            self.strange(due, (Stream::Ft, 0), (reader, Transport::Udp), &record, sockets.clock)?;
        }
        Ok(())
    }

    /// Whether the second client is to ask in this moment, and has asked. Comes before [`Self::disturb`].
    pub fn steals(&mut self, moment: &Moment, sockets: &mut Sockets<'_>) -> Result<bool, Error> {
        self.faults.touched(moment.touched);
        let due = self.faults.due(Needs::SecondClient, Stream::Ft, 0, moment);
        let (false, Some(request)) = (due.is_empty(), self.request.clone()) else { return Ok(false) };
        due.into_iter().for_each(|due| self.faults.count(due));
        if !self.holds_stream {
            let sensor = sockets.sensor.local();
            let thief = match self.thief.take() {
                Some(thief) => thief,
                None => Endpoint::bind(towards(sensor), Lock::Only(sensor)).map_err(failed)?,
            };
            let thief = self.thief.insert(thief);
            thief.send(sockets.clock, &request, &mut Vec::new()).map_err(failed)?;
        }
        Ok(true)
    }

    fn strange(
        &mut self,
        due: usize,
        key: (Stream, usize),
        (to, transport): (SocketAddr, Transport),
        bytes: &[u8],
        clock: Clock<'_>,
    ) -> Result<(), Error> {
        let stranger = match self.strangers.remove(&key) {
            Some(stranger) => stranger,
            None => Calling::to(to, transport)?,
        };
        let stranger = self.strangers.entry(key).or_insert(stranger);
        // Over TCP each time anew: the computer hangs up.
        stranger.connect(CONNECT).map_err(failed)?;
        stranger.send(clock, bytes, &mut Vec::new())?;
        self.faults.count(due);
        Ok(())
    }

    /// A robot's port was spoken to by somebody who is not the computer.
    pub fn heard_stranger(&mut self) {
        *self.events.entry("cell-stranger").or_default() += 1;
    }
}
