//! The cell's side of real sockets: packets out, answers in, in virtual or in real time.
//!
//! | time | when a cycle ends |
//! |---|---|
//! | virtual | when every robot that was sent a frame has its answer; after `patience` without one, that answer counts as missing |
//! | virtual, and a fault has changed a frame or closed a port | the same, but after at most 50 ms: there may be no answer |
//! | real | the same, but at the latest when the next one begins; each packet is sent when its time has come |
//!
//! Within a cycle the F/T packets are sent before the frames. A datagram on loopback is in the receiver's socket when the call that
//! sends it returns: who has read the frame finds all readings of the cycle. Over TCP a frame may come in pieces, of which the last
//! is sent after the readings too; an answer is there when its last piece is.
//!
//! Sensors are reached as their protocol has it ([`super::sensor_link`]). Over TCP the cell connects when the controller has asked the sensor for its stream, and tries again until somebody listens.

use super::clock::WallClock;
use super::config::Cell;
use super::intruder::{Intruder, Sockets};
use super::link::Calling;
use super::net_faults::NetFaults;
use super::page_server::PageServer;
use super::process::Started;
use super::run::{Answers, FaultAccount, Peer};
use super::sensor_link::SensorPort;
use super::virtual_cell::{Line, Moment, Packet};
use crate::error::Error;
use drivers::fault::Stream;
use drivers::ft::{AnyDevice, Device as _};
use drivers::net::{Arrival, Clock, wait};
use drivers::rsi::{Frames, Transport, split};
use serde::Serialize;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

/// How long one look at the sockets may take, so that a controller that has died is noticed.
const LOOK: Duration = Duration::from_millis(50);

/// How long an answer to a frame is waited for that a fault has changed. Below the 100 ms after which a sensor's reader takes its
/// stream for dead and starts it again, so that such a wait shows in nothing else.
const DOUBT: Duration = Duration::from_millis(50);

/// How long one attempt to connect may take: a machine that is there answers within milliseconds. Chosen.
const CONNECT: Duration = Duration::from_secs(1);

/// How the cycles follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As fast as the controller answers.
    Virtual {
        /// How long an answer may take.
        patience: Duration,
    },
    /// One cycle in each period of this length.
    Real(Nanos),
}

/// How well the time was kept.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Timing {
    /// Cycles that were sent.
    pub cycles: u64,
    /// Sum of how late frames were sent, in ns, and the latest.
    pub late_ns: [i64; 2],
    /// Answers that came within their cycle, how long they took in all, and the slowest, in ns.
    pub answers: (u64, [i64; 2]),
    /// Frames without an answer within their cycle.
    pub missing: u64,
    /// Time that was not spent waiting, in ns.
    pub busy_ns: i64,
    /// Time from the first cycle to the last, in ns.
    pub total_ns: i64,
}

/// Where a cell and a controller meet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Addresses {
    /// Where the computer is bound, for each robot.
    pub robots: Vec<SocketAddr>,
    /// Where the sensor is.
    pub sensor: SocketAddr,
    /// Where its page is, if it has one.
    pub page: Option<SocketAddr>,
}

impl Addresses {
    /// As the cell says them.
    pub fn of(cell: &Cell) -> Self {
        let robots = cell.config.robots.iter().map(|robot| robot.listen).collect();
        Addresses { robots, sensor: cell.config.sensor.address, page: cell.config.sensor.page }
    }
}

/// One robot's link. Over TCP documents go into a stream and are cut out of one.
pub(super) struct Robot {
    name: String,
    pub(super) address: SocketAddr,
    pub(super) link: Calling,
    /// What is said and what is heard; the form of the length before a document is the controller's own, whatever is heard.
    streams: Option<[Frames; 2]>,
    has_length: bool,
}

impl Robot {
    fn of(cell: &Cell, nth: usize, address: SocketAddr) -> Result<Self, Error> {
        let config = cell.driven(nth)?;
        let stream = || Frames::new(config.length_prefix);
        Ok(Robot {
            name: cell.config.robots[nth].name.clone(),
            address,
            link: Calling::to(address, config.protocol)?,
            streams: (config.protocol == Transport::Tcp).then(|| [stream(), stream()]),
            has_length: config.length_prefix,
        })
    }

    /// A packet as it goes on the wire.
    pub(super) fn framed(&self, packet: &[u8]) -> Vec<u8> {
        let Some([said, _]) = self.streams.as_ref().filter(|_| self.has_length) else { return packet.to_vec() };
        let documents: Result<Vec<_>, _> = split(packet).into_iter().collect();
        // What a fault has made of it is no document: it goes as it is, with its own length.
        documents.map_or_else(|_| said.wrap(packet), |all| all.iter().flat_map(|one| said.wrap(one)).collect())
    }

    /// The answers in what has come. What is no document has the place of one in which there is nothing: the robot controller
    /// takes neither.
    fn answers(&mut self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let Some([_, heard]) = &mut self.streams else { return vec![bytes] };
        heard.documents(&bytes).into_iter().map(Result::unwrap_or_default).collect()
    }
}

/// See the module.
pub struct Wires {
    robots: Vec<Robot>,
    sensor: SensorPort,
    /// Somebody has connected to a sensor that streams unasked.
    is_read: bool,
    page: Option<PageServer>,
    intruder: Intruder,
    clock: WallClock,
    pace: Pace,
    /// How long to wait for the controller to come.
    ready: Duration,
    child: Option<Started>,
    ends: Box<dyn Fn() -> bool + Send>,
    /// Tells a request from noise.
    device: Option<AnyDevice>,
    begun: Option<Nanos>,
    waited_ns: i64,
    arrivals: Vec<Arrival>,
    /// How well the time was kept.
    pub timing: Timing,
}

impl Wires {
    /// Binds the sensor's port, and one for each robot's controller that sends datagrams.
    ///
    /// # Errors
    /// When a port is in use, or an Ethernet configuration is wrong.
    pub fn bind(cell: &Cell, addresses: &Addresses, pace: Pace, ready: Duration) -> Result<Self, Error> {
        let robots = addresses.robots.iter().enumerate().map(|(nth, address)| Robot::of(cell, nth, *address));
        let robots = robots.collect::<Result<_, _>>()?;
        let sensor = SensorPort::bind(addresses.sensor, cell.sensor()?.transport())?;
        Ok(Wires {
            robots,
            sensor,
            is_read: false,
            page: addresses.page.map(PageServer::bind).transpose()?,
            intruder: Intruder::default(),
            clock: WallClock::new(),
            pace,
            ready,
            child: None,
            ends: Box::new(|| false),
            device: None,
            begun: None,
            waited_ns: 0,
            arrivals: Vec::new(),
            timing: Timing::default(),
        })
    }

    /// Where the sensor really is.
    pub fn sensor(&self) -> SocketAddr {
        self.sensor.local()
    }

    /// Where its page really is.
    pub fn page(&self) -> Option<SocketAddr> {
        self.page.as_ref().map(PageServer::local)
    }

    /// Watches this program: when it ends, the run does.
    pub fn watch(&mut self, child: Started) {
        self.child = Some(child);
    }

    /// Ends the run when this says so.
    pub fn end_when(&mut self, ends: impl Fn() -> bool + Send + 'static) {
        self.ends = Box::new(ends);
    }

    /// The program that was watched.
    pub fn release(&mut self) -> Option<Started> {
        self.child.take()
    }

    /// Looks at all sockets once, for at most `limit`.
    fn look(&mut self, limit: Duration, answers: &mut Answers) -> Result<(), Error> {
        let before = self.clock.now();
        let robots = self.robots.iter().filter_map(|robot| robot.link.socket());
        let page = self.page.iter().map(|page| page.listener() as &dyn AsFd);
        let sockets: Vec<&dyn AsFd> = robots.chain([self.sensor.socket()]).chain(page).collect();
        wait(&sockets, limit.min(LOOK)).map_err(|error| Error::new(format!("cannot wait for the sockets: {error}")))?;
        self.waited_ns += (self.clock.now() - before).0;
        let clock = self.clock;
        let now = || clock.now();
        for (nth, robot) in self.robots.iter_mut().enumerate() {
            robot.link.receive(&now, &mut self.arrivals)?;
            for arrival in self.arrivals.drain(..) {
                match arrival {
                    Arrival::Bytes { bytes, .. } => {
                        let heard = robot.answers(bytes).into_iter().filter(|answer| self.intruder.hears(nth, answer));
                        answers.replies.extend(heard.map(|answer| (nth, answer)));
                    }
                    Arrival::Stranger { .. } => self.intruder.heard_stranger(),
                    // Nobody is there any more.
                    Arrival::Unreachable { .. } | Arrival::Closed { .. } => answers.gone = true,
                    _ => {}
                }
            }
        }
        let mut is_request = |bytes: &[u8]| self.device.as_ref().is_some_and(|device| device.is_request(bytes));
        let is_connected = self.sensor.receive(&now, &mut is_request, &mut self.arrivals)?;
        self.is_read |= is_connected && self.device.as_ref().is_some_and(|device| device.streams());
        for arrival in std::mem::take(&mut self.arrivals) {
            let (bytes, from) = match arrival {
                Arrival::Bytes { bytes, from, .. } => (bytes, from),
                Arrival::Stranger { .. } | Arrival::Invalid { .. } => {
                    self.intruder.heard_stranger();
                    continue;
                }
                _ => continue,
            };
            let (intruder, mut sockets) = self.disturbed(&now);
            if intruder.asked(from, &bytes, &mut sockets)? {
                answers.requests.push(bytes);
            }
        }
        let (intruder, mut sockets) = self.disturbed(&now);
        intruder.tick(&mut sockets)?;
        if let Some(page) = &mut self.page {
            page.look(&now, &mut |number| self.intruder.faults.request(Stream::Http, number))?;
        }
        if self.child.as_mut().is_some_and(|child| child.has_ended()) {
            answers.gone = true;
        }
        answers.interrupted |= (self.ends)();
        Ok(())
    }

    fn disturbed<'s>(&'s mut self, clock: Clock<'s>) -> (&'s mut Intruder, Sockets<'s>) {
        let Wires { intruder, robots, sensor, .. } = self;
        (intruder, Sockets { clock, robots, sensor })
    }

    /// What faults do before the packets of this moment are sent.
    fn disturb(&mut self, moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        let clock = self.clock;
        let now = || clock.now();
        let (intruder, mut sockets) = self.disturbed(&now);
        intruder.open(&mut sockets)?;
        let steals = intruder.steals(moment, &mut sockets)?;
        if let Pace::Virtual { patience } = self.pace {
            let end = clock.now() + nanos(patience);
            // Time stands still until the thief's request is here, or the computer has noticed and asks again.
            while self.intruder.awaits_request() != steals && clock.now() < end && !answers.gone && !answers.interrupted
            {
                self.look(LOOK, answers)?;
            }
        }
        let (intruder, mut sockets) = self.disturbed(&now);
        intruder.disturb(moment, packets, &mut sockets)
    }

    fn send(&mut self, packet: &Packet) -> Result<(), Error> {
        let clock = self.clock;
        let now = || clock.now();
        if let Line::Robot(nth) = packet.line {
            let robot = &mut self.robots[nth];
            let bytes = robot.framed(&packet.bytes);
            return robot.link.send(&now, &bytes, &mut self.arrivals);
        }
        self.sensor.send(&now, &packet.bytes)
    }

    /// Connects the robots that speak TCP, and waits until somebody listens for them.
    fn connect(&mut self, limit: Nanos, answers: &mut Answers) -> Result<(), Error> {
        for nth in 0..self.robots.len() {
            while let Err(error) = self.robots[nth].link.connect(CONNECT) {
                let Robot { name, address, .. } = &self.robots[nth];
                if answers.gone || answers.interrupted {
                    return Err(Error::new(format!("the controller ended before it listened at {address} for {name}"))
                        .place("argument --controller")
                        .help("its own output says why"));
                }
                if self.clock.now() > limit {
                    let what = format!("nobody listens at {address} for {name} within {:?}: {error}", self.ready);
                    let help =
                        "start the controller; its Ethernet configuration says TCP, so that the robot connects to it";
                    return Err(Error::new(what).help(help));
                }
                self.look(LOOK, answers)?;
            }
        }
        Ok(())
    }

    /// Waits until this time, and hears what comes meanwhile.
    fn wait_until(&mut self, time: Nanos, answers: &mut Answers) -> Result<(), Error> {
        loop {
            let left = time - self.clock.now();
            if left.0 <= 0 || answers.gone || answers.interrupted {
                return Ok(());
            }
            self.look(Duration::from_nanos(left.0.unsigned_abs()), answers)?;
        }
    }

    /// Waits until every robot has as many answers as it sent frames, or until the end of the cycle.
    fn collect(&mut self, sent: Nanos, end: Nanos, expected: &mut [u64], answers: &mut Answers) -> Result<(), Error> {
        let mut seen = answers.replies.len();
        loop {
            let now = self.clock.now();
            for (nth, _) in &answers.replies[seen..] {
                if expected[*nth] > 0 {
                    expected[*nth] -= 1;
                    let took_ns = (now - sent).0;
                    let (count, [sum_ns, most_ns]) = self.timing.answers;
                    self.timing.answers = (count + 1, [sum_ns + took_ns, most_ns.max(took_ns)]);
                }
            }
            seen = answers.replies.len();
            let is_done = expected.iter().all(|missing| *missing == 0);
            if is_done || answers.gone || answers.interrupted || now >= end {
                self.timing.missing += expected.iter().sum::<u64>();
                return Ok(());
            }
            self.look(Duration::from_nanos((end - now).0.unsigned_abs()), answers)?;
        }
    }
}

fn nanos(time: Duration) -> Nanos {
    Nanos(i64::try_from(time.as_nanos()).unwrap_or(i64::MAX / 2))
}

impl Peer for Wires {
    fn equip(&mut self, cell: &Cell, faults: NetFaults) -> Result<(), Error> {
        if let Some(page) = &mut self.page {
            page.show(cell.sensor()?.page().map_err(|error| cell.sensor_error(&error))?);
        }
        if self.sensor.datagrams().is_none() {
            faults.refused_on_stream(cell)?;
        }
        self.device = Some(cell.sensor()?.device().map_err(|error| cell.sensor_error(&error))?);
        self.intruder = Intruder::default();
        self.intruder.faults = faults;
        Ok(())
    }

    fn account(&mut self) -> (BTreeMap<&'static str, u64>, Vec<FaultAccount>) {
        (std::mem::take(&mut self.intruder.events), self.intruder.faults.accounts())
    }

    fn begin(&mut self, greetings: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        let limit = nanos(self.ready);
        while answers.requests.is_empty() && !self.is_read {
            if answers.interrupted {
                return Err(Error::new("ended by a signal before a controller came"));
            }
            if answers.gone {
                return Err(Error::new("the controller ended before it asked for the sensor's stream")
                    .place("argument --controller")
                    .help("its own output says why"));
            }
            if self.clock.now() > limit {
                let what =
                    format!("nobody asked the sensor at {} for its stream within {:?}", self.sensor(), self.ready);
                return Err(Error::new(what)
                    .help("start the controller: it binds the ports of the robots, then asks the sensor to start"));
            }
            self.look(LOOK, answers)?;
        }
        self.connect(limit, answers)?;
        greetings.iter().try_for_each(|packet| self.send(packet))
    }

    fn exchange(&mut self, moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        self.disturb(moment, packets, answers)?;
        let cycle = moment.cycle;
        let begun = match self.begun {
            Some(begun) => begun,
            None => {
                self.waited_ns = 0;
                *self.begun.insert(self.clock.now())
            }
        };
        let mut expected = vec![0; self.robots.len()];
        let mut sent = None;
        for packet in packets {
            if let Pace::Real(_) = self.pace {
                self.wait_until(begun + packet.at, answers)?;
            }
            if let Line::Robot(nth) = packet.line {
                expected[nth] += 1;
                sent.get_or_insert_with(|| self.clock.now());
            }
            self.send(packet)?;
        }
        let sent = sent.unwrap_or_else(|| self.clock.now());
        let end = match self.pace {
            Pace::Virtual { patience } => {
                let is_sound = packets.iter().all(|packet| packet.is_sound) && !self.intruder.is_in_doubt();
                sent + nanos(if is_sound { patience } else { patience.min(DOUBT) })
            }
            Pace::Real(period) => {
                let late_ns = (sent - begun).0 - cycle as i64 * period.0;
                let [sum_ns, most_ns] = self.timing.late_ns;
                self.timing.late_ns = [sum_ns + late_ns, most_ns.max(late_ns)];
                begun + Nanos((cycle as i64 + 1) * period.0)
            }
        };
        self.collect(sent, end, &mut expected, answers)?;
        self.timing.cycles += 1;
        self.timing.total_ns = (self.clock.now() - begun).0;
        self.timing.busy_ns = self.timing.total_ns - self.waited_ns;
        Ok(())
    }
}
