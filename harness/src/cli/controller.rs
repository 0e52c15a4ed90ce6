//! `dockhil-controller`: the reference controller as a program of its own, over RSI and F/T on real sockets. It ends when the cell
//! has been silent, and says what it saw.

use super::console::Console;
use super::interrupt::Interrupt;
use super::outcome::Exit;
use crate::cell::Cell;
use crate::cell::controller::{Reference, Task};
use crate::cell::on_wire::OnWire;
use crate::cell::page_reader::check_page;
use crate::cell::serve::Served;
use crate::cell::wires::Addresses;
use crate::error::Error;
use clap::Parser;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// The software half of a docking simulator: answers the robots of a cell, and listens to its sensor.
#[derive(Debug, Parser)]
#[command(name = "dockhil-controller", version)]
struct Arguments {
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// Where to be bound, one for each robot in the order of the cell; as the cell says, if none is given.
    #[arg(long, value_name = "ADDRESS", value_delimiter = ',')]
    rsi: Vec<SocketAddr>,
    /// Where the sensor is; as the cell says, if it is not given.
    #[arg(long, value_name = "ADDRESS")]
    ft: Option<SocketAddr>,
    /// Where the sensor's page is, which is held against the cell; as the cell says, if it is not given.
    #[arg(long, value_name = "ADDRESS")]
    page: Option<SocketAddr>,
    /// What it does.
    #[arg(long, value_enum, default_value_t)]
    task: Task,
    /// Begin here along z instead of where the cell says, in m; positive is penetration.
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    position: Option<f64>,
    /// Begin with this speed along z instead of the cell's, in m/s.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    velocity: Option<f64>,
    /// How long to wait for the first frame, in s.
    #[arg(long, value_name = "S", default_value_t = 60)]
    wait: u64,
    /// End after this silence, in ms.
    #[arg(long, value_name = "MS", default_value_t = 1500, value_parser = clap::value_parser!(u64).range(1..))]
    silence: u64,
}

/// Runs one command line, `args[0]` being the program; returns the exit code: 0, 2 for an error, or 4 if no frame came.
pub fn controller(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    catalog: &Catalog<Axis>,
    console: &mut Console<'_>,
) -> u8 {
    let arguments = match Arguments::try_parse_from(args) {
        Ok(arguments) => arguments,
        Err(error) if error.use_stderr() => {
            console.say(&error.render().to_string());
            return Exit::BadInput.code();
        }
        Err(error) => {
            console.print(&error.render().to_string());
            return Exit::Pass.code();
        }
    };
    let mut events = BTreeMap::new();
    let mut after = BTreeMap::new();
    let served = arguments.serve(catalog, &mut events, &mut after);
    if let Ok(answered) = served {
        console.print(&format!("{answered} frames answered\n"));
    }
    for (class, count) in &events {
        console.print(&format!("{class}: {count}\n"));
    }
    for (class, count) in &after {
        console.print(&format!("after the last frame, {class}: {count}\n"));
    }
    match served.and_then(|answered| console.finish().map(|()| answered)) {
        Ok(0) => {
            let what = format!("no frame of a robot came in {} s", arguments.wait);
            let help =
                "start the cell or RSI first, or give more time: --wait; check the ports of --rsi or of the cell";
            console.error(&Error::new(what).help(help));
            Exit::NothingToRun.code()
        }
        Ok(_) => Exit::Pass.code(),
        Err(error) => {
            console.error(&error);
            Exit::BadInput.code()
        }
    }
}

impl Arguments {
    /// How many frames were answered; what else was seen, by class, is added to `events`, and to `after` if it came after the last
    /// frame.
    fn serve(
        &self,
        catalog: &Catalog<Axis>,
        events: &mut BTreeMap<String, u64>,
        after: &mut BTreeMap<String, u64>,
    ) -> Result<u64, Error> {
        let mut cell = Cell::find(&self.cell)?;
        cell.begin_at(self.position, self.velocity)?;
        let model = cell.model(catalog)?;
        let mut addresses = Addresses::of(&cell);
        if self.rsi.len() > addresses.robots.len() {
            let what = format!("--rsi names {} addresses for {} robots", self.rsi.len(), addresses.robots.len());
            return Err(Error::new(what).help("give one for each robot of the cell"));
        }
        addresses.robots.iter_mut().zip(&self.rsi).for_each(|(address, given)| *address = *given);
        addresses.sensor = self.ft.unwrap_or(addresses.sensor);
        if let Some(page) = self.page.or(addresses.page) {
            check_page(&cell, page, events)?;
        }
        let controller = Reference::new(&model, cell.first()?, self.task);
        let mut on_wire = OnWire::new(&cell, controller)?;
        let mut served = Served::bind(&cell, &addresses)?;
        let (patience, silence) = (Duration::from_secs(self.wait), Duration::from_millis(self.silence));
        let interrupt = Interrupt::watch()?;
        let answered = served.serve(&mut on_wire, patience, silence, &|| interrupt.asked());
        *after = served.after;
        for (class, count) in on_wire.events {
            *events.entry(class).or_default() += count;
        }
        answered
    }
}
