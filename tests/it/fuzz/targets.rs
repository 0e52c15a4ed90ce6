//! What is fuzzed: each target takes any bytes, and counts under a name what became of every piece of them.
//!
//! The long test and the targets of libFuzzer (`tests/fuzz/`) share these bodies. A body panics where a promise is broken: a
//! piece that leaves no trace, a name that is empty, a place outside the input, an encoding that is not stable, a count that is
//! not the sum.

use drivers::capture::{Reader, Why as CaptureWhy};
use drivers::ft::{Device, Event, Sensor, Settings, Transport};
use drivers::rsi::{self, EthernetConfig, Frames, Mode, Telegram};
use harness::cell::CellConfig;
use sim_core::time::Nanos;
use std::collections::BTreeMap;

/// How often each outcome came.
pub type Outcomes = BTreeMap<&'static str, u64>;

/// Something that reads bytes from outside.
pub struct Target {
    /// What it is called.
    pub name: &'static str,
    /// Takes one input.
    pub run: fn(&[u8], &mut Outcomes),
    /// Sound inputs to start from.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// The outcome of an input that is sound.
    pub sound: &'static str,
}

/// All of them.
pub const TARGETS: &[Target] = &[
    Target { name: "telegram", run: telegram, seeds: telegrams, sound: "telegram" },
    Target { name: "frames", run: frames, seeds: streams, sound: "document" },
    Target { name: "datagram", run: datagram, seeds: telegrams, sound: "document" },
    Target { name: "ethernet", run: ethernet, seeds: ethernets, sound: "configuration" },
    Target { name: "rdt", run: rdt, seeds: rdt_sessions, sound: "ft-sample" },
    Target { name: "rdt-device", run: rdt_device, seeds: rdt_requests, sound: "stream" },
    Target { name: "sensor-settings", run: sensor_settings, seeds: settings_texts, sound: "settings" },
    Target { name: "capture", run: capture, seeds: captures, sound: "packet" },
    Target { name: "cell", run: cell, seeds: cells, sound: "cell" },
];

fn count(outcomes: &mut Outcomes, name: &'static str) {
    assert!(!name.is_empty(), "an outcome without a name");
    *outcomes.entry(name).or_default() += 1;
}

/// Cuts an input into the pieces of a session: two bytes of length before each.
fn pieces(mut input: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let (length, rest) = input.split_first_chunk::<2>()?;
        let (piece, after) = rest.split_at(usize::from(u16::from_le_bytes(*length)).min(rest.len()));
        input = after;
        Some(piece)
    })
}

/// The other way round.
fn session<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for piece in pieces {
        bytes.extend_from_slice(&u16::try_from(piece.len()).unwrap_or(u16::MAX).to_le_bytes());
        bytes.extend_from_slice(piece);
    }
    bytes
}

const KRC4: &str = "<Rob Type=\"KUKA\"><RIst X=\"1.00000\" Y=\"-2.50000\" Z=\"992.00000\" A=\"0.00000\" B=\"90.00000\" \
    C=\"-179.99990\"/><AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"0.0\" A6=\"0.0\"/><EIPos E1=\"226966.9326\" \
    E2=\"0.0\" E3=\"0.0\" E4=\"0.0\" E5=\"0.0\" E6=\"0.0\"/><GPIO 01=\"1\"/><Delay D=\"15\"/><IPOC>435413237</IPOC></Rob>";
const KRC2: &str = "<Rob TYPE=\"KUKA\">\n\t<Dat TaskType=\"b\">\n\t\t<ComStatus>continuous</ComStatus>\n\t\t<RIst X=\"93.9531\" \
    Y=\"-347.9674\" Z=\"1844.9703\" A=\"-126.9460\" B=\"24.9226\" C=\"-28.2871\" />\r\n<IPOC>0680309708</IPOC><BMode>3</BMode>\
    <Tech x=\"1\" p6=\"0.0000\"/><Tick>0000000000000000</Tick>\n\t</Dat>\n</Rob>\n";
const SEN: &str = "<Sen Type=\"ImFree\"><EStr>text</EStr><RKorr X=\"0.0000\" Y=\"0.0000\" Z=\"0.1000\" A=\"0.0000\" \
    B=\"0.0000\" C=\"0.0000\"/><DiO>125</DiO><IPOC>123645634563</IPOC></Sen>";

fn telegrams() -> Vec<Vec<u8>> {
    [KRC4, KRC2, SEN].map(|text| text.as_bytes().to_vec()).to_vec()
}

fn telegram(input: &[u8], outcomes: &mut Outcomes) {
    let telegram = match Telegram::decode(input) {
        Ok(telegram) => telegram,
        Err(malformed) => {
            assert!(malformed.at <= input.len(), "{malformed} is behind {} bytes", input.len());
            return count(outcomes, malformed.why.id());
        }
    };
    let mut once = Vec::new();
    telegram.encode(&mut once);
    let again = Telegram::decode(&once).expect("what was written can be read");
    let mut twice = Vec::new();
    again.encode(&mut twice);
    assert_eq!(once, twice, "encode(decode(x)) is stable");
    for element in &telegram.elements {
        for attribute in element.attributes.iter().map(|(name, _)| name.as_str()).chain([""]) {
            match telegram.number(&element.tag, attribute) {
                Some(Ok(value)) => assert!(value.is_finite(), "{value} was read as a number"),
                Some(Err(bad)) => count(outcomes, bad.why.id()),
                None => {}
            }
        }
    }
    let _ = telegram
        .six("RIst", rsi::POSE)
        .into_iter()
        .flatten()
        .inspect(|pose| assert!(pose.iter().all(|v| v.is_finite())));
    count(outcomes, if telegram.ipoc().is_some() { "telegram" } else { "telegram-without-ipoc" });
}

fn streams() -> Vec<Vec<u8>> {
    let (one, other) = (KRC4.as_bytes(), KRC2.as_bytes());
    let both = [one, b"\0\0\0", other].concat();
    let mut prefixed = 460_u32.to_le_bytes().to_vec();
    prefixed.extend_from_slice(one);
    let halves = one.split_at(100);
    [session([&[0], halves.0, halves.1]), session([&[0], both.as_slice()]), session([&[1], prefixed.as_slice(), other])]
        .to_vec()
}

/// The first piece says whether a length stands before each document.
fn frames(input: &[u8], outcomes: &mut Outcomes) {
    let mut pieces = pieces(input);
    let prefix = pieces.next().and_then(|piece| piece.first()).is_some_and(|byte| byte % 2 == 1);
    let mut frames = Frames::new(prefix);
    let mut found = 0;
    for piece in pieces {
        frames.push(piece);
        while let Some(document) = frames.next() {
            found += 1;
            assert!(found <= input.len() + 8, "more documents than bytes");
            match document {
                Ok(_) => count(outcomes, "document"),
                Err(malformed) => count(outcomes, malformed.why.id()),
            }
        }
        // Two documents at most, whatever came.
        assert!(frames.waiting() <= 2 * 65_536, "{} bytes wait", frames.waiting());
    }
    if frames.waiting() > 0 || found == 0 {
        count(outcomes, "waits");
    }
}

fn datagram(input: &[u8], outcomes: &mut Outcomes) {
    let found = rsi::split(input);
    assert!(!found.is_empty(), "a datagram leaves no trace");
    for document in found {
        match document {
            Ok(_) => count(outcomes, "document"),
            Err(malformed) => count(outcomes, malformed.why.id()),
        }
    }
}

fn ethernets() -> Vec<Vec<u8>> {
    let krc2 = "<ROOT><CONFIG><IP_NUMBER>192.0.1.2</IP_NUMBER><PORT>6008</PORT><PROTOCOL>TCP</PROTOCOL><SENTYPE>CoRob\
        </SENTYPE><PROTCOLLENGTH>Off</PROTCOLLENGTH><ONLYSEND>FALSE</ONLYSEND></CONFIG><!-- KRC2 !--><SEND><ELEMENTS>\
        <ELEMENT TAG=\"DEF_RIst\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\" UNIT=\"0x601\"/>\
        <ELEMENT TAG=\"GPIO.01\" TYPE=\"BOOL\" INDX=\"1\" UNIT=\"0\"/></ELEMENTS></SEND><RECEIVE><ELEMENTS>\
        <ELEMENT TAG=\"RKorr.X\" TYPE=\"DOUBLE\" INDX=\"1\" UNIT=\"1\" HOLDON=\"1\"/></ELEMENTS></RECEIVE></ROOT>";
    vec![include_bytes!("../../../fixtures/cells/rsi/bench.xml").to_vec(), krc2.as_bytes().to_vec()]
}

fn ethernet(input: &[u8], outcomes: &mut Outcomes) {
    let text = String::from_utf8_lossy(input);
    match EthernetConfig::parse(&text) {
        Ok(config) => {
            for mode in [Mode::Absolute, Mode::Relative] {
                assert_eq!(config.check(mode).is_err(), !config.dangers(mode).is_empty());
            }
            for trap in config.traps() {
                count(outcomes, trap.id());
            }
            count(outcomes, "configuration");
        }
        Err(error) => {
            let lines = text.matches('\n').count() + 1;
            assert!((1..=lines).contains(&error.line), "line {} of {lines}", error.line);
            assert!(!error.what.is_empty() && !error.help.is_empty());
            count(outcomes, "refused");
        }
    }
}

fn settings(text: &str) -> Settings {
    toml::from_str(text).expect("these settings are sound")
}

/// The host's side of a sensor: nothing comes in without leaving a trace, and its own count is the sum.
fn sensor(settings: &Settings, input: &[u8], outcomes: &mut Outcomes) {
    let datagrams = settings.protocol.transport() == Transport::Udp;
    let mut sensor = settings.sensor().expect("these settings are sound");
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

const RDT: &str = "protocol = \"rdt\"\nrate_hz = 1000\ncounts_per_n = 1000000\ncounts_per_n_m = 1000000\n";

fn rdt_sessions() -> Vec<Vec<u8>> {
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

fn rdt(input: &[u8], outcomes: &mut Outcomes) {
    sensor(&settings(RDT), input, outcomes);
}

fn rdt_requests() -> Vec<Vec<u8>> {
    let request = |code: u8| vec![0x12, 0x34, 0, code, 0, 0, 0, 3];
    vec![session(
        [request(2), request(0x42), request(0x41), request(3), request(4), request(0)].iter().map(Vec::as_slice),
    )]
}

/// The sensor's side: whatever is asked of it, it streams or it does not, and a sample is one datagram at most.
fn rdt_device(input: &[u8], outcomes: &mut Outcomes) {
    let mut device = settings(RDT).device().expect("these settings are sound");
    let (mut out, mut now) = (Vec::new(), Nanos(0));
    for piece in pieces(input) {
        now = now + Nanos(1_000_000);
        device.receive(now, piece, &mut out);
        assert!(out.is_empty(), "RDT has no answers");
        device.sample([1.0, -2.0, f64::from(piece.len() as u32)], [0.0; 3], &mut out);
        assert!(out.len() <= 1 && out.iter().all(|datagram| datagram.len() == 36), "{out:?}");
        count(outcomes, if out.is_empty() { "silent" } else { "stream" });
        out.clear();
    }
    count(outcomes, "session");
}

fn settings_texts() -> Vec<Vec<u8>> {
    let axia = "protocol = \"rdt\"\nmodel = \"axia\"\naddress = \"192.168.1.1:49152\"\nclock_hz = 7812\nrate_hz = 488.5\n\
        counts_per_n = 1e6\ncounts_per_n_m = 1e6\nbuffered = true\nrecords_per_datagram = 40\nstale_ms = 100\n";
    [RDT, axia].map(|text| text.as_bytes().to_vec()).to_vec()
}

fn sensor_settings(input: &[u8], outcomes: &mut Outcomes) {
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

fn captures() -> Vec<Vec<u8>> {
    vec![
        include_bytes!("../../../fixtures/captures/udp.pcap").to_vec(),
        include_bytes!("../../../fixtures/captures/udp.pcapng").to_vec(),
        include_bytes!("../../../fixtures/captures/udp_ns_big.pcap").to_vec(),
        include_bytes!("../../../fixtures/captures/tcp.pcap").to_vec(),
    ]
}

/// Bytes in one piece, and the same bytes cut small: the packets are the same.
fn capture(input: &[u8], outcomes: &mut Outcomes) {
    let read = |step: usize| {
        let (mut reader, mut packets) = (Reader::default(), Vec::new());
        let mut damage = None;
        for piece in input.chunks(step) {
            damage = damage.or(reader.push(piece, &mut packets).err());
            assert!(reader.held() <= input.len());
        }
        damage = damage.or(reader.finish(&mut packets).err());
        (packets, damage, reader.tally().clone())
    };
    let whole = read(input.len().max(1));
    let cut = read(997);
    assert_eq!(whole, cut, "how a capture is cut makes no difference");
    let (packets, damage, tally) = whole;
    assert_eq!(tally.packets, packets.len() as u64, "each packet is counted");
    for (why, times) in tally.skipped {
        *outcomes.entry(why.id()).or_default() += times;
    }
    if let Some(damage) = &damage {
        assert!(damage.at <= input.len() as u64, "{damage} is behind {} bytes", input.len());
        count(
            outcomes,
            match &damage.why {
                CaptureWhy::NotACapture(_) => "damage-not-a-capture",
                CaptureWhy::Packed(_) => "damage-packed",
                CaptureWhy::Variant(_) => "damage-variant",
                CaptureWhy::Length { .. } => "damage-length",
                CaptureWhy::Unequal { .. } => "damage-unequal",
                CaptureWhy::Fraction(_) => "damage-fraction",
                CaptureWhy::ByteOrder(_) => "damage-byte-order",
                CaptureWhy::CutOff { .. } => "damage-cut-off",
            },
        );
    }
    *outcomes.entry("packet").or_default() += packets.len() as u64;
    count(outcomes, if damage.is_some() { "damaged" } else { "whole" });
}

fn cells() -> Vec<Vec<u8>> {
    vec![include_bytes!("../../../fixtures/cells/bench.toml").to_vec()]
}

fn cell(input: &[u8], outcomes: &mut Outcomes) {
    match CellConfig::parse("CELL.toml", &String::from_utf8_lossy(input)) {
        Ok(_) => count(outcomes, "cell"),
        Err(error) => {
            assert!(!error.what.is_empty());
            count(
                outcomes,
                if error.place.is_some() || error.source_text.is_some() { "refused" } else { "refused-nowhere" },
            );
        }
    }
}
