//! More dead time between command and robot than the link declares: `x_a(t) = x_c(t - h - δ)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | δ | extra delay | s | fitted |
//!
//! Not modelled: jitter. Confused with: {read-out delay δ together with force delay δ}, which gives the same log to the last
//! bit; a laser tracker on the robot would split them.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Received, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct CommandDelay {
    delay_s: f64,
}

impl Effect<Axis> for CommandDelay {
    fn received(&self, _context: Context<'_>, _seen: &Signals<Axis>, out: &mut Received<Axis>) {
        out.late_s += self.delay_s;
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "command-delay".into(),
        about: "the robot gets its commands later than the link declares".into(),
        fingerprint: "pose and force are both late by the same time, from the first instant of contact".into(),
        experiment: "a laser tracker on the tool: it splits a late robot from a late read-out with a late sensor".into(),
        wires: vec![Wire::Received],
        order: 10,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![Param::new("delay_s", "s", [-0.05, 0.0, 0.2], 1e-3, &[0.003, -0.003])],
        verified: Verified::Foreign("data/hidden-effect d3"),
        build: Arc::new(|values| Box::new(CommandDelay { delay_s: values[0] })),
    }
}
