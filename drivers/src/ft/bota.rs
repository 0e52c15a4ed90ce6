//! Bota Rokubi and SensONE on a serial line, 460800 baud, little-endian. Source: reference/PROTOCOLS.md, section 3.
//!
//! | bytes | record |
//! |---|---|
//! | 0 | 0xAA, which also occurs inside: only the CRC tells where a record begins |
//! | 1..3 | status: 0 application took too long, 1 overrange, 2 invalid measurement, 3 raw |
//! | 3..27 | six f32, N and N m |
//! | 27..31 | time in µs, wraps after 71.6 minutes |
//! | 31..35 | temperature, f32, in °C |
//! | 35..37 | CRC-16/IBM-SDLC over 1..35 |
//!
//! Text: the sensor says `App Init` when it is switched on; `C` stops it for configuration (answer `r,0,C,0`), `c,…` and `f,…`
//! configure it, `R` lets it run, `I` resets it. That the answers to `c` and `f` look like that to `C` is inferred; whether a line
//! ends with anything is not known, so the commands of the settings are sent exactly as they are written there.
//!
//! Not covered: the EtherCAT variant.

use super::bench::{Bench, Ticks};
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Event, Health, Malformed};
use super::framer::{Framer, Verdict};
use super::status::words;
use super::{Device, Disturbance, Unable};
use core::net::SocketAddr;
use crc::{CRC_16_IBM_SDLC, Crc};
use sim_core::time::Nanos;

/// Bytes of a record.
pub const RECORD: usize = 37;
/// Ticks of its clock, in Hz.
pub const CLOCK_HZ: f64 = 1e6;

const X25: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_SDLC);
const SYNC: u8 = 0xaa;
const APP_INIT: &[u8] = b"App Init";
/// Longest answer: `r,0,C,0`.
const ANSWER: usize = 7;
const STATUS: [&str; 4] = ["application took too long", "overrange", "invalid measurement", "raw measurement"];
const OVERRANGE: u32 = 1 << 1;
const RAW: u32 = 1 << 3;
/// A configuration takes longer than a start: the next attempt comes after this.
const PATIENCE: Nanos = Nanos(1_000_000_000);

/// The host's part.
#[derive(Debug, Clone, Default)]
pub struct Bota {
    framer: Framer,
    /// Commands that configure the sensor, in order; none: it runs as it is.
    configure: Vec<String>,
    /// Which command waits for its answer: 0 is `C`, then those above.
    waiting: Option<usize>,
    answered: bool,
}

impl Bota {
    /// With these commands before it runs.
    pub fn new(configure: Vec<String>) -> Self {
        Bota { configure, ..Bota::default() }
    }
}

impl Wire for Bota {
    fn counters(&self) -> Counters {
        Counters { sequence_bits: None, clock: Some((32, CLOCK_HZ)) }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        self.answered = false;
        self.waiting = (!self.configure.is_empty()).then_some(0);
        out.push(if self.waiting.is_some() { b"C".to_vec() } else { b"R".to_vec() });
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(b"C".to_vec());
    }

    fn bias(&mut self, _set: bool) -> Option<Vec<Vec<u8>>> {
        None
    }

    fn next_request(&mut self, out: &mut Vec<Vec<u8>>) {
        let (Some(done), true) = (self.waiting, self.answered) else { return };
        self.answered = false;
        match self.configure.get(done) {
            Some(command) => {
                self.waiting = Some(done + 1);
                out.push(command.clone().into_bytes());
            }
            None => {
                self.waiting = None;
                out.push(b"R".to_vec());
            }
        }
    }

    fn patience(&self) -> Nanos {
        if self.configure.is_empty() { super::client::RESEND_EVERY } else { PATIENCE }
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        let before = found.len();
        self.framer.push(bytes, found, look);
        let answers = found.iter().skip(before).filter(|item| matches!(item, Found::Event(Event::Answer(_))));
        self.answered |= answers.count() > 0;
    }

    fn judge(&self, status: u32) -> (Health, String) {
        judge(status)
    }

    fn forget(&mut self) {
        self.framer.clear();
    }
}

fn look(bytes: &[u8]) -> Verdict {
    let no = |wanted: u8| {
        let got = bytes.first().copied().map_or(0, u64::from);
        Verdict::No(Malformed::Header { got, wanted: u64::from(wanted), at: 0 })
    };
    match bytes.first() {
        Some(&SYNC) => match bytes.first_chunk::<RECORD>() {
            Some(record) => decode(record),
            None => Verdict::More,
        },
        Some(b'A') => text(bytes, APP_INIT.len(), |line| {
            (line == APP_INIT).then(|| Event::Answer("App Init: the sensor was switched on".to_string()))
        })
        .unwrap_or_else(|| no(b'A')),
        Some(b'r') => text(bytes, ANSWER, |line| match line {
            [b'r', b',', b'0', b',', command, b',', b'0'] => {
                Some(Event::Answer(format!("{} done", char::from(*command))))
            }
            [b'r', b',', _, b',', command, b',', error] => {
                Some(Event::Refused(format!("{}, error {}", char::from(*command), char::from(*error))))
            }
            _ => None,
        })
        .unwrap_or_else(|| no(b'r')),
        // Ends of lines between answers.
        Some(b'\r' | b'\n') => Verdict::Take(1, Found::Nothing),
        _ => no(SYNC),
    }
}

/// A text of known length, if it is one; `None` if it is something else.
fn text(bytes: &[u8], length: usize, make: impl FnOnce(&[u8]) -> Option<Event>) -> Option<Verdict> {
    let Some(line) = bytes.get(..length) else {
        return bytes.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ').then_some(Verdict::More);
    };
    make(line).map(|event| Verdict::Take(length, Found::Event(event)))
}

fn decode(record: &[u8; RECORD]) -> Verdict {
    let [_, payload @ .., c1, c2] = record;
    let (got, computed) = (u16::from_le_bytes([*c1, *c2]), X25.checksum(payload));
    if got != computed {
        let (got, computed) = (u64::from(got), u64::from(computed));
        return Verdict::No(Malformed::Checksum { got, computed, bytes: RECORD });
    }
    let [s1, s2, values @ ..] = payload;
    let (words, _) = values.as_chunks::<4>();
    let &[fx, fy, fz, tx, ty, tz, time, _temperature] = words else {
        return Verdict::No(Malformed::Length { got: values.len(), wanted: "32 bytes of values" });
    };
    let reading = Reading {
        wrench: [fx, fy, fz, tx, ty, tz].map(|bytes| f64::from(f32::from_le_bytes(bytes))),
        status: u32::from(u16::from_le_bytes([*s1, *s2])),
        sequence: None,
        clock: Some(u64::from(u32::from_le_bytes(time))),
        clipped: false,
    };
    Verdict::Take(RECORD, Found::Reading(reading))
}

fn judge(status: u32) -> (Health, String) {
    let health = match status {
        0 => Health::Good,
        RAW => Health::Warning,
        _ if status & OVERRANGE != 0 && status & !(OVERRANGE | RAW) == 0 => Health::Saturated,
        _ => Health::Error,
    };
    (health, words(status, &STATUS))
}

/// The sensor itself.
#[derive(Debug, Clone)]
pub struct BotaDevice {
    bench: Bench,
    ticks: Ticks,
    configuring: bool,
    temperature_c: f32,
}

impl BotaDevice {
    /// A sensor that waits for `R`. `rate_hz` is how often [`Device::sample`] will be called.
    pub fn new(rate_hz: f64) -> Self {
        let ticks = Ticks::new(CLOCK_HZ, rate_hz);
        BotaDevice { bench: Bench::default(), ticks, configuring: false, temperature_c: 25.5 }
    }
}

impl Device for BotaDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], out: &mut Vec<Vec<u8>>) {
        match bytes.trim_ascii() {
            b"C" => {
                self.configuring = true;
                self.bench.streams = false;
                out.push(b"r,0,C,0".to_vec());
            }
            b"R" => {
                self.configuring &= !self.bench.begin(peer);
            }
            b"I" => {
                self.configuring = false;
                self.bench.streams = false;
                self.ticks.count = 0;
                out.push(APP_INIT.to_vec());
            }
            [command @ (b'c' | b'f'), b',', ..] if self.configuring => {
                out.push(vec![b'r', b',', b'0', b',', *command, b',', b'0']);
            }
            _ => {}
        }
    }

    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>) {
        if !self.bench.stalled {
            self.ticks.advance();
        }
        let wrench = self.bench.read(force_n, torque_n_m);
        if !self.bench.streams || self.bench.silent {
            return;
        }
        let mut record = vec![SYNC];
        record.extend((self.bench.status.unwrap_or_default() as u16).to_le_bytes());
        record.extend(wrench.iter().flat_map(|value| (*value as f32).to_le_bytes()));
        record.extend((self.ticks.count as u32).to_le_bytes());
        record.extend(self.temperature_c.to_le_bytes());
        let crc = X25.checksum(record.get(1..).unwrap_or_default());
        record.extend(crc.to_le_bytes());
        out.push(record);
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        matches!(bytes.trim_ascii(), b"C" | b"R" | b"I" | [b'c' | b'f', b',', ..])
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        match disturbance {
            Disturbance::Clock(at) => self.ticks.count = at,
            Disturbance::Sequence(_) => return Err(Unable { what: "send a packet counter: it has none" }),
            Disturbance::Scale { .. } => return Err(Unable { what: "change its scale: it sends newtons" }),
            Disturbance::Counts(_) => return Err(Unable { what: "send counts: it sends newtons" }),
            other => {
                self.bench.disturb(other);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_has_four_bits() {
        assert_eq!(judge(0), (Health::Good, "good".to_string()));
        assert_eq!(judge(2), (Health::Saturated, "overrange".to_string()));
        assert_eq!(judge(8), (Health::Warning, "raw measurement".to_string()));
        assert_eq!(judge(5), (Health::Error, "invalid measurement, application took too long".to_string()));
    }
}
