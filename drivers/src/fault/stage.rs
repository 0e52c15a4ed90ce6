//! One fault at work on one stream: packets in, packets out, what it holds in between.

use super::action::{Action, BYTES_MAX};
use super::faulty::Out;
use super::schedule::{Event, Schedule};
use super::wire_fault::{Stream, WireFault};
use super::{document, record};
use sim_core::time::Nanos;
use std::collections::VecDeque;

/// Most bytes that one fault holds back; a packet beyond is lost, and counted.
const HELD_BYTES_MAX: usize = 1 << 26;
/// Most packets that one number may become.
const PACKETS_MAX: usize = 1000;

/// One fault and its state.
pub(super) struct Stage {
    pub(super) fault: WireFault,
    pub(super) schedule: Schedule,
    pub(super) lost: u64,
    held: VecDeque<Out>,
    held_bytes: usize,
    /// When the last packet of a queue that keeps its order leaves.
    last: (u64, Nanos),
    seen: u64,
    memory: Memory,
}

/// What a change of bytes remembers of the packets before.
#[derive(Default)]
struct Memory {
    ipoc: Option<u64>,
    sample: Option<record::Sample>,
    offset: u32,
}

impl Stage {
    pub(super) fn new(fault: WireFault, schedule: Schedule) -> Self {
        let (held, memory) = (VecDeque::new(), Memory::default());
        Stage { fault, schedule, lost: 0, held, held_bytes: 0, last: (0, Nanos(0)), seen: 0, memory }
    }

    pub(super) fn event(&mut self, event: Event) {
        self.schedule.event(event);
    }

    /// What is held back now, in packets.
    pub(super) fn holds(&self) -> usize {
        self.held.len()
    }

    /// Packets of this number in, what leaves by this number out.
    pub(super) fn pass(&mut self, number: u64, period: Nanos, packets: &mut Vec<Out>) {
        let asks = !packets.is_empty() || self.fault.action == Action::SilenceThenBurst {};
        let due = asks && self.schedule.due(number);
        for packet in std::mem::take(packets) {
            self.one(number, period, due, packet, packets);
        }
        // What overtakes goes first, what queues goes first: either way the queue is looked at once, in its own place.
        let keeps_order = matches!(self.fault.action, Action::Hold { .. } | Action::Swap { .. });
        let mut late = Vec::new();
        let burst_waits = due && self.fault.action == Action::SilenceThenBurst {};
        let pair_waits = self.fault.action == Action::TwoDocuments {};
        if !burst_waits && !pair_waits {
            while self.held.front().is_some_and(|out| out.number <= number) {
                if let Some(out) = self.held.pop_front() {
                    self.held_bytes -= out.bytes.len();
                    late.push(out);
                }
            }
        }
        if keeps_order {
            packets.append(&mut late);
        } else {
            late.append(packets);
            *packets = late;
        }
    }

    fn one(&mut self, number: u64, period: Nanos, due: bool, mut packet: Out, out: &mut Vec<Out>) {
        match self.fault.action.clone() {
            Action::Drop {} | Action::LostStart {} if due => self.schedule.count(),
            Action::Duplicate { copies } if due => {
                let room = PACKETS_MAX.saturating_sub(out.len()).min(copies as usize);
                out.extend(std::iter::repeat_n(packet, room + 1));
                self.schedule.count();
            }
            Action::Swap { next: later } | Action::Hold { cycles: later } if due => {
                packet.number = number.saturating_add(u64::from(later));
                self.schedule.count();
                self.hold(packet);
            }
            Action::Delay { cycles } => self.queue(due, u64::from(cycles), Nanos(0), packet, out),
            Action::Jitter { delays_us } => {
                let delay_us = delays_us[self.seen as usize % delays_us.len().max(1)];
                self.seen += u64::from((due && delay_us > 0) || self.seen > 0);
                let total = packet.within + Nanos(i64::from(delay_us) * 1000);
                let cycles = total.0 / period.0.max(1);
                // A controller takes an answer whenever it comes within its cycle.
                let shows = cycles > 0 || self.fault.on != Stream::RsiReply;
                self.queue(
                    due && delay_us > 0 && shows,
                    cycles as u64,
                    Nanos(total.0 - cycles * period.0),
                    packet,
                    out,
                );
            }
            Action::SilenceThenBurst {} if due => {
                self.schedule.count();
                self.hold(packet);
            }
            Action::TwoDocuments {} => self.pair(due, packet, out),
            _ => {
                if self.changes(due, &mut packet.bytes) {
                    self.schedule.count();
                }
                out.push(packet);
            }
        }
    }

    /// Later by so much, or behind what is later.
    fn queue(&mut self, due: bool, cycles: u64, within: Nanos, mut packet: Out, out: &mut Vec<Out>) {
        let own = if due { (packet.number.saturating_add(cycles), within) } else { (packet.number, packet.within) };
        let at = own.max(self.last);
        if due {
            self.schedule.count();
        }
        if !due && self.held.is_empty() && at == own {
            return out.push(packet);
        }
        self.last = at;
        (packet.number, packet.within) = at;
        self.hold(packet);
    }

    /// The packet waits for the next, and both are one piece.
    fn pair(&mut self, due: bool, mut packet: Out, out: &mut Vec<Out>) {
        if let Some(first) = self.held.pop_front() {
            self.held_bytes -= first.bytes.len();
            let mut both = first.bytes;
            both.append(&mut packet.bytes);
            both.truncate(BYTES_MAX);
            self.schedule.count();
            out.push(Out { bytes: both, ..packet });
        } else if due {
            self.hold(packet);
        } else {
            out.push(packet);
        }
    }

    fn hold(&mut self, packet: Out) {
        if self.held_bytes + packet.bytes.len() > HELD_BYTES_MAX {
            self.lost += 1;
            return;
        }
        self.held_bytes += packet.bytes.len();
        let place = self.held.partition_point(|other| (other.number, other.within) <= (packet.number, packet.within));
        self.held.insert(place, packet);
    }

    /// Changes the bytes; whether anything differs because it acted.
    fn changes(&mut self, due: bool, bytes: &mut Vec<u8>) -> bool {
        match &self.fault.action {
            Action::IpocPrevious {} => {
                let before = self.memory.ipoc;
                self.memory.ipoc = document::ipoc(bytes);
                due && before.is_some_and(|before| document::set_ipoc(bytes, before))
            }
            Action::FtStall {} => match (due, self.memory.sample) {
                (true, Some(sample)) => record::stall(bytes, &sample),
                _ => {
                    self.memory.sample = record::last(bytes).or(self.memory.sample);
                    false
                }
            },
            Action::RdtRestart {} | Action::FtRestart {} => {
                let (field, first) = if self.fault.action == (Action::RdtRestart {}) { (0, 1) } else { (4, 0) };
                let start = record::sequence(bytes, field);
                if let (true, Some(start)) = (due, start) {
                    self.memory.offset = start.wrapping_sub(first);
                }
                record::count_back(bytes, field, self.memory.offset) && due
            }
            Action::FlipBit { bit } if due => {
                let bit = bit.unwrap_or_else(|| self.schedule.below(bytes.len() * 8));
                document::flip(bytes, bit)
            }
            action => due && (document::change(action, bytes) || record::change(action, bytes)),
        }
    }
}
