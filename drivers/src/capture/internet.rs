//! From an IPv4 packet to a datagram or a segment.
//!
//! ```text
//! IPv4  version·4+words u8 | – | length u16 | id u16 | flags and offset u16 | – | protocol u8 | sum u16 | from 4 | to 4 | options
//! UDP   from u16 | to u16 | length u16 | sum u16
//! TCP   from u16 | to u16 | sequence u32 | acknowledged u32 | words·16 u8 | flags u8 | window u16 | sum u16 | urgent u16 | options
//! ```
//! A length of 0 in IPv4 or UDP means "as long as there are bytes": the network card fills it in when it cuts up a large send.

use super::container::Order::Big;
use super::packet::Skip;
use std::net::{Ipv4Addr, SocketAddrV4};

const UDP: u8 = 17;
const TCP: u8 = 6;
const UDP_HEADER_LENGTH: usize = 8;

/// What a packet carries.
#[derive(Debug, PartialEq)]
pub(super) enum Carried<'b> {
    Datagram { payload: &'b [u8] },
    Segment(Segment<'b>),
}

/// A TCP segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment<'b> {
    pub sequence: u32,
    /// First byte that the other side still waits for.
    pub acknowledged: Option<u32>,
    pub is_first: bool,
    pub is_last: bool,
    pub payload: &'b [u8],
}

/// Who sends, who receives, and what. `is_cut` is whether the capture kept less than there was.
pub(super) fn open(packet: &[u8], is_cut: bool) -> Result<(SocketAddrV4, SocketAddrV4, Carried<'_>), Skip> {
    let header_length = usize::from(packet.first().ok_or(Skip::Malformed)? & 0xf) * 4;
    let (length, flags) = (Big.u16(packet, 2).ok_or(Skip::Malformed)?, Big.u16(packet, 6).ok_or(Skip::Malformed)?);
    if header_length < 20 || packet.len() < header_length {
        return Err(Skip::Malformed);
    }
    // More fragments, or an offset: a piece of a larger packet.
    if flags & 0x3fff != 0 {
        return Err(Skip::Fragment);
    }
    let missing = if is_cut { Skip::Cut } else { Skip::Malformed };
    let end = if length == 0 { packet.len() } else { usize::from(length) };
    let body = packet.get(header_length..end).ok_or(missing)?;
    let address = |at: usize| Ipv4Addr::from(Big.u32(packet, at).unwrap_or_default());
    let port = |at: usize| Big.u16(body, at).ok_or(Skip::Malformed);
    let carried = match packet[9] {
        UDP => datagram(body)?,
        TCP => segment(body)?,
        _ => return Err(Skip::NotUdpOrTcp),
    };
    Ok((SocketAddrV4::new(address(12), port(0)?), SocketAddrV4::new(address(16), port(2)?), carried))
}

fn datagram(body: &[u8]) -> Result<Carried<'_>, Skip> {
    let length = usize::from(Big.u16(body, 4).ok_or(Skip::Malformed)?);
    let end = if length == 0 { body.len() } else { length };
    let payload = body.get(UDP_HEADER_LENGTH..end).ok_or(Skip::Malformed)?;
    Ok(Carried::Datagram { payload })
}

fn segment(body: &[u8]) -> Result<Carried<'_>, Skip> {
    let word = |at: usize| Big.u32(body, at).ok_or(Skip::Malformed);
    let (sequence, acknowledged) = (word(4)?, word(8)?);
    let (&words, &flags) = (body.get(12).ok_or(Skip::Malformed)?, body.get(13).ok_or(Skip::Malformed)?);
    let header_length = usize::from(words >> 4) * 4;
    if header_length < 20 {
        return Err(Skip::Malformed);
    }
    let payload = body.get(header_length..).ok_or(Skip::Malformed)?;
    let has = |flag: u8| flags & flag != 0;
    Ok(Carried::Segment(Segment {
        sequence,
        acknowledged: has(0x10).then_some(acknowledged),
        is_first: has(0x02),
        is_last: has(0x01) || has(0x04),
        payload,
    }))
}
