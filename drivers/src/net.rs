//! Sockets: the only file that has any. It moves bytes, stamps them with the caller's clock, and decides nothing about them.
//!
//! | what | how |
//! |---|---|
//! | UDP [`Endpoint`] | bound without `SO_REUSEADDR`, so that a port in use shows; never blocks; a datagram of any length is whole |
//! | peer | locked to the first sender whose bytes the caller calls valid ([`Lock`]); others are counted and reported |
//! | unreachable peer | `IP_RECVERR` (Linux): an ICMP message becomes [`Arrival::Unreachable`], never an error |
//! | TCP [`Listener`], [`Connection`] | one connection at a time, `TCP_NODELAY`, what waits to be sent is bounded |
//! | [`wait`] | `poll(2)` over any of them, with a bounded time and no thread |
//! | [`http_get`] | one page with a limit in time; its bytes are judged by [`crate::ft::http`] |
//!
//! The controller sends first and from any port, so a reply goes to where the frame came from (reference/PROTOCOLS.md,
//! section 1.1). A second start command takes a sensor's stream away (section 2.1): [`Lock::Latest`] is the sensor's side.
//!
//! Not covered: stamps by the kernel or the network card (a stamp is taken when the datagram is read, so a late reader adds its
//! own delay); multicast; systems other than Unix; ICMP on systems other than Linux.

mod arrival;
mod error;
mod get;
#[cfg(test)]
mod tests;

pub use arrival::{Arrival, Counts, Lock};
pub use error::NetError;
pub use get::http_get;
use nix::poll::{PollFd, PollFlags};
use sim_core::time::Nanos;
use socket2::{Domain, Protocol, Socket, Type};
use std::collections::BTreeSet;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

/// Time as the caller counts it; any monotonic clock will do, and in virtual time it is no clock at all.
pub type Clock<'a> = &'a dyn Fn() -> Nanos;

/// Longest UDP payload over IPv4 is 65,507 bytes; the buffer takes a whole IP packet, so that none is cut.
const DATAGRAM_BYTES: usize = 65_536;
/// Longest payload that fits into one IPv4 packet.
const PAYLOAD_BYTES_MAX: usize = 65_507;
/// Asked of the kernel for what arrives while nobody reads. Linux charges about 768 bytes for a small datagram: over a second of
/// a sensor at 1 kHz.
const RECEIVE_BUFFER_BYTES: usize = 1 << 20;
/// The port from which nobody sends (RFC 863).
const DISCARD: u16 = 9;
/// What the kernel must grant: a quarter of a second of the same. Linux grants 208 KiB, doubled, without any setting.
const RECEIVE_BUFFER_BYTES_MIN: usize = 192 << 10;
/// Datagrams of one call of [`Endpoint::receive`], so that a flood cannot keep the caller there.
const DATAGRAMS_PER_CALL_MAX: usize = 4096;
/// Strangers that are reported one by one; beyond that they are only counted.
const STRANGERS_REPORTED_MAX: usize = 16;
/// Errors of earlier datagrams that one call takes note of.
const ERRORS_PER_CALL_MAX: usize = 64;
/// What may wait to be sent on a connection whose other side does not read.
const OUTBOX_BYTES_MAX: usize = 256 << 10;
/// Bytes of one call of [`Connection::receive`].
const STREAM_BYTES_PER_CALL_MAX: usize = 1 << 20;

fn system(doing: &'static str, address: SocketAddr) -> impl Fn(io::Error) -> NetError {
    move |source| NetError::System { doing, address, source }
}

fn bound(transport: &'static str, address: SocketAddr, source: io::Error) -> NetError {
    match source.kind() {
        ErrorKind::AddrInUse => NetError::InUse { transport, address },
        ErrorKind::AddrNotAvailable => NetError::NotHere { address },
        ErrorKind::PermissionDenied => NetError::NotPermitted { address },
        _ => NetError::System { doing: "bind", address, source },
    }
}

/// Nothing there yet, or a signal came in between: both mean 'ask again'.
fn later(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// What an ICMP message about an earlier datagram becomes.
fn unreachable(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable
    )
}

/// One UDP port.
#[derive(Debug)]
pub struct Endpoint {
    socket: UdpSocket,
    local: SocketAddr,
    lock: Lock,
    peer: Option<SocketAddr>,
    /// Whoever is valid next becomes the peer.
    is_open: bool,
    reported: BTreeSet<SocketAddr>,
    counts: Counts,
    receive_buffer_bytes: usize,
    buffer: Vec<u8>,
}

impl Endpoint {
    /// Binds the port; port 0 is any free one.
    pub fn bind(address: SocketAddr, lock: Lock) -> Result<Endpoint, NetError> {
        let failed = |doing| system(doing, address);
        let socket =
            Socket::new(Domain::for_address(address), Type::DGRAM, Some(Protocol::UDP)).map_err(failed("open"))?;
        socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES).map_err(failed("set the receive buffer of"))?;
        let receive_buffer_bytes = socket.recv_buffer_size().map_err(failed("read the receive buffer of"))?;
        if receive_buffer_bytes < RECEIVE_BUFFER_BYTES_MIN {
            return Err(NetError::Buffer { address, granted: receive_buffer_bytes, needed: RECEIVE_BUFFER_BYTES_MIN });
        }
        socket.set_nonblocking(true).map_err(failed("set"))?;
        report_unreachable(&socket, address).map_err(failed("set"))?;
        socket.bind(&address.into()).map_err(|source| bound("UDP", address, source))?;
        let socket: UdpSocket = socket.into();
        let local = socket.local_addr().map_err(failed("name"))?;
        let peer = if let Lock::Only(peer) = lock { Some(peer) } else { None };
        let buffer = vec![0; DATAGRAM_BYTES];
        let counts = Counts::default();
        let reported = BTreeSet::new();
        Ok(Endpoint { socket, local, lock, peer, is_open: false, reported, counts, receive_buffer_bytes, buffer })
    }

    /// Where it is bound.
    pub fn local(&self) -> SocketAddr {
        self.local
    }

    /// Who the peer is, once it is known.
    pub fn peer(&self) -> Option<SocketAddr> {
        self.peer
    }

    /// What has been counted since the start.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// What the kernel grants for datagrams that nobody has read yet.
    pub fn receive_buffer_bytes(&self) -> usize {
        self.receive_buffer_bytes
    }

    /// The peer is silent: the next valid datagram of whomever brings the next peer. Until then this one stays. A fixed one stays
    /// for good.
    pub fn relent(&mut self) {
        self.is_open = self.peer.is_some() && !matches!(self.lock, Lock::Only(_));
        self.reported.clear();
    }

    /// The session is over: the next valid datagram brings the next peer. A fixed peer stays.
    pub fn forget(&mut self) {
        if !matches!(self.lock, Lock::Only(_)) {
            self.peer = None;
        }
        self.reported.clear();
    }

    /// From now on the peer meets a closed port here: its machine is told by ICMP that nobody is there, while this end may still
    /// send. Bind the port again, after this end is dropped, to open it.
    ///
    /// A socket that is connected to somebody else hears nobody but him. Linux lets it send to others all the same.
    ///
    /// # Errors
    /// Before there is a peer.
    pub fn refuse(&mut self) -> Result<(), NetError> {
        let peer = self.peer.ok_or(NetError::NoPeer { local: self.local })?;
        let other = if peer.port() == DISCARD { DISCARD + 1 } else { DISCARD };
        self.socket.connect(SocketAddr::new(peer.ip(), other)).map_err(system("close", self.local))
    }

    /// Reads everything that waits, at most 4,096 datagrams. Never blocks. `valid` is asked where a sender may become the peer.
    pub fn receive(
        &mut self,
        clock: Clock<'_>,
        valid: &mut dyn FnMut(&[u8]) -> bool,
        arrivals: &mut Vec<Arrival>,
    ) -> Result<(), NetError> {
        for _ in 0..DATAGRAMS_PER_CALL_MAX {
            match self.socket.recv_from(&mut self.buffer) {
                Ok((length, from)) => self.arrived(clock(), from, length, valid, arrivals),
                Err(error) if later(&error) => break,
                Err(error) if unreachable(&error) => self.undelivered(clock(), &error, arrivals),
                Err(error) => return Err(system("receive on", self.local)(error)),
            }
        }
        Ok(())
    }

    fn arrived(
        &mut self,
        at: Nanos,
        from: SocketAddr,
        length: usize,
        valid: &mut dyn FnMut(&[u8]) -> bool,
        arrivals: &mut Vec<Arrival>,
    ) {
        let bytes = self.buffer.get(..length).unwrap_or_default();
        if let Lock::Host(host) = self.lock {
            self.peer = if from.ip() == host { Some(from) } else { self.peer.or(Some(SocketAddr::new(host, 0))) };
        }
        match self.peer {
            Some(peer) if peer == from => self.is_open = self.is_open && !valid(bytes),
            Some(peer) if (self.lock != Lock::Latest && !self.is_open) || !valid(bytes) => {
                self.counts.strangers += 1;
                if self.reported.len() < STRANGERS_REPORTED_MAX && self.reported.insert(from) {
                    arrivals.push(Arrival::Stranger { at, from, peer });
                }
                return;
            }
            None if !valid(bytes) => {
                self.counts.invalid += 1;
                arrivals.push(Arrival::Invalid { at, from, bytes: bytes.to_vec() });
                return;
            }
            other => {
                self.peer = Some(from);
                self.is_open = false;
                arrivals.extend(other.map(|old| Arrival::Taken { at, from: old, by: from }));
            }
        }
        self.counts.received += 1;
        arrivals.push(Arrival::Bytes { at, from, bytes: bytes.to_vec() });
    }

    fn undelivered(&mut self, at: Nanos, error: &io::Error, arrivals: &mut Vec<Arrival>) {
        self.counts.unreachable += forget_errors(&self.socket).max(1);
        arrivals.push(Arrival::Unreachable { at, why: error.kind() });
    }

    /// Sends to the peer. That an earlier datagram did not arrive goes to `arrivals`, and this one is sent all the same.
    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), NetError> {
        let peer = self.peer.ok_or(NetError::NoPeer { local: self.local })?;
        if bytes.len() > PAYLOAD_BYTES_MAX {
            return Err(NetError::TooLong { length: bytes.len() });
        }
        for _ in 0..ERRORS_PER_CALL_MAX {
            match self.socket.send_to(bytes, peer) {
                Ok(_) => {
                    self.counts.sent += 1;
                    return Ok(());
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if unreachable(&error) => self.undelivered(clock(), &error, arrivals),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(system("send to", peer)(error)),
            }
        }
        // A cyclic sender does not wait: what is late is worth nothing.
        self.counts.unsent += 1;
        Ok(())
    }
}

impl AsFd for Endpoint {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Without this, Linux keeps ICMP messages from a socket that is not connected; and a connected one would not see strangers.
#[cfg(target_os = "linux")]
fn report_unreachable(socket: &Socket, address: SocketAddr) -> io::Result<()> {
    use nix::sys::socket::{setsockopt, sockopt};
    match address {
        SocketAddr::V4(_) => setsockopt(socket, sockopt::Ipv4RecvErr, &true)?,
        SocketAddr::V6(_) => setsockopt(socket, sockopt::Ipv6RecvErr, &true)?,
    }
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn report_unreachable(_: &Socket, _: SocketAddr) -> io::Result<()> {
    Ok(())
}

/// Linux keeps each message until it is read, in the memory of the receive buffer: unread ones would shut the port. Tells how
/// many there were.
#[cfg(target_os = "linux")]
fn forget_errors(socket: &UdpSocket) -> u64 {
    use nix::sys::socket::{MsgFlags, recv};
    use std::os::fd::AsRawFd;
    let flags = MsgFlags::MSG_ERRQUEUE | MsgFlags::MSG_DONTWAIT;
    let mut dropped = [0; 64];
    (0..ERRORS_PER_CALL_MAX).take_while(|_| recv(socket.as_raw_fd(), &mut dropped, flags).is_ok()).count() as u64
}

#[cfg(not(target_os = "linux"))]
fn forget_errors(_: &UdpSocket) -> u64 {
    0
}

/// A TCP port that serves one connection at a time.
#[derive(Debug)]
pub struct Listener {
    socket: TcpListener,
    local: SocketAddr,
    refused: u64,
    last_refused: Option<SocketAddr>,
}

impl Listener {
    /// Binds the port; port 0 is any free one. A port that is served is in use; one whose last connection ended a moment ago
    /// is not: for TCP, that is all that `SO_REUSEADDR`, which the standard library sets, does on Unix.
    pub fn bind(address: SocketAddr) -> Result<Listener, NetError> {
        let failed = |doing| system(doing, address);
        let socket = TcpListener::bind(address).map_err(|source| bound("TCP", address, source))?;
        socket.set_nonblocking(true).map_err(failed("set"))?;
        let local = socket.local_addr().map_err(failed("name"))?;
        Ok(Listener { socket, local, refused: 0, last_refused: None })
    }

    /// Where it is bound.
    pub fn local(&self) -> SocketAddr {
        self.local
    }

    /// Connections that were closed at once, since there was one already.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Who was closed last in this way.
    pub fn last_refused(&self) -> Option<SocketAddr> {
        self.last_refused
    }

    /// The next connection, if one waits. While `busy`, whoever comes is closed at once and counted.
    pub fn accept(&mut self, busy: bool) -> Result<Option<Connection>, NetError> {
        loop {
            match self.socket.accept() {
                // Dropping it closes it.
                Ok((_, from)) if busy => {
                    self.refused += 1;
                    self.last_refused = Some(from);
                }
                Ok((stream, peer)) => return Connection::new(stream, peer).map(Some),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(None),
                // The other side left before it was accepted: the next one may be there.
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::ConnectionAborted) => {}
                Err(error) => return Err(system("accept on", self.local)(error)),
            }
        }
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// A TCP connection. Documents are cut out of its stream by the protocol, not here.
#[derive(Debug)]
pub struct Connection {
    stream: TcpStream,
    peer: SocketAddr,
    outbox: Vec<u8>,
    buffer: Vec<u8>,
    open: bool,
}

impl Connection {
    fn new(stream: TcpStream, peer: SocketAddr) -> Result<Connection, NetError> {
        stream.set_nodelay(true).map_err(system("set", peer))?;
        stream.set_nonblocking(true).map_err(system("set", peer))?;
        Ok(Connection { stream, peer, outbox: Vec::new(), buffer: vec![0; DATAGRAM_BYTES], open: true })
    }

    /// Connects, and gives up after `limit`.
    pub fn connect(peer: SocketAddr, limit: Duration) -> Result<Connection, NetError> {
        let stream = TcpStream::connect_timeout(&peer, limit).map_err(system("connect to", peer))?;
        Connection::new(stream, peer)
    }

    /// The other side.
    pub fn peer(&self) -> SocketAddr {
        self.peer
    }

    /// Whether the other side is there, as far as is known.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Reads what waits, at most 1 MiB. Never blocks. A connection that was cut is closed, which is no error.
    pub fn receive(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), NetError> {
        self.flush(clock, arrivals)?;
        let mut read = 0;
        while self.open && read < STREAM_BYTES_PER_CALL_MAX {
            match self.stream.read(&mut self.buffer) {
                Ok(0) => self.close(clock, arrivals),
                Ok(length) => {
                    read += length;
                    let bytes = self.buffer.get(..length).unwrap_or_default().to_vec();
                    arrivals.push(Arrival::Bytes { at: clock(), from: self.peer, bytes });
                }
                Err(error) if later(&error) => break,
                Err(error) if cut(&error) => self.close(clock, arrivals),
                Err(error) => return Err(system("receive from", self.peer)(error)),
            }
        }
        Ok(())
    }

    /// Sends, or keeps what the system does not take now. On a closed connection nothing is sent.
    pub fn send(&mut self, clock: Clock<'_>, bytes: &[u8], arrivals: &mut Vec<Arrival>) -> Result<(), NetError> {
        let waiting = self.outbox.len() + bytes.len();
        if waiting > OUTBOX_BYTES_MAX {
            return Err(NetError::NotRead { peer: self.peer, waiting });
        }
        if self.open {
            self.outbox.extend_from_slice(bytes);
        }
        self.flush(clock, arrivals)
    }

    fn flush(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) -> Result<(), NetError> {
        while self.open && !self.outbox.is_empty() {
            match self.stream.write(&self.outbox) {
                Ok(length) => drop(self.outbox.drain(..length)),
                Err(error) if later(&error) => break,
                Err(error) if cut(&error) => self.close(clock, arrivals),
                Err(error) => return Err(system("send to", self.peer)(error)),
            }
        }
        Ok(())
    }

    fn close(&mut self, clock: Clock<'_>, arrivals: &mut Vec<Arrival>) {
        self.open = false;
        self.outbox.clear();
        arrivals.push(Arrival::Closed { at: clock() });
    }
}

impl AsFd for Connection {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

/// The other side ended the connection without a word.
fn cut(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe)
}

/// Waits until something comes in on any of the sockets, or until the time is over; tells which. An error that waits on a socket
/// counts as something that came in: the next call on it says what it is.
pub fn wait(sockets: &[&dyn AsFd], limit: Duration) -> io::Result<Vec<bool>> {
    let mut watched: Vec<PollFd<'_>> =
        sockets.iter().map(|socket| PollFd::new(socket.as_fd(), PollFlags::POLLIN)).collect();
    match poll(&mut watched, limit) {
        // A signal ends the waiting; who waits looks around and comes back.
        Ok(_) | Err(nix::Error::EINTR) => {}
        Err(error) => return Err(error.into()),
    }
    Ok(watched.iter().map(|one| one.revents().is_some_and(|what| !what.is_empty())).collect())
}

/// Fractions of a millisecond matter in a cycle of four.
#[cfg(target_os = "linux")]
fn poll(watched: &mut [PollFd<'_>], limit: Duration) -> nix::Result<i32> {
    nix::poll::ppoll(watched, Some(limit.into()), None)
}

#[cfg(not(target_os = "linux"))]
fn poll(watched: &mut [PollFd<'_>], limit: Duration) -> nix::Result<i32> {
    nix::poll::poll(watched, u16::try_from(limit.as_millis()).unwrap_or(u16::MAX))
}
