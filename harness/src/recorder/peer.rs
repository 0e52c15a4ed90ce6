//! Taking part as the PC: every frame is answered with zero corrections.
//!
//! The answer goes out before anything is written down. Answers stop when the recording ends; the controller then counts late
//! answers until it stops RSI by itself (`RSITimeout`).

use super::devices::{Devices, Way};
use super::network::{note, take};
use super::session::Recorder;
use crate::cell::Cell;
use crate::cell::link::{Listening, failed, towards};
use crate::error::Error;
use drivers::ft::Transport;
use drivers::net::{Arrival, Clock, Connection, Endpoint, Lock, wait};
use std::io::Write;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

/// Longest wait for something to come: silences and old chunks are looked at this often.
const WAIT: Duration = Duration::from_millis(5);
/// How long a connection to a sensor may take.
const CONNECT: Duration = Duration::from_secs(2);

/// The line to a sensor.
#[derive(Debug)]
enum SensorLink {
    Udp(Box<Endpoint>),
    Tcp(Box<Connection>),
}

impl SensorLink {
    fn open(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        match transport {
            Transport::Udp => {
                let endpoint = Endpoint::bind(towards(address), Lock::Only(address)).map_err(failed)?;
                Ok(SensorLink::Udp(Box::new(endpoint)))
            }
            // A serial line is reached through a box that makes a stream of it.
            Transport::Stream => {
                let help = "switch the sensor on, and check its address in the cell";
                let connection = Connection::connect(address, CONNECT);
                connection.map(Box::new).map(SensorLink::Tcp).map_err(|error| Error::new(error.to_string()).help(help))
            }
        }
    }

    /// Datagrams of others than the sensor.
    fn strangers(&self) -> u64 {
        match self {
            SensorLink::Udp(endpoint) => endpoint.counts().strangers,
            SensorLink::Tcp(_) => 0,
        }
    }

    fn socket(&self) -> &dyn AsFd {
        match self {
            SensorLink::Udp(endpoint) => endpoint.as_ref(),
            SensorLink::Tcp(connection) => connection.as_ref(),
        }
    }

    fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            SensorLink::Udp(endpoint) => endpoint.receive(clock, &mut |_| true, arrivals),
            SensorLink::Tcp(connection) => connection.receive(clock, arrivals),
        }
        .map_err(failed)
    }

    fn send(&mut self, clock: Clock<'_>, all: &[Vec<u8>], devices: &mut Devices) -> Result<(), Error> {
        let mut arrivals = Vec::new();
        for bytes in all {
            match self {
                SensorLink::Udp(endpoint) => endpoint.send(clock, bytes, &mut arrivals),
                SensorLink::Tcp(connection) => connection.send(clock, bytes, &mut arrivals),
            }
            .map_err(failed)?;
        }
        arrivals.iter().for_each(|arrival| note("ft", arrival, devices));
        Ok(())
    }
}

/// A cell that this program answers.
#[derive(Debug)]
pub struct Peer {
    links: Vec<Listening>,
    names: Vec<String>,
    sensor: SensorLink,
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
        Ok(Peer { links, names, sensor: SensorLink::open(cell.config.sensor.address, transport)? })
    }

    /// Where the robots are expected.
    pub fn addresses(&self) -> Vec<SocketAddr> {
        self.links.iter().map(Listening::local).collect()
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
        let start = devices.sensor_requests(true);
        self.sensor.send(clock, &start, devices)?;
        let outcome = self.cycles(devices, recorder, clock, until);
        // The sensor is told to stop also when the disk is full.
        let stop = devices.sensor_requests(false);
        self.sensor.send(clock, &stop, devices)?;
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
                self.links.iter().map(Listening::socket).chain([self.sensor.socket()]).collect();
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
            self.sensor.send(clock, &again, devices)?;
            devices.write(recorder)?;
            recorder.tick(now)?;
        }
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
