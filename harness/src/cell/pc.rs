//! The computer's side of one robot's link: frames in, answers out.

use crate::error::Error;
use drivers::rsi::{EXTERNAL, Element, EthernetConfig, Form, POSE, Root, Telegram, fixed, sent};
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// What a frame says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Fresh {
    /// `RIst`, if it is there.
    pub pose_mm_deg: Option<[f64; 6]>,
    /// `EIPos`, if it is there.
    pub external_mm: Option<[f64; 6]>,
}

/// See the module.
pub(super) struct Pc {
    config: EthernetConfig,
    correction: String,
    decimals: u8,
    ipoc: String,
    form: Form,
    last: Option<Vec<u8>>,
}

impl Pc {
    pub fn new(config: EthernetConfig, correction: &str, decimals: u8) -> Self {
        let correction = correction.to_owned();
        Pc { config, correction, decimals, ipoc: String::new(), form: Form::Flat, last: None }
    }

    /// A frame that wants a new answer.
    pub fn receive(&mut self, _now: Nanos, bytes: &[u8], events: &mut BTreeMap<String, u64>) -> Option<Fresh> {
        let frame = match Telegram::decode(bytes) {
            Ok(frame) => frame,
            Err(error) => {
                *events.entry(format!("rsi-malformed-{}", error.why.id())).or_default() += 1;
                self.last = None;
                return None;
            }
        };
        let ipoc = frame.ipoc()?.text;
        if ipoc == self.ipoc {
            return None;
        }
        (self.ipoc, self.form) = (ipoc, frame.form);
        let six = |tag, names| frame.six(tag, names).and_then(Result::ok);
        Some(Fresh { pose_mm_deg: six("RIst", POSE), external_mm: six("EIPos", EXTERNAL) })
    }

    /// The answer to a frame that came again.
    pub fn again(&self) -> Option<Vec<u8>> {
        self.last.clone()
    }

    /// The answer to the newest frame, and what it really says.
    pub fn reply(&mut self, correction: &[f64; 6]) -> Result<(Vec<u8>, [f64; 6]), Error> {
        let mut answer = Telegram::new(Root::Sen, &self.config.sentype, self.form);
        let written = correction.iter().map(|value| fixed(*value, self.decimals)).collect::<Result<Vec<_>, _>>();
        let written = written.map_err(|error| {
            Error::new(format!("the controller commands a pose that is no number: {error}"))
                .help("correct the controller")
        })?;
        answer.elements.push(Element::attributes(&self.correction, POSE.into_iter().zip(written)));
        answer.elements.push(Element::text("IPOC", &self.ipoc));
        let mut bytes = Vec::new();
        answer.encode(&mut bytes);
        self.last = Some(bytes.clone());
        Ok((bytes, correction.map(|value| sent(value, self.decimals))))
    }

    /// Time has passed.
    pub fn tick(&mut self, _now: Nanos, _events: &mut BTreeMap<String, u64>) {}
}
