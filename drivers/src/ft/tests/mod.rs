//! Both sides of every protocol, against the vectors of reference/PROTOCOLS.md, against each other, and against damaged bytes.

mod damage;
mod exchange;
mod mutated;
mod settings;
mod vectors;

use super::{AnyDevice, AnySensor, Event, Sample, Sensor, Settings};
use sim_core::time::Nanos;

/// Settings of one sensor of each protocol, at the rate that it has in the table.
const EVERY: [(&str, &str); 7] = [
    ("rdt", "protocol = 'rdt'\nrate_hz = 1000\ncounts_per_n = 1e6\ncounts_per_n_m = 1e6"),
    (
        "rdt, buffered",
        "protocol = 'rdt'\nrate_hz = 1000\ncounts_per_n = 1e6\ncounts_per_n_m = 1e6\nbuffered = true\nrecords_per_datagram = 4",
    ),
    ("optoforce", "protocol = 'optoforce'\nrate_hz = 1000"),
    ("schunk", "protocol = 'schunk'"),
    ("bota", "protocol = 'bota'\nrate_hz = 1000"),
    ("robotiq", "protocol = 'robotiq'"),
    ("record", SRI),
];

/// SRI's frames as the reference has them. Its length byte leaves one byte after the floats; that it is the sum of the data is
/// inferred.
const SRI: &str = "protocol = 'record'\nrate_hz = 2000\n[record]\nlength = 31\nframing = 'stream'\nendian = 'little'\n\
    start = '41542b4753440d0a'\nsync = { bytes = 'aa55001b' }\nsequence = { at = 4, type = 'u16' }\n\
    force = { at = [6, 10, 14], type = 'f32', unit = 'N' }\ntorque = { at = [18, 22, 26], type = 'f32', unit = 'Nm' }\n\
    crc = { name = 'sum-8', at = 30, from = 6, to = 30 }";

/// A laboratory's wrapper of a JR3: one byte that is always 9, then 14 bytes, six values and a counter. Scales are of the load
/// settings of that laboratory; here a full scale of 16384 counts for 400 N (800 N along z) and 40 N m.
const JR3: &str = "protocol = 'record'\nrate_hz = 1000\n[record]\nlength = 15\nendian = 'big'\nsync = { bytes = '09' }\n\
    force = { at = [1, 3, 5], type = 'i16', scale = [0.0244140625, 0.0244140625, 0.048828125], unit = 'N' }\n\
    torque = { at = [7, 9, 11], type = 'i16', scale = 0.00244140625, unit = 'Nm' }\nsequence = { at = 13, type = 'u16' }";

fn settings(text: &str) -> Settings {
    toml::from_str(text).expect("settings of a test")
}

fn pair(text: &str) -> (AnySensor, AnyDevice) {
    let settings = settings(text);
    (settings.sensor().expect("a sensor"), settings.device().expect("a device"))
}

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.chars().filter_map(|digit| digit.to_digit(16)).map(|digit| digit as u8).collect();
    digits.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect()
}

fn millis(time_ms: i64) -> Nanos {
    Nanos(time_ms * 1_000_000)
}

fn samples(events: &[Event]) -> Vec<Sample> {
    events.iter().filter_map(|event| if let Event::Sample(sample) = event { Some(*sample) } else { None }).collect()
}

fn classes(events: &[Event]) -> String {
    events.iter().map(Event::class).collect::<Vec<_>>().join(" ")
}

/// What the sensor makes of one piece of bytes.
fn hear(sensor: &mut AnySensor, now: Nanos, bytes: &[u8]) -> Vec<Event> {
    let mut events = Vec::new();
    sensor.receive(now, bytes, &mut events);
    events
}
