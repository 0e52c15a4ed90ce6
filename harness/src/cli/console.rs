//! The two streams of a command, and how they look.

use crate::error::Error;
use crate::files::write_whole;
use miette::{GraphicalReportHandler, GraphicalTheme};
use std::io::{ErrorKind, Write};
use std::path::Path;

use super::progress::Progress;

/// How output looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Look {
    /// Whether standard error takes colours.
    pub colour: bool,
    /// Whether somebody watches standard error: only then is progress shown, and are lines wrapped.
    pub terminal: bool,
}

/// Where a command writes.
pub struct Console<'a> {
    out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    /// How output looks.
    pub look: Look,
    /// The command line, as it would be typed again.
    pub command: String,
    /// The first failure of standard output.
    failed: Option<std::io::Error>,
}

impl<'a> Console<'a> {
    /// Data to `out`; progress and errors to `err`.
    pub fn new(out: &'a mut dyn Write, err: &'a mut dyn Write, look: Look) -> Self {
        Console { out, err, look, command: String::new(), failed: None }
    }

    /// Prints data. A reader that left early, such as `head`, changes neither files nor exit code; see [`Self::finish`].
    pub fn print(&mut self, text: &str) {
        if self.failed.is_none() {
            self.failed = self.out.write_all(text.as_bytes()).err();
        }
    }

    /// Says something that is not data.
    pub fn say(&mut self, text: &str) {
        // Nobody can be told that standard error is closed.
        let _ = self.err.write_all(text.as_bytes());
    }

    /// Shows an error with its place and its help.
    pub fn error(&mut self, error: &Error) {
        let theme = if self.look.colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_wrap_lines(self.look.terminal);
        let mut text = String::new();
        if handler.render_report(&mut text, error).is_err() {
            text = format!("{error}\n");
        }
        self.say(text.trim_start_matches('\n'));
    }

    /// Prints data, or saves them whole when a file is named; `-` is standard output.
    pub fn save(&mut self, path: &Path, text: &str) -> Result<(), Error> {
        if path == Path::new("-") {
            self.print(text);
            return Ok(());
        }
        self.write(path, text.as_bytes())
    }

    /// Writes a file whole, and says so.
    pub fn write(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        write_whole(path, bytes)?;
        self.say(&format!("{}: written\n", path.display()));
        Ok(())
    }

    /// A line that tells how far a long computation is, if somebody watches.
    pub fn progress(&self) -> Progress {
        Progress::new(self.look.terminal)
    }

    /// Hands everything over; an error if standard output could not take it.
    pub fn finish(&mut self) -> Result<(), Error> {
        let flushed = self.out.flush().err();
        match self.failed.take().or(flushed) {
            Some(error) if error.kind() != ErrorKind::BrokenPipe => {
                Err(Error::new(format!("cannot write to standard output: {error}")).help("check the disk behind it"))
            }
            _ => Ok(()),
        }
    }
}
