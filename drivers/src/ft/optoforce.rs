//! OnRobot/OptoForce Ethernet converter: RDT with commands, scale and status of its own. Source: reference/PROTOCOLS.md, section 3.
//!
//! | command | number |
//! |---|---|
//! | 0x0000 stop, 0x0002 start | samples, 0 without end |
//! | 0x0042 bias | 255 set, 0 take back |
//! | 0x0081 filter | 0 none, 1 500 Hz, 2 150, 3 50, 4 15 (default), 5 5, 6 1.5 |
//! | 0x0082 period | 1 to 255 ms, 0 stops; 10 by default |
//!
//! Records are those of RDT. 10 000 counts make a newton, 100 000 a newton metre. The F/T sequence counts milliseconds; whether it
//! wraps at 65536 is not known, so both are taken: a step from just below 65536 to just above 0 is a wrap, unless the counter was
//! ever higher. Settings are lost at power off, so that period and filter go out before each start.
//!
//! | status bits | meaning |
//! |---|---|
//! | 0..=2 | number of the sensor |
//! | 3 | several sensors |
//! | 4..=9 | overload of Fx Fy Fz Tx Ty Tz |
//! | 10..=12 | 1 sensor not detected, 2 sensor failure |
//! | 13..=15 | 1 converter (DAQ) failure, 2 communication failure |

use super::bench::{self, Bench, Ticks};
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Asked, Event, Health, Malformed};
use super::rdt::{RECORD, Record, parse_request, request};
use super::{Device, Disturbance, Unable};
use crate::units::SensorScale;
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// Counts for a newton, in its Newton mode.
pub const COUNTS_PER_N: f64 = 10_000.0;
/// Counts for a newton metre.
pub const COUNTS_PER_N_M: f64 = 100_000.0;
/// Ticks of its F/T sequence, in Hz.
pub const CLOCK_HZ: f64 = 1000.0;

const STOP: u16 = 0x0000;
const START: u16 = 0x0002;
const BIAS: u16 = 0x0042;
const FILTER: u16 = 0x0081;
const PERIOD: u16 = 0x0082;
const BIAS_SET: u32 = 255;
/// How near 65536 a counter of 16 bits must be for a wrap: 4 s.
const NEAR_WRAP: u32 = 0x1000;

/// What the host knows of the converter.
#[derive(Debug, Clone)]
pub struct OptoForce {
    scale: SensorScale,
    period_ms: u32,
    filter: Option<u32>,
    last: Option<u32>,
    wrapped: u64,
    narrow: bool,
}

impl OptoForce {
    /// With a period of 1 to 255 ms and a filter of 0 to 6; `None`: as it is.
    pub fn new(scale: SensorScale, period_ms: u8, filter: Option<u8>) -> Self {
        let (period_ms, filter) = (u32::from(period_ms), filter.map(u32::from));
        OptoForce { scale, period_ms, filter, last: None, wrapped: 0, narrow: true }
    }

    /// The counter unwrapped, whether it has 16 bits or 32.
    fn clock(&mut self, seen: u32) -> u64 {
        self.narrow &= seen <= 0xffff;
        let last = self.last.unwrap_or(seen);
        let (low, high) = (NEAR_WRAP, 0x1_0000 - NEAR_WRAP);
        if self.narrow && last >= high && seen < low {
            self.wrapped += 0x1_0000;
        } else if self.narrow && last < low && seen >= high && self.wrapped > 0 {
            // A late packet of before the wrap.
            return self.wrapped - 0x1_0000 + u64::from(seen);
        }
        self.last = Some(seen);
        self.wrapped + u64::from(seen)
    }
}

impl Wire for OptoForce {
    fn counters(&self) -> Counters {
        Counters { sequence_bits: Some(32), clock: Some((48, CLOCK_HZ)) }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(request(PERIOD, self.period_ms));
        out.extend(self.filter.map(|filter| request(FILTER, filter)));
        out.push(request(START, 0));
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(request(STOP, 0));
    }

    fn bias(&mut self, set: bool) -> Option<Vec<Vec<u8>>> {
        Some(vec![request(BIAS, if set { BIAS_SET } else { 0 })])
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        let record = Record::decode(bytes).filter(|_| bytes.len() == RECORD);
        let Some(record) = record else {
            found.push(Found::Malformed(Malformed::Length { got: bytes.len(), wanted: "one record of 36 bytes" }));
            return;
        };
        found.push(Found::Reading(Reading {
            wrench: self.scale.wrench_from_counts(record.counts),
            status: record.status,
            sequence: Some(u64::from(record.rdt_sequence)),
            clock: Some(self.clock(record.ft_sequence)),
            clipped: record.clipped(),
        }));
    }

    fn overhear(&self, bytes: &[u8]) -> Vec<Event> {
        let event = match parse_request(bytes) {
            Some((START, _)) => Event::Asked(Asked::Start),
            Some((STOP, _) | (PERIOD, 0)) => Event::Asked(Asked::Stop),
            Some((BIAS, number)) => Event::Bias { set: number == BIAS_SET },
            _ => return Vec::new(),
        };
        vec![event]
    }

    fn judge(&self, status: u32) -> (Health, String) {
        judge(status)
    }
}

fn judge(status: u32) -> (Health, String) {
    let mut said = Vec::new();
    let overload = status >> 4 & 0x3f;
    let axes = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"];
    said.extend(
        axes.iter().enumerate().filter(|(bit, _)| overload >> bit & 1 == 1).map(|(_, axis)| format!("overload {axis}")),
    );
    let (sensor, converter) = (status >> 10 & 7, status >> 13 & 7);
    match sensor {
        0 => {}
        1 => said.push("sensor not detected".to_string()),
        2 => said.push("sensor failure".to_string()),
        other => said.push(format!("sensor error {other}")),
    }
    match converter {
        0 => {}
        1 => said.push("converter failure".to_string()),
        2 => said.push("communication failure".to_string()),
        other => said.push(format!("converter error {other}")),
    }
    let health = match (sensor | converter, overload) {
        (0, 0) => Health::Good,
        (0, _) => Health::Saturated,
        _ => Health::Error,
    };
    if said.is_empty() {
        said.push("good".to_string());
    }
    if status & 0xf != 0 {
        said.push(format!("sensor {}{}", status & 7, if status & 8 != 0 { " of several" } else { "" }));
    }
    (health, said.join(", "))
}

/// The converter itself.
#[derive(Debug, Clone)]
pub struct OptoForceDevice {
    scale: SensorScale,
    bench: Bench,
    ticks: Ticks,
    narrow: bool,
    sequence: u32,
    left: Option<u32>,
    /// As the last requests set them.
    period_ms: u32,
    filter: u32,
}

impl OptoForceDevice {
    /// A converter that was just switched on. `narrow`: its F/T sequence has 16 bits.
    pub fn new(scale: SensorScale, rate_hz: f64, narrow: bool) -> Self {
        OptoForceDevice {
            scale,
            bench: Bench::default(),
            ticks: Ticks::new(CLOCK_HZ, rate_hz),
            narrow,
            sequence: 0,
            left: None,
            period_ms: 10,
            filter: 4,
        }
    }

    /// Period in ms and filter as they were set.
    pub fn settings(&self) -> (u32, u32) {
        (self.period_ms, self.filter)
    }
}

impl Device for OptoForceDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], _out: &mut Vec<Vec<u8>>) {
        let Some((code, number)) = parse_request(bytes) else { return };
        match code {
            STOP => self.bench.streams = false,
            START if self.bench.begin(peer) => {
                self.sequence = 0;
                self.left = (number > 0).then_some(number);
            }
            BIAS if number == BIAS_SET || number == 0 => self.bench.set_bias(number == BIAS_SET),
            FILTER if number <= 6 => self.filter = number,
            PERIOD if number <= 255 => {
                self.period_ms = number;
                self.bench.streams &= number > 0;
            }
            _ => {}
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
        let counts = self.bench.counts.unwrap_or_else(|| self.scale.counts_from_wrench(wrench));
        let overload = counts.iter().enumerate().filter(|(_, count)| **count == i32::MAX || **count == i32::MIN);
        let overload: u32 = overload.map(|(axis, _)| 0x10 << axis).sum();
        let dictated = self.bench.counts.is_some();
        let record = Record {
            rdt_sequence: self.sequence,
            ft_sequence: if self.narrow { self.ticks.count as u32 & 0xffff } else { self.ticks.count as u32 },
            status: self.bench.status.unwrap_or(if dictated { 0 } else { overload }),
            counts,
        };
        if !self.bench.silent {
            let mut datagram = Vec::with_capacity(RECORD);
            record.encode(&mut datagram);
            out.push(datagram);
        }
        self.left = self.left.map(|left| left.saturating_sub(1));
        self.bench.streams = self.left != Some(0);
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        parse_request(bytes).is_some_and(|(code, _)| [STOP, START, BIAS, FILTER, PERIOD].contains(&code))
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        match disturbance {
            Disturbance::Sequence(next) => self.sequence = (next as u32).wrapping_sub(1),
            Disturbance::Clock(at) => self.ticks.count = at,
            Disturbance::Scale { counts_per_n, counts_per_n_m } => {
                self.scale = bench::scale(counts_per_n, counts_per_n_m)?;
            }
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
    fn the_status_says_which_axis_and_which_part() {
        assert_eq!(judge(0), (Health::Good, "good".to_string()));
        assert_eq!(judge(1), (Health::Good, "good, sensor 1".to_string()));
        assert_eq!(judge(0x0241), (Health::Saturated, "overload Fz, overload Tz, sensor 1".to_string()));
        assert_eq!(judge(0x0400), (Health::Error, "sensor not detected".to_string()));
        assert_eq!(judge(0x4009), (Health::Error, "communication failure, sensor 1 of several".to_string()));
    }

    #[test]
    fn a_narrow_counter_wraps_and_a_wide_one_does_not() {
        let scale = SensorScale::new(COUNTS_PER_N, COUNTS_PER_N_M).expect("a sound scale");
        let mut narrow = OptoForce::new(scale, 1, None);
        let seen: Vec<u64> = [65_534, 65_535, 1, 65_533, 2].map(|seen| narrow.clock(seen)).to_vec();
        assert_eq!(seen, [65_534, 65_535, 65_537, 65_533, 65_538]);
        let mut wide = OptoForce::new(scale, 1, None);
        assert_eq!([65_535, 65_536, 65_535, 1].map(|seen| wide.clock(seen)), [65_535, 65_536, 65_535, 1]);
    }
}
