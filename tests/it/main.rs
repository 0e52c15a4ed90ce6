//! One integration binary.

mod effects;
mod recording;
mod page;
