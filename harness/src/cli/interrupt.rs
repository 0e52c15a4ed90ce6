//! Ctrl-C and SIGTERM as the natural end of what would otherwise go on: files are finished, results are told.
//!
//! | signal | while somebody watches | otherwise |
//! |---|---|---|
//! | the first SIGINT or SIGTERM | [`Interrupt::asked`] says so | the program dies of it, as usual |
//! | the second | the program dies of it | the program dies of it |
//!
//! A system call that waits is begun again by the system: who reads from a pipe polls it with a limit first.

use crate::error::Error;
use signal_hook::consts::{SIGINT, SIGTERM};
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
        for signal in [SIGINT, SIGTERM] {
            // They act in this order, so that the first signal does not find what it sets.
            flag::register_conditional_default(signal, Arc::clone(&deadly))
                .and_then(|_| flag::register(signal, Arc::clone(&asked)))
                .and_then(|_| flag::register(signal, Arc::clone(&deadly)))
                .map_err(|error| error.to_string())?;
        }
        Ok(Flags { asked, deadly, watching: Mutex::new(0) })
    })
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
