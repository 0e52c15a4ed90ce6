//! From a recording to a verdict: compare a model with measurements, find the effect that is missing, add it, watch the error
//! fall.
#![warn(missing_docs)]

pub mod blocks;
pub mod calibrate;
pub mod case;
pub mod cell;
pub mod clamp;
pub mod cli;
pub mod clocks;
pub mod compare;
pub mod diagnose;
pub mod error;
pub mod files;
pub mod identify;
pub mod missing;
pub mod model;
pub mod recorder;
pub mod recording;
pub mod replay;
pub mod report;
pub mod scenario;
pub mod simulate;
pub mod stability;
