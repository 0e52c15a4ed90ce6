//! One integration binary.

mod recording;
