//! Ctrl-C, SIGTERM and SIGHUP as the natural end of what would otherwise go on: files are finished, results are told.
//!
//! | signal | while somebody watches | otherwise |
//! |---|---|---|
//! | the first SIGINT, SIGTERM or SIGHUP | [`Interrupt::asked`] says so | the program dies of it, as usual |
//! | the second | the program dies of it | the program dies of it |
//!
//! A terminal that goes away sends SIGHUP; who starts the program with `nohup` has it ignored, and so it stays. SIGXFSZ, with which the
//! system ends a program whose file grows beyond `ulimit -f`, is taken and means nothing: the write that is too much fails then, and
//! the command says so.
//!
//! A system call that waits is begun again by the system: who reads from a pipe polls it with a limit first.

use crate::error::Error;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What the handlers set. They stay for the life of the program: the library cannot put back what was there before.
struct Flags {
    /// A signal came while somebody watched.
    asked: Arc<AtomicBool>,
    /// The next signal is the program's end.
    deadly: Arc<AtomicBool>,
    /// How many watch. A command line is one; tests run several in one process.
    watching: Mutex<usize>,
}

static FLAGS: OnceLock<Result<Flags, String>> = OnceLock::new();

fn flags() -> &'static Result<Flags, String> {
    FLAGS.get_or_init(|| {
        let (asked, deadly) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(true)));
        let hang_up = Some(SIGHUP).filter(|signal| !is_ignored(*signal));
        for signal in [SIGINT, SIGTERM].into_iter().chain(hang_up) {
            // They act in this order, so that the first signal does not find what it sets.
            flag::register_conditional_default(signal, Arc::clone(&deadly))
                .and_then(|_| flag::register(signal, Arc::clone(&asked)))
                .and_then(|_| flag::register(signal, Arc::clone(&deadly)))
                .map_err(|error| error.to_string())?;
        }
        Ok(Flags { asked, deadly, watching: Mutex::new(0) })
    })
}

/// Whether who started this program has it ignore this signal, as far as the system tells.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).map(str::trim);
    mask.and_then(|mask| u64::from_str_radix(mask, 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Lets a write beyond the limit on a file's length fail, so that a command can say so, instead of ending the program without a word.
pub(super) fn outlive_file_limit() {
    static TAKEN: OnceLock<()> = OnceLock::new();
    // A system that takes no handler ends the program as before.
    TAKEN.get_or_init(|| drop(flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))));
}

/// From its making to its dropping, the first signal is a request.
pub struct Interrupt(&'static Flags);

impl Interrupt {
    /// Begins to watch.
    ///
    /// # Errors
    /// When the system takes no handler.
    pub fn watch() -> Result<Self, Error> {
        let flags = flags().as_ref().map_err(|error| Error::new(format!("cannot watch for Ctrl-C: {error}")))?;
        let mut watching = flags.watching.lock().unwrap_or_else(PoisonError::into_inner);
        if *watching == 0 {
            flags.asked.store(false, Ordering::SeqCst);
            flags.deadly.store(false, Ordering::SeqCst);
        }
        *watching += 1;
        Ok(Interrupt(flags))
    }

    /// Whether the end was asked for.
    pub fn asked(&self) -> bool {
        self.0.asked.load(Ordering::SeqCst)
    }
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        let mut watching = self.0.watching.lock().unwrap_or_else(PoisonError::into_inner);
        *watching -= 1;
        if *watching == 0 {
            self.0.deadly.store(true, Ordering::SeqCst);
        }
    }
}
