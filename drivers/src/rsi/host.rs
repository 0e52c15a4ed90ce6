//! The PC's side of the exchange with one robot: documents and time in, events and replies out.
//!
//! Each fresh frame wants one reply, which echoes its IPOC digit by digit. A repeated frame gets the same reply again
//! ([`Host::repeat`]), a late one none. After a stall only the newest frame is answered: every frame is handed out, so that it can
//! be recorded, but a reply goes to the newest alone. A frame with nothing but a stamp, as a KRC2 sends before the exchange, is
//! dropped and its stamp not used. After a restart the ledger is zero again, because an offset counts from the new start.
//!
//! Memory is bounded: nothing grows with the number of frames. Source: reference/PROTOCOLS.md, sections 1.1, 1.6 and 1.7.

use std::collections::BTreeMap;

use sim_core::time::Nanos;

use super::config::EthernetConfig;
use super::dangers::Mode;
use super::event::Event;
use super::ipoc::{Move, Seen, Stamps};
use super::malformed::{Malformed, Why};
use super::names::Names;
use super::pace::Pace;
use super::quantum::{Found, Quantum};
use super::reply::{Corrections, Ledger, ReplyError};
use super::telegram::{EXTERNAL, Form, POSE, Root, Telegram};

/// Repeats of a stamp after which its clock stands.
const FROZEN: u32 = 2;

/// How the PC behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HostOptions {
    /// Decimals of what is sent.
    pub decimals: u8,
    /// What a correction means.
    pub mode: Mode,
    /// Whether frames are answered; a tap answers none.
    pub answers: bool,
    /// Time without a frame after which it is silent.
    pub silence: Nanos,
    /// Age of a frame from which on frames must have been waiting.
    pub backlog: Nanos,
}

impl Default for HostOptions {
    /// Four decimals and absolute corrections, as most cells have them; a silence of 25 frames and a backlog of five at 4 ms.
    fn default() -> Self {
        HostOptions {
            decimals: 4,
            mode: Mode::Absolute,
            answers: true,
            silence: Nanos(100_000_000),
            backlog: Nanos(20_000_000),
        }
    }
}

/// A fresh frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// When it came.
    pub received: Nanos,
    /// Its stamp, as sent.
    pub ipoc: u64,
    /// Its stamp without the wrap at 2^32.
    pub unwrapped: u64,
    /// Session, from 1; a restart begins another.
    pub session: u32,
    /// Frames that are missing before it.
    pub missing: u64,
    /// How old it seems to be beyond the usual.
    pub lag: Nanos,
    /// Measured pose (`RIst`), mm and degrees.
    pub pose_mm_deg: Option<[f64; 6]>,
    /// Measured external axes (`EIPos`), mm or degrees.
    pub external: Option<[f64; 6]>,
    /// Late and invalid replies that the controller counted.
    pub delay: Option<i64>,
    /// The whole document.
    pub telegram: Telegram,
}

/// A frame that waits for its reply.
#[derive(Debug, Clone)]
struct Pending {
    ipoc: u64,
    text: String,
    form: Form,
}

/// The PC's side for one robot.
#[derive(Debug, Clone)]
pub struct Host {
    config: EthernetConfig,
    options: HostOptions,
    stamps: Stamps,
    pace: Pace,
    quantum: Quantum,
    names: Names,
    ledger: Ledger,
    session: u32,
    pending: Option<Pending>,
    /// Stamp and bytes of the newest reply.
    cached: Option<(u64, Vec<u8>)>,
    /// The newest document was a repeat of the frame that `cached` answers, and nobody has taken the reply yet.
    repeated: bool,
    delay: Option<i64>,
    last: Option<Nanos>,
    silent: bool,
    lagging: bool,
    foreign_kind: bool,
    foreign_spelling: bool,
    counts: BTreeMap<&'static str, u64>,
    causes: BTreeMap<&'static str, u64>,
}

impl Host {
    /// A host that has seen nothing.
    pub fn new(config: EthernetConfig, options: HostOptions) -> Host {
        let ledger = Ledger::new(&config, options.decimals, options.mode);
        Host {
            config,
            options,
            stamps: Stamps::default(),
            pace: Pace::default(),
            quantum: Quantum::default(),
            names: Names::default(),
            ledger,
            session: 0,
            pending: None,
            cached: None,
            repeated: false,
            delay: None,
            last: None,
            silent: false,
            lagging: false,
            foreign_kind: false,
            foreign_spelling: false,
            counts: BTreeMap::new(),
            causes: BTreeMap::new(),
        }
    }

    /// Takes one document. `Some`: a fresh frame, which wants a reply.
    pub fn receive(&mut self, now: Nanos, document: &[u8], events: &mut Vec<Event>) -> Option<Frame> {
        self.repeated = false;
        match Telegram::decode(document) {
            Ok(telegram) if telegram.root == Root::Rob => self.rob(now, telegram, events),
            Ok(_) => {
                self.malformed(Malformed { at: 0, why: Why::WrongDirection }, events);
                None
            }
            Err(problem) => {
                self.malformed(problem, events);
                None
            }
        }
    }

    /// Takes the documents that came at once.
    pub fn receive_documents(
        &mut self,
        now: Nanos,
        documents: Vec<Result<Vec<u8>, Malformed>>,
        events: &mut Vec<Event>,
    ) -> Vec<Frame> {
        let mut frames = Vec::new();
        for document in documents {
            match document {
                Ok(document) => frames.extend(self.receive(now, &document, events)),
                Err(problem) => self.malformed(problem, events),
            }
        }
        frames
    }

    /// Counts bytes that are no document, as [`super::Frames`] finds them in a stream.
    pub fn malformed(&mut self, problem: Malformed, events: &mut Vec<Event>) {
        self.repeated = false;
        count(&mut self.causes, problem.why.id());
        self.say(events, Event::Malformed(problem));
    }

    /// Looks at the time: silence.
    pub fn tick(&mut self, now: Nanos, events: &mut Vec<Event>) {
        let Some(last) = self.last else { return };
        let lasted = Nanos(now.0.saturating_sub(last.0));
        if !self.silent && lasted > self.options.silence {
            self.silent = true;
            self.say(events, Event::Silent { lasted });
        }
    }

    /// The reply to the newest frame. Each frame gets one; an error sends nothing and remembers nothing.
    pub fn reply(&mut self, values: &Corrections) -> Result<Vec<u8>, ReplyError> {
        if self.config.only_send {
            return Err(ReplyError::OnlySend);
        }
        let Some(pending) = &self.pending else { return Err(ReplyError::NothingToAnswer) };
        let telegram = self.ledger.write(&self.config, pending.form, &pending.text, values)?;
        let mut bytes = Vec::with_capacity(512);
        telegram.encode(&mut bytes);
        self.cached = Some((pending.ipoc, bytes.clone()));
        self.pending = None;
        Ok(bytes)
    }

    /// The reply that is due again, when the newest document repeated a frame that was answered. Each repeat is given one.
    pub fn repeat(&mut self) -> Option<&[u8]> {
        let is_due = core::mem::take(&mut self.repeated);
        let (_, bytes) = self.cached.as_ref().filter(|_| is_due)?;
        Some(bytes)
    }

    /// What was sent last for this name, as text.
    pub fn sent(&self, tag: &str, attribute: &str) -> Option<&str> {
        self.ledger.sent(tag, attribute)
    }

    /// The configuration that it speaks by.
    pub fn config(&self) -> &EthernetConfig {
        &self.config
    }

    /// Advance of the stamp per frame, once learned.
    pub fn step(&self) -> Option<u64> {
        self.stamps.step()
    }

    /// Decimals of the measured pose, once seen.
    pub fn decimals(&self) -> Option<usize> {
        self.quantum.printed()
    }

    /// How often each class of event was said.
    pub fn counts(&self) -> &BTreeMap<&'static str, u64> {
        &self.counts
    }

    /// How often bytes were malformed, or values no numbers, by cause.
    pub fn causes(&self) -> &BTreeMap<&'static str, u64> {
        &self.causes
    }

    fn say(&mut self, events: &mut Vec<Event>, event: Event) {
        count(&mut self.counts, event.class());
        events.push(event);
    }

    fn rob(&mut self, now: Nanos, telegram: Telegram, events: &mut Vec<Event>) -> Option<Frame> {
        let ipoc = telegram.ipoc();
        let only_stamp = telegram.elements.iter().all(|element| element.tag == "IPOC");
        if only_stamp && !telegram.elements.is_empty() && !self.config.send.is_empty() {
            self.alive(now, events);
            self.say(events, Event::Hello { ipoc: ipoc.map(|ipoc| ipoc.value) });
            return None;
        }
        let Some(ipoc) = ipoc else {
            let missing = telegram.element("IPOC").is_none();
            let why = if missing { Why::IpocMissing } else { Why::IpocNotANumber };
            self.malformed(Malformed { at: 0, why }, events);
            return None;
        };
        self.alive(now, events);
        self.header(&telegram, events);
        let seen = self.stamps.take(ipoc.value);
        let missing = self.follow(seen, ipoc.value, events)?;
        let lag = self.pace.take(now, missing.saturating_add(1));
        self.look_at_lag(lag, events);
        if let Some(left) = self.pending.take().filter(|_| self.options.answers) {
            self.say(events, Event::Unanswered { ipoc: left.ipoc });
        }
        if !self.config.only_send {
            self.pending = Some(Pending { ipoc: ipoc.value, text: ipoc.text, form: telegram.form });
        }
        let mut frame = Frame {
            received: now,
            ipoc: ipoc.value,
            unwrapped: self.stamps.unwrapped(),
            session: self.session,
            missing,
            lag,
            pose_mm_deg: telegram.six("RIst", POSE).and_then(Result::ok),
            external: telegram.six("EIPos", EXTERNAL).and_then(Result::ok),
            delay: None,
            telegram,
        };
        frame.delay = self.content(&frame.telegram, events);
        Some(frame)
    }

    /// Something came.
    fn alive(&mut self, now: Nanos, events: &mut Vec<Event>) {
        let before = self.last.replace(now);
        if core::mem::take(&mut self.silent) {
            let lasted = Nanos(now.0.saturating_sub(before.map_or(now.0, |before| before.0)));
            self.say(events, Event::Resumed { lasted });
        }
    }

    fn header(&mut self, telegram: &Telegram, events: &mut Vec<Event>) {
        let foreign = telegram.kind != "KUKA";
        if foreign && !self.foreign_kind {
            let kind = telegram.kind.chars().take(40).collect();
            self.say(events, Event::ForeignType { kind });
        }
        self.foreign_kind = foreign;
        if telegram.upper_type && !self.foreign_spelling {
            self.say(events, Event::ForeignSpelling);
        }
        self.foreign_spelling = telegram.upper_type;
    }

    /// What the stamp says; the number of missing frames when the frame is fresh.
    fn follow(&mut self, seen: Seen, ipoc: u64, events: &mut Vec<Event>) -> Option<u64> {
        let mut missing = 0;
        match seen.what {
            Move::First => {
                self.session = self.session.saturating_add(1);
                self.say(events, Event::Started { ipoc });
            }
            Move::Next => {}
            Move::Gap { missing: frames } => {
                missing = frames;
                self.say(events, Event::Gap { missing, ipoc });
            }
            Move::Irregular { advance, step } => self.say(events, Event::Irregular { advance, step, ipoc }),
            Move::Repeat { times } => {
                self.say(events, Event::Duplicate { ipoc });
                if times == FROZEN {
                    self.say(events, Event::Frozen { ipoc });
                }
                self.repeated = self.cached.as_ref().is_some_and(|(answered, _)| *answered == ipoc);
                return None;
            }
            Move::Behind { by } => {
                self.say(events, Event::OutOfOrder { ipoc, behind: by });
                return None;
            }
            Move::Restart { from } => {
                self.forget();
                self.say(events, Event::Restarted { from, to: ipoc });
            }
        }
        if seen.missed_before > 0 {
            self.say(events, Event::Gap { missing: seen.missed_before, ipoc });
        }
        if seen.wrapped {
            self.say(events, Event::Wrapped { ipoc });
        }
        if let Some(step) = seen.step {
            self.say(events, Event::Step { step });
        }
        Some(missing)
    }

    /// A new session knows nothing of the old one.
    fn forget(&mut self) {
        self.session = self.session.saturating_add(1);
        self.pace = Pace::default();
        self.quantum = Quantum::default();
        self.ledger = Ledger::new(&self.config, self.options.decimals, self.options.mode);
        self.pending = None;
        self.cached = None;
        self.delay = None;
        self.lagging = false;
    }

    fn look_at_lag(&mut self, lag: Nanos, events: &mut Vec<Event>) {
        if !self.lagging && lag > self.options.backlog {
            self.lagging = true;
            self.say(events, Event::Backlog { lag });
        } else if lag.0 < self.options.backlog.0 / 2 {
            self.lagging = false;
        }
    }

    /// Names and values of a fresh frame; what the controller counts as late.
    fn content(&mut self, telegram: &Telegram, events: &mut Vec<Event>) -> Option<i64> {
        for event in self.names.take(&self.config, telegram) {
            if let Event::Number(problem) = &event {
                count(&mut self.causes, problem.why.id());
            }
            self.say(events, event);
        }
        match telegram.element("RIst").and_then(|element| self.quantum.take(element)) {
            Some(Found::Printed(printed)) => self.say(events, Event::Decimals { printed }),
            Some(Found::Significant { printed, significant }) => {
                self.say(events, Event::Coarse { printed, significant });
            }
            None => {}
        }
        let counted = telegram.number("Delay", "D")?.ok()?;
        // A conversion saturates, so that no count on the wire is too large.
        let counted = counted as i64;
        let more = counted.saturating_sub(self.delay.unwrap_or(0));
        if more > 0 {
            self.say(events, Event::Late { count: counted, more });
        }
        self.delay = Some(counted);
        Some(counted)
    }
}

fn count(counts: &mut BTreeMap<&'static str, u64>, name: &'static str) {
    let count = counts.entry(name).or_default();
    *count = count.saturating_add(1);
}
