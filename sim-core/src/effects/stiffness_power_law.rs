//! A spring that follows a power of the depth: the nominal `k d` becomes `k d (d / d₀)ⁿ⁻¹` while d > 0.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | n | exponent; 1 is linear, 1.5 is Hertz | 1 | fitted |
//! | d | penetration | m | |
//! | d₀ | depth at which both springs agree, 5 mm | m | about half the depth of the thesis' impacts (chosen, not measured) |
//!
//! With d₀ in the middle of the data, exponent and stiffness are nearly independent in a fit. It scales the nominal term only,
//! so it acts before every effect that adds one. Not modelled: a change of exponent with depth. Confused with: cubic
//! hardening, end stop; at one approach speed all of them look the same.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

/// Depth d₀ at which both springs agree; see the table above.
const REFERENCE_DEPTH_M: f64 = 0.005;

struct StiffnessPowerLaw {
    exponent: f64,
}

impl Effect<Axis> for StiffnessPowerLaw {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let depth_m = seen.touch.depth_m;
        if depth_m > 0.0 {
            out.elastic *= libm::pow(depth_m / REFERENCE_DEPTH_M, self.exponent - 1.0);
        }
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "stiffness-power-law".into(),
        about: "the elastic force follows a power of the depth other than one".into(),
        fingerprint: "the missing force is the same going in and coming out, and changes its sign at a fixed depth".into(),
        experiment: "impacts at three or more approach speeds, or a slow push with a force reading at each depth".into(),
        wires: vec![Wire::Contact],
        order: 10,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![Param::new("exponent", "1", [0.5, 1.0, 3.0], 0.02, &[1.1, 0.9])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(StiffnessPowerLaw { exponent: values[0] })),
    }
}
