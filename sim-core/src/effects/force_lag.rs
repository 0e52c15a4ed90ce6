//! A low-pass in the force sensor: one pole, `τ y' = u - y`, or two equal ones, with `τ = 1 / (2π f_c)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | f_c | corner frequency of each pole | Hz | fitted; 10 to 500 Hz is the usual range |
//! | order | number of poles, 1 or 2 | 1 | chosen |
//! | u | reading without it | N | straight between physics steps |
//! | y | reading with it | N | |
//!
//! Each step is exact: on a line of slope s the reading tends to `u - order τ s`, and the deviation from that dies freely. It
//! begins as if the first reading had always been there. From 10 kHz on it is the identity.
//!
//! Not modelled: under-damped filters, aliasing. Confused with: a force delay of order × τ, which shifts the onset instead of
//! rounding it; in slow contact both are an active -k τ of damping.

use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;
use core::f64::consts::PI;

/// From this corner frequency on, the reading follows at once. Chosen: τ is 1/30 of a physics step of 0.5 ms.
const IMMEDIATE_HZ: f64 = 1e4;

struct ForceLag {
    corner_frequency_hz: f64,
    two_poles: bool,
}

impl Effect<Axis> for ForceLag {
    /// What is left of a deviation after one step, then input, output and rate of the output, and the length of a step in s.
    fn memory(&self, _rates: &Rates) -> usize {
        5
    }

    fn sensed(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut f64) {
        if self.corner_frequency_hz >= IMMEDIATE_HZ {
            return;
        }
        let corner_rad_per_s = 2.0 * PI * self.corner_frequency_hz;
        let memory = context.memory;
        if context.step.index == 0 {
            let dt_s = context.step.dt.seconds();
            // Only now is it known what the other effects on this wire make of the first reading.
            memory.copy_from_slice(&[libm::exp(-dt_s * corner_rad_per_s), *out, *out, 0.0, dt_s]);
        }
        let (kept, input, dt_s) = (memory[0], *out, memory[4]);
        let slope = (input - memory[1]) / dt_s;
        let lag = slope / corner_rad_per_s;
        if self.two_poles {
            let (deviation, rate) = (memory[2] - (memory[1] - 2.0 * lag), memory[3] - slope);
            let drive = rate + corner_rad_per_s * deviation;
            memory[2] = input - 2.0 * lag + kept * (deviation + drive * dt_s);
            memory[3] = slope + kept * (rate - corner_rad_per_s * drive * dt_s);
        } else {
            memory[2] = input - lag + kept * (memory[2] - (memory[1] - lag));
        }
        memory[1] = input;
        *out = memory[2];
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "force-lag".into(),
        about: "a low-pass in the force sensor".into(),
        fingerprint: "the reading trails the force and rounds its onset, and its noise is coloured".into(),
        experiment: "a tap on the sensor at rest: a low-pass rounds the edge, a transport delay only shifts it".into(),
        wires: vec![Wire::Sensed],
        order: 20,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![
            Param::new("corner_frequency_hz", "Hz", [1.0, IMMEDIATE_HZ, IMMEDIATE_HZ], 1.0, &[15.0, 40.0]),
            Param::choice("order", "1", 1.0, &[1.0, 2.0]).or(1.0),
        ],
        verified: Verified::Foreign("data/hidden-effect d4"),
        build: Arc::new(|values| {
            Box::new(ForceLag { corner_frequency_hz: values[0], two_poles: values[1] > 1.5 })
        }),
    }
}
