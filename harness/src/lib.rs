//! Harness.
pub mod report;
