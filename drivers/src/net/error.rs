//! What goes wrong with a socket, and what to type next.

use super::{OUTBOX_BYTES_MAX, PAYLOAD_BYTES_MAX};
use std::io;
use std::net::SocketAddr;

/// What went wrong with a socket. Hostile or absent peers are no errors: they are `Arrival`s.
#[derive(Debug, thiserror::Error)]
pub enum NetError {
    /// Another program, or this one, has the port.
    #[error(
        "{transport} port {} of {} is in use; `ss -{}lpn 'sport = :{}'` names the program that has it",
        .address.port(), .address.ip(), if *transport == "UDP" { 'u' } else { 't' }, .address.port()
    )]
    InUse {
        /// UDP or TCP.
        transport: &'static str,
        /// Where it should be bound.
        address: SocketAddr,
    },
    /// The address belongs to another machine.
    #[error("{address}: this machine has no such address; `ip -brief address` lists those that it has")]
    NotHere {
        /// Where it should be bound.
        address: SocketAddr,
    },
    /// A port below 1024 without the right to it.
    #[error("{address}: not permitted; ports below 1024 need privileges")]
    NotPermitted {
        /// Where it should be bound.
        address: SocketAddr,
    },
    /// The kernel grants too little memory for what arrives while nobody reads.
    #[error(
        "{address}: the kernel grants a receive buffer of {granted} bytes, at least {needed} are needed; `sysctl -w net.core.rmem_max={needed}`"
    )]
    Buffer {
        /// Where it is bound.
        address: SocketAddr,
        /// What the kernel grants, in bytes.
        granted: usize,
        /// What is needed, in bytes.
        needed: usize,
    },
    /// There is nobody to send to yet.
    #[error("{local}: nothing can be sent before a valid datagram has come in: the peer is not known")]
    NoPeer {
        /// Where it is bound.
        local: SocketAddr,
    },
    /// More bytes than a datagram holds.
    #[error("a datagram of {length} bytes is longer than the {PAYLOAD_BYTES_MAX} bytes that UDP carries")]
    TooLong {
        /// What should be sent, in bytes.
        length: usize,
    },
    /// The other side of a connection does not read.
    #[error("{peer}: {waiting} bytes wait to be sent, limit {OUTBOX_BYTES_MAX}: the other side does not read")]
    NotRead {
        /// The other side.
        peer: SocketAddr,
        /// What waits, in bytes.
        waiting: usize,
    },
    /// A page that did not come, or not whole.
    #[error("http://{address}{path}: {what}")]
    Page {
        /// The server.
        address: SocketAddr,
        /// Which page.
        path: String,
        /// What is wrong with it.
        what: String,
    },
    /// Anything else that the system says.
    #[error("{doing} {address}: {source}")]
    System {
        /// What was tried.
        doing: &'static str,
        /// With whom.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
}
