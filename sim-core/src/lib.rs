//! The closed docking loop: eight wires, the parts that drive them, and the effects that rewrite them.
//!
//! `commanded → received → achieved → measured`, `achieved → touch → contact → sensed`,
//! `measured + sensed → feedback → (commanded)`.
//!
//! Nothing here knows a clock, a file, a thread or a global: a run is a function of its arguments, bit for bit.
//! Units are SI and stand in the names. Time is an integer count of nanoseconds.
//!
//! Signs: positive z closes the gap; a contact force is positive when it resists penetration; the sensor's reading is the
//! force on the probe, so that contact reads negative along z.
#![no_std]
#![warn(missing_docs)]

extern crate alloc;

pub mod audit;
pub mod calibration;
pub mod closed_loop;
pub mod compensator;
pub mod contact;
pub mod criterion;
pub mod delay;
pub mod effect;
pub mod effects;
pub mod energy;
pub mod force_sensor;
pub mod frames;
pub mod geometry;
pub mod identification;
pub mod link;
pub mod plant;
pub mod readout;
pub mod recorder;
pub mod refusal;
pub mod restitution;
pub mod rig;
pub mod rng;
pub mod robot;
pub mod signals;
pub mod space;
pub mod stability;
pub mod time;
pub mod trace;
