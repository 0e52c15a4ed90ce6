//! The contact plane is not where the model has it: `d = z - g`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | z | penetration of the nominal plane | m | |
//! | g | gap; positive: the device is touched later, negative: earlier | m | fitted; 0.1 to 2 mm is the usual range |
//!
//! The virtual contact in the compensator keeps the nominal plane: that is why a gap also changes the restitution.
//! Not modelled: play that depends on the direction. Confused with: a force bias of -k g while in contact, which also shows
//! outside it; at one speed with preload and dead zone.

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::{Axis, AxisTouch};
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ContactGap {
    gap_m: f64,
}

impl Effect<Axis> for ContactGap {
    fn touch(&self, _context: Context<'_>, _seen: &Signals<Axis>, out: &mut AxisTouch) {
        out.depth_m -= self.gap_m;
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "contact-gap".into(),
        about: "contact begins deeper or earlier than the model's plane".into(),
        fingerprint: "the missing force is the same constant all through contact, and zero outside it".into(),
        experiment: "drive slowly (1 mm/s) into the device and note the pose at which the force leaves its noise".into(),
        wires: vec![Wire::Touch],
        order: 10,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![Param::new("gap_m", "m", [-0.02, 0.0, 0.02], 1e-4, &[5e-4, -5e-4])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ContactGap { gap_m: values[0] })),
    }
}
