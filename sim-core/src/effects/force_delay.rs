//! The reading is on its way for a while: `y(t) = u(t - δ)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | δ | transport delay of the reading | s | fitted; 0 to 8 ms is the usual range |
//! | u | reading without it | N | |
//!
//! A whole number of physics steps is exact; between steps the history is a straight line. It begins as if the first reading had
//! always been there. The sampling of the sensor adds up to one of its periods by itself.
//!
//! Not modelled: jitter. Confused with: a low-pass, which rounds the onset; a clock offset, which the satellites do not feel;
//! and {this together with measurement delay δ} is {command delay δ}, to the last bit.

use crate::delay;
use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ForceDelay {
    delay_s: f64,
}

impl Effect<Axis> for ForceDelay {
    fn memory(&self, rates: &Rates) -> usize {
        delay::slots(self.delay_s, rates.physics_step.seconds())
    }

    fn sensed(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut f64) {
        if context.step.index == 0 {
            // Only now is it known what the other effects on this wire make of the first reading.
            delay::fill(context.memory, |_age| *out);
        }
        let steps = delay::steps(self.delay_s, context.step.dt.seconds());
        *out = delay::push_and_read(context.memory, *out, steps);
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "force-delay".into(),
        about: "the force reading arrives late".into(),
        fingerprint: "the whole reading is late by the same time, its sharp onset included".into(),
        experiment: "a tap on the sensor while a second, direct channel (an accelerometer, a switch) records the tap".into(),
        wires: vec![Wire::Sensed],
        order: 90,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![Param::new("delay_s", "s", [0.0, 0.0, 0.1], 5e-4, &[0.002])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ForceDelay { delay_s: values[0] })),
    }
}
