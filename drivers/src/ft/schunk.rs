//! SCHUNK FTS with IFB-EN: samples over UDP to port 54843 of the host, commands over TCP port 82, little-endian. Source:
//! reference/PROTOCOLS.md, section 3.
//!
//! | bytes | every message |
//! |---|---|
//! | 0..2 | 0xFFFF |
//! | 2..4 | counter; of samples: 1 ms each |
//! | 4..6 | bytes that follow |
//! | 6 | packet id of a sample, or command |
//!
//! A sample has 29 bytes there: id, u32 status, six f32 in N and N m. A request has its command alone, an answer command and error
//! (0 ok, 1 unknown, 3 invalid). Commands: 0x40 start, 0x41 stop, 0x12 tare, 0x13 untare.
//!
//! Status bits: 0 ready, 1 data invalid, 2 temperature, 3 hardware, 4 mechanical overrange, 5 user overrange.
//!
//! Samples and answers are told apart by their length, so one machine takes the bytes of both connections. What `start` and `stop`
//! yield goes to the command connection. Not covered: tool (0x30), filter (0x31), parameters (0xF0, 0xF1); an answer that the
//! network splits.

use super::bench::Bench;
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Asked, Event, Health, Malformed};
use super::status::words;
use super::{Device, Disturbance, Unable};
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// Port of the host to which samples come.
pub const SAMPLES_PORT: u16 = 54843;
/// Bytes of a sample.
pub const SAMPLE: usize = 35;

const START: u8 = 0x40;
const STOP: u8 = 0x41;
const TARE: u8 = 0x12;
const UNTARE: u8 = 0x13;
const SAMPLE_BODY: usize = 29;
const ANSWER_BODY: usize = 2;
const READY: u32 = 1;
const OVERRANGE: u32 = 1 << 4;
const USER_OVERRANGE: u32 = 1 << 5;
const STATUS: [&str; 6] =
    ["ready", "data invalid", "temperature", "hardware", "mechanical overrange", "user overrange"];

/// The host's part.
#[derive(Debug, Clone, Default)]
pub struct Schunk {
    requests: u16,
}

impl Schunk {
    fn request(&mut self, command: u8) -> Vec<u8> {
        self.requests = self.requests.wrapping_add(1);
        message(self.requests, &[command])
    }
}

/// Header and body.
fn message(counter: u16, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0xff, 0xff];
    bytes.extend(counter.to_le_bytes());
    bytes.extend((body.len() as u16).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// Counter, body and what follows of the first message.
fn split(bytes: &[u8]) -> Result<(u16, &[u8], &[u8]), Malformed> {
    let short = Malformed::Length { got: bytes.len(), wanted: "6 bytes of header and as many as it says" };
    let &[h1, h2, c1, c2, l1, l2, ref rest @ ..] = bytes else { return Err(short) };
    let header = u16::from_le_bytes([h1, h2]);
    if header != 0xffff {
        return Err(Malformed::Header { got: u64::from(header), wanted: 0xffff, at: 0 });
    }
    let length = usize::from(u16::from_le_bytes([l1, l2]));
    let (body, rest) = rest.split_at_checked(length).ok_or(short)?;
    Ok((u16::from_le_bytes([c1, c2]), body, rest))
}

/// Whether bytes of the sensor answer a command; all others are samples, or what a fault has made of them.
pub fn is_answer(bytes: &[u8]) -> bool {
    split(bytes).is_ok_and(|(_, body, _)| body.len() == ANSWER_BODY)
}

impl Wire for Schunk {
    fn counters(&self) -> Counters {
        Counters { sequence_bits: Some(16), clock: Some((16, 1000.0)) }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        let request = self.request(START);
        out.push(request);
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        let request = self.request(STOP);
        out.push(request);
    }

    fn bias(&mut self, set: bool) -> Option<Vec<Vec<u8>>> {
        Some(vec![self.request(if set { TARE } else { UNTARE })])
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        let mut left = bytes;
        loop {
            match split(left) {
                Err(why) => return found.push(Found::Malformed(why)),
                Ok((counter, body, rest)) => {
                    found.push(decode(counter, body));
                    left = rest;
                }
            }
            if left.is_empty() {
                return;
            }
        }
    }

    fn overhear(&self, bytes: &[u8]) -> Vec<Event> {
        let (mut left, mut heard) = (bytes, Vec::new());
        while let Ok((_, body, rest)) = split(left) {
            left = rest;
            heard.extend(match body.first() {
                Some(&START) => Some(Event::Asked(Asked::Start)),
                Some(&STOP) => Some(Event::Asked(Asked::Stop)),
                Some(&TARE) => Some(Event::Bias { set: true }),
                Some(&UNTARE) => Some(Event::Bias { set: false }),
                _ => None,
            });
        }
        heard
    }

    fn judge(&self, status: u32) -> (Health, String) {
        judge(status)
    }
}

fn decode(counter: u16, body: &[u8]) -> Found {
    if let &[command, error] = body {
        return Found::Event(match error {
            0 => Event::Answer(format!("command 0x{command:02x} done")),
            1 => Event::Refused(format!("command 0x{command:02x} is unknown")),
            3 => Event::Refused(format!("command 0x{command:02x} is invalid")),
            other => Event::Refused(format!("command 0x{command:02x}, error {other}")),
        });
    }
    let (words, _) = body.get(1..).unwrap_or_default().as_chunks::<4>();
    let &[status, fx, fy, fz, tx, ty, tz] = words else {
        let wanted = "a body of 29 bytes (sample) or 2 (answer)";
        return Found::Malformed(Malformed::Length { got: body.len(), wanted });
    };
    if body.len() != SAMPLE_BODY {
        return Found::Malformed(Malformed::Length { got: body.len(), wanted: "a body of 29 bytes" });
    }
    Found::Reading(Reading {
        wrench: [fx, fy, fz, tx, ty, tz].map(|bytes| f64::from(f32::from_le_bytes(bytes))),
        status: u32::from_le_bytes(status),
        sequence: Some(u64::from(counter)),
        clock: Some(u64::from(counter)),
        clipped: false,
    })
}

fn judge(status: u32) -> (Health, String) {
    let faults = status & !READY;
    let health = match faults {
        0 if status & READY != 0 => Health::Good,
        USER_OVERRANGE if status & READY != 0 => Health::Warning,
        _ if faults & OVERRANGE != 0 && faults & !(OVERRANGE | USER_OVERRANGE) == 0 => Health::Saturated,
        _ => Health::Error,
    };
    let ready = if status & READY == 0 { ", not ready" } else { "" };
    (health, format!("{}{ready}", words(status, &STATUS)))
}

/// The sensor itself.
#[derive(Debug, Clone, Default)]
pub struct SchunkDevice {
    bench: Bench,
    counter: u16,
}

impl Device for SchunkDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], out: &mut Vec<Vec<u8>>) {
        let mut left = bytes;
        while let Ok((counter, body, rest)) = split(left) {
            left = rest;
            let &[command, ref parameters @ ..] = body else { continue };
            let error = match command {
                START => {
                    if !self.bench.begin(peer) {
                        return;
                    }
                    0
                }
                STOP => {
                    self.bench.streams = false;
                    0
                }
                TARE | UNTARE => {
                    self.bench.set_bias(command == TARE);
                    0
                }
                _ => 1,
            };
            let error = if error == 0 && !parameters.is_empty() { 3 } else { error };
            out.push(message(counter, &[command, error]));
        }
    }

    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>) {
        let wrench = self.bench.read(force_n, torque_n_m);
        let counter = self.counter;
        if !self.bench.stalled {
            // Its counter is its clock: milliseconds, whether it streams or not.
            self.counter = self.counter.wrapping_add(1);
        }
        if !self.bench.streams || self.bench.silent {
            return;
        }
        let mut body = vec![0];
        body.extend(self.bench.status.unwrap_or(READY).to_le_bytes());
        body.extend(wrench.iter().flat_map(|value| (*value as f32).to_le_bytes()));
        out.push(message(counter, &body));
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        split(bytes).is_ok_and(|(_, body, _)| !body.is_empty())
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        match disturbance {
            Disturbance::Sequence(next) | Disturbance::Clock(next) => self.counter = next as u16,
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
    fn the_status_is_good_only_when_ready() {
        assert_eq!(judge(1), (Health::Good, "ready".to_string()));
        assert_eq!(judge(0), (Health::Error, "good, not ready".to_string()));
        assert_eq!(judge(0x21), (Health::Warning, "user overrange, ready".to_string()));
        assert_eq!(judge(0x31), (Health::Saturated, "user overrange, mechanical overrange, ready".to_string()));
        assert_eq!(judge(0x05), (Health::Error, "temperature, ready".to_string()));
    }
}
