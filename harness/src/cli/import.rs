//! `dockhil import`: a session from what another program recorded.

use super::console::Console;
use super::inputs;
use super::outcome::Exit;
use super::recorded;
use super::shortfall::{nothing, too_fast};
use crate::cell::Cell;
use crate::error::Error;
use crate::recorder::{Devices, Recorder, clocks, remarks, session_record, tap};
use crate::recording::Kind;
use clap::{Args, Subcommand};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil import`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// RSI and force/torque traffic that Wireshark or tcpdump captured; both directions, so that commands are known.
    ///
    /// The clocks of all devices are fitted to the whole capture before a time is written.
    Pcap(Pcap),
}

#[derive(Debug, Args)]
struct Pcap {
    /// A pcap or pcapng.
    #[arg(value_name = "FILE")]
    capture: PathBuf,
    /// The cell whose addresses are in the capture.
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// The session.
    #[arg(short, long, value_name = "S.mcap")]
    output: PathBuf,
    /// What was done meanwhile: static, free-flight or impact.
    #[arg(long, value_name = "KIND", value_parser = recorded::kind)]
    kind: Kind,
    /// Overwrite the session.
    #[arg(long)]
    force: bool,
    /// Save the summary as JSON; `-` prints it instead of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let What::Pcap(pcap) = &self.what;
        pcap.run(catalog, console)
    }
}

impl Pcap {
    fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let cell = Cell::find(&self.cell)?;
        let mut devices = Devices::of(&cell, false)?;
        let record = session_record(&cell, catalog, self.kind, "import")?;
        inputs::writable_new(&self.output, self.force)?;
        let read = cell.files().into_iter().chain([&self.capture]);
        inputs::not_read(&self.output, read.clone())?;
        if let Some(json) = &self.json {
            inputs::result(json, read.clone())?;
            inputs::not_the_same(json, &self.output)?;
        }
        let named = |error: Error| error.file(&self.capture);
        recorded::warn(&remarks(&cell)?, console);
        let (lines, summary, tapped) = clocks(&mut recorded::open(&self.capture)?, &cell, &devices).map_err(named)?;
        if tapped.matched.from_robots + tapped.matched.from_sensor == 0 {
            return Err(named(nothing(Some(&tapped))));
        }
        if let Some(error) = too_fast(&summary) {
            return Err(named(error));
        }
        let beside = beside(&self.output);
        let failed = |error: std::io::Error| Error::new(format!("cannot write: {error}")).file(&self.output);
        let out = BufWriter::new(File::create(&beside).map_err(failed)?);
        let written = (|| {
            let mut recorder = Recorder::create(out, &cell.config, &record, Some(lines))?;
            let mut capture = recorded::open(&self.capture)?;
            let tapped = tap(&mut capture, &cell, &mut devices, &mut recorder, None, &|| false)?;
            recorded::note_capture(&mut recorder, &tapped)?;
            let (_, summary) = recorder.finish()?;
            std::fs::rename(&beside, &self.output).map_err(failed)?;
            Ok((summary, tapped))
        })();
        let (summary, tapped) = written.map_err(|error: Error| {
            // The file beside is ours; that it cannot be removed either adds nothing to the message.
            let _ = std::fs::remove_file(&beside);
            error.file(&self.output)
        })?;
        let outcome = recorded::Outcome {
            summary,
            tapped: Some(tapped),
            latencies: Vec::new(),
            file: Some(self.output.clone()),
            source: Some(self.capture.clone()),
            heard: Some(devices.heard().clone()),
        };
        recorded::tell(&outcome, &cell, self.json.as_deref(), console)
    }
}

/// Where the session grows until it is whole.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    path.with_file_name(name)
}
