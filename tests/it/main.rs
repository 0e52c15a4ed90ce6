//! One integration binary.

mod effects;
