//! One integration binary.
#![expect(clippy::unwrap_used, reason = "a test may stop where it stands")]

mod cli;
mod compare;
mod effects;
mod page;
mod recording;
mod sets;
mod tidy;
