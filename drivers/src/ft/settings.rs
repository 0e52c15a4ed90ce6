//! What CELL.toml says of the sensor, checked, and made into either side of the wire.
//!
//! | key | protocols |
//! |---|---|
//! | `counts_per_n`, `counts_per_n_m` | rdt: required; optoforce: 10 000 and 100 000 unless given |
//! | `model`, `buffered`, `records_per_datagram`, `clock_hz` | rdt |
//! | `filter` | optoforce |
//! | `configure` | bota |
//! | `record` | record: required |
//! | `samples_port` | schunk: 54843 unless given |
//! | `rate_hz`, `stale_ms`, `address` | all |
//!
//! A key that the protocol has no use for is an error, since it would change nothing.

use super::any::{AnyDevice, AnySensor};
use super::bota::{Bota, BotaDevice};
use super::client::Client;
use super::layout::{Checked, Framing, RecordLayout};
use super::optoforce::{self, OptoForce, OptoForceDevice};
use super::rdt::{self, Rdt, RdtDevice};
use super::record::{RecordDevice, RecordWire};
use super::robotiq::{self, Robotiq};
use super::schunk::{self, Schunk};
use super::status::Model;
use crate::units::SensorScale;
use serde::Deserialize;
use sim_core::time::Nanos;
use thiserror::Error;

/// Protocol of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// ATI Net F/T and Axia.
    Rdt,
    /// OnRobot/OptoForce HEX.
    OptoForce,
    /// SCHUNK FTS with IFB-EN.
    Schunk,
    /// Bota Rokubi and SensONE.
    Bota,
    /// Robotiq FT 150/300.
    Robotiq,
    /// A laboratory's own box.
    Record,
}

/// How a sensor's samples travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// Datagrams: each is a whole message.
    Udp,
    /// A stream of bytes: TCP, or a serial line behind a box that makes TCP of it.
    Stream,
    /// Commands and their answers on a stream, samples as datagrams to a port of the host.
    Split {
        /// The host's port for samples; 0 is any free one.
        samples_port: u16,
    },
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Protocol; 6] =
        [Protocol::Rdt, Protocol::OptoForce, Protocol::Schunk, Protocol::Bota, Protocol::Robotiq, Protocol::Record];

    /// Name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Rdt => "rdt",
            Protocol::OptoForce => "optoforce",
            Protocol::Schunk => "schunk",
            Protocol::Bota => "bota",
            Protocol::Robotiq => "robotiq",
            Protocol::Record => "record",
        }
    }

    /// How its records are known, in words.
    pub fn expects(self) -> &'static str {
        match self {
            Protocol::Rdt => "datagrams of 36 bytes, or several times as many",
            Protocol::OptoForce => "datagrams of 36 bytes",
            Protocol::Schunk => "messages that begin with 0xffff, a counter and a length; a sample has 35 bytes",
            Protocol::Bota => "a stream of records of 37 bytes that begin with 0xaa",
            Protocol::Robotiq => "a stream of records of 16 bytes that begin with 0x20 0x4e",
            Protocol::Record => "records as the table record lays them out",
        }
    }
}

/// The table `[sensor]` of CELL.toml.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Which protocol it speaks.
    pub protocol: Protocol,
    /// Where it is, for example `192.168.1.1:49152`.
    pub address: Option<String>,
    /// Samples per second.
    pub rate_hz: Option<f64>,
    /// Counts for one N, from the sensor's calibration. No default: it changes with the calibration and the units.
    pub counts_per_n: Option<f64>,
    /// Counts for one N m.
    pub counts_per_n_m: Option<f64>,
    /// Whose status bits hold; `net-ft` unless it says `axia`.
    pub model: Option<Model>,
    /// Several records in a datagram.
    pub buffered: Option<bool>,
    /// Buffered: records in a datagram of the virtual sensor, 1 to 40.
    pub records_per_datagram: Option<usize>,
    /// Rate of the F/T sequence. 7000 for `net-ft`; for `axia` the rate of its converter, which has no default.
    pub clock_hz: Option<f64>,
    /// 0 to 6: none, 500, 150, 50, 15, 5, 1.5 Hz.
    pub filter: Option<u8>,
    /// Commands that configure the sensor before it runs, for example `["f,51,0,0,1"]`.
    pub configure: Option<Vec<String>>,
    /// Layout of the records.
    pub record: Option<RecordLayout>,
    /// Port of the host to which samples come, where commands travel elsewhere.
    pub samples_port: Option<u16>,
    /// Silence after which the last sample is stale; 100 ms, for robotiq 160 ms.
    pub stale_ms: Option<u32>,
}

/// A setting that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("sensor.{field} {problem}")]
pub struct SettingsError {
    /// Which one.
    pub field: &'static str,
    /// Its value, the limit, and what to do.
    pub problem: String,
}

/// Silence after which a sample is stale, unless the settings say otherwise. Source: reference/PROTOCOLS.md, section 2.4.
const STALE_MS: u32 = 100;
/// Most commands that configure a sensor, and most bytes of each.
const CONFIGURE_MAX: (usize, usize) = (32, 64);

impl Settings {
    /// The host's side.
    ///
    /// # Errors
    /// Names the first setting that is missing, out of its limits, or of no use to the protocol.
    pub fn sensor(&self) -> Result<AnySensor, SettingsError> {
        self.check()?;
        let usual_ms = if self.protocol == Protocol::Robotiq { robotiq::STALE_MS } else { STALE_MS };
        let stale = Nanos(i64::from(self.stale_ms.unwrap_or(usual_ms)) * 1_000_000);
        Ok(match self.protocol {
            Protocol::Rdt => {
                let (model, clock_hz) = self.model_and_clock();
                let buffered = self.buffered.unwrap_or_default();
                AnySensor::Rdt(Box::new(Client::new(Rdt { scale: self.scale()?, model, buffered, clock_hz }, stale)))
            }
            Protocol::OptoForce => {
                let wire = OptoForce::new(self.scale()?, self.period_ms()?, self.filter);
                AnySensor::OptoForce(Box::new(Client::new(wire, stale)))
            }
            Protocol::Schunk => AnySensor::Schunk(Box::new(Client::new(Schunk::default(), stale))),
            Protocol::Bota => {
                let wire = Bota::new(self.configure.clone().unwrap_or_default());
                AnySensor::Bota(Box::new(Client::new(wire, stale)))
            }
            Protocol::Robotiq => AnySensor::Robotiq(Box::new(Client::new(Robotiq::default(), stale))),
            Protocol::Record => AnySensor::Record(Box::new(Client::new(RecordWire::new(self.layout()?), stale))),
        })
    }

    /// The device's side.
    ///
    /// # Errors
    /// Names the first setting that is missing, out of its limits, or of no use to the protocol.
    pub fn device(&self) -> Result<AnyDevice, SettingsError> {
        self.check()?;
        let rate_hz = self.rate()?;
        Ok(match self.protocol {
            Protocol::Rdt => {
                let (model, clock_hz) = self.model_and_clock();
                let clock_hz = clock_hz.unwrap_or(rate_hz);
                let records = self.records_per_datagram.unwrap_or(1);
                AnyDevice::Rdt(Box::new(RdtDevice::new(self.scale()?, model, clock_hz, rate_hz, records)))
            }
            Protocol::OptoForce => {
                self.period_ms()?;
                AnyDevice::OptoForce(Box::new(OptoForceDevice::new(self.scale()?, rate_hz, false)))
            }
            Protocol::Schunk => AnyDevice::Schunk(Box::default()),
            Protocol::Bota => AnyDevice::Bota(Box::new(BotaDevice::new(rate_hz))),
            Protocol::Robotiq => AnyDevice::Robotiq(Box::default()),
            Protocol::Record => AnyDevice::Record(Box::new(RecordDevice::new(self.layout()?, rate_hz))),
        })
    }

    /// Time between two samples.
    ///
    /// # Errors
    /// If the rate is missing or out of its limits.
    pub fn period(&self) -> Result<Nanos, SettingsError> {
        self.rate().map(|rate_hz| Nanos::from_seconds(1.0 / rate_hz))
    }

    /// How its samples travel.
    pub fn transport(&self) -> Transport {
        match self.protocol {
            Protocol::Rdt | Protocol::OptoForce => Transport::Udp,
            Protocol::Schunk => Transport::Split { samples_port: self.samples_port.unwrap_or(schunk::SAMPLES_PORT) },
            Protocol::Bota | Protocol::Robotiq => Transport::Stream,
            Protocol::Record => match self.record.as_ref().map(|layout| layout.framing) {
                Some(Framing::Stream) => Transport::Stream,
                Some(Framing::Datagram) | None => Transport::Udp,
            },
        }
    }

    fn rate(&self) -> Result<f64, SettingsError> {
        let fixed = match self.protocol {
            Protocol::Schunk => Some(1000.0),
            Protocol::Robotiq => Some(robotiq::RATE_HZ),
            _ => None,
        };
        let rate_hz = self.rate_hz.or(fixed).ok_or_else(|| missing("rate_hz", "samples per second"))?;
        match fixed {
            Some(fixed) => between("rate_hz", rate_hz, fixed, fixed, "Hz")?,
            None => between("rate_hz", rate_hz, 1.0, 20_000.0, "Hz")?,
        }
        Ok(rate_hz)
    }

    /// OptoForce is set in whole milliseconds.
    fn period_ms(&self) -> Result<u8, SettingsError> {
        let period_ms = (1000.0 / self.rate()?).round();
        between("rate_hz", period_ms, 1.0, 255.0, "ms between samples")?;
        Ok(period_ms as u8)
    }

    pub(super) fn model_and_clock(&self) -> (Model, Option<f64>) {
        let model = self.model.unwrap_or(Model::NetFt);
        let usual = (model == Model::NetFt).then_some(rdt::CLOCK_HZ);
        (model, self.clock_hz.or(usual))
    }

    pub(super) fn scale(&self) -> Result<SensorScale, SettingsError> {
        let usual = |value: f64| (self.protocol == Protocol::OptoForce).then_some(value);
        let help = "counts for one N (N m), from the sensor's page: cfgcpf (cfgcpt), divided by the newtons (newton \
                    metres) in its unit; there is no default, since it changes with calibration and units";
        let per_n =
            self.counts_per_n.or(usual(optoforce::COUNTS_PER_N)).ok_or_else(|| missing("counts_per_n", help))?;
        let per_n_m =
            self.counts_per_n_m.or(usual(optoforce::COUNTS_PER_N_M)).ok_or_else(|| missing("counts_per_n_m", help))?;
        between("counts_per_n", per_n, 1e-9, 1e12, "counts per N")?;
        between("counts_per_n_m", per_n_m, 1e-9, 1e12, "counts per N m")?;
        SensorScale::new(per_n, per_n_m).ok_or_else(|| missing("counts_per_n", help))
    }

    fn layout(&self) -> Result<Checked, SettingsError> {
        let layout = self.record.as_ref();
        layout.ok_or_else(|| missing("record", "the table [sensor.record] with the layout of the records"))?.check()
    }

    fn check(&self) -> Result<(), SettingsError> {
        self.nothing_useless()?;
        if self.rate_hz.is_some() {
            self.rate()?;
        }
        if let Some(stale_ms) = self.stale_ms {
            between("stale_ms", f64::from(stale_ms), 1.0, 60_000.0, "ms")?;
        }
        if let Some(clock_hz) = self.clock_hz {
            between("clock_hz", clock_hz, 1.0, 1e6, "Hz")?;
        }
        if let Some(records) = self.records_per_datagram {
            between("records_per_datagram", records as f64, 1.0, rdt::RECORDS_MAX as f64, "records")?;
        }
        if let Some(filter) = self.filter {
            between("filter", f64::from(filter), 0.0, 6.0, "(code of the filter)")?;
        }
        let (commands_max, bytes_max) = CONFIGURE_MAX;
        let commands = self.configure.as_deref().unwrap_or_default();
        if commands.len() > commands_max || commands.iter().any(|command| command.len() > bytes_max) {
            let limit = format!("has more than {commands_max} commands, or one of more than {bytes_max} bytes");
            return Err(SettingsError { field: "configure", problem: limit });
        }
        Ok(())
    }

    /// No key without a use: it would change nothing, and whoever wrote it believes otherwise.
    fn nothing_useless(&self) -> Result<(), SettingsError> {
        use Protocol::{Bota, OptoForce, Rdt, Record, Schunk};
        let keys: [(&'static str, bool, &[Protocol]); 10] = [
            ("counts_per_n", self.counts_per_n.is_some(), &[Rdt, OptoForce]),
            ("counts_per_n_m", self.counts_per_n_m.is_some(), &[Rdt, OptoForce]),
            ("model", self.model.is_some(), &[Rdt]),
            ("buffered", self.buffered.is_some(), &[Rdt]),
            ("records_per_datagram", self.records_per_datagram.is_some(), &[Rdt]),
            ("clock_hz", self.clock_hz.is_some(), &[Rdt]),
            ("filter", self.filter.is_some(), &[OptoForce]),
            ("configure", self.configure.is_some(), &[Bota]),
            ("record", self.record.is_some(), &[Record]),
            ("samples_port", self.samples_port.is_some(), &[Schunk]),
        ];
        match keys.into_iter().find(|(_, given, protocols)| *given && !protocols.contains(&self.protocol)) {
            None => Ok(()),
            Some((field, _, protocols)) => {
                let names: Vec<&str> = protocols.iter().map(|protocol| protocol.name()).collect();
                let (mine, others) = (self.protocol.name(), names.join(" and "));
                let problem = format!("means nothing to the protocol {mine}, only to {others}; take it out");
                Err(SettingsError { field, problem })
            }
        }
    }
}

fn missing(field: &'static str, what: &str) -> SettingsError {
    SettingsError { field, problem: format!("is missing: {what}") }
}

fn between(field: &'static str, value: f64, least: f64, most: f64, unit: &str) -> Result<(), SettingsError> {
    if value >= least && value <= most {
        return Ok(());
    }
    Err(SettingsError { field, problem: format!("= {value} {unit} is outside [{least}, {most}]") })
}
