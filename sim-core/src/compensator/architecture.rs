//! The three architectures of thesis Fig. 3.1, and the pose on which a virtual contact acts.

use super::PositionEstimator;
use crate::refusal::Refusal;
use serde::{Deserialize, Serialize};

/// Which contact the satellites feel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// The real contact alone: what the sensor feels.
    PureHardware,
    /// The virtual contact alone; the sensor is not listened to.
    PureSoftware,
    /// Both.
    #[default]
    Hybrid,
}

impl Architecture {
    /// Whether the sensor is listened to.
    pub fn feels(self) -> bool {
        self != Architecture::PureSoftware
    }

    /// Whether the virtual contact acts.
    pub fn computes(self) -> bool {
        self != Architecture::PureHardware
    }
}

/// The pose that the virtual contact penetrates. It sets the delay of the virtual part of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VirtualPose {
    /// The measured pose: late by the robot and by the read-back (32 ms at the facility).
    #[default]
    Measured,
    /// An estimate of the pose that the robot has now: late by the robot alone (16 ms).
    Estimated(PositionEstimator),
    /// The commanded pose: not late.
    Commanded,
}

impl VirtualPose {
    /// Refuses an estimator without meaning.
    pub fn check(&self, period_s: f64) -> Result<(), Refusal> {
        match self {
            VirtualPose::Estimated(estimator) => estimator.check(period_s),
            VirtualPose::Measured | VirtualPose::Commanded => Ok(()),
        }
    }
}
