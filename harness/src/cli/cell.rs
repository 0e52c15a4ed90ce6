//! `dockhil cell`: the virtual cell on real sockets. It waits for a controller, and says how the run ended.

use super::console::Console;
use super::inputs::{self, Extracted, Outputs};
use super::interrupt::Interrupt;
use super::outcome::Exit;
use super::run::did_nothing;
use crate::cell::page::page;
use crate::cell::run::{Options, Ran, check, run};
use crate::cell::timing::Timing;
use crate::cell::wires::{Addresses, Pace, Wires};
use crate::cell::{self, Cell, fault_list, session};
use crate::error::Error;
use crate::files::sha256_hex;
use crate::report::{TEXT_WIDTH, Tone, html, text};
use clap::Args;
use drivers::rsi::Transport;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest wait for an answer in virtual time: beyond it the answer counts as missing. Chosen.
const PATIENCE_MS: u64 = 1000;

/// What a controller has to do, for those who write one.
pub(super) const CONTROLLER: &str = "\
What a controller does:
  It binds the address `listen` of each robot (over TCP it listens there), and then asks the sensor to stream;
  rdt: 12 34 00 02 00 00 00 00. The readings of a cycle come before its frames: big-endian counts, of force along
  z negative where the contact resists.
  Each frame, <Rob Type=\"KUKA\">…<IPOC>n</IPOC></Rob>, is answered once, with the same IPOC:
  <Sen Type=\"SENTYPE\"><RKorr X=\"0.0000\" …/><IPOC>n</IPOC></Sen>. X, Y and Z in mm, A, B and C in deg, from the
  pose at the start (mode absolute) or from the last one (relative), in the axes of the robot's BASE.
  The cell begins in motion, with velocity_m_per_s of [start]. What is commanded in the first cycle is the start
  itself, a correction of zero; the reported pose is behind it by the dead times of the model.
  When no frame comes any more it ends. `dockhil test` sends it SIGTERM 0.2 s after the run, and SIGKILL 0.2 s later.";

/// How a cell is run.
#[derive(Debug, Clone, Args)]
pub struct Running {
    /// Save what was exchanged as a recording; `compare` and `diagnose` read it.
    #[arg(short, long, value_name = "S.mcap")]
    pub output: Option<PathBuf>,
    /// Overwrite the recording.
    #[arg(long)]
    pub force: bool,
    /// Length of the run in the cell's own time, in s.
    #[arg(long, value_name = "S", default_value_t = 2.0, allow_negative_numbers = true)]
    pub duration: f64,
    /// Begin here along z instead of where the cell says, in m; positive is penetration.
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    pub position: Option<f64>,
    /// Begin with this speed along z instead of the cell's, in m/s.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    pub velocity: Option<f64>,
    /// Draw noise and faults from this seed instead of the cell's.
    #[arg(long, value_parser = inputs::seed, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    #[command(flatten)]
    pub outputs: Outputs,
}

/// How real sockets are served.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Time")]
pub struct Timed {
    /// Keep the cycle of the robot controller by the clock on the wall, and report how well it was kept.
    #[arg(long)]
    pub real_time: bool,
    /// Virtual time: how long an answer may take before it counts as missing, in ms.
    #[arg(long, value_name = "MS", default_value_t = PATIENCE_MS, value_parser = clap::value_parser!(u64).range(1..))]
    pub patience: u64,
    /// How long to wait for the controller to come, in s.
    #[arg(long, value_name = "S", default_value_t = 60)]
    pub wait: u64,
}

/// Arguments of `dockhil cell`.
#[derive(Debug, Args)]
#[command(after_long_help = CONTROLLER)]
pub struct Arguments {
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml", required_unless_present_any = ["list_faults", "schema"])]
    cell: Option<PathBuf>,
    #[command(flatten)]
    running: Running,
    #[command(flatten)]
    timed: Timed,
    /// Save the cell, its model and its Ethernet configurations to a folder, to be changed there; nothing is run.
    #[arg(long, value_name = "FOLDER")]
    extract: Option<PathBuf>,
    /// List the faults of the wire with their parameters, and end.
    #[arg(long, conflicts_with_all = ["cell", "schema"])]
    list_faults: bool,
    /// Print the JSON schema of CELL.toml; editors complete and check with it.
    #[arg(long, conflicts_with = "cell")]
    schema: bool,
}

impl Running {
    /// Reads the cell, and refuses now what could not be written later.
    pub fn read(&self, cell: &Path) -> Result<Cell, Error> {
        let mut cell = Cell::find(cell)?;
        cell.begin_at(self.position, self.velocity)?;
        cell.config.seed = self.seed.or(cell.config.seed);
        let read = cell.files();
        self.outputs.check(read.iter().copied())?;
        if let Some(path) = &self.output {
            inputs::not_read(path, read.iter().copied())?;
            self.outputs.written_once(path)?;
            inputs::writable_new(path, self.force)?;
        }
        Ok(cell)
    }

    /// How long it runs.
    pub fn options(&self) -> Options {
        Options { duration_s: self.duration, keeps: self.output.is_some() || self.outputs.report.is_some() }
    }

    /// Says how a run ended, saves it, and gives its exit code.
    pub fn ended(
        &self,
        cell: &Cell,
        ran: &Ran,
        timing: Option<&Timing>,
        complaint: Option<Complaint>,
        console: &mut Console<'_>,
    ) -> Result<Exit, Error> {
        let End { exit, tone, words, error } = End::of(cell, ran, complaint);
        let recording = self.output.as_ref().filter(|_| ran.cycles > 0);
        let recording = recording.map(|path| Ok::<_, Error>((path, session::mcap(&ran.session, cell)?))).transpose()?;
        let file =
            |(path, bytes): &(&PathBuf, Vec<u8>)| (path.display().to_string(), format!("sha256 {}", sha256_hex(bytes)));
        let files: Vec<(String, String)> = recording.iter().map(file).collect();
        let page = page(cell, ran, timing, (tone, words.clone()), &console.command, &files);
        // What came out is told also where it cannot be saved.
        if !self.outputs.takes_stdout() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        error.iter().for_each(|error| console.error(error));
        if let Some((path, bytes)) = &recording {
            console.write(path, bytes)?;
        }
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", json(ran, timing, &words)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        Ok(exit)
    }
}

/// What somebody else has to say against a run: how it is said in the page, and what goes to standard error.
pub struct Complaint {
    /// What the command ends with.
    pub exit: Exit,
    /// The verdict.
    pub words: String,
    /// The error, where it is one.
    pub error: Option<Error>,
}

/// How a run ended.
struct End {
    exit: Exit,
    tone: Tone,
    words: String,
    error: Option<Error>,
}

impl End {
    fn of(cell: &Cell, ran: &Ran, complaint: Option<Complaint>) -> Self {
        let end = |exit, words: &str, error| {
            let tone = match exit {
                Exit::Pass => Tone::Good,
                Exit::Interrupted => Tone::Warning,
                _ => Tone::Bad,
            };
            End { exit, tone, words: words.to_owned(), error }
        };
        if let Some(Complaint { exit, words, error }) = complaint {
            return end(exit, &words, error);
        }
        if ran.interrupted {
            let words = format!("interrupted by a signal after {} of {} cycles", ran.cycles, ran.planned);
            return end(Exit::Interrupted, &words, None);
        }
        if ran.left {
            let what = format!("the controller left in cycle {} of {}", ran.cycles, ran.planned);
            let help = "a controller answers until no frame comes any more; of two robots, both ports must be bound";
            return end(Exit::Failed, &format!("fail: {what}"), Some(Error::new(what).help(help)));
        }
        let idle = ran.idle();
        if !idle.is_empty() {
            let error = did_nothing(&idle, "[[fault]]").file(&cell.source.file);
            return end(Exit::Idle, "the run says nothing: a fault did nothing", Some(error));
        }
        match ran.stops.first() {
            Some((robot, _)) => end(Exit::Failed, &format!("fail: {robot} stopped"), None),
            None => end(Exit::Pass, "pass: no robot stopped, and the controller stayed to the end", None),
        }
    }
}

impl Timed {
    /// As the wires want it.
    pub fn pace(&self, cell: &Cell) -> Pace {
        if self.real_time {
            return Pace::Real(Nanos::from_seconds(cell.config.time.cycle_s));
        }
        Pace::Virtual { patience: Duration::from_millis(self.patience) }
    }

    /// How long to wait for the controller.
    pub fn ready(&self) -> Duration {
        Duration::from_secs(self.wait)
    }
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        if self.schema {
            console.print(&format!("{:#}\n", cell::schema(catalog)));
            return Ok(Exit::Pass);
        }
        let Some(named) = &self.cell else {
            console.print(&fault_list::text());
            return Ok(Exit::Pass);
        };
        if let Some(folder) = &self.extract {
            return self.extract(named, folder, console);
        }
        let cell = self.running.read(named)?;
        // What is wrong with the cell is said before anybody is waited for.
        check(&cell, catalog)?;
        let addresses = Addresses::of(&cell);
        let mut wires = Wires::bind(&cell, &addresses, self.timed.pace(&cell), self.timed.ready())?;
        let robots: Vec<String> = addresses
            .robots
            .iter()
            .enumerate()
            .map(|(nth, robot)| told(&cell, nth, *robot))
            .collect::<Result<_, _>>()?;
        let page = wires.page().map(|page| format!(", its page at {page}")).unwrap_or_default();
        console.say(&format!("sensor at {}{page}; frames go to {}\n", wires.sensor(), robots.join(" and ")));
        let interrupt = Interrupt::watch()?;
        wires.end_when(move || interrupt.asked());
        let progress = console.progress();
        wires.tell(move |text| progress.say(text));
        let ran = run(&cell, catalog, &self.running.options(), &mut wires)?;
        let timing = self.timed.real_time.then_some(&wires.timing);
        self.running.ended(&cell, &ran, timing, None, console)
    }
}

/// Where a robot's frames go, and how.
fn told(cell: &Cell, nth: usize, address: SocketAddr) -> Result<String, Error> {
    Ok(match cell.ethernet(nth)?.protocol {
        Transport::Udp => address.to_string(),
        Transport::Tcp => format!("{address} over TCP"),
    })
}

impl Arguments {
    fn extract(&self, named: &Path, folder: &Path, console: &mut Console<'_>) -> Result<Exit, Error> {
        let cell = Cell::find(named)?;
        let name = cell.source.file.file_name().unwrap_or_default();
        let beside = cell.config.robots.iter().map(|robot| robot.rsi.as_str()).zip(&cell.rsi);
        let own = [(Path::new(name), &cell.source), (Path::new(&cell.config.model), &cell.model)];
        let files = own.into_iter().chain(beside.map(|(path, file)| (Path::new(path), file)));
        let files = files.map(|(path, from)| Extracted { to: folder.join(path), text: &from.text });
        let mut files: Vec<_> = files.collect();
        files.dedup_by(|a, b| a.to == b.to);
        inputs::extract(&files, cell.files(), self.running.force, console)?;
        Ok(Exit::Pass)
    }
}

/// What a run did, as data.
fn json(ran: &Ran, timing: Option<&Timing>, verdict: &str) -> serde_json::Value {
    let stops: Vec<_> =
        ran.stops.iter().map(|(robot, why)| serde_json::json!({ "robot": robot, "why": why })).collect();
    serde_json::json!({
        "schema": 1,
        "verdict": verdict,
        "cycles": ran.cycles,
        "planned": ran.planned,
        "answered": ran.answered,
        "contact_s": ran.contact_s,
        "peak_n": ran.peak.map(|(peak_n, _)| peak_n),
        "peak_at_s": ran.peak.map(|(_, at_s)| at_s),
        "exchange": ran.fingerprint(),
        "left_early": ran.left,
        "interrupted": ran.interrupted,
        "stops": stops,
        "cell_events": ran.events,
        "first_of_cell_events": ran.first_of,
        "driver_events": ran.driver,
        "faults": ran.faults,
        "real_time": timing,
    })
}

/// The cell as a program under test is told it: a path, or a name inside the program.
pub(super) fn named(cell: &Path) -> String {
    cell.display().to_string()
}
