//! What is fuzzed: each target takes any bytes, and counts under a name what became of every piece of them.
//!
//! The long test and the targets of libFuzzer (`tests/fuzz/`) share these bodies. A body panics where a promise is broken: a
//! piece that leaves no trace, a name that is empty, a place outside the input, an encoding that is not stable, a count that is
//! not the sum.

use super::sensors::{
    calibration, calibrations, devices, dialogue, rdt_sessions, requests, sensor, sensor_settings, settings_texts,
};
use drivers::capture::{Reader, Why as CaptureWhy};
use drivers::rsi::{
    self, Controller, Corrections, EthernetConfig, Family, Frames, Host, HostOptions, LateRule, Mode, Telegram,
};
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
    Target { name: "host", run: host, seeds: frame_sessions, sound: "frame" },
    Target { name: "controller", run: controller, seeds: reply_sessions, sound: "taken" },
    Target { name: "ethernet", run: ethernet, seeds: ethernets, sound: "configuration" },
    Target { name: "rdt", run: sensor::<0>, seeds: rdt_sessions, sound: "ft-sample" },
    Target { name: "buffered", run: sensor::<1>, seeds: dialogue::<1>, sound: "ft-sample" },
    Target { name: "optoforce", run: sensor::<2>, seeds: dialogue::<2>, sound: "ft-sample" },
    Target { name: "schunk", run: sensor::<3>, seeds: dialogue::<3>, sound: "ft-sample" },
    Target { name: "bota", run: sensor::<4>, seeds: dialogue::<4>, sound: "ft-sample" },
    Target { name: "robotiq", run: sensor::<5>, seeds: dialogue::<5>, sound: "ft-sample" },
    Target { name: "record-stream", run: sensor::<6>, seeds: dialogue::<6>, sound: "ft-sample" },
    Target { name: "record", run: sensor::<7>, seeds: dialogue::<7>, sound: "ft-sample" },
    Target { name: "devices", run: devices, seeds: requests, sound: "stream" },
    Target { name: "calibration", run: calibration, seeds: calibrations, sound: "calibration" },
    Target { name: "sensor-settings", run: sensor_settings, seeds: settings_texts, sound: "settings" },
    Target { name: "capture", run: capture, seeds: captures, sound: "packet" },
    Target { name: "cell", run: cell, seeds: cells, sound: "cell" },
];

/// One more of these.
pub fn count(outcomes: &mut Outcomes, name: &'static str) {
    assert!(!name.is_empty(), "an outcome without a name");
    *outcomes.entry(name).or_default() += 1;
}

/// Cuts an input into the pieces of a session: two bytes of length before each.
pub fn pieces(mut input: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let (length, rest) = input.split_first_chunk::<2>()?;
        let (piece, after) = rest.split_at(usize::from(u16::from_le_bytes(*length)).min(rest.len()));
        input = after;
        Some(piece)
    })
}

/// Pieces as an input.
pub fn session<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Vec<u8> {
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

fn bench() -> EthernetConfig {
    EthernetConfig::parse(include_str!("../../../fixtures/cells/rsi/bench.xml")).expect("the configuration is sound")
}

fn frame_sessions() -> Vec<Vec<u8>> {
    let frame = |ipoc: u64| {
        format!(
            "<Rob Type=\"KUKA\"><RIst X=\"1.0000\" Y=\"0.0000\" Z=\"992.0000\" A=\"0.0000\" B=\"0.0000\" C=\"0.0000\"/>\
             <RSol X=\"1.0000\" Y=\"0.0000\" Z=\"992.0000\" A=\"0.0000\" B=\"0.0000\" C=\"0.0000\"/><Delay D=\"0\"/>\
             <IPOC>{ipoc}</IPOC></Rob>"
        )
    };
    let of = |stamps: &[u64]| {
        let frames: Vec<String> = stamps.iter().map(|ipoc| frame(*ipoc)).collect();
        session(frames.iter().map(String::as_bytes))
    };
    // In order; repeated, missing, back, begun anew; over 2^32.
    vec![
        of(&[100, 104, 108, 112]),
        of(&[100, 104, 104, 116, 112, 4]),
        of(&[4_294_967_288, 4_294_967_292, 0, 4]),
        session([KRC4.as_bytes(), KRC2.as_bytes()]),
    ]
}

/// The PC's side of a robot: each datagram is a frame, an event, or both, and what it counts is what it said.
fn host(input: &[u8], outcomes: &mut Outcomes) {
    let mut host = Host::new(bench(), HostOptions::default());
    let (mut all, mut now) = (Vec::new(), Nanos(0));
    for piece in pieces(input) {
        now = now + Nanos(if piece.len() % 16 == 5 { 300_000_000 } else { 4_000_000 });
        host.tick(now, &mut all);
        let before = all.len();
        let frames = host.receive_documents(now, rsi::split(piece), &mut all);
        assert!(!frames.is_empty() || all.len() > before, "a datagram of {} bytes leaves no trace", piece.len());
        for frame in &frames {
            let values = frame.pose_mm_deg.into_iter().chain(frame.external).flatten();
            assert!(values.into_iter().all(f64::is_finite), "{frame:?}");
            count(outcomes, "frame");
        }
        if !frames.is_empty() {
            let correction = Corrections::six("RKorr", rsi::POSE, [0.0, 0.0, piece.len() as f64 * 1e-3, 0.0, 0.0, 0.0]);
            let reply = host.reply(&correction).expect("a fresh frame is answered");
            let reply = Telegram::decode(&reply).expect("the answer is a document");
            assert!(reply.ipoc().is_some());
        }
    }
    let mut classes = Outcomes::new();
    all.iter().for_each(|event| count(&mut classes, event.class()));
    assert_eq!(&classes, host.counts(), "each event is counted once");
    for (name, times) in classes.iter().chain(host.causes()) {
        *outcomes.entry(name).or_default() += times;
    }
    if all.is_empty() {
        count(outcomes, "nothing");
    }
}

/// Stamps of a controller that begins at 1000.
fn reply_sessions() -> Vec<Vec<u8>> {
    let replies: Vec<String> =
        (0..6).map(|cycle| SEN.replace("123645634563", &(1000 + 4 * cycle).to_string())).collect();
    vec![session(replies.iter().map(String::as_bytes))]
}

/// The controller's side of a robot: whatever is answered, its target stays within its limits.
fn controller(input: &[u8], outcomes: &mut Outcomes) {
    let mut settings = rsi::Settings::new(bench(), Family::Krc4);
    (settings.first_ipoc, settings.bad_stops) = (1000, false);
    settings.late = LateRule::Total { limit: 20 };
    let start = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
    let mut controller = Controller::new(settings, start, [0.0; 6]);
    let mut events = Vec::new();
    for piece in pieces(input) {
        let frame = controller.frame(&controller.target_mm_deg(), &[0.0; 6]);
        assert!(controller.stopped().is_some() || Telegram::decode(&frame).is_ok());
        controller.cycle(Some(piece), &mut events);
        let target = controller.target_mm_deg();
        assert!((0..3).all(|axis| (target[axis] - start[axis]).abs() <= 5.0 + 1e-9), "{target:?} is out of limits");
        if events.is_empty() {
            count(outcomes, if controller.stopped().is_some() { "after-the-stop" } else { "taken" });
        }
        events.drain(..).for_each(|event| count(outcomes, event.class()));
    }
    count(outcomes, "session");
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
