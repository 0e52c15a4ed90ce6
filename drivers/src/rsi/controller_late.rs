//! Late replies: how the controller counts them, and when it has had enough.
//!
//! Whether the count `Delay D` is a total or falls back with a good reply is documented nowhere public, so that there are three
//! rules. The manual's words are that the robot stops when the allowed number is exceeded: with a limit of 100 the 101st stops.
//!
//! | rule | what D holds | stops when |
//! |---|---|---|
//! | `total` | every late reply since RSI was started | D > limit |
//! | `consecutive` | late replies since the last good one | D > limit |
//! | `percent` | late replies among the last `window` cycles | D > limit % of the window |
//!
//! Source: reference/PROTOCOLS.md, section 1.6.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Longest window, in cycles.
const WINDOW_MAX: u32 = 100_000;

/// When the controller has had enough.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "rule", rename_all = "kebab-case", deny_unknown_fields)]
pub enum LateRule {
    /// Counts up only.
    Total {
        /// Late replies that are allowed.
        limit: u32,
    },
    /// A good reply sets the count to 0.
    Consecutive {
        /// Late replies in a row that are allowed.
        limit: u32,
    },
    /// A share of the last cycles.
    Percent {
        /// Late replies that are allowed, in % of the window.
        limit: f64,
        /// Length of the window, in cycles; at most 100 000.
        window: u32,
    },
}

/// A rule at work.
#[derive(Debug, Clone)]
pub(super) struct LateCount {
    rule: LateRule,
    count: u32,
    window: VecDeque<bool>,
}

impl LateCount {
    pub(super) fn new(rule: LateRule) -> Self {
        LateCount { rule, count: 0, window: VecDeque::new() }
    }

    /// What `Delay D` says.
    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// One cycle more; whether the rule is now broken.
    pub(super) fn cycle(&mut self, late: bool) -> bool {
        match self.rule {
            LateRule::Total { limit } => {
                self.count = self.count.saturating_add(u32::from(late));
                self.count > limit
            }
            LateRule::Consecutive { limit } => {
                self.count = if late { self.count.saturating_add(1) } else { 0 };
                self.count > limit
            }
            LateRule::Percent { limit, window } => {
                let window = window.clamp(1, WINDOW_MAX);
                if self.window.len() >= window as usize && self.window.pop_front() == Some(true) {
                    self.count -= 1;
                }
                self.window.push_back(late);
                self.count += u32::from(late);
                f64::from(self.count) * 100.0 > limit * f64::from(window)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `L` late, `.` in time. The count after each cycle, `!` where the rule is broken.
    fn check(rule: LateRule, cycles: &str, expected: &str) {
        let mut late = LateCount::new(rule);
        let told = cycles.chars().map(|cycle| {
            let broken = late.cycle(cycle == 'L');
            format!("{}{}", late.count(), if broken { "!" } else { "" })
        });
        assert_eq!(told.collect::<Vec<_>>().join(" "), expected, "{rule:?}");
    }

    #[test]
    fn each_rule_counts_in_its_own_way() {
        check(LateRule::Total { limit: 2 }, "L.L..L", "1 1 2 2 2 3!");
        check(LateRule::Consecutive { limit: 2 }, "LL.LLL", "1 2 0 1 2 3!");
        check(LateRule::Percent { limit: 50.0, window: 4 }, "L.LLL...", "1 1 2 3! 3! 3! 2 1");
        check(LateRule::Total { limit: 0 }, ".L", "0 1!");
    }

    #[test]
    fn a_window_of_any_length_is_bounded() {
        let mut late = LateCount::new(LateRule::Percent { limit: 100.0, window: u32::MAX });
        assert!((0..200_000).all(|_| !late.cycle(true)));
        assert_eq!(late.count(), WINDOW_MAX);
        let mut late = LateCount::new(LateRule::Percent { limit: 0.0, window: 0 });
        assert!(!late.cycle(false) && late.cycle(true));
    }
}
