//! Records of a laboratory's own box, as [`RecordLayout`](super::layout::RecordLayout) describes them: SRI, wrappers of a JR3,
//! and whatever else puts six numbers in a row. Source: reference/PROTOCOLS.md, section 3, last paragraph.
//!
//! A raw number becomes `raw · scale + offset` in the unit of the layout, then N or N m. A whole number at the end of its range
//! counts as clipped.

use super::bench::{Bench, Ticks};
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Health, Malformed};
use super::framer::{Framer, Verdict};
use super::layout::{Checked, Endian, Framing, Kind, Vector};
use super::{Device, Disturbance, Unable};
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// Rate into which a floating-point time in seconds is put, in Hz.
const FLOAT_TICKS_HZ: f64 = 1e6;

/// A number as it was on the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Raw {
    Whole(i128),
    Float(f64),
}

impl Raw {
    fn value(self) -> f64 {
        match self {
            Raw::Whole(value) => value as f64,
            Raw::Float(value) => value,
        }
    }

    /// Its bits, for counters and status words.
    fn bits(self) -> u64 {
        match self {
            Raw::Whole(value) => value as u64,
            Raw::Float(value) => value as u64,
        }
    }
}

/// Eight bytes with the number in the low ones, whichever order it came in.
fn low_bytes(bytes: &[u8], endian: Endian) -> u64 {
    let push = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    match endian {
        Endian::Big => bytes.iter().fold(0, push),
        Endian::Little => bytes.iter().rev().fold(0, push),
    }
}

fn read(record: &[u8], at: usize, kind: Kind, endian: Endian) -> Option<Raw> {
    let bits = low_bytes(record.get(at..at + kind.bytes())?, endian);
    Some(match kind {
        Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => Raw::Whole(i128::from(bits)),
        Kind::I8 => Raw::Whole(i128::from(bits as u8 as i8)),
        Kind::I16 => Raw::Whole(i128::from(bits as u16 as i16)),
        Kind::I32 => Raw::Whole(i128::from(bits as u32 as i32)),
        Kind::I64 => Raw::Whole(i128::from(bits as i64)),
        Kind::F32 => Raw::Float(f64::from(f32::from_bits(bits as u32))),
        Kind::F64 => Raw::Float(f64::from_bits(bits)),
    })
}

fn write_bytes(record: &mut [u8], at: usize, length: usize, endian: Endian, bits: u64) {
    let Some(place) = record.get_mut(at..at + length) else { return };
    let little = bits.to_le_bytes();
    place.iter_mut().zip(little).for_each(|(to, from)| *to = from);
    if endian == Endian::Big {
        place.reverse();
    }
}

fn write(record: &mut [u8], at: usize, kind: Kind, endian: Endian, value: f64) {
    let bits = match kind.limits() {
        Some((least, most)) => (value.round() as i128).clamp(least, most) as u64,
        None if kind == Kind::F32 => u64::from((value as f32).to_bits()),
        None => value.to_bits(),
    };
    write_bytes(record, at, kind.bytes(), endian, bits);
}

/// The host's part.
#[derive(Debug, Clone)]
pub struct RecordWire {
    checked: Checked,
    framer: Framer,
}

impl RecordWire {
    /// Of a layout that was checked.
    pub fn new(checked: Checked) -> Self {
        RecordWire { checked, framer: Framer::default() }
    }
}

impl Wire for RecordWire {
    fn counters(&self) -> Counters {
        let layout = &self.checked.layout;
        let bits = |kind: Kind| kind.bytes() as u32 * 8;
        Counters {
            sequence_bits: layout.sequence.map(|field| bits(field.kind)),
            clock: layout.time.map(|field| match field.kind.floats() {
                true => (64, FLOAT_TICKS_HZ),
                false => (bits(field.kind), field.hz),
            }),
        }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        out.extend((!self.checked.start.is_empty()).then(|| self.checked.start.clone()));
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        out.extend((!self.checked.stop.is_empty()).then(|| self.checked.stop.clone()));
    }

    fn bias(&mut self, _set: bool) -> Option<Vec<Vec<u8>>> {
        None
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        let RecordWire { checked, framer } = self;
        let length = checked.layout.length;
        if checked.layout.framing == Framing::Stream {
            framer.push(bytes, found, |rest| look(checked, rest));
            return;
        }
        if bytes.is_empty() || !bytes.len().is_multiple_of(length) {
            found.push(Found::Malformed(Malformed::Length { got: bytes.len(), wanted: "one or more whole records" }));
            return;
        }
        for record in bytes.chunks_exact(length) {
            found.push(match decode(checked, record) {
                Ok(reading) => Found::Reading(reading),
                Err(why) => Found::Malformed(why),
            });
        }
    }

    fn judge(&self, status: u32) -> (Health, String) {
        let Some(field) = self.checked.layout.status else { return (Health::Good, "no status".to_string()) };
        if status & field.saturated != 0 {
            return (Health::Saturated, "overload".to_string());
        }
        match status & field.mask == field.good {
            true => (Health::Good, "good".to_string()),
            false => (Health::Error, format!("not good, which is 0x{:x}", field.good)),
        }
    }

    fn forget(&mut self) {
        self.framer.clear();
    }
}

fn look(checked: &Checked, rest: &[u8]) -> Verdict {
    let (at, sync) = &checked.sync;
    let there = rest.get(*at..).unwrap_or_default();
    if let Some((&got, &wanted)) = there.iter().zip(sync).find(|(got, wanted)| got != wanted) {
        return Verdict::No(Malformed::Header { got: u64::from(got), wanted: u64::from(wanted), at: *at });
    }
    let length = checked.layout.length;
    match rest.get(..length).map(|record| decode(checked, record)) {
        None => Verdict::More,
        Some(Ok(reading)) => Verdict::Take(length, Found::Reading(reading)),
        Some(Err(why)) => Verdict::No(why),
    }
}

fn decode(checked: &Checked, record: &[u8]) -> Result<Reading, Malformed> {
    let layout = &checked.layout;
    let short = Malformed::Length { got: record.len(), wanted: "a whole record" };
    let (at, sync) = &checked.sync;
    let there = record.get(*at..*at + sync.len()).ok_or_else(|| short.clone())?;
    if there != sync.as_slice() {
        let number = |bytes: &[u8]| low_bytes(bytes, Endian::Big);
        return Err(Malformed::Header { got: number(there), wanted: number(sync), at: *at });
    }
    if let Some((checksum, field, endian)) = &checked.crc {
        let got = record.get(field.at..field.at + checksum.bytes()).ok_or_else(|| short.clone())?;
        let got = low_bytes(got, *endian);
        let computed = checksum.of(record.get(field.from..field.to).ok_or_else(|| short.clone())?);
        if got != computed {
            return Err(Malformed::Checksum { got, computed, bytes: record.len() });
        }
    }
    let mut reading = Reading { wrench: [0.0; 6], status: 0, sequence: None, clock: None, clipped: false };
    for (half, (vector, unit)) in [&layout.force, &layout.torque].into_iter().zip(checked.unit).enumerate() {
        let (scale, offset) = (vector.scale.values(), vector.offset.values());
        for axis in 0..3 {
            let raw = read(record, vector.at[axis], vector.kind, layout.endian).ok_or_else(|| short.clone())?;
            reading.wrench[half * 3 + axis] = (raw.value() * scale[axis] + offset[axis]) * unit;
            reading.clipped |= ends(raw, vector.kind);
        }
    }
    let number = |at, kind| read(record, at, kind, layout.endian);
    reading.sequence = layout.sequence.and_then(|field| number(field.at, field.kind)).map(Raw::bits);
    reading.status = layout.status.and_then(|field| number(field.at, field.kind)).map_or(0, |raw| raw.bits() as u32);
    reading.clock = layout.time.and_then(|field| {
        let raw = number(field.at, field.kind)?;
        Some(if field.kind.floats() { (raw.value() / field.hz * FLOAT_TICKS_HZ).round() as u64 } else { raw.bits() })
    });
    Ok(reading)
}

fn ends(raw: Raw, kind: Kind) -> bool {
    match (raw, kind.limits()) {
        (Raw::Whole(value), Some((least, most))) => value == most || (value == least && least < 0),
        _ => false,
    }
}

/// The box itself.
#[derive(Debug, Clone)]
pub struct RecordDevice {
    checked: Checked,
    bench: Bench,
    ticks: Ticks,
    sequence: u64,
}

impl RecordDevice {
    /// A box that streams at once, unless its layout has a request that starts it.
    pub fn new(checked: Checked, rate_hz: f64) -> Self {
        let clock_hz =
            checked.layout.time.map_or(0.0, |field| if field.kind.floats() { FLOAT_TICKS_HZ } else { field.hz });
        let mut bench = Bench::default();
        bench.streams = checked.start.is_empty();
        RecordDevice { checked, bench, ticks: Ticks::new(clock_hz, rate_hz), sequence: 0 }
    }

    fn record(&self, wrench: [f64; 6]) -> Vec<u8> {
        let layout = &self.checked.layout;
        let mut record = vec![0; layout.length];
        let (at, sync) = &self.checked.sync;
        if let Some(place) = record.get_mut(*at..*at + sync.len()) {
            place.copy_from_slice(sync);
        }
        for (half, (vector, unit)) in [&layout.force, &layout.torque].into_iter().zip(self.checked.unit).enumerate() {
            for axis in 0..3 {
                let dictated = self.bench.counts.map(|counts| f64::from(counts[half * 3 + axis]));
                let raw = dictated.unwrap_or_else(|| raw_of(vector, axis, wrench[half * 3 + axis] / unit));
                write(&mut record, vector.at[axis], vector.kind, layout.endian, raw);
            }
        }
        if let Some(field) = layout.sequence {
            write_bytes(&mut record, field.at, field.kind.bytes(), layout.endian, self.sequence);
        }
        if let Some(field) = layout.status {
            let status = self.bench.status.unwrap_or(field.good);
            write_bytes(&mut record, field.at, field.kind.bytes(), layout.endian, u64::from(status));
        }
        match layout.time {
            Some(field) if field.kind.floats() => {
                let time = self.ticks.count as f64 / FLOAT_TICKS_HZ * field.hz;
                write(&mut record, field.at, field.kind, layout.endian, time);
            }
            Some(field) => write_bytes(&mut record, field.at, field.kind.bytes(), layout.endian, self.ticks.count),
            None => {}
        }
        if let Some((checksum, field, endian)) = &self.checked.crc {
            let computed = checksum.of(record.get(field.from..field.to).unwrap_or_default());
            write_bytes(&mut record, field.at, checksum.bytes(), *endian, computed);
        }
        record
    }
}

fn raw_of(vector: &Vector, axis: usize, value: f64) -> f64 {
    (value - vector.offset.values()[axis]) / vector.scale.values()[axis]
}

impl Device for RecordDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], _out: &mut Vec<Vec<u8>>) {
        if !self.checked.start.is_empty() && bytes == self.checked.start {
            self.bench.begin(peer);
        } else if !self.checked.stop.is_empty() && bytes == self.checked.stop {
            self.bench.streams = false;
        }
    }

    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>) {
        if !self.bench.stalled {
            self.ticks.advance();
        }
        let wrench = self.bench.read(force_n, torque_n_m);
        if !self.bench.streams {
            return;
        }
        self.sequence = self.sequence.wrapping_add(1);
        if !self.bench.silent {
            out.push(self.record(wrench));
        }
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        !bytes.is_empty() && (bytes == self.checked.start || bytes == self.checked.stop)
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        let layout = &self.checked.layout;
        match disturbance {
            Disturbance::Sequence(next) if layout.sequence.is_some() => self.sequence = next.wrapping_sub(1),
            Disturbance::Clock(at) if layout.time.is_some() => self.ticks.count = at,
            Disturbance::Sequence(_) => return Err(Unable { what: "send a packet counter: its layout has none" }),
            Disturbance::Clock(_) => return Err(Unable { what: "send a clock: its layout has none" }),
            Disturbance::Status(_) if layout.status.is_none() => {
                return Err(Unable { what: "send a status: its layout has none" });
            }
            Disturbance::Scale { .. } => return Err(Unable { what: "change its scale: it is in the layout" }),
            Disturbance::DeafStarts(_) if self.checked.start.is_empty() => {
                return Err(Unable { what: "miss a start: its layout has no request" });
            }
            other => {
                self.bench.disturb(other);
            }
        }
        Ok(())
    }
}
