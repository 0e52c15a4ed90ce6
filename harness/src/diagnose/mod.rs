//! What is missing in a model.

pub mod answer;
pub mod fit;
pub mod noise;
pub mod problem;
pub mod quality;
pub mod search;
pub mod software;
