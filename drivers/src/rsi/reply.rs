//! Replies: corrections by name, written as the configuration wants them.
//!
//! Elements, attributes and their order come from RECEIVE, `Type` is SENTYPE, IPOC is last and echoes the digits of the frame. A
//! channel that is given nothing keeps what it had; a DOUBLE of a relative link falls to zero, since its value is a step. What
//! was sent is kept as sent, with its decimals, in a ledger; a refused reply leaves it untouched.

use super::config::{EthernetConfig, Kind};
use super::dangers::Mode;
use super::layout::{Slot, layout};
use super::telegram::{Element, Form, Root, Telegram};
use super::write::{NotFinite, fixed};

/// Longest text that is sent.
const TEXT_MAX: usize = 256;

/// Values for a reply, by the names of the configuration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Corrections {
    values: Vec<(String, String, Value)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Number(f64),
    Flag(bool),
    Text(String),
}

impl Corrections {
    /// Nothing: every channel keeps its value, or its step of zero.
    pub fn none() -> Self {
        Corrections::default()
    }

    /// Six values of one element, such as `RKorr` with X..C in mm and degrees.
    pub fn six(tag: &str, attributes: [&str; 6], values: [f64; 6]) -> Self {
        let mut corrections = Corrections::none();
        for (attribute, value) in attributes.into_iter().zip(values) {
            corrections.number(tag, attribute, value);
        }
        corrections
    }

    /// A number, in the unit of the wire; `attribute` is empty for the text of an element.
    pub fn number(&mut self, tag: &str, attribute: &str, value: f64) -> &mut Self {
        self.push(tag, attribute, Value::Number(value))
    }

    /// A switch, such as `Stop`.
    pub fn flag(&mut self, tag: &str, attribute: &str, value: bool) -> &mut Self {
        self.push(tag, attribute, Value::Flag(value))
    }

    /// A text, such as `EStr`.
    pub fn text(&mut self, tag: &str, attribute: &str, value: &str) -> &mut Self {
        self.push(tag, attribute, Value::Text(value.to_owned()))
    }

    fn push(&mut self, tag: &str, attribute: &str, value: Value) -> &mut Self {
        self.values.push((tag.to_owned(), attribute.to_owned(), value));
        self
    }
}

/// A reply that is not sent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReplyError {
    /// No frame waits for an answer; each gets one.
    #[error("no frame waits for an answer; answer each fresh frame once")]
    NothingToAnswer,
    /// The configuration says that no reply is expected.
    #[error("ONLYSEND is TRUE: the controller takes no reply; set it to FALSE")]
    OnlySend,
    /// A name that the configuration does not take.
    #[error("{name} is not in RECEIVE of the configuration; there are {known}")]
    Unknown {
        /// Element, or element and attribute.
        name: String,
        /// What the configuration takes.
        known: String,
    },
    /// A value that cannot be written.
    #[error("{name}: {problem}")]
    NotFinite {
        /// Element, or element and attribute.
        name: String,
        /// The value.
        problem: NotFinite,
    },
    /// A value of another type than the configuration says.
    #[error("{name} = {value} is no {want}")]
    WrongKind {
        /// Element, or element and attribute.
        name: String,
        /// The value.
        value: String,
        /// Type that the configuration says.
        want: &'static str,
    },
}

/// What was sent last, channel by channel.
#[derive(Debug, Clone)]
pub(super) struct Ledger {
    slots: Vec<Slot>,
    sent: Vec<Vec<String>>,
    decimals: u8,
    mode: Mode,
}

/// Name of an attribute, or of an element whose text is meant.
pub(super) fn name_of(tag: &str, attribute: &str) -> String {
    if attribute.is_empty() { tag.to_owned() } else { format!("{tag}.{attribute}") }
}

impl Ledger {
    /// All zero.
    pub fn new(config: &EthernetConfig, decimals: u8, mode: Mode) -> Self {
        let slots = layout(&config.receive);
        let zero = |slot: &Slot| {
            slot.fields.iter().map(|(_, channel)| zero(config.receive[*channel].kind, decimals)).collect()
        };
        let sent = slots.iter().map(zero).collect();
        Ledger { slots, sent, decimals, mode }
    }

    /// What was sent last for this name.
    pub fn sent(&self, tag: &str, attribute: &str) -> Option<&str> {
        let (slot, field) = self.find(tag, attribute)?;
        Some(&self.sent[slot][field])
    }

    fn find(&self, tag: &str, attribute: &str) -> Option<(usize, usize)> {
        let slot = self.slots.iter().position(|slot| slot.element == tag)?;
        let field = self.slots[slot].fields.iter().position(|(name, _)| name == attribute)?;
        Some((slot, field))
    }

    /// The reply to the frame with this stamp; what it holds is remembered.
    pub fn write(
        &mut self,
        config: &EthernetConfig,
        form: Form,
        ipoc: &str,
        corrections: &Corrections,
    ) -> Result<Telegram, ReplyError> {
        let mut next = self.sent.clone();
        if self.mode == Mode::Relative {
            for (slot, values) in self.slots.iter().zip(&mut next) {
                for ((_, channel), value) in slot.fields.iter().zip(values) {
                    if config.receive[*channel].kind == Kind::Double {
                        *value = zero(Kind::Double, self.decimals);
                    }
                }
            }
        }
        for (tag, attribute, value) in &corrections.values {
            let Some((slot, field)) = self.find(tag, attribute) else {
                return Err(ReplyError::Unknown { name: name_of(tag, attribute), known: self.known() });
            };
            let kind = config.receive[self.slots[slot].fields[field].1].kind;
            next[slot][field] = text_of(kind, value, self.decimals, &name_of(tag, attribute))?;
        }
        self.sent = next;
        Ok(self.telegram(config, form, ipoc))
    }

    fn telegram(&self, config: &EthernetConfig, form: Form, ipoc: &str) -> Telegram {
        let mut telegram = Telegram::new(Root::Sen, &config.sentype, form);
        for (slot, values) in self.slots.iter().zip(&self.sent) {
            let mut element = Element { tag: slot.element.clone(), ..Element::default() };
            for ((name, _), value) in slot.fields.iter().zip(values) {
                if name.is_empty() {
                    element.text.clone_from(value);
                } else {
                    element.attributes.push((name.clone(), value.clone()));
                }
            }
            telegram.elements.push(element);
        }
        telegram.elements.push(Element::text("IPOC", ipoc));
        telegram
    }

    fn known(&self) -> String {
        let names = self.slots.iter().flat_map(|slot| slot.fields.iter().map(|(name, _)| name_of(&slot.element, name)));
        let names: Vec<String> = names.collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }
}

fn zero(kind: Kind, decimals: u8) -> String {
    match kind {
        Kind::Bool | Kind::Long => "0".to_owned(),
        Kind::Double => fixed(0.0, decimals).unwrap_or_default(),
        Kind::String => String::new(),
    }
}

/// How a value of this type is written.
fn text_of(kind: Kind, value: &Value, decimals: u8, name: &str) -> Result<String, ReplyError> {
    let wrong = |value: String, want| Err(ReplyError::WrongKind { name: name.to_owned(), value, want });
    match (kind, value) {
        (Kind::Double, Value::Number(number)) => {
            fixed(*number, decimals).map_err(|problem| ReplyError::NotFinite { name: name.to_owned(), problem })
        }
        (Kind::Long, Value::Number(number)) => {
            // The range of 32 bits is exact in a double, and the fraction decides whether it is whole.
            let whole = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(number) && number.fract() == 0.0;
            if whole { Ok(format!("{}", *number as i32)) } else { wrong(number.to_string(), "whole number of 32 bits") }
        }
        (Kind::Bool, Value::Flag(flag)) => Ok(u8::from(*flag).to_string()),
        (Kind::String, Value::Text(text)) => {
            let sound = text.len() <= TEXT_MAX && !text.chars().any(|c| c.is_control() || "<>&\"'".contains(c));
            if sound {
                Ok(text.clone())
            } else {
                let shown = text.chars().take(40).collect();
                wrong(shown, "text of at most 256 bytes without < > & quotes and control characters")
            }
        }
        (Kind::Bool, other) => wrong(shown(other), "BOOL; give a flag"),
        (Kind::String, other) => wrong(shown(other), "STRING; give a text"),
        (Kind::Long | Kind::Double, other) => wrong(shown(other), "number"),
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::Flag(flag) => flag.to_string(),
        Value::Text(text) => text.chars().take(40).collect(),
    }
}
