//! Faults that need another socket, a closed port or a page: which are due, and whether each has acted. `intruder` beside this
//! file does them.
//!
//! | fault | what the cell does |
//! |---|---|
//! | `foreign-peer` on `rsi-frame` | another socket sends this cycle's frame to the computer, just before the robot does |
//! | `foreign-peer` on `rsi-reply` | another socket sends the computer's last answer to the robot |
//! | `foreign-peer` on `ft` | another socket sends this cycle's record to the computer |
//! | `icmp-unreachable` on `rsi-reply` | the robot sends its frame, and the answer meets a closed port |
//! | `icmp-unreachable` on `ft-request` | the request is lost, and for 250 ms its repetitions meet a closed port |
//! | `second-client` on `ft` | another socket asks for the stream, and gets it until the computer asks again |
//! | `http-*` on `http` | the request for the page with this number is answered wrongly, late, or by half |
//!
//! A frame, an answer or a record is addressed by its cycle or sample, as on the link itself; requests are counted as they come.
//! In virtual time the cell waits where the computer counts real time: until it asks the sensor again. Time stands still, so that
//! the run is the same each time.

use super::config::Cell;
use super::run::FaultAccount;
use super::virtual_cell::Moment;
use crate::error::Error;
use crate::model::place;
use drivers::fault::{Action, Event, Needs, Schedule, Stream, WireFault, row};
use sim_core::rng::Streams;

/// Whether a fault is done by the cell's own links, without another socket.
pub(super) fn is_on_links(fault: &WireFault) -> bool {
    row(fault.id(), fault.on).is_some_and(|row| matches!(row.needs, Needs::Bytes | Needs::Controller))
}

/// See the module.
#[derive(Default)]
pub struct NetFaults {
    faults: Vec<One>,
    touched: bool,
}

struct One {
    fault: WireFault,
    robot: usize,
    schedule: Schedule,
    /// Which `[[fault]]` of the cell it is.
    place: usize,
}

impl One {
    fn refused(&self, cell: &Cell, why: &str, help: &str) -> Error {
        let text = &cell.source.text;
        Error::new(format!("{} on {} {why}", self.fault.id(), self.fault.on.id()))
            .file(&cell.source.file)
            .span(text, place::in_list(text, "fault", self.place, None))
            .help(help.to_owned())
    }
}

impl NetFaults {
    /// Of the wire faults of a cell, each with its place in the file, those that need more than its links.
    pub(super) fn of(cell: &Cell, faults: &[WireFault], places: &[usize], streams: &Streams) -> Self {
        let robot = |name: &Option<String>| {
            let named = cell.config.robots.iter().position(|robot| name.as_ref() == Some(&robot.name));
            named.unwrap_or_default()
        };
        let all = faults.iter().zip(places).enumerate().filter(|(_, (fault, _))| !is_on_links(fault));
        let one = |(index, (fault, place)): (usize, (&WireFault, &usize))| One {
            robot: robot(&fault.robot),
            schedule: Schedule::new(fault, index, streams),
            fault: fault.clone(),
            place: *place,
        };
        NetFaults { faults: all.map(one).collect(), touched: false }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.faults.is_empty()
    }

    /// An error for whoever has no sockets, if there is a fault.
    ///
    /// # Errors
    /// Names the first fault.
    pub(super) fn refused_in_process(&self, cell: &Cell) -> Result<(), Error> {
        let help = "start a program: --controller 'dockhil-controller --cell {cell} --rsi {rsi} --ft {ft}'";
        let why = "needs sockets, and the reference inside has none";
        self.faults.first().map_or(Ok(()), |one| Err(one.refused(cell, why, help)))
    }

    /// An error for a sensor that is reached over a connection, if there is a fault that another socket does at its port.
    ///
    /// # Errors
    /// Names the first fault.
    pub(super) fn refused_on_stream(&self, cell: &Cell) -> Result<(), Error> {
        let is_there = |one: &&One| matches!(one.fault.on, Stream::Ft | Stream::FtRequest);
        let help = "take the fault out, or choose a sensor whose requests are datagrams";
        let why = "needs a sensor that is asked by datagrams, and this one is asked over TCP";
        self.faults.iter().find(is_there).map_or(Ok(()), |one| Err(one.refused(cell, why, help)))
    }

    /// Probe and nozzle have touched, or not yet.
    pub(super) fn touched(&mut self, touched: bool) {
        if touched && !self.touched {
            self.touched = true;
            self.faults.iter_mut().for_each(|one| one.schedule.event(Event::FirstContact));
        }
    }

    /// How often this kind is due on the packets of this moment. Each moment is asked once.
    pub(super) fn due(&mut self, needs: Needs, on: Stream, robot: usize, moment: &Moment) -> Vec<usize> {
        let numbers = if on == Stream::Ft { moment.samples.clone() } else { moment.cycle..moment.cycle + 1 };
        let mut due = Vec::new();
        for (nth, one) in self.faults.iter_mut().enumerate() {
            let is_meant = one.fault.on == on && one.robot == robot;
            if is_meant && row(one.fault.id(), on).is_some_and(|row| row.needs == needs) {
                due.extend(numbers.clone().filter(|number| one.schedule.due(*number)).map(|_| nth));
            }
        }
        due
    }

    /// What happens to the request with this number, the first that is due. It counts as done.
    pub(super) fn request(&mut self, on: Stream, number: u64) -> Option<Action> {
        let mut action = None;
        for one in self.faults.iter_mut().filter(|one| one.fault.on == on) {
            if one.schedule.due(number) && action.is_none() {
                one.schedule.count();
                action = Some(one.fault.action.clone());
            }
        }
        action
    }

    /// It was done.
    pub(super) fn count(&mut self, nth: usize) {
        if let Some(one) = self.faults.get_mut(nth) {
            one.schedule.count();
        }
    }

    /// What came of each.
    pub(super) fn accounts(&self) -> Vec<FaultAccount> {
        self.faults.iter().map(|one| FaultAccount::of(&one.fault, &one.schedule)).collect()
    }
}
