//! What a capture yields: packets, counts of what was no use, and the reason why reading stopped.

use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::fmt;
use std::net::SocketAddrV4;

/// How a payload travelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Transport {
    /// One datagram.
    Udp,
    /// A piece of a stream, in order.
    Tcp,
}

/// One payload on its way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Time of the capture since 1970. A piece of a stream that came too early bears the time at which its turn came.
    pub at: Nanos,
    /// Who sent it.
    pub from: SocketAddrV4,
    /// To whom.
    pub to: SocketAddrV4,
    /// How.
    pub transport: Transport,
    /// The bytes.
    pub payload: Vec<u8>,
    /// TCP: bytes of the stream are missing before these, or the stream is a new one. A decoder starts afresh.
    pub broken: bool,
}

/// Why a frame, or a part of it, is no packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Skip {
    /// A link type that is not read.
    LinkType,
    /// Neither IPv4 nor anything that carries it: ARP, LLDP, IPv6 and the like.
    NotIpv4,
    /// IPv4 with neither UDP nor TCP in it.
    NotUdpOrTcp,
    /// A piece of a datagram that was cut up on its way.
    Fragment,
    /// The capture kept less than was sent: its snapshot length is too small.
    Cut,
    /// A length in a header contradicts another one.
    Malformed,
    /// The container gives the frame no time, or one that 64 bits of nanoseconds do not hold.
    NoTime,
    /// The frame belongs to an interface that the container never described.
    NoInterface,
    /// TCP: bytes that came before.
    Repeated,
    /// TCP: a hole that nothing filled.
    Hole,
    /// TCP: a stream that was set aside because too many ran at once.
    Stream,
}

impl Skip {
    /// The word that stands for it in a report.
    pub const fn id(self) -> &'static str {
        match self {
            Skip::LinkType => "capture-link-type",
            Skip::NotIpv4 => "capture-not-ipv4",
            Skip::NotUdpOrTcp => "capture-not-udp-or-tcp",
            Skip::Fragment => "capture-fragment",
            Skip::Cut => "capture-cut",
            Skip::Malformed => "capture-malformed",
            Skip::NoTime => "capture-no-time",
            Skip::NoInterface => "capture-no-interface",
            Skip::Repeated => "capture-tcp-repeated",
            Skip::Hole => "capture-tcp-hole",
            Skip::Stream => "capture-tcp-streams",
        }
    }

    /// What it means and what to do.
    pub const fn about(self) -> &'static str {
        match self {
            Skip::LinkType => "frames of a link type that is not read; capture on one Ethernet interface, or on `any`",
            Skip::NotIpv4 => "frames without IPv4",
            Skip::NotUdpOrTcp => "IPv4 packets without UDP and TCP",
            Skip::Fragment => "IP fragments, which are not put together; the datagram is longer than the MTU",
            Skip::Cut => "packets of which the capture kept only the beginning; capture with a snapshot length of 0",
            Skip::Malformed => "packets whose lengths contradict each other",
            Skip::NoTime => "frames without a usable time",
            Skip::NoInterface => "frames of an interface that the capture does not describe",
            Skip::Repeated => "TCP segments that came before",
            Skip::Hole => "holes in TCP streams; the capture lost packets",
            Skip::Stream => "TCP streams set aside because too many ran at once; capture with a filter on the ports",
        }
    }
}

/// What passed, and what did not.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// Frames in the container.
    pub frames: u64,
    /// Packets handed on.
    pub packets: u64,
    /// What was skipped, by reason.
    pub skipped: BTreeMap<Skip, u64>,
}

impl Tally {
    pub(super) fn skip(&mut self, why: Skip) {
        *self.skipped.entry(why).or_insert(0) += 1;
    }
}

/// The container contradicts itself; nothing after this byte is read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("byte {at}: {why}")]
pub struct Damage {
    /// First byte of the record.
    pub at: u64,
    /// What is wrong: value and limit.
    pub why: Why,
}

/// What is wrong with a container.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Why {
    /// The first bytes belong to no capture.
    NotACapture([u8; 4]),
    /// Something that has to be unpacked first.
    Packed(&'static str),
    /// A variant of pcap that is not read.
    Variant(u32),
    /// A length that no capture has.
    Length {
        /// What has this length.
        of: &'static str,
        /// The length in bytes.
        length: u64,
        /// The most that is read.
        limit: u64,
    },
    /// A block that ends elsewhere than it says.
    Unequal {
        /// Length at its beginning.
        first: u32,
        /// Length at its end.
        last: u32,
    },
    /// A fraction of a second that is a second or more.
    Fraction(u32),
    /// A section whose byte order cannot be told.
    ByteOrder(u32),
    /// The bytes end inside a record.
    CutOff {
        /// Bytes of the record that are there.
        there: u64,
    },
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Why::NotACapture([a, b, c, d]) => {
                write!(f, "begins with {a:02x} {b:02x} {c:02x} {d:02x}, which is neither pcap nor pcapng")
            }
            Why::Packed(with) => write!(f, "is packed with {with}; unpack it first"),
            Why::Variant(magic) => write!(f, "is the pcap variant {magic:08x}, which is not read; save it as pcapng"),
            Why::Length { of, length, limit } => write!(f, "{of} of {length} bytes, at most {limit} are possible"),
            Why::Unequal { first, last } => write!(f, "a block of {first} bytes ends with the length {last}"),
            Why::Fraction(ticks) => write!(f, "a time with {ticks} ticks, which is a second or more"),
            Why::ByteOrder(mark) => write!(f, "a section with the byte-order mark {mark:08x}, expected 1a2b3c4d"),
            Why::CutOff { there } => write!(f, "the capture ends {there} bytes into a record"),
        }
    }
}
