//! Taking no part: packets come from a capture, whole or as it grows.
//!
//! A packet belongs to a robot when it comes from, or goes to, the address at which the PC listens; to the sensor when it comes
//! from the sensor's address. Everything else is passed over, and its ends are remembered, so that a capture in which nothing
//! belongs to the cell is answered with what is in it.

use super::devices::{Devices, Way};
use super::session::{AllLines, Recorder, Summary};
use crate::cell::Cell;
use crate::error::Error;
use drivers::capture::{Damage, Packet, Reader, Tally, Transport};
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
    pub matched: u64,
    /// Where other packets went.
    pub others: BTreeMap<String, u64>,
    /// Somebody ended it before its end.
    pub is_ended: bool,
}

/// Sorts packets to the devices of a cell.
struct Sorter<'c> {
    cell: &'c Cell,
    first: Option<Nanos>,
    matched: u64,
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
        match way {
            Some((robot, way)) if packet.transport == Transport::Tcp => {
                devices.stream(robot, way, packet.at, &packet.payload, packet.broken);
            }
            Some((robot, way)) => {
                devices.datagram(robot, way, packet.at, &packet.payload);
            }
            None if from == self.cell.config.sensor.address => devices.sensed(packet.at, &packet.payload),
            None => {
                let transport = if packet.transport == Transport::Udp { "UDP" } else { "TCP" };
                let key = format!("{transport} to {}", packet.to);
                if self.others.len() < OTHERS_MAX || self.others.contains_key(&key) {
                    *self.others.entry(key).or_insert(0) += 1;
                }
                return;
            }
        }
        self.matched += 1;
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
    let mut sorter = Sorter { cell, first: None, matched: 0, others: BTreeMap::new() };
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
            let first = *sorter.first.get_or_insert(packet.at);
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
    Ok(Tapped { tally: reader.tally().clone(), damage, matched, others, is_ended })
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
