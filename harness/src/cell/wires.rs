//! The cell's side of real sockets: packets out, answers in, in virtual or in real time.
//!
//! | time | when a cycle ends |
//! |---|---|
//! | virtual | when every robot that was sent a frame has its answer; after `patience` without one, that answer counts as missing |
//! | virtual, and a fault has changed a frame or closed a port | the same, but after at most 50 ms: there may be no answer |
//! | real | at its end, a cycle after the last one, whatever came |
//!
//! Within a cycle the F/T packets are sent before the frames. A datagram on loopback is in the receiver's socket when the call that
//! sends it returns: who has read the frame finds all readings of the cycle.

use super::clock::WallClock;
use super::config::Cell;
use super::intruder::{Intruder, Sockets};
use super::net_faults::NetFaults;
use super::page_server::PageServer;
use super::process::Started;
use super::run::{Answers, Peer};
use super::virtual_cell::{Line, Moment, Packet};
use crate::error::Error;
use drivers::fault::Stream;
use drivers::net::{Arrival, Clock, Endpoint, Lock, NetError, wait};
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::os::fd::AsFd;
use std::time::Duration;

/// How long one look at the sockets may take, so that a controller that has died is noticed.
const LOOK: Duration = Duration::from_millis(50);

/// How long an answer to a frame is waited for that a fault has changed. Below the 100 ms after which a sensor's reader takes its
/// stream for dead and starts it again, so that such a wait shows in nothing else.
const DOUBT: Duration = Duration::from_millis(50);

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
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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

/// An error of the sockets, as a user sees it.
pub(super) fn failed(error: &NetError) -> Error {
    Error::new(error.to_string()).help("correct the addresses of the cell, or end the program that holds the port")
}

/// Any port on the way to this address.
pub(super) fn towards(address: SocketAddr) -> SocketAddr {
    let ip: IpAddr = match (address.ip(), address.ip().is_loopback()) {
        (ip, true) => ip,
        (IpAddr::V4(_), false) => Ipv4Addr::UNSPECIFIED.into(),
        (IpAddr::V6(_), false) => Ipv6Addr::UNSPECIFIED.into(),
    };
    SocketAddr::new(ip, 0)
}

/// See the module.
pub struct Wires {
    robots: Vec<Endpoint>,
    listens: Vec<SocketAddr>,
    sensor: Endpoint,
    page: Option<PageServer>,
    intruder: Intruder,
    clock: WallClock,
    pace: Pace,
    /// How long to wait for the controller to come.
    ready: Duration,
    child: Option<Started>,
    begun: Option<Nanos>,
    waited_ns: i64,
    arrivals: Vec<Arrival>,
    /// How well the time was kept.
    pub timing: Timing,
}

impl Wires {
    /// Binds the sensor's port, and one for each robot's controller.
    ///
    /// # Errors
    /// When a port is in use.
    pub fn bind(addresses: &Addresses, pace: Pace, ready: Duration) -> Result<Self, Error> {
        let robot = |listen: &SocketAddr| Endpoint::bind(towards(*listen), Lock::Only(*listen));
        let robots = addresses.robots.iter().map(robot).collect::<Result<_, _>>().map_err(|error| failed(&error))?;
        let sensor = Endpoint::bind(addresses.sensor, Lock::Latest).map_err(|error| failed(&error))?;
        Ok(Wires {
            robots,
            listens: addresses.robots.clone(),
            sensor,
            page: addresses.page.map(PageServer::bind).transpose()?,
            intruder: Intruder::default(),
            clock: WallClock::new(),
            pace,
            ready,
            child: None,
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

    /// The program that was watched.
    pub fn release(&mut self) -> Option<Started> {
        self.child.take()
    }

    /// Looks at all sockets once, for at most `limit`.
    fn look(&mut self, limit: Duration, answers: &mut Answers) -> Result<(), Error> {
        let before = self.clock.now();
        let page = self.page.iter().map(|page| page.listener() as &dyn AsFd);
        let links = self.robots.iter().chain([&self.sensor]).map(|one| one as &dyn AsFd);
        let sockets: Vec<&dyn AsFd> = links.chain(page).collect();
        wait(&sockets, limit.min(LOOK)).map_err(|error| Error::new(format!("cannot wait for the sockets: {error}")))?;
        self.waited_ns += (self.clock.now() - before).0;
        let clock = self.clock;
        let now = || clock.now();
        for (nth, robot) in self.robots.iter_mut().enumerate() {
            robot.receive(&now, &mut |_| true, &mut self.arrivals).map_err(|error| failed(&error))?;
            for arrival in self.arrivals.drain(..) {
                match arrival {
                    Arrival::Bytes { bytes, .. } if !self.intruder.hears(nth, &bytes) => {}
                    Arrival::Bytes { bytes, .. } => answers.replies.push((nth, bytes)),
                    Arrival::Stranger { .. } => self.intruder.heard_stranger(),
                    // Nobody is bound there any more.
                    Arrival::Unreachable { .. } => answers.gone = true,
                    _ => {}
                }
            }
        }
        self.sensor
            .receive(&now, &mut |bytes| !bytes.is_empty(), &mut self.arrivals)
            .map_err(|error| failed(&error))?;
        for arrival in std::mem::take(&mut self.arrivals) {
            let Arrival::Bytes { bytes, from, .. } = arrival else { continue };
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
        Ok(())
    }

    fn disturbed<'s>(&'s mut self, clock: Clock<'s>) -> (&'s mut Intruder, Sockets<'s>) {
        let Wires { intruder, robots, listens, sensor, .. } = self;
        (intruder, Sockets { clock, robots, listens, sensor })
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
            while self.intruder.awaits_request() != steals && clock.now() < end && !answers.gone {
                self.look(LOOK, answers)?;
            }
        }
        let (intruder, mut sockets) = self.disturbed(&now);
        intruder.disturb(moment, packets, &mut sockets)
    }

    fn send(&mut self, packet: &Packet) -> Result<(), Error> {
        let clock = self.clock;
        let now = || clock.now();
        let endpoint = match packet.line {
            Line::Sensor => &mut self.sensor,
            Line::Robot(nth) => &mut self.robots[nth],
        };
        let sent = endpoint.send(&now, &packet.bytes, &mut self.arrivals);
        if packet.line == Line::Sensor {
            // A sensor does not know that its reader has left, and its readings must not be taken for a robot's answers.
            self.arrivals.clear();
        }
        match sent {
            // A sensor that nobody has asked sends to nobody.
            Ok(()) | Err(NetError::NoPeer { .. }) => Ok(()),
            Err(error) => Err(failed(&error)),
        }
    }

    /// Waits until every robot in `expected` has an answer, or until the end of the cycle.
    fn collect(&mut self, sent: Nanos, end: Nanos, expected: &mut [bool], answers: &mut Answers) -> Result<(), Error> {
        let mut seen = answers.replies.len();
        loop {
            let now = self.clock.now();
            for (nth, _) in &answers.replies[seen..] {
                if std::mem::take(&mut expected[*nth]) {
                    let took_ns = (now - sent).0;
                    let (count, [sum_ns, most_ns]) = self.timing.answers;
                    self.timing.answers = (count + 1, [sum_ns + took_ns, most_ns.max(took_ns)]);
                }
            }
            seen = answers.replies.len();
            let is_done = matches!(self.pace, Pace::Virtual { .. }) && !expected.contains(&true);
            if is_done || answers.gone || now >= end {
                self.timing.missing += expected.iter().filter(|missing| **missing).count() as u64;
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
        self.intruder = Intruder::default();
        self.intruder.faults = faults;
        Ok(())
    }

    fn account(&mut self) -> (BTreeMap<&'static str, u64>, Vec<String>) {
        (std::mem::take(&mut self.intruder.events), self.intruder.faults.idle())
    }

    fn begin(&mut self, answers: &mut Answers) -> Result<(), Error> {
        let limit = nanos(self.ready);
        while answers.requests.is_empty() {
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
        Ok(())
    }

    fn exchange(&mut self, moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        self.disturb(moment, packets, answers)?;
        let cycle = moment.cycle;
        let begun = *self.begun.get_or_insert_with(|| self.clock.now());
        let mut expected = vec![false; self.robots.len()];
        let now = self.clock.now();
        let end = match self.pace {
            Pace::Virtual { patience } => {
                let is_sound = packets.iter().all(|packet| packet.is_sound) && !self.intruder.is_in_doubt();
                let limit = if is_sound { patience } else { patience.min(DOUBT) };
                now + nanos(limit)
            }
            Pace::Real(period) => {
                let late_ns = (now - begun).0 - cycle as i64 * period.0;
                let [sum_ns, most_ns] = self.timing.late_ns;
                self.timing.late_ns = [sum_ns + late_ns, most_ns.max(late_ns)];
                begun + Nanos((cycle as i64 + 1) * period.0)
            }
        };
        for packet in packets {
            self.send(packet)?;
            if let Line::Robot(nth) = packet.line {
                expected[nth] = true;
            }
        }
        self.collect(now, end, &mut expected, answers)?;
        self.timing.cycles += 1;
        self.timing.total_ns = (self.clock.now() - begun).0;
        self.timing.busy_ns = self.timing.total_ns - self.waited_ns;
        Ok(())
    }
}
