//! A reply as the controller judges it, in this order.
//!
//! | finding | what becomes of the reply |
//! |---|---|
//! | no document, or one of the other direction | RSIBad |
//! | `Type` is not SENTYPE, to the letter | dropped without a trace; late |
//! | IPOC is not that of this cycle's frame | late |
//! | an element or attribute that RECEIVE does not name | nothing; on iiQKA late |
//! | a value that is no number (comma, exponent, NaN) | RSIBad |
//! | an output that it does not name | that output alone does what HOLDON says |
//!
//! Source: reference/PROTOCOLS.md, sections 1.3 and 1.6. Inferred: the last four rows but for the second; that a real parser takes
//! no exponent is not known, and a computer that sends one is wrong in any case.

use super::controller_event::Refusal;
use super::controller_settings::Family;
use super::{BadNumber, NumberWhy, split};
use super::{Channel, Kind, Root, Telegram};

/// One output of the ETHERNET object.
#[derive(Debug, Clone)]
pub(super) struct Output {
    pub(super) element: String,
    pub(super) attribute: String,
    kind: Kind,
    hold: bool,
    pub(super) value: f64,
}

/// The outputs of RECEIVE, all 0.
pub(super) fn outputs(receive: &[Channel]) -> Vec<Output> {
    let mut outputs = Vec::new();
    for channel in receive {
        let text = channel.attributes.is_empty().then(String::new);
        for attribute in channel.attributes.iter().cloned().chain(text) {
            let (element, kind) = (channel.element.clone(), channel.kind);
            outputs.push(Output { element, attribute, kind, hold: channel.hold == Some(true), value: 0.0 });
        }
    }
    outputs
}

impl Output {
    /// What it does where no value came; whether it fell.
    pub(super) fn release(&mut self) -> bool {
        let falls = !self.hold && self.value.abs() > 0.0;
        if falls {
            self.value = 0.0;
        }
        falls
    }
}

/// What a reply is judged by.
pub(super) struct Judge<'a> {
    pub(super) sentype: &'a str,
    pub(super) family: Family,
    pub(super) expected: Option<u64>,
    pub(super) outputs: &'a [Output],
}

impl Judge<'_> {
    /// The documents of a packet: for each the values of the outputs (`None`: not named), or why it is refused.
    pub(super) fn packet(&self, bytes: &[u8]) -> Vec<Result<Vec<Option<f64>>, Refusal>> {
        let documents = split(bytes).into_iter();
        documents.map(|document| self.document(&document.map_err(Refusal::Malformed)?)).collect()
    }

    fn document(&self, bytes: &[u8]) -> Result<Vec<Option<f64>>, Refusal> {
        let reply = Telegram::decode(bytes).map_err(Refusal::Malformed)?;
        if reply.root != Root::Sen {
            return Err(Refusal::Direction);
        }
        // A reply says `Type`; another spelling is another attribute, so that there is no type at all.
        if reply.kind != self.sentype || reply.upper_type {
            return Err(Refusal::Type { got: reply.kind.chars().take(40).collect() });
        }
        let got = reply.ipoc().map(|ipoc| ipoc.value);
        if got.is_none() || got != self.expected {
            return Err(Refusal::Ipoc { expected: self.expected, got });
        }
        if self.family == Family::IiQka
            && let Some(name) = self.unknown(&reply)
        {
            return Err(Refusal::Mapping { name });
        }
        self.outputs.iter().map(|output| value(&reply, output)).collect()
    }

    /// What the reply names and RECEIVE does not.
    fn unknown(&self, reply: &Telegram) -> Option<String> {
        let known = |element: &str, attribute: Option<&str>| {
            self.outputs.iter().any(|output| {
                output.element == element && attribute.is_none_or(|attribute| output.attribute == attribute)
            })
        };
        reply.elements.iter().filter(|element| element.tag != "IPOC").find_map(|element| {
            if !known(&element.tag, None) {
                return Some(element.tag.clone());
            }
            let mut names = element.attributes.iter().map(|(name, _)| name);
            names.find(|name| !known(&element.tag, Some(name))).map(|name| format!("{}.{name}", element.tag))
        })
    }
}

fn value(reply: &Telegram, output: &Output) -> Result<Option<f64>, Refusal> {
    if output.kind == Kind::String {
        return Ok(None);
    }
    match reply.number(&output.element, &output.attribute) {
        None | Some(Err(BadNumber { why: NumberWhy::Absent, .. })) => Ok(None),
        Some(Ok(value)) => Ok(Some(value)),
        Some(Err(bad)) => truth(&bad.text).filter(|_| output.kind == Kind::Bool).map(Some).ok_or(Refusal::Number(bad)),
    }
}

/// A BOOL may be a word.
fn truth(text: &str) -> Option<f64> {
    let is = |word: &str| text.trim_ascii().eq_ignore_ascii_case(word);
    if is("true") { Some(1.0) } else { is("false").then_some(0.0) }
}
