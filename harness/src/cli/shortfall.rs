//! What is missing in a recording, so that `compare` and `diagnose` could not use it, and what to do about it.

use super::outcome::Exit;
use super::recorded::Outcome;
use crate::cell::Cell;
use crate::error::Error;
use crate::recorder::{Back, Summary, Tapped};
use drivers::capture::Skip;
use drivers::ft::Protocol;
use drivers::rsi::EthernetConfig;
use serde::Deserialize;
use std::path::Path;

/// What every message ends with.
const NEEDED: &str = "`compare` and `diagnose` cannot use it";

/// A robot whose clock is too fast to live in real time.
pub(super) fn too_fast(summary: &Summary) -> Option<Error> {
    let (name, rate) = summary.rates.iter().find(|(_, rate)| *rate > 1.0)?;
    let what = format!(
        "the robot's clock runs {} times as fast as this computer's: it does not live in real time, and when something was \
         cannot be told",
        times(*rate)
    );
    let help = "a virtual cell keeps real time with: dockhil cell --real-time. A session in virtual time is written by the cell \
                itself: dockhil cell -o S.mcap";
    Some(Error::new(what).place(format!("robot {name}")).help(help))
}

fn times(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.2}") } else { format!("{rate:.0}") }
}

/// Why nothing was recorded.
pub(super) fn nothing(tapped: Option<&Tapped>) -> Error {
    let Some(tapped) = tapped else {
        return Error::new("no frame of a robot came, and no reading of the sensor").help(
            "start RSI on the robot; check IP_NUMBER and PORT in its configuration, and the firewall of this computer",
        );
    };
    if let (Some(damage), 0) = (&tapped.damage, tapped.tally.frames) {
        return Error::new(damage.to_string()).help("give a pcap or pcapng, as Wireshark and tcpdump write them");
    }
    let matched = &tapped.matched;
    if matched.total() > 0 {
        let ways =
            [(matched.to_robots, "replies of the PC to the robots"), (matched.to_sensor, "requests to the sensor")];
        let there: Vec<String> =
            ways.iter().filter(|way| way.0 > 0).map(|(count, what)| format!("{count} {what}")).collect();
        let there = if there.is_empty() { "nothing that can be read".to_owned() } else { there.join(" and ") };
        let what = format!(
            "of the cell the capture has {there}, and nothing that its robots or its sensor have sent{}",
            unread(tapped)
        );
        return Error::new(what).help("capture both directions: on the PC itself, or at a mirror port of the switch");
    }
    let skipped = unread(tapped);
    if tapped.others.is_empty() && !skipped.is_empty() {
        let what = format!("no packet of the capture can be used{skipped}");
        return Error::new(what).help("capture again; tcpdump -i any -U -w FILE captures whole packets");
    }
    Error::new(format!("no packet of the capture belongs to the cell; it has {}{skipped}", others(tapped)))
        .help("correct `listen` of the robots and `address` of the sensor in the cell")
}

/// What of a capture could not be read, and may have been the cell's.
fn unread(tapped: &Tapped) -> String {
    let is_loss = |why: &Skip| !matches!(why, Skip::NotUdpOrTcp | Skip::Repeated);
    let is_loss = |why: &Skip| is_loss(why) && (*why != Skip::NotIpv4 || tapped.tally.packets == 0);
    let skipped = tapped.tally.skipped.iter().filter(|(why, _)| is_loss(why));
    skipped.map(|(why, count)| format!("; {count} {}", why.about())).collect()
}

/// A capture whose times go back.
fn goes_back(back: &Back) -> Error {
    let what = format!(
        "the times of the capture go back by {:.3} s, {:.3} s after its beginning: that is the end of the recording",
        back.by.seconds(),
        back.after.seconds()
    );
    let help = "the clock of the capturing computer was set meanwhile, or two captures were joined: capture again, or cut it there \
                (editcap -A, -B) and import the parts";
    Error::new(what).help(help)
}

fn others(tapped: &Tapped) -> String {
    let others: Vec<String> = tapped
        .others
        .iter()
        .map(|(to, count)| format!("{count} packet{} {to}", if *count == 1 { "" } else { "s" }))
        .collect();
    if others.is_empty() { "no other UDP or TCP".to_owned() } else { others.join(", ") }
}

/// All that is missing, and what the command ends with for it.
pub(super) fn shortfalls(outcome: &Outcome, cell: &Cell) -> Vec<(Exit, Error)> {
    let summary = &outcome.summary;
    let tapped = outcome.tapped.as_ref();
    let named = |error: Error| match (&outcome.source, &outcome.file) {
        (Some(name), _) | (None, Some(name)) => error.file(name),
        (None, None) => error,
    };
    if summary.frames() == 0 && (summary.samples == 0 || tapped.is_some_and(|tapped| tapped.matched.total() == 0)) {
        let is_none = tapped.is_some_and(|tapped| tapped.damage.is_some() && tapped.tally.frames == 0);
        let exit = if is_none { Exit::BadInput } else { Exit::NothingToRun };
        return vec![(exit, named(nothing(tapped)))];
    }
    let mut missing = Vec::new();
    if summary.frames() == 0 {
        missing.push((Exit::NothingToRun, no_frame(summary, tapped, cell)));
    } else {
        missing.extend(no_pose(summary).map(|error| (Exit::BadInput, error)));
        let is_meant =
            cell.rsi.iter().all(|file| EthernetConfig::parse(&file.text).is_ok_and(|config| config.only_send));
        let exit = if is_meant { Exit::Pass } else { Exit::BadInput };
        missing.extend(no_command(summary, tapped, cell).map(|error| (exit, error)));
    }
    missing.extend(no_reading(outcome, cell).map(|error| (Exit::BadInput, error)));
    missing.extend(summary.rates.iter().filter(|(name, _)| !is_counter(outcome, name)).map(|(name, rate)| {
        let what = format!(
            "the robot's clock runs {} times as fast as this computer's: times are not to be trusted, and neither are \
             `compare` and `diagnose`",
            times(*rate)
        );
        let help = "a virtual cell keeps real time with: dockhil cell --real-time";
        (Exit::BadInput, Error::new(what).place(format!("robot {name}")).help(help))
    }));
    missing.extend(tapped.and_then(|tapped| tapped.back.as_ref()).map(|back| (Exit::BadInput, goes_back(back))));
    if let Some(damage) = tapped.and_then(|tapped| tapped.damage.as_ref()) {
        // A live capture ends wherever its program was ended.
        if outcome.source.as_deref() != Some(Path::new(super::record::STANDARD_INPUT)) {
            let what = format!("the capture ends early: {damage}");
            let help = "what came before is recorded; copy the capture again to have the rest";
            missing.push((Exit::BadInput, Error::new(what).help(help)));
        }
    }
    missing.into_iter().map(|(exit, error)| (exit, named(error))).collect()
}

/// Whether its stamps count frames, which was told, and does no harm: times are then those of receipt.
fn is_counter(outcome: &Outcome, name: &str) -> bool {
    outcome.summary.counters.iter().any(|counter| counter == name)
}

fn no_frame(summary: &Summary, tapped: Option<&Tapped>, cell: &Cell) -> Error {
    let listen: Vec<String> = cell.config.robots.iter().map(|robot| robot.listen.to_string()).collect();
    let (listen, samples) = (listen.join(", "), summary.samples);
    match tapped {
        Some(tapped) => Error::new(format!(
            "{samples} readings of the sensor, but no packet to or from {listen}, where the PC listens to the robots: {NEEDED}; \
             the capture has {}{}",
            others(tapped),
            unread(tapped)
        ))
        .help("correct `listen` of the robots in the cell, or capture RSI too, with whole packets"),
        None => Error::new(format!("{samples} readings of the sensor, but no frame of a robot at {listen}: {NEEDED}")).help(
            "start RSI on the robot; check IP_NUMBER and PORT in its configuration, and the firewall of this computer",
        ),
    }
}

fn no_pose(summary: &Summary) -> Option<Error> {
    if summary.poses[1] > 0 {
        return None;
    }
    let silent = summary.robots.iter().find(|robot| robot.1 == 0);
    Some(match silent {
        Some((name, ..)) => {
            Error::new(format!("no frame of the robot {name} came, so that there is no relative pose: {NEEDED}"))
                .help("start RSI on that robot too, or leave it out of the cell")
        }
        None if summary.events.keys().any(|(_, class)| class == "pose-unreadable") => {
            let help = "set the robot controller to write numbers with a point and in fixed notation";
            Error::new(format!("RIst of the frames is no six numbers, so that there is no measured pose: {NEEDED}"))
                .help(help)
        }
        None => {
            Error::new(format!("{} frames without RIst, so that there is no measured pose: {NEEDED}", summary.frames()))
                .help("add DEF_RIst to SEND on the robot controller, and use the file that it has loaded")
        }
    })
}

fn no_command(summary: &Summary, tapped: Option<&Tapped>, cell: &Cell) -> Option<Error> {
    let replies: u64 = summary.robots.iter().map(|robot| robot.2).sum();
    if summary.poses[0] > 0 || summary.poses[1] == 0 {
        return None;
    }
    let corrections: Vec<&str> = cell.config.robots.iter().map(|robot| robot.correction.as_str()).collect();
    Some(match (replies, tapped) {
        (0, Some(_)) => {
            Error::new(format!("no reply of the PC is in the capture, so that no pose is commanded: {NEEDED}"))
                .help("capture both directions")
        }
        (0, None) => Error::new(format!("the robot got no reply, so that no pose is commanded: {NEEDED}"))
            .help("with ONLYSEND TRUE this is as it must be: what is recorded shows that the wiring is right"),
        (replies, _) => Error::new(format!(
            "{replies} replies without {} from X to C, so that no pose is commanded: {NEEDED}",
            corrections.join(" or ")
        ))
        .help("name the element with the correction: `correction` in the cell; corrections of axes tell no pose"),
    })
}

fn no_reading(outcome: &Outcome, cell: &Cell) -> Option<Error> {
    let (samples, unmeasured) = (outcome.summary.samples, outcome.summary.unmeasured);
    if samples > 0 && samples == unmeasured {
        let what = format!("all {samples} readings of the sensor are clipped or invalid by their own status: {NEEDED}");
        return Some(
            Error::new(what)
                .help("see the ft- events of the session; correct [sensor] of the cell if its status is another one's"),
        );
    }
    let heard = outcome.heard.as_ref().filter(|_| outcome.summary.samples == 0)?;
    let address = cell.config.sensor.address;
    let protocol = cell.config.sensor.protocol.get("protocol").cloned();
    let protocol = protocol.and_then(|value| Protocol::deserialize(value).ok())?;
    let expects = format!("{} has {}", protocol.name(), protocol.expects());
    let what = match (heard.is_empty(), &outcome.tapped) {
        (true, Some(tapped)) => {
            format!("no packet from {address}, the address of the sensor; the capture has {}", others(tapped))
        }
        (true, None) => format!(
            "nothing came from the sensor at {address}, which was asked to stream as {} has it",
            protocol.name()
        ),
        (false, _) => format!("from {address} came {heard}; {expects}"),
    };
    let help = if heard.is_empty() {
        "check that the sensor is on and reached, and `address` and `protocol` in [sensor] of the cell"
    } else {
        "correct `protocol` in [sensor] of the cell, or `address`: another device may be there"
    };
    Some(Error::new(format!("no reading of the sensor: {what}: {NEEDED}")).help(help))
}
