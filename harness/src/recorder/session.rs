//! What was decoded, written down as a session: relative poses, wrenches, raw counters, events.

use super::clock::{DeviceClock, Lines};
use super::pairing::{Paired, Pairing};
use super::raw;
use super::robot::{Answer, Command, Reports, Robot};
use super::topics;
use crate::cell::frames::{Places, Reported, recorded};
use crate::cell::{Carries, CellConfig};
use crate::error::Error;
use crate::recording::{LiveWriter, Times, Wrench};
use drivers::ft::Sample;
use drivers::rsi::{Frame, Telegram};
use serde_json::json;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::io::Write;

/// Which of the two relative poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Which {
    Commanded,
    Measured,
}

/// Clock lines of every device: the robots in their order, then the sensor.
pub type AllLines = Vec<Lines>;

/// Writes a session.
pub struct Recorder<W: Write> {
    live: LiveWriter<W>,
    robots: Vec<Robot>,
    nozzle: Option<usize>,
    commanded: Pairing,
    measured: Pairing,
    sensor: DeviceClock,
    /// How often each class of event came, by source.
    events: BTreeMap<(String, String), u64>,
    first_ns: Option<i64>,
    last_ns: i64,
    samples: u64,
    unmeasured: u64,
    /// How often the sensor's zero was moved after its first reading.
    biases: u64,
    poses: [u64; 2],
}

/// What a session came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// From the first to the last message.
    pub duration_s: f64,
    /// Frames, replies and the late count of each robot, by name.
    pub robots: Vec<(String, u64, u64, Option<i64>)>,
    /// Commanded and measured relative poses.
    pub poses: [u64; 2],
    /// Readings of the sensor.
    pub samples: u64,
    /// Those of them that are clipped or invalid, by the sensor's own status: kept raw, and not as forces.
    pub unmeasured: u64,
    /// How often the sensor's zero was moved while it was recorded.
    pub biases: u64,
    /// How often each class of event came, by source.
    pub events: BTreeMap<(String, String), u64>,
    /// Lines of all clocks.
    pub lines: AllLines,
    /// Robots whose clocks go far from the host's, and how many of their seconds went by in one of the host's.
    pub rates: Vec<(String, f64)>,
    /// Those of them whose stamps count frames: their times are those of receipt.
    pub counters: Vec<String>,
}

impl Summary {
    /// Frames of all robots.
    pub fn frames(&self) -> u64 {
        self.robots.iter().map(|robot| robot.1).sum()
    }
}

impl<W: Write> Recorder<W> {
    /// Begins a session. `lines` are the clocks, where they are known already.
    ///
    /// # Errors
    /// When the output does not take it.
    pub fn create(
        out: W,
        cell: &CellConfig,
        session: &BTreeMap<String, String>,
        lines: Option<AllLines>,
    ) -> Result<Self, Error> {
        let places = Places::of(cell).ok_or_else(|| {
            Error::new("no robot carries the probe").help("say carries = \"probe\" at one [[robot]] of the cell")
        })?;
        let nozzle = cell.robots.iter().position(|robot| robot.carries == Carries::Nozzle);
        let line = |nth: usize| lines.as_ref().map(|lines| lines.get(nth).cloned().unwrap_or_default());
        let robots: Vec<Robot> =
            cell.robots.iter().enumerate().map(|(nth, robot)| Robot::new(robot, line(nth))).collect();
        Ok(Recorder {
            live: LiveWriter::create(out, session)?,
            sensor: DeviceClock::with(line(robots.len())),
            robots,
            nozzle,
            commanded: Pairing::new(places, nozzle.is_some()),
            measured: Pairing::new(places, nozzle.is_some()),
            events: BTreeMap::new(),
            first_ns: None,
            last_ns: 0,
            samples: 0,
            unmeasured: 0,
            biases: 0,
            poses: [0; 2],
        })
    }

    /// A fresh frame of a robot.
    ///
    /// # Errors
    /// When the output does not take it.
    pub fn frame(&mut self, robot: usize, frame: &Frame) -> Result<(), Error> {
        let Some(track) = self.robots.get_mut(robot) else { return Ok(()) };
        let Reports { stamp_ns, measured: reported, commanded } = track.frame(frame);
        let (topic, name) = (track.topic.clone(), track.name.clone());
        let is_counter = track.clock.counts_no_time();
        let times = Times { received_ns: frame.received.0, stamp_ns };
        self.span(frame.received);
        self.live.json(&topics::robot_raw(&topic), times, &raw::frame(frame))?;
        self.command(robot, commanded)?;
        if is_counter {
            self.tell_once(
                "clock-counts-no-time",
                frame.received,
                &name,
                "the IPOC does not count milliseconds: times are those of receipt",
            )?;
        }
        match reported {
            Some(reported) => {
                // A nozzle that nobody corrects is commanded to be where it is.
                if self.nozzle == Some(robot) && self.robots[robot].replies == 0 {
                    self.place(Which::Commanded, robot, times, reported)?;
                }
                self.place(Which::Measured, robot, times, reported)
            }
            None if frame.telegram.element("RIst").is_some() => {
                let text = "RIst is there, and is no six numbers: such a frame gives no measured pose";
                self.tell_once("pose-unreadable", frame.received, &name, text)
            }
            None => {
                let text = "the frames carry no RIst: there is no measured pose";
                self.tell_once("pose-absent", frame.received, &name, text)
            }
        }
    }

    /// A reply on its way to a robot; whether the controller takes replies of its type.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn reply(&mut self, robot: usize, at: Nanos, telegram: &Telegram, is_of_type: bool) -> Result<(), Error> {
        let Some(track) = self.robots.get_mut(robot) else { return Ok(()) };
        let (answer, is_guessed) = track.reply(at, telegram, is_of_type);
        let (topic, name, correction) = (track.topic.clone(), track.name.clone(), track.correction().to_owned());
        self.span(at);
        let stamp_ns = if let Answer::Waits(stamp_ns) = answer { stamp_ns } else { at.0 };
        let times = Times { received_ns: at.0, stamp_ns };
        self.live.json(&topics::robot_raw(&topic), times, &raw::reply(at, telegram, &correction))?;
        if is_guessed {
            let text = "the recording began after the corrections: the start pose is RIst less the first correction, \
                        which the robot follows with a lag";
            self.event(at, &name, "start-guessed", text)?;
        }
        match answer {
            // That the type is wrong was told by whoever knows the configuration.
            Answer::Waits(_) | Answer::Dropped => Ok(()),
            Answer::Bad(class) => {
                let which = telegram.ipoc().map_or_else(
                    || "a reply without a readable IPOC".to_owned(),
                    |ipoc| format!("the reply with IPOC {}", ipoc.value),
                );
                self.event(at, &name, class, &format!("{which} commands nothing"))
            }
            Answer::Nowhere => {
                let text = "a reply to a frame whose pose cannot be read: where the robot was told to be is not known";
                self.tell_once("command-without-pose", at, &name, text)
            }
            Answer::Nothing => {
                let text = format!("the replies carry no {correction} with X to C: there is no commanded pose");
                self.tell_once("correction-absent", at, &name, &text)
            }
        }
    }

    /// Where a robot was told to be, once that is certain.
    fn command(&mut self, robot: usize, command: Option<Command>) -> Result<(), Error> {
        let Some(Command { received_ns, stamp_ns, reported }) = command else { return Ok(()) };
        self.place(Which::Commanded, robot, Times { received_ns, stamp_ns }, reported)
    }

    /// A reading of the sensor.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn sample(&mut self, sample: &Sample) -> Result<(), Error> {
        let device_ns = sample.device_s.map(|device_s| Nanos::from_seconds(device_s).0);
        let stamp_ns = self.sensor.stamp(device_ns, sample.received.0);
        if self.sensor.counts_no_time() {
            let text = "the sensor's counter does not count time at its rate: times are those of receipt";
            self.tell_once("clock-counts-no-time", sample.received, "ft", text)?;
        }
        let times = Times { received_ns: sample.received.0, stamp_ns };
        self.span(sample.received);
        self.samples += 1;
        let mut raw = json!({
            "received_ns": sample.received.0, "sequence": sample.sequence, "device_s": sample.device_s,
            "status": sample.status,
        });
        if !sample.is_measured() {
            // Kept, but not as a force: it is clipped, or not one.
            self.unmeasured += 1;
            raw["force_n"] = json!(sample.force_n);
            raw["torque_n_m"] = json!(sample.torque_n_m);
            return self.live.json(&topics::SENSOR_RAW, times, &raw);
        }
        self.live.json(&topics::SENSOR_RAW, times, &raw)?;
        let wrench = Wrench { force_n: sample.force_n, torque_n_m: sample.torque_n_m };
        self.live.wrench(topics::SENSED, times, &wrench)
    }

    /// The sensor's clock began anew.
    pub fn sensor_restarted(&mut self) {
        self.sensor.restart();
    }

    /// Something unusual.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn event(&mut self, at: Nanos, source: &str, class: &str, text: &str) -> Result<(), Error> {
        *self.events.entry((source.to_owned(), class.to_owned())).or_insert(0) += 1;
        self.biases += u64::from(self.samples > 0 && class.starts_with("ft-bias"));
        let times = Times { received_ns: at.0, stamp_ns: at.0 };
        self.live.json(&topics::EVENT, times, &json!({ "source": source, "class": class, "text": text }))
    }

    /// What was counted elsewhere, of which only the first was told.
    pub fn count(&mut self, source: &str, class: &str, count: u64) {
        if count > 0 {
            let told = self.events.entry((source.to_owned(), class.to_owned())).or_insert(0);
            *told = count.max(*told);
        }
    }

    /// Whether a robot's clock is so fast that it cannot live in real time.
    pub fn is_too_fast(&self) -> bool {
        self.robots.iter().any(|robot| robot.clock.is_too_fast())
    }

    /// Time passes.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn tick(&mut self, now: Nanos) -> Result<(), Error> {
        self.pairs(Which::Commanded, now)?;
        self.pairs(Which::Measured, now)?;
        self.live.tick(now.0)
    }

    /// A metadata record.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn metadata(&mut self, name: &str, record: &BTreeMap<String, String>) -> Result<(), Error> {
        self.live.metadata(name, record)
    }

    /// Ends the session: clocks and counts are written beside it.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn finish(mut self) -> Result<(W, Summary), Error> {
        for robot in 0..self.robots.len() {
            // No frame says anything of the last command.
            let command = self.robots[robot].settle(true);
            self.command(robot, command)?;
        }
        // What still waits for the other robot is late now.
        self.tick(Nanos(self.last_ns.saturating_add(i64::from(u32::MAX))))?;
        let summary = self.summary();
        self.live.metadata("clocks", &clocks(&self.robots, &summary.lines))?;
        let rates = summary.rates.iter().map(|(name, rate)| (name.clone(), rate.to_string())).collect();
        self.live.metadata("clock_rates", &rates)?;
        let mut counts: BTreeMap<String, String> = self.robots.iter().flat_map(Robot::counts).collect();
        counts.insert("ft_samples".to_owned(), self.samples.to_string());
        counts.extend(
            self.events.iter().map(|((source, class), count)| (format!("{source}/{class}"), count.to_string())),
        );
        self.live.metadata("counts", &counts)?;
        Ok((self.live.finish()?, summary))
    }

    /// Time of the newest message, in ns since 1970.
    pub fn last_ns(&self) -> i64 {
        self.last_ns
    }

    /// What it came to so far.
    pub fn summary(&self) -> Summary {
        let mut lines: AllLines = self.robots.iter().map(|robot| robot.clock.lines()).collect();
        lines.push(self.sensor.lines());
        let robots = self.robots.iter();
        Summary {
            duration_s: Nanos(self.last_ns.saturating_sub(self.first_ns.unwrap_or(self.last_ns))).seconds(),
            robots: robots.map(|robot| (robot.name.clone(), robot.frames, robot.replies, robot.delay)).collect(),
            poses: self.poses,
            samples: self.samples,
            unmeasured: self.unmeasured,
            biases: self.biases,
            events: self.events.clone(),
            lines,
            counters: self
                .robots
                .iter()
                .filter(|robot| robot.counts_frames())
                .map(|robot| robot.name.clone())
                .collect(),
            rates: self.robots.iter().filter_map(|robot| Some((robot.name.clone(), robot.rate_off()?))).collect(),
        }
    }

    fn span(&mut self, at: Nanos) {
        self.first_ns.get_or_insert(at.0);
        self.last_ns = self.last_ns.max(at.0);
    }

    fn place(&mut self, which: Which, robot: usize, times: Times, reported: Reported) -> Result<(), Error> {
        let is_nozzle = self.nozzle == Some(robot);
        let pairing = if which == Which::Commanded { &mut self.commanded } else { &mut self.measured };
        match is_nozzle {
            true => pairing.nozzle(times.received_ns, times.stamp_ns, reported),
            false => pairing.probe(times.received_ns, times.stamp_ns, reported),
        }
        self.pairs(which, Nanos(times.received_ns))
    }

    /// Writes the relative poses that are ready.
    fn pairs(&mut self, which: Which, now: Nanos) -> Result<(), Error> {
        loop {
            let (pairing, topic) = match which {
                Which::Commanded => (&mut self.commanded, topics::COMMANDED),
                Which::Measured => (&mut self.measured, topics::MEASURED),
            };
            let Some(Paired { received_ns, stamp_ns, pose, is_held }) = pairing.next(now.0) else { return Ok(()) };
            self.live.pose(topic, Times { received_ns, stamp_ns }, &recorded(&pose))?;
            self.poses[usize::from(which == Which::Measured)] += 1;
            if is_held {
                let text = "the robot with the nozzle was silent for more than 40 ms: its last pose is held";
                self.tell_once("pose-held", Nanos(received_ns), "recorder", text)?;
            }
        }
    }

    /// Says it in the session once for each source, and counts it always.
    fn tell_once(&mut self, class: &'static str, at: Nanos, source: &str, text: &str) -> Result<(), Error> {
        match self.events.get_mut(&(source.to_owned(), class.to_owned())) {
            None => self.event(at, source, class, text),
            Some(count) => {
                *count += 1;
                Ok(())
            }
        }
    }
}

/// The lines of all clocks as a metadata record.
fn clocks(robots: &[Robot], lines: &[Lines]) -> BTreeMap<String, String> {
    let names = robots.iter().map(|robot| robot.name.as_str()).chain(["ft"]);
    let mut record = BTreeMap::new();
    for (name, lines) in names.zip(lines) {
        for (nth, line) in lines.iter().enumerate() {
            let text = line.and_then(|line| serde_json::to_string(&line).ok()).unwrap_or_else(|| "none".to_owned());
            record.insert(format!("{name}.{}", nth + 1), text);
        }
    }
    record
}
