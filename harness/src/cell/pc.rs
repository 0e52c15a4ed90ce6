//! The computer's side of one robot's link, with its events counted.

use crate::error::Error;
use drivers::rsi::{Corrections, EthernetConfig, Event, Host, HostOptions, Malformed, Mode, POSE};
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// What the newest frame says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Fresh {
    /// `RIst`, if it is there.
    pub pose_mm_deg: Option<[f64; 6]>,
    /// `EIPos`, if it is there.
    pub external_mm: Option<[f64; 6]>,
    /// The controller did not take the newest answer: it counts more late ones than frames without an answer.
    pub is_refused: bool,
}

/// See the module.
pub(super) struct Pc {
    host: Host,
    correction: String,
    events: Vec<Event>,
    /// Late answers that the controller had counted in the newest frame.
    late: i64,
}

impl Pc {
    pub fn new(config: EthernetConfig, correction: &str, decimals: u8, mode: Mode) -> Self {
        let host = Host::new(config, HostOptions { decimals, mode, ..HostOptions::default() });
        Pc { host, correction: correction.to_owned(), events: Vec::new(), late: 0 }
    }

    /// The newest of the frames that came at once, if it wants a new answer.
    pub fn receive(
        &mut self,
        now: Nanos,
        documents: Vec<Result<Vec<u8>, Malformed>>,
        counts: &mut BTreeMap<String, u64>,
    ) -> Option<Fresh> {
        let frames = self.host.receive_documents(now, documents, &mut self.events);
        self.count(counts);
        let frame = frames.last()?;
        let unanswered = frames.iter().map(|frame| frame.missing).sum::<u64>() + frames.len() as u64 - 1;
        let late = frame.delay.unwrap_or(self.late);
        let is_refused = late.saturating_sub(self.late) > i64::try_from(unanswered).unwrap_or(i64::MAX);
        self.late = late;
        Some(Fresh { pose_mm_deg: frame.pose_mm_deg, external_mm: frame.external, is_refused })
    }

    /// The answer to a frame that came again.
    pub fn again(&mut self) -> Option<Vec<u8>> {
        self.host.repeat().map(<[u8]>::to_vec)
    }

    /// The answer to the newest frame, and what it really says.
    pub fn reply(&mut self, correction: &[f64; 6]) -> Result<(Vec<u8>, [f64; 6]), Error> {
        let mut values = Corrections::none();
        for (name, value) in POSE.into_iter().zip(correction) {
            if self.host.config().receives(&self.correction, name).is_some() {
                values.number(&self.correction, name, *value);
            }
        }
        let bytes = self.host.reply(&values).map_err(|error| {
            let help = "correct the controller, or the Ethernet configuration of the robot";
            Error::new(format!("no answer can be written: {error}")).help(help)
        })?;
        let sent = |name| self.host.sent(&self.correction, name).and_then(|text| text.parse().ok());
        Ok((bytes, POSE.map(|name| sent(name).unwrap_or(0.0))))
    }

    /// Time has passed.
    pub fn tick(&mut self, now: Nanos, counts: &mut BTreeMap<String, u64>) {
        self.host.tick(now, &mut self.events);
        self.count(counts);
    }

    fn count(&mut self, counts: &mut BTreeMap<String, u64>) {
        for event in self.events.drain(..).filter(|event| !event.is_news()) {
            *counts.entry(event.class().to_owned()).or_default() += 1;
        }
    }
}
