//! Random and mutated inputs: every one follows from the name of its stream, so that a failure can be had again.

use sim_core::rng::Stream;

/// Longest input; a little more than what a datagram or a document may hold.
const LENGTH_MAX: usize = 70_000;
/// One input in this many is repeated until it is longer than anything allowed.
const HUGE_ONE_IN: usize = 4000;
/// One input in this many is nothing but random bytes.
const RANDOM_ONE_IN: usize = 16;
/// Bytes that decoders look for, or that lie at the edge of a type.
const BYTES: &[u8] = b"\0\x01\x7f\x80\xff<>/=\"' \n\t0159-+.,eE&;[]{}#TQR\xaa\x4e";
/// Pieces of text that mean something to one of the decoders.
const WORDS: &[&[u8]] = &[
    b"<Rob",
    b"</Rob>",
    b"<Sen",
    b"</Sen>",
    b"<Dat TaskType=\"b\">",
    b"</Dat>",
    b"<IPOC>",
    b"</IPOC>",
    b"<IPOC>18446744073709551615</IPOC>",
    b"<IPOC>4294967295</IPOC>",
    b"<Delay D=\"-1\"/>",
    b"01=\"1\"",
    b"NaN",
    b"inf",
    b"-0",
    b"1e999",
    b"1,5",
    b"99999999999999999999",
    b"<!--",
    b"-->",
    b"<![CDATA[",
    b"&#0;",
    b"<ELEMENT TAG=\"DEF_Tech.T1\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>",
    b"HOLDON=\"0\"",
    b"[sensor]",
    b"nan",
    b"[[fault]]",
];
/// Pieces of records that mean something to one of the decoders.
const RECORDS: &[&[u8]] = &[
    b"\0\0\0\0\0\0\0\0",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"\x80\0\0\0",
    b"\x12\x34",
    b"\x20\x4e",
    b"\xff\xff",
    b"\x4d\x3c\xb2\xa1",
    b"\x0a\x0d\x0d\x0a",
    b"\x06\0\0\0",
];

/// A source of inputs.
pub struct Mutator<'a> {
    seeds: &'a [Vec<u8>],
    stream: Stream,
    /// Whether the seed is text: then few bytes come in that are none, since most decoders of text look no further.
    is_text: bool,
}

impl<'a> Mutator<'a> {
    /// Inputs around these.
    pub fn new(seeds: &'a [Vec<u8>], stream: Stream) -> Self {
        Mutator { seeds, stream, is_text: false }
    }

    /// A whole number below `limit`; 0 if that is 0.
    fn below(&mut self, limit: usize) -> usize {
        (self.stream.uniform() * limit as f64) as usize
    }

    fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    /// The next input.
    pub fn next(&mut self) -> Vec<u8> {
        if self.one_in(RANDOM_ONE_IN) {
            let length = self.below(400);
            return (0..length).map(|_| self.below(256) as u8).collect();
        }
        let seed = self.below(self.seeds.len());
        let mut input = self.seeds[seed].clone();
        self.is_text = input.is_ascii() && !self.one_in(10);
        // One input in ten or so stays sound, so that what follows the decoding is reached as well.
        for _ in 0..self.below(10).min(self.below(10)) {
            self.mutate(&mut input);
        }
        if self.one_in(HUGE_ONE_IN) && !input.is_empty() {
            let from = self.below(input.len());
            let piece = input[from..(from + 64).min(input.len())].to_vec();
            while input.len() < LENGTH_MAX {
                input.extend_from_slice(&piece);
            }
        }
        input.truncate(LENGTH_MAX);
        input
    }

    fn byte(&mut self) -> u8 {
        let byte = if self.one_in(2) { BYTES[self.below(BYTES.len())] } else { self.below(256) as u8 };
        if self.is_text { byte & 0x7f } else { byte }
    }

    fn word(&mut self) -> &'static [u8] {
        let words = if self.is_text || self.one_in(4) { WORDS } else { RECORDS };
        words[self.below(words.len())]
    }

    fn mutate(&mut self, input: &mut Vec<u8>) {
        let at = self.below(input.len() + 1);
        let until = (at + 1 + self.below(24)).min(input.len());
        match self.below(10) {
            0 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << self.below(if self.is_text { 7 } else { 8 });
                }
            }
            1 | 2 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte = self.byte();
                }
            }
            3 => input.insert(at, self.byte()),
            4 => drop(input.drain(at.min(until)..until)),
            5 => {
                let piece = input[at.min(until)..until].to_vec();
                let to = self.below(input.len() + 1);
                input.splice(to..to, piece);
            }
            6 if self.one_in(4) => input.truncate(at),
            7 if self.one_in(4) => {
                let other = &self.seeds[self.below(self.seeds.len())];
                let from = self.below(other.len() + 1);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            6..9 => {
                let word = self.word();
                input.splice(at..at, word.iter().copied());
            }
            // A word in place of what was there, so that lengths stay right.
            _ => {
                let word = self.word();
                for (byte, new) in input.iter_mut().skip(at).zip(word) {
                    *byte = *new;
                }
            }
        }
    }
}
