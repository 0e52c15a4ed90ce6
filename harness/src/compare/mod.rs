//! A model against measurements: our own software first, then block by block with the inputs clamped, then the free run.
//!
//! | step | what goes in | what it can blame | decides |
//! |---|---|---|---|
//! | software | recorded force | clock, mass, compensator | yes |
//! | path block | recorded command | link, robot, read-out | yes |
//! | force block | path of the model | geometry, contact, sensor | yes |
//! | free run | recorded first motion only | the loop as a whole | only where the user sets a limit |
//!
//! The verdict rests on the blocks: in a closed loop the sensor's noise feeds back into the motion, and a right model misses
//! the recorded position by many times the read-out noise. Free runs are therefore shown with bands that carry noise and
//! declared scatter through the loop.
//!
//! Signals are never aligned: a shift that would fit better is reported and applied nowhere.

mod agreement;
mod clamped;
mod free_run;
mod limit;
mod log;
mod measurement_words;
mod measurements;
mod observed;
mod quantity;
mod result;
mod run;
mod session;
mod shift;
mod signals;
mod words;

pub use agreement::Agreement;
pub use limit::{CHANNELS, Limit, Outcome};
pub use measurements::{Alignment, Curves, Difference, Measurements, RunAgainst, compare_measurements};
pub use observed::observation;
pub use result::{
    Block, CompareVerdict, Comparison, Fitted, FreeRunSummary, HeatCell, HeatRow, LimitResult, Quantity,
    SessionComparison, Shift, Signals, Verdict,
};
pub use run::{FreeRun, Request, compare, exit_code, exit_code_of};
