//! What CELL.toml says of the sensor, checked, and made into either side of the wire.

use super::any::{AnyDevice, AnySensor};
use super::client::Client;
use super::rdt::{self, Rdt, RdtDevice};
use super::status::Model;
use crate::units::SensorScale;
use serde::Deserialize;
use sim_core::time::Nanos;
use thiserror::Error;

/// Protocol of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// ATI Net F/T and Axia.
    Rdt,
}

/// How a protocol's bytes travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// Datagrams: each is a whole message.
    Udp,
    /// A stream of bytes.
    Tcp,
    /// A serial line, or a box that makes a TCP stream of one.
    Serial,
}

impl Protocol {
    /// Name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Rdt => "rdt",
        }
    }

    /// How its samples travel.
    pub fn transport(self) -> Transport {
        match self {
            Protocol::Rdt => Transport::Udp,
        }
    }
}

/// The table `[sensor]` of CELL.toml.
#[derive(Debug, Clone, PartialEq, Deserialize)]
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
    /// RDT: whose status bits hold; `net-ft` unless it says `axia`.
    pub model: Option<Model>,
    /// RDT: several records in a datagram.
    #[serde(default)]
    pub buffered: bool,
    /// RDT, buffered: records in a datagram of the virtual sensor, 1 to 40.
    pub records_per_datagram: Option<usize>,
    /// RDT: rate of the F/T sequence. 7000 for `net-ft`; for `axia` the rate of its converter, which has no default.
    pub clock_hz: Option<f64>,
    /// Silence after which the last sample is stale; 100 ms.
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

impl Settings {
    /// The host's side.
    ///
    /// # Errors
    /// Names the first setting that is missing or out of its limits.
    pub fn sensor(&self) -> Result<AnySensor, SettingsError> {
        self.check()?;
        let stale_after = Nanos(i64::from(self.stale_ms.unwrap_or(STALE_MS)) * 1_000_000);
        Ok(match self.protocol {
            Protocol::Rdt => {
                let (model, clock_hz) = self.model_and_clock();
                let rdt = Rdt { scale: self.scale()?, model, buffered: self.buffered, clock_hz };
                AnySensor::Rdt(Client::new(rdt, stale_after))
            }
        })
    }

    /// The device's side.
    ///
    /// # Errors
    /// Names the first setting that is missing or out of its limits.
    pub fn device(&self) -> Result<AnyDevice, SettingsError> {
        self.check()?;
        let rate_hz = self.rate()?;
        Ok(match self.protocol {
            Protocol::Rdt => {
                let (model, clock_hz) = self.model_and_clock();
                let clock_hz = clock_hz.unwrap_or(rate_hz);
                let records = self.records_per_datagram.unwrap_or(1);
                AnyDevice::Rdt(RdtDevice::new(self.scale()?, model, clock_hz, rate_hz, records))
            }
        })
    }

    /// Time between two samples.
    ///
    /// # Errors
    /// If the rate is missing or out of its limits.
    pub fn period(&self) -> Result<Nanos, SettingsError> {
        self.rate().map(|rate_hz| Nanos::from_seconds(1.0 / rate_hz))
    }

    fn rate(&self) -> Result<f64, SettingsError> {
        let rate_hz = self.rate_hz.ok_or_else(|| missing("rate_hz", "samples per second"))?;
        between("rate_hz", rate_hz, 1.0, 20_000.0, "Hz")?;
        Ok(rate_hz)
    }

    fn model_and_clock(&self) -> (Model, Option<f64>) {
        let model = self.model.unwrap_or(Model::NetFt);
        let usual = (model == Model::NetFt).then_some(rdt::CLOCK_HZ);
        (model, self.clock_hz.or(usual))
    }

    fn scale(&self) -> Result<SensorScale, SettingsError> {
        let help =
            "counts for one unit, from the sensor's page: cfgcpf and cfgcpt in its own units, here per N and N m";
        let counts_per_n = self.counts_per_n.ok_or_else(|| missing("counts_per_n", help))?;
        let counts_per_n_m = self.counts_per_n_m.ok_or_else(|| missing("counts_per_n_m", help))?;
        between("counts_per_n", counts_per_n, 1e-9, 1e12, "counts per N")?;
        between("counts_per_n_m", counts_per_n_m, 1e-9, 1e12, "counts per N m")?;
        SensorScale::new(counts_per_n, counts_per_n_m).ok_or_else(|| missing("counts_per_n", help))
    }

    fn check(&self) -> Result<(), SettingsError> {
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
            between("records_per_datagram", records as f64, 1.0, 40.0, "records")?;
        }
        Ok(())
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
