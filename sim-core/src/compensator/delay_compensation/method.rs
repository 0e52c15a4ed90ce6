//! Any of the methods, as a model's file names it: `method = "phase-lead"`, then its parameters.

use super::{
    DelayCompensation, EnergyTank, Extrapolation, Felt, IdentifiedResponse, Passivity, PhaseLead, ResponseError,
    SmithLead, SmithPredictor, Uncompensated, VirtualDamping,
};
use crate::refusal::Refusal;
use crate::space::AxisMotion;
use serde::{Deserialize, Serialize};

/// Writes the list of methods once; it is asked once per tick of the loop which one it is.
macro_rules! methods {
    ($($(#[$doc:meta])* $name:ident($method:ty)),* $(,)?) => {
        /// A method, chosen at run time.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "method", rename_all = "kebab-case")]
        pub enum Compensation {
            $($(#[$doc])* $name($method)),*
        }

        /// The state of the method that was chosen.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum CompensationState {
            $($(#[$doc])* $name(<$method as DelayCompensation>::State)),*
        }

        impl DelayCompensation for Compensation {
            type State = CompensationState;

            fn start(&self, period_s: f64) -> CompensationState {
                match self {
                    $(Compensation::$name(method) => CompensationState::$name(method.start(period_s))),*
                }
            }

            fn check(&self, period_s: f64) -> Result<(), Refusal> {
                match self {
                    $(Compensation::$name(method) => method.check(period_s)),*
                }
            }

            fn force_n(&self, state: &mut CompensationState, felt: &Felt) -> f64 {
                match (self, state) {
                    $((Compensation::$name(method), CompensationState::$name(state)) => method.force_n(state, felt),)*
                    _ => unreachable!("a state belongs to the method that started it"),
                }
            }

            fn command(&self, state: &mut CompensationState, asked: &AxisMotion, period_s: f64) -> AxisMotion {
                match (self, state) {
                    $((Compensation::$name(method), CompensationState::$name(state)) => {
                        method.command(state, asked, period_s)
                    })*
                    _ => unreachable!("a state belongs to the method that started it"),
                }
            }
        }
    };
}

methods! {
    /// See [`Uncompensated`].
    None(Uncompensated),
    /// See [`VirtualDamping`].
    VirtualDamping(VirtualDamping),
    /// See [`PhaseLead`].
    PhaseLead(PhaseLead),
    /// See [`SmithPredictor`].
    SmithPredictor(SmithPredictor),
    /// See [`SmithLead`].
    SmithLead(SmithLead),
    /// See [`Extrapolation`].
    Extrapolation(Extrapolation),
    /// See [`ResponseError`].
    ResponseError(ResponseError),
    /// See [`IdentifiedResponse`].
    IdentifiedResponse(IdentifiedResponse),
    /// See [`Passivity`].
    Passivity(Passivity),
    /// See [`EnergyTank`].
    EnergyTank(EnergyTank),
}

impl Default for Compensation {
    fn default() -> Self {
        Compensation::None(Uncompensated)
    }
}
