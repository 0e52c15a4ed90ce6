//! Lost packets: at each tick the link is either fine or in a loss; while it is in a loss, the last packet counts.
//!
//! `P(fine → loss) = p`, `P(loss → fine) = q`; a share `p / (p + q)` of the packets is lost, in runs of `1 / q` on average.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | p | probability that a loss begins at a tick | 1 | fitted; 0 to 5 % of packets is the usual range |
//! | q | probability that it ends at a tick | 1 | fitted; 1 - p makes losses independent |
//!
//! The packet before the first tick is the first command. Not modelled: a robot that stops after too many losses, extrapolation
//! by the robot, losses on the way back. Confused with: jitter, and on average with a delay of `T (p / (p + q)) / q`.

use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{Received, Signals, Wire};
use crate::space::{Axis, AxisMotion};
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct CommandLoss {
    probability_in: f64,
    probability_out: f64,
}

impl Effect<Axis> for CommandLoss {
    /// Whether it is in a loss, then the last packet.
    fn memory(&self, _rates: &Rates) -> usize {
        6
    }

    fn begin(&self, memory: &mut [f64], _rates: &Rates, first: &Signals<Axis>) {
        memory[0] = 0.0;
        store(&mut memory[1..], &first.received.motion);
    }

    fn received(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut Received<Axis>) {
        let was_lost = context.memory[0] > 0.0;
        let drawn = context.random.uniform();
        let lost = if was_lost { drawn >= self.probability_out } else { drawn < self.probability_in };
        context.memory[0] = if lost { 1.0 } else { 0.0 };
        let last = &mut context.memory[1..];
        if lost {
            out.motion = load(last);
            out.lost = true;
        } else {
            store(last, &out.motion);
        }
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

fn store(numbers: &mut [f64], motion: &AxisMotion) {
    numbers[0] = motion.position_m;
    numbers[1] = motion.velocity_m_per_s;
    numbers[2] = motion.acceleration_m_per_s2;
    numbers[3] = motion.pitch_rad;
    numbers[4] = motion.pitch_rate_rad_per_s;
}

fn load(numbers: &[f64]) -> AxisMotion {
    AxisMotion {
        position_m: numbers[0],
        velocity_m_per_s: numbers[1],
        acceleration_m_per_s2: numbers[2],
        pitch_rad: numbers[3],
        pitch_rate_rad_per_s: numbers[4],
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "command-loss".into(),
        about: "packets to the robot get lost, alone or in bursts, and the last one counts".into(),
        fingerprint: "the pose stands still for whole ticks and then catches up in one step, at random times".into(),
        experiment: "free flight at constant speed for a minute: count the ticks in which the reported pose stands still".into(),
        wires: vec![Wire::Received],
        order: 30,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![
            Param::new("probability_in", "1", [0.0, 0.0, 1.0], 0.01, &[0.02]),
            Param::new("probability_out", "1", [0.01, 1.0, 1.0], 0.1, &[0.9, 0.3]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(CommandLoss { probability_in: values[0], probability_out: values[1] })),
    }
}
