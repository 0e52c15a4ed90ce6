//! The computer's side of real sockets: a controller that answers until nobody sends any more.

use super::clock::WallClock;
use super::controller::Controller;
use super::on_wire::OnWire;
use super::virtual_cell::Line;
use super::wires::{Addresses, failed, towards};
use crate::error::Error;
use drivers::net::{Arrival, Endpoint, Lock, wait};
use sim_core::time::Nanos;
use std::os::fd::AsFd;
use std::time::Duration;

/// How long one look at the sockets may take: the sensor is asked again when it does not answer.
const LOOK: Duration = Duration::from_millis(20);

/// The sockets of a controller.
pub struct Served {
    robots: Vec<Endpoint>,
    sensor: Endpoint,
    clock: WallClock,
}

impl Served {
    /// Binds the port of each robot.
    ///
    /// # Errors
    /// When a port is in use.
    pub fn bind(addresses: &Addresses) -> Result<Self, Error> {
        let bound = |address, lock| Endpoint::bind(address, lock).map_err(|error| failed(&error));
        let robots = addresses.robots.iter().map(|address| bound(*address, Lock::First)).collect::<Result<_, _>>()?;
        let sensor = bound(towards(addresses.sensor), Lock::Only(addresses.sensor))?;
        Ok(Served { robots, sensor, clock: WallClock::new() })
    }

    /// Answers until nothing has come for `silence`; before the first frame, for `patience`. How many frames were answered.
    ///
    /// # Errors
    /// When the sockets fail, or the controller commands what cannot be written.
    pub fn serve<C: Controller>(
        &mut self,
        on_wire: &mut OnWire<C>,
        patience: Duration,
        silence: Duration,
    ) -> Result<u64, Error> {
        let clock = self.clock;
        let now = || clock.now();
        let (mut requests, mut arrivals, mut answered) = (Vec::new(), Vec::new(), 0);
        let mut last = clock.now();
        on_wire.start(&mut requests);
        loop {
            for request in requests.drain(..) {
                self.sensor.send(&now, &request, &mut arrivals).map_err(|error| failed(&error))?;
            }
            let sockets: Vec<&dyn AsFd> =
                self.robots.iter().chain([&self.sensor]).map(|one| one as &dyn AsFd).collect();
            wait(&sockets, LOOK).map_err(|error| Error::new(format!("cannot wait for the sockets: {error}")))?;
            let heard = self.hear(&on_wire.lines(), &mut arrivals)?;
            let came = !heard.is_empty();
            for (line, at, bytes) in heard {
                let Some(answer) = on_wire.receive(line, at, &bytes)? else { continue };
                if let Line::Robot(nth) = line {
                    self.robots[nth].send(&now, &answer, &mut arrivals).map_err(|error| failed(&error))?;
                    answered += 1;
                }
            }
            for class in arrivals.drain(..).filter_map(|arrival| arrival.class()) {
                *on_wire.events.entry(class.to_owned()).or_default() += 1;
            }
            on_wire.tick(clock.now(), &mut requests);
            let limit = if answered == 0 { patience } else { silence };
            if came {
                last = clock.now();
            } else if (clock.now() - last).0 > i64::try_from(limit.as_nanos()).unwrap_or(i64::MAX) {
                return Ok(answered);
            }
        }
    }

    /// What has come: readings, then the frames of the nozzle's robot, then those of the probe's. They are read the other way
    /// round: when a frame is there, all that was sent before it is there too.
    /// What else the sockets say goes to `others`.
    fn hear(&mut self, lines: &[Line], others: &mut Vec<Arrival>) -> Result<Vec<(Line, Nanos, Vec<u8>)>, Error> {
        let clock = self.clock;
        let now = || clock.now();
        let mut heard = Vec::new();
        let mut arrivals = Vec::new();
        for line in lines.iter().copied() {
            let endpoint = match line {
                Line::Robot(nth) => &mut self.robots[nth],
                Line::Sensor => &mut self.sensor,
            };
            let is_frame = |bytes: &[u8]| line == Line::Sensor || bytes.windows(4).any(|part| part == b"<Rob");
            endpoint.receive(&now, &mut |bytes| is_frame(bytes), &mut arrivals).map_err(|error| failed(&error))?;
            let bytes = arrivals.drain(..).filter_map(|arrival| match arrival {
                Arrival::Bytes { at, bytes, .. } | Arrival::Invalid { at, bytes, .. } => Some((line, at, bytes)),
                other => {
                    others.push(other);
                    None
                }
            });
            heard.push(bytes.collect::<Vec<_>>());
        }
        heard.reverse();
        Ok(heard.into_iter().flatten().collect())
    }
}
