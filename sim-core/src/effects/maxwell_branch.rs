//! Relaxation: a spring and a dashpot in series beside the device, `f' = k_m d' - f / τ`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | k_m | stiffness of the branch | N/m | fitted |
//! | τ | relaxation time | s | fitted; of the order of a contact, or nothing is seen |
//! | d | penetration, straight between physics steps | m | |
//! | f | force of the branch; 0 at touch | N | |
//!
//! Each step is exact: `f ← f e^{-Δt/τ} + k_m τ (1 - e^{-Δt/τ}) Δd / Δt`; the step of the touch counts from the instant of touch.
//!
//! Not modelled: recovery between contacts (the branch is at rest at each touch), several relaxation times. Confused with: a
//! damper k_m τ when the contact is much longer than τ, a stiffer spring when it is much shorter.

use crate::effect::{Context, Effect, Family, Kind, Param, Rates, Reads, Verified, Where};
use crate::signals::{ContactForce, Signals, Wire};
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct MaxwellBranch {
    stiffness_n_per_m: f64,
    relaxation_time_s: f64,
}

impl Effect<Axis> for MaxwellBranch {
    /// The force of the branch and the depth of the step before.
    fn memory(&self, _rates: &Rates) -> usize {
        2
    }

    fn contact(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let depth_m = seen.touch.depth_m;
        // A run that begins in contact begins at rest.
        let before_m = if context.step.index == 0 { depth_m } else { context.memory[1] };
        context.memory[1] = depth_m;
        if depth_m > 0.0 {
            let inside = if before_m < 0.0 { depth_m / (depth_m - before_m) } else { 1.0 };
            let share_of_time = context.step.dt.seconds() * inside / self.relaxation_time_s;
            let relaxed = -libm::expm1(-share_of_time);
            let travel_m = depth_m - before_m.max(0.0);
            context.memory[0] += -context.memory[0] * relaxed + self.stiffness_n_per_m * travel_m * relaxed / share_of_time;
        } else {
            context.memory[0] = 0.0;
        }
        out.dissipative += context.memory[0];
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "maxwell-branch".into(),
        about: "part of the device's force relaxes with time".into(),
        fingerprint: "the missing force rises on the way in, fades within a time of its own, and pulls on the way out".into(),
        experiment: "push in quickly, hold the depth for a second, and watch the force fade; or impacts at two masses".into(),
        wires: vec![Wire::Contact],
        order: 40,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![
            Param::new("stiffness_n_per_m", "N/m", [0.0, 0.0, 1e7], 50.0, &[300.0]),
            Param::new("relaxation_time_s", "s", [1e-3, 0.15, 10.0], 0.01, &[0.05, 0.15, 0.4]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| {
            Box::new(MaxwellBranch { stiffness_n_per_m: values[0], relaxation_time_s: values[1] })
        }),
    }
}
