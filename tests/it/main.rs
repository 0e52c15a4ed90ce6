//! One integration binary.
#![expect(clippy::unwrap_used, reason = "a test may stop where it stands")]

mod bodies;
mod calibration;
mod capture;
mod cell_facility;
mod cli;
mod clocks;
mod compare;
mod compensators;
mod confusion;
mod contact;
mod criteria;
mod determinism;
mod effects;
mod hidden;
mod identification;
mod r#loop;
mod measurements;
mod mistakes;
mod oracles;
mod page;
mod physics;
mod record;
mod recording;
mod replay;
mod scenario;
mod sets;
mod shell;
mod stability;
mod stability_command;
mod story;
mod story_compare;
mod tidy;
