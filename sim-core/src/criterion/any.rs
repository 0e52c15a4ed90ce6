//! Every criterion behind one type, so that a file can list them.
//!
//! `[[criterion]]`, then `id = "…"`, then the limits of that criterion, units in their keys:
//!
//! ```toml
//! [[criterion]]
//! id = "observed-energy"
//! expect = "passive"
//!
//! [[criterion]]
//! id = "restitution"
//! release = "zero-force"
//! at_most = 1.0
//! ```

use super::{
    Agreement, ContactDuration, Criterion, Damping, Distortion, EnergyPerAxis, Observation, ObservedEnergy, PeakDepth,
    PeakForce, Restitution, Verdict,
};
use crate::refusal::Refusal;
use serde::{Deserialize, Serialize};

/// One criterion of a list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "id", rename_all = "kebab-case")]
pub enum AnyCriterion {
    /// See [`ObservedEnergy`].
    ObservedEnergy(ObservedEnergy),
    /// See [`EnergyPerAxis`].
    EnergyPerAxis(EnergyPerAxis),
    /// See [`Damping`].
    Damping(Damping),
    /// See [`Restitution`].
    Restitution(Restitution),
    /// See [`ContactDuration`].
    ContactDuration(ContactDuration),
    /// See [`PeakForce`].
    PeakForce(PeakForce),
    /// See [`PeakDepth`].
    PeakDepth(PeakDepth),
    /// See [`Distortion`].
    Distortion(Distortion),
    /// See [`Agreement`].
    Agreement(Agreement),
}

impl AnyCriterion {
    /// Refuses a criterion whose limits have no meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        match self {
            AnyCriterion::ObservedEnergy(criterion) => criterion.check(),
            AnyCriterion::EnergyPerAxis(criterion) => criterion.check(),
            AnyCriterion::Damping(criterion) => criterion.check(),
            AnyCriterion::Restitution(criterion) => criterion.check(),
            AnyCriterion::ContactDuration(criterion) => criterion.check(),
            AnyCriterion::PeakForce(criterion) => criterion.check(),
            AnyCriterion::PeakDepth(criterion) => criterion.check(),
            AnyCriterion::Distortion(criterion) => criterion.check(),
            AnyCriterion::Agreement(criterion) => criterion.check(),
        }
    }

    fn criterion(&self) -> &dyn Criterion {
        match self {
            AnyCriterion::ObservedEnergy(criterion) => criterion,
            AnyCriterion::EnergyPerAxis(criterion) => criterion,
            AnyCriterion::Damping(criterion) => criterion,
            AnyCriterion::Restitution(criterion) => criterion,
            AnyCriterion::ContactDuration(criterion) => criterion,
            AnyCriterion::PeakForce(criterion) => criterion,
            AnyCriterion::PeakDepth(criterion) => criterion,
            AnyCriterion::Distortion(criterion) => criterion,
            AnyCriterion::Agreement(criterion) => criterion,
        }
    }
}

impl Criterion for AnyCriterion {
    fn id(&self) -> &str {
        self.criterion().id()
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        self.criterion().judge(run)
    }
}
