//! Robotiq FT 150/300 on RS-485 or USB, 19200 8N1, slave 9. Source: reference/PROTOCOLS.md, section 3.
//!
//! | bytes | record, 100 Hz |
//! |---|---|
//! | 0..2 | 20 4E |
//! | 2..14 | six i16, little-endian: hundredths of a newton, thousandths of a newton metre |
//! | 14..16 | CRC-16/MODBUS over 0..14, little-endian |
//!
//! Writing 0x0200 to register 410 starts the stream: Modbus function 16, `09 10 019A 0001 02 0200 CRC`; the sensor answers
//! `09 10 019A 0001 CRC`, or with the function plus 0x80 and a code where it refuses. Fifty bytes of 0xFF stop it. It has neither
//! status nor counter: a lost record cannot be seen, a silence can.

use super::bench::Bench;
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Event, Health, Malformed};
use super::framer::{Framer, Verdict};
use super::{Device, Disturbance, Unable};
use crate::units::SensorScale;
use core::net::SocketAddr;
use crc::{CRC_16_MODBUS, Crc};
use sim_core::time::Nanos;

/// Records in a second.
pub const RATE_HZ: f64 = 100.0;
/// Silence after which the sensor is at fault.
pub const STALE_MS: u32 = 160;
/// Bytes of a record.
pub const RECORD: usize = 16;

const MODBUS: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
const SYNC: [u8; 2] = [0x20, 0x4e];
const SLAVE: u8 = 9;
const WRITE: u8 = 0x10;
const REFUSED: u8 = WRITE | 0x80;
/// Function 16 to register 410, one register of two bytes, 0x0200.
const START: [u8; 9] = [SLAVE, WRITE, 0x01, 0x9a, 0x00, 0x01, 0x02, 0x02, 0x00];
const ANSWER: usize = 8;
const EXCEPTION: usize = 5;
const STOP_BYTE: u8 = 0xff;
const STOP_BYTES: usize = 50;

/// Bytes with their CRC.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = bytes.to_vec();
    sealed.extend(MODBUS.checksum(bytes).to_le_bytes());
    sealed
}

/// Whether the last two bytes are the CRC of those before.
fn intact(bytes: &[u8]) -> Result<(), Malformed> {
    let wanted = "a body and two bytes of CRC";
    let Some((body, &[c1, c2])) = bytes.split_last_chunk::<2>() else {
        return Err(Malformed::Length { got: bytes.len(), wanted });
    };
    let (got, computed) = (u16::from_le_bytes([c1, c2]), MODBUS.checksum(body));
    if got == computed {
        return Ok(());
    }
    Err(Malformed::Checksum { got: u64::from(got), computed: u64::from(computed), bytes: bytes.len() })
}

fn scale() -> SensorScale {
    SensorScale::new(100.0, 1000.0).expect("both are finite and above zero")
}

/// The host's part.
#[derive(Debug, Clone, Default)]
pub struct Robotiq {
    framer: Framer,
}

impl Wire for Robotiq {
    fn counters(&self) -> Counters {
        Counters { sequence_bits: None, clock: None }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(sealed(&START));
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(vec![STOP_BYTE; STOP_BYTES]);
    }

    fn bias(&mut self, _set: bool) -> Option<Vec<Vec<u8>>> {
        None
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        self.framer.push(bytes, found, look);
    }

    fn judge(&self, _status: u32) -> (Health, String) {
        (Health::Good, "no status".to_string())
    }

    fn forget(&mut self) {
        self.framer.clear();
    }
}

fn look(bytes: &[u8]) -> Verdict {
    match bytes {
        [0x20, 0x4e, ..] => whole(bytes, RECORD, |record| Found::Reading(reading(record))),
        &[SLAVE, WRITE, ..] => whole(bytes, ANSWER, |_| Found::Event(Event::Answer("the stream starts".to_string()))),
        &[SLAVE, REFUSED, ..] => whole(bytes, EXCEPTION, |answer| {
            let code = answer.get(2).copied().unwrap_or_default();
            Found::Event(Event::Refused(format!("Modbus exception {code}")))
        }),
        &[0x20] | &[SLAVE] => Verdict::More,
        _ => {
            let got = bytes.first().copied().map_or(0, u64::from);
            Verdict::No(Malformed::Header { got, wanted: 0x20, at: 0 })
        }
    }
}

/// The first `length` bytes, if they have come and their CRC is right.
fn whole(bytes: &[u8], length: usize, make: impl FnOnce(&[u8]) -> Found) -> Verdict {
    let Some(frame) = bytes.get(..length) else { return Verdict::More };
    match intact(frame) {
        Ok(()) => Verdict::Take(length, make(frame)),
        Err(why) => Verdict::No(why),
    }
}

fn reading(record: &[u8]) -> Reading {
    let (values, _) = record.get(SYNC.len()..).unwrap_or_default().as_chunks::<2>();
    let mut counts = [0; 6];
    counts.iter_mut().zip(values).for_each(|(count, bytes)| *count = i32::from(i16::from_le_bytes(*bytes)));
    let limits = [i32::from(i16::MAX), i32::from(i16::MIN)];
    Reading {
        wrench: scale().wrench_from_counts(counts),
        status: 0,
        sequence: None,
        clock: None,
        clipped: counts.iter().any(|count| limits.contains(count)),
    }
}

/// The sensor itself.
#[derive(Debug, Clone, Default)]
pub struct RobotiqDevice {
    bench: Bench,
    stops: usize,
}

impl Device for RobotiqDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], out: &mut Vec<Vec<u8>>) {
        for &byte in bytes {
            self.stops = if byte == STOP_BYTE { self.stops + 1 } else { 0 };
            if self.stops >= STOP_BYTES {
                self.stops = 0;
                self.bench.streams = false;
            }
        }
        if bytes.first() != Some(&SLAVE) || intact(bytes).is_err() {
            return;
        }
        if bytes == sealed(&START) {
            if self.bench.begin(peer) {
                out.push(sealed(&START[..6]));
            }
        } else if bytes.get(1).is_some_and(|function| function & 0x80 == 0) {
            // Illegal function, or illegal address for the only one that it has.
            let code = if bytes.get(1) == Some(&WRITE) { 2 } else { 1 };
            out.push(sealed(&[SLAVE, bytes[1] | 0x80, code]));
        }
    }

    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>) {
        let wrench = self.bench.read(force_n, torque_n_m);
        if !self.bench.streams || self.bench.silent {
            return;
        }
        let counts = self.bench.counts.unwrap_or_else(|| scale().counts_from_wrench(wrench));
        let narrow = |count: i32| count.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16;
        let mut record = SYNC.to_vec();
        record.extend(counts.iter().flat_map(|count| narrow(*count).to_le_bytes()));
        out.push(sealed(&record));
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        let stops = bytes.iter().all(|byte| *byte == STOP_BYTE);
        (stops && !bytes.is_empty()) || (bytes.first() == Some(&SLAVE) && intact(bytes).is_ok())
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        match disturbance {
            Disturbance::Status(_) => Err(Unable { what: "send a status: it has none" }),
            Disturbance::Sequence(_) | Disturbance::Clock(_) => Err(Unable { what: "send a counter: it has none" }),
            Disturbance::Scale { .. } => Err(Unable { what: "change its scale: it is fixed" }),
            other => {
                self.bench.disturb(other);
                Ok(())
            }
        }
    }
}
