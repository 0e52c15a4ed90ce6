//! The robot's controller, as it sees the exchange: frames out, replies judged, corrections limited, and in the end a stop.
//!
//! No clock and no socket: whoever has them calls, once in each cycle, [`Controller::frame`] with what the robot measures and
//! then [`Controller::cycle`] with the reply that came by the deadline, or with none. [`Controller::target_mm_deg`] is where the
//! robot is then sent.
//!
//! | in a cycle | absolute | relative |
//! |---|---|---|
//! | a reply was taken | correction = value | correction = correction + value |
//! | none, HOLDON 1 | the correction stays | the last value is added again |
//! | none, HOLDON 0 | correction = 0: the robot is sent home in one cycle | the correction stays |
//!
//! Then POSCORR bounds the cumulative correction, without a word; POSCORRMON stops when it is too long; STOP stops on a rising
//! edge. The target is the pose at the start plus the correction: X, Y, Z in BASE, and A, B, C to the Euler components.
//!
//! Source: reference/PROTOCOLS.md, sections 1.1, 1.5, 1.6 and 1.7. Chosen, because it is documented nowhere: the running sum of
//! the relative mode does not wind up beyond the limits; of several replies in a cycle the first with the right IPOC is taken, and
//! a cycle is late at most once. Not modelled: the arm (axis corrections do not move the pose), the filter of `IPO`, and a
//! correction in another frame than BASE.

use super::controller_event::{ControllerEvent, Refusal, Stop, StopReason};
use super::controller_late::LateCount;
use super::controller_reply::{Judge, Output, outputs};
use super::controller_send::{State, frame, greeting};
use super::controller_settings::{Family, Settings, TWO_TO_32};
use super::{EXTERNAL, Mode, POSE};
use crate::fault::Action;

/// A virtual robot controller.
#[derive(Debug, Clone)]
pub struct Controller {
    settings: Settings,
    outputs: Vec<Output>,
    start_mm_deg: [f64; 6],
    start_external: [f64; 6],
    measured_mm_deg: [f64; 6],
    measured_external: [f64; 6],
    correction: [f64; 6],
    external: [f64; 6],
    late: LateCount,
    warning: Option<LateCount>,
    warned: bool,
    /// IPOC of the next frame, and of the one that waits for its reply.
    next: u64,
    waits: Option<u64>,
    frozen: bool,
    stat: u8,
    stop_input: bool,
    cycles: u64,
    stopped: Option<Stop>,
}

impl Controller {
    /// RSI starts at this pose (mm and degrees) and with these external axes. What is not finite is taken as 0.
    pub fn new(mut settings: Settings, start_pose_mm_deg: [f64; 6], start_external: [f64; 6]) -> Controller {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        settings.axes_deg = settings.axes_deg.map(finite);
        settings.inputs.values_mut().for_each(|value| *value = finite(*value));
        let (pose, external) = (start_pose_mm_deg.map(finite), start_external.map(finite));
        Controller {
            outputs: outputs(&settings.config.receive),
            start_mm_deg: pose,
            start_external: external,
            measured_mm_deg: pose,
            measured_external: external,
            correction: [0.0; 6],
            external: [0.0; 6],
            late: LateCount::new(settings.late),
            warning: settings.warning.map(LateCount::new),
            warned: false,
            next: settings.first_ipoc,
            waits: None,
            frozen: false,
            stat: 0,
            stop_input: false,
            cycles: 0,
            stopped: None,
            settings,
        }
    }

    /// What a KRC2 sends when the connection is made, before RSI runs; others send nothing. No reply is judged.
    pub fn greeting(&self) -> Option<Vec<u8>> {
        (self.settings.family == Family::Krc2).then(|| greeting(&self.settings))
    }

    /// The frame of this cycle. A value that is not finite repeats the last one. Nothing (no bytes) once it has stopped.
    pub fn frame(&mut self, measured_mm_deg: &[f64; 6], external: &[f64; 6]) -> Vec<u8> {
        if self.stopped.is_some() {
            return Vec::new();
        }
        for (last, new) in [(&mut self.measured_mm_deg, measured_mm_deg), (&mut self.measured_external, external)] {
            for (last, new) in last.iter_mut().zip(new).filter(|(_, new)| new.is_finite()) {
                *last = *new;
            }
        }
        let ipoc = self.stamp();
        self.waits = Some(ipoc);
        let state = State {
            measured_mm_deg: &self.measured_mm_deg,
            external: &self.measured_external,
            start_mm_deg: &self.start_mm_deg,
            start_external: &self.start_external,
            late: self.late.count(),
            stat: self.stat,
            ipoc,
        };
        frame(&self.settings, &state)
    }

    fn stamp(&mut self) -> u64 {
        if let (true, Some(before)) = (std::mem::take(&mut self.frozen), self.waits) {
            return before;
        }
        let ipoc = if self.settings.ipoc_wraps { self.next % TWO_TO_32 } else { self.next };
        self.next = ipoc.saturating_add(u64::from(self.settings.cycle_ms));
        ipoc
    }

    /// The end of this cycle: the reply that came by the deadline, or none.
    pub fn cycle(&mut self, reply: Option<&[u8]>, events: &mut Vec<ControllerEvent>) {
        self.cycle_of(reply.as_slice(), events);
    }

    /// The same with every packet that came in this cycle.
    pub fn cycle_of<B: AsRef<[u8]>>(&mut self, replies: &[B], events: &mut Vec<ControllerEvent>) {
        if self.stopped.is_some() {
            return;
        }
        let (taken, bad) = self.judge(replies, events);
        match bad.filter(|_| self.settings.bad_stops) {
            Some(refusal) => self.stop(StopReason::Bad(refusal), events),
            None => self.count_late(taken.is_none() && !self.settings.config.only_send, events),
        }
        if self.stopped.is_none() {
            self.set_outputs(taken, events);
            self.correct(events);
        }
        self.cycles += 1;
    }

    /// The values of the first reply that is taken, and why the first cannot be read that cannot; what is refused is reported.
    fn judge<B: AsRef<[u8]>>(&self, replies: &[B], events: &mut Vec<ControllerEvent>) -> (Taken, Option<Refusal>) {
        let Settings { config, family, .. } = &self.settings;
        let judge = Judge { sentype: &config.sentype, family: *family, expected: self.waits, outputs: &self.outputs };
        let (mut taken, mut bad) = (None, None);
        if config.only_send {
            return (taken, bad);
        }
        for result in replies.iter().flat_map(|bytes| judge.packet(bytes.as_ref())) {
            match result {
                Ok(values) => taken = taken.or(Some(values)),
                Err(refusal) => {
                    if bad.is_none() && refusal.is_bad() {
                        bad = Some(refusal.clone());
                    }
                    events.push(ControllerEvent::Refused(refusal));
                }
            }
        }
        (taken, bad)
    }

    fn count_late(&mut self, late: bool, events: &mut Vec<ControllerEvent>) {
        let broken = self.late.cycle(late);
        let count = self.late.count();
        if late {
            events.push(ControllerEvent::Late { count });
        }
        if let Some(warning) = &mut self.warning {
            let warns = warning.cycle(late);
            if warns && !self.warned {
                events.push(ControllerEvent::Warning { count: warning.count() });
            }
            self.warned = warns;
        }
        if broken {
            self.stop(StopReason::Timeout { late: count }, events);
        }
    }

    /// The outputs of the ETHERNET object after this cycle.
    fn set_outputs(&mut self, taken: Taken, events: &mut Vec<ControllerEvent>) {
        let late = taken.is_none();
        let values = taken.unwrap_or_else(|| vec![None; self.outputs.len()]);
        let mut fell = 0;
        for (output, value) in self.outputs.iter_mut().zip(values) {
            match value {
                Some(value) => output.value = value,
                None => fell += usize::from(output.release()),
            }
        }
        if late && fell > 0 {
            events.push(ControllerEvent::Fell { outputs: fell });
        }
    }

    /// The correction that follows from the outputs, through the limits.
    fn correct(&mut self, events: &mut Vec<ControllerEvent>) {
        let stop_input = self.output(&self.settings.stop, "") > 0.5;
        let rises = stop_input && !self.stop_input;
        self.stop_input = stop_input;
        if rises {
            return self.stop(StopReason::Commanded, events);
        }
        let (pose, external) = (self.wanted(&self.settings.correction, POSE, &self.correction), {
            self.wanted(&self.settings.external, EXTERNAL, &self.external)
        });
        let limits = self.settings.limits;
        self.correction = limits.pose(&self.start_mm_deg, &pose);
        self.external = limits.external(&external);
        let differs = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.0);
        let limited = differs(&self.correction, &pose) || differs(&self.external, &external);
        let moves = differs(&self.correction, &[0.0; 6]) || differs(&self.external, &[0.0; 6]);
        if limited && self.stat < 2 {
            events.push(ControllerEvent::Limited);
        }
        self.stat = if limited { 2 } else { u8::from(moves) };
        if let Some((value, limit, unit)) = limits.too_far(&self.start_mm_deg, &self.correction) {
            self.stop(StopReason::Monitor { value, limit, unit }, events);
        }
    }

    /// What the outputs of this element ask for.
    fn wanted(&self, element: &str, attributes: [&str; 6], running: &[f64; 6]) -> [f64; 6] {
        let mut wanted = attributes.map(|attribute| self.output(element, attribute));
        if self.settings.mode == Mode::Relative {
            wanted.iter_mut().zip(running).for_each(|(value, running)| *value += running);
        }
        wanted
    }

    fn output(&self, element: &str, attribute: &str) -> f64 {
        let found = self.outputs.iter().find(|output| output.element == element && output.attribute == attribute);
        found.map_or(0.0, |output| output.value)
    }

    fn stop(&mut self, reason: StopReason, events: &mut Vec<ControllerEvent>) {
        let stop = Stop::new(reason, self.cycles, self.settings.family);
        events.push(ControllerEvent::Stopped(stop.clone()));
        self.stopped = Some(stop);
    }

    /// Where the robot is sent: the pose at the start plus the correction, after limits. It stays once RSI has stopped.
    pub fn target_mm_deg(&self) -> [f64; 6] {
        sum(&self.start_mm_deg, &self.correction)
    }

    /// Where the external axes are sent.
    pub fn external_target(&self) -> [f64; 6] {
        sum(&self.start_external, &self.external)
    }

    /// `Stat` of POSCORR: 0 no correction, 1 correcting, 2 limited.
    pub fn stat(&self) -> u8 {
        self.stat
    }

    /// What `Delay D` says.
    pub fn late(&self) -> u32 {
        self.late.count()
    }

    /// IPOC of the frame that waits for its reply.
    pub fn ipoc(&self) -> Option<u64> {
        self.waits
    }

    /// How RSI stopped, if it has.
    pub fn stopped(&self) -> Option<&Stop> {
        self.stopped.as_ref()
    }

    /// A fault of the controller's own clock, for the frame that comes next; whether it is one, and acts now. A crossing of 2^32
    /// is prepared by [`Settings::cross_at`] and acts with the frame that crosses.
    pub fn disturb(&mut self, action: &Action) -> bool {
        match action {
            Action::IpocFreeze {} => {
                self.frozen = self.waits.is_some();
                self.frozen
            }
            Action::IpocBack { ms } => {
                let before = self.next;
                self.next = before.saturating_sub(*ms);
                self.next != before
            }
            Action::IpocRestart { first } => {
                self.restart(*first);
                true
            }
            Action::IpocCrossing { .. } => {
                let step = u64::from(self.settings.cycle_ms);
                self.waits.is_some_and(|before| before < TWO_TO_32 && before.saturating_add(step) >= TWO_TO_32)
            }
            _ => false,
        }
    }

    /// RSI stops and starts again where the robot is sent, with this IPOC; counts and outputs are as at a start.
    fn restart(&mut self, first: u64) {
        let mut settings = self.settings.clone();
        settings.first_ipoc = first;
        let cycles = self.cycles;
        *self = Controller::new(settings, self.target_mm_deg(), self.external_target());
        self.cycles = cycles;
    }
}

/// Values of the outputs by a reply that was taken; `None` within: it does not name that output.
type Taken = Option<Vec<Option<f64>>>;

fn sum(a: &[f64; 6], b: &[f64; 6]) -> [f64; 6] {
    let mut sum = *a;
    sum.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    sum
}

#[cfg(test)]
#[path = "controller_tests.rs"]
#[expect(clippy::float_cmp, reason = "the values are sums that a double holds exactly")]
mod tests;

#[cfg(test)]
#[path = "controller_exchange.rs"]
#[expect(clippy::float_cmp, reason = "the values are sums that are rounded once")]
mod exchange;
