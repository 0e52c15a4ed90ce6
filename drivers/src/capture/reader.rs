//! A capture, piece by piece.

use super::container::{Container, Frame, Record};
use super::internet::{self, Carried};
use super::link;
use super::packet::{Damage, Packet, Skip, Tally, Transport, Why};
use super::stream::Streams;
use sim_core::time::Nanos;

/// Reads a capture. Between two calls it holds at most one incomplete record and what TCP holds back.
#[derive(Debug)]
pub struct Reader {
    container: Container,
    streams: Streams,
    tally: Tally,
    /// The beginning of a record whose end has not come yet.
    rest: Vec<u8>,
    /// Where `rest` begins in the capture.
    at: u64,
    /// Bytes to step over that have not come yet.
    leap: u64,
    last: Nanos,
    damage: Option<Damage>,
}

impl Default for Reader {
    fn default() -> Self {
        Reader {
            container: Container::Unknown,
            streams: Streams::default(),
            tally: Tally::default(),
            rest: Vec::new(),
            at: 0,
            leap: 0,
            last: Nanos(0),
            damage: None,
        }
    }
}

impl Reader {
    /// Takes the next bytes, however they are cut, and hands out the packets that they complete.
    ///
    /// # Errors
    /// When the container contradicts itself: then, and at every later call, with the same damage. The packets before it
    /// have been handed out.
    pub fn push(&mut self, bytes: &[u8], out: &mut Vec<Packet>) -> Result<(), Damage> {
        if let Some(damage) = &self.damage {
            return Err(damage.clone());
        }
        let leap = self.leap.min(bytes.len() as u64);
        self.leap -= leap;
        self.at += leap;
        // No longer than the slice, so it fits.
        let mut unread = std::mem::take(&mut self.rest);
        unread.extend_from_slice(&bytes[leap as usize..]);
        let (used, outcome) = self.records(&unread, out);
        self.rest = unread.split_off(used);
        outcome.map_err(|why| {
            let damage = Damage { at: self.at, why };
            self.rest = Vec::new();
            self.damage = Some(damage.clone());
            damage
        })
    }

    /// The capture has ended.
    ///
    /// # Errors
    /// When it ended inside a record, or was damaged before. What TCP held back has been handed out.
    pub fn finish(&mut self, out: &mut Vec<Packet>) -> Result<(), Damage> {
        self.streams.finish(self.last, &mut self.tally, out);
        if self.damage.is_none() && (!self.rest.is_empty() || self.leap > 0 || self.at == 0) {
            let there = self.rest.len() as u64;
            self.damage = Some(Damage { at: self.at, why: Why::CutOff { there } });
        }
        self.damage.clone().map_or(Ok(()), Err)
    }

    /// What passed so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// How many bytes are held for the record that is not complete.
    pub fn held(&self) -> usize {
        self.rest.len()
    }

    fn records(&mut self, unread: &[u8], out: &mut Vec<Packet>) -> (usize, Result<(), Why>) {
        let mut used = 0;
        loop {
            let taken = match self.container.take(&unread[used..]) {
                Ok(Some(taken)) => taken,
                Ok(None) => return (used, Ok(())),
                Err(why) => return (used, Err(why)),
            };
            let there = (unread.len() - used) as u64;
            self.at += taken.used.min(there);
            self.leap = taken.used.saturating_sub(there);
            used += taken.used.min(there) as usize;
            match taken.record {
                Record::None => {}
                Record::Skipped(why) => {
                    self.tally.frames += 1;
                    self.tally.skip(why);
                }
                Record::Frame(frame) => {
                    self.tally.frames += 1;
                    self.last = frame.at;
                    if let Err(why) = self.frame(frame, out) {
                        self.tally.skip(why);
                    }
                }
            }
        }
    }

    fn frame(&mut self, frame: Frame<'_>, out: &mut Vec<Packet>) -> Result<(), Skip> {
        let packet = link::internet(frame.link, frame.bytes)?;
        let (from, to, carried) = internet::open(packet, frame.is_cut)?;
        match carried {
            Carried::Datagram { payload } => {
                self.tally.packets += 1;
                let payload = payload.to_vec();
                out.push(Packet { at: frame.at, from, to, transport: Transport::Udp, payload, broken: false });
            }
            Carried::Segment(segment) => {
                self.streams.segment(frame.at, (from, to), &segment, &mut self.tally, out);
            }
        }
        Ok(())
    }
}
