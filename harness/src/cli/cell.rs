//! `dockhil cell`: the virtual cell on real sockets. It waits for a controller, and says how the run ended.

use super::console::Console;
use super::inputs;
use super::interrupt::Interrupt;
use super::outcome::Exit;
use super::run::did_nothing;
use crate::cell::run::{Options, Ran, run};
use crate::cell::wires::{Addresses, Pace, Timing, Wires};
use crate::cell::{Cell, fault_list, session};
use crate::error::Error;
use crate::files::write_whole;
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
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    pub duration: f64,
    /// Begin here along z instead of where the cell says, in m; positive is penetration.
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    pub position: Option<f64>,
    /// Begin with this speed along z instead of the cell's, in m/s.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    pub velocity: Option<f64>,
    /// Draw noise and faults from this seed instead of the cell's.
    #[arg(long, value_parser = inputs::seed)]
    pub seed: Option<u64>,
    /// Save what happened as JSON; `-` prints it instead of the text.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// How real sockets are served.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Time")]
pub struct Timed {
    /// Keep the cycle of the robot controller by the clock on the wall, and report how well it was kept.
    #[arg(long)]
    pub real_time: bool,
    /// Virtual time: how long an answer may take before it counts as missing, in ms.
    #[arg(long, value_name = "MS", default_value_t = PATIENCE_MS)]
    pub patience: u64,
    /// How long to wait for the controller to come, in s.
    #[arg(long, value_name = "S", default_value_t = 60)]
    pub wait: u64,
}

/// Arguments of `dockhil cell`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml", required_unless_present = "list_faults")]
    cell: Option<PathBuf>,
    #[command(flatten)]
    running: Running,
    #[command(flatten)]
    timed: Timed,
    /// Save the cell, its model and its Ethernet configurations to a folder, to be changed there; nothing is run.
    #[arg(long, value_name = "FOLDER")]
    extract: Option<PathBuf>,
    /// List the faults of the wire with their parameters, and end.
    #[arg(long, conflicts_with = "cell")]
    list_faults: bool,
}

impl Running {
    /// Reads the cell, and refuses now what could not be written later.
    pub fn read(&self, cell: &Path) -> Result<Cell, Error> {
        let mut cell = Cell::find(cell)?;
        if let Some(velocity_m_per_s) = self.velocity {
            if velocity_m_per_s.is_nan() || velocity_m_per_s.abs() > 10.0 {
                let what = format!("--velocity {velocity_m_per_s} m/s is outside [-10, 10]");
                return Err(Error::new(what).help("give the speed in m/s; positive closes the gap"));
            }
            cell.config.start.velocity_m_per_s = velocity_m_per_s;
        }
        if let Some(position_m) = self.position {
            cell.begin_at(position_m)?;
        }
        cell.config.seed = self.seed.or(cell.config.seed);
        if let Some(path) = &self.output {
            let read = [&cell.source.file, &cell.model.file].into_iter().chain(cell.rsi.iter().map(|file| &file.file));
            inputs::not_read(path, read)?;
            inputs::writable_new(path, self.force)?;
        }
        Ok(cell)
    }

    /// How long it runs.
    pub fn options(&self) -> Options {
        Options { duration_s: self.duration }
    }

    /// Says how a run ended, saves it, and gives its exit code.
    pub fn ended(
        &self,
        cell: &Cell,
        ran: &Ran,
        timing: Option<&Timing>,
        complaint: Option<&Error>,
        console: &mut Console<'_>,
    ) -> Result<Exit, Error> {
        if self.json.as_ref().is_none_or(|path| path.as_os_str() != "-") {
            timing.iter().for_each(|timing| console.print(&kept(timing, cell.config.time.cycle_s)));
            console.print(&summary(ran));
        }
        if let Some(path) = &self.output {
            write_whole(path, &session::mcap(&ran.session, cell)?)?;
            console.say(&format!("{}: written\n", path.display()));
        }
        if let Some(path) = &self.json {
            console.save(path, &format!("{:#}\n", json(ran, timing)))?;
        }
        if let Some(complaint) = complaint {
            console.error(complaint);
            return Ok(Exit::Failed);
        }
        if ran.left {
            let what = format!("the controller left in cycle {} of {}", ran.cycles, ran.planned);
            let help = "a controller answers until no frame comes any more; of two robots, both ports must be bound";
            console.error(&Error::new(what).help(help));
            return Ok(Exit::Failed);
        }
        let idle = ran.idle();
        if !idle.is_empty() {
            console.error(&did_nothing(&idle, "[[fault]]").file(&cell.source.file));
            return Ok(Exit::Idle);
        }
        if ran.interrupted {
            console.say(&format!("ended by a signal in cycle {} of {}\n", ran.cycles, ran.planned));
            return Ok(Exit::Undecided);
        }
        Ok(if ran.stops.is_empty() { Exit::Pass } else { Exit::Failed })
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
        let Some(named) = &self.cell else {
            console.print(&fault_list::text());
            return Ok(Exit::Pass);
        };
        if let Some(folder) = &self.extract {
            return self.extract(named, folder, console);
        }
        let cell = self.running.read(named)?;
        // What is wrong with the cell is said before anybody is waited for.
        cell.model(catalog)?;
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
        let mut files = vec![(folder.join(name), &cell.source)];
        files.extend(
            [(cell.config.model.as_str(), &cell.model)]
                .into_iter()
                .chain(beside)
                .map(|(path, text)| (folder.join(path), text)),
        );
        files.dedup_by(|a, b| a.0 == b.0);
        for (path, from) in &files {
            let parent = path.parent().unwrap_or(folder);
            std::fs::create_dir_all(parent).map_err(|error| {
                Error::new(format!("cannot make the folder: {error}"))
                    .file(parent)
                    .help("name another one after --extract")
            })?;
            inputs::not_read(path, [&from.file].into_iter())?;
            inputs::writable_new(path, self.running.force)?;
        }
        for (path, from) in &files {
            write_whole(path, from.text.as_bytes())?;
            console.print(&format!("{}: written\n", path.display()));
        }
        Ok(Exit::Pass)
    }
}

/// What a run did, in a few lines.
fn summary(ran: &Ran) -> String {
    let mut text = format!("{} cycles, {} answered, exchange {}\n", ran.cycles, ran.answered, ran.fingerprint());
    for one in &ran.faults {
        let first = one.first.map(|first| format!(", first on packet {first}")).unwrap_or_default();
        let times = if one.acted == 1 { "time" } else { "times" };
        text.push_str(&format!("fault {}: acted {} {times}{first}\n", one.fault, one.acted));
    }
    let cell = ran.events.iter().map(|(class, count)| (*class, count));
    let driver = ran.driver.iter().map(|(class, count)| (class.as_str(), count));
    for (who, class, count) in
        cell.map(|(class, count)| ("cell", class, count)).chain(driver.map(|(class, count)| ("driver", class, count)))
    {
        text.push_str(&format!("{who} {class}: {count}\n"));
    }
    for (robot, why) in &ran.stops {
        text.push_str(&format!("{robot}: {why}\n"));
    }
    text
}

/// The same as data.
fn json(ran: &Ran, timing: Option<&Timing>) -> serde_json::Value {
    let stops: Vec<_> =
        ran.stops.iter().map(|(robot, why)| serde_json::json!({ "robot": robot, "why": why })).collect();
    serde_json::json!({
        "schema": 1,
        "cycles": ran.cycles,
        "planned": ran.planned,
        "answered": ran.answered,
        "exchange": ran.fingerprint(),
        "left_early": ran.left,
        "interrupted": ran.interrupted,
        "stops": stops,
        "cell_events": ran.events,
        "driver_events": ran.driver,
        "faults": ran.faults,
        "real_time": timing,
    })
}

/// How well real time was kept.
pub(super) fn kept(timing: &Timing, cycle_s: f64) -> String {
    let us = |ns: i64| ns as f64 * 1e-3;
    let mean = |sum_ns: i64, count: u64| us(sum_ns) / count.max(1) as f64;
    let ([late_sum, late_most], (answers, [took_sum, took_most])) = (timing.late_ns, timing.answers);
    format!(
        "real time, {} cycles of {} ms\n\
         frames sent late: mean {:.0} us, at most {:.0} us\n\
         answers: {answers} in time, mean {:.0} us, at most {:.0} us; {} late or missing\n\
         load: {:.1} % of the time not waiting\n",
        timing.cycles,
        cycle_s * 1e3,
        mean(late_sum, timing.cycles),
        us(late_most),
        mean(took_sum, answers),
        us(took_most),
        timing.missing,
        100.0 * timing.busy_ns as f64 / timing.total_ns.max(1) as f64,
    )
}

/// The cell as a program under test is told it: a path, or a name inside the program.
pub(super) fn named(cell: &Path) -> String {
    cell.display().to_string()
}
