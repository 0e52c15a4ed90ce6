//! A robot that follows like a mass on a spring: `x'' = ωₙ² (u - x) - 2 ζ ωₙ x'`, in position and in pitch.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | u | pose that the robot would have without it | m, rad | straight between physics steps |
//! | x | pose that it has | m, rad | |
//! | ωₙ | natural frequency, 2π times the one in Hz | rad/s | fitted; 3 to 15 Hz is the usual range |
//! | ζ | damping ratio | 1 | fitted; 0.05 to 0.8 is the usual range |
//!
//! Each step is exact: on a straight line of slope s the pose tends to `u - 2 ζ s / ωₙ`, and the deviation from that moves
//! freely. It begins as if it had followed the first line for ever. From 10 kHz on it is the identity.
//!
//! Not modelled: saturation of speed and acceleration, the arm's yielding to the contact force. Confused with: command delay,
//! which neither rings nor overshoots; slow contact shows only the lag 2 ζ / ωₙ of both.

use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::{Axis, AxisMotion};
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;
use core::f64::consts::PI;

/// From this natural frequency on, the robot follows at once. Chosen: its lag is 1/20 of a physics step of 0.5 ms.
const IMMEDIATE_HZ: f64 = 1e4;

struct RobotSecondOrder {
    natural_frequency_hz: f64,
    damping_ratio: f64,
}

impl RobotSecondOrder {
    fn natural_rad_per_s(&self) -> f64 {
        2.0 * PI * self.natural_frequency_hz
    }

    /// Free motion for `dt_s`: what becomes of a deviation and of its rate, row by row.
    fn free_motion(&self, dt_s: f64) -> [f64; 4] {
        let natural = self.natural_rad_per_s();
        let decay = self.damping_ratio * natural;
        let discriminant = 1.0 - self.damping_ratio * self.damping_ratio;
        let own = natural * libm::sqrt(discriminant.abs());
        let (even, odd) = if discriminant > 0.0 {
            (libm::cos(own * dt_s), libm::sin(own * dt_s) / own)
        } else if discriminant < 0.0 {
            (libm::cosh(own * dt_s), libm::sinh(own * dt_s) / own)
        } else {
            (1.0, dt_s)
        };
        let left = libm::exp(-decay * dt_s);
        [
            left * (even + decay * odd),
            left * odd,
            -left * natural * natural * odd,
            left * (even - decay * odd),
        ]
    }

    /// One step of one coordinate, whose memory is (input, pose, rate): the pose and its rate and acceleration.
    fn follow(&self, free: &[f64], memory: &mut [f64], input: f64, dt_s: f64) -> [f64; 3] {
        let natural = self.natural_rad_per_s();
        let slope = (input - memory[0]) / dt_s;
        let lag = 2.0 * self.damping_ratio / natural * slope;
        let (deviation, rate) = (memory[1] - (memory[0] - lag), memory[2] - slope);
        memory[0] = input;
        memory[1] = input - lag + free[0] * deviation + free[1] * rate;
        memory[2] = slope + free[2] * deviation + free[3] * rate;
        let acceleration = natural * natural * (input - memory[1]) - 2.0 * self.damping_ratio * natural * memory[2];
        [memory[1], memory[2], acceleration]
    }
}

impl Effect<Axis> for RobotSecondOrder {
    /// The free motion over one step, then (input, pose, rate) of position and pitch.
    fn memory(&self, _rates: &Rates) -> usize {
        10
    }

    fn achieved(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut AxisMotion) {
        if self.natural_frequency_hz >= IMMEDIATE_HZ {
            return;
        }
        let dt_s = context.step.dt.seconds();
        let (free, both) = context.memory.split_at_mut(4);
        let (position, pitch) = both.split_at_mut(3);
        if context.step.index == 0 {
            // Only now is it known what the other effects on this wire make of the first pose.
            free.copy_from_slice(&self.free_motion(dt_s));
            let lag_s = 2.0 * self.damping_ratio / self.natural_rad_per_s();
            let steady = |input: f64, rate: f64| {
                let before = input - rate * dt_s;
                [before, before - lag_s * rate, rate]
            };
            position.copy_from_slice(&steady(out.position_m, out.velocity_m_per_s));
            pitch.copy_from_slice(&steady(out.pitch_rad, out.pitch_rate_rad_per_s));
        }
        let [position_m, velocity_m_per_s, acceleration_m_per_s2] = self.follow(free, position, out.position_m, dt_s);
        let [pitch_rad, pitch_rate_rad_per_s, _] = self.follow(free, pitch, out.pitch_rad, dt_s);
        *out = AxisMotion { position_m, velocity_m_per_s, acceleration_m_per_s2, pitch_rad, pitch_rate_rad_per_s };
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "robot-second-order".into(),
        about: "the robot follows its commands with a natural frequency and a damping ratio".into(),
        fingerprint: "the pose is late and overshoots or rings when the speed changes, at a frequency of its own".into(),
        experiment: "a step and a sine sweep of the command in free space: the phase of a delay is straight, this one bends".into(),
        wires: vec![Wire::Achieved],
        order: 10,
        family: Family::Robot,
        rigs: Where::Docking,
        params: vec![
            Param::new("natural_frequency_hz", "Hz", [1.0, IMMEDIATE_HZ, IMMEDIATE_HZ], 0.5, &[5.0, 10.0, 20.0]),
            Param::new("damping_ratio", "1", [0.02, 0.7, 2.0], 0.05, &[0.3, 0.7]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| {
            Box::new(RobotSecondOrder { natural_frequency_hz: values[0], damping_ratio: values[1] })
        }),
    }
}
