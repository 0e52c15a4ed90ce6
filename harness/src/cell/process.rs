//! A program under test: started, watched, stopped, its output kept.

use crate::error::Error;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use std::io::Read;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// What is kept of a program's output, in bytes: its end says why it failed.
const OUTPUT_BYTES_MAX: usize = 64 << 10;
/// How long the rest of what a program printed may take to be read.
const DRAIN: Duration = Duration::from_secs(2);
/// How often a program that should end by itself is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// A program that runs.
pub struct Started {
    child: Child,
    output: Arc<Mutex<Kept>>,
    readers: Vec<JoinHandle<()>>,
    status: Option<ExitStatus>,
    is_stopped: bool,
}

/// How a program ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    /// Its exit code, if it ended by itself and not by a signal.
    pub code: Option<i32>,
    /// The signal that ended it, ours or another's.
    pub signal: Option<i32>,
    /// Whether it had to be stopped.
    pub was_stopped: bool,
    /// The end of what it printed on both its streams.
    pub output: String,
}

/// Takes a command line apart as a shell does with blanks and quotes; nothing else of a shell is known.
///
/// # Errors
/// When a quote is not closed, or nothing is left.
pub fn words(line: &str) -> Result<Vec<String>, Error> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for letter in line.chars() {
        match (quote, letter) {
            (Some(open), _) if open == letter => quote = None,
            (Some(_), _) => word.get_or_insert_default().push(letter),
            (None, '\'' | '"') => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            (None, _) if letter.is_whitespace() => words.extend(word.take()),
            (None, _) => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    let refuse = |what: &str| Error::new(what).place("argument --controller").help("give it as './prog {rsi} {ft}'");
    match (quote, words.is_empty()) {
        (Some(_), _) => Err(refuse("a quote is not closed")),
        (None, true) => Err(refuse("there is no program in it")),
        (None, false) => Ok(words),
    }
}

impl Started {
    /// Starts a program, its input empty and its output kept. It leads a process group of its own, so that what it starts in turn is
    /// stopped with it.
    ///
    /// # Errors
    /// When there is no such program, or it may not be run.
    pub fn start(words: &[String]) -> Result<Self, Error> {
        let (program, arguments) = words.split_first().expect("a command line has a word");
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.process_group(0);
        let mut child = command.spawn().map_err(|error| {
            Error::new(format!("cannot start {program:?}: {error}"))
                .place("argument --controller")
                .help("check the path of the program, seen from where you are")
        })?;
        let output = Arc::new(Mutex::new(Kept::default()));
        let mut readers = Vec::new();
        readers.extend(child.stdout.take().map(|stream| keep(stream, &output)));
        readers.extend(child.stderr.take().map(|stream| keep(stream, &output)));
        Ok(Started { child, output, readers, status: None, is_stopped: false })
    }

    /// Whether it has ended.
    pub fn has_ended(&mut self) -> bool {
        if self.status.is_none() {
            self.status = self.child.try_wait().ok().flatten();
        }
        self.status.is_some()
    }

    /// Waits so long for it to end by itself, asks it to end (SIGTERM), waits as long again, then stops it.
    pub fn stop(mut self, patience: Duration) -> Ended {
        let was_stopped = !self.ends_within(patience);
        if was_stopped {
            self.signal(Signal::SIGTERM);
            self.ends_within(patience);
        }
        self.kill();
        let code = self.status.and_then(|status| status.code());
        let signal = self.status.and_then(|status| status.signal());
        // A program that left its group may hold the streams open: what has come until then is kept.
        let mut looks = DRAIN.as_millis() / LOOK.as_millis();
        while !self.readers.iter().all(JoinHandle::is_finished) && looks > 0 {
            std::thread::sleep(LOOK);
            looks -= 1;
        }
        let output = self.output.lock().map(|kept| kept.text()).unwrap_or_default();
        Ended { code, signal, was_stopped, output }
    }
}

impl Ended {
    /// How it failed by itself, in words.
    pub fn failure(&self) -> Option<String> {
        match (self.was_stopped, self.code, self.signal) {
            (false, Some(code), _) if code != 0 => Some(format!("ended with code {code}")),
            (false, None, Some(signal)) => Some(format!("was ended by signal {signal}")),
            _ => None,
        }
    }
}

impl Started {
    fn ends_within(&mut self, patience: Duration) -> bool {
        let mut looks = patience.as_millis() / LOOK.as_millis();
        while !self.has_ended() && looks > 0 {
            std::thread::sleep(LOOK);
            looks -= 1;
        }
        self.has_ended()
    }

    /// For the program and whatever it has started.
    fn signal(&self, signal: Signal) {
        if let Ok(leader) = i32::try_from(self.child.id()) {
            // All of them may have ended in between: then there is nothing to stop.
            let _ = killpg(Pid::from_raw(leader), signal);
        }
    }

    fn kill(&mut self) {
        if std::mem::replace(&mut self.is_stopped, true) {
            return;
        }
        self.signal(Signal::SIGKILL);
        if self.status.is_none() {
            self.status = self.child.wait().ok();
        }
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The end of what a program printed, and how much came before it.
#[derive(Default)]
struct Kept {
    bytes: Vec<u8>,
    dropped: usize,
}

impl Kept {
    fn add(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        let surplus = self.bytes.len().saturating_sub(OUTPUT_BYTES_MAX);
        self.bytes.drain(..surplus);
        self.dropped += surplus;
    }

    fn text(&self) -> String {
        let text = String::from_utf8_lossy(&self.bytes);
        if self.dropped == 0 {
            text.into_owned()
        } else {
            format!("({} bytes before this were not kept)\n{text}", self.dropped)
        }
    }
}

fn keep(mut stream: impl Read + Send + 'static, output: &Arc<Mutex<Kept>>) -> JoinHandle<()> {
    let output = output.clone();
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(length) = stream.read(&mut buffer) {
            let Ok(mut kept) = output.lock() else { return };
            if length == 0 {
                return;
            }
            kept.add(&buffer[..length]);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_is_taken_apart_as_a_shell_does() {
        assert_eq!(words("./a --x 'b c' \"\" d\"e f\"g").unwrap(), ["./a", "--x", "b c", "", "de fg"]);
        assert!(words("  ").is_err() && words("a 'b").is_err());
    }

    #[test]
    fn a_program_is_watched_stopped_and_its_output_kept() {
        let shell = |script: &str| Started::start(&["sh".to_owned(), "-c".to_owned(), script.to_owned()]).unwrap();
        let ended = shell("echo here; echo there >&2; exit 3").stop(Duration::from_secs(20));
        assert_eq!((ended.code, ended.was_stopped), (Some(3), false));
        assert_eq!(ended.failure().as_deref(), Some("ended with code 3"));
        let killed = shell("kill -9 $$").stop(Duration::from_secs(20));
        assert_eq!(killed.failure().as_deref(), Some("was ended by signal 9"), "{killed:?}");
        assert!(ended.output.contains("here") && ended.output.contains("there"), "{ended:?}");
        let ended = shell("exec sleep 1000").stop(Duration::ZERO);
        assert_eq!((ended.code, ended.was_stopped), (None, true));
        assert!(Started::start(&["./there-is-no-such-program".to_owned()]).is_err());
        let asked = "trap 'echo goodbye; exit 0' TERM; echo ready; while true; do sleep 0.05; done";
        let started = shell(asked);
        while !started.output.lock().unwrap().text().contains("ready") {
            std::thread::sleep(LOOK);
        }
        let ended = started.stop(Duration::from_secs(10));
        assert!(ended.was_stopped && ended.output.contains("goodbye"), "{ended:?}");
        let ended = shell("head -c 70000 /dev/zero | tr '\\0' x").stop(Duration::from_secs(20));
        assert!(ended.output.starts_with("(4464 bytes before this were not kept)\nx"), "{}", &ended.output[..60]);
    }

    #[test]
    fn what_it_started_is_stopped_with_it() {
        let script = "sleep 1000 & echo $!; wait".to_owned();
        let mut started = Started::start(&["sh".to_owned(), "-c".to_owned(), script]).unwrap();
        let mut grandchild = String::new();
        while !grandchild.ends_with('\n') {
            assert!(!started.has_ended(), "it waits for what it started");
            grandchild = started.output.lock().unwrap().text();
        }
        started.stop(Duration::ZERO);
        let about = format!("/proc/{}/stat", grandchild.trim());
        // Nobody may have asked yet how it ended: then it is there as a zombie.
        let is_gone = || std::fs::read_to_string(&about).map_or(true, |stat| stat.contains(") Z "));
        let mut looks = 1000;
        while !is_gone() && looks > 0 {
            std::thread::sleep(LOOK);
            looks -= 1;
        }
        assert!(is_gone(), "{:?}", std::fs::read_to_string(&about));
    }
}
