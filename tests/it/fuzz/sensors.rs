//! The force/torque sensors, both sides, their settings and ATI's calibration page; part of [`super::targets`].

use super::targets::{Outcomes, count, pieces, session};
use drivers::ft::{Calibration, Device, Event, Sensor, Settings, Transport};
use sim_core::time::Nanos;
use std::sync::LazyLock;

/// Settings of each protocol. The last two are boxes of laboratories: a stream with a checksum, and datagrams without one.
const SENSORS: [&str; 8] = [
    "protocol = 'rdt'\nrate_hz = 1000\ncounts_per_n = 1e6\ncounts_per_n_m = 1e6",
    "protocol = 'rdt'\nmodel = 'axia'\nclock_hz = 7812\nrate_hz = 1000\ncounts_per_n = 1e6\ncounts_per_n_m = 1e6\n\
     buffered = true\nrecords_per_datagram = 4\nstale_ms = 100",
    "protocol = 'optoforce'\nrate_hz = 1000\nfilter = 4",
    "protocol = 'schunk'\nrate_hz = 1000",
    "protocol = 'bota'\nrate_hz = 1000\nconfigure = ['f,51,0,0,1']",
    "protocol = 'robotiq'\nrate_hz = 100",
    "protocol = 'record'\nrate_hz = 2000\n[record]\nlength = 31\nframing = 'stream'\nendian = 'little'\n\
     start = '41542b4753440d0a'\nsync = { bytes = 'aa55001b' }\nsequence = { at = 4, type = 'u16' }\n\
     force = { at = [6, 10, 14], type = 'f32', unit = 'N' }\ntorque = { at = [18, 22, 26], type = 'f32', unit = 'Nm' }\n\
     crc = { name = 'sum-8', at = 30, from = 6, to = 30 }",
    "protocol = 'record'\nrate_hz = 1000\n[record]\nlength = 15\nendian = 'big'\nsync = { bytes = '09' }\n\
     force = { at = [1, 3, 5], type = 'i16', scale = [0.025, 0.025, 0.05], unit = 'N' }\n\
     torque = { at = [7, 9, 11], type = 'i16', scale = 0.0025, unit = 'Nm' }\nsequence = { at = 13, type = 'u16' }",
];

static SETTINGS: LazyLock<[Settings; 8]> =
    LazyLock::new(|| SENSORS.map(|text| toml::from_str(text).expect("these settings are sound")));

/// What a device answers when its own host talks to it.
pub fn dialogue<const NTH: usize>() -> Vec<Vec<u8>> {
    let mut sensor = SETTINGS[NTH].sensor().expect("these settings are sound");
    let mut device = SETTINGS[NTH].device().expect("these settings are sound");
    let (mut requests, mut answers, mut events, mut said) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    sensor.start(&mut requests);
    for cycle in 0..30 {
        let now = Nanos(cycle * 10_000_000);
        sensor.tick(now, &mut requests, &mut events);
        requests.drain(..).for_each(|request: Vec<u8>| device.receive(now, &request, &mut answers));
        device.sample([12.5, -3.25, 9.75], [0.125, -0.0625, 0.5], &mut answers);
        answers.iter().for_each(|answer: &Vec<u8>| sensor.receive(now, answer, &mut events));
        said.append(&mut answers);
    }
    let apart = session(said.iter().map(Vec::as_slice));
    // A stream may come in any pieces; a datagram is whole.
    let together = (SETTINGS[NTH].transport() == Transport::Stream).then(|| session([said.concat().as_slice()]));
    [apart].into_iter().chain(together).collect()
}

/// The host's side of a sensor: nothing comes in without leaving a trace, and its own count is the sum.
pub fn sensor<const NTH: usize>(input: &[u8], outcomes: &mut Outcomes) {
    let datagrams = SETTINGS[NTH].transport() != Transport::Stream;
    let mut sensor = SETTINGS[NTH].sensor().expect("these settings are sound");
    let (mut sent, mut all, mut now) = (Vec::new(), Vec::new(), Nanos(0));
    sensor.start(&mut sent);
    for piece in pieces(input) {
        // Pieces of odd length come late, so that the sensor is stale at times.
        now = now + Nanos(if piece.len() % 2 == 0 { 1_000_000 } else { 60_000_000 });
        let before = all.len();
        sensor.receive(now, piece, &mut all);
        assert!(!datagrams || all.len() > before, "a datagram of {} bytes leaves no trace", piece.len());
        sensor.tick(now, &mut sent, &mut all);
        assert!(sent.len() < 64, "{} requests", sent.len());
        sent.clear();
    }
    let mut classes = Outcomes::new();
    for event in &all {
        count(&mut classes, event.class());
        match event {
            Event::Sample(sample) => {
                assert!(sample.force_n.iter().chain(&sample.torque_n_m).all(|v| v.is_finite()), "{sample:?}");
                assert!(sample.device_s.is_none_or(f64::is_finite), "{sample:?}");
            }
            Event::Malformed(why) => count(outcomes, why.id()),
            _ => {}
        }
        assert!(!event.to_string().is_empty());
    }
    let counted: Outcomes = sensor.tally().classes().collect();
    assert_eq!(classes, counted, "each event is counted once");
    let malformed: u64 = sensor.tally().malformed().map(|(_, count)| count).sum();
    assert_eq!(malformed, sensor.tally().class("ft-malformed"), "each malformed piece is named");
    for (class, times) in classes {
        *outcomes.entry(class).or_default() += times;
    }
    if all.is_empty() {
        count(outcomes, "nothing");
    }
}

/// Records in order, buffered, over the wrap and saturated, repeated and empty.
pub fn rdt_sessions() -> Vec<Vec<u8>> {
    let record = |sequence: u32, status: u32, counts: [i32; 6]| {
        let words = [sequence, sequence.wrapping_mul(7), status];
        let words = words.into_iter().chain(counts.map(|count| count as u32));
        words.flat_map(u32::to_be_bytes).collect::<Vec<u8>>()
    };
    let usual = [12_500_000, -3_250_000, 98_066_500, 125_000, -1, 0];
    let saturated = [i32::MAX, i32::MIN, 0, 0, 0, 0];
    let buffered = [record(1, 0, usual), record(2, 0, usual), record(3, 0, usual)].concat();
    let wrapping = [record(u32::MAX, 0x8002_0000, saturated), record(0, 0, usual)];
    let plain: Vec<Vec<u8>> = (1..12).map(|sequence| record(sequence, 0, usual)).collect();
    let of = |records: &[Vec<u8>]| session(records.iter().map(Vec::as_slice));
    vec![
        of(&plain),
        of(&[buffered]),
        of(&wrapping),
        of(&[record(1, 0, usual), record(1, 0x8001_0000, usual), Vec::new()]),
    ]
}

/// The first piece says which device.
pub fn requests() -> Vec<Vec<u8>> {
    let rdt = |code: u8| vec![0x12, 0x34, 0, code, 0, 0, 0, 3];
    let rdt: Vec<Vec<u8>> = [2, 0x42, 0x41, 3, 4, 0].map(rdt).into();
    let other = |nth: u8, piece: &[u8]| session([&[nth], piece, b"R".as_slice()]);
    vec![
        session([vec![0]].iter().chain(&rdt).map(Vec::as_slice)),
        session([vec![2]].iter().chain(&rdt).map(Vec::as_slice)),
        other(3, &[0xff, 0xff, 0, 0, 1, 0, 0x40]),
        other(4, b"C"),
        other(5, &[9, 16, 1, 0x9a, 0, 1, 2, 2, 0, 0xcd, 0xca]),
        other(6, b"AT+GSD\r\n"),
    ]
}

/// The sensors' side: whatever is asked, few and bounded answers, and a sample at most at each tick.
pub fn devices(input: &[u8], outcomes: &mut Outcomes) {
    let mut pieces = pieces(input);
    let nth = pieces.next().and_then(|piece| piece.first()).map_or(0, |byte| usize::from(*byte) % SENSORS.len());
    let mut device = SETTINGS[nth].device().expect("these settings are sound");
    let (mut out, mut now): (Vec<Vec<u8>>, _) = (Vec::new(), Nanos(0));
    for piece in pieces {
        now = now + Nanos(1_000_000);
        device.receive(now, piece, &mut out);
        let answers = out.len();
        assert!(answers <= piece.len() + 1, "{answers} answers to {} bytes", piece.len());
        device.sample([1.0, -2.0, piece.len() as f64], [0.0; 3], &mut out);
        assert!(out.len() <= answers + 1, "{} datagrams for one sample", out.len() - answers);
        count(outcomes, if device.streams() { "stream" } else { "silent" });
        out.clear();
    }
    count(outcomes, "session");
}

/// The page of a sensor, and that of its calibration alone.
pub fn calibrations() -> Vec<Vec<u8>> {
    let sensor = "<?xml version=\"1.0\"?>\r\n<netft>\r\n <runstat>00000000</runstat><prodname>Ethernet F/T</prodname>\
        <cfgcalsn>FT01234</cfgcalsn><cfgfu>2</cfgfu><scfgfu>N</scfgfu><cfgtu>3</cfgtu><scfgtu>Nm</scfgtu>\
        <cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt></netft>";
    let alone = "<netftCalibration><calcpf>500</calcpf><calcpt>20000</calcpt><calfu>4</calfu><caltu>3</caltu>\
        </netftCalibration>";
    [sensor, alone].map(|text| text.as_bytes().to_vec()).to_vec()
}

/// What a page says is usable, or it is refused.
pub fn calibration(input: &[u8], outcomes: &mut Outcomes) {
    match Calibration::parse(&String::from_utf8_lossy(input)) {
        Ok(page) => {
            let counts = [page.counts_per_force, page.counts_per_torque];
            assert!(counts.iter().all(|counts| counts.is_finite() && *counts > 0.0), "{counts:?}");
            count(outcomes, "calibration");
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            count(outcomes, "refused");
        }
    }
}

/// Settings as text.
pub fn settings_texts() -> Vec<Vec<u8>> {
    SENSORS.map(|text| text.as_bytes().to_vec()).to_vec()
}

/// The table `[sensor]` with the layout of a record.
pub fn sensor_settings(input: &[u8], outcomes: &mut Outcomes) {
    let text = String::from_utf8_lossy(input);
    let Ok(settings) = toml::from_str::<Settings>(&text) else {
        return count(outcomes, "not-settings");
    };
    let host = settings.sensor();
    for error in [host.as_ref().err(), settings.device().as_ref().err(), settings.period().as_ref().err()] {
        assert!(error.is_none_or(|error| !error.field.is_empty() && !error.problem.is_empty()));
    }
    count(outcomes, if host.is_ok() { "settings" } else { "unusable" });
}
