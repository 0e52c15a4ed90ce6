//! The catalogue: one file each. A new effect is one file and one word here; a tidy test compares list and folder.

use crate::effect::Catalog;
use crate::space::Axis;

macro_rules! catalogue {
    ($($name:ident),* $(,)?) => {
        $(pub mod $name;)*

        /// Every effect of this folder, for one axis.
        pub fn standard() -> Catalog<Axis> {
            Catalog::of(alloc::vec![$($name::kind()),*])
        }
    };
}

catalogue![
    asymmetric_damping,
    clock_offset,
    command_delay,
    command_jitter,
    command_loss,
    contact_gap,
    contact_preload,
    coulomb_friction,
    end_stop,
    force_bias,
    force_bias_drift,
    force_delay,
    force_lag,
    force_scale,
    hunt_crossley,
    hysteresis,
    maxwell_branch,
    measurement_delay,
    robot_second_order,
    stiffness_hardening,
    stiffness_power_law,
    tool_inertia,
    tool_weight,
];
