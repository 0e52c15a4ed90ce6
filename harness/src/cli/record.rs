//! `dockhil record`: a real cell, recorded while it works, until its time is over or somebody presses Ctrl-C.

use super::console::Console;
use super::inputs;
use super::interrupt::Interrupt;
use super::outcome::Exit;
use super::recorded::{self, Outcome};
use super::shortfall::too_fast;
use crate::cell::Cell;
use crate::cell::page_reader::check_page;
use crate::error::Error;
use crate::recorder::{Devices, Peer, Proxy, Recorder, Spread, Tapped, remarks, sensor_transport, session_record, tap};
use crate::recording::Kind;
use clap::{Args, ValueEnum};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::fs::File;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

const PAGE: &str = "\
What goes to the robot, and what may move:
  tap    nothing is sent; packets come from a capture (tcpdump -i any -U -w - … | dockhil record --as tap --pcap -)
  proxy  what the PC's program sends, byte by byte; what that program moves
  peer   one reply to each frame, with zero in every correction; nothing, if RSI was started with corrections at zero

To be sure before a robot is involved:
  1. Record with tap first. It binds no port and sends nothing.
  2. For peer, connect RECEIVE to no correction in the robot's object graph, or set ONLYSEND to TRUE: then no reply can move it.
  3. With corrections connected, an absolute zero means \"where RSI was started\". If another program corrected before, in the
     same RSI session, zero is a jump: start RSI anew. Absolute with HOLDON 0 and relative with HOLDON 1 are refused.
  4. Corrections of axes (AK.A1 … AK.A6, as the ROS drivers have them) are zero too. That is no motion only if the RSI context
     leads them to an AXISCORR object, which adds them to the programmed axes. A context that takes them as joint angles, or
     adds something to them, moves to that: look into it, or use ONLYSEND. The same holds for every other number of RECEIVE.
  5. Keep POSCORR and POSCORRMON (AXISCORR and AXISCORRMON) at their few millimetres (degrees), run in T1, a hand at the
     enabling switch. The limits that the ROS drivers deliver are 90 degrees and more.
  6. When the recording ends, so do the replies; the controller then stops RSI (RSITimeout). That is a stop, not a motion.
The sensor is asked to stream and to stop, nothing else; with --bias its zero is set before. What others ask it for is recorded.
Where the cell names the sensor's page, peer and proxy read it first, and refuse a cell that says something else.

Ctrl-C, SIGTERM and SIGHUP end a recording well; a second one kills the program. A recording that is killed keeps all but its last 0.1 s;
`compare` and `diagnose` read it with grade B.";

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
#[command(after_long_help = PAGE)]
pub struct Arguments {
    /// The cell: a file, or the name of one inside the program.
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// The session.
    #[arg(short, long, value_name = "S.mcap")]
    output: PathBuf,
    /// Overwrite the session, as soon as the recording begins.
    #[arg(long)]
    force: bool,
    /// What is done meanwhile: static, free-flight or impact.
    #[arg(long, value_name = "KIND", value_parser = recorded::kind)]
    kind: Kind,
    /// How to take part.
    #[arg(long = "as", value_enum, default_value_t = As::Peer)]
    part: As,
    /// How long, in s; Ctrl-C ends it before.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = duration)]
    duration_s: f64,
    /// proxy: where a robot sends from now on, once for each robot of the cell; its PC stays at `listen`.
    #[arg(long, value_name = "IP:PORT")]
    robot_side: Vec<SocketAddr>,
    /// proxy: where the PC finds the sensor from now on; without it the sensor is not recorded.
    #[arg(long, value_name = "IP:PORT")]
    sensor_side: Option<SocketAddr>,
    /// peer: set the sensor's zero at its present load (its software bias) before the recording begins; it is recorded.
    #[arg(long)]
    bias: bool,
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

/// What takes part.
enum Part {
    Peer(Peer),
    Proxy(Box<Proxy>),
    /// A capture, and what it is called.
    Tap(File, PathBuf),
}

/// What a capture is called that comes through a pipe.
pub(super) const STANDARD_INPUT: &str = "standard input";

/// What a part came to, beside what was recorded.
type Ended = (Option<Tapped>, Vec<(&'static str, Spread)>);

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
        inputs::writable_new(&self.output, self.force)?;
        let read = cell.files().into_iter().chain(&self.pcap);
        inputs::not_read(&self.output, read.clone())?;
        if let Some(json) = &self.json {
            inputs::result(json, read.clone())?;
            inputs::not_the_same(json, &self.output)?;
        }
        if self.bias {
            // Whether it can be done at all; what goes to the sensor is made when the recording begins.
            devices.clone().sensor_bias(Nanos(0))?;
        }
        recorded::warn(&remarks(&cell)?, console);
        let mut seen = BTreeMap::new();
        let asks = self.part == As::Peer || (self.part == As::Proxy && self.sensor_side.is_some());
        if let Some(page) = cell.config.sensor.page.filter(|_| asks) {
            check_page(&cell, page, &mut seen)?;
        }
        let mut part = self.open(&cell, &devices, console)?;
        let interrupt = Interrupt::watch()?;
        let mut recorder = self.begin(&cell, &record)?;
        seen.iter().for_each(|(class, count)| recorder.count("ft", class, *count));
        let ended = self.take_part(&mut part, &cell, &mut devices, &mut recorder, &interrupt);
        let outcome = self.finished(ended, recorder, &part, &devices)?;
        recorded::tell(&outcome, &cell, self.json.as_deref(), console)
    }

    fn consistent(&self) -> Result<(), Error> {
        let is_proxy = self.part == As::Proxy;
        let what = match () {
            () if !is_proxy && (!self.robot_side.is_empty() || self.sensor_side.is_some()) => {
                "--robot-side and --sensor-side are for --as proxy"
            }
            () if self.part != As::Tap && self.pcap.is_some() => "--pcap is for --as tap",
            () if self.part != As::Peer && self.bias => {
                "--bias is for --as peer: a proxy and a tap ask the sensor nothing"
            }
            () => return Ok(()),
        };
        Err(Error::new(what).help("dockhil record --help tells the three ways of taking part"))
    }

    /// Binds and opens what is needed, before a file is made.
    fn open(&self, cell: &Cell, devices: &Devices, console: &mut Console<'_>) -> Result<Part, Error> {
        match self.part {
            As::Peer => {
                let mut peer = Peer::open(cell, devices, sensor_transport(cell)?)?;
                if self.bias {
                    peer.set_bias_first();
                }
                console
                    .say(&format!("waiting for robots at {}; Ctrl-C ends the recording\n", listed(&peer.addresses())));
                Ok(Part::Peer(peer))
            }
            As::Proxy => {
                let proxy = Proxy::open(cell, devices, &self.robot_side, self.sensor_side)?;
                console
                    .say(&format!("waiting for robots at {}; Ctrl-C ends the recording\n", listed(&proxy.addresses())));
                match proxy.sensor_address() {
                    Some(address) => console.say(&format!("the sensor is at {address} for the PC\n")),
                    None => console.say("without --sensor-side the sensor is not recorded, and `compare` needs it\n"),
                }
                Ok(Part::Proxy(Box::new(proxy)))
            }
            As::Tap => {
                let path = self.pcap.as_deref().unwrap_or(Path::new("-"));
                if path != Path::new("-") {
                    return Ok(Part::Tap(recorded::open(path)?, path.to_path_buf()));
                }
                // Without the buffer that the standard library puts before it: what is in there cannot be waited for.
                let input = std::io::stdin().as_fd().try_clone_to_owned();
                let input = input.map_err(|error| Error::new(format!("cannot read standard input: {error}")))?;
                Ok(Part::Tap(input.into(), STANDARD_INPUT.into()))
            }
        }
    }

    /// The file, with the beginning of a session in it.
    fn begin(&self, cell: &Cell, record: &BTreeMap<String, String>) -> Result<Recorder<File>, Error> {
        let file = if self.force { File::create(&self.output) } else { File::create_new(&self.output) };
        let file = file.map_err(|error| {
            Error::new(format!("cannot write: {error}")).help("check that the folder exists, is writable and has room")
        });
        file.and_then(|file| Recorder::create(file, &cell.config, record, None))
            .map_err(|error| error.file(&self.output))
    }

    fn take_part(
        &self,
        part: &mut Part,
        cell: &Cell,
        devices: &mut Devices,
        recorder: &mut Recorder<File>,
        interrupt: &Interrupt,
    ) -> Result<Ended, Error> {
        let now = clock();
        let end = now() + Nanos::from_seconds(self.duration_s);
        let until = || interrupt.asked() || now() >= end;
        match part {
            Part::Peer(peer) => {
                peer.run(devices, recorder, &now, &until)?;
                Ok((None, Vec::new()))
            }
            Part::Proxy(proxy) => {
                proxy.run(devices, recorder, &now, &until)?;
                let named = [
                    ("robot to PC", proxy.to_pc.spread()),
                    ("PC to robot", proxy.to_robot.spread()),
                    ("sensor to PC", proxy.from_sensor.spread()),
                ];
                let latencies: Vec<_> = named.into_iter().filter_map(|(name, spread)| Some((name, spread?))).collect();
                let text = |spread| serde_json::to_string(spread).unwrap_or_default();
                let metadata = latencies.iter().map(|(name, spread)| ((*name).to_owned(), text(spread))).collect();
                recorder.metadata("proxy_latency", &metadata)?;
                Ok((None, latencies))
            }
            Part::Tap(capture, _) => {
                let longest = Some(Nanos::from_seconds(self.duration_s));
                let tapped = tap(capture, cell, devices, recorder, longest, &|| interrupt.asked())?;
                recorded::note_capture(recorder, &tapped)?;
                Ok((Some(tapped), Vec::new()))
            }
        }
    }

    /// Ends the file. One that holds no data, or whose times mean nothing, is removed.
    fn finished(
        &self,
        ended: Result<Ended, Error>,
        recorder: Recorder<File>,
        part: &Part,
        devices: &Devices,
    ) -> Result<Outcome, Error> {
        let before = recorder.summary();
        let fast = too_fast(&before);
        let is_empty = before.frames() == 0 && before.samples == 0;
        // What ended it early is worth more than that the file cannot be ended either.
        let result = match (ended, recorder.finish()) {
            (Err(error), _) | (Ok(_), Err(error)) => Err(error.file(&self.output)),
            (Ok(ended), Ok((_, summary))) => Ok((ended, summary)),
        };
        let is_kept = fast.is_none() && !is_empty;
        let is_left = |metadata: std::fs::Metadata| metadata.is_file() && (!is_kept || metadata.len() == 0);
        if self.output.symlink_metadata().is_ok_and(is_left) {
            // It is ours; that it cannot be removed either adds nothing to the message.
            let _ = std::fs::remove_file(&self.output);
        }
        let ((tapped, latencies), summary) = result?;
        let source = if let Part::Tap(_, name) = part { Some(name.clone()) } else { None };
        if let Some(error) = fast {
            return Err(error.file(source.unwrap_or_else(|| self.output.clone())));
        }
        let hears = !matches!(part, Part::Proxy(proxy) if proxy.sensor_address().is_none());
        let heard = hears.then(|| devices.heard().clone());
        let file = is_kept.then(|| self.output.clone());
        Ok(Outcome { summary, tapped, latencies, file, source, heard })
    }
}

fn listed(addresses: &[SocketAddr]) -> String {
    addresses.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
