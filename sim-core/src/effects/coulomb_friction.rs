//! Dry friction in the device or the axis: `f += F_c tanh(d' / v_s)`, in contact only where the law is one-sided.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | F_c | friction force | N | fitted |
//! | d' | rate of penetration | m/s | |
//! | v_s | smoothing speed; 1 mm/s unless it is given | m/s | about 1/35 of the impact speed of the thesis (chosen) |
//!
//! Not modelled: breakaway, Stribeck. Confused with: hysteresis (rounded corners), damping at one speed.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct CoulombFriction {
    force_n: f64,
    smoothing_m_per_s: f64,
}

impl Effect<Axis> for CoulombFriction {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        out.dissipative += self.force_n * libm::tanh(seen.touch.rate_m_per_s / self.smoothing_m_per_s);
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "coulomb-friction".into(),
        about: "dry friction: a constant force against the motion".into(),
        fingerprint: "the missing force resists in both directions with the same size, whatever the depth and the speed".into(),
        experiment: "impacts at two approach speeds: friction keeps its size, damping grows with the speed".into(),
        wires: vec![Wire::Contact],
        order: 40,
        family: Family::Contact,
        rigs: Where::Both,
        params: vec![
            Param::new("force_n", "N", [0.0, 0.0, 1e4], 0.1, &[0.3]),
            Param::new("smoothing_m_per_s", "m/s", [1e-4, 0.001, 0.01], 1e-4, &[0.001]).or(0.001),
        ],
        verified: Verified::Foreign("data/hidden-effect d2; EMPS drive"),
        build: Arc::new(|values| Box::new(CoulombFriction { force_n: values[0], smoothing_m_per_s: values[1] })),
    }
}
