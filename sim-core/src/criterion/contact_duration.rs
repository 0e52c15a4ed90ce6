//! Contact duration: from first to last touch.
//!
//! A weak test of a model: it tells √(m/k) and hardly anything of damping or delay. Uncertainty: at each edge the noise of one
//! reading over the slope of the force there, times √(5/2) for the line through two crossings, and the spread of a contact that
//! falls anywhere between two samples, T/√12.

use super::restitution::{approach, ran_away};
use super::verdict::{Finding, Range, judged};
use super::{Contact, Criterion, Estimate, Missing, Observation, ObservedAxis, Verdict, contact};
use crate::refusal::Refusal;
use alloc::format;
use serde::{Deserialize, Serialize};

/// A limit of the contact's duration.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactDuration {
    /// Axis whose force tells.
    pub axis: ObservedAxis,
    /// Shortest that passes, in s.
    pub at_least_s: Option<f64>,
    /// Longest that passes, in s.
    pub at_most_s: Option<f64>,
}

impl ContactDuration {
    fn range(&self) -> Range {
        Range { at_least: self.at_least_s, at_most: self.at_most_s }
    }

    /// Refuses limits without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        self.range().check(["at_least_s", "at_most_s"], "s")
    }
}

/// Duration and its standard deviation in s, with the contact that it is of.
pub fn contact_duration(run: &Observation<'_>, axis: ObservedAxis) -> Result<(Estimate, Contact), Missing> {
    let along = run.along(axis)?;
    let found = contact(run, along)?;
    if let Ok(before) = approach(run, along, found.begin_s) {
        ran_away(run, along, before.value)?;
    }
    let period_s = if found.by.starts_with("reading") { run.sensor_tick_s()? } else { run.tick_s()? };
    let edge = |slope: f64| {
        let noise_s = along.load_sd.unwrap_or(0.0) / slope.max(f64::MIN_POSITIVE);
        2.5 * noise_s * noise_s + period_s * period_s / 12.0
    };
    let sd = libm::sqrt(edge(found.slopes_n_per_s[0]) + edge(found.slopes_n_per_s[1]));
    Ok((Estimate { value: found.end_s - found.begin_s, sd: Some(sd) }, found))
}

impl Criterion for ContactDuration {
    fn id(&self) -> &str {
        "contact-duration"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let found = contact_duration(run, self.axis).map(|(estimate, contact)| Finding {
            estimate,
            unit: "s",
            at: Some(crate::time::Nanos::from_seconds(contact.end_s)),
            about: format!("from first to last touch, by the {} from {:.3} N down", contact.by, contact.threshold_n),
        });
        judged(self, found, "s", self.range())
    }
}
