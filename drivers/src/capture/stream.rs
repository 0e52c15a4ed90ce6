//! TCP in order: what came too early is held back, what came before is dropped.
//!
//! A hole is given up when the other side acknowledges what lies behind it (the capture lost it, the receiver did not), or when
//! too much waits for it. Sequence numbers are compared modulo 2³².

use super::internet::Segment;
use super::packet::{Packet, Skip, Tally, Transport};
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::net::SocketAddrV4;

/// Most streams at a time, each direction counted; the one that was silent longest makes room. Chosen.
const STREAMS_MAX: usize = 64;
/// Most segments and bytes that wait for a hole in one stream. Chosen: a tenth of a second of a robot, many times over.
const HELD_MAX: usize = 64;
const HELD_BYTES_MAX: usize = 256 << 10;

type Ends = (SocketAddrV4, SocketAddrV4);

#[derive(Debug)]
struct Stream {
    /// Sequence number of the byte whose turn it is.
    next: u32,
    held: Vec<(u32, Vec<u8>)>,
    held_bytes: usize,
    /// Whether what comes next follows on nothing.
    is_broken: bool,
    used: u64,
}

/// All streams of a capture.
#[derive(Debug, Default)]
pub(super) struct Streams {
    streams: BTreeMap<Ends, Stream>,
    clock: u64,
}

impl Streams {
    /// Takes a segment; what is in order by then comes out.
    pub fn segment(&mut self, at: Nanos, ends: Ends, segment: &Segment<'_>, tally: &mut Tally, out: &mut Vec<Packet>) {
        self.clock += 1;
        if let (Some(acknowledged), Some(other)) = (segment.acknowledged, self.streams.get_mut(&(ends.1, ends.0)))
            && !other.held.is_empty()
            && ahead(acknowledged, other.next) > 0
        {
            other.leap(tally);
            other.drain(at, (ends.1, ends.0), tally, out);
        }
        if segment.is_first || !self.streams.contains_key(&ends) {
            // The first segment of all takes one number of its own.
            let next = if segment.is_first { segment.sequence.wrapping_add(1) } else { segment.sequence };
            self.make_room(tally);
            let stream = Stream { next, held: Vec::new(), held_bytes: 0, is_broken: true, used: 0 };
            self.streams.insert(ends, stream);
        }
        let Some(stream) = self.streams.get_mut(&ends) else { return };
        stream.used = self.clock;
        if !segment.payload.is_empty() {
            let sequence = if segment.is_first { segment.sequence.wrapping_add(1) } else { segment.sequence };
            stream.held_bytes += segment.payload.len();
            stream.held.push((sequence, segment.payload.to_vec()));
        }
        stream.drain(at, ends, tally, out);
        while stream.held.len() > HELD_MAX || stream.held_bytes > HELD_BYTES_MAX {
            stream.leap(tally);
            stream.drain(at, ends, tally, out);
        }
        if segment.is_last {
            stream.flush(at, ends, tally, out);
            self.streams.remove(&ends);
        }
    }

    /// Hands out what still waits.
    pub fn finish(&mut self, at: Nanos, tally: &mut Tally, out: &mut Vec<Packet>) {
        for (ends, mut stream) in std::mem::take(&mut self.streams) {
            stream.flush(at, ends, tally, out);
        }
    }

    fn make_room(&mut self, tally: &mut Tally) {
        if self.streams.len() < STREAMS_MAX {
            return;
        }
        let silent = self.streams.iter().min_by_key(|(_, stream)| stream.used).map(|(ends, _)| *ends);
        if let Some(ends) = silent {
            self.streams.remove(&ends);
            tally.skip(Skip::Stream);
        }
    }
}

impl Stream {
    /// Hands out what is in order.
    fn drain(&mut self, at: Nanos, (from, to): Ends, tally: &mut Tally, out: &mut Vec<Packet>) {
        while let Some(place) = self.held.iter().position(|(sequence, _)| ahead(*sequence, self.next) <= 0) {
            let (sequence, mut payload) = self.held.remove(place);
            self.held_bytes -= payload.len();
            let known = ahead(self.next, sequence) as usize;
            if known >= payload.len() {
                tally.skip(Skip::Repeated);
                continue;
            }
            payload.drain(..known);
            self.next = self.next.wrapping_add(payload.len() as u32);
            let broken = std::mem::take(&mut self.is_broken);
            tally.packets += 1;
            out.push(Packet { at, from, to, transport: Transport::Tcp, payload, broken });
        }
    }

    /// Gives the next hole up.
    fn leap(&mut self, tally: &mut Tally) {
        let nearest =
            self.held.iter().map(|(sequence, _)| *sequence).min_by_key(|sequence| ahead(*sequence, self.next));
        if let Some(sequence) = nearest {
            self.next = sequence;
            self.is_broken = true;
            tally.skip(Skip::Hole);
        }
    }

    fn flush(&mut self, at: Nanos, ends: Ends, tally: &mut Tally, out: &mut Vec<Packet>) {
        self.drain(at, ends, tally, out);
        while !self.held.is_empty() {
            self.leap(tally);
            self.drain(at, ends, tally, out);
        }
    }
}

/// How far `a` lies ahead of `b`, modulo 2³².
fn ahead(a: u32, b: u32) -> i32 {
    a.wrapping_sub(b) as i32
}
