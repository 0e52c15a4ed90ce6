//! What came from the sensor, whether or not it was a reading: so that another protocol than the configured one can be told.

use drivers::ft::Event;
use std::collections::BTreeMap;
use std::fmt;

/// Lengths that are remembered.
const LENGTHS_MAX: usize = 8;

/// Datagrams, or pieces of a stream, and what was wrong with them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heard {
    count: u64,
    lengths: BTreeMap<usize, u64>,
    /// Why the first that was no record was none.
    why: Option<String>,
}

impl Heard {
    pub(super) fn take(&mut self, length: usize, events: &[Event]) {
        self.count += 1;
        if self.lengths.len() < LENGTHS_MAX || self.lengths.contains_key(&length) {
            *self.lengths.entry(length).or_insert(0) += 1;
        }
        if self.why.is_none() {
            let found = events.iter().find(|event| matches!(event, Event::Malformed(_)));
            self.why = found.map(ToString::to_string);
        }
    }

    /// Whether nothing came.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl fmt::Display for Heard {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lengths: Vec<String> =
            self.lengths.iter().map(|(length, count)| format!("{count} of {length} bytes")).collect();
        let lengths = if lengths.is_empty() { "nothing".to_owned() } else { lengths.join(", ") };
        match &self.why {
            Some(why) => write!(out, "{lengths}; the first is {why}"),
            None => out.write_str(&lengths),
        }
    }
}
