//! A tool that weighs something else than the model says: `y = u + m g sin θ`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | m | true mass of the tool less the model's | kg | fitted |
//! | g | standard gravity, 9.80665 | m/s² | CGPM 1901 |
//! | θ | achieved rotation about +x of the nozzle frame | rad | |
//! | u | reading without it | N | |
//!
//! The axis of travel is horizontal: only a tool that is turned feels its weight along it.
//!
//! Not modelled: its inertia (`tool-inertia`), the torque of its centre of mass. Confused with: the weight's own scale, where nothing
//! touches (`force-scale`).

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::force_sensor::GRAVITY_M_PER_S2;
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ToolWeight {
    mass_kg: f64,
}

impl Effect<Axis> for ToolWeight {
    fn sensed(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut f64) {
        *out += self.mass_kg * GRAVITY_M_PER_S2 * libm::sin(seen.achieved.pitch_rad);
    }

    fn reads(&self) -> Reads {
        Reads::Motions
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "tool-weight".into(),
        about: "the tool weighs something else than the model says".into(),
        fingerprint: "the missing force follows the attitude of the tool, at rest too".into(),
        experiment: "turn the tool at rest to several attitudes (dockhil calibrate ft): its weight follows the sine".into(),
        wires: vec![Wire::Sensed],
        order: 10,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![Param::new("mass_kg", "kg", [-100.0, 0.0, 100.0], 0.1, &[0.5, -0.5])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ToolWeight { mass_kg: values[0] })),
    }
}
