//! From a frame to the IPv4 packet in it.
//!
//! | link type | what stands before the packet | source |
//! |---|---|---|
//! | 0, 108 | 4 bytes, the address family 2; in the byte order of whoever captured | LINKTYPE_NULL, LINKTYPE_LOOP |
//! | 1 | addresses 2 × 6, tags of 4 (8100, 88a8, 9100), protocol u16 | LINKTYPE_ETHERNET, IEEE 802.1Q |
//! | 12, 14, 101, 228 | nothing | LINKTYPE_RAW, LINKTYPE_IPV4 |
//! | 113 | 14 bytes, protocol u16 | LINKTYPE_LINUX_SLL |
//! | 276 | protocol u16, 18 bytes | LINKTYPE_LINUX_SLL2 |

use super::container::Order;
use super::packet::Skip;

const IPV4: u16 = 0x0800;
const TAGS_MAX: usize = 3;

/// The bytes from the IPv4 header on.
pub(super) fn internet(link: u16, frame: &[u8]) -> Result<&[u8], Skip> {
    let (protocol, from) = match link {
        0 | 108 => {
            let family = frame.first_chunk::<4>().ok_or(Skip::Malformed)?;
            let is_ipv4 = matches!(family, [2, 0, 0, 0] | [0, 0, 0, 2]);
            (if is_ipv4 { IPV4 } else { 0 }, 4)
        }
        1 => tagged(frame, 12)?,
        12 | 14 | 101 | 228 => return version_4(frame),
        113 => tagged(frame, 14)?,
        276 => (protocol_at(frame, 0)?, 20),
        _ => return Err(Skip::LinkType),
    };
    if protocol != IPV4 {
        return Err(Skip::NotIpv4);
    }
    version_4(frame.get(from..).ok_or(Skip::Malformed)?)
}

/// The protocol that stands at `at`, or behind the tags there; and where its packet begins.
fn tagged(frame: &[u8], at: usize) -> Result<(u16, usize), Skip> {
    let mut at = at;
    for _ in 0..=TAGS_MAX {
        match protocol_at(frame, at)? {
            0x8100 | 0x88a8 | 0x9100 => at += 4,
            protocol => return Ok((protocol, at + 2)),
        }
    }
    Err(Skip::Malformed)
}

fn protocol_at(frame: &[u8], at: usize) -> Result<u16, Skip> {
    Order::Big.u16(frame, at).ok_or(Skip::Malformed)
}

fn version_4(packet: &[u8]) -> Result<&[u8], Skip> {
    match packet.first().ok_or(Skip::Malformed)? >> 4 {
        4 => Ok(packet),
        _ => Err(Skip::NotIpv4),
    }
}
