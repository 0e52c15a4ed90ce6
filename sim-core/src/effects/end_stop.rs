//! An end stop: a second spring from a certain depth on, `f += k₂ max(0, d - d₁)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | d₁ | depth at which it is reached | m | fitted; 3 to 10 mm is the usual range |
//! | k₂ | stiffness of the stop | N/m | fitted; 1 to 50 kN/m is the usual range |
//! | d | penetration | m | |
//!
//! A recording that never gets as deep as d₁ says nothing about k₂. With a delay in the loop a stiff stop creates energy, though
//! the spring itself does not. Not modelled: damping of the stop. Confused with: cubic hardening, power law, which have no
//! kink.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct EndStop {
    depth_m: f64,
    stiffness_n_per_m: f64,
}

impl Effect<Axis> for EndStop {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        out.elastic += self.stiffness_n_per_m * (seen.touch.depth_m - self.depth_m).max(0.0);
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "end-stop".into(),
        about: "the device hits a stop at a certain depth".into(),
        fingerprint: "nothing is missing up to a certain depth, and from there on the force grows along a second line".into(),
        experiment: "a slow push to full depth, or impacts at rising speed: the kink stays at its depth".into(),
        wires: vec![Wire::Contact],
        order: 20,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![
            Param::new("depth_m", "m", [0.0, 0.005, 0.05], 1e-4, &[0.003, 0.006, 0.01]),
            Param::new("stiffness_n_per_m", "N/m", [0.0, 0.0, 1e7], 100.0, &[2e3]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(EndStop { depth_m: values[0], stiffness_n_per_m: values[1] })),
    }
}
