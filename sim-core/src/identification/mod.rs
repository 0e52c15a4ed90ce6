//! Identification of a position-controlled robot: what lies between a command and the pose.
//!
//! One axis is a lag of second order, a dead time, or both:
//!
//! ```text
//! G(s) = e^{-s T} ωₙ² / (s² + 2 ζ ωₙ s + ωₙ²),    equivalent delay at low frequency: T + 2 ζ / ωₙ
//! ```
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | fₙ = ωₙ / 2π | natural frequency | Hz | fitted |
//! | ζ | damping ratio | 1 | fitted |
//! | T | dead time that the lag does not explain | s | fitted |
//!
//! A lag of 10 Hz and ζ = 0.5 delays as much as a dead time of 15.9 ms: a delay that a manufacturer states may *be* the lag. So
//! the three forms compete on the data ([`form`]), and a dead time beside a lag is kept only where both were fitted together and
//! the data cannot do without either. Two ways lead to the data: a step in the command ([`step`] for the classical reading,
//! [`response`] for the fit), and an excitation of any shape ([`following`] for the fit, [`excitation`] for gain and delay at its
//! frequencies). A step is held from its stamp on; under an excitation the command is drawn as straight lines between its stamps,
//! which is half a loop period earlier on average. Source: reference/PHYSICS.md, section 6.
//!
//! What is identified is the way from the command to the pose that was recorded: through a robot controller's own report it
//! includes the delay of that report.
//!
//! Not modelled: limits of speed and acceleration (steps must be small), friction, modes above the first.

pub mod excitation;
pub mod following;
pub mod form;
pub mod least_squares;
pub mod response;
pub mod step;

pub use excitation::{Line, Spectrum, frequencies, spectrum};
pub use following::follow;
pub use form::{Choice, Form, Lag, Way};
pub use response::fit_step;
pub use step::{Classical, StepTest, classical};

#[cfg(test)]
mod tests;
