//! Harness.

pub mod error;
pub mod recording;
