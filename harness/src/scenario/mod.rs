//! Scenarios: one run of a rig, as a file. What it starts from, which faults are put in, and what it is judged by.
//!
//! TOML, units in the keys, unknown keys refused with their place. The rig is a model file that the scenario names, so that
//! several scenarios can share one, and `compare`, `diagnose` and `replay` read the same file. Everything that decides a run is in
//! these two files: there is no default seed and no clock.
//!
//! ```text
//! scenario.toml ─┐
//! model.toml ────┴─→ run → trace → criteria → verdicts
//!                           └────→ recording (.mcap) → compare, diagnose, replay
//! ```

pub(crate) mod axis;
mod check;
mod fault;
pub mod judge;
mod library;
pub mod page;
pub mod run;
mod schema;
mod space;

pub use fault::{Fault, acting};
pub use library::{Source, embedded};
pub(crate) use schema::fault_schemas;
pub use schema::schema;

use crate::error::Error;
use crate::model::{EffectModel, parsed};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_core::criterion::AnyCriterion;
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// A whole scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format.
    pub schema: u32,
    /// What it is called: lower-case letters, digits and dashes.
    pub name: String,
    /// What it is for, and where its numbers come from.
    #[serde(default)]
    pub about: String,
    /// Where all randomness of the run comes from; there is no default.
    pub seed: u64,
    /// Length of the run.
    pub duration_s: f64,
    /// The model file, seen from the folder of the scenario.
    pub model: String,
    /// Date of the first sample, in whole seconds since 1970; the clock on the wall is never asked.
    #[serde(default = "epoch_s")]
    pub epoch_s: u64,
    /// Where the satellites are at the beginning, and how they move.
    pub start: StartModel,
    /// Faults that are put in, besides the effects of the model.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultModel>,
    /// What the run is judged by.
    #[serde(default, rename = "criterion", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<BTreeMap<String, serde_json::Value>>")]
    pub criteria: Vec<AnyCriterion>,
    /// What the operator notes down: keys and texts for the recording's `session` record.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub session: BTreeMap<String, String>,
}

/// The first motion: one number along the axis of approach, or three numbers in the nozzle frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartModel {
    /// Position of the probe; positive z is penetration of the nominal contact plane.
    pub position_m: Components,
    /// Velocity of the probe; positive z closes the gap.
    pub velocity_m_per_s: Components,
    /// How the probe is turned against the nozzle: axis times angle, in the nozzle frame. Six axes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_rad: Option<[f64; 3]>,
    /// How the probe turns against the nozzle, in the nozzle frame. Six axes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_rad_per_s: Option<[f64; 3]>,
    /// Velocity of the target, global. Six axes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_velocity_m_per_s: Option<[f64; 3]>,
    /// How the target tumbles, in its own axes. Six axes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_rate_rad_per_s: Option<[f64; 3]>,
}

/// A number along the axis of approach, or a vector in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected one number along the axis, or [x, y, z] in the nozzle frame")]
pub enum Components {
    /// Along the axis of approach, z.
    Along(f64),
    /// In the nozzle frame.
    Vector([f64; 3]),
}

impl Components {
    /// The part along the axis of approach.
    pub fn along(self) -> f64 {
        match self {
            Components::Along(value) | Components::Vector([_, _, value]) => value,
        }
    }

    /// All three parts in the nozzle frame.
    pub fn vector(self) -> [f64; 3] {
        match self {
            Components::Along(value) => [0.0, 0.0, value],
            Components::Vector(value) => value,
        }
    }
}

/// A fault: an effect of the catalogue, all the time or for a while.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultModel {
    /// The effect and its parameters, as in a model.
    #[serde(flatten)]
    pub effect: EffectModel,
    /// When it begins to act; from the beginning if it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// When it ceases to act; never if it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
}

/// What lists the keys of a scenario.
const SCHEMA: &str = "dockhil run --schema";

/// 2000-01-01T00:00:00Z.
fn epoch_s() -> u64 {
    946_684_800
}

impl Scenario {
    /// Date of the first sample, in ns. The check has made sure that it fits.
    fn start_ns(&self) -> i64 {
        self.epoch_s as i64 * 1_000_000_000
    }

    /// The end of the run: a whole number of ticks of the loop, as the check has made sure.
    fn until(&self, loop_period: Nanos) -> Nanos {
        let ticks = libm::round(self.duration_s / loop_period.seconds()) as i64;
        Nanos(ticks * loop_period.0)
    }

    /// Reads a scenario from text; `name` stands in errors. What depends on the model is checked when the two meet.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let scenario = parsed::<Scenario>(name, text, SCHEMA).map_err(|error| judge::placed(error, name, text))?;
        scenario.check(name, text)?;
        Ok(scenario)
    }
}
