//! The targets of the long test, for libFuzzer.

#[path = "../../it/fuzz/sensors.rs"]
mod sensors;
#[path = "../../it/fuzz/targets.rs"]
mod targets;

pub use targets::{TARGETS, Target};

/// Gives one input to the target with this name.
///
/// # Panics
/// When there is no such target, or when it breaks a promise.
pub fn run(name: &str, input: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target of this name");
    let mut outcomes = targets::Outcomes::new();
    (target.run)(input, &mut outcomes);
    assert!(!outcomes.is_empty(), "the input leaves no trace");
}
