//! Taking no part: packets come from a capture, whole or as it grows.
//!
//! A packet belongs to a robot when it comes from, or goes to, the address at which the PC listens; to the sensor when it comes
//! from, or goes to, the sensor's address. A SCHUNK's samples come from its machine to the port for samples; an ATI Net F/T can be
//! asked for a bias over TCP too. Everything else is passed over, and its ends are remembered, so that a capture in which nothing
//! belongs to the cell is answered with what is in it.
//!
//! A capture ends where its times go back: what comes behind cannot be put in order.

use super::devices::{Devices, Way};
use super::session::{AllLines, Recorder, Summary};
use crate::cell::Cell;
use crate::error::Error;
use drivers::capture::{Damage, Packet, Reader, Tally, Transport};
use drivers::ft::{self, netft_tcp};
use drivers::net::wait;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Write};
use std::net::SocketAddr;
use std::time::Duration;

/// Bytes that are asked of the capture at once.
const READ_LENGTH: usize = 64 << 10;
/// How long a pipe that brings nothing is waited for before somebody is asked whether to go on.
const WAIT: Duration = Duration::from_millis(50);
/// How far times may go back: packets of several queues or files are out of order by less. Chosen.
const BACK: Nanos = Nanos(100_000_000);
/// Other ends that are remembered, for the error.
const OTHERS_MAX: usize = 8;

/// What a capture came to.
#[derive(Debug, Clone)]
pub struct Tapped {
    /// Frames, packets and what was skipped.
    pub tally: Tally,
    /// Why it ended early.
    pub damage: Option<Damage>,
    /// Packets that belong to the cell.
    pub matched: Matched,
    /// Where its times go back: that is its end.
    pub back: Option<Back>,
    /// Where other packets went.
    pub others: BTreeMap<String, u64>,
    /// Somebody ended it before its end.
    pub is_ended: bool,
}

/// Packets of a capture that belong to the cell, by their ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Matched {
    /// From robots.
    pub from_robots: u64,
    /// To robots.
    pub to_robots: u64,
    /// From the sensor.
    pub from_sensor: u64,
    /// To the sensor.
    pub to_sensor: u64,
}

impl Matched {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.from_robots + self.to_robots + self.from_sensor + self.to_sensor
    }
}

/// A step back in the times of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Back {
    /// From the first packet to the newest before the step.
    pub after: Nanos,
    /// How far it goes.
    pub by: Nanos,
}

/// Sorts packets to the devices of a cell.
struct Sorter<'c> {
    cell: &'c Cell,
    /// Where the sensor's samples go, if commands go elsewhere.
    samples_port: Option<u16>,
    first: Option<Nanos>,
    newest: Option<Nanos>,
    matched: Matched,
    others: BTreeMap<String, u64>,
}

impl Sorter<'_> {
    fn take(&mut self, packet: &Packet, devices: &mut Devices) {
        let (from, to) = (SocketAddr::V4(packet.from), SocketAddr::V4(packet.to));
        let robots = || self.cell.config.robots.iter().enumerate();
        let way = robots().find_map(|(nth, robot)| match robot.listen {
            listen if same(listen, to) => Some((nth, Way::FromRobot)),
            listen if same(listen, from) => Some((nth, Way::ToRobot)),
            _ => None,
        });
        if let Some((robot, way)) = way {
            match packet.transport {
                Transport::Tcp => devices.stream(robot, way, packet.at, &packet.payload, packet.broken),
                Transport::Udp => devices.datagram(robot, way, packet.at, &packet.payload),
            };
            match way {
                Way::FromRobot => self.matched.from_robots += 1,
                Way::ToRobot => self.matched.to_robots += 1,
            }
            return;
        }
        let sensor = self.cell.config.sensor.address;
        let is_sample = packet.transport == Transport::Udp && self.samples_port == Some(to.port());
        let is_beside = packet.transport == Transport::Tcp && to == SocketAddr::new(sensor.ip(), netft_tcp::PORT);
        match () {
            () if from == sensor || (from.ip() == sensor.ip() && is_sample) => {
                devices.sensed(packet.at, &packet.payload);
                self.matched.from_sensor += 1;
            }
            () if to == sensor => {
                devices.asked(packet.at, &packet.payload);
                self.matched.to_sensor += 1;
            }
            () if is_beside => {
                devices.asked_beside(packet.at, &packet.payload);
                self.matched.to_sensor += 1;
            }
            () => {
                let transport = if packet.transport == Transport::Udp { "UDP" } else { "TCP" };
                let key = format!("{transport} to {}", packet.to);
                if self.others.len() < OTHERS_MAX || self.others.contains_key(&key) {
                    *self.others.entry(key).or_insert(0) += 1;
                }
            }
        }
    }

    /// Whether this time goes back.
    fn back(&mut self, at: Nanos) -> Option<Back> {
        let first = *self.first.get_or_insert(at);
        let newest = self.newest.get_or_insert(at);
        let by = Nanos(newest.0.saturating_sub(at.0));
        if by > BACK {
            return Some(Back { after: Nanos(newest.0.saturating_sub(first.0)), by });
        }
        *newest = (*newest).max(at);
        None
    }
}

/// An address that listens on every interface is met by its port alone.
fn same(listen: SocketAddr, end: SocketAddr) -> bool {
    listen.port() == end.port() && (listen.ip() == end.ip() || listen.ip().is_unspecified())
}

/// Reads a capture to its end, for so long in its own time, or until that is true.
///
/// # Errors
/// When the capture cannot be read, or the session does not take what is in it. That a capture ends in the middle of a record,
/// as a live one does, is no error.
pub fn tap<W: Write>(
    capture: &mut File,
    cell: &Cell,
    devices: &mut Devices,
    recorder: &mut Recorder<W>,
    longest: Option<Nanos>,
    until: &dyn Fn() -> bool,
) -> Result<Tapped, Error> {
    let samples_port = match cell.sensor()?.transport() {
        ft::Transport::Split { samples_port } => Some(samples_port),
        _ => None,
    };
    let (matched, others) = (Matched::default(), BTreeMap::new());
    let mut sorter = Sorter { cell, samples_port, first: None, newest: None, matched, others };
    let mut back = None;
    let (mut reader, mut packets, mut damage) = (Reader::default(), Vec::new(), None);
    let mut buffer = vec![0; READ_LENGTH];
    let (mut is_over, mut is_ended) = (false, false);
    while !is_over && damage.is_none() {
        is_ended = until() || recorder.is_too_fast();
        if is_ended {
            break;
        }
        // A file is always ready; a pipe may bring nothing for long.
        let failed = |error| Error::new(format!("waiting for the capture failed: {error}"));
        if !wait(&[&*capture], WAIT).map_err(failed)?.contains(&true) {
            continue;
        }
        let length = match capture.read(&mut buffer) {
            Ok(length) => length,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(Error::new(format!("reading the capture failed: {error}"))),
        };
        damage = match length {
            0 => reader.finish(&mut packets),
            _ => reader.push(&buffer[..length], &mut packets),
        }
        .err();
        is_over = length == 0;
        for packet in packets.drain(..) {
            back = sorter.back(packet.at);
            if back.is_some() {
                is_over = true;
                break;
            }
            let first = sorter.first.unwrap_or(packet.at);
            if longest.is_some_and(|longest| packet.at.0.saturating_sub(first.0) > longest.0) {
                is_over = true;
                break;
            }
            // A tap asks the sensor nothing.
            devices.tick(packet.at);
            sorter.take(&packet, devices);
            devices.write(recorder)?;
            recorder.tick(packet.at)?;
        }
    }
    let Sorter { matched, others, .. } = sorter;
    Ok(Tapped { tally: reader.tally().clone(), damage, matched, back, others, is_ended })
}

/// The clocks of a whole capture: it is read once for them alone.
///
/// # Errors
/// As [`tap`].
pub fn clocks(capture: &mut File, cell: &Cell, devices: &Devices) -> Result<(AllLines, Summary, Tapped), Error> {
    let nowhere = std::io::sink();
    let mut recorder = Recorder::create(nowhere, &cell.config, &BTreeMap::new(), None)?;
    let tapped = tap(capture, cell, &mut devices.clone(), &mut recorder, None, &|| false)?;
    let (_, summary) = recorder.finish()?;
    Ok((summary.lines.clone(), summary, tapped))
}
