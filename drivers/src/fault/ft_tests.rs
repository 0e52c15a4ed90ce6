//! Each fault of the sensor's stream, from the virtual sensor through the wire to the host's side: what it reports is the table.

use super::*;
use crate::ft::{AnyDevice, AnySensor, Device, Event as FtEvent, Sensor, Settings};
use sim_core::rng::Streams;
use sim_core::time::Nanos;
use std::collections::BTreeSet;

const PERIOD: Nanos = Nanos(1_000_000);
const SAMPLES: u64 = 400;

/// The sensor, the wire, the host.
struct Bench {
    device: AnyDevice,
    sensor: AnySensor,
    requests: Faulty,
    stream: Faulty,
    asked: u64,
    classes: BTreeSet<&'static str>,
}

impl Bench {
    fn new(list: &[WireFault]) -> Bench {
        let text = "protocol = \"rdt\"\nrate_hz = 1000\ncounts_per_n = 1000000\ncounts_per_n_m = 1000000";
        let settings: Settings = toml::from_str(text).expect("sound settings");
        let link = |on| Faulty::new(on, Robot::None, list, PERIOD, &Streams::new(11));
        Bench {
            device: settings.device().expect("a device"),
            sensor: settings.sensor().expect("a sensor"),
            requests: link(Stream::FtRequest),
            stream: link(Stream::Ft),
            asked: 0,
            classes: BTreeSet::new(),
        }
    }

    fn ask(&mut self, now: Nanos, requests: &mut Vec<Vec<u8>>) {
        for request in requests.drain(..) {
            let mut arrived = Vec::new();
            self.requests.pass(self.asked, Some(&request), &mut arrived);
            self.asked += 1;
            arrived.iter().for_each(|out| self.device.receive(now, &out.bytes, &mut Vec::new()));
        }
    }

    fn note(&mut self, events: &mut Vec<FtEvent>) {
        self.classes.extend(events.drain(..).map(|event| event.class()));
    }

    /// All samples; the classes that the host reported.
    fn run(mut self) -> (BTreeSet<&'static str>, usize) {
        let (mut requests, mut events, mut records) = (Vec::new(), Vec::new(), Vec::new());
        self.sensor.start(&mut requests);
        self.ask(Nanos(0), &mut requests);
        for number in 0..SAMPLES {
            let now = Nanos(number as i64 * PERIOD.0);
            self.device.sample([1.0, -2.0, 3.0 + number as f64 * 1e-3], [0.1, 0.2, 0.3], &mut records);
            let mut arrived = Vec::new();
            self.stream.pass(number, records.pop().as_deref(), &mut arrived);
            for out in &arrived {
                self.sensor.receive(now + out.within, &out.bytes, &mut events);
            }
            self.sensor.tick(now, &mut requests, &mut events);
            self.ask(now, &mut requests);
            self.note(&mut events);
        }
        self.classes.remove("ft-sample");
        (self.classes, self.requests.never_acted().count() + self.stream.never_acted().count())
    }
}

#[test]
fn a_sound_stream_reports_nothing() {
    assert_eq!(Bench::new(&[]).run(), (BTreeSet::new(), 0));
}

#[test]
fn each_fault_of_the_sensor_is_reported_as_the_table_says() {
    let mut wrong = Vec::new();
    for row in TABLE.iter().filter(|row| matches!(row.on, Stream::Ft | Stream::FtRequest) && row.needs == Needs::Bytes)
    {
        let (seen, idle) = Bench::new(&tests::sound(&tests::example(row))).run();
        let seen: Vec<&str> = seen.into_iter().collect();
        if seen != row.classes || idle > 0 {
            wrong.push(format!("{} on {}: seen {seen:?}, table {:?}, idle {idle}", row.id, row.on.id(), row.classes));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
