//! One robot on the wire: what it reports, what it is told, and when.
//!
//! | quantity | from |
//! |---|---|
//! | measured pose | `RIst` |
//! | start pose | `RSol` of the first frame, which holds the programmed pose; without it `RIst` less the correction of that moment |
//! | commanded pose, absolute | start + correction, component by component |
//! | commanded pose, relative | start + sum of all corrections so far |
//! | time of a command | that of the frame whose IPOC it echoes: the loop's tick |
//!
//! A command waits for the next frame, which tells whether the controller took it:
//!
//! | reply | next frame | commanded pose of that tick |
//! |---|---|---|
//! | to the newest frame, of the right type | Delay D as before, or not sent | with its correction |
//! | the same | D grew by more than the frames that are missing | the one before |
//! | of another type | any | the one before: the controller drops it |
//! | none, or one that comes after the next frame | D grew | the one before |
//! | none | D as before, or not sent | none: nothing is known |
//!
//! A reply without that correction commands the start pose when every number in it is zero; with others, such as `AK` of axes, it
//! tells no pose.
//!
//! Source: reference/PROTOCOLS.md, sections 1.2 and 1.5. Not covered: corrections of axes (`AKorr`), which need the arm's geometry;
//! commands to the rail, which is taken to be where `EIPos` says; HOLDON 0 of absolute and HOLDON 1 of relative corrections, with
//! which a reply that is missing moves the robot.

use super::clock::{DeviceClock, Lines};
use crate::cell::frames::Reported;
use crate::cell::{ModeName, RobotConfig};
use drivers::rsi::{BadNumber, Frame, POSE, Telegram, parse};
use sim_core::time::Nanos;
use std::collections::{BTreeMap, VecDeque};

/// Frames that a reply may still answer; the controller takes the newest only. Chosen: a quarter of a second.
const FRAMES_MAX: usize = 64;

/// A frame that has been seen.
#[derive(Debug, Clone, Copy)]
struct Asked {
    ipoc: u64,
    stamp_ns: i64,
    measured: Option<Reported>,
    is_answered: bool,
}

/// What a reply was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    /// A command for the tick at that time: it waits for the next frame.
    Waits(i64),
    /// No correction in it.
    Nothing,
    /// A correction, and no pose to add it to.
    Nowhere,
    /// The controller drops it.
    Dropped,
    /// Nothing usable; the class says why.
    Bad(&'static str),
}

/// A command that the next frame confirms or takes back.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    received_ns: i64,
    asked: Asked,
    /// `None`: the controller drops it, whatever the next frame says.
    correction: Option<[f64; 6]>,
}

/// Where a robot was told to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Command {
    pub received_ns: i64,
    pub stamp_ns: i64,
    pub reported: Reported,
}

/// What came of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reports {
    pub stamp_ns: i64,
    pub measured: Option<Reported>,
    /// The command of the tick before, now that it is known.
    pub commanded: Option<Command>,
}

#[derive(Debug)]
pub(super) struct Robot {
    pub name: String,
    pub topic: String,
    correction: String,
    mode: ModeName,
    pub clock: DeviceClock,
    /// Rate of an earlier session whose clock was off.
    rate_before: Option<f64>,
    /// The newest stamp without its wrap, and the least that it ever advanced.
    unwrapped: u64,
    step: Option<u64>,
    session: u32,
    start: Option<[f64; 6]>,
    /// Whether `start` is exact.
    is_programmed: bool,
    /// What the controller adds to the start: the newest correction that it took, or the sum of all.
    offset: [f64; 6],
    waiting: Option<Waiting>,
    /// A command was taken in this session.
    is_commanded: bool,
    /// It was corrected by something that tells no pose.
    is_lost: bool,
    asked: VecDeque<Asked>,
    /// How often each thing was sent and received: for the summary.
    pub frames: u64,
    pub replies: u64,
    pub delay: Option<i64>,
}

impl Robot {
    pub fn new(config: &RobotConfig, lines: Option<Lines>) -> Self {
        Robot {
            name: config.name.clone(),
            topic: format!("/rsi/{}", config.name),
            correction: config.correction.clone(),
            mode: config.mode,
            clock: DeviceClock::with(lines),
            rate_before: None,
            unwrapped: 0,
            step: None,
            session: 0,
            start: None,
            is_programmed: false,
            offset: [0.0; 6],
            waiting: None,
            is_commanded: false,
            is_lost: false,
            asked: VecDeque::new(),
            frames: 0,
            replies: 0,
            delay: None,
        }
    }

    /// Takes a fresh frame: its time, what it reports if it reports a pose, and what it says of the command before.
    pub fn frame(&mut self, frame: &Frame) -> Reports {
        let commanded = self.confirmed(frame);
        if frame.session != self.session {
            if self.session != 0 {
                self.rate_before = self.rate_off();
                self.clock.restart();
            }
            self.session = frame.session;
            self.start = None;
            self.offset = [0.0; 6];
            self.is_commanded = false;
            self.is_lost = false;
            self.delay = None;
            self.asked.clear();
        }
        self.frames += 1;
        self.delay = frame.delay.or(self.delay);
        let advance = frame.unwrapped.saturating_sub(self.unwrapped);
        self.unwrapped = frame.unwrapped;
        if advance > 0 && self.frames > 1 {
            self.step = Some(self.step.map_or(advance, |step| step.min(advance)));
        }
        let device_ns = i64::try_from(frame.unwrapped).ok().and_then(|ms| ms.checked_mul(1_000_000));
        let stamp_ns = self.clock.stamp(device_ns, frame.received.0);
        let measured = frame
            .pose_mm_deg
            .map(|pose_mm_deg| Reported { pose_mm_deg, external_mm: frame.external.unwrap_or_default() });
        if self.start.is_none() {
            let programmed = frame.telegram.six("RSol", POSE).and_then(Result::ok);
            self.is_programmed = programmed.is_some();
            self.start = programmed.or(frame.pose_mm_deg);
        }
        if self.asked.len() == FRAMES_MAX {
            self.asked.pop_front();
        }
        self.asked.push_back(Asked { ipoc: frame.ipoc, stamp_ns, measured, is_answered: false });
        Reports { stamp_ns, measured, commanded }
    }

    /// The command of the newest tick, with what this frame says of it.
    fn confirmed(&mut self, frame: &Frame) -> Option<Command> {
        if frame.session != self.session {
            return self.settle(true);
        }
        let grown = match (self.delay, frame.delay) {
            (Some(before), Some(now)) => now.saturating_sub(before),
            _ => 0,
        };
        // A frame that did not come has no reply, and counts too.
        let is_refused = grown > i64::try_from(frame.missing).unwrap_or(i64::MAX);
        if self.waiting.is_none() && is_refused && self.is_commanded {
            let asked = *self.asked.back()?;
            self.waiting = Some(Waiting { received_ns: frame.received.0, asked, correction: None });
        }
        self.settle(!is_refused)
    }

    /// The command that waits, taken by the controller or not.
    pub fn settle(&mut self, is_taken: bool) -> Option<Command> {
        let Waiting { received_ns, asked, correction } = self.waiting.take()?;
        if let Some(correction) = correction.filter(|_| is_taken) {
            self.is_commanded = true;
            match self.mode {
                ModeName::Absolute => self.offset = correction,
                ModeName::Relative => self.offset.iter_mut().zip(correction).for_each(|(sum, part)| *sum += part),
            }
        }
        let (start, measured) = (self.start?, asked.measured?);
        let pose_mm_deg = std::array::from_fn(|axis| start[axis] + self.offset[axis]);
        Some(Command { received_ns, stamp_ns: asked.stamp_ns, reported: Reported { pose_mm_deg, ..measured } })
    }

    /// Takes a reply that went, or came by, on its way to the robot; whether the controller takes its type. The second value: the
    /// start pose is a guess from here on.
    pub fn reply(&mut self, at: Nanos, telegram: &Telegram, is_of_type: bool) -> (Answer, bool) {
        self.replies += 1;
        let Some(ipoc) = telegram.ipoc() else { return (Answer::Bad("reply-without-ipoc"), false) };
        let Some(place) = self.asked.iter().rposition(|asked| asked.ipoc == ipoc.value) else {
            return (Answer::Bad("reply-unmatched"), false);
        };
        let is_newest = place + 1 == self.asked.len();
        let asked = &mut self.asked[place];
        if asked.is_answered {
            return (Answer::Bad("reply-again"), false);
        }
        if !is_newest {
            return (Answer::Bad("reply-late"), false);
        }
        asked.is_answered = is_of_type;
        let asked = *asked;
        if !is_of_type {
            self.waiting = Some(Waiting { received_ns: at.0, asked, correction: None });
            return (Answer::Dropped, false);
        }
        let correction = match pose_of(telegram, &self.correction) {
            // Whatever it corrects, nothing is no motion.
            None if is_all_zero(telegram) && !(self.is_lost && self.mode == ModeName::Relative) => [0.0; 6],
            None => {
                self.is_lost = true;
                return (Answer::Nothing, false);
            }
            Some(Err(_)) => return (Answer::Bad("reply-number"), false),
            Some(Ok(correction)) => correction,
        };
        let mut guessed = false;
        if self.replies == 1 && !self.is_programmed && correction.iter().any(|part| part.abs() > 0.0) {
            // The session had begun before: the robot is where the correction has brought it, but for its lag.
            if let (Some(start), ModeName::Absolute) = (&mut self.start, self.mode) {
                start.iter_mut().zip(correction).for_each(|(start, part)| *start -= part);
            }
            guessed = true;
        }
        self.waiting = Some(Waiting { received_ns: at.0, asked, correction: Some(correction) });
        let is_placed = self.start.is_some() && asked.measured.is_some();
        (if is_placed { Answer::Waits(asked.stamp_ns) } else { Answer::Nowhere }, guessed)
    }

    /// How many of its seconds went by in one of the host's, where that is far from one.
    pub fn rate_off(&self) -> Option<f64> {
        self.clock.rate_off().or(self.rate_before)
    }

    /// Whether its stamp goes on by one with each frame, as on some simulators.
    pub fn counts_frames(&self) -> bool {
        self.step == Some(1)
    }

    /// Element that carries its correction.
    pub fn correction(&self) -> &str {
        &self.correction
    }

    /// What the summary says of it.
    pub fn counts(&self) -> BTreeMap<String, String> {
        let delay = self.delay.map_or_else(|| "not sent".to_owned(), |delay| delay.to_string());
        [("frames", self.frames.to_string()), ("replies", self.replies.to_string()), ("delay_d", delay)]
            .into_iter()
            .map(|(key, value)| (format!("{}_{key}", self.name), value))
            .collect()
    }
}

/// X to C of an element; what it leaves out is zero. `None` where it has none of them.
fn pose_of(telegram: &Telegram, tag: &str) -> Option<Result<[f64; 6], BadNumber>> {
    let element = telegram.element(tag)?;
    let values = POSE.map(|name| element.value(name).and_then(|_| telegram.number(tag, name)));
    if values.iter().all(Option::is_none) {
        return None;
    }
    let mut pose = [0.0; 6];
    for (part, value) in pose.iter_mut().zip(values) {
        match value {
            Some(Ok(value)) => *part = value,
            Some(Err(bad)) => return Some(Err(bad)),
            None => {}
        }
    }
    Some(Ok(pose))
}

/// Whether a reply corrects something, and all by zero.
fn is_all_zero(telegram: &Telegram) -> bool {
    let mut numbers = telegram.elements.iter().flat_map(|element| &element.attributes).peekable();
    numbers.peek().is_some() && numbers.all(|(_, text)| parse(text).is_ok_and(|value| value.abs() <= 0.0))
}
