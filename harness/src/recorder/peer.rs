//! Taking part as the PC: every frame is answered with zero corrections.
//!
//! The answer goes out before anything is written down. Answers stop when the recording ends; the controller then counts late
//! answers until it stops RSI by itself (`RSITimeout`).

use super::devices::{Devices, Way};
use super::network::{note, take};
use super::session::Recorder;
use crate::cell::Cell;
use crate::cell::link::Listening;
use crate::cell::sensor_link::SensorLink;
use crate::error::Error;
use drivers::ft::Transport;
use drivers::net::{Arrival, Clock, wait};
use std::io::Write;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

/// Longest wait for something to come: silences and old chunks are looked at this often.
const WAIT: Duration = Duration::from_millis(5);
/// A cell that this program answers.
#[derive(Debug)]
pub struct Peer {
    links: Vec<Listening>,
    names: Vec<String>,
    sensor: SensorLink,
    /// The sensor's zero is set before it is asked to stream.
    sets_bias: bool,
}

impl Peer {
    /// Binds all ports and opens the line to the sensor; nothing is sent yet.
    ///
    /// # Errors
    /// When a port is in use, or the sensor cannot be reached.
    pub fn open(cell: &Cell, devices: &Devices, transport: Transport) -> Result<Self, Error> {
        let robots = cell.config.robots.iter().enumerate();
        let links = robots.map(|(nth, robot)| {
            let link = Listening::bind(robot.listen, devices.config(nth).protocol);
            link.map_err(|error| error.place(format!("robot {}", robot.name)))
        });
        let links = links.collect::<Result<Vec<_>, _>>().map_err(|error| error.file(&cell.source.file))?;
        let names = cell.config.robots.iter().map(|robot| robot.name.clone()).collect();
        Ok(Peer { links, names, sensor: SensorLink::open(cell.config.sensor.address, transport)?, sets_bias: false })
    }

    /// Where the robots are expected.
    pub fn addresses(&self) -> Vec<SocketAddr> {
        self.links.iter().map(Listening::local).collect()
    }

    /// The recording begins with setting the sensor's zero at its present load.
    pub fn set_bias_first(&mut self) {
        self.sets_bias = true;
    }

    /// Where the sensor's samples are expected, where that is a port of its own.
    pub fn samples(&self) -> Option<SocketAddr> {
        self.sensor.samples()
    }

    /// Answers and records until that is true, or a robot turns out not to live in real time.
    ///
    /// # Errors
    /// When a socket fails, or the session does not take what came.
    pub fn run<W: Write>(
        &mut self,
        devices: &mut Devices,
        recorder: &mut Recorder<W>,
        clock: Clock<'_>,
        until: &dyn Fn() -> bool,
    ) -> Result<(), Error> {
        let is_due = std::mem::take(&mut self.sets_bias);
        let mut start = if is_due { devices.sensor_bias(clock())? } else { Vec::new() };
        start.extend(devices.sensor_requests(true));
        self.ask(&start, devices, clock)?;
        let outcome = self.cycles(devices, recorder, clock, until);
        // The sensor is told to stop also when the disk is full.
        let stop = devices.sensor_requests(false);
        self.ask(&stop, devices, clock)?;
        for (name, link) in self.names.iter().zip(&self.links) {
            recorder.count(name, "net-stranger", link.strangers());
        }
        recorder.count("ft", "net-stranger", self.sensor.strangers());
        outcome
    }

    fn cycles<W: Write>(
        &mut self,
        devices: &mut Devices,
        recorder: &mut Recorder<W>,
        clock: Clock<'_>,
        until: &dyn Fn() -> bool,
    ) -> Result<(), Error> {
        while !until() && !recorder.is_too_fast() {
            let sockets: Vec<&dyn AsFd> =
                self.links.iter().map(Listening::socket).chain(self.sensor.sockets()).collect();
            wait(&sockets, WAIT).map_err(|error| Error::new(format!("waiting for the network failed: {error}")))?;
            for robot in 0..self.links.len() {
                self.robot(robot, devices, clock)?;
            }
            let mut arrivals = Vec::new();
            self.sensor.receive(clock, &mut arrivals)?;
            for arrival in &arrivals {
                note("ft", arrival, devices);
                if let Arrival::Bytes { at, bytes, .. } = arrival {
                    devices.sensed(*at, bytes);
                }
            }
            let now = clock();
            let again = devices.tick(now);
            self.ask(&again, devices, clock)?;
            devices.write(recorder)?;
            recorder.tick(now)?;
        }
        Ok(())
    }

    /// Sends requests to the sensor.
    fn ask(&mut self, requests: &[Vec<u8>], devices: &mut Devices, clock: Clock<'_>) -> Result<(), Error> {
        let mut arrivals = Vec::new();
        for request in requests {
            self.sensor.send(clock, request, &mut arrivals)?;
        }
        arrivals.iter().for_each(|arrival| note("ft", arrival, devices));
        Ok(())
    }

    /// Takes what a robot sent and answers the newest of it.
    fn robot(&mut self, robot: usize, devices: &mut Devices, clock: Clock<'_>) -> Result<(), Error> {
        let link = &mut self.links[robot];
        let mut arrivals = Vec::new();
        if link.receive(clock, &mut arrivals)? {
            devices.connected(robot);
        }
        let mut is_fresh = false;
        let has_bytes = arrivals.iter().any(|arrival| matches!(arrival, Arrival::Bytes { .. }));
        for arrival in &arrivals {
            is_fresh |= take(robot, arrival, link.is_stream(), devices);
            note(&self.names[robot], arrival, devices);
        }
        if !has_bytes {
            return Ok(());
        }
        if let Some(reply) = devices.answer(robot, is_fresh)? {
            let bytes = if link.is_stream() { devices.framed(robot, &reply) } else { reply.clone() };
            let mut arrivals = Vec::new();
            link.send(clock, &bytes, &mut arrivals)?;
            arrivals.iter().for_each(|arrival| note(&self.names[robot], arrival, devices));
            devices.datagram(robot, Way::ToRobot, clock(), &reply);
        }
        Ok(())
    }
}
