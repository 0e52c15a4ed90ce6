//! Which recorded wire the blocks start from.
//!
//! Everything upstream of a clamped wire is taken from the recording, so that a misfit behind it belongs to what follows. An
//! effect at or upstream of the clamp could not act: it is an error, not a silence.

use crate::blocks::{self, Path};
use crate::case::Case;
use crate::error::Error;
use crate::model::{Chosen, Model};
use serde::Serialize;
use sim_core::signals::Wire;
use sim_core::space::AxisMotion;

/// A wire that is taken from the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Clamp {
    /// The commanded pose: link, robot, read-out, contact and sensor are under test.
    #[default]
    Commanded,
    /// The achieved pose, taken as the reported one without its declared delay: contact and sensor are under test.
    Achieved,
}

impl Clamp {
    /// Refuses an effect that the clamp would silence.
    pub fn check(self, effects: &[Chosen]) -> Result<(), Error> {
        let silenced = |wire: &Wire| self == Clamp::Achieved && matches!(wire, Wire::Received | Wire::Achieved);
        match effects.iter().find(|chosen| chosen.kind.wires.iter().any(silenced)) {
            None => Ok(()),
            Some(chosen) => {
                let wires: Vec<&str> = chosen.kind.wires.iter().map(|wire| wire.name()).collect();
                let what = format!(
                    "effect {} acts on the wire {}, which is clamped to the recording",
                    chosen.kind.id,
                    wires.join(", ")
                );
                Err(Error::new(what).place("--clamp achieved").help(format!(
                    "take the effect out (dockhil effect remove {} --model MODEL.toml), or clamp further upstream: --clamp commanded",
                    chosen.kind.id
                )))
            }
        }
    }

    /// The robot's path of a run that starts from this wire.
    pub fn path(self, model: &Model, case: &Case) -> Path {
        match self {
            Clamp::Commanded => blocks::path(model, case, &[], None),
            Clamp::Achieved => reported(model, case),
        }
    }
}

/// The reported pose without its declared delay, on straight lines between reports. Its velocity and acceleration carry the
/// read-out noise.
fn reported(model: &Model, case: &Case) -> Path {
    let period_s = case.rates.loop_period.seconds();
    let measured_m = &case.measured_m.value;
    let steps = (case.until.0 / case.rates.physics_step.0) as usize;
    let last = measured_m.len() - 1;
    let rate = |tick: usize| if tick == 0 { 0.0 } else { (measured_m[tick] - measured_m[tick - 1]) / period_s };
    let at = |step: usize| {
        let time_s = step as f64 * case.rates.physics_step.seconds() + model.timing.measurement_delay_s;
        let place = (time_s / period_s).clamp(0.0, last as f64);
        let tick = (libm::ceil(place) as usize).clamp(1, last);
        let share = place - (tick - 1) as f64;
        let commanded = case.commanded
            [(step as i64 * case.rates.physics_step.0 / case.rates.loop_period.0) as usize % case.commanded.len()];
        AxisMotion {
            position_m: measured_m[tick - 1] + (measured_m[tick] - measured_m[tick - 1]) * share,
            velocity_m_per_s: rate(tick),
            acceleration_m_per_s2: (rate(tick) - rate(tick - 1)) / period_s,
            ..commanded
        }
    };
    Path { achieved: (0..steps).map(at).collect(), measured_m: measured_m.clone() }
}
