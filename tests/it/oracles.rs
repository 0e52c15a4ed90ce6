//! Every oracle of the physics: a number that was computed or published elsewhere, with its source, and the tolerance that its
//! source allows. A deviation carries `DIFFERENCE:` and the reason. The numbers stand in `reference/PHYSICS.md`, section 9.
//!
//! | oracle | what | file |
//! |---|---|---|
//! | O1, O2, O3 | critical delay: closed form, Padé, growth of the delayed equation | `stability` |
//! | O4, O6 | restitution and energy behind a delay, published and computed | `loops` |
//! | O5 | neutral damping of the sampled loops | `stability` |
//! | O7 | two plates in the plane | `plates` |
//! | O8 | the exact discrete energy identity | `energy_identity` |
//! | O9, O10 | mis-pairing; both definitions of restitution | `energy` |
//! | O11 | calibration of a force sensor | `calibration` |
//! | O12 | stiffness of a preloaded device | `device` |
//! | O13, O14 | tool as heavy as the satellites; monotony | `stability` |
//! | O15 | exponents of residual over speed | `speed` |

mod calibration;
mod device;
mod energy;
mod energy_identity;
mod loops;
mod plates;
mod speed;
mod stability;
