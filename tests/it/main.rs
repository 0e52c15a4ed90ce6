//! One integration binary.
#![expect(clippy::unwrap_used, reason = "a test may stop where it stands")]

mod cli;
mod compare;
mod confusion;
mod criteria;
mod contact;
mod determinism;
mod effects;
mod hidden;
mod measurements;
mod mistakes;
mod oracles;
mod page;
mod physics;
mod recording;
mod replay;
mod scenario;
mod sets;
mod shell;
mod story;
mod story_compare;
mod tidy;
