//! One integration binary.

mod compare;
mod effects;
mod page;
mod recording;
mod story;
mod story_compare;
