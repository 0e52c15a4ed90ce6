//! Compensation of the loop's delay: one method per file, all behind one trait.
//!
//! A method may act at two places: on the felt force, before the virtual contact is added, and on the command, before the robot
//! gets it. Each file says what the method is good for and how it fails; the numbers are those of the loop that
//! `tests/it/compensators.rs` runs: 63.2 kg on a spring of 1066 N/m behind 36 ms, 35 mm/s, where restitution without compensation is
//! 1.276 instead of 1.
//!
//! Wave variables are not here: they need a robot that answers to a wave instead of a position, and the facility's do not.

use crate::refusal::Refusal;
use crate::space::AxisMotion;

mod energy_tank;
mod extrapolation;
mod identified_response;
mod method;
mod passivity;
mod phase_lead;
mod response_error;
pub(crate) mod ring;
mod smith_lead;
mod smith_predictor;
mod uncompensated;
mod virtual_damping;
pub use energy_tank::{EnergyTank, EnergyTankState};
pub use extrapolation::{Extrapolation, ExtrapolationState, Order};
pub use identified_response::{IdentifiedResponse, IdentifiedResponseState};
pub use method::{Compensation, CompensationState};
pub use passivity::{Passivity, PassivityState, Side};
pub use phase_lead::{PhaseLead, PhaseLeadState};
pub use response_error::{ResponseError, ResponseErrorState};
pub use ring::{Ring, TICKS_BACK};
pub use smith_lead::{SmithLead, SmithLeadState};
pub use smith_predictor::{SmithPredictor, SmithPredictorState};
pub use uncompensated::Uncompensated;
pub use virtual_damping::VirtualDamping;

/// What a compensation hears at a tick of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// Force of the real contact as the sensor feels it, in N; positive resists closing, 0 outside contact.
    pub force_n: f64,
    /// The motion that was commanded at this tick.
    pub commanded: AxisMotion,
    /// The newest pose that the robot controller reports.
    pub measured: AxisMotion,
    /// Tick of the loop.
    pub period_s: f64,
}

/// A way to make up for the delay of the loop.
pub trait DelayCompensation: Send + Sync {
    /// What changes from tick to tick.
    type State: Clone + Send;
    /// Before the first tick.
    fn start(&self, period_s: f64) -> Self::State;
    /// Refuses what has no meaning at this tick of the loop.
    fn check(&self, period_s: f64) -> Result<(), Refusal>;
    /// The force that the satellites should feel, in N.
    fn force_n(&self, state: &mut Self::State, felt: &Felt) -> f64;
    /// What the robot is told when the satellites ask for `asked`.
    fn command(&self, _state: &mut Self::State, asked: &AxisMotion, _period_s: f64) -> AxisMotion {
        *asked
    }
}
