//! The sockets of a sensor's link. What they carry follows from the sensor's protocol.
//!
//! | | computer, [`SensorLink`] | sensor, [`SensorPort`] |
//! |---|---|---|
//! | datagrams | sends to the sensor's port | bound; whoever asked last has the stream |
//! | a stream: a serial line behind a box | connects | listens; one connection |
//! | commands on a stream, samples as datagrams (SCHUNK) | connects, and is bound to the port for samples | listens; sends samples to that port of whoever has asked |
//!
//! A connection that was closed stays closed: what the sensor says last is an event, and the recording goes on without it.
//! Source: reference/PROTOCOLS.md, sections 2.1 and 3.

use super::link::{Listening, failed, towards};
use crate::error::Error;
use drivers::ft::{Transport, schunk};
use drivers::net::{Arrival, Clock, Connection, Endpoint, Lock, NetError};
use drivers::rsi;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

/// How long a connection to a sensor may take.
const CONNECT: Duration = Duration::from_secs(2);

/// The computer's side.
#[derive(Debug)]
pub(crate) enum SensorLink {
    Datagrams(Box<Endpoint>),
    Stream(Box<Connection>),
    Split { commands: Box<Connection>, samples: Box<Endpoint> },
}

impl SensorLink {
    /// Opens the way to the sensor at this address; nothing is sent yet.
    pub fn open(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        let connect = || {
            let help = "switch the sensor on, and check its address in the cell";
            let connection = Connection::connect(address, CONNECT).map(Box::new);
            connection.map_err(|error| Error::new(error.to_string()).help(help))
        };
        Ok(match transport {
            Transport::Udp => {
                let endpoint = Endpoint::bind(towards(address), Lock::Only(address)).map_err(failed)?;
                SensorLink::Datagrams(Box::new(endpoint))
            }
            Transport::Stream => SensorLink::Stream(connect()?),
            Transport::Split { samples_port } => {
                // From which port a sensor sends its samples is not known.
                let here = SocketAddr::new(towards(address).ip(), samples_port);
                let samples = Endpoint::bind(here, Lock::Host(address.ip())).map_err(failed)?;
                SensorLink::Split { commands: connect()?, samples: Box::new(samples) }
            }
        })
    }

    /// Where samples are expected, where that is not the port that asks.
    pub fn samples(&self) -> Option<SocketAddr> {
        match self {
            SensorLink::Split { samples, .. } => Some(samples.local()),
            _ => None,
        }
    }

    /// Datagrams of others than the sensor.
    pub fn strangers(&self) -> u64 {
        match self {
            SensorLink::Datagrams(endpoint) | SensorLink::Split { samples: endpoint, .. } => {
                endpoint.counts().strangers
            }
            SensorLink::Stream(_) => 0,
        }
    }

    /// What to wait for. The end of a closed connection would be there to read for ever.
    pub fn sockets(&self) -> Vec<&dyn AsFd> {
        let open = |connection: &'_ Connection| connection.is_open();
        match self {
            SensorLink::Datagrams(endpoint) => vec![endpoint.as_ref()],
            SensorLink::Stream(connection) => {
                Some(connection.as_ref()).filter(|one| open(one)).map(|one| one as &dyn AsFd).into_iter().collect()
            }
            SensorLink::Split { commands, samples } => {
                let commands = Some(commands.as_ref()).filter(|one| open(one)).map(|one| one as &dyn AsFd);
                commands.into_iter().chain([samples.as_ref() as &dyn AsFd]).collect()
            }
        }
    }

    pub fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            SensorLink::Datagrams(endpoint) => endpoint.receive(clock, &mut |_| true, arrivals),
            SensorLink::Stream(connection) => connection.receive(clock, arrivals),
            SensorLink::Split { commands, samples } => {
                commands.receive(clock, arrivals).and_then(|()| samples.receive(clock, &mut |_| true, arrivals))
            }
        }
        .map_err(failed)
    }

    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            SensorLink::Datagrams(endpoint) => endpoint.send(clock, bytes, arrivals),
            SensorLink::Stream(connection) | SensorLink::Split { commands: connection, .. } => {
                connection.send(clock, bytes, arrivals)
            }
        }
        .map_err(failed)
    }
}

/// The sensor's side.
#[derive(Debug)]
pub(crate) enum SensorPort {
    Datagrams(Box<Endpoint>),
    Stream(Box<Listening>),
    Split {
        commands: Box<Listening>,
        /// Towards the one who has asked.
        samples: Option<Box<Endpoint>>,
        /// His port for samples.
        samples_port: u16,
    },
}

impl SensorPort {
    pub fn bind(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        let listening = || Listening::bind(address, rsi::Transport::Tcp).map(Box::new);
        Ok(match transport {
            Transport::Udp => SensorPort::Datagrams(Box::new(Endpoint::bind(address, Lock::Latest).map_err(failed)?)),
            Transport::Stream => SensorPort::Stream(listening()?),
            Transport::Split { samples_port } => {
                SensorPort::Split { commands: listening()?, samples: None, samples_port }
            }
        })
    }

    pub fn local(&self) -> SocketAddr {
        match self {
            SensorPort::Datagrams(endpoint) => endpoint.local(),
            SensorPort::Stream(listening) | SensorPort::Split { commands: listening, .. } => listening.local(),
        }
    }

    /// What to wait for.
    pub fn socket(&self) -> &dyn AsFd {
        match self {
            SensorPort::Datagrams(endpoint) => endpoint.as_ref(),
            SensorPort::Stream(listening) | SensorPort::Split { commands: listening, .. } => listening.socket(),
        }
    }

    /// Its port, where requests come as datagrams: what another socket can do there.
    pub fn datagrams(&mut self) -> Option<&mut Endpoint> {
        match self {
            SensorPort::Datagrams(endpoint) => Some(endpoint),
            _ => None,
        }
    }

    /// What is asked. True: somebody has connected anew.
    pub fn receive(
        &mut self,
        clock: Clock<'_>,
        is_request: &mut dyn FnMut(&[u8]) -> bool,
        arrivals: &mut Vec<Arrival>,
    ) -> Result<bool, Error> {
        match self {
            SensorPort::Datagrams(endpoint) => {
                endpoint.receive(clock, is_request, arrivals).map_err(failed)?;
                Ok(false)
            }
            SensorPort::Stream(listening) => listening.receive(clock, arrivals),
            SensorPort::Split { commands, samples, samples_port } => {
                let is_new = commands.receive(clock, arrivals)?;
                let asked = arrivals.iter().rev().find_map(|arrival| match arrival {
                    Arrival::Bytes { from, .. } => Some(SocketAddr::new(from.ip(), *samples_port)),
                    _ => None,
                });
                if let Some(host) = asked
                    && samples.as_ref().is_none_or(|samples| samples.peer() != Some(host))
                {
                    let endpoint = Endpoint::bind(towards(host), Lock::Only(host)).map_err(failed)?;
                    *samples = Some(Box::new(endpoint));
                }
                Ok(is_new)
            }
        }
    }

    /// Sends a sample, or what a request is answered with. A sensor that nobody has asked sends to nobody, and one does not know
    /// that its reader has left.
    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8]) -> Result<(), Error> {
        let nobody = &mut Vec::new();
        let sent = match self {
            SensorPort::Datagrams(endpoint) => endpoint.send(clock, bytes, nobody),
            SensorPort::Split { samples, .. } if !schunk::is_answer(bytes) => {
                samples.as_mut().map_or(Ok(()), |samples| samples.send(clock, bytes, nobody))
            }
            SensorPort::Stream(listening) | SensorPort::Split { commands: listening, .. } => {
                return listening.send(clock, bytes, nobody);
            }
        };
        match sent {
            Ok(()) | Err(NetError::NoPeer { .. }) => Ok(()),
            Err(error) => Err(failed(error)),
        }
    }
}
