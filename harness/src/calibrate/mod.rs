//! Calibration of the force/torque sensor and its tool, from recordings of poses at rest.
//!
//! ```text
//! recordings ─ rest ─→ poses at rest ─ ft ─→ FtCalibration ─ words ─→ text
//!                                                          └ section ─→ the model file
//! ```

mod ft;
mod rest;
mod section;
mod words;

pub use ft::{FtCalibration, FtRequest, NamedNumber, ObservabilityReport, calibrate_ft};
pub use rest::{RestPose, at_rest};
pub use section::write_calibration;
pub use words::{axis_name, text};
