//! What comes in from a socket, whose it is, and how often.

use sim_core::time::Nanos;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr};

/// Whose datagrams count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lock {
    /// The first sender of a valid datagram, until `Endpoint::forget`. A robot's side of RSI.
    First,
    /// Whoever sent the latest valid datagram: it takes the stream away from the one before. A sensor.
    Latest,
    /// This one and no other. Who asks a sensor knows where it is.
    Only(SocketAddr),
    /// Whoever sends from this machine, from any port: a sensor that is asked elsewhere than it sends from.
    Host(IpAddr),
}

/// What came in.
#[derive(Debug, Clone, PartialEq)]
pub enum Arrival {
    /// Bytes of the peer: a datagram, or a piece of a stream.
    Bytes {
        /// When it was read.
        at: Nanos,
        /// Who sent it.
        from: SocketAddr,
        /// All of it.
        bytes: Vec<u8>,
    },
    /// The first datagram of a sender who is not the peer. Its bytes are dropped.
    Stranger {
        /// When it was read.
        at: Nanos,
        /// Who sent it.
        from: SocketAddr,
        /// Who the peer is.
        peer: SocketAddr,
    },
    /// A datagram that is not valid, of a sender who is nobody's peer. The bytes are there, so that a decoder can name the fault.
    Invalid {
        /// When it was read.
        at: Nanos,
        /// Who sent it.
        from: SocketAddr,
        /// All of it.
        bytes: Vec<u8>,
    },
    /// The stream has another receiver now ([`Lock::Latest`]); its datagram follows.
    Taken {
        /// When it was read.
        at: Nanos,
        /// Who had it.
        from: SocketAddr,
        /// Who has it.
        by: SocketAddr,
    },
    /// A network or a host says that an earlier datagram did not arrive: there is no program on that port, or no way there.
    Unreachable {
        /// When it was read.
        at: Nanos,
        /// What the system calls it.
        why: ErrorKind,
    },
    /// The other side of a connection has closed it.
    Closed {
        /// When it was read.
        at: Nanos,
    },
}

/// How often something happened since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Datagrams of the peer.
    pub received: u64,
    /// Datagrams sent.
    pub sent: u64,
    /// Datagrams of senders who are not the peer.
    pub strangers: u64,
    /// Datagrams that are not valid, before there was a peer.
    pub invalid: u64,
    /// Messages that a datagram did not arrive.
    pub unreachable: u64,
    /// Datagrams that the system did not take, since its buffer was full.
    pub unsent: u64,
}
