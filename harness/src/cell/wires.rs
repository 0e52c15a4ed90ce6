//! The cell's side of real sockets: packets out, answers in, in virtual or in real time.
//!
//! | time | when a cycle ends |
//! |---|---|
//! | virtual | when every frame has its answer; after `patience` without one, that answer counts as missing |
//! | virtual, and a fault has changed a frame or closed a port | the same, but after at most 50 ms: there may be no answer |
//! | real | the same, but at the latest when the next one begins, or one cycle after the frame if that was late; each packet is sent
//!   when its time has come |
//!
//! Within a cycle the F/T packets are sent before the frames. A datagram on loopback is in the receiver's socket when the call that
//! sends it returns: who has read the frame finds all readings of the cycle. Over TCP a frame may come in pieces, of which the last
//! is sent after the readings too; an answer is there when its last piece is.
//!
//! In virtual time a controller is quick: of several frames for one robot, each is answered before the next is sent. An answer that
//! comes a second time goes nowhere then, since when it comes is chance; in real time it goes to the robot, as on a network.
//!
//! Sensors are reached as their protocol has it (`sensor_link`). Over TCP the cell connects when the controller has asked
//! the sensor for its stream, and tries again until somebody listens.

use super::clock::WallClock;
use super::config::Cell;
use super::intruder::{Intruder, Sockets};
use super::link::Calling;
use super::net_faults::NetFaults;
use super::page_server::PageServer;
use super::process::Started;
use super::run::{Answers, FaultAccount, Peer};
use super::sensor_link::SensorPort;
use super::timing::Timing;
use super::virtual_cell::{Line, Moment, Packet};
use super::waiting::{Heard, Waiting};
use crate::error::Error;
use drivers::fault::Stream;
use drivers::ft::{AnyDevice, Device as _};
use drivers::net::{Arrival, Clock, wait};
use drivers::rsi::{Frames, Transport, split};
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::ops::Range;
use std::os::fd::AsFd;
use std::time::Duration;

/// How long one look at the sockets may take, so that a controller that has died is noticed.
const LOOK: Duration = Duration::from_millis(50);

/// How long an answer is waited for awake, in virtual time. Chosen: longer than a controller takes that waits for nobody else.
const AWAKE: Nanos = Nanos(300_000);

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
    waiting: Waiting,
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
            waiting: Waiting::default(),
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
    tells: Box<dyn Fn(&str) + Send>,
    /// Cycles without an answer until now, one after the other.
    silent: u64,
    /// Tells a request from noise.
    device: Option<AnyDevice>,
    begun: Option<Nanos>,
    waited_ns: i64,
    arrivals: Vec<Arrival>,
    /// Who asked the sensor last.
    reader: Option<SocketAddr>,
    /// What the sockets saw, by class.
    seen: BTreeMap<&'static str, u64>,
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
            tells: Box::new(|_| {}),
            silent: 0,
            device: None,
            begun: None,
            waited_ns: 0,
            arrivals: Vec::new(),
            reader: None,
            seen: BTreeMap::new(),
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

    /// Tells here that no answer comes.
    pub fn tell(&mut self, tells: impl Fn(&str) + Send + 'static) {
        self.tells = Box::new(tells);
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
        let failed = |error| Error::new(format!("cannot wait for the sockets: {error}"));
        let mut is_there = false;
        if let Pace::Virtual { .. } = self.pace {
            // Whoever sleeps is woken late: a quick answer is met awake, and others may run meanwhile.
            while !is_there && self.clock.now() - before < AWAKE {
                is_there = wait(&sockets, Duration::ZERO).map_err(failed)?.contains(&true);
                std::thread::yield_now();
            }
        }
        if !is_there {
            wait(&sockets, limit.min(LOOK)).map_err(failed)?;
        }
        self.waited_ns += (self.clock.now() - before).0;
        let clock = self.clock;
        let now = || clock.now();
        for (nth, robot) in self.robots.iter_mut().enumerate() {
            robot.link.receive(&now, &mut self.arrivals)?;
            for arrival in self.arrivals.drain(..) {
                match arrival {
                    Arrival::Bytes { bytes, .. } => {
                        for answer in robot.answers(bytes).into_iter().filter(|answer| self.intruder.hears(nth, answer))
                        {
                            match robot.waiting.heard(&answer) {
                                Heard::Answer(sent) => self.timing.answers_in_time.add(clock.now() - sent),
                                Heard::Spare if matches!(self.pace, Pace::Virtual { .. }) => {
                                    *self.seen.entry("cell-spare-answer").or_default() += 1;
                                    continue;
                                }
                                _ => {}
                            }
                            answers.replies.push((nth, answer));
                        }
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
                if self.reader.replace(from).is_some_and(|reader| reader != from) {
                    *self.seen.entry("cell-reader-changed").or_default() += 1;
                }
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
                if answers.interrupted {
                    return Ok(());
                }
                if answers.gone {
                    return Err(Error::new(format!("the controller ended before it listened at {address} for {name}"))
                        .place("argument --controller")
                        .help("its own output says why"));
                }
                if self.clock.now() > limit {
                    let what = format!(
                        "nobody listens at {address} for {name} within {} s: {error}",
                        self.ready.as_secs_f64()
                    );
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

    /// Waits until the frames of these robots have their answers, or until the end.
    fn collect(&mut self, robots: Range<usize>, end: Nanos, answers: &mut Answers) -> Result<(), Error> {
        loop {
            let waits = self.robots[robots.clone()].iter().any(|robot| robot.waiting.waits());
            let left = end - self.clock.now();
            if !waits || answers.gone || answers.interrupted || left.0 <= 0 {
                let given_up = self.robots[robots].iter_mut().filter_map(|robot| robot.waiting.give_up().then_some(()));
                let given_up = given_up.count() as u64 * u64::from(!answers.interrupted);
                self.timing.late_or_missing += given_up;
                self.silent = if given_up > 0 { self.silent + 1 } else { 0 };
                if let (Pace::Virtual { patience }, 1..) = (self.pace, self.silent) {
                    (self.tells)(&format!("no answer in {} cycles, each waited for {patience:?}", self.silent));
                }
                return Ok(());
            }
            self.look(Duration::from_nanos(left.0.unsigned_abs()), answers)?;
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
        let mut events = std::mem::take(&mut self.intruder.events);
        events.append(&mut self.seen);
        (events, self.intruder.faults.accounts())
    }

    fn begin(&mut self, greetings: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        let limit = nanos(self.ready);
        while answers.requests.is_empty() && !self.is_read {
            if answers.interrupted {
                return Ok(());
            }
            if answers.gone {
                return Err(Error::new("the controller ended before it asked for the sensor's stream")
                    .place("argument --controller")
                    .help("its own output says why"));
            }
            if self.clock.now() > limit {
                let what = format!(
                    "nobody asked the sensor at {} for its stream within {} s",
                    self.sensor(),
                    self.ready.as_secs_f64()
                );
                return Err(Error::new(what)
                    .help("start the controller: it binds the ports of the robots, then asks the sensor to start"));
            }
            self.look(LOOK, answers)?;
        }
        self.connect(limit, answers)?;
        if answers.interrupted {
            return Ok(());
        }
        greetings.iter().try_for_each(|packet| self.send(packet))
    }

    fn exchange(&mut self, moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        self.disturb(moment, packets, answers)?;
        let begun = match self.begun {
            Some(begun) => begun,
            None => {
                self.waited_ns = 0;
                *self.begun.insert(self.clock.now())
            }
        };
        let mut sent = None;
        let mut is_sound = true;
        for packet in packets {
            if let Pace::Real(_) = self.pace {
                self.wait_until(begun + packet.at, answers)?;
            }
            let Line::Robot(nth) = packet.line else {
                self.send(packet)?;
                continue;
            };
            if let (true, Pace::Virtual { patience }) = (self.robots[nth].waiting.waits(), self.pace) {
                let end = self.clock.now() + nanos(if is_sound { patience } else { patience.min(DOUBT) });
                self.collect(nth..nth + 1, end, answers)?;
            }
            is_sound &= packet.is_sound && !self.intruder.is_in_doubt();
            let now = self.clock.now();
            sent.get_or_insert(now);
            self.robots[nth].waiting.sent(&packet.bytes, now);
            self.send(packet)?;
        }
        let sent = sent.unwrap_or_else(|| self.clock.now());
        let end = match self.pace {
            Pace::Virtual { patience } => {
                self.clock.now() + nanos(if is_sound { patience } else { patience.min(DOUBT) })
            }
            Pace::Real(period) => {
                self.timing.sent_late.add(sent - begun - Nanos(moment.cycle as i64 * period.0));
                // That a frame was sent late is not the controller's fault.
                (begun + Nanos((moment.cycle as i64 + 1) * period.0)).max(sent + period)
            }
        };
        self.collect(0..self.robots.len(), end, answers)?;
        self.timing.cycles += 1;
        self.timing.total_ns = (self.clock.now() - begun).0;
        self.timing.busy_ns = self.timing.total_ns - self.waited_ns;
        Ok(())
    }
}
