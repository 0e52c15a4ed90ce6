//! Identification of a robot from recordings: steps in the command, or free flight under an excitation.
//!
//! ```text
//! recordings ─ axes ─→ command and pose, axis by axis ─┬─ steps  ─┐
//!                                                      └─ excite ─┴─ robot ─→ RobotIdentification ─ words ─→ text
//!                                                                                       └ section ─→ the model file
//! ```

mod axes;
mod robot;
mod section;
mod steps;
mod words;

pub use axes::AxisSignal;
pub use robot::{AxisIdentification, Excited, RobotIdentification, gradings, identify_robot};
pub use section::write_robot;
pub use steps::{Coupling, Stepped};
pub use words::text;
