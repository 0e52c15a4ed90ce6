//! What is missing in a model.

pub mod fit;
pub mod noise;
pub mod problem;
pub mod search;
