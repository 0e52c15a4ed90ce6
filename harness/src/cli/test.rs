//! `dockhil test`: a controller under test against the virtual cell: started, watched, stopped, its output kept.

use super::cell::{CONTROLLER, Complaint, Running, Timed, named};
use super::console::Console;
use super::interrupt::Interrupt;
use super::outcome::Exit;
use crate::cell::Cell;
use crate::cell::controller::{Reference, Task};
use crate::cell::on_wire::OnWire;
use crate::cell::process::{Ended, Started, words};
use crate::cell::run::{InProcess, Options, Ran, check, run};
use crate::cell::timing::Timing;
use crate::cell::wires::{Addresses, Wires};
use crate::error::Error;
use clap::Args;
use drivers::net::{Endpoint, Listener, Lock};
use drivers::rsi::Transport;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// How long a program may take to end by itself after the exchange. Chosen: a controller notices silence within a second or two.
const END: Duration = Duration::from_millis(200);
/// What not every cell has.
const PLACEHOLDERS: [&str; 2] = ["{rsi2}", "{page}"];
/// The controller inside this program.
const REFERENCE: &str = "reference";

/// Arguments of `dockhil test`.
#[derive(Debug, Args)]
#[command(after_long_help = CONTROLLER)]
pub struct Arguments {
    /// The program to start, or `reference` for the one inside. `{rsi}` becomes the address where it is to be bound for the first
    /// robot, `{rsi2}` for the second, `{ft}` the address of the sensor, `{page}` that of its page, `{cell}` the path of the cell,
    /// `{position}` and `{velocity}` where and how fast the run begins along z, in m and m/s.
    #[arg(long, value_name = "COMMAND")]
    controller: String,
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    #[command(flatten)]
    running: Running,
    #[command(flatten)]
    timed: Timed,
    /// Run it twice, and name the first cycle that differs.
    #[arg(long, conflicts_with = "real_time")]
    twice: bool,
    /// What the reference controller inside does; `dock` if nothing is said.
    #[arg(long, value_enum)]
    task: Option<Task>,
}

/// What came of one run of a controller.
struct Tested {
    ran: Ran,
    timing: Option<Timing>,
    /// The program failed by itself.
    complaint: Option<Complaint>,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let is_inside = self.controller.trim() == REFERENCE;
        let refusal = match () {
            () if is_inside && self.timed.real_time => Some((
                "--real-time needs a program",
                "use --controller 'dockhil-controller --cell {cell} --rsi {rsi} --ft {ft}'",
            )),
            () if !is_inside && self.task.is_some() => {
                Some(("--task is for the reference inside", "give the task to the program in its own command"))
            }
            () => None,
        };
        if let Some((what, help)) = refusal {
            return Err(Error::new(what).place("argument --controller").help(help));
        }
        let cell = self.running.read(&self.cell)?;
        check(&cell, catalog)?;
        let starts =
            [("{position}", "--position", self.running.position), ("{velocity}", "--velocity", self.running.velocity)];
        for (key, flag, _) in starts.iter().filter(|(key, _, given)| given.is_some() && !self.controller.contains(key))
        {
            if !is_inside {
                console.say(&format!(
                    "{flag} is where the cell begins; the program is told only where its command has {key}\n"
                ));
            }
        }
        let tested = self.once(&cell, catalog, console)?;
        if self.twice && tested.complaint.is_none() && !tested.ran.interrupted {
            let again = self.once(&cell, catalog, console)?;
            if again.ran.interrupted {
                let cycles = again.ran.cycles;
                let words = format!("interrupted by a signal in cycle {cycles} of the second run; this is the first");
                let complaint = Complaint { exit: Exit::Interrupted, words, error: None };
                return self.running.ended(&cell, &tested.ran, tested.timing.as_ref(), Some(complaint), console);
            }
            if let Some(cycle) = tested.ran.first_difference(&again.ran) {
                let what =
                    format!("two runs of the controller differ, first in cycle {cycle}; what is told is the first");
                let help =
                    "the cell is the same both times: look for a clock, a random number or a race in the controller";
                let words = format!("fail: {what}");
                let error = Some(Error::new(what).place("argument --twice").help(help));
                let complaint = Complaint { exit: Exit::Diverged, words, error };
                return self.running.ended(&cell, &tested.ran, tested.timing.as_ref(), Some(complaint), console);
            }
            console.say("two runs are the same, bit for bit\n");
        }
        self.running.ended(&cell, &tested.ran, tested.timing.as_ref(), tested.complaint, console)
    }

    fn once(&self, cell: &Cell, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Tested, Error> {
        let options = self.running.options();
        if self.controller.trim() == REFERENCE {
            let ran = in_process(cell, catalog, &options, self.task.unwrap_or_default())?;
            return Ok(Tested { ran, timing: None, complaint: None });
        }
        let (ran, timing, ended) = self.external(cell, catalog, &options, console)?;
        if !ended.output.is_empty() {
            console.say(&format!("the controller printed:\n{}\n", ended.output.trim_end()));
        }
        let failure = ended.failure();
        let said = if ended.output.is_empty() { "it printed nothing" } else { "its output is above" };
        let with_failure = |error: Error| match &failure {
            Some(failure) => error.help(format!("it {failure}; {said}")),
            None => error,
        };
        let ran = ran.map_err(with_failure)?;
        let complaint = failure.as_ref().map(|failure| {
            let what = format!("the controller {failure} in cycle {} of {}", ran.cycles, ran.planned);
            Complaint {
                exit: Exit::Failed,
                words: "fail: the controller ended with an error of its own".to_owned(),
                error: Some(Error::new(what).place("argument --controller").help(said)),
            }
        });
        Ok(Tested { ran, timing: self.timed.real_time.then_some(timing), complaint })
    }

    fn external(
        &self,
        cell: &Cell,
        catalog: &Catalog<Axis>,
        options: &Options,
        console: &Console<'_>,
    ) -> Result<(Result<Ran, Error>, Timing, Ended), Error> {
        let mut addresses = Addresses::of(cell);
        // What the program is told can be chosen; what it is not told must be as the cell says.
        for (nth, key) in ["{rsi}", "{rsi2}"].iter().enumerate().take(addresses.robots.len()) {
            if self.controller.contains(key) {
                addresses.robots[nth] = free(addresses.robots[nth], cell.ethernet(nth)?.protocol)?;
            }
        }
        if self.controller.contains("{ft}") {
            addresses.sensor.set_port(0);
        }
        if let (true, Some(page)) = (self.controller.contains("{page}"), &mut addresses.page) {
            page.set_port(0);
        }
        let mut wires = Wires::bind(cell, &addresses, self.timed.pace(cell), self.timed.ready())?;
        let mut values = vec![("{ft}", wires.sensor().to_string()), ("{cell}", named(&self.cell))];
        for (key, address) in ["{rsi}", "{rsi2}"].into_iter().zip(&addresses.robots) {
            values.push((key, address.to_string()));
        }
        values.extend(wires.page().map(|page| ("{page}", page.to_string())));
        let first = cell.first()?;
        values.push(("{position}", first.position_m.to_string()));
        values.push(("{velocity}", first.velocity_m_per_s.to_string()));
        let interrupt = Interrupt::watch()?;
        wires.end_when(move || interrupt.asked());
        let progress = console.progress();
        wires.tell(move |text| progress.say(text));
        let filled = |word: &String| values.iter().fold(word.clone(), |word, (key, value)| word.replace(key, value));
        let words: Vec<String> = words(&self.controller)?.iter().map(filled).collect();
        if let Some(word) = words.iter().find(|word| PLACEHOLDERS.iter().any(|key| word.contains(key))) {
            let what = format!("{word:?} asks for what this cell does not have");
            let help = "a cell with two robots has {rsi2}, and one whose [sensor] has a page has {page}";
            return Err(Error::new(what).place("argument --controller").help(help));
        }
        wires.watch(Started::start(&words)?);
        let ran = run(cell, catalog, options, &mut wires);
        let started = wires.release().expect("it was given to be watched");
        Ok((ran, wires.timing, started.stop(END)))
    }
}

/// The reference controller in this process.
///
/// # Errors
/// When the cell's files cannot go together.
pub fn in_process(cell: &Cell, catalog: &Catalog<Axis>, options: &Options, task: Task) -> Result<Ran, Error> {
    let controller = Reference::new(&cell.model(catalog)?, cell.first()?, task);
    run(cell, catalog, options, &mut InProcess(OnWire::new(cell, controller)?))
}

/// A port that nobody has now.
fn free(address: SocketAddr, transport: Transport) -> Result<SocketAddr, Error> {
    let any = SocketAddr::new(address.ip(), 0);
    let bound = match transport {
        Transport::Udp => Endpoint::bind(any, Lock::Latest).map(|socket| socket.local()),
        Transport::Tcp => Listener::bind(any).map(|socket| socket.local()),
    };
    bound.map_err(|error| Error::new(format!("no port is free on {}: {error}", address.ip())).help("correct listen"))
}
