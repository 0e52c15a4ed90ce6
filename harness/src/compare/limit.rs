//! Limits that a user sets, and the guard band by which they are judged.

use crate::error::Error;
use serde::Serialize;

/// What a limit may be set on: name, unit, what is held against it.
pub const CHANNELS: [(&str, &str, &str); 7] = [
    ("force_z_n", "N", "RMSE of the force block over contact and 20 ms on either side"),
    ("measured_z_m", "m", "RMSE of the reported position over contact and 20 ms on either side"),
    ("peak_force_n", "N", "difference of the peak force between free run and recording"),
    ("contact_time_s", "s", "difference of the contact time"),
    ("rebound_speed_m_per_s", "m/s", "difference of the rebound speed"),
    ("restitution", "1", "difference of rebound speed over approach speed"),
    ("observed_energy_j", "J", "difference of the observed energy"),
];

/// A limit on a difference.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// One of [`CHANNELS`].
    pub channel: String,
    /// Largest difference that is accepted, in the unit of the channel.
    pub value: f64,
}

/// A limit, decided or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Below the limit, uncertainty included.
    Pass,
    /// Above the limit, uncertainty included.
    Fail,
    /// The limit lies within the uncertainty, or the number could not be had.
    Undecided,
}

impl Limit {
    /// From `channel=value`, the value in the unit of the channel.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let (channel, value) = text.split_once('=').ok_or_else(|| {
            Error::new(format!("limit `{text}` has no `=`")).help(format!("write channel=value; {}", known_channels()))
        })?;
        let value = value.trim().parse().map_err(|_| {
            Error::new(format!("limit `{text}`: `{}` is not a number", value.trim()))
                .help("write a number without its unit, as in force_z_n=0.35")
        })?;
        let limit = Limit { channel: channel.trim().to_string(), value };
        limit.check()?;
        Ok(limit)
    }

    /// Whether channel and value can be judged.
    pub(super) fn check(&self) -> Result<(), Error> {
        if unit_of(&self.channel).is_none() {
            return Err(Error::new(format!("no channel `{}` to set a limit on", self.channel)).help(known_channels()));
        }
        if !(self.value.is_finite() && self.value >= 0.0) {
            return Err(Error::new(format!(
                "limit {} = {} is not a finite number from 0 up",
                self.channel, self.value
            ))
            .help("a limit is the largest absolute difference that is accepted"));
        }
        Ok(())
    }
}

/// The unit of a channel.
pub(super) fn unit_of(channel: &str) -> Option<&'static str> {
    CHANNELS.iter().find(|(name, _, _)| *name == channel).map(|(_, unit, _)| *unit)
}

fn known_channels() -> String {
    let list: Vec<String> = CHANNELS.iter().map(|(name, unit, about)| format!("{name} in {unit} ({about})")).collect();
    format!("channels: {}", list.join("; "))
}

/// Decides with a guard band: an absolute value and its uncertainty against a limit.
pub(super) fn judged(value: Option<f64>, uncertainty: Option<f64>, limit: f64) -> Outcome {
    match (value, uncertainty) {
        (Some(value), Some(uncertainty)) if value + uncertainty <= limit => Outcome::Pass,
        (Some(value), Some(uncertainty)) if value - uncertainty > limit => Outcome::Fail,
        _ => Outcome::Undecided,
    }
}
