//! Hysteresis after Dahl (Bouc-Wen with n = 1): `f += F z`, `dz/dd = (1 - z sgn d') / ℓ`, in contact.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | F | force of a fully developed loop | N | fitted |
//! | ℓ | travel over which the force turns round | m | fitted |
//! | z | state of the loop, -1 to 1; 0 at touch | 1 | |
//! | d | penetration | m | |
//!
//! The force depends on the path, not on the speed. Each step is exact in its own travel: `z ← s + (z - s) exp(-|Δd| / ℓ)`, with
//! s the direction. It only ever absorbs energy, since z = 0 stores none and dz/dd ≥ 0.
//!
//! Not modelled: a memory that outlasts the contact, loops that change with depth. Confused with: dry friction, which it is for
//! small ℓ; a Maxwell branch, whose loop closes when pushed slowly.

use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct Hysteresis {
    force_n: f64,
    length_m: f64,
}

impl Effect<Axis> for Hysteresis {
    /// The state z and the depth of the step before.
    fn memory(&self, _rates: &Rates) -> usize {
        2
    }

    fn contact(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let depth_m = seen.touch.depth_m.max(0.0);
        if depth_m > 0.0 {
            let travel_m = depth_m - context.memory[1];
            let direction = if travel_m < 0.0 { -1.0 } else { 1.0 };
            let kept = libm::exp(-travel_m.abs() / self.length_m);
            context.memory[0] = direction + (context.memory[0] - direction) * kept;
        } else {
            context.memory[0] = 0.0;
        }
        context.memory[1] = depth_m;
        out.dissipative += self.force_n * context.memory[0];
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "hysteresis".into(),
        about: "the force depends on the path: it turns round over a certain travel".into(),
        fingerprint: "the missing force draws a loop over depth whose corners are round, the same at every speed".into(),
        experiment: "push in and out slowly, with small and with large travel: the loop stays however slow the push".into(),
        wires: vec![Wire::Contact],
        order: 40,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![
            Param::new("force_n", "N", [0.0, 0.0, 1e4], 0.1, &[0.3]),
            Param::new("length_m", "m", [1e-5, 1e-3, 0.02], 1e-4, &[5e-4, 1.5e-3]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(Hysteresis { force_n: values[0], length_m: values[1] })),
    }
}
