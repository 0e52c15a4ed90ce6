//! The computer's side of real sockets: a controller that answers until nobody sends any more.

use super::clock::WallClock;
use super::config::Cell;
use super::controller::Controller;
use super::link::{Listening, told};
use super::on_wire::OnWire;
use super::sensor_link::SensorLink;
use super::virtual_cell::Line;
use super::wires::Addresses;
use crate::error::Error;
use drivers::net::{Arrival, Clock, wait};
use drivers::rsi::{Frames, Malformed, Transport, split};
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

/// How long one look at the sockets may take: the sensor is asked again when it does not answer.
const LOOK: Duration = Duration::from_millis(20);

/// Silence after which a cell may have gone: longer than any jitter, shorter than what a driver calls silence. Chosen.
const QUIET: Duration = Duration::from_millis(60);

/// One robot's link, and its stream if it is one.
struct Robot {
    link: Listening,
    stream: Option<Frames>,
    has_length: bool,
}

/// Documents of a robot, as they came at once.
type Documents = Vec<Result<Vec<u8>, Malformed>>;

/// What was heard in one look.
enum Heard {
    Reading(Nanos, Vec<u8>),
    Frames(usize, Nanos, Documents),
}

impl Robot {
    fn of(cell: &Cell, nth: usize, address: SocketAddr) -> Result<Self, Error> {
        let config = cell.driven(nth)?;
        let link = Listening::bind(address, config.protocol);
        let link = link.map_err(|error| error.place(format!("robot {}", cell.config.robots[nth].name)))?;
        let stream = (config.protocol == Transport::Tcp).then(|| Frames::new(config.length_prefix));
        Ok(Robot { link, stream, has_length: config.length_prefix })
    }

    /// Takes what waits. The stream of a new connection follows on nothing that came before.
    fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        if self.link.receive(clock, arrivals)? {
            self.stream = Some(Frames::new(self.has_length));
        }
        Ok(())
    }

    /// The documents in what has come.
    fn documents(&mut self, bytes: &[u8]) -> Documents {
        self.stream.as_mut().map_or_else(|| split(bytes), |stream| stream.documents(bytes))
    }

    /// An answer as it goes on the wire.
    fn framed(&self, answer: Vec<u8>) -> Vec<u8> {
        match &self.stream {
            Some(stream) => stream.wrap(&answer),
            None => answer,
        }
    }
}

/// The sockets of a controller.
pub struct Served {
    robots: Vec<Robot>,
    sensor: SensorLink,
    clock: WallClock,
    /// What was seen after the last frame, by class: mostly that the cell has gone.
    pub after: BTreeMap<String, u64>,
}

impl Served {
    /// Binds the port of each robot and opens the way to the sensor.
    ///
    /// # Errors
    /// When a port is in use, or an Ethernet configuration is wrong.
    pub fn bind(cell: &Cell, addresses: &Addresses) -> Result<Self, Error> {
        let robots = addresses.robots.iter().enumerate().map(|(nth, address)| Robot::of(cell, nth, *address));
        let robots = robots.collect::<Result<_, _>>()?;
        let sensor = SensorLink::open(addresses.sensor, cell.sensor()?.transport())?;
        Ok(Served { robots, sensor, clock: WallClock::new(), after: BTreeMap::new() })
    }

    /// Answers until nothing has come for `silence`; before the first frame, for `patience`; or until it is told to end. How many
    /// frames were answered.
    ///
    /// # Errors
    /// When the sockets fail, or the controller commands what cannot be written.
    pub fn serve<C: Controller>(
        &mut self,
        on_wire: &mut OnWire<C>,
        patience: Duration,
        silence: Duration,
        ends: &dyn Fn() -> bool,
    ) -> Result<u64, Error> {
        let clock = self.clock;
        let now = || clock.now();
        let (mut requests, mut arrivals, mut answered) = (Vec::new(), Vec::new(), 0);
        let mut last = clock.now();
        let mut before = None;
        on_wire.start(&mut requests);
        loop {
            for request in requests.drain(..) {
                self.sensor.send(&now, &request, &mut arrivals)?;
            }
            let robots = self.robots.iter().map(|robot| robot.link.socket());
            let sockets: Vec<&dyn AsFd> = robots.chain(self.sensor.sockets()).collect();
            wait(&sockets, LOOK).map_err(|error| Error::new(format!("cannot wait for the sockets: {error}")))?;
            let heard = self.hear(&on_wire.lines(), &mut on_wire.events)?;
            let came = !heard.is_empty();
            for heard in heard {
                let (nth, answer) = match heard {
                    Heard::Reading(at, bytes) => (0, on_wire.receive(Line::Sensor, at, &bytes)?),
                    Heard::Frames(nth, at, documents) => (nth, on_wire.documents(nth, at, documents)?),
                };
                let Some(answer) = answer else { continue };
                let robot = &mut self.robots[nth];
                let bytes = robot.framed(answer);
                robot.link.send(&now, &bytes, &mut arrivals)?;
                answered += 1;
            }
            count(&arrivals, &mut on_wire.events);
            arrivals.clear();
            on_wire.tick(clock.now(), &mut requests);
            let limit = if answered == 0 { patience } else { silence };
            let silent = Duration::from_nanos((clock.now() - last).0.unsigned_abs());
            if came {
                (last, before) = (clock.now(), None);
            } else if silent > QUIET && answered > 0 && before.is_none() {
                before = Some(on_wire.events.clone());
            }
            if ends() || !came && silent > limit {
                self.gone(before, &mut on_wire.events);
                return Ok(answered);
            }
        }
    }

    /// Parts what was seen when all was quiet from what was seen before.
    fn gone(&mut self, before: Option<BTreeMap<String, u64>>, events: &mut BTreeMap<String, u64>) {
        let Some(before) = before else { return };
        let since = |(class, count): (&String, &u64)| {
            let more = count - before.get(class).unwrap_or(&0);
            (more > 0).then(|| (class.clone(), more))
        };
        self.after = events.iter().filter_map(since).collect();
        *events = before;
    }

    /// What has come: readings, then the frames of the nozzle's robot, then those of the probe's. They are read the other way
    /// round: when a frame is there, all that was sent before it is there too.
    fn hear(&mut self, lines: &[Line], events: &mut BTreeMap<String, u64>) -> Result<Vec<Heard>, Error> {
        let clock = self.clock;
        let now = || clock.now();
        let mut heard = Vec::new();
        let mut arrivals = Vec::new();
        for line in lines.iter().copied() {
            match line {
                Line::Robot(nth) => self.robots[nth].receive(&now, &mut arrivals)?,
                Line::Sensor => self.sensor.receive(&now, &mut arrivals)?,
            }
            count(&arrivals, events);
            let (mut of_line, mut documents) = (Vec::new(), None);
            for arrival in arrivals.drain(..) {
                let (Arrival::Bytes { at, bytes, .. } | Arrival::Invalid { at, bytes, .. }) = arrival else { continue };
                match line {
                    Line::Sensor => of_line.push(Heard::Reading(at, bytes)),
                    Line::Robot(nth) => {
                        // Frames that waited came at once: the newest is answered, and the controller makes one step.
                        let (newest, all) = documents.get_or_insert_with(|| (at, Vec::new()));
                        *newest = at;
                        all.extend(self.robots[nth].documents(&bytes));
                    }
                }
            }
            if let (Line::Robot(nth), Some((at, documents))) = (line, documents) {
                of_line.push(Heard::Frames(nth, at, documents));
            }
            heard.push(of_line);
        }
        heard.reverse();
        Ok(heard.into_iter().flatten().collect())
    }
}

/// What the network said is an event as any other.
fn count(arrivals: &[Arrival], events: &mut BTreeMap<String, u64>) {
    for (_, class, _) in arrivals.iter().filter_map(told) {
        *events.entry(class.to_owned()).or_default() += 1;
    }
}
