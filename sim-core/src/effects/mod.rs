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

catalogue![command_delay, coulomb_friction, stiffness_hardening];
