//! A diagnosis as lines for a terminal.

use crate::diagnose::Outcome;
use crate::diagnose::answer::Ladder;
use std::fmt::Write;

/// The ladder first, the sentences after it: the last lines are the answer.
pub fn diagnosis(outcome: &Outcome) -> String {
    let mut text = ladder(&outcome.ladder);
    for sentence in &outcome.diagnosis.sentences {
        let _ = writeln!(text, "{sentence}");
    }
    let _ = writeln!(text, "verdict: {}", outcome.diagnosis.verdict.id());
    text
}

/// One line for each step of each channel.
pub fn ladder(ladder: &Ladder) -> String {
    let mut text = String::new();
    for (name, channel) in &ladder.channels {
        let _ = writeln!(
            text,
            "{name}, {} on the test recordings; noise floor {}",
            channel.unit,
            number(channel.noise_floor)
        );
        let first = channel.steps.first().map_or(1.0, |step| step.rms);
        for step in &channel.steps {
            let cells = (step.rms / first * 24.0).round().clamp(0.0, 48.0) as usize;
            let _ = writeln!(text, "  {:<28} {:>10}  {}", step.label, number(step.rms), "█".repeat(cells));
        }
    }
    text
}

/// Four significant digits.
fn number(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-2 || value.abs() >= 1e4) {
        format!("{value:.3e}")
    } else {
        format!("{value:.4}")
    }
}
