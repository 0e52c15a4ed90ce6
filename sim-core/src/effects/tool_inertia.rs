//! Mass between sensor and contact that the sensor's electronics does not know: `y = u - m_t a`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | m_t | undeclared mass of the tool | kg | fitted |
//! | a | achieved acceleration of the robot, positive along +z | m/s² | |
//! | u | reading without it | N | |
//!
//! Sign: the reading is the force on the probe, and the flange has to push the mass along +z to accelerate it so. It acts before
//! the sensor's own filters. It needs no contact. With m_t near the reduced mass the delayed loop diverges even in free flight.
//!
//! Not modelled: its weight (see the tool's weight in the model), its inertia about the sensor. Confused with: a smaller
//! stiffness, k m / (m + m_t), in contact alone.

use crate::effect::{Context, Effect, Family, Kind, Param, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ToolInertia {
    mass_kg: f64,
}

impl Effect<Axis> for ToolInertia {
    fn sensed(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut f64) {
        *out -= self.mass_kg * seen.achieved.acceleration_m_per_s2;
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "tool-inertia".into(),
        about: "the tool is heavier than the sensor's electronics was told".into(),
        fingerprint: "the missing force follows the acceleration of the robot, in contact and in free flight alike".into(),
        experiment: "shake the tool in free space at 10 Hz: nothing but its inertia can make the reading follow".into(),
        wires: vec![Wire::Sensed],
        order: 10,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![Param::new("mass_kg", "kg", [0.0, 0.0, 100.0], 0.1, &[1.0])],
        verified: Verified::Foreign("data/hidden-effect d5"),
        build: Arc::new(|values| Box::new(ToolInertia { mass_kg: values[0] })),
    }
}
