//! One integration binary.

mod effects;
mod page;
mod recording;
mod story;
