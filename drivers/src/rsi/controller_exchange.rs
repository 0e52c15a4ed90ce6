//! The two sides against each other, over datagrams and over streams in pieces: whatever the family and the form, every reply is
//! taken, and the robot goes where it is sent.

use super::super::{
    Controller, Corrections, EthernetConfig, Event, Family, Form, Frames, Host, HostOptions, Mode, POSE, Settings,
};
use super::tests::config;
use sim_core::time::Nanos;

const CYCLES: u64 = 100;
const START: [f64; 6] = [1000.0, 0.0, 500.0, 90.0, 0.0, 180.0];

/// Bytes of a stream, so many at a time, as documents.
struct Pipe {
    frames: Frames,
    piece: usize,
}

impl Pipe {
    fn new(prefixed: bool, piece: usize) -> Pipe {
        Pipe { frames: Frames::new(prefixed), piece }
    }

    fn carry(&mut self, document: &[u8], wrap: bool) -> Vec<Vec<u8>> {
        let bytes = if wrap { self.frames.wrap(document) } else { document.to_vec() };
        let mut documents = Vec::new();
        for piece in bytes.chunks(self.piece) {
            self.frames.push(piece);
            documents.extend(
                std::iter::from_fn(|| self.frames.next())
                    .map(|document| document.unwrap_or_else(|error| panic!("{piece:?}: {error}"))),
            );
        }
        documents
    }
}

/// Runs the exchange; where the robot is sent in the end, and every event of the host that is no news.
fn exchange(settings: Settings, prefixed: bool, piece: usize) -> ([f64; 6], Vec<String>) {
    let period = Nanos(i64::from(settings.cycle_ms) * 1_000_000);
    let options = HostOptions { mode: settings.mode, ..HostOptions::default() };
    let mut host = Host::new(settings.config.clone(), options);
    let (mut down, mut up) = (Pipe::new(prefixed, piece), Pipe::new(prefixed, piece));
    let mut controller = Controller::new(settings, START, [0.0; 6]);
    let (mut events, mut log) = (Vec::new(), Vec::new());
    if let Some(greeting) = controller.greeting() {
        for document in down.carry(&greeting, prefixed) {
            assert_eq!(host.receive(Nanos(0), &document, &mut events), None, "a greeting is not answered");
        }
        assert_eq!(events.pop().map(|event| event.class()), Some("rsi-hello"));
    }
    for cycle in 0..CYCLES {
        let frame = controller.frame(&controller.target_mm_deg().map(|v| v + cycle as f64 * 0.0173), &[0.0; 6]);
        let mut replies = Vec::new();
        for document in down.carry(&frame, prefixed) {
            let now = Nanos(cycle as i64 * period.0);
            let fresh = host.receive(now, &document, &mut events).expect("a fresh frame");
            assert_eq!(fresh.delay, Some(0));
            let mut wanted = Corrections::six("RKorr", POSE, [0.01, 0.0, -0.02, 0.0, 0.005, 0.0]);
            wanted.number("EKorr", "E1", -0.01);
            let reply = host.reply(&wanted).expect("a reply");
            replies.extend(up.carry(&reply, prefixed));
        }
        assert_eq!(replies.len(), 1);
        controller.cycle_of(&replies, &mut log);
    }
    assert_eq!(log, []);
    let anomalies = events.iter().filter(|event| !event.is_news()).map(Event::class).map(str::to_owned);
    (controller.target_mm_deg(), anomalies.collect())
}

fn settings(family: Family, form: Form, mode: Mode) -> Settings {
    let hold = if mode == Mode::Absolute { "1" } else { "0" };
    let config: EthernetConfig = config(hold);
    Settings { form, mode, decimals: 4, ..Settings::new(config, family) }
}

#[test]
fn every_family_and_form_drives_an_exchange() {
    for (family, form) in [
        (Family::Krc4, Form::Flat),
        (Family::Krc5, Form::Flat),
        (Family::IiQka, Form::Flat),
        (Family::Krc2, Form::Flat),
        (Family::Krc2, Form::Dat),
    ] {
        let (target, anomalies) = exchange(settings(family, form, Mode::Absolute), false, usize::MAX);
        assert_eq!(target, [1000.01, 0.0, 499.98, 90.0, 0.005, 180.0], "{family:?}");
        assert_eq!(anomalies, [""; 0], "{family:?}");
        // A hundred steps, each of them exact only to rounding of the sum.
        let (target, _) = exchange(settings(family, form, Mode::Relative), false, usize::MAX);
        assert!((target[0] - 1001.0).abs() < 1e-12 * 1000.0 && (target[2] - 498.0).abs() < 1e-9, "{target:?}");
    }
}

/// A KRC2 over TCP: pieces of any length, whole buffers padded with NUL, or a length before each document.
#[test]
fn a_stream_in_pieces_carries_the_same() {
    for piece in [1, 7, 100, 2048] {
        for (prefixed, frame_bytes) in [(false, 0), (false, 2048), (true, 0)] {
            let mut krc2 =
                Settings { frame_bytes, ipoc_digits: 10, ..settings(Family::Krc2, Form::Dat, Mode::Absolute) };
            krc2.config.length_prefix = prefixed;
            let (target, anomalies) = exchange(krc2, prefixed, piece);
            assert_eq!((target[0], anomalies.len()), (1000.01, 0), "{piece} bytes, {prefixed}, {frame_bytes}");
        }
    }
}

/// 0.98 of 2^32, as a real telegram has it, and across it both ways.
#[test]
fn the_exchange_goes_on_across_two_to_the_thirty_two() {
    for wraps in [true, false] {
        let mut near = settings(Family::Krc4, Form::Flat, Mode::Absolute);
        near.cross_at(50, wraps);
        let (target, anomalies) = exchange(near, false, usize::MAX);
        let expected: &[&str] = if wraps { &["rsi-wrap"] } else { &[] };
        assert_eq!((target[0], anomalies), (1000.01, expected.iter().map(|class| (*class).to_owned()).collect()));
    }
}
