//! Calibration of a force/torque sensor and its tool from poses at rest.
//!
//! At rest the sensor feels its bias and the weight of the tool. Turned through enough attitudes, the two separate:
//!
//! ```text
//! f = (1 + S) w + c_f + k_f ΔT,    τ = r × w + Q w + c_τ + k_τ ΔT,    w = m D(α) γ,   γ = R(q)ᵀ g
//! ```
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | f, τ | mean reading of one pose, force and torque on the tool, in the sensor's own axes S | N, N m | recording |
//! | γ | gravity in the nominal axes S₀ of the sensor | m/s² | pose of the robot |
//! | D(α) | turns S₀ into S: rotation vector α, the misalignment | rad | estimated |
//! | m, r | mass of the tool; its centre of mass from the sensor's origin, in S | kg, m | estimated |
//! | c_f, c_τ | bias | N, N m | estimated |
//! | S | crosstalk between forces that a weight can show: symmetric, without trace (5 numbers) | 1 | estimated on request |
//! | Q | crosstalk from force to torque that a weight can show: symmetric (6 numbers) | m | estimated on request |
//! | k_f, k_τ | drift of the bias with temperature | N/K, N m/K | estimated on request |
//! | ΔT | temperature less a reference | K | given |
//!
//! The other entries of a full crosstalk matrix look like something else under weight alone: the trace of S like m, its
//! antisymmetric part like α, that of Q like r, and whatever a torque causes needs a second tool. A matrix from a data sheet is
//! taken out of the readings first ([`decoupled`]).
//!
//! The estimate: a closed-form start ([`start`]), then an iterative batch of weighted least squares
//! `x ← x + (Hᵀ R⁻¹ H)⁻¹ Hᵀ R⁻¹ (z - h(x))`, `P = (Hᵀ R⁻¹ H)⁻¹` ([`batch`]), what the poses could not show
//! ([`observability`]), and what is left ([`residuals`]). Sources: reference/PHYSICS.md, section 5.
//!
//! Not modelled: motion (every pose is at rest), an error of the robot's own attitude, elastic sag of the tool, hysteresis.

pub mod batch;
pub mod measurement;
pub mod observability;
pub mod residuals;
pub mod start;

pub use batch::{Calibration, Noise, Unsolved, calibrate};
pub use measurement::{Parameters, StaticPose, Terms, decoupled};
pub use observability::{Observability, observe};
pub use residuals::{AxisResidual, Pattern, Shape, patterns};

#[cfg(test)]
mod tests;
