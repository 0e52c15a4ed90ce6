//! Hardening: a spring that grows stiffer with depth, `f += k₃ d³`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | k₃ | cubic stiffness | N/m³ | fitted |
//! | d | penetration | m | |
//!
//! Not modelled: softening (k₃ < 0), a hard stop. Confused with: power law, end stop, Hertz; at one approach speed all of them
//! look the same.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct StiffnessHardening {
    cubic_n_per_m3: f64,
}

impl Effect<Axis> for StiffnessHardening {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let depth_m = seen.touch.depth_m;
        out.elastic += self.cubic_n_per_m3 * depth_m * depth_m * depth_m;
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "stiffness-hardening".into(),
        about: "the device grows stiffer with the cube of its depth".into(),
        fingerprint: "the missing force has the same sign going in and coming out, and grows with the cube of the depth".into(),
        experiment: "impacts at three or more approach speeds, the fastest at least twice the slowest".into(),
        wires: vec![Wire::Contact],
        order: 20,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![Param::new("cubic_n_per_m3", "N/m^3", [0.0, 0.0, 1e12], 1e6, &[3e6])],
        verified: Verified::Foreign("data/hidden-effect d1, d6"),
        build: Arc::new(|values| Box::new(StiffnessHardening { cubic_n_per_m3: values[0] })),
    }
}
