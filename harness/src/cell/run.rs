//! One run of a virtual cell with somebody at the other end of its wires.

use super::config::Cell;
use super::controller::Controller;
use super::faults::{Account, Faults, watched};
use super::net_faults::NetFaults;
use super::on_wire::OnWire;
use super::virtual_cell::{Line, Moment, Packet, VirtualCell};
use crate::blocks;
use crate::error::Error;
use crate::model::{Chosen, Model};
use crate::recording::Session;
use crate::simulate;
use drivers::fault::{Schedule, WireFault};
use serde::Serialize;
use sim_core::closed_loop::{Start, Stepped};
use sim_core::effect::{Attached, Catalog};
use sim_core::refusal::plain;
use sim_core::rng::Streams;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// How a run is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How long, in the cell's own time.
    pub duration_s: f64,
    /// Whether what is exchanged is kept: without it the session is empty, and memory does not grow with the length of the run.
    pub keeps: bool,
}

/// What the other side sends in one cycle.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answers {
    /// Answers for robots, in the order in which they came.
    pub replies: Vec<(usize, Vec<u8>)>,
    /// Requests for the sensor.
    pub requests: Vec<Vec<u8>>,
    /// The other side is gone: the run ends after this cycle.
    pub gone: bool,
    /// A signal asked for the end.
    pub interrupted: bool,
}

/// Somebody at the other end of the wires.
pub trait Peer {
    /// Takes the faults that need sockets, before anything else.
    ///
    /// # Errors
    /// When there is one, and this one has no sockets.
    fn equip(&mut self, cell: &Cell, faults: NetFaults) -> Result<(), Error> {
        faults.refused_in_process(cell)
    }
    /// Makes the links, carries what the robot controllers send then, and brings what is asked before the first cycle.
    ///
    /// # Errors
    /// When there is nobody.
    fn begin(&mut self, greetings: &[Packet], answers: &mut Answers) -> Result<(), Error>;
    /// Carries the packets of one cycle, in their order, and brings what comes back.
    ///
    /// # Errors
    /// When the wires fail.
    fn exchange(&mut self, moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error>;
    /// What the sockets saw, by class, and what came of the faults that need them.
    fn account(&mut self) -> (BTreeMap<&'static str, u64>, Vec<FaultAccount>) {
        Default::default()
    }
    /// What the drivers of the computer's side reported, by class, if they are in this process. `ceased` is when the last robot
    /// stopped, if they all did: for the computer time goes on.
    fn driver(&mut self, _ceased: Option<Nanos>) -> BTreeMap<String, u64> {
        BTreeMap::new()
    }
}

/// What came of a fault.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FaultAccount {
    /// Its name, and the stream of a fault of the wire.
    pub fault: String,
    /// How often it acted; of an effect, 1 if it ever changed anything.
    pub acted: u64,
    /// Number of the packet on which a fault of the wire acted first.
    pub first: Option<u64>,
}

impl FaultAccount {
    /// Of a fault of the wire.
    pub(super) fn of(fault: &WireFault, schedule: &Schedule) -> Self {
        let robot = fault.robot.as_ref().map(|robot| format!(" of {robot}")).unwrap_or_default();
        FaultAccount {
            fault: format!("{} on {}{robot}", fault.id(), fault.on.id()),
            acted: schedule.acted(),
            first: schedule.first(),
        }
    }
}

/// A controller in this process.
pub struct InProcess<C>(pub OnWire<C>);

impl<C: Controller> Peer for InProcess<C> {
    fn begin(&mut self, greetings: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        self.0.start(&mut answers.requests);
        greetings.iter().try_for_each(|packet| self.0.receive(packet.line, packet.at, &packet.bytes).map(drop))
    }

    fn exchange(&mut self, _moment: &Moment, packets: &[Packet], answers: &mut Answers) -> Result<(), Error> {
        for packet in packets {
            let answer = self.0.receive(packet.line, packet.at, &packet.bytes)?;
            if let (Line::Robot(nth), Some(bytes)) = (packet.line, answer) {
                answers.replies.push((nth, bytes));
            }
        }
        let now = packets.iter().map(|packet| packet.at).max();
        now.into_iter().for_each(|now| self.0.tick(now, &mut answers.requests));
        Ok(())
    }

    fn driver(&mut self, ceased: Option<Nanos>) -> BTreeMap<String, u64> {
        if let Some(at) = ceased {
            self.0.tick(at + SILENCE, &mut Vec::new());
        }
        std::mem::take(&mut self.0.events)
    }
}

/// What a run left behind.
#[derive(Debug, Clone)]
pub struct Ran {
    /// What was exchanged.
    pub session: Session,
    /// When probe and nozzle touched first and last, in s of the cell, to one cycle.
    pub contact_s: Option<[f64; 2]>,
    /// The largest reading along z, of either sign, in N, and when it was taken, in s of the cell.
    pub peak: Option<(f64, f64)>,
    /// Cycles that were run.
    pub cycles: u64,
    /// Cycles that were to be run.
    pub planned: u64,
    /// Cycles with an answer for the probe's robot.
    pub answered: u64,
    /// The other side left before the end.
    pub left: bool,
    /// A signal ended it.
    pub interrupted: bool,
    /// Robots that stopped, with what their controllers print.
    pub stops: Vec<(String, String)>,
    /// Events of the robot controllers and of the cell's sockets, by class.
    pub events: BTreeMap<&'static str, u64>,
    /// Of each event of the robot controllers the first, in words.
    pub first_of: BTreeMap<&'static str, String>,
    /// What the drivers of the computer's side reported, by class, if they were in this process.
    pub driver: BTreeMap<String, u64>,
    /// What came of each fault.
    pub faults: Vec<FaultAccount>,
    /// For each cycle, a hash of everything that was sent and answered.
    pub prints: Vec<u64>,
}

impl Ran {
    /// Faults that did nothing.
    pub fn idle(&self) -> Vec<String> {
        self.faults.iter().filter(|one| one.acted == 0).map(|one| one.fault.clone()).collect()
    }

    /// The first cycle in which two runs differ; runs of different length differ where the shorter one ends.
    pub fn first_difference(&self, other: &Ran) -> Option<u64> {
        let pairs = self.prints.iter().zip(&other.prints);
        let differs = pairs.clone().position(|(here, there)| here != there);
        let ends = (self.prints.len() != other.prints.len()).then_some(pairs.len());
        differs.or(ends).map(|cycle| cycle as u64)
    }

    /// A hash of the whole exchange.
    pub fn fingerprint(&self) -> String {
        format!("{:016x}", self.prints.iter().fold(SEED, |print, cycle| hashed(print, &cycle.to_le_bytes())))
    }
}

/// How long the computer waits on when the robots have stopped: longer than any driver takes to speak of silence. Chosen.
const SILENCE: Nanos = Nanos(500_000_000);

/// FNV-1a.
const SEED: u64 = 0xcbf2_9ce4_8422_2325;

fn hashed(print: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(print, |print, byte| (print ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// What a run is made of; asked before anybody is started or waited for.
///
/// # Errors
/// When the files of a cell cannot go together, a fault cannot be, or there is no seed.
pub fn check(cell: &Cell, catalog: &Catalog<Axis>) -> Result<(Model, Faults, u64), Error> {
    let model = cell.model(catalog)?;
    let faults = Faults::of(cell, &model, catalog)?;
    let Some(seed) = cell.config.seed else {
        let help = "add seed = a whole number: noise and faults are drawn from it";
        return Err(cell.at("name", "the cell has no seed", help));
    };
    Ok((model, faults, seed))
}

/// Runs a cell with this peer.
///
/// # Errors
/// When the cell's files are wrong, or the wires fail.
pub fn run(cell: &Cell, catalog: &Catalog<Axis>, options: &Options, peer: &mut dyn Peer) -> Result<Ran, Error> {
    let (model, faults, seed) = check(cell, catalog)?;
    let cycles = (options.duration_s / cell.config.time.cycle_s).round();
    if !(1.0..=1e9).contains(&cycles) {
        let (shown, cycle_s) = (plain(options.duration_s), cell.config.time.cycle_s);
        let what = format!("a run of {shown} s is not between one cycle, {cycle_s} s, and a thousand million of them");
        return Err(Error::new(what).place("argument --duration").help("give it in seconds of the cell's own time"));
    }
    let own = model.chosen(catalog);
    let (mut effects, mut accounts): (Vec<Attached<Axis>>, Vec<Account>) =
        (own.iter().map(Chosen::attach).collect(), Vec::new());
    for fault in &faults.effects {
        let (effect, account) = watched(fault);
        effects.push(effect);
        accounts.push(account);
    }
    let late_s: f64 = effects.iter().map(|attached| attached.effect.stamp_offset_s()).sum();
    let start = Start {
        first: cell.first()?,
        from: Nanos(0),
        until: Nanos(0),
        noise: simulate::noise(&model),
        streams: Streams::new(seed),
    };
    let mut ran = None;
    let parts = blocks::Cell::of(&model, model.plant.mass_kg);
    parts.facility(&effects, simulate::rates(&model), &start, &mut |facility| {
        let (cycles, keeps) = (cycles as u64, options.keeps);
        let one = Run { cell, model: &model, faults: &faults, streams: start.streams, late_s, cycles, keeps };
        ran = Some(one.run(facility, peer));
    });
    let mut ran = ran.expect("the facility was handed over")?;
    ran.faults.extend(accounts.into_iter().map(|account| FaultAccount {
        acted: u64::from(account.acted()),
        fault: account.id,
        first: None,
    }));
    Ok(ran)
}

struct Run<'r> {
    cell: &'r Cell,
    model: &'r Model,
    faults: &'r Faults,
    streams: Streams,
    late_s: f64,
    cycles: u64,
    keeps: bool,
}

impl Run<'_> {
    fn run(&self, facility: &mut dyn Stepped<Axis>, peer: &mut dyn Peer) -> Result<Ran, Error> {
        let mut cell = VirtualCell::new(self.cell, self.model, self.faults, &self.streams, facility)?;
        cell.keeps = self.keeps;
        let (mut packets, mut answers, mut prints) = (Vec::new(), Answers::default(), Vec::new());
        let (probe, _) = self.cell.roles();
        peer.equip(self.cell, NetFaults::of(self.cell, &self.faults.wire, &self.faults.places, &self.streams))?;
        peer.begin(&cell.greetings(), &mut answers)?;
        let (mut answered, mut left) = (0, false);
        for cycle in 0..self.cycles {
            if answers.interrupted {
                break;
            }
            answers.requests.drain(..).for_each(|request| cell.request(&request, &mut packets));
            cell.begin(&mut packets);
            peer.exchange(&cell.moment(), &packets, &mut answers)?;
            if answers.interrupted {
                // A signal cut this cycle short: nobody is judged by it.
                break;
            }
            // Which socket is read first is nobody's business: answers count robot by robot, the probe's last.
            answers.replies.sort_by_key(|(nth, _)| (*nth == probe, *nth));
            let print = packets.iter().fold(SEED, |print, packet| hashed(print, &packet.bytes));
            prints.push(answers.replies.iter().fold(print, |print, (_, bytes)| hashed(print, bytes)));
            answered += u64::from(answers.replies.iter().any(|(nth, _)| *nth == probe));
            answers.replies.drain(..).for_each(|(nth, bytes)| cell.reply(nth, &bytes));
            cell.end();
            packets.clear();
            left = answers.gone && cycle + 1 < self.cycles && !cell.is_over();
            if answers.gone || cell.is_over() {
                break;
            }
        }
        let (events, of_sockets) = peer.account();
        cell.events.extend(events);
        let name = |(nth, why): (usize, String)| (self.cell.config.robots[nth].name.clone(), why);
        Ok(Ran {
            contact_s: cell.contact.map(|times| times.map(Nanos::seconds)),
            peak: cell.peak.map(|(peak_n, at)| (peak_n, at.seconds())),
            cycles: prints.len() as u64,
            answered,
            planned: self.cycles,
            left,
            interrupted: answers.interrupted,
            driver: peer.driver(cell.is_over().then_some(cell.now())),
            stops: cell.stops().into_iter().map(name).collect(),
            faults: [cell.faults(), of_sockets].concat(),
            events: std::mem::take(&mut cell.events),
            first_of: std::mem::take(&mut cell.first_of),
            prints,
            session: cell.log.session(self.model, self.cell, cell.contact.is_some(), self.late_s),
        })
    }
}
