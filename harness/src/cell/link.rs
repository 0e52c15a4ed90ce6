//! The sockets of one robot's link. What they carry, datagrams or a stream, follows from the Ethernet configuration of the robot.
//!
//! | | computer, [`Listening`] | robot controller, [`Calling`] |
//! |---|---|---|
//! | UDP | bound; the first sender of a frame is the robot | sends to the computer's port |
//! | TCP | listens; one connection, whoever else comes is closed at once and reported | connects |
//!
//! On either, who has been silent gives way to another one: a controller whose RSI starts again comes from another port, and one
//! that was switched off has not closed its connection. Over UDP who sends no frames counts as silent. Source: reference/PROTOCOLS.md, section 1.1.

use crate::error::Error;
use drivers::net::{Arrival, Clock, Connection, Endpoint, Listener, Lock, NetError};
use drivers::rsi::{Root, Telegram, Transport, split};
use sim_core::time::Nanos;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::os::fd::AsFd;
use std::time::Duration;

/// Silence after which another sender may take the place of a robot: longer than that of `rsi-silent`, so that a computer which
/// stumbles gives nothing away. Chosen.
const FORGET_UDP_NS: i64 = 250_000_000;
/// The same over TCP, where a new connection is not taken by mistake for an old one. Chosen.
const FORGET_NS: i64 = 1_000_000_000;
/// Connections that were closed at once and are reported one by one; beyond that they are only counted.
const REFUSED_REPORTED_MAX: u64 = 16;

/// A socket's error as a command shows it.
pub(crate) fn failed(error: NetError) -> Error {
    Error::new(error.to_string()).help("correct the addresses of the cell, or end the program that holds the port")
}

/// Any port of this computer from which that address is reached.
pub(crate) fn towards(address: SocketAddr) -> SocketAddr {
    let ip: IpAddr = match (address.ip(), address.ip().is_loopback()) {
        (ip, true) => ip,
        (IpAddr::V4(_), false) => Ipv4Addr::UNSPECIFIED.into(),
        (IpAddr::V6(_), false) => Ipv6Addr::UNSPECIFIED.into(),
    };
    SocketAddr::new(ip, 0)
}

/// Closes this port and opens it anew.
pub(crate) fn bind_again(endpoint: &mut Endpoint, lock: Lock) -> Result<(), NetError> {
    let local = endpoint.local();
    // Something must stand there while the port is free.
    *endpoint = Endpoint::bind(towards(local), lock)?;
    *endpoint = Endpoint::bind(local, lock)?;
    Ok(())
}

/// What the network says that is no bytes: its class, and its text.
pub(crate) fn told(arrival: &Arrival) -> Option<(Nanos, &'static str, String)> {
    let (at, class, text) = match arrival {
        Arrival::Bytes { .. } => return None,
        Arrival::Stranger { at, from, peer } => (at, "net-stranger", format!("{from} sends too; the peer is {peer}")),
        Arrival::Invalid { at, from, bytes } => {
            (at, "net-invalid", format!("{} bytes from {from} are no frame of a robot", bytes.len()))
        }
        Arrival::Taken { at, from, by } => (at, "net-taken", format!("{by} takes the stream away from {from}")),
        Arrival::Unreachable { at, why } => (at, "net-unreachable", format!("what was sent did not arrive: {why}")),
        Arrival::Closed { at } => (at, "net-closed", "the connection was closed".to_owned()),
    };
    Some((*at, class, text))
}

/// Whether bytes are a frame of a robot controller.
fn is_frame(bytes: &[u8]) -> bool {
    let is_rob = |document: Vec<u8>| Telegram::decode(&document).is_ok_and(|telegram| telegram.root == Root::Rob);
    split(bytes).into_iter().flatten().any(is_rob)
}

/// Whether it looks like a robot's: enough to know that it still speaks.
fn is_of_robot(arrival: &Arrival) -> bool {
    matches!(arrival, Arrival::Bytes { bytes, .. } if bytes.windows(4).any(|four| four == b"<Rob"))
}

/// The computer's side: bound, waiting for a robot controller to speak.
#[derive(Debug)]
pub(crate) enum Listening {
    Udp(Box<Endpoint>, Option<Nanos>),
    Tcp(Box<Port>),
}

/// A port with at most one connection.
#[derive(Debug)]
pub(crate) struct Port {
    listener: Listener,
    connection: Option<Connection>,
    /// When something came last.
    last: Nanos,
}

impl Listening {
    pub fn bind(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        Ok(match transport {
            Transport::Udp => Listening::Udp(Box::new(Endpoint::bind(address, Lock::First).map_err(failed)?), None),
            Transport::Tcp => {
                let listener = Listener::bind(address).map_err(failed)?;
                Listening::Tcp(Box::new(Port { listener, connection: None, last: Nanos(0) }))
            }
        })
    }

    pub fn local(&self) -> SocketAddr {
        match self {
            Listening::Udp(endpoint, _) => endpoint.local(),
            Listening::Tcp(port) => port.listener.local(),
        }
    }

    /// What to wait for.
    pub fn socket(&self) -> &dyn AsFd {
        match self {
            Listening::Udp(endpoint, _) => endpoint.as_ref(),
            Listening::Tcp(port) => port.open().map_or(&port.listener, |open| open as &dyn AsFd),
        }
    }

    /// All that waits. True: the stream that it is of is a new one.
    pub fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<bool, Error> {
        match self {
            Listening::Udp(endpoint, last) => {
                endpoint.receive(clock, &mut is_frame, arrivals).map_err(failed)?;
                let now = clock();
                if arrivals.iter().any(is_of_robot) {
                    *last = Some(now);
                } else if last.is_some_and(|last| now.0.saturating_sub(last.0) > FORGET_UDP_NS) {
                    endpoint.relent();
                    *last = None;
                }
                Ok(false)
            }
            Listening::Tcp(port) => port.receive(clock, arrivals).map_err(failed),
        }
    }

    /// Whether documents travel on a stream.
    pub fn is_stream(&self) -> bool {
        matches!(self, Listening::Tcp(..))
    }

    /// Datagrams, or connections, of others than the robot.
    pub fn strangers(&self) -> u64 {
        match self {
            Listening::Udp(endpoint, _) => endpoint.counts().strangers,
            Listening::Tcp(port) => port.listener.refused(),
        }
    }

    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            Listening::Udp(endpoint, _) if endpoint.peer().is_some() => endpoint.send(clock, bytes, arrivals),
            Listening::Tcp(port) => port.connection.as_mut().map_or(Ok(()), |open| open.send(clock, bytes, arrivals)),
            // Who asked is gone; there is nobody to answer.
            Listening::Udp(..) => Ok(()),
        }
        .map_err(failed)
    }

    /// Closes the connection, if there is one; the port stays.
    pub fn hang_up(&mut self) {
        if let Listening::Tcp(port) = self {
            port.connection = None;
        }
    }
}

impl Port {
    fn open(&self) -> Option<&Connection> {
        self.connection.as_ref().filter(|connection| connection.is_open())
    }

    fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<bool, NetError> {
        if let Some(open) = self.connection.as_mut().filter(|connection| connection.is_open()) {
            open.receive(clock, arrivals)?;
            let now = clock();
            if !arrivals.is_empty() {
                self.last = now;
            }
            if !open.is_open() {
                // What has just come is of the old stream: a successor is looked for at the next call.
                return Ok(false);
            }
            if now.0.saturating_sub(self.last.0) <= FORGET_NS {
                let peer = open.peer();
                let before = self.listener.refused();
                self.listener.accept(true)?;
                let is_told = self.listener.refused() > before && before < REFUSED_REPORTED_MAX;
                let stranger = self.listener.last_refused().filter(|_| is_told);
                arrivals.extend(stranger.map(|from| Arrival::Stranger { at: now, from, peer }));
                return Ok(false);
            }
        }
        let old = self.open().map(Connection::peer);
        let Some(next) = self.listener.accept(false)? else {
            self.connection = self.connection.take().filter(Connection::is_open);
            return Ok(false);
        };
        self.last = clock();
        arrivals.extend(old.map(|from| Arrival::Taken { at: self.last, from, by: next.peer() }));
        let next = self.connection.insert(next);
        next.receive(clock, arrivals)?;
        Ok(true)
    }
}

/// The robot controller's side, or that of whoever stands in its place.
#[derive(Debug)]
pub(crate) enum Calling {
    Udp(Box<Endpoint>),
    Tcp(SocketAddr, Option<Connection>),
}

impl Calling {
    /// The side that speaks to this address. Over TCP nobody is connected yet.
    pub fn to(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        match transport {
            Transport::Udp => {
                let endpoint = Endpoint::bind(towards(address), Lock::Only(address));
                endpoint.map(Box::new).map(Calling::Udp).map_err(failed)
            }
            Transport::Tcp => Ok(Calling::Tcp(address, None)),
        }
    }

    /// Connects anew; a datagram needs no connection.
    pub fn connect(&mut self, limit: Duration) -> Result<(), NetError> {
        if let Calling::Tcp(address, connection) = self {
            *connection = None;
            *connection = Some(Connection::connect(*address, limit)?);
        }
        Ok(())
    }

    /// What it speaks.
    pub fn transport(&self) -> Transport {
        match self {
            Calling::Udp(_) => Transport::Udp,
            Calling::Tcp(..) => Transport::Tcp,
        }
    }

    /// Where it is bound; a connection hears nobody but its other end.
    pub fn local(&self) -> Option<SocketAddr> {
        match self {
            Calling::Udp(endpoint) => Some(endpoint.local()),
            Calling::Tcp(..) => None,
        }
    }

    /// Answers meet a closed port from now on, until [`Self::open`]. A connection goes on.
    pub fn refuse(&mut self) -> Result<(), Error> {
        match self {
            Calling::Udp(endpoint) => endpoint.refuse().map_err(failed),
            Calling::Tcp(..) => Ok(()),
        }
    }

    /// Answers arrive again.
    pub fn open(&mut self) -> Result<(), Error> {
        match self {
            Calling::Udp(endpoint) => {
                let lock = endpoint.peer().map_or(Lock::First, Lock::Only);
                bind_again(endpoint, lock).map_err(failed)
            }
            Calling::Tcp(..) => Ok(()),
        }
    }

    /// Closes the connection, if there is one.
    pub fn hang_up(&mut self) {
        if let Calling::Tcp(_, connection) = self {
            *connection = None;
        }
    }

    /// What to wait for.
    pub fn socket(&self) -> Option<&dyn AsFd> {
        match self {
            Calling::Udp(endpoint) => Some(endpoint.as_ref()),
            // The end of a closed connection would be there to read for ever.
            Calling::Tcp(_, connection) => {
                connection.as_ref().filter(|connection| connection.is_open()).map(|open| open as &dyn AsFd)
            }
        }
    }

    pub fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            Calling::Udp(endpoint) => endpoint.receive(clock, &mut |_| true, arrivals),
            Calling::Tcp(_, connection) => connection.as_mut().map_or(Ok(()), |open| open.receive(clock, arrivals)),
        }
        .map_err(failed)
    }

    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            Calling::Udp(endpoint) => endpoint.send(clock, bytes, arrivals),
            Calling::Tcp(_, connection) => connection.as_mut().map_or(Ok(()), |open| open.send(clock, bytes, arrivals)),
        }
        .map_err(failed)
    }
}
