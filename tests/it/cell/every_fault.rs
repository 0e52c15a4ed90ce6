//! Every row of the list of faults, in a run of the cell: the computer reports what the list says, and nothing more.

use super::sockets::{free, heard};
use super::{cell, reference};
use drivers::fault::{Needs, Row, Stream, TABLE};
use harness::cell::Cell;
use harness::cell::controller::{Reference, Task};
use harness::cell::on_wire::OnWire;
use harness::cell::run::{InProcess, Options, Ran, run};
use sim_core::effects::standard;
use std::collections::BTreeMap;

/// The parameters that a fault must have, and how long it lasts so that the computer must notice.
fn written(row: &Row) -> String {
    let more = match (row.id, row.on) {
        ("swap", _) => "next = 2",
        ("hold" | "delay", _) => "cycles = 2",
        ("jitter", _) => "delays_us = [6000, 0, 9000]\nfor = 3",
        // More than the 100 ms after which a driver speaks of silence.
        ("silence-then-burst", Stream::RsiFrame) => "for = 40",
        ("silence-then-burst", Stream::Ft) => "for = 150",
        ("truncate", _) => "bytes = 30",
        ("flip-bit", Stream::Ft) => "bit = 200",
        // The `<` with which a document begins.
        ("flip-bit", _) => "bit = 2",
        ("ipoc-step", Stream::RsiReply) => "step = 4",
        ("ipoc-step", Stream::RsiFrame) => "step = -4",
        ("ipoc-freeze", _) => "for = 3",
        ("ipoc-back", _) => "ms = 4000",
        ("ipoc-restart", _) => "first = 1",
        ("ipoc-crossing", _) => "wraps = true",
        ("status-word", _) => "status = 2147614720",
        ("cpf-change", _) => "factor = 2.0",
        ("length", _) => "bytes = 35",
        ("http-slow", _) => "delay_ms = 3000",
        _ => "",
    };
    // Requests and pages are counted from the start; everything else is put where links have settled.
    let at = match row.on {
        Stream::RsiFrame | Stream::RsiReply => 300,
        Stream::Ft => 1300,
        Stream::FtRequest | Stream::Http => 0,
    };
    format!("[[fault]]\nid = \"{}\"\non = \"{}\"\nat = {at}\n{more}\n", row.id, row.on.id())
}

/// A run in this process, and what the computer reported.
fn here(cell: &Cell) -> (Ran, BTreeMap<String, u64>) {
    let model = cell.model(&standard()).unwrap();
    let reference = Reference::new(&model, cell.first().unwrap(), Task::Dock);
    let mut peer = InProcess(OnWire::new(cell, reference).unwrap());
    let options = Options { duration_s: 2.0, keeps: true };
    let mut ran = run(cell, &standard(), &options, &mut peer).unwrap_or_else(|error| panic!("{error}"));
    let events = std::mem::take(&mut ran.driver);
    (ran, events)
}

/// What is there without a fault is not what a fault shows.
fn shown(events: &BTreeMap<String, u64>, calm: &BTreeMap<String, u64>) -> Vec<String> {
    let news = |(class, count): &(&String, &u64)| calm.get(*class) != Some(count);
    events.iter().filter(news).map(|(class, _)| class.clone()).collect()
}

#[test]
fn every_fault_shows_what_the_list_says() {
    let (_, calm) = here(&cell("bench", ""));
    let mut wrong = Vec::new();
    let links = TABLE.iter().filter(|row| matches!(row.needs, Needs::Bytes | Needs::Controller));
    let mut rows = 0;
    for row in links {
        rows += 1;
        let mut cell = cell("bench", &written(row));
        if row.id == "ipoc-middle" {
            // Between others a stamp can only stand where there are two.
            let other = "<ELEMENT TAG=\"DiO\" TYPE=\"LONG\" INDX=\"7\" HOLDON=\"1\" />\n    </ELEMENTS>\n  </RECEIVE>";
            cell.rsi[0].text = cell.rsi[0].text.replace("</ELEMENTS>\n  </RECEIVE>", other);
        }
        let (ran, events) = here(&cell);
        let mut shown = shown(&events, &calm);
        if !ran.stops.is_empty() {
            // The cell is over, and its sensor is silent with it.
            shown.retain(|class| class != "ft-stale");
        }
        if !ran.idle().is_empty() || shown != row.classes {
            let name = format!("{} on {}", row.id, row.on.id());
            wrong.push(format!("{name}: the list says {:?}, the run {shown:?}, idle {:?}", row.classes, ran.idle()));
        }
    }
    assert!(rows > 60 && wrong.is_empty(), "{rows} rows\n{}", wrong.join("\n"));
}

#[test]
fn every_fault_that_needs_sockets_shows_what_the_list_says() {
    let sockets: Vec<&Row> =
        TABLE.iter().filter(|row| !matches!(row.needs, Needs::Bytes | Needs::Controller)).collect();
    for row in &sockets {
        let cell = cell_with_page(&written(row));
        let name = format!("{} on {}", row.id, row.on.id());
        let bound = free(&cell);
        let (ran, events) = heard(&cell, 2.0, &bound, bound.clone());
        assert!(ran.idle().is_empty(), "{name}: {:?} did nothing", ran.idle());
        let shown: Vec<&str> = row.classes.iter().copied().filter(|class| events.contains_key(*class)).collect();
        assert_eq!(shown, row.classes, "{name}: {events:?}");
        let is_seen = events.keys().any(|class| class.starts_with("net-"));
        assert_eq!(is_seen, row.classes.iter().any(|class| class.starts_with("net-")), "{name}: {events:?}");
        assert_eq!((ran.cycles, &ran.stops[..]), (500, &[][..]), "{name}: the run goes on");
        assert!(ran.answered >= 499, "{name}: {} answered", ran.answered);
        // Whatever the network did, and however long it took: the exchange is the same again.
        let bound = free(&cell);
        let (again, _) = heard(&cell, 2.0, &bound, bound.clone());
        assert_eq!(ran.first_difference(&again), None, "{name}");
        assert_eq!(ran.session, again.session, "{name}");
    }
    assert_eq!(sockets.len(), 9, "the rows that need sockets");
}

/// Over TCP a stranger is one who connects too: he is hung up on, and the robot goes on.
#[test]
fn a_stranger_over_tcp_is_reported_and_changes_nothing() {
    let fault = "[[fault]]\nid = \"foreign-peer\"\non = \"rsi-frame\"\nat = 20\nfor = 2\n";
    let (calm, cell) = (cell("krc2", ""), cell("krc2", fault));
    let bound = free(&cell);
    let (ran, events) = heard(&cell, 0.4, &bound, bound.clone());
    assert!(ran.idle().is_empty() && events.contains_key("net-stranger"), "{:?} {events:?}", ran.idle());
    assert_eq!(reference(&calm, 0.4).first_difference(&ran), None);
    for fault in ["foreign-peer", "icmp-unreachable"] {
        let cell = super::cell("krc2", &format!("[[fault]]\nid = \"{fault}\"\non = \"rsi-reply\"\nat = 20\n"));
        let model = cell.model(&standard()).unwrap();
        let error = harness::cell::faults::Faults::of(&cell, &model, &standard()).unwrap_err().to_string();
        assert!(error.contains("this robot speaks TCP"), "{error}");
    }
}

/// A cell whose sensor has a page.
fn cell_with_page(added: &str) -> Cell {
    let mut cell = cell("bench", added);
    cell.config.sensor.page = Some("127.0.0.1:0".parse().unwrap());
    cell
}
