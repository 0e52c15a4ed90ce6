//! The blocks of a pcapng.
//!
//! ```text
//! type u32 | length u32 | body, padded to 4 | length u32
//! ```
//! | type | block | body |
//! |---|---|---|
//! | 0a0d0d0a | section | byte-order mark 1a2b3c4d, version, section length, options |
//! | 1 | interface | link type u16, 2 bytes, snapshot length u32, options (9: resolution of time, 14: offset of time in s) |
//! | 6 | packet | interface u32, time 2 × u32 (upper half first), kept u32, length u32, bytes, options |
//! | 2 | packet, old form | interface u16, drops u16, then as 6 |
//! | 3 | simple packet | length u32, bytes: it has no time |
//!
//! Other blocks are stepped over without being held in memory.

use super::container::{FRAME_LENGTH_MAX, Frame, Order, Record, Taken};
use super::packet::{Skip, Why};
use sim_core::time::Nanos;

const SECTION: u32 = 0x0a0d_0d0a;
const INTERFACE: u32 = 1;
const PACKET_OLD: u32 = 2;
const PACKET_SIMPLE: u32 = 3;
const PACKET: u32 = 6;
const ORDER_MARK: u32 = 0x1a2b_3c4d;
/// Type and length, and the length again at the end.
const FRAMING_LENGTH: usize = 12;
/// Longest block that is read: a frame and its options. Chosen.
const BLOCK_LENGTH_MAX: u64 = 2 * FRAME_LENGTH_MAX as u64;
/// Most interfaces of one section. Chosen.
const INTERFACES_MAX: usize = 256;
/// Resolution of time where an interface does not say: 10⁻⁶ s.
const RESOLUTION_DEFAULT: u8 = 6;

#[derive(Debug, Clone, Copy)]
struct Interface {
    link: u16,
    /// Ticks per second.
    rate: u64,
    offset_s: i64,
}

/// The section that is being read.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    order: Option<Order>,
    interfaces: Vec<Interface>,
}

impl Blocks {
    pub fn take<'b>(&mut self, bytes: &'b [u8]) -> Result<Option<Taken<'b>>, Why> {
        if bytes.len() < FRAMING_LENGTH {
            return Ok(None);
        }
        let is_section = bytes.starts_with(&SECTION.to_be_bytes());
        if is_section {
            self.section(bytes)?;
        }
        // The first block of a capture is a section.
        let order = self.order.unwrap_or(Order::Little);
        let word = |at: usize| order.u32(bytes, at).unwrap_or_default();
        let (kind, length) = (word(0), word(4));
        if (length as usize) < FRAMING_LENGTH || length % 4 != 0 {
            return Err(Why::Unequal { first: length, last: length });
        }
        let is_read = is_section || matches!(kind, INTERFACE | PACKET | PACKET_OLD | PACKET_SIMPLE);
        if !is_read {
            return Ok(Some(Taken { used: length.into(), record: Record::None }));
        }
        if u64::from(length) > BLOCK_LENGTH_MAX {
            return Err(Why::Length { of: "a block", length: length.into(), limit: BLOCK_LENGTH_MAX });
        }
        let Some(block) = bytes.get(..length as usize) else { return Ok(None) };
        let end = block.len() - 4;
        let last = order.u32(block, end).unwrap_or_default();
        if last != length {
            return Err(Why::Unequal { first: length, last });
        }
        let body = &block[8..end];
        let record = match kind {
            INTERFACE => self.interface(order, body)?,
            PACKET => self.packet(order, body, order.u32(body, 0))?,
            PACKET_OLD => self.packet(order, body, order.u16(body, 0).map(u32::from))?,
            PACKET_SIMPLE => Record::Skipped(Skip::NoTime),
            _ => Record::None,
        };
        Ok(Some(Taken { used: length.into(), record }))
    }

    /// A section sets the byte order and forgets the interfaces.
    fn section(&mut self, bytes: &[u8]) -> Result<(), Why> {
        let mark = Order::Little.u32(bytes, 8).unwrap_or_default();
        self.order = match mark {
            ORDER_MARK => Some(Order::Little),
            _ if mark.swap_bytes() == ORDER_MARK => Some(Order::Big),
            _ => return Err(Why::ByteOrder(mark)),
        };
        self.interfaces.clear();
        Ok(())
    }

    fn interface(&mut self, order: Order, body: &[u8]) -> Result<Record<'static>, Why> {
        let Some(link) = order.u16(body, 0) else { return Ok(Record::Skipped(Skip::Malformed)) };
        let count = self.interfaces.len() as u64 + 1;
        if count > INTERFACES_MAX as u64 {
            return Err(Why::Length { of: "a list of interfaces", length: count, limit: INTERFACES_MAX as u64 });
        }
        let (resolution, offset_s) = time_options(order, body.get(8..).unwrap_or_default());
        let power = u32::from(resolution & 0x7f);
        let rate = if resolution & 0x80 == 0 { 10_u64.checked_pow(power) } else { 1_u64.checked_shl(power) };
        // A rate of 0 marks times that 64 bits do not hold: its frames are counted as having none.
        self.interfaces.push(Interface { link, rate: rate.unwrap_or(0), offset_s });
        Ok(Record::None)
    }

    fn packet<'b>(&self, order: Order, body: &'b [u8], interface: Option<u32>) -> Result<Record<'b>, Why> {
        let word = |nth: usize| order.u32(body, 4 * nth);
        let (Some(interface), Some(high), Some(low), Some(kept), Some(length)) =
            (interface, word(1), word(2), word(3), word(4))
        else {
            return Ok(Record::Skipped(Skip::Malformed));
        };
        let limit = FRAME_LENGTH_MAX as u64;
        if u64::from(kept) > limit {
            return Err(Why::Length { of: "a frame", length: kept.into(), limit });
        }
        let Some(bytes) = body.get(20..20 + kept as usize) else { return Ok(Record::Skipped(Skip::Malformed)) };
        let Some(interface) = self.interfaces.get(interface as usize) else {
            return Ok(Record::Skipped(Skip::NoInterface));
        };
        let ticks = u64::from(high) << 32 | u64::from(low);
        let Some(at) = nanos(ticks, interface) else { return Ok(Record::Skipped(Skip::NoTime)) };
        Ok(Record::Frame(Frame { at, link: interface.link, bytes, is_cut: length > kept }))
    }
}

fn nanos(ticks: u64, interface: &Interface) -> Option<Nanos> {
    if interface.rate == 0 {
        return None;
    }
    let since = i128::from(ticks) * 1_000_000_000 / i128::from(interface.rate);
    let total = since + i128::from(interface.offset_s) * 1_000_000_000;
    i64::try_from(total).ok().map(Nanos)
}

/// Resolution and offset of time, from the options of an interface.
fn time_options(order: Order, mut options: &[u8]) -> (u8, i64) {
    let (mut resolution, mut offset_s) = (RESOLUTION_DEFAULT, 0);
    while let (Some(code), Some(length)) = (order.u16(options, 0), order.u16(options, 2)) {
        let length = usize::from(length);
        let Some(value) = options.get(4..4 + length) else { break };
        match code {
            0 => break,
            9 => resolution = value.first().copied().unwrap_or(RESOLUTION_DEFAULT),
            14 => offset_s = order.u64(value, 0).map_or(0, |offset| offset as i64),
            _ => {}
        }
        options = options.get(4 + length.next_multiple_of(4)..).unwrap_or_default();
    }
    (resolution, offset_s)
}
