//! Jitter: each packet takes effect at its own time, `h + σ n` after it was issued, n standard normal and independent.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | σ | standard deviation of the lateness | s | fitted; 0.5 to 4 ms is the usual range |
//!
//! A packet may be early, but never overtakes the one before it: the robot makes it wait. From σ of about half a tick on, this
//! alone makes the mean later. Not modelled: bursts, a floor that lateness cannot go below. Confused with: read-out noise,
//! which does not vanish at rest; lost packets, which come in whole ticks.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Received, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct CommandJitter {
    sigma_s: f64,
}

impl Effect<Axis> for CommandJitter {
    fn received(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut Received<Axis>) {
        out.late_s += self.sigma_s * context.random.normal();
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "command-jitter".into(),
        about: "the time after which a command takes effect varies from packet to packet".into(),
        fingerprint: "the noise of the pose grows with the speed and vanishes at rest".into(),
        experiment: "free flight at two speeds and ten seconds at rest: jitter scales with the speed, read-out noise stays".into(),
        wires: vec![Wire::Received],
        order: 20,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![Param::new("sigma_s", "s", [0.0, 0.0, 0.02], 1e-3, &[1e-3])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(CommandJitter { sigma_s: values[0] })),
    }
}
