//! Viscous friction that differs by direction: `f += c d'` while d' < 0.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | c | damping that the way back has beyond the way there; may be negative | N s/m | fitted |
//! | d' | rate of the position | m/s | |
//!
//! Passive as long as the law's own damping plus c is not negative. Not modelled: dry friction that differs by direction.
//! Confused with: dry friction and a constant force, at one speed.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct AsymmetricDamping {
    damping_n_s_per_m: f64,
}

impl Effect<Axis> for AsymmetricDamping {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        out.dissipative += self.damping_n_s_per_m * seen.touch.rate_m_per_s.min(0.0);
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "asymmetric-damping".into(),
        about: "viscous friction that differs between there and back".into(),
        fingerprint: "the missing force grows with the speed in one direction, and is zero in the other".into(),
        experiment: "constant speeds in both directions, at three or more speeds each".into(),
        wires: vec![Wire::Contact],
        order: 40,
        family: Family::Contact,
        rigs: Where::Drive,
        params: vec![Param::new("damping_n_s_per_m", "N s/m", [-1e5, 0.0, 1e5], 1.0, &[10.0, -10.0])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(AsymmetricDamping { damping_n_s_per_m: values[0] })),
    }
}
