//! Records in a stream of bytes: pieces put together, noise stepped over and counted.
//!
//! A position is a record only if its decoder says so, checksum and all: a byte that looks like the beginning of one also occurs
//! inside. A record with a wrong checksum right after a good one is named as such; other bytes between records are garbage.

use super::client::Found;
use super::event::Malformed;

/// Bytes without a record after which the garbage is reported, so that a stream of it is noticed.
const GARBAGE_MAX: usize = 512;
/// Bytes that are looked at in one piece.
const PIECE: usize = 4096;

/// What a decoder says of the bytes at a position.
pub enum Verdict {
    /// This many bytes are this.
    Take(usize, Found),
    /// It may become something.
    More,
    /// It is nothing.
    No(Malformed),
}

/// Bytes that are not yet a record.
#[derive(Debug, Clone, Default)]
pub struct Framer {
    buffer: Vec<u8>,
    skipped: usize,
    /// Bytes of a record that was already reported as damaged.
    blamed: usize,
    /// The last thing was a record, so that the next begins here.
    aligned: bool,
}

impl Framer {
    /// Takes a piece of the stream. `look` sees at least one byte; where it says [`Verdict::More`] it must come to a decision
    /// within a bounded number of bytes.
    pub fn push(&mut self, bytes: &[u8], found: &mut Vec<Found>, mut look: impl FnMut(&[u8]) -> Verdict) {
        for piece in bytes.chunks(PIECE) {
            self.buffer.extend_from_slice(piece);
            let mut at = 0;
            while let Some(rest) = self.buffer.get(at..).filter(|rest| !rest.is_empty()) {
                match look(rest) {
                    Verdict::Take(length, item) => {
                        self.report(found);
                        found.push(item);
                        self.aligned = true;
                        at += length.max(1);
                    }
                    Verdict::More => break,
                    Verdict::No(why) => {
                        if let (true, Malformed::Checksum { bytes, .. }) = (self.aligned, &why) {
                            self.blamed = *bytes;
                            found.push(Found::Malformed(why));
                        }
                        self.aligned = false;
                        self.skipped += 1;
                        at += 1;
                        if self.skipped >= GARBAGE_MAX {
                            self.report(found);
                        }
                    }
                }
            }
            self.buffer.drain(..at.min(self.buffer.len()));
        }
    }

    /// Drops what is half read.
    pub fn clear(&mut self) {
        *self = Framer::default();
    }

    fn report(&mut self, found: &mut Vec<Found>) {
        let bytes = self.skipped.saturating_sub(self.blamed);
        if bytes > 0 {
            found.push(Found::Malformed(Malformed::Garbage { bytes }));
        }
        self.skipped = 0;
        self.blamed = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ft::Event;

    /// A record is 0x10, a byte, and the byte again.
    fn look(bytes: &[u8]) -> Verdict {
        match bytes {
            [0x10, value, check, ..] if value == check => {
                Verdict::Take(3, Found::Event(Event::Answer(value.to_string())))
            }
            [0x10, got, computed, ..] => {
                Verdict::No(Malformed::Checksum { got: u64::from(*got), computed: u64::from(*computed), bytes: 3 })
            }
            [0x10, ..] => Verdict::More,
            _ => Verdict::No(Malformed::Header { got: 0, wanted: 0x10, at: 0 }),
        }
    }

    fn check(pieces: &[&[u8]], wanted: &str) {
        let (mut framer, mut found) = (Framer::default(), Vec::new());
        pieces.iter().for_each(|piece| framer.push(piece, &mut found, look));
        let said: Vec<String> = found
            .iter()
            .map(|item| match item {
                Found::Event(Event::Answer(text)) => text.clone(),
                Found::Malformed(why) => why.to_string(),
                other => format!("{other:?}"),
            })
            .collect();
        assert_eq!(said.join(" | "), wanted);
    }

    #[test]
    fn pieces_become_records_and_noise_is_counted() {
        check(&[&[0x10, 5], &[5, 0x10], &[6, 6]], "5 | 6");
        check(&[&[1, 2, 3, 0x10, 5, 5]], "3 bytes between records | 5");
        // The byte that begins a record occurs inside one.
        check(&[&[0x10, 0x10, 0x10, 0x10, 7, 7]], "16 | 7");
        check(&[&[9, 0x10, 0x10, 7, 7]], "2 bytes between records | 7");
    }

    #[test]
    fn a_damaged_record_is_named_once() {
        check(&[&[0x10, 5, 5, 0x10, 6, 9, 0x10, 7, 7]], "5 | checksum 0x6, computed 0x9 | 7");
        check(
            &[&[0x10, 5, 5, 0x10, 6, 9, 1, 0x10, 7, 7]],
            "5 | checksum 0x6, computed 0x9 | 1 bytes between records | 7",
        );
    }

    #[test]
    fn endless_noise_is_said_and_not_kept() {
        let (mut framer, mut found) = (Framer::default(), Vec::new());
        framer.push(&vec![0xff; 100_000], &mut found, look);
        assert_eq!(found.len(), 100_000 / GARBAGE_MAX);
        assert_eq!(framer.buffer.len(), 0);
    }
}
