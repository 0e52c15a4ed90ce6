//! The reported pose is older than the read-back declares: `x_m(t) = x_a(t - D - δ)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | D | delay of the read-back in the model | s | model |
//! | δ | extra delay | s | fitted; 4 to 24 ms is the usual range |
//!
//! A whole number of physics steps is exact; between steps the history is a straight line. A negative δ moves the pose on along
//! its own velocity, which is exact only where the pose is straight: a better model has a smaller D instead.
//!
//! Not modelled: jitter of the read-back. Confused with: a viscous damper of k δ, when reading and pose are compared at one
//! instant; a clock offset of -δ; and {this together with force delay δ} is {command delay δ}, to the last bit.

use crate::delay;
use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::{Axis, AxisMotion, Path};
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

/// How many numbers a motion has, and so how many lines are kept.
const LINES: usize = 5;

struct MeasurementDelay {
    delay_s: f64,
}

impl Effect<Axis> for MeasurementDelay {
    /// One line for each number of the motion.
    fn memory(&self, rates: &Rates) -> usize {
        LINES * delay::slots(self.delay_s, rates.physics_step.seconds())
    }

    fn measured(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut AxisMotion) {
        if self.delay_s < 0.0 {
            *out = out.coasted(-self.delay_s);
            return;
        }
        let dt_s = context.step.dt.seconds();
        let length = context.memory.len() / LINES;
        if context.step.index == 0 {
            // Only now is it known what the other effects on this wire make of the first pose.
            for (i, line) in context.memory.chunks_exact_mut(length).enumerate() {
                delay::fill(line, |age| numbers(&out.coasted(-((age + 1) as f64) * dt_s))[i]);
            }
        }
        let mut read = numbers(out);
        for (number, line) in read.iter_mut().zip(context.memory.chunks_exact_mut(length)) {
            *number = delay::push_and_read(line, *number, delay::steps(self.delay_s, dt_s));
        }
        let [position_m, velocity_m_per_s, acceleration_m_per_s2, pitch_rad, pitch_rate_rad_per_s] = read;
        *out = AxisMotion { position_m, velocity_m_per_s, acceleration_m_per_s2, pitch_rad, pitch_rate_rad_per_s };
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

fn numbers(motion: &AxisMotion) -> [f64; LINES] {
    [
        motion.position_m,
        motion.velocity_m_per_s,
        motion.acceleration_m_per_s2,
        motion.pitch_rad,
        motion.pitch_rate_rad_per_s,
    ]
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "measurement-delay".into(),
        about: "the robot controller reports a pose that is older than the read-back declares".into(),
        fingerprint: "the reported pose trails the command by a constant time more, and the force comes before the depth".into(),
        experiment: "a laser tracker on the tool, or a tap on the sensor while the robot moves".into(),
        wires: vec![Wire::Measured],
        order: 10,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![Param::new("delay_s", "s", [-0.05, 0.0, 0.2], 1e-3, &[0.003, -0.003])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(MeasurementDelay { delay_s: values[0] })),
    }
}
