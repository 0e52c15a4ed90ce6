//! Damping that grows with depth, after Hunt and Crossley: `f += c d d'` while d > 0.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | c | damping for each metre of depth | N s/m² | fitted |
//! | d | penetration | m | |
//! | d' | its rate | m/s | |
//!
//! It starts and ends at zero force, which a dashpot does not. Their law has the elastic term's own exponent; here it is 1.
//! Restitution falls with the approach speed, `e ≈ 1 - α v`. Not modelled: other exponents. Confused with: plain damping at one
//! speed, hysteresis.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct HuntCrossley {
    damping_n_s_per_m2: f64,
}

impl Effect<Axis> for HuntCrossley {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let touch = &seen.touch;
        if touch.depth_m > 0.0 {
            out.dissipative += self.damping_n_s_per_m2 * touch.depth_m * touch.rate_m_per_s;
        }
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "hunt-crossley".into(),
        about: "damping that grows with the depth".into(),
        fingerprint: "the missing force resists in both directions, grows with depth times speed, and is zero at touch".into(),
        experiment: "impacts at three or more approach speeds: restitution falls with the speed, while plain damping keeps it".into(),
        wires: vec![Wire::Contact],
        order: 40,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![Param::new("damping_n_s_per_m2", "N s/m^2", [0.0, 0.0, 1e7], 300.0, &[1e3])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(HuntCrossley { damping_n_s_per_m2: values[0] })),
    }
}
