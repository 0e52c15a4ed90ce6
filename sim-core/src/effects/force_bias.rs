//! A bias that nobody took out: `y = u + c`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | c | bias of the reading beyond the known one; positive pushes the probe along +z of the nozzle frame | N | fitted |
//! | u | reading without it | N | |
//!
//! Outside contact it accelerates the satellites by c / m as soon as it exceeds the compensator's dead band. Not modelled:
//! change with time, see the drift. Confused with: the weight of an undeclared tool at a single attitude; a gap of the contact,
//! which shows inside it only.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ForceBias {
    force_n: f64,
}

impl Effect<Axis> for ForceBias {
    fn sensed(&self, _context: Context<'_>, _seen: &Signals<Axis>, out: &mut f64) {
        *out += self.force_n;
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "force-bias".into(),
        about: "the force reading has a bias that was not taken out".into(),
        fingerprint: "the same force is missing always, in contact and outside it, at every speed".into(),
        experiment: "ten seconds at rest, out of contact, at two attitudes: a bias keeps its size, a weight does not".into(),
        wires: vec![Wire::Sensed],
        order: 40,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![Param::new("force_n", "N", [-1e3, 0.0, 1e3], 0.05, &[0.1, -0.1])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ForceBias { force_n: values[0] })),
    }
}
