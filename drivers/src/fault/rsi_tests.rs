//! Each fault of an RSI link, from the virtual controller through the wire to the host's side: what it reports is the table, and
//! the robot ends as a real one would.

use super::tests::{example, sound};
use super::*;
use crate::rsi::{
    Controller, ControllerEvent, Corrections, EthernetConfig, Family, Host, HostOptions, LateRule, POSE, Settings,
    split,
};
use sim_core::rng::Streams;
use sim_core::time::Nanos;
use std::collections::BTreeSet;

const PERIOD: Nanos = Nanos(4_000_000);
const CYCLES: u64 = 200;

fn config() -> EthernetConfig {
    let send = ["RIst", "EIPos", "Delay"].map(|name| {
        let kind = if name == "Delay" { "LONG" } else { "DOUBLE" };
        format!("<ELEMENT TAG=\"DEF_{name}\" TYPE=\"{kind}\" INDX=\"INTERNAL\"/>")
    });
    let receive = [1, 2, 3, 4, 5, 6].map(|port| {
        let name = POSE[port - 1];
        format!("<ELEMENT TAG=\"RKorr.{name}\" TYPE=\"DOUBLE\" INDX=\"{port}\" HOLDON=\"1\"/>")
    });
    EthernetConfig::parse(&format!(
        "<ROOT><CONFIG><IP_NUMBER>127.0.0.1</IP_NUMBER><PORT>49152</PORT><SENTYPE>ImFree</SENTYPE>\
         <ONLYSEND>FALSE</ONLYSEND></CONFIG><SEND><ELEMENTS>{}</ELEMENTS></SEND>\
         <RECEIVE><ELEMENTS>{}</ELEMENTS></RECEIVE></ROOT>",
        send.concat(),
        receive.concat() + "<ELEMENT TAG=\"EKorr.E1\" TYPE=\"DOUBLE\" INDX=\"7\" HOLDON=\"1\"/>"
    ))
    .expect("a sound configuration")
}

/// Controller, wire, host; one fault.
struct Bench {
    controller: Controller,
    host: Host,
    own: Vec<(WireFault, Schedule)>,
    frames: Faulty,
    replies: Faulty,
    classes: BTreeSet<&'static str>,
    log: Vec<ControllerEvent>,
}

impl Bench {
    fn new(list: &[WireFault]) -> Bench {
        let streams = Streams::new(11);
        let mut settings = Settings {
            decimals: 4,
            first_ipoc: 680_309_708,
            late: LateRule::Total { limit: 100 },
            ..Settings::new(config(), Family::Krc4)
        };
        let mut own = Vec::new();
        for (index, fault) in list.iter().enumerate() {
            if let (Action::IpocCrossing { wraps }, At::Number(cycle)) = (&fault.action, fault.at) {
                settings.cross_at(cycle, *wraps);
            }
            if row(fault.id(), fault.on).is_some_and(|row| row.needs == Needs::Controller) {
                own.push((fault.clone(), Schedule::new(fault, index, &streams)));
            }
        }
        let link = |on| Faulty::new(on, Robot::First("chaser"), list, PERIOD, &streams);
        Bench {
            controller: Controller::new(settings, [0.0; 6], [0.0; 6]),
            host: Host::new(config(), HostOptions::default()),
            own,
            frames: link(Stream::RsiFrame),
            replies: link(Stream::RsiReply),
            classes: BTreeSet::new(),
            log: Vec::new(),
        }
    }

    /// What the host answers to what arrived in a cycle: each datagram before the next, and of several documents in one the newest.
    fn answer(&mut self, now: Nanos, arrived: &[Out]) -> Vec<Vec<u8>> {
        let (mut events, mut replies) = (Vec::new(), Vec::new());
        let wanted = Corrections::six("RKorr", POSE, [1.25, -0.5, 0.0, 0.0, 0.0, 0.25]);
        for out in arrived {
            let documents = split(&out.bytes);
            let is_fresh = !self.host.receive_documents(now + out.within, documents, &mut events).is_empty();
            replies.extend(match is_fresh {
                true => self.host.reply(&wanted).ok(),
                false => self.host.repeat().map(<[u8]>::to_vec),
            });
        }
        self.host.tick(now + Nanos(PERIOD.0 - 1), &mut events);
        self.classes.extend(events.iter().filter(|event| !event.is_news()).map(crate::rsi::Event::class));
        replies
    }

    fn run(&mut self) {
        for cycle in 0..CYCLES {
            for (fault, schedule) in &mut self.own {
                if schedule.due(cycle) && self.controller.disturb(&fault.action) {
                    schedule.count();
                }
            }
            // Digits that change, so that every decimal says something.
            let measured = self.controller.target_mm_deg().map(|value| value + cycle as f64 * 0.0173);
            let frame = self.controller.frame(&measured, &[cycle as f64 * 0.0173; 6]);
            let (mut arrived, mut back) = (Vec::new(), Vec::new());
            self.frames.pass(cycle, (!frame.is_empty()).then_some(&frame), &mut arrived);
            let mut replies = self.answer(Nanos(cycle as i64 * PERIOD.0), &arrived).into_iter();
            self.replies.pass(cycle, replies.next().as_deref(), &mut back);
            let back: Vec<Vec<u8>> = back.into_iter().map(|out| out.bytes).chain(replies).collect();
            self.controller.cycle_of(&back, &mut self.log);
        }
    }

    fn idle(&self) -> usize {
        let own = self.own.iter().filter(|(_, schedule)| schedule.acted() == 0).count();
        own + self.frames.never_acted().count() + self.replies.never_acted().count()
    }
}

#[test]
fn a_sound_link_reports_nothing_and_the_robot_goes_where_it_is_sent() {
    let mut bench = Bench::new(&[]);
    bench.run();
    assert_eq!((bench.classes, bench.log), (BTreeSet::new(), Vec::new()));
    let target = bench.controller.target_mm_deg().map(|value| format!("{value}"));
    assert_eq!(target.join(" "), "1.25 -0.5 0 0 0 0.25");
}

#[test]
fn each_fault_of_a_link_is_reported_as_the_table_says() {
    let mut wrong = Vec::new();
    let performed = |row: &&Row| matches!(row.needs, Needs::Bytes | Needs::Controller);
    for row in TABLE.iter().filter(|row| matches!(row.on, Stream::RsiFrame | Stream::RsiReply)).filter(performed) {
        let mut bench = Bench::new(&sound(&example(row)));
        bench.run();
        let (idle, seen) = (bench.idle(), bench.classes.into_iter().collect::<Vec<_>>());
        if seen != row.classes || idle > 0 {
            wrong.push(format!("{} on {}: seen {seen:?}, table {:?}, idle {idle}", row.id, row.on.id(), row.classes));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// One fault of each kind that stops a robot: RSIBad at once, a time-out after the allowed hundred.
#[test]
fn a_run_ends_as_a_real_cell_would_end_it() {
    let table = [
        ("id = \"decimal-comma\"", "cycle 60: a reply holds no number: "),
        ("id = \"drop\"\nfor = 100", ""),
        ("id = \"drop\"\nfor = 101", "cycle 160: 101 late replies | KSS29002 "),
        ("id = \"wrong-type\"\nfor = 1000", "cycle 160: 101 late replies | KSS29002 "),
        ("id = \"ipoc-step\"\nstep = 4\nfor = 1000", "cycle 160: 101 late replies | KSS29002 "),
    ];
    for (fault, expected) in table {
        let list = sound(&format!("[[fault]]\non = \"rsi-reply\"\nat = 60\n{fault}"));
        let mut bench = Bench::new(&list);
        bench.run();
        let said = bench.controller.stopped().map(ToString::to_string);
        let said = said.unwrap_or_default();
        assert!(said.contains(expected) && said.is_empty() == expected.is_empty(), "{fault}: {said:?}");
        assert_eq!(bench.classes.contains("rsi-silent"), !expected.is_empty(), "{fault}: the frames cease");
    }
}

/// The same seed and list give the same bytes and events.
#[test]
fn a_run_with_faults_repeats_to_the_bit() {
    let text = "[[fault]]\nid = \"flip-bit\"\non = \"rsi-frame\"\nat = 40\nfor = 100\nchance = 0.3\n\
                [[fault]]\nid = \"drop\"\non = \"rsi-reply\"\nat = 40\nfor = 100\nchance = 0.3";
    let run = || {
        let mut bench = Bench::new(&sound(text));
        bench.run();
        (bench.classes, bench.log, bench.host.causes().clone())
    };
    let first = run();
    assert!(first.1.len() > 10, "the faults act: {}", first.1.len());
    assert_eq!(first, run());
}

#[test]
fn the_table_names_every_action_once_per_stream_and_says_what_is_alike() {
    let rows: BTreeSet<_> = TABLE.iter().map(|row| (row.id, row.on)).collect();
    assert_eq!(rows.len(), TABLE.len(), "no row twice");
    for row in TABLE {
        assert!(row.classes.is_sorted(), "{}", row.id);
    }
    let alike = |id, on| alike(row(id, on).expect("a row")).map(|row| row.id).collect::<Vec<_>>().join(" ");
    assert_eq!(alike("ipoc-back", Stream::RsiFrame), "ipoc-restart");
    assert_eq!(alike("swap", Stream::RsiFrame), "hold");
    assert_eq!(alike("length", Stream::Ft), "truncate");
    assert_eq!(alike("ft-stall", Stream::Ft), "");
}
