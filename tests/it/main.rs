//! One integration binary.

mod compare;
mod effects;
mod recording;
