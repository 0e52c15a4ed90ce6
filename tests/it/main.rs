//! One integration binary.

mod effects;
mod recording;
