//! Sockets of a live recording, and what their arrivals become.

use super::devices::{Devices, Way};
use crate::cell::RobotConfig;
use crate::error::Error;
use drivers::net::{Arrival, Clock, Connection, Endpoint, Listener, Lock, NetError};
use drivers::rsi::{Root, Telegram, Transport, split};
use sim_core::time::Nanos;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::os::fd::AsFd;

/// Silence after which another sender may take the place of a robot: RSI that starts again sends from another port. Chosen.
const FORGET_NS: i64 = 1_000_000_000;

/// A socket's error as a command shows it.
pub(super) fn failed(error: NetError) -> Error {
    Error::new(error.to_string()).help("correct the address in the cell, or end the program that has the port")
}

/// Whether bytes are a frame of a robot controller.
pub(super) fn is_frame(bytes: &[u8]) -> bool {
    let is_rob = |document: Vec<u8>| Telegram::decode(&document).is_ok_and(|telegram| telegram.root == Root::Rob);
    split(bytes).into_iter().flatten().any(is_rob)
}

/// An address of this computer from which that one is reached.
pub(super) fn any_port(peer: SocketAddr) -> SocketAddr {
    let ip = if peer.ip().is_loopback() { IpAddr::V4(Ipv4Addr::LOCALHOST) } else { IpAddr::V4(Ipv4Addr::UNSPECIFIED) };
    SocketAddr::new(ip, 0)
}

/// The side of a robot controller: bound, waiting for it to speak.
#[derive(Debug)]
pub(super) enum Link {
    Udp(Box<Endpoint>, Option<Nanos>),
    Tcp(Listener, Option<Connection>),
}

impl Link {
    pub fn bind(address: SocketAddr, transport: Transport) -> Result<Self, Error> {
        match transport {
            Transport::Udp => Ok(Link::Udp(Box::new(Endpoint::bind(address, Lock::First).map_err(failed)?), None)),
            Transport::Tcp => Ok(Link::Tcp(Listener::bind(address).map_err(failed)?, None)),
        }
    }

    pub fn of(robot: &RobotConfig, transport: Transport) -> Result<Self, Error> {
        Link::bind(robot.listen, transport).map_err(|error| error.place(format!("robot {}", robot.name)))
    }

    pub fn local(&self) -> SocketAddr {
        match self {
            Link::Udp(endpoint, _) => endpoint.local(),
            Link::Tcp(listener, _) => listener.local(),
        }
    }

    /// What to wait for.
    pub fn socket(&self) -> &dyn AsFd {
        match self {
            Link::Udp(endpoint, _) => endpoint.as_ref(),
            Link::Tcp(_, Some(connection)) => connection,
            Link::Tcp(listener, None) => listener,
        }
    }

    /// All that waits. True: the stream that they are of is a new one.
    pub fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<bool, Error> {
        match self {
            Link::Udp(endpoint, last) => {
                endpoint.receive(clock, &mut is_frame, arrivals).map_err(failed)?;
                let now = clock();
                if arrivals.iter().any(|arrival| matches!(arrival, Arrival::Bytes { .. })) {
                    *last = Some(now);
                } else if last.is_some_and(|last| now.0.saturating_sub(last.0) > FORGET_NS) {
                    endpoint.forget();
                    *last = None;
                }
                Ok(false)
            }
            Link::Tcp(listener, connection) => {
                let busy = connection.as_ref().is_some_and(Connection::is_open);
                let accepted = listener.accept(busy).map_err(failed)?;
                let is_new = accepted.is_some();
                if is_new || !busy {
                    *connection = accepted;
                }
                connection.as_mut().map_or(Ok(()), |open| open.receive(clock, arrivals)).map_err(failed)?;
                Ok(is_new)
            }
        }
    }

    /// Whether documents travel on a stream.
    pub fn is_stream(&self) -> bool {
        matches!(self, Link::Tcp(..))
    }

    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), Error> {
        match self {
            Link::Udp(endpoint, _) if endpoint.peer().is_some() => endpoint.send(clock, bytes, arrivals),
            Link::Tcp(_, Some(connection)) if connection.is_open() => connection.send(clock, bytes, arrivals),
            // Who asked is gone; there is nobody to answer.
            _ => Ok(()),
        }
        .map_err(failed)
    }
}

/// What is no bytes becomes an event.
pub(super) fn note(source: &str, arrival: &Arrival, devices: &mut Devices) {
    let (at, class, text) = match arrival {
        Arrival::Bytes { .. } => return,
        Arrival::Stranger { at, from, peer } => (at, "net-stranger", format!("{from} sends too; the peer is {peer}")),
        Arrival::Invalid { at, from, bytes } => {
            (at, "net-invalid", format!("{} bytes from {from} are no frame of a robot", bytes.len()))
        }
        Arrival::Taken { at, from, by } => (at, "net-taken", format!("{by} takes the stream away from {from}")),
        Arrival::Unreachable { at, why } => (at, "net-unreachable", format!("what was sent did not arrive: {why}")),
        Arrival::Closed { at } => (at, "net-closed", "the connection was closed".to_owned()),
    };
    devices.event(*at, source, class, text);
}

/// Takes what came from a robot controller. True: there is a fresh frame in it.
pub(super) fn take(robot: usize, arrival: &Arrival, is_stream: bool, is_new: bool, devices: &mut Devices) -> bool {
    match arrival {
        Arrival::Bytes { at, bytes, .. } if is_stream => devices.stream(robot, Way::FromRobot, *at, bytes, is_new),
        // A datagram that is no frame has a decoder that says why.
        Arrival::Bytes { at, bytes, .. } | Arrival::Invalid { at, bytes, .. } => {
            devices.datagram(robot, Way::FromRobot, *at, bytes)
        }
        _ => false,
    }
}
