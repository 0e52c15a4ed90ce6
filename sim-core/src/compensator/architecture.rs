//! The three architectures of thesis Fig. 3.1, and the pose on which a virtual contact acts.
//!
//! Where the loop is neutral depends on both. For 63.2 kg, 1066 N/m, 16 ms there and 16 ms back, a tick of 4 ms and a damping on
//! the measured pose (computed by `tests/it/compensators/pattern.rs`, equal to `reference/PHYSICS.md`, section 2.2):
//!
//! | stiffness | integrator | a pose is valid | neutral damping in N s/m |
//! |---|---|---|---|
//! | virtual, measured pose | exact hold | at the end of the tick | 40.90 |
//! | virtual, measured pose | semi-implicit | at the end of the tick | 38.71 |
//! | virtual, measured pose | semi-implicit | a tick late | 43.10 |
//! | virtual, measured pose | exact hold | before the step | 36.53 |
//! | hardware | exact hold | before the step | 19.38 |
//! | hardware | semi-implicit to explicit | at the end of the tick | 21.56 to 25.93 |
//!
//! The captions of thesis Fig. 4.12 and 4.13 call 0 and 20 N s/m active, 40 approximately neutral, 70 passive, and do not say
//! for which loop. That it was the first one is a hypothesis. 'Before the step' is what [`crate::closed_loop`] does: the pose of
//! a tick is there for that tick's reading. 'At the end of the tick' it leaves after that reading, and counts one tick later.

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
