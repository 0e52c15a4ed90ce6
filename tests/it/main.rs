//! One integration binary.

mod page;
