//! A wrong gauge factor: `y = s u`, where u is the whole reading.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | s | ratio of reading to truth | 1 | fitted; 0.97 to 1.03 is the usual range; 0.2248 is N read as lbf |
//! | u | reading without it: contact, weight and known bias | N | |
//!
//! The known bias is electronic and would not be scaled, but this wire carries only the sum. So the known bias c is scaled too,
//! which shows as a constant offset (s - 1) c; biases that other effects add come after it and are not scaled.
//!
//! The satellites integrate the same reading, so that the block of the software is blind to it. Not modelled: crosstalk, a
//! factor that depends on the sign. Confused with: wrong stiffness and damping by the same ratio; only a known weight or an
//! independently known stiffness tells them apart.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ForceScale {
    scale_ratio: f64,
}

impl Effect<Axis> for ForceScale {
    fn sensed(&self, _context: Context<'_>, _seen: &Signals<Axis>, out: &mut f64) {
        *out *= self.scale_ratio;
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "force-scale".into(),
        about: "the force reading is too large or too small by a factor".into(),
        fingerprint: "the missing force is a fixed share of the reading, in contact and in the tool's weight alike".into(),
        experiment: "hang a known weight; without a known weight or an independent stiffness it cannot be identified".into(),
        wires: vec![Wire::Sensed],
        order: 30,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![Param::new("scale_ratio", "1", [0.1, 1.0, 10.0], 0.005, &[1.02, 0.98])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ForceScale { scale_ratio: values[0] })),
    }
}
