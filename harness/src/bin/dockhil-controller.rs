//! The reference controller as a program of its own: satellites, compensation and virtual contact of the cell's model, over RSI and
//! F/T on real sockets. It ends when the cell has been silent.

use clap::Parser;
use harness::cell::Cell;
use harness::cell::controller::{Reference, Task};
use harness::cell::on_wire::OnWire;
use harness::cell::serve::Served;
use harness::cell::wires::Addresses;
use harness::error::Error;
use std::collections::BTreeMap;
use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
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
    #[arg(long, value_name = "MS", default_value_t = 1500)]
    silence: u64,
}

fn main() -> ExitCode {
    match serve(&Arguments::parse()) {
        Ok((answered, events)) => {
            let mut text = format!("{answered} frames answered\n");
            for (class, count) in events {
                text.push_str(&format!("{class}: {count}\n"));
            }
            // Nobody can be told that standard output is closed.
            let _ = write!(std::io::stdout(), "{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            let help = error.help.as_ref().map(|help| format!("\n  help: {help}")).unwrap_or_default();
            let _ = writeln!(std::io::stderr(), "{error}{help}");
            ExitCode::from(2)
        }
    }
}

/// Frames that were answered, and everything unusual by its class.
fn serve(arguments: &Arguments) -> Result<(u64, BTreeMap<String, u64>), Error> {
    let mut cell = Cell::find(&arguments.cell)?;
    cell.config.start.velocity_m_per_s = arguments.velocity.unwrap_or(cell.config.start.velocity_m_per_s);
    if let Some(position_m) = arguments.position {
        cell.begin_at(position_m)?;
    }
    let model = cell.model(&sim_core::effects::standard())?;
    let mut addresses = Addresses::of(&cell);
    if arguments.rsi.len() > addresses.robots.len() {
        let what = format!("--rsi names {} addresses for {} robots", arguments.rsi.len(), addresses.robots.len());
        return Err(Error::new(what).help("give one for each robot of the cell"));
    }
    addresses.robots.iter_mut().zip(&arguments.rsi).for_each(|(address, given)| *address = *given);
    addresses.sensor = arguments.ft.unwrap_or(addresses.sensor);
    let controller = Reference::new(&model, cell.first()?, arguments.task);
    let mut on_wire = OnWire::new(&cell, controller)?;
    let mut served = Served::bind(&cell, &addresses)?;
    let (patience, silence) = (Duration::from_secs(arguments.wait), Duration::from_millis(arguments.silence));
    let answered = served.serve(&mut on_wire, patience, silence)?;
    Ok((answered, on_wire.events))
}
