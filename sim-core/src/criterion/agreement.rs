//! Agreement of a prediction with an observation: agrees, contradicts, cannot tell.
//!
//! | form | agrees | contradicts | cannot tell |
//! |---|---|---|---|
//! | sign | both clear of zero, on one side | both clear of zero, on either side | one of them touches zero |
//! | value | nearer than the tolerance, uncertainty included | farther than it, uncertainty included | else |
//!
//! Clear of zero is: farther than two standard deviations. The sign form holds a stability prediction (`b - b_lo` of the loop as
//! it is) against the observed damping of a run; which of the two forms of stability that is, linear or one-sided, is the
//! caller's to say (reference/PHYSICS.md, correction 1).

use super::verdict::cannot;
use super::{
    Criterion, Estimate, Missing, Observation, ObservedAxis, Outcome, Verdict, contact_duration, observed_damping,
    speeds,
};
use crate::energy::Pairing;
use crate::refusal::{Refusal, finite, not_negative, positive};
use crate::restitution::Release;
use alloc::format;
use alloc::string::{String, ToString};
use serde::{Deserialize, Serialize};

/// The three outcomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// Prediction and observation say the same.
    Agrees,
    /// They do not.
    Contradicts,
    /// The uncertainty of either is too large.
    CannotTell,
}

/// Which quantity was predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AgreementOf {
    /// Whether the contact absorbs energy: the sign of the effective damping, in N s/m.
    Stability,
    /// Restitution with release at d = 0.
    RestitutionAtZeroDepth,
    /// Restitution with release at f = 0.
    RestitutionAtZeroForce,
    /// Effective damping at the satellites' port, in N s/m.
    Damping,
    /// Contact duration, in s.
    ContactDuration,
}

/// A prediction that a run must agree with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Agreement {
    /// Which quantity.
    pub of: AgreementOf,
    /// What was predicted, in the quantity's unit.
    pub predicted: f64,
    /// Standard deviation of the prediction, in the same unit.
    #[serde(default)]
    pub predicted_sd: f64,
    /// How far off still agrees, in the same unit; not for stability.
    #[serde(default)]
    pub tolerance: Option<f64>,
}

/// Whether two numbers have the same sign.
pub fn same_sign(predicted: Estimate, observed: Estimate) -> Answer {
    let clear = |estimate: Estimate| estimate.value.abs() > 2.0 * estimate.sd.unwrap_or(0.0);
    if !clear(predicted) || !clear(observed) {
        Answer::CannotTell
    } else if (predicted.value > 0.0) == (observed.value > 0.0) {
        Answer::Agrees
    } else {
        Answer::Contradicts
    }
}

/// Whether two numbers are nearer than `tolerance`, uncertainty included.
pub fn same_value(predicted: Estimate, observed: Estimate, tolerance: f64) -> Answer {
    let (a, b) = (predicted.sd.unwrap_or(0.0), observed.sd.unwrap_or(0.0));
    let twice = 2.0 * libm::sqrt(a * a + b * b);
    let distance = (predicted.value - observed.value).abs();
    if distance + twice <= tolerance {
        Answer::Agrees
    } else if distance - twice > tolerance {
        Answer::Contradicts
    } else {
        Answer::CannotTell
    }
}

impl Agreement {
    fn unit(&self) -> &'static str {
        match self.of {
            AgreementOf::Stability | AgreementOf::Damping => "N s/m",
            AgreementOf::RestitutionAtZeroDepth | AgreementOf::RestitutionAtZeroForce => "1",
            AgreementOf::ContactDuration => "s",
        }
    }

    fn observed(&self, run: &Observation<'_>) -> Result<Estimate, Missing> {
        let axis = ObservedAxis::Z;
        match self.of {
            AgreementOf::Stability | AgreementOf::Damping => {
                observed_damping(run, axis, Pairing::FeedbackWithSatelliteMean).map(|found| found.damping)
            }
            AgreementOf::RestitutionAtZeroDepth => {
                speeds(run, axis, Release::ZeroDepth).map(|speeds| speeds.restitution)
            }
            AgreementOf::RestitutionAtZeroForce => {
                speeds(run, axis, Release::ZeroForce).map(|speeds| speeds.restitution)
            }
            AgreementOf::ContactDuration => contact_duration(run, axis).map(|(duration, _)| duration),
        }
    }

    /// Refuses numbers without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        finite("predicted", self.predicted, self.unit())?;
        not_negative("predicted_sd", self.predicted_sd, self.unit())?;
        match (self.of, self.tolerance) {
            (AgreementOf::Stability, None) => Ok(()),
            (AgreementOf::Stability, Some(value)) => {
                let limit = "is given for stability, where only the sign counts";
                Err(Refusal { name: "tolerance", value, unit: self.unit(), limit })
            }
            (_, Some(value)) => positive("tolerance", value, self.unit()).map(|_| ()),
            (_, None) => {
                let limit = "is what is left out: give how far off still agrees, above 0";
                Err(Refusal { name: "tolerance", value: 0.0, unit: self.unit(), limit })
            }
        }
    }
}

impl Criterion for Agreement {
    fn id(&self) -> &str {
        "agreement"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let observed = match self.observed(run) {
            Ok(observed) => observed,
            Err(missing) => return cannot(self, self.unit(), &missing),
        };
        let predicted = Estimate { value: self.predicted, sd: Some(self.predicted_sd) };
        let answer = match (self.of, self.tolerance) {
            (AgreementOf::Stability, _) | (_, None) => same_sign(predicted, observed),
            (_, Some(tolerance)) => same_value(predicted, observed, tolerance),
        };
        let (outcome, word) = match answer {
            Answer::Agrees => (Outcome::Pass, "agrees"),
            Answer::Contradicts => (Outcome::Fail, "contradicts"),
            Answer::CannotTell => (Outcome::Undecided, "cannot tell"),
        };
        let (off, unit) = (observed.value - self.predicted, self.unit());
        // A ratio has no unit to be printed.
        let said = if unit == "1" { String::new() } else { format!(" {unit}") };
        Verdict {
            criterion: self.id().to_string(),
            outcome,
            value: Some(observed.value),
            uncertainty: observed.sd.map(|sd| 2.0 * libm::sqrt(sd * sd + self.predicted_sd * self.predicted_sd)),
            limit: Some(self.predicted),
            bound: None,
            margin: self.tolerance.map(|tolerance| tolerance - off.abs()),
            unit,
            at: None,
            why: format!("{word}: predicted {:.4}{said}, observed {:.4}{said}", self.predicted, observed.value),
        }
    }
}
