//! One line on standard error that tells how far a long computation is, from its second second on.

use indicatif::{ProgressBar, ProgressDrawTarget};
use std::time::Duration;

/// Nothing is shown before.
const SHOWN_AFTER: Duration = Duration::from_secs(1);

/// A line that is shown while it lives, and only to somebody who watches.
pub struct Progress {
    line: Option<ProgressBar>,
}

impl Progress {
    pub(super) fn new(watched: bool) -> Self {
        let line = || ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        Progress { line: watched.then(line) }
    }

    /// Says what is done now. Pass it on as `&|text: &str| progress.say(text)`; threads may call it.
    pub fn say(&self, text: &str) {
        let Some(line) = &self.line else { return };
        if line.is_hidden() && line.elapsed() > SHOWN_AFTER {
            line.set_draw_target(ProgressDrawTarget::stderr());
            line.enable_steady_tick(Duration::from_millis(100));
        }
        line.set_message(text.to_owned());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(line) = &self.line {
            line.finish_and_clear();
        }
    }
}
