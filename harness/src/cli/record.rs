//! `dockhil record`: a real cell, recorded while it works.

use super::console::Console;
use super::inputs;
use super::outcome::Exit;
use super::recorded;
use crate::cell::Cell;
use crate::error::Error;
use crate::recorder::{Devices, Peer, Proxy, Recorder, sensor_transport, session_record, tap};
use crate::recording::Kind;
use clap::{Args, ValueEnum};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

const LONG_ABOUT: &str = "\
Record a real cell: robots, sensor, clocks and everything unusual.

What goes to the robot, and what may move:
  tap    nothing is sent; packets come from a capture (tcpdump -i any -U -w - … | dockhil record --as tap --pcap -)
  proxy  what the PC's program sends, byte by byte; what that program moves
  peer   one reply to each frame, with zero in every correction; nothing, if RSI was started with corrections at zero

To be sure before a robot is involved:
  1. Record with tap first. It binds no port and sends nothing.
  2. For peer, connect RECEIVE to no correction in the robot's object graph, or set ONLYSEND to TRUE: then no reply can move it.
  3. With corrections connected, an absolute zero means \"where RSI was started\". If another program corrected before, in the
     same RSI session, zero is a jump: start RSI anew. Absolute with HOLDON 0 and relative with HOLDON 1 are refused.
  4. Keep POSCORR and POSCORRMON at their few millimetres, run in T1, a hand at the enabling switch.
  5. When the recording ends, so do the replies; the controller then stops RSI (RSITimeout). That is a stop, not a motion.
The sensor is asked to stream and to stop, nothing else. Its bias is never set.

A recording that is killed keeps all but its last 0.1 s; `compare` and `diagnose` read it with grade B.";

/// How the program takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum As {
    /// The robots' PC: answers every frame with zero corrections.
    Peer,
    /// Between the robots and their PC.
    Proxy,
    /// Not at all: packets come from a capture.
    Tap,
}

/// Arguments of `dockhil record`.
#[derive(Debug, Args)]
#[command(long_about = LONG_ABOUT)]
pub struct Arguments {
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// The session; an old one is never replaced.
    #[arg(short, long, value_name = "S.mcap")]
    output: PathBuf,
    /// What is done meanwhile: static, free-flight or impact.
    #[arg(long, value_name = "KIND", value_parser = recorded::kind)]
    kind: Kind,
    /// How to take part.
    #[arg(long = "as", value_enum, default_value_t = As::Peer)]
    part: As,
    /// How long, in s.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = duration)]
    duration_s: f64,
    /// proxy: where a robot sends from now on, once for each robot of the cell; its PC stays at `listen`.
    #[arg(long, value_name = "IP:PORT")]
    robot_side: Vec<SocketAddr>,
    /// proxy: where the PC finds the sensor from now on; without it the sensor is not recorded.
    #[arg(long, value_name = "IP:PORT")]
    sensor_side: Option<SocketAddr>,
    /// tap: a pcap or pcapng; `-` is standard input.
    #[arg(long, value_name = "FILE", required_if_eq("part", "tap"))]
    pcap: Option<PathBuf>,
    /// Save the summary as JSON; `-` prints it instead of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn duration(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().map_err(|_| "expected a number of seconds".to_owned())?;
    // A week: beyond, the index of a recording outgrows memory.
    let is_sound = seconds > 0.0 && seconds <= 604_800.0;
    if is_sound { Ok(seconds) } else { Err(format!("{seconds} s is outside (0, 604800]")) }
}

/// A clock that only goes forward and begins with the computer's time.
fn clock() -> impl Fn() -> Nanos {
    #[expect(clippy::disallowed_types, reason = "a recorder of real devices needs the real time")]
    let (begun, since_1970) = {
        let now = std::time::SystemTime::now().duration_since(std::time::SystemTime::UNIX_EPOCH);
        (std::time::Instant::now(), now.map_or(0, |since| since.as_nanos()))
    };
    // Until the year 2262.
    move || Nanos(i64::try_from(since_1970 + begun.elapsed().as_nanos()).unwrap_or(i64::MAX))
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.consistent()?;
        let cell = Cell::find(&self.cell)?;
        let mut devices = Devices::of(&cell, self.part == As::Peer)?;
        let how = match self.part {
            As::Peer => "peer",
            As::Proxy => "proxy",
            As::Tap => "tap",
        };
        let record = session_record(&cell, catalog, self.kind, how)?;
        inputs::writable_new(&self.output, false)?;
        let result = match self.part {
            As::Peer => self.peer(&cell, &mut devices, &record, console),
            As::Proxy => self.proxy(&cell, &mut devices, &record, console),
            As::Tap => self.tap(&cell, &mut devices, &record),
        };
        let outcome = result.map_err(|error| error.file(&self.output))?;
        recorded::tell(&outcome, self.json.as_deref(), &self.output, console)
    }

    fn consistent(&self) -> Result<(), Error> {
        let is_proxy = self.part == As::Proxy;
        let what = match () {
            () if !is_proxy && (!self.robot_side.is_empty() || self.sensor_side.is_some()) => {
                "--robot-side and --sensor-side are for --as proxy"
            }
            () if self.part != As::Tap && self.pcap.is_some() => "--pcap is for --as tap",
            () => return Ok(()),
        };
        Err(Error::new(what).help("dockhil record --help tells the three ways of taking part"))
    }

    /// The file, new, with the beginning of a session in it.
    fn begin(&self, cell: &Cell, record: &BTreeMap<String, String>) -> Result<Recorder<File>, Error> {
        let file = File::create_new(&self.output).map_err(|error| {
            Error::new(format!("cannot write: {error}")).help("check that the folder exists and is writable")
        })?;
        Recorder::create(file, &cell.config, record, None)
    }

    fn until(&self, now: Nanos) -> Nanos {
        now + Nanos::from_seconds(self.duration_s)
    }

    fn peer(
        &self,
        cell: &Cell,
        devices: &mut Devices,
        record: &BTreeMap<String, String>,
        console: &mut Console<'_>,
    ) -> Result<recorded::Outcome, Error> {
        let mut peer = Peer::open(cell, devices, sensor_transport(cell)?)?;
        let mut recorder = self.begin(cell, record)?;
        console.say(&format!("waiting for robots at {}\n", listed(&peer.addresses())));
        let now = clock();
        peer.run(devices, &mut recorder, &now, self.until(now()))?;
        let (_, summary) = recorder.finish()?;
        Ok(recorded::Outcome { summary, tapped: None, latencies: Vec::new() })
    }

    fn proxy(
        &self,
        cell: &Cell,
        devices: &mut Devices,
        record: &BTreeMap<String, String>,
        console: &mut Console<'_>,
    ) -> Result<recorded::Outcome, Error> {
        let mut proxy = Proxy::open(cell, devices, &self.robot_side, self.sensor_side)?;
        let mut recorder = self.begin(cell, record)?;
        console.say(&format!("waiting for robots at {}\n", listed(&proxy.addresses())));
        match proxy.sensor_address() {
            Some(address) => console.say(&format!("the sensor is at {address} for the PC\n")),
            None => console.say("without --sensor-side the sensor is not recorded, and `compare` needs it\n"),
        }
        let now = clock();
        proxy.run(devices, &mut recorder, &now, self.until(now()))?;
        let named = [
            ("robot to PC", proxy.to_pc.spread()),
            ("PC to robot", proxy.to_robot.spread()),
            ("sensor to PC", proxy.from_sensor.spread()),
        ];
        let latencies: Vec<_> = named.into_iter().filter_map(|(name, spread)| Some((name, spread?))).collect();
        let text = |spread| serde_json::to_string(spread).unwrap_or_default();
        let metadata = latencies.iter().map(|(name, spread)| ((*name).to_owned(), text(spread))).collect();
        recorder.metadata("proxy_latency", &metadata)?;
        let (_, summary) = recorder.finish()?;
        Ok(recorded::Outcome { summary, tapped: None, latencies })
    }

    fn tap(
        &self,
        cell: &Cell,
        devices: &mut Devices,
        record: &BTreeMap<String, String>,
    ) -> Result<recorded::Outcome, Error> {
        let path = self.pcap.as_deref().unwrap_or(Path::new("-"));
        let mut capture: Box<dyn Read> =
            if path == Path::new("-") { Box::new(std::io::stdin()) } else { Box::new(recorded::open(path)?) };
        let mut recorder = self.begin(cell, record)?;
        let longest = Nanos::from_seconds(self.duration_s);
        let tapped = tap(capture.as_mut(), cell, devices, &mut recorder, Some(longest))?;
        recorded::note_capture(&mut recorder, &tapped)?;
        let (_, summary) = recorder.finish()?;
        Ok(recorded::Outcome { summary, tapped: Some(tapped), latencies: Vec::new() })
    }
}

fn listed(addresses: &[SocketAddr]) -> String {
    addresses.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
