//! Where the loop with a delay is stable.

pub mod exact;
