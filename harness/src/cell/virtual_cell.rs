//! The virtual cell: robot controllers, sensor and facility on one seeded clock, bytes out and bytes in.
//!
//! [`VirtualCell::greetings`] come first. One cycle: [`VirtualCell::begin`] gives the F/T packets since the last one and then the frame of each robot, the nozzle's
//! first; whoever carries them brings the answers to [`VirtualCell::reply`]; [`VirtualCell::end`] lets the controllers judge
//! them and sends the robots on their way. Nothing here waits, and no clock is asked.
//!
//! Not modelled: a nozzle's robot is where it is told at once, while the relative pose has the dead times of the model; rails
//! stand still; what lies across the axis of approach stays as it is at the start.

use super::config::{Cell, ModeName};
use super::faults::Faults;
use super::frames::{Places, Reported, recorded, relative};
use super::parts::settings;
use super::run::FaultAccount;
use super::session::{Log, push};
use crate::error::Error;
use crate::model::Model;
use crate::recording::Wrench;
use crate::simulate;
use drivers::fault::{self, Event, Faulty, Needs, Out, Robot, Schedule, WireFault, row};
use drivers::ft::{self, AnyDevice, AnySensor, Device, Sensor};
use drivers::rsi::{Controller, ControllerEvent, POSE, Telegram};
use sim_core::closed_loop::Stepped;
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;

/// Frames that an answer may still be for. Chosen: a quarter of a second.
const STAMPS_MAX: usize = 64;

/// Who a packet is from, or for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// The sensor.
    Sensor,
    /// The link of a robot, by its number in the cell.
    Robot(usize),
}

/// A packet of the cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Whose it is.
    pub line: Line,
    /// Time of the cell.
    pub at: Nanos,
    /// What it says.
    pub bytes: Vec<u8>,
    /// Whether it is as it was sent and when: an answer to one that is not cannot be counted on.
    pub is_sound: bool,
}

/// Where a run is: what addresses of faults count.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moment {
    /// Number of the cycle.
    pub cycle: u64,
    /// Numbers of the samples since the cycle before.
    pub samples: Range<u64>,
    /// Whether probe and nozzle have touched.
    pub touched: bool,
}

/// One robot's controller, its faults, and what was heard of it.
struct Link {
    controller: Controller,
    mode: ModeName,
    correction: String,
    frames: Faulty,
    replies: Faulty,
    clock_faults: Vec<(WireFault, Schedule)>,
    inbox: Vec<Vec<u8>>,
    answered: bool,
    sentype: String,
    /// Stamps of the newest frames as they went, and when.
    stamps: VecDeque<(u64, Nanos)>,
    /// What was commanded, as it was sent: the pose at the start and the correction.
    start_mm_deg: [f64; 6],
    commanded: Reported,
    /// What was reported, as it arrived.
    reported: Reported,
}

/// See the module.
pub struct VirtualCell<'f> {
    facility: &'f mut dyn Stepped<Axis>,
    links: Vec<Link>,
    probe: usize,
    nozzle: Option<usize>,
    places: Places,
    device: AnyDevice,
    weight_n: f64,
    ft: Faulty,
    requests: Faulty,
    /// Hears what arrives from the sensor, for the log.
    tap: AnySensor,
    across: [f64; 2],
    /// Records of the sensor that were not there when the frames of their cycle went.
    late: Vec<Packet>,
    now: Nanos,
    cycle: u64,
    samples: u64,
    samples_before: u64,
    asked: u64,
    /// When probe and nozzle touched first and last.
    pub contact: Option<[Nanos; 2]>,
    /// The largest reading along z, of either sign, in N, and when it was taken.
    pub peak: Option<(f64, Nanos)>,
    /// What was exchanged.
    pub log: Log,
    /// Whether it is written down.
    pub keeps: bool,
    /// How often each event came, by class.
    pub events: BTreeMap<&'static str, u64>,
    /// Of each class the first, in words.
    pub first_of: BTreeMap<&'static str, String>,
}

impl<'f> VirtualCell<'f> {
    /// A cell at its beginning. `seed` decides what is random in the faults.
    ///
    /// # Errors
    /// When its files cannot go together.
    pub fn new(
        cell: &Cell,
        model: &Model,
        faults: &Faults,
        streams: &Streams,
        facility: &'f mut dyn Stepped<Axis>,
    ) -> Result<Self, Error> {
        let settings_of_sensor = cell.sensor()?;
        let refuse = |error: ft::SettingsError| cell.sensor_error(&error);
        let (probe, nozzle) = cell.roles();
        let (start, places) = (cell.start(), cell.places());
        let links =
            (0..cell.config.robots.len()).map(|nth| link(cell, nth, faults, streams)).collect::<Result<_, _>>()?;
        let pose = places.relative(&start[probe], nozzle.map(|nth| &start[nth]));
        let period = settings_of_sensor.period().map_err(refuse)?;
        let stream = |on| Faulty::new(on, Robot::None, &faults.wire, period, streams);
        Ok(VirtualCell {
            facility,
            links,
            probe,
            nozzle,
            places,
            device: settings_of_sensor.device().map_err(refuse)?,
            weight_n: model.sensor.tool_mass_kg * crate::blocks::GRAVITY_M_PER_S2,
            ft: stream(fault::Stream::Ft),
            requests: stream(fault::Stream::FtRequest),
            tap: settings_of_sensor.sensor().map_err(refuse)?,
            across: [pose.position_m.x, pose.position_m.y],
            late: Vec::new(),
            now: Nanos(0),
            cycle: 0,
            samples: 0,
            samples_before: 0,
            asked: 0,
            contact: None,
            peak: None,
            log: Log::default(),
            keeps: true,
            events: BTreeMap::new(),
            first_of: BTreeMap::new(),
        })
    }

    /// What the robot controllers send when their links are made, before RSI runs. It wants no answer.
    pub fn greetings(&self) -> Vec<Packet> {
        let greeting = |nth: usize| {
            let bytes = self.links[nth].controller.greeting()?;
            Some(Packet { line: Line::Robot(nth), at: self.now, bytes, is_sound: true })
        };
        (0..self.links.len()).filter_map(greeting).collect()
    }

    /// A request to the sensor; what it answers at once is added to `out`.
    pub fn request(&mut self, bytes: &[u8], out: &mut Vec<Packet>) {
        let (mut arrived, mut answers) = (Vec::new(), Vec::new());
        self.requests.pass(self.asked, Some(bytes), &mut arrived);
        self.asked += 1;
        for request in arrived {
            self.device.receive(self.now, &request.bytes, &mut answers);
        }
        let at = self.now;
        out.extend(answers.into_iter().map(|bytes| Packet { line: Line::Sensor, at, bytes, is_sound: true }));
    }

    /// Whether somebody asked for the sensor's stream.
    pub fn streams(&self) -> bool {
        self.device.streams()
    }

    /// What the cell sends in this cycle, in the order in which it is sent.
    pub fn begin(&mut self, out: &mut Vec<Packet>) {
        let reported = self.facility.report();
        let (now, measured) = (reported.now, reported.measured);
        let touches = reported.touch.iter().any(|touch| touch.depth_m > 0.0);
        let readings: Vec<(Nanos, f64)> =
            reported.sensor_time.iter().copied().zip(reported.sensed.iter().copied()).collect();
        (self.now, self.samples_before) = (now, self.samples);
        if touches {
            let first = self.contact.map(|[first, _]| first);
            self.contact = Some([first.unwrap_or(now), now]);
            if first.is_none() {
                self.happened(Event::FirstContact);
            }
        }
        out.append(&mut self.late);
        for (at, reading_n) in readings {
            self.sample(at, reading_n, out);
        }
        for nth in self.nozzle.into_iter().chain([self.probe]) {
            self.frame(nth, &measured, out);
        }
        self.hear(out);
    }

    /// Where the run is, after [`Self::begin`].
    pub fn moment(&self) -> Moment {
        Moment { cycle: self.cycle, samples: self.samples_before..self.samples, touched: self.contact.is_some() }
    }

    fn happened(&mut self, event: Event) {
        self.ft.event(event);
        self.requests.event(event);
        for link in &mut self.links {
            link.frames.event(event);
            link.replies.event(event);
            link.clock_faults.iter_mut().for_each(|(_, schedule)| schedule.event(event));
        }
    }

    fn sample(&mut self, at: Nanos, reading_n: f64, out: &mut Vec<Packet>) {
        let (mut sent, mut arrived) = (Vec::new(), Vec::new());
        self.device.sample([0.0, -self.weight_n, reading_n], [0.0; 3], &mut sent);
        if self.peak.is_none_or(|(peak_n, _)| reading_n.abs() > peak_n.abs()) {
            self.peak = Some((reading_n, at));
        }
        match sent.split_first() {
            Some((first, rest)) => {
                self.ft.pass(self.samples, Some(first), &mut arrived);
                debug_assert!(rest.is_empty(), "a sample is at most one packet");
            }
            None => self.ft.pass(self.samples, None, &mut arrived),
        }
        self.samples += 1;
        for packet in arrived {
            let at = at + packet.within;
            let packet = Packet { line: Line::Sensor, at, bytes: packet.bytes, is_sound: true };
            // What is not there when the frames go belongs to the next cycle.
            if at > self.now { self.late.push(packet) } else { out.push(packet) }
        }
    }

    fn frame(&mut self, nth: usize, measured: &AxisMotion, out: &mut Vec<Packet>) {
        let nozzle = self.nozzle.map(|nozzle| self.target(nozzle));
        let here = if nth == self.probe {
            let mut pose = simulate::pose(measured.position_m, measured.pitch_rad);
            [pose.position_m[0], pose.position_m[1]] = self.across;
            let external_mm = self.links[nth].controller.external_target();
            let pose_mm_deg = self.places.probe_mm_deg(&relative(&pose), &external_mm, nozzle.as_ref());
            Reported { pose_mm_deg, external_mm }
        } else {
            self.target(nth)
        };
        let link = &mut self.links[nth];
        let mut runs_on = true;
        for (fault, schedule) in &mut link.clock_faults {
            if schedule.due(self.cycle) && link.controller.disturb(&fault.action) {
                schedule.count();
                runs_on = false;
            }
        }
        let frame = link.controller.frame(&here.pose_mm_deg, &here.external_mm);
        let mut arrived = Vec::new();
        link.frames.pass(self.cycle, (!frame.is_empty()).then_some(&frame), &mut arrived);
        let at = self.now;
        let packet = |packet: Out| {
            let is_sound = runs_on && packet.bytes == frame;
            Packet { line: Line::Robot(nth), at: at + packet.within, bytes: packet.bytes, is_sound }
        };
        out.extend(arrived.into_iter().map(packet));
    }

    /// Where a robot is sent.
    fn target(&self, nth: usize) -> Reported {
        let controller = &self.links[nth].controller;
        Reported { pose_mm_deg: controller.target_mm_deg(), external_mm: controller.external_target() }
    }

    /// Writes down what arrives at the computer.
    fn hear(&mut self, packets: &[Packet]) {
        let mut heard = Vec::new();
        for packet in packets {
            match packet.line {
                Line::Sensor => {
                    self.tap.receive(packet.at, &packet.bytes, &mut heard);
                    for event in heard.drain(..) {
                        let ft::Event::Sample(sample) = event else { continue };
                        let wrench = Wrench { force_n: sample.force_n, torque_n_m: sample.torque_n_m };
                        if self.keeps && sample.is_measured() {
                            push(&mut self.log.sensed, packet.at.0, wrench);
                        }
                    }
                }
                Line::Robot(nth) => {
                    let Ok(frame) = Telegram::decode(&packet.bytes) else { continue };
                    self.links[nth].went(&frame, packet.at);
                    let Some(Ok(pose_mm_deg)) = frame.six("RIst", POSE) else { continue };
                    self.links[nth].reported.pose_mm_deg = pose_mm_deg;
                    if self.keeps && nth == self.probe {
                        let nozzle = self.nozzle.map(|nozzle| &self.links[nozzle].reported);
                        let pose = self.places.relative(&self.links[nth].reported, nozzle);
                        push(&mut self.log.measured, packet.at.0, recorded(&pose));
                    }
                }
            }
        }
    }

    /// An answer for a robot's controller.
    pub fn reply(&mut self, nth: usize, bytes: &[u8]) {
        let Some(link) = self.links.get_mut(nth) else { return };
        let asked = link.asked(bytes);
        let mut arrived = Vec::new();
        // Answers are counted by cycle: of several in one cycle, only the first can meet a fault.
        if link.answered {
            link.inbox.push(bytes.to_vec());
        } else {
            link.replies.pass(self.cycle, Some(bytes), &mut arrived);
            link.inbox.extend(arrived.into_iter().map(|packet| packet.bytes));
            link.answered = true;
        }
        let Some((at, pose_mm_deg)) = asked else { return };
        link.commanded.pose_mm_deg = pose_mm_deg;
        if self.keeps && nth == self.probe {
            let nozzle = self.nozzle.map(|nozzle| self.links[nozzle].commanded);
            let pose = self.places.relative(&self.links[nth].commanded, nozzle.as_ref());
            push(&mut self.log.commanded, at.0, recorded(&pose));
        }
    }

    /// The end of the cycle: answers are judged, and the robots go where they are sent.
    pub fn end(&mut self) {
        let mut events: Vec<ControllerEvent> = Vec::new();
        for link in &mut self.links {
            if !std::mem::take(&mut link.answered) {
                let mut arrived = Vec::new();
                link.replies.pass(self.cycle, None, &mut arrived);
                link.inbox.extend(arrived.into_iter().map(|packet| packet.bytes));
            }
            link.controller.cycle_of(&link.inbox, &mut events);
            link.inbox.clear();
        }
        for event in events {
            *self.events.entry(event.class()).or_default() += 1;
            self.first_of.entry(event.class()).or_insert_with(|| format!("cycle {}: {event}", self.cycle));
        }
        let nozzle = self.nozzle.map(|nozzle| self.target(nozzle));
        let pose = recorded(&self.places.relative(&self.target(self.probe), nozzle.as_ref()));
        let [x, _, _, w] = pose.orientation_xyzw;
        let pitch_rad = 2.0 * libm::atan2(x, w);
        self.facility.command(AxisMotion { pitch_rad, ..AxisMotion::moving(pose.position_m[2], 0.0) });
        self.cycle += 1;
    }

    /// The cell's own time.
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// Which robots have stopped, and what their controllers print.
    pub fn stops(&self) -> Vec<(usize, String)> {
        let stopped = |nth: usize| Some((nth, self.links[nth].controller.stopped()?.to_string()));
        (0..self.links.len()).filter_map(stopped).collect()
    }

    /// Whether no robot is left that sends.
    pub fn is_over(&self) -> bool {
        self.links.iter().all(|link| link.controller.stopped().is_some())
    }

    /// What came of each fault of the wire that the links do, in the order of the streams.
    pub fn faults(&self) -> Vec<FaultAccount> {
        let streams =
            self.links.iter().flat_map(|link| [&link.frames, &link.replies]).chain([&self.ft, &self.requests]);
        let clocks = self.links.iter().flat_map(|link| &link.clock_faults).map(|(fault, schedule)| (fault, schedule));
        streams
            .flat_map(Faulty::faults)
            .chain(clocks)
            .map(|(fault, schedule)| FaultAccount::of(fault, schedule))
            .collect()
    }
}

impl Link {
    /// A frame has gone to the computer.
    fn went(&mut self, frame: &Telegram, at: Nanos) {
        let Some(stamp) = frame.ipoc() else { return };
        self.stamps.push_back((stamp.value, at));
        if self.stamps.len() > STAMPS_MAX {
            self.stamps.pop_front();
        }
    }

    /// Where an answer wants the robot, in mm and deg, and when the frame came that it answers. What is not for this robot, or
    /// answers no frame, wants nothing.
    fn asked(&self, bytes: &[u8]) -> Option<(Nanos, [f64; 6])> {
        let answer = Telegram::decode(bytes).ok().filter(|answer| answer.kind == self.sentype)?;
        let stamp = answer.ipoc()?.value;
        let (_, at) = self.stamps.iter().rev().find(|(known, _)| *known == stamp)?;
        let from = match self.mode {
            ModeName::Absolute => self.start_mm_deg,
            // What the controller has taken so far, and no more: a correction that was lost on its way is not in it.
            ModeName::Relative => self.controller.target_mm_deg(),
        };
        answer.element(&self.correction)?;
        let mut pose = from;
        for (value, name) in pose.iter_mut().zip(POSE) {
            *value += answer.number(&self.correction, name).and_then(Result::ok).unwrap_or(0.0);
        }
        Some((*at, pose))
    }
}

fn link(cell: &Cell, nth: usize, faults: &Faults, streams: &Streams) -> Result<Link, Error> {
    let robot = &cell.config.robots[nth];
    let cycle_s = cell.config.time.cycle_s;
    let period = Nanos::from_seconds(cycle_s);
    let whose = if nth == 0 { Robot::First(&robot.name) } else { Robot::Other(&robot.name) };
    let stream = |on| Faulty::new(on, whose, &faults.wire, period, streams);
    let mut settings = settings(nth, robot, cell.driven(nth)?, cycle_s);
    let mut clock_faults = Vec::new();
    for (index, fault) in faults.wire.iter().enumerate() {
        let here = fault.robot.as_ref().map_or(nth == 0, |name| *name == robot.name);
        if !here || row(fault.id(), fault.on).is_none_or(|row| row.needs != Needs::Controller) {
            continue;
        }
        if let (fault::Action::IpocCrossing { wraps }, fault::At::Number(cycle)) = (&fault.action, fault.at) {
            settings.cross_at(cycle, *wraps);
        }
        clock_faults.push((fault.clone(), Schedule::new(fault, index, streams)));
    }
    let start = Reported { pose_mm_deg: robot.start_mm_deg, ..Reported::default() };
    Ok(Link {
        controller: Controller::new(settings, robot.start_mm_deg, [0.0; 6]),
        mode: robot.mode,
        correction: robot.correction.clone(),
        sentype: cell.driven(nth)?.sentype,
        stamps: VecDeque::new(),
        frames: stream(fault::Stream::RsiFrame),
        replies: stream(fault::Stream::RsiReply),
        clock_faults,
        inbox: Vec::new(),
        answered: false,
        start_mm_deg: robot.start_mm_deg,
        commanded: start,
        reported: start,
    })
}
