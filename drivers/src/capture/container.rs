//! Which kind of capture it is, and the records of a pcap.
//!
//! ```text
//! magic u32 | version 2 × u16 | zone i32 | accuracy u32 | snapshot length u32 | link type u32
//! then records: seconds u32 | fraction u32 | kept u32 | length on the wire u32 | bytes
//! ```
//! | magic, as written | fraction |
//! |---|---|
//! | a1b2c3d4 | µs |
//! | a1b23c4d | ns |

use super::packet::{Skip, Why};
use super::pcapng::Blocks;
use sim_core::time::Nanos;

/// Longest frame: the largest snapshot length that tcpdump takes.
pub(super) const FRAME_LENGTH_MAX: usize = 256 << 10;

const HEADER_LENGTH: usize = 24;
const RECORD_HEADER_LENGTH: usize = 16;
const NANOSECONDS_PER_SECOND: i64 = 1_000_000_000;

/// Order of the bytes in a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    pub fn u16(self, bytes: &[u8], at: usize) -> Option<u16> {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(if self == Order::Little { u16::from_le_bytes(*bytes) } else { u16::from_be_bytes(*bytes) })
    }

    pub fn u32(self, bytes: &[u8], at: usize) -> Option<u32> {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(if self == Order::Little { u32::from_le_bytes(*bytes) } else { u32::from_be_bytes(*bytes) })
    }

    pub fn u64(self, bytes: &[u8], at: usize) -> Option<u64> {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(if self == Order::Little { u64::from_le_bytes(*bytes) } else { u64::from_be_bytes(*bytes) })
    }
}

/// What a capture holds: bytes of one link type at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame<'b> {
    pub at: Nanos,
    pub link: u16,
    pub bytes: &'b [u8],
    /// Whether the wire had more bytes than these.
    pub is_cut: bool,
}

/// What one record was.
#[derive(Debug)]
pub(super) enum Record<'b> {
    /// No frame in it.
    None,
    Frame(Frame<'b>),
    /// A frame that cannot be used.
    Skipped(Skip),
}

/// One record, and how many bytes it took; they may lie beyond those that are there.
#[derive(Debug)]
pub(super) struct Taken<'b> {
    pub used: u64,
    pub record: Record<'b>,
}

/// What is known of the capture.
#[derive(Debug)]
pub(super) enum Container {
    Unknown,
    Classic(Classic),
    Blocks(Blocks),
}

impl Container {
    /// The record at the beginning of these bytes; `None` if more bytes are needed.
    pub fn take<'b>(&mut self, bytes: &'b [u8]) -> Result<Option<Taken<'b>>, Why> {
        match self {
            Container::Unknown => self.begin(bytes),
            Container::Classic(classic) => classic.take(bytes),
            Container::Blocks(blocks) => blocks.take(bytes),
        }
    }

    fn begin<'b>(&mut self, bytes: &'b [u8]) -> Result<Option<Taken<'b>>, Why> {
        let Some(first) = bytes.first_chunk::<4>() else { return Ok(None) };
        let (order, is_nano) = match u32::from_be_bytes(*first) {
            0xa1b2_c3d4 => (Order::Big, false),
            0xa1b2_3c4d => (Order::Big, true),
            0xd4c3_b2a1 => (Order::Little, false),
            0x4d3c_b2a1 => (Order::Little, true),
            0x0a0d_0d0a => {
                *self = Container::Blocks(Blocks::default());
                return self.take(bytes);
            }
            magic @ (0xa1b2_cd34 | 0x34cd_b2a1 | 0xa1e2_cb12 | 0x12cb_e2a1) => return Err(Why::Variant(magic)),
            0x28b5_2ffd => return Err(Why::Packed("zstd")),
            0xfd37_7a58 => return Err(Why::Packed("xz")),
            _ if first[..2] == [0x1f, 0x8b] => return Err(Why::Packed("gzip")),
            _ => return Err(Why::NotACapture(*first)),
        };
        if bytes.len() < HEADER_LENGTH {
            return Ok(None);
        }
        // The upper half may say how long the frame check sequence is; the sequence itself lies behind the IP packet.
        let link = order.u32(bytes, 20).unwrap_or_default() & 0xffff;
        *self = Container::Classic(Classic { order, is_nano, link: link as u16 });
        Ok(Some(Taken { used: HEADER_LENGTH as u64, record: Record::None }))
    }
}

/// A pcap.
#[derive(Debug)]
pub(super) struct Classic {
    order: Order,
    is_nano: bool,
    link: u16,
}

impl Classic {
    fn take<'b>(&self, bytes: &'b [u8]) -> Result<Option<Taken<'b>>, Why> {
        let word = |nth: usize| self.order.u32(bytes, 4 * nth);
        let (Some(seconds), Some(fraction), Some(kept), Some(length)) = (word(0), word(1), word(2), word(3)) else {
            return Ok(None);
        };
        let ticks_per_second = if self.is_nano { 1_000_000_000 } else { 1_000_000 };
        if fraction >= ticks_per_second {
            return Err(Why::Fraction(fraction));
        }
        let limit = FRAME_LENGTH_MAX as u64;
        if u64::from(kept) > limit {
            return Err(Why::Length { of: "a frame", length: kept.into(), limit });
        }
        let end = RECORD_HEADER_LENGTH + kept as usize;
        let Some(frame) = bytes.get(RECORD_HEADER_LENGTH..end) else { return Ok(None) };
        let nanoseconds = i64::from(fraction) * if self.is_nano { 1 } else { 1000 };
        let at = Nanos(i64::from(seconds) * NANOSECONDS_PER_SECOND + nanoseconds);
        let frame = Frame { at, link: self.link, bytes: frame, is_cut: length > kept };
        Ok(Some(Taken { used: end as u64, record: Record::Frame(frame) }))
    }
}
