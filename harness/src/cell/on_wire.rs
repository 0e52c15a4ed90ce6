//! A controller on the wire: bytes of robots and sensor in, answers out, SI for the controller in between.
//!
//! When the frame of the probe's robot comes, the controller runs one cycle on what has arrived until then. Its command is split:
//! the probe's robot moves, the nozzle's robot is answered with no correction.

use super::config::{Carries, Cell, ModeName};
use super::controller::{Controller, Seen};
use super::frames::{Places, Reported, recorded, relative, within_half_turn_deg};
use super::pc::Pc;
use super::virtual_cell::Line;
use crate::error::Error;
use crate::recording::Wrench;
use drivers::ft::{self, AnySensor, Sensor};
use drivers::rsi::{Malformed, split};
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// What is known of one robot.
struct Robot {
    pc: Pc,
    mode: ModeName,
    start_mm_deg: [f64; 6],
    reported: Reported,
    /// What was sent so far: the correction in absolute mode; in relative mode its sum, and what the newest answer adds to it.
    sent_mm_deg: [f64; 6],
    newest_mm_deg: [f64; 6],
}

/// See the module.
pub struct OnWire<C> {
    controller: C,
    robots: Vec<Robot>,
    probe: usize,
    nozzle: Option<usize>,
    places: Places,
    sensor: AnySensor,
    wrenches: Vec<Wrench>,
    cycle: u64,
    /// How often each event came, by class.
    pub events: BTreeMap<String, u64>,
}

impl<C: Controller> OnWire<C> {
    /// This controller on the links of this cell.
    ///
    /// # Errors
    /// When the cell's files cannot go together.
    pub fn new(cell: &Cell, controller: C) -> Result<Self, Error> {
        let sensor = cell.sensor()?.sensor().map_err(|error| cell.sensor_error(&error))?;
        let robot = |nth: usize| {
            let config = &cell.config.robots[nth];
            let reported = Reported { pose_mm_deg: config.start_mm_deg, ..Reported::default() };
            let pc = Pc::new(cell.driven(nth)?, &config.correction, config.decimals, config.mode.into());
            let (mode, start_mm_deg) = (config.mode, config.start_mm_deg);
            Ok(Robot { pc, mode, start_mm_deg, reported, sent_mm_deg: [0.0; 6], newest_mm_deg: [0.0; 6] })
        };
        let robots = (0..cell.config.robots.len()).map(robot).collect::<Result<_, Error>>()?;
        let (probe, nozzle) = cell.roles();
        debug_assert!(cell.config.robots[probe].carries == Carries::Probe, "the check has found the probe");
        Ok(OnWire {
            controller,
            robots,
            probe,
            nozzle,
            places: cell.places(),
            sensor,
            wrenches: Vec::new(),
            cycle: 0,
            events: BTreeMap::new(),
        })
    }

    /// What to ask the sensor at the beginning.
    pub fn start(&mut self, requests: &mut Vec<Vec<u8>>) {
        self.sensor.start(requests);
    }

    /// The lines in the order in which sockets are read: what is sent before a frame of the probe's robot is then read after it.
    pub fn lines(&self) -> Vec<Line> {
        [self.probe].into_iter().chain(self.nozzle).map(Line::Robot).chain([Line::Sensor]).collect()
    }

    /// Time has passed: what the sensor must be asked again.
    pub fn tick(&mut self, now: Nanos, requests: &mut Vec<Vec<u8>>) {
        let mut events = Vec::new();
        self.sensor.tick(now, requests, &mut events);
        self.heard(events);
        for robot in &mut self.robots {
            robot.pc.tick(now, &mut self.events);
        }
    }

    /// Something has arrived; the answer, if it wants one.
    ///
    /// # Errors
    /// When the controller commands what cannot be written on the wire.
    pub fn receive(&mut self, line: Line, now: Nanos, bytes: &[u8]) -> Result<Option<Vec<u8>>, Error> {
        match line {
            Line::Sensor => {
                let mut events = Vec::new();
                self.sensor.receive(now, bytes, &mut events);
                self.heard(events);
                Ok(None)
            }
            Line::Robot(nth) => self.documents(nth, now, split(bytes)),
        }
    }

    fn heard(&mut self, events: Vec<ft::Event>) {
        for event in events {
            match event {
                ft::Event::Sample(sample) => {
                    self.wrenches.push(Wrench { force_n: sample.force_n, torque_n_m: sample.torque_n_m });
                }
                event => *self.events.entry(event.class().to_owned()).or_default() += 1,
            }
        }
    }

    /// Documents of a robot have arrived at once; the answer to the newest of them, if it wants one.
    ///
    /// # Errors
    /// As [`OnWire::receive`].
    pub fn documents(
        &mut self,
        nth: usize,
        now: Nanos,
        documents: Vec<Result<Vec<u8>, Malformed>>,
    ) -> Result<Option<Vec<u8>>, Error> {
        let Some(robot) = self.robots.get_mut(nth) else { return Ok(None) };
        let heard = robot.pc.receive(now, documents, &mut self.events);
        let Some(fresh) = heard else { return Ok(robot.pc.again()) };
        robot.reported.pose_mm_deg = fresh.pose_mm_deg.unwrap_or(robot.reported.pose_mm_deg);
        robot.reported.external_mm = fresh.external_mm.unwrap_or(robot.reported.external_mm);
        if robot.mode == ModeName::Relative && fresh.is_refused {
            let newest = std::mem::take(&mut robot.newest_mm_deg);
            robot.sent_mm_deg.iter_mut().zip(newest).for_each(|(sum, sent)| *sum -= sent);
        }
        let correction = if nth == self.probe { self.commanded() } else { [0.0; 6] };
        let robot = &mut self.robots[nth];
        let value = match robot.mode {
            ModeName::Absolute => correction,
            ModeName::Relative => std::array::from_fn(|i| correction[i] - robot.sent_mm_deg[i]),
        };
        let (answer, sent) = robot.pc.reply(&value)?;
        for (sum, sent) in robot.sent_mm_deg.iter_mut().zip(sent) {
            *sum = if robot.mode == ModeName::Relative { *sum + sent } else { sent };
        }
        robot.newest_mm_deg = sent;
        Ok(Some(answer))
    }

    /// One cycle of the controller; the correction that takes the probe's robot where it wants it.
    fn commanded(&mut self) -> [f64; 6] {
        let nozzle = self.nozzle.map(|nth| self.robots[nth].reported);
        let probe = self.robots[self.probe].reported;
        let pose = recorded(&self.places.relative(&probe, nozzle.as_ref()));
        let seen = Seen { cycle: self.cycle, pose, wrenches: &self.wrenches };
        let command = self.controller.cycle(&seen);
        self.cycle += 1;
        self.wrenches.clear();
        // The nozzle's robot holds: what it reports wanders by its own noise, and is not followed.
        let held =
            self.nozzle.map(|nth| Reported { pose_mm_deg: self.robots[nth].start_mm_deg, ..self.robots[nth].reported });
        let asked = self.places.probe_mm_deg(&relative(&command.pose), &probe.external_mm, held.as_ref());
        let start = self.robots[self.probe].start_mm_deg;
        let turn = |i: usize, by: f64| if i < 3 { by } else { within_half_turn_deg(by) };
        std::array::from_fn(|i| turn(i, asked[i] - start[i]))
    }
}
