//! A bias that drifts: `y = u + r t`, with t the time since the start of the recording.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | r | rate of the bias | N/s | fitted; 0.1 to 1 N/h when warm, up to 0.2 N/s after switching on |
//! | t | time since the start | s | |
//! | u | reading without it | N | |
//!
//! Not modelled: a drift that settles, dependence on temperature. Confused with: the weight of the tool while the attitude
//! changes steadily, creep of the device (in contact only).

use crate::effect::{Context, Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::{Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ForceBiasDrift {
    rate_n_per_s: f64,
}

impl Effect<Axis> for ForceBiasDrift {
    fn sensed(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut f64) {
        *out += self.rate_n_per_s * context.step.now.seconds();
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "force-bias-drift".into(),
        about: "the bias of the force reading drifts with time".into(),
        fingerprint: "the force that is missing outside contact grows steadily from the start to the end".into(),
        experiment: "a minute at rest, out of contact, at one attitude, before and after the impacts".into(),
        wires: vec![Wire::Sensed],
        order: 41,
        family: Family::Sensor,
        rigs: Where::Docking,
        params: vec![Param::new("rate_n_per_s", "N/s", [-10.0, 0.0, 10.0], 0.01, &[0.02, -0.02])],
        verified: Verified::Foreign("data/hidden-effect d6"),
        build: Arc::new(|values| Box::new(ForceBiasDrift { rate_n_per_s: values[0] })),
    }
}
