//! One integration binary.
#![expect(clippy::unwrap_used, reason = "a test may stop where it stands")]

mod calibration;
mod cli;
mod compare;
mod confusion;
mod contact;
mod determinism;
mod effects;
mod hidden;
mod identification;
mod mistakes;
mod oracles;
mod page;
mod physics;
mod recording;
mod sets;
mod shell;
mod story;
mod story_compare;
mod tidy;
