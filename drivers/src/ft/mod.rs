//! Force/torque sensors: the host's side ([`Sensor`]) and the device's side ([`Device`]) of each protocol.
//!
//! Bytes and time come in, events and bytes go out. Wire units end here: samples are in N and N m.
//!
//! | protocol | transport | module |
//! |---|---|---|
//! | ATI Net F/T and Axia, RDT | UDP | [`rdt`] |
//! | OnRobot/OptoForce HEX | UDP | [`optoforce`] |
//! | SCHUNK FTS | samples UDP, commands TCP | [`schunk`] |
//! | Bota Rokubi, SensONE | serial line | [`bota`] |
//! | Robotiq FT 150/300 | serial line | [`robotiq`] |
//! | a laboratory's own box | UDP, or a stream | [`record`] |
//!
//! Source of all of them: reference/PROTOCOLS.md, sections 2 and 3.

mod any;
mod bench;
pub mod bota;
pub mod calibration;
mod checksum;
mod client;
mod event;
mod framer;
pub mod http;
mod layout;
pub mod netft_tcp;
pub mod optoforce;
mod page;
pub mod rdt;
pub mod record;
pub mod robotiq;
pub mod schunk;
mod sequence;
mod settings;
mod status;
#[cfg(test)]
mod tests;

pub use any::{AnyDevice, AnySensor};
pub use bench::Bench;
pub use calibration::{Calibration, PageError};
pub use checksum::Checksum;
pub use client::{Client, Counters, Found, Reading, Wire};
pub use event::{Asked, Event, Health, Malformed, Sample, Tally};
pub use layout::{
    Checked, CrcField, Endian, Field, Framing, Kind, PerAxis, RecordLayout, StatusField, Sync, TimeField, Vector,
};
pub use sequence::{Sequence, Step};
pub use settings::{Protocol, Settings, SettingsError, Transport};
pub use status::Model;

use core::net::SocketAddr;
use sim_core::time::Nanos;
use thiserror::Error;

/// The host's side of one sensor.
pub trait Sensor {
    /// What to send so that it streams.
    fn start(&mut self, out: &mut Vec<Vec<u8>>);

    /// What to send so that it stops.
    fn stop(&mut self, out: &mut Vec<Vec<u8>>);

    /// A datagram, or a piece of a stream.
    fn receive(&mut self, now: Nanos, bytes: &[u8], events: &mut Vec<Event>);

    /// Time passes: a start that nobody answered goes out again, a silence is noticed. Call it every few milliseconds.
    fn tick(&mut self, now: Nanos, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>);

    /// Sets the zero at the present load, or takes it back. Never sent unasked.
    ///
    /// # Errors
    /// Where the protocol cannot.
    fn bias(&mut self, set: bool, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) -> Result<(), Unable>;

    /// Bytes on their way to the device, sent by somebody else: what they ask it for.
    fn overhear(&mut self, bytes: &[u8], events: &mut Vec<Event>);

    /// How often each class of event came.
    fn tally(&self) -> &Tally;
}

/// The device's side: being the sensor.
pub trait Device {
    /// A request, or a piece of a stream of requests, from a peer. Answers go back to that peer.
    fn receive_from(&mut self, now: Nanos, peer: Option<SocketAddr>, request: &[u8], out: &mut Vec<Vec<u8>>);

    /// A request from the only peer there is.
    fn receive(&mut self, now: Nanos, request: &[u8], out: &mut Vec<Vec<u8>>) {
        self.receive_from(now, None, request, out);
    }

    /// A sample of the load; call it at the rate of the settings, whether the device streams or not. What comes out goes to
    /// [`Device::client`].
    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>);

    /// Who asked last for the stream; `None` if nobody did, or if the caller named no peer.
    fn client(&self) -> Option<SocketAddr> {
        self.bench().client
    }

    /// Whether samples go out.
    fn streams(&self) -> bool {
        self.bench().streams
    }

    /// Whether this is something that a client of it says; anything else is noise, and its sender nobody.
    fn is_request(&self, bytes: &[u8]) -> bool;

    /// What it has in common with every other device.
    fn bench(&self) -> &Bench;

    /// Does something wrong from the next sample on.
    ///
    /// # Errors
    /// Where the protocol has nothing that this could act on.
    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable>;
}

/// What a test makes a device do wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// Send this status word; `None`: its own again.
    Status(Option<u32>),
    /// Send these counts, whatever the load, such as the limits of the type; `None`: the load again.
    Counts(Option<[i32; 6]>),
    /// The next packet has this counter.
    Sequence(u64),
    /// The device's own sample counter goes on from here.
    Clock(u64),
    /// The device's own sample counter stands still, and so does the reading.
    Stall(bool),
    /// Count differently from now on.
    Scale {
        /// Counts for one N.
        counts_per_n: f64,
        /// Counts for one N m.
        counts_per_n_m: f64,
    },
    /// Ignore this many requests to start.
    DeafStarts(u32),
    /// Send nothing, while the counters go on.
    Silent(bool),
}

/// A protocol that has no means for what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("this sensor's protocol cannot {what}")]
pub struct Unable {
    /// What was asked.
    pub what: &'static str,
}
