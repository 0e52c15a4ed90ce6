//! A stream with its faults: what is sent goes in, what arrives comes out.

use super::schedule::{Event, Schedule};
use super::stage::Stage;
use super::table::{Needs, row};
use super::wire_fault::{Stream, WireFault};
use sim_core::rng::Streams;
use sim_core::time::Nanos;

/// A packet that arrives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Out {
    /// Number of the packet of the stream with which it arrives: what was delayed has a later one than when it was sent.
    pub number: u64,
    /// How much later than that, below one period; above zero only with jitter.
    pub within: Nanos,
    /// What arrives.
    pub bytes: Vec<u8>,
}

/// The faults of one stream, in the order of their list: what one lets through is what the next sees.
pub struct Faulty {
    stages: Vec<Stage>,
    period: Nanos,
}

impl Faulty {
    /// Of these faults those that act on the bytes of the stream `on`, on the link of `robot` (`first`: it has those too that
    /// name nobody). `period` is the time between two packets. A fault's random numbers depend on its place in `faults`.
    pub fn new(on: Stream, robot: Robot<'_>, faults: &[WireFault], period: Nanos, streams: &Streams) -> Self {
        let here = |fault: &WireFault| {
            let bytes = row(fault.id(), fault.on).is_some_and(|row| row.needs == Needs::Bytes);
            bytes && fault.on == on && robot.has(fault)
        };
        let stages = faults.iter().enumerate().filter(|(_, fault)| here(fault));
        let stages = stages.map(|(index, fault)| Stage::new(fault.clone(), Schedule::new(fault, index, streams)));
        Faulty { stages: stages.collect(), period }
    }

    /// This event has happened; faults that wait for it start with the next packet.
    pub fn event(&mut self, event: Event) {
        self.stages.iter_mut().for_each(|stage| stage.event(event));
    }

    /// What arrives with this number, in its order. To be called with every number, also where nothing is sent, since what is
    /// held is let go by number.
    pub fn pass(&mut self, number: u64, packet: Option<&[u8]>, out: &mut Vec<Out>) {
        let sent = packet.map(|bytes| Out { number, within: Nanos(0), bytes: bytes.to_vec() });
        let mut packets: Vec<Out> = sent.into_iter().collect();
        for stage in &mut self.stages {
            stage.pass(number, self.period, &mut packets);
        }
        for packet in packets {
            out.push(Out { number, ..packet });
        }
    }

    /// Each fault and what has come of it, in the order of the list.
    pub fn faults(&self) -> impl Iterator<Item = (&WireFault, &Schedule)> {
        self.stages.iter().map(|stage| (&stage.fault, &stage.schedule))
    }

    /// Those that did nothing: each is an error of the run.
    pub fn never_acted(&self) -> impl Iterator<Item = &WireFault> {
        self.faults().filter(|(_, schedule)| schedule.acted() == 0).map(|(fault, _)| fault)
    }

    /// Packets that are still held back.
    pub fn holds(&self) -> usize {
        self.stages.iter().map(Stage::holds).sum()
    }

    /// Packets that were lost because a fault would have held more than its memory.
    pub fn lost(&self) -> u64 {
        self.stages.iter().map(|stage| stage.lost).sum()
    }
}

/// Whose link a stream belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Robot<'a> {
    /// The first robot of the cell, or the only one: also of faults that name no robot.
    First(&'a str),
    /// Another robot.
    Other(&'a str),
    /// No robot's: the sensor's.
    None,
}

impl Robot<'_> {
    fn has(self, fault: &WireFault) -> bool {
        match (self, fault.robot.as_deref()) {
            (Robot::First(_) | Robot::None, None) => true,
            (Robot::First(name) | Robot::Other(name), Some(robot)) => name == robot,
            (Robot::Other(_), None) | (Robot::None, Some(_)) => false,
        }
    }
}
