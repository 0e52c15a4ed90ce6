//! Damaged bytes: seeded, 100 000 pieces for each decoder. None panics, none grows, and what is malformed is counted and named.

use super::super::calibration::Calibration;
use super::super::http::{PAGE, Reply, request};
use super::super::{Device, Sensor, netft_tcp};
use super::{EVERY, JR3, millis, pair};
use sim_core::rng::{Stream, Streams};

const CASES: usize = 100_000;

fn below(stream: &mut Stream, limit: usize) -> usize {
    (stream.uniform() * limit as f64) as usize
}

/// One or two of the things that happen to bytes.
fn mutate(bytes: &mut Vec<u8>, stream: &mut Stream) {
    for _ in 0..=below(stream, 2) {
        let at = below(stream, bytes.len().max(1));
        match below(stream, 7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << below(stream, 8),
            1 if !bytes.is_empty() => bytes[at] = below(stream, 256) as u8,
            2 => bytes.truncate(at),
            3 => bytes.insert(at.min(bytes.len()), below(stream, 256) as u8),
            4 => bytes.extend_from_within(..at),
            5 => *bytes = (0..below(stream, 300)).map(|_| below(stream, 256) as u8).collect(),
            _ => bytes.rotate_left(at),
        }
    }
}

#[test]
fn every_decoder_survives() {
    for (name, text) in EVERY.into_iter().chain([("jr3", JR3)]) {
        let mut stream = Streams::new(4).named(name);
        let (mut sensor, mut device) = pair(text);
        let (mut out, mut wire, mut events) = (Vec::new(), Vec::new(), Vec::new());
        sensor.start(&mut out);
        out.iter().for_each(|request| device.receive(millis(0), request, &mut wire));
        for case in 0..CASES as i64 {
            wire.clear();
            while wire.is_empty() {
                device.sample([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], &mut wire);
            }
            let mut piece = wire.swap_remove(0);
            // One in four stays whole, so that the counters move on.
            if case % 4 != 0 {
                mutate(&mut piece, &mut stream);
            }
            events.clear();
            sensor.receive(millis(case), &piece, &mut events);
            sensor.tick(millis(case), &mut out, &mut events);
            // At most one thing per byte, what was half read before, and four events for each.
            assert!(events.len() <= 4 * (piece.len() + 4096) + 4, "{name}: {} events", events.len());
            for sample in super::samples(&events) {
                assert!(sample.force_n.iter().chain(&sample.torque_n_m).all(|value| value.is_finite()), "{name}");
            }
            out.clear();
        }
        let named: u64 = sensor.tally().malformed().map(|(_, count)| count).sum();
        assert_eq!(named, sensor.tally().class("ft-malformed"), "{name}");
        assert!(named > 1000, "{name}: {named} malformed of {CASES}");
        recovers(name, &mut sensor, &mut device);
    }
}

/// After all that, a sound stream is heard again.
fn recovers(name: &str, sensor: &mut super::AnySensor, device: &mut super::AnyDevice) {
    let (mut out, mut events) = (Vec::new(), Vec::new());
    sensor.start(&mut out);
    out.iter().for_each(|request| device.receive(millis(0), request, &mut Vec::new()));
    for ms in 0..200 {
        let mut wire = Vec::new();
        device.sample([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], &mut wire);
        wire.iter().for_each(|piece| sensor.receive(millis(200_000 + ms), piece, &mut events));
    }
    assert!(super::samples(&events).len() >= 180, "{name}: {} samples", super::samples(&events).len());
}

#[test]
fn every_device_survives() {
    for (name, text) in EVERY.into_iter().chain([("jr3", JR3)]) {
        let mut stream = Streams::new(5).named(name);
        let (mut sensor, mut device) = pair(text);
        let mut requests = Vec::new();
        sensor.start(&mut requests);
        requests.push(b"C".to_vec());
        for _ in 0..CASES / 4 {
            let mut request = requests[below(&mut stream, requests.len())].clone();
            mutate(&mut request, &mut stream);
            let mut out = Vec::new();
            device.receive(millis(0), &request, &mut out);
            // The shortest request of SCHUNK has six bytes, and each gets one answer.
            assert!(out.len() <= request.len() / 6 + 1, "{name}");
            out.clear();
            device.sample([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], &mut out);
            assert!(out.len() <= 1, "{name}");
        }
    }
}

#[test]
fn pages_and_replies_survive() {
    let page = "<netft><cfgfu>2</cfgfu><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><scfgfu>N</scfgfu>\
        <scfgtu>Nm</scfgtu><prodname>Net F/T</prodname></netft>";
    let reply = format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n{page}", page.len());
    assert!(request(PAGE, "x").ends_with(b"\r\n\r\n"));
    let mut stream = Streams::new(6).named("pages");
    let (mut sound, mut refused) = (0, 0);
    for _ in 0..CASES {
        let mut bytes = reply.clone().into_bytes();
        mutate(&mut bytes, &mut stream);
        let mut incoming = Reply::default();
        let got = incoming.push(&bytes).and_then(|page| page.map_or_else(|| incoming.end(), Ok));
        match got.map(|page| Calibration::parse(&page.text)) {
            Ok(Ok(calibration)) => {
                sound += 1;
                assert!(calibration.scale().is_some_and(|scale| scale.counts_per_n() > 0.0));
            }
            Ok(Err(_)) | Err(_) => refused += 1,
        }
        // Lengths that are not a reply's are refused before anything is read.
        let tcp = (netft_tcp::Info::decode(&bytes), netft_tcp::Reading::decode(&bytes));
        assert!(matches!(tcp, (Err(_), Err(_))) || bytes.len() <= netft_tcp::INFO);
    }
    assert!(sound > 1000 && refused > 1000, "{sound} sound, {refused} refused");
}

#[test]
fn tcp_replies_survive() {
    let mut stream = Streams::new(7).named("tcp");
    let info = super::bytes("1234 02 03 000f4240 000f4240 0190 0190 0190 0014 0014 0014");
    let reading = super::bytes("1234 8002 7a12 e043 0000 0032 ffff 8000");
    let mut read = 0;
    for _ in 0..CASES {
        let (mut one, mut other) = (info.clone(), reading.clone());
        mutate(&mut one, &mut stream);
        mutate(&mut other, &mut stream);
        if let (Ok(info), Ok(reading)) = (netft_tcp::Info::decode(&one), netft_tcp::Reading::decode(&other)) {
            read += 1;
            let wrench = reading.wrench(&info).expect("counts above zero make a scale");
            assert!(wrench.iter().all(|value| value.is_finite()));
        }
    }
    assert!(read > 1000, "{read} read");
}
