//! What somebody else recorded from the wire: pcap and pcapng, as bytes come in.
//!
//! ```text
//! bytes → container (pcap | pcapng) → frames → link layer → IPv4 → UDP | TCP in order → Packet
//! ```
//! | part | reads | source |
//! |---|---|---|
//! | container | pcap of either byte order with µs or ns; pcapng with sections of either byte order, any time resolution | draft-ietf-opsawg-pcap, draft-ietf-opsawg-pcapng |
//! | link layer | Ethernet with up to three VLAN tags, Linux cooked v1 and v2, raw IP, BSD loopback | tcpdump.org/linktypes |
//! | internet | IPv4 with UDP or TCP | RFC 791, 768, 9293 |
//!
//! What cannot be used is counted under a name ([`Skip`]) and never stops the reading; a container that contradicts itself
//! does, because nothing says where its next record begins ([`Damage`]). Memory is bounded whatever the bytes are: one record
//! of the container, and per TCP stream what is held back for order.
//!
//! Not covered: IPv6; reassembly of IP fragments (they are counted: an RSI document above about 1470 bytes needs a larger
//! MTU); checksums of IP, UDP and TCP (network cards fill them in after the capture); TCP payload beyond one gap at a time.

mod container;
mod internet;
mod link;
mod packet;
mod pcapng;
mod reader;
mod stream;

pub use packet::{Damage, Packet, Skip, Tally, Transport, Why};
pub use reader::Reader;
