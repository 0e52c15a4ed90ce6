//! Criteria: what a run must satisfy, judged from its columns alone.
//!
//! A criterion sees an [`Observation`] and cannot know whether it was measured or simulated. So 'prediction against observation'
//! is one test and not two, and a requirement that was checked in simulation is the one that is checked on the rig.
//!
//! A verdict has three outcomes. It is undecided when the margin is below what the sensor resolves (two standard deviations),
//! and when a column that it needs is missing: the reason then begins with `cannot be judged`.

use crate::time::Nanos;
use alloc::string::String;
use serde::Serialize;

mod agreement;
mod any;
mod contact;
mod contact_duration;
mod damping;
mod distortion;
mod energy_per_axis;
mod observation;
mod observed_energy;
mod peak;
mod restitution;
mod speed;
mod verdict;

pub use agreement::{Agreement, AgreementOf, Answer, same_sign, same_value};
pub use any::AnyCriterion;
pub use contact::{Contact, contact};
pub use contact_duration::{ContactDuration, contact_duration};
pub use damping::{Damping, ObservedDamping, observed_damping};
pub use distortion::{Distortion, DistortionOf, distortion};
pub use energy_per_axis::{AxisEnergy, EnergyPerAxis, energy_per_axis};
pub use observation::{Along, Column, Known, Observation, ObservedAxis};
pub use observed_energy::{Energy, ObservedEnergy, Window, observed_energy};
pub use peak::{Peak, PeakDepth, PeakForce, peak_depth, peak_force, peak_force_size};
pub use restitution::{Restitution, Speeds, speeds};
pub use speed::{Estimate, mean_velocity};

/// What a run must satisfy.
pub trait Criterion {
    /// Its name, as files and reports write it.
    fn id(&self) -> &str;
    /// Judges a run.
    fn judge(&self, run: &Observation<'_>) -> Verdict;
}

/// Pass, fail, or neither.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// Satisfied, by more than the sensor leaves open.
    Pass,
    /// The margin is below what the sensor resolves, or a column is missing.
    Undecided,
    /// Not satisfied, by more than the sensor leaves open.
    Fail,
}

/// Which side of a limit is the good one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bound {
    /// The limit is the smallest value that passes.
    AtLeast,
    /// The limit is the largest value that passes.
    AtMost,
}

impl Bound {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Bound::AtLeast => "at least",
            Bound::AtMost => "at most",
        }
    }
}

/// What a criterion says of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// The criterion's [`Criterion::id`].
    pub criterion: String,
    /// The answer.
    pub outcome: Outcome,
    /// What was found, in `unit`; none if it could not be had.
    pub value: Option<f64>,
    /// Twice the standard deviation of the value, in `unit`; none if it is not known.
    pub uncertainty: Option<f64>,
    /// What it was held against, in `unit`: the nearer of two limits.
    pub limit: Option<f64>,
    /// Which side of the limit is the good one; none where it is a prediction.
    pub bound: Option<Bound>,
    /// Distance from the limit to the value, in `unit`; positive on the good side.
    pub margin: Option<f64>,
    /// Unit of the numbers above; `1` for a ratio.
    pub unit: &'static str,
    /// The instant that decided, if there is one; in ns, and so named where it is written.
    #[serde(rename = "at_ns")]
    pub at: Option<Nanos>,
    /// The reason, with definition and pairing, in one sentence.
    pub why: String,
}

/// Why a quantity cannot be had from a run: the end of the sentence `cannot be judged: `.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Missing(pub String);
