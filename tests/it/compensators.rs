//! Compensations of the delay: what they are worth, and how each of them fails; the contact in software; the set-ups of the loop.

pub(crate) mod bench;
mod failures;
mod model;
mod pattern;
mod software;
mod table;
