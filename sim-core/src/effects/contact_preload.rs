//! A preloaded device: it yields only beyond a force, `f += F₀` while d > 0.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | F₀ | preload | N | fitted; 0 to 5 N is the usual range |
//! | d | penetration | m | |
//!
//! Not modelled: the steep but finite slope up to F₀, friction in the preloaded seat. Confused with: a gap (-F₀ / k), which also
//! moves the onset; a force bias, which also shows outside contact; dry friction, which changes its sign.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ContactPreload {
    force_n: f64,
}

impl Effect<Axis> for ContactPreload {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        if seen.touch.depth_m > 0.0 {
            out.elastic += self.force_n;
        }
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "contact-preload".into(),
        about: "the device is preloaded: its force begins with a step".into(),
        fingerprint: "the force jumps at touch and at release by the same amount, and is right in between but for that".into(),
        experiment: "a slow push (1 mm/s): the force steps up at touch, while a gap only moves the pose of the touch".into(),
        wires: vec![Wire::Contact],
        order: 30,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![Param::new("force_n", "N", [0.0, 0.0, 100.0], 0.1, &[0.5])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ContactPreload { force_n: values[0] })),
    }
}
