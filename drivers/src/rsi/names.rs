//! Compares a frame with the configuration: names that are missing or new, values that are no numbers.
//!
//! Each difference is said when it appears, not in every frame. In the `Dat` form a KRC2 adds elements of its own (`ComStatus`,
//! `IPOStat`, `Tick`), so that only attributes of known elements are new there.

use super::config::{Channel, EthernetConfig, Kind};
use super::event::Event;
use super::number::{BadNumber, NumberWhy, parse};
use super::reply::name_of;
use super::telegram::{Form, Telegram};

/// Most differences and most bad numbers that are said of one frame.
const SAID_MAX: usize = 16;

/// Differences of the newest frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    absent: Vec<String>,
    unexpected: Vec<String>,
}

impl Names {
    /// What is new in this frame.
    pub fn take(&mut self, config: &EthernetConfig, telegram: &Telegram) -> Vec<Event> {
        let (absent, numbers) = values(config, telegram);
        let unexpected = unexpected(config, telegram);
        let mut events = Vec::new();
        let new = |known: &[String], name: &&String| !known.contains(name);
        for name in absent.iter().filter(|name| new(&self.absent, name)) {
            events.push(Event::Absent { name: name.clone() });
        }
        for name in unexpected.iter().filter(|name| new(&self.unexpected, name)) {
            events.push(Event::Unexpected { name: name.clone() });
        }
        events.extend(numbers.into_iter().map(Event::Number));
        (self.absent, self.unexpected) = (absent, unexpected);
        events
    }
}

/// Names that are missing, and values that are no numbers.
fn values(config: &EthernetConfig, telegram: &Telegram) -> (Vec<String>, Vec<BadNumber>) {
    let (mut absent, mut numbers) = (Vec::new(), Vec::new());
    for channel in &config.send {
        let Some(element) = telegram.element(&channel.element) else {
            if absent.len() < SAID_MAX && !absent.contains(&channel.element) {
                absent.push(channel.element.clone());
            }
            continue;
        };
        let text = [String::new()];
        let names: &[String] = if channel.attributes.is_empty() { &text } else { &channel.attributes };
        for name in names {
            match element.value(name) {
                None if absent.len() < SAID_MAX => absent.push(name_of(&channel.element, name)),
                Some(value) if numbers.len() < SAID_MAX => {
                    numbers
                        .extend(problem(channel, value).map(|why| BadNumber::new(&channel.element, name, value, why)));
                }
                _ => {}
            }
        }
    }
    (absent, numbers)
}

/// Why a value is none of its channel. An internal name that is not known may hold anything.
fn problem(channel: &Channel, value: &str) -> Option<NumberWhy> {
    let unknown = channel.tag.starts_with("DEF_") && channel.attributes.is_empty();
    let word = channel.kind == Kind::Bool && ["TRUE", "FALSE"].contains(&value.trim_ascii());
    if channel.kind == Kind::String || unknown || word { None } else { parse(value).err() }
}

/// Names that the configuration does not have.
fn unexpected(config: &EthernetConfig, telegram: &Telegram) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for element in telegram.elements.iter().filter(|element| element.tag != "IPOC") {
        if names.len() >= SAID_MAX {
            break;
        }
        if !config.sends(&element.tag) {
            if telegram.form == Form::Flat && !names.contains(&element.tag) {
                names.push(element.tag.clone());
            }
            continue;
        }
        let known = |name: &String| {
            config.send.iter().any(|channel| channel.element == element.tag && channel.attributes.contains(name))
        };
        let new = element.attributes.iter().map(|(name, _)| name).filter(|name| !known(name));
        names.extend(new.take(SAID_MAX - names.len()).map(|name| name_of(&element.tag, name)));
    }
    names
}
