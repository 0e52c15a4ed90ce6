//! The robot's and the sensor's side of the wire.
//!
//! Here is the edge at which units change: outside, what a controller or a sensor counts in; inside, SI. Every conversion is
//! one function, named after what comes out and what goes in, so that a factor stands in one place.
//!
//! Time comes in as [`sim_core::time::Nanos`]; sockets stay in one module behind the feature `net`.
#![warn(missing_docs)]

pub mod capture;
pub mod fault;
pub mod ft;
#[cfg(feature = "net")]
pub mod net;
pub mod rsi;
mod units;

pub use units::{
    ForceUnit, SensorScale, TorqueUnit, degrees_from_radians, metres_from_millimetres, millimetres_from_metres,
    nanos_from_milliseconds, radians_from_degrees,
};
