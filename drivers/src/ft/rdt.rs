//! ATI RDT: the UDP stream of Net F/T and Axia, port 49152, big-endian. Source: reference/PROTOCOLS.md, sections 2.1 to 2.5.
//!
//! | bytes | request |
//! |---|---|
//! | 0..2 | 0x1234 |
//! | 2..4 | command: 0 stop, 2 start, 3 start buffered, 4 start multi-unit, 0x41 reset the latch, 0x42 set the bias |
//! | 4..8 | number of samples, 0 without end |
//!
//! | bytes | record |
//! |---|---|
//! | 0..4 | RDT sequence: 1 at every start |
//! | 4..8 | F/T sequence: the device's own samples at 7000 Hz; goes on over starts |
//! | 8..12 | status |
//! | 12..36 | six i32: Fx Fy Fz in counts per force unit, Tx Ty Tz in counts per torque unit |
//!
//! Buffered, a datagram holds 1 to 40 records. There is no acknowledgement and no time stamp. The stream has one client: a start
//! from another address takes it away.
//!
//! Not covered: the multi-unit start is sent and taken as a plain start.

use super::bench::{self, Bench, Ticks};
use super::client::{Counters, Found, Reading, Wire};
use super::event::{Asked, Event, Health, Malformed};
use super::status::Model;
use super::{Device, Disturbance, Unable};
use crate::units::SensorScale;
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// First two bytes of a request.
pub const HEADER: u16 = 0x1234;
/// Bytes of a record.
pub const RECORD: usize = 36;
/// Most records in a datagram.
pub const RECORDS_MAX: usize = 40;
/// Rate of the Net F/T's own samples, in Hz.
pub const CLOCK_HZ: f64 = 7000.0;

/// Status of a sensor whose only news is a latched monitor condition.
const LATCHED: u32 = 0x8001_0000;

/// A command to the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// End the stream.
    Stop,
    /// One record in a datagram.
    Start,
    /// Several records in a datagram.
    StartBuffered,
    /// One record in a datagram, synchronised between units.
    StartMultiUnit,
    /// Clear the latched monitor condition.
    ResetLatch,
    /// Set the zero at the present load.
    Bias,
}

impl Command {
    /// Every command.
    pub const ALL: [Command; 6] = [
        Command::Stop,
        Command::Start,
        Command::StartBuffered,
        Command::StartMultiUnit,
        Command::ResetLatch,
        Command::Bias,
    ];

    /// Its number.
    pub fn code(self) -> u16 {
        match self {
            Command::Stop => 0x0000,
            Command::Start => 0x0002,
            Command::StartBuffered => 0x0003,
            Command::StartMultiUnit => 0x0004,
            Command::ResetLatch => 0x0041,
            Command::Bias => 0x0042,
        }
    }
}

/// Eight bytes with a command and its number.
pub fn request(code: u16, number: u32) -> Vec<u8> {
    let mut bytes = HEADER.to_be_bytes().to_vec();
    bytes.extend(code.to_be_bytes());
    bytes.extend(number.to_be_bytes());
    bytes
}

/// Command and number of eight bytes; `None` if they are no request.
pub fn parse_request(bytes: &[u8]) -> Option<(u16, u32)> {
    let &[h1, h2, c1, c2, n1, n2, n3, n4] = bytes else { return None };
    (u16::from_be_bytes([h1, h2]) == HEADER)
        .then(|| (u16::from_be_bytes([c1, c2]), u32::from_be_bytes([n1, n2, n3, n4])))
}

/// One record as it is on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Counts the packets of this stream, from 1.
    pub rdt_sequence: u32,
    /// Counts the device's own samples.
    pub ft_sequence: u32,
    /// Status word.
    pub status: u32,
    /// Fx Fy Fz Tx Ty Tz.
    pub counts: [i32; 6],
}

impl Record {
    /// From the first 36 bytes; `None` if there are fewer.
    pub fn decode(bytes: &[u8]) -> Option<Record> {
        let (words, _) = bytes.get(..RECORD)?.as_chunks::<4>();
        let word = |index: usize| words.get(index).map(|bytes| u32::from_be_bytes(*bytes));
        let count = |index: usize| words.get(index).map(|bytes| i32::from_be_bytes(*bytes));
        Some(Record {
            rdt_sequence: word(0)?,
            ft_sequence: word(1)?,
            status: word(2)?,
            counts: [count(3)?, count(4)?, count(5)?, count(6)?, count(7)?, count(8)?],
        })
    }

    /// Appends its 36 bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        for word in [self.rdt_sequence, self.ft_sequence, self.status] {
            out.extend(word.to_be_bytes());
        }
        for count in self.counts {
            out.extend(count.to_be_bytes());
        }
    }

    /// Whether a count lies at a limit of its type.
    pub fn clipped(&self) -> bool {
        self.counts.iter().any(|&count| count == i32::MAX || count == i32::MIN)
    }
}

/// What the host knows of the sensor.
#[derive(Debug, Clone)]
pub struct Rdt {
    /// Counts per N and per N m, from the sensor's page.
    pub scale: SensorScale,
    /// Whose status bits hold.
    pub model: Model,
    /// Ask for the buffered stream.
    pub buffered: bool,
    /// Rate of the F/T sequence, if known, in Hz.
    pub clock_hz: Option<f64>,
}

impl Wire for Rdt {
    fn counters(&self) -> Counters {
        Counters { sequence_bits: Some(32), clock: self.clock_hz.map(|rate_hz| (32, rate_hz)) }
    }

    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        let command = if self.buffered { Command::StartBuffered } else { Command::Start };
        out.push(request(command.code(), 0));
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        out.push(request(Command::Stop.code(), 0));
    }

    fn bias(&mut self, set: bool) -> Option<Vec<Vec<u8>>> {
        set.then(|| vec![request(Command::Bias.code(), 0)])
    }

    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>) {
        if bytes.is_empty() || !bytes.len().is_multiple_of(RECORD) || bytes.len() > RECORD * RECORDS_MAX {
            let wanted = "1 to 40 records of 36 bytes";
            found.push(Found::Malformed(Malformed::Length { got: bytes.len(), wanted }));
            return;
        }
        for record in bytes.chunks_exact(RECORD).filter_map(Record::decode) {
            found.push(Found::Reading(Reading {
                wrench: self.scale.wrench_from_counts(record.counts),
                status: record.status,
                sequence: Some(u64::from(record.rdt_sequence)),
                clock: Some(u64::from(record.ft_sequence)),
                clipped: record.clipped(),
            }));
        }
    }

    fn overhear(&self, bytes: &[u8]) -> Vec<Event> {
        let code = parse_request(bytes).map(|(code, _)| code);
        let command = Command::ALL.into_iter().find(|command| Some(command.code()) == code);
        let event = command.map(|command| match command {
            Command::Stop => Event::Asked(Asked::Stop),
            Command::Start | Command::StartBuffered | Command::StartMultiUnit => Event::Asked(Asked::Start),
            Command::ResetLatch => Event::Asked(Asked::ResetLatch),
            Command::Bias => Event::Bias { set: true },
        });
        event.into_iter().collect()
    }

    fn judge(&self, status: u32) -> (Health, String) {
        self.model.judge(status)
    }
}

/// The sensor itself.
#[derive(Debug, Clone)]
pub struct RdtDevice {
    scale: SensorScale,
    model: Model,
    records_per_datagram: usize,
    bench: Bench,
    ticks: Ticks,
    rdt_sequence: u32,
    left: Option<u32>,
    buffered: bool,
    pending: Vec<u8>,
    latched: bool,
}

impl RdtDevice {
    /// A sensor that was just switched on. `rate_hz` is how often [`Device::sample`] will be called.
    pub fn new(scale: SensorScale, model: Model, clock_hz: f64, rate_hz: f64, records_per_datagram: usize) -> Self {
        RdtDevice {
            scale,
            model,
            records_per_datagram: records_per_datagram.clamp(1, RECORDS_MAX),
            bench: Bench::default(),
            ticks: Ticks::new(clock_hz, rate_hz),
            rdt_sequence: 0,
            left: None,
            buffered: false,
            pending: Vec::new(),
            latched: false,
        }
    }

    /// Meets a monitor condition: bit 16 stays until the latch is reset.
    pub fn latch(&mut self) {
        self.latched = true;
    }

    /// Counts per N and N m in use now: what its page would say.
    pub fn scale(&self) -> SensorScale {
        self.scale
    }

    fn begin(&mut self, peer: Option<SocketAddr>, buffered: bool, samples: u32) {
        if self.bench.begin(peer) {
            self.rdt_sequence = 0;
            self.left = (samples > 0).then_some(samples);
            self.buffered = buffered;
            self.pending.clear();
        }
    }

    fn record(&mut self, wrench: [f64; 6]) -> Record {
        let load = self.scale.counts_from_wrench(wrench);
        let counts = self.bench.counts.unwrap_or(load);
        let mut record =
            Record { rdt_sequence: self.rdt_sequence, ft_sequence: self.ticks.count as u32, status: 0, counts };
        // Counts that a test dictates come with the status that it dictates, or with a good one.
        let saturated = if record.clipped() && self.bench.counts.is_none() { self.model.saturated() } else { 0 };
        record.status = self.bench.status.unwrap_or(saturated | if self.latched { LATCHED } else { 0 });
        record
    }
}

impl Device for RdtDevice {
    fn receive_from(&mut self, _now: Nanos, peer: Option<SocketAddr>, bytes: &[u8], _out: &mut Vec<Vec<u8>>) {
        let Some((code, number)) = parse_request(bytes) else { return };
        match Command::ALL.into_iter().find(|command| command.code() == code) {
            Some(Command::Start | Command::StartMultiUnit) => self.begin(peer, false, number),
            Some(Command::StartBuffered) => self.begin(peer, true, number),
            Some(Command::Stop) => self.bench.streams = false,
            Some(Command::Bias) => self.bench.set_bias(true),
            Some(Command::ResetLatch) => self.latched = false,
            None => {}
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
        self.rdt_sequence = self.rdt_sequence.wrapping_add(1);
        self.record(wrench).encode(&mut self.pending);
        self.left = self.left.map(|left| left.saturating_sub(1));
        let done = self.left == Some(0);
        let records = if self.buffered { self.records_per_datagram } else { 1 };
        if self.pending.len() >= records * RECORD || done {
            let datagram = core::mem::take(&mut self.pending);
            if !self.bench.silent {
                out.push(datagram);
            }
        }
        if done {
            self.bench.streams = false;
        }
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        parse_request(bytes).is_some_and(|(code, _)| Command::ALL.iter().any(|command| command.code() == code))
    }

    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        match disturbance {
            Disturbance::Sequence(next) => self.rdt_sequence = (next as u32).wrapping_sub(1),
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
