//! Host and device talk: starting, silence, bias, a client that takes the stream away, and a round trip in every protocol.

use super::super::{Device, Disturbance, Event, Sensor, netft_tcp};
use super::{EVERY, classes, hear, millis, pair, samples};
use std::net::SocketAddr;

const RDT: &str = EVERY[0].1;

/// Loads that every protocol can carry: hundredths of a newton, thousandths of a newton metre.
fn load(k: i32) -> ([f64; 3], [f64; 3]) {
    let value = |i: i32| f64::from((k * 37 + i * 101) % 1000 - 500);
    ([value(0), value(1), value(2)].map(|n| n / 4.0), [value(3), value(4), value(5)].map(|n| n / 1000.0))
}

#[test]
fn what_the_device_feels_the_sensor_says() {
    for (name, text) in EVERY {
        let (mut sensor, mut device) = pair(text);
        let (mut requests, mut wire, mut events) = (Vec::new(), Vec::new(), Vec::new());
        sensor.start(&mut requests);
        requests.iter().for_each(|request| device.receive(millis(0), request, &mut wire));
        assert!(device.streams(), "{name}");
        let count = 400;
        for k in 0..count {
            let (force_n, torque_n_m) = load(k);
            device.sample(force_n, torque_n_m, &mut wire);
            wire.drain(..).for_each(|piece| sensor.receive(millis(i64::from(k)), &piece, &mut events));
        }
        let got = samples(&events);
        assert_eq!(got.len(), count as usize, "{name}");
        for (k, sample) in got.iter().enumerate() {
            let (force_n, torque_n_m) = load(k as i32);
            let felt = force_n.iter().chain(&torque_n_m);
            for (is, was) in sample.force_n.iter().chain(&sample.torque_n_m).zip(felt) {
                // Half the coarsest count is 5 mN and 0.5 mN m; loads are whole counts, so that only f32 rounds (0.5 ulp).
                assert!((is - was).abs() <= was.abs() * f64::from(f32::EPSILON) / 2.0, "{name} {k}: {is} {was}");
            }
        }
        let rest: Vec<_> = events.iter().map(Event::class).filter(|class| *class != "ft-sample").collect();
        assert!(rest.iter().all(|class| *class == "ft-answer"), "{name}: {rest:?}");
        assert_eq!(sensor.tally().class("ft-sample"), count as u64, "{name}");
        if let (Some(first), Some(last)) = (got[0].device_s, got[399].device_s) {
            // Each device's clock is whole ticks, at most a millisecond.
            let period_s = super::settings(text).period().unwrap().seconds();
            assert!((last - first - 399.0 * period_s).abs() <= 1e-3, "{name}: {first} {last}");
        }
        requests.clear();
        sensor.stop(&mut requests);
        requests.iter().for_each(|request| device.receive(millis(0), request, &mut wire));
        // SRI's layout has no request that stops it.
        assert_eq!(device.streams(), requests.is_empty(), "{name} stops");
    }
}

#[test]
fn a_lost_start_goes_out_again() {
    let (mut sensor, mut device) = pair(RDT);
    device.disturb(Disturbance::DeafStarts(3)).unwrap();
    let (mut out, mut events) = (Vec::new(), Vec::new());
    sensor.start(&mut out);
    let mut heard_at = None;
    for ms in 0..1000 {
        sensor.tick(millis(ms), &mut out, &mut events);
        let requests = std::mem::take(&mut out);
        requests.iter().for_each(|request| device.receive(millis(ms), request, &mut Vec::new()));
        let mut wire = Vec::new();
        device.sample([1.0; 3], [0.0; 3], &mut wire);
        wire.iter().for_each(|piece| sensor.receive(millis(ms), piece, &mut events));
        heard_at = heard_at.or((!samples(&events).is_empty()).then_some(ms));
    }
    assert_eq!(sensor.tally().class("ft-start-resent"), 3);
    assert_eq!(heard_at, Some(300), "the fourth request is heard");
    assert_eq!(sensor.tally().class("ft-stale"), 0);
}

#[test]
fn nobody_answers() {
    let (mut sensor, _) = pair(RDT);
    let (mut out, mut events) = (Vec::new(), Vec::new());
    sensor.start(&mut out);
    let mut sent_at = Vec::new();
    for ms in 0..20_000 {
        out.clear();
        sensor.tick(millis(ms), &mut out, &mut events);
        if !out.is_empty() {
            sent_at.push(ms);
        }
    }
    let tens: Vec<i64> = (1..=10).map(|k| k * 100).collect();
    assert_eq!(sent_at[..10], tens, "every 100 ms, ten times");
    // Then 0.25 s, doubling, never more than 5 s.
    assert_eq!(sent_at[10..], [1350, 1850, 2850, 4850, 8850, 13_850, 18_850]);
    assert_eq!(sensor.tally().class("ft-no-answer"), 1);
    assert!(events.iter().any(|event| event.to_string().contains("no answer to 11 requests")));
}

#[test]
fn a_silence_makes_the_sample_stale_once() {
    let (mut sensor, mut device) = pair(RDT);
    let (mut out, mut wire, mut events) = (Vec::new(), Vec::new(), Vec::new());
    sensor.start(&mut out);
    out.drain(..).for_each(|request| device.receive(millis(0), &request, &mut wire));
    for ms in 0..1000 {
        device.disturb(Disturbance::Silent((300..600).contains(&ms))).unwrap();
        device.sample([1.0; 3], [0.0; 3], &mut wire);
        wire.drain(..).for_each(|piece| sensor.receive(millis(ms), &piece, &mut events));
        // A passive tap sends nothing: what it would send does not reach the device here.
        sensor.tick(millis(ms), &mut out, &mut events);
    }
    let count = |class| sensor.tally().class(class);
    assert_eq!((count("ft-stale"), count("ft-resumed"), count("ft-sample")), (1, 1, 700));
    assert!(events.contains(&Event::Resumed { silent: millis(301) }));
}

#[test]
fn a_tap_sends_nothing() {
    let (mut sensor, _) = pair(RDT);
    let (mut out, mut events) = (Vec::new(), Vec::new());
    for ms in 0..3000 {
        sensor.tick(millis(ms), &mut out, &mut events);
    }
    assert_eq!((out.len(), events.len()), (0, 0));
}

#[test]
fn ten_malformed_in_a_row_are_a_new_session() {
    let (mut sensor, _) = pair(RDT);
    let said: Vec<String> = (0..10).map(|_| classes(&hear(&mut sensor, millis(0), &[0; 35]))).collect();
    assert_eq!(said[8..], ["ft-malformed", "ft-malformed ft-session"]);
    assert_eq!(sensor.tally().malformed().collect::<Vec<_>>(), [("length", 10)]);
}

#[test]
fn a_bias_is_asked_for_and_said() {
    let (mut sensor, mut device) = pair(RDT);
    let (mut out, mut wire, mut events) = (Vec::new(), Vec::new(), Vec::new());
    sensor.start(&mut out);
    assert_eq!(out.len(), 1, "a start alone: no bias unasked");
    out.drain(..).for_each(|request| device.receive(millis(0), &request, &mut wire));
    for _ in 0..5 {
        device.sample([1.0, 2.0, 3.0], [0.5; 3], &mut wire);
    }
    let late = wire.split_off(3);
    wire.drain(..).for_each(|piece| sensor.receive(millis(1), &piece, &mut events));
    events.clear();
    sensor.bias(true, &mut out, &mut events).unwrap();
    assert_eq!(classes(&events), "ft-bias-set");
    out.drain(..).for_each(|request| device.receive(millis(0), &request, &mut wire));
    device.sample([1.0, 2.0, 4.0], [0.5; 3], &mut wire);
    // Two packets of the old stream were still under way.
    late.iter().chain(&wire).for_each(|piece| sensor.receive(millis(2), piece, &mut events));
    assert_eq!(
        classes(&events),
        "ft-bias-set ft-sample ft-sample ft-sample",
        "the count that begins anew was asked for"
    );
    let got = samples(&events);
    assert_eq!((got[1].force_n, got[2].force_n), ([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]));
    assert_eq!((got[1].sequence, got[2].sequence), (Some(5), Some(1)));
    assert!(sensor.bias(false, &mut out, &mut events).is_err(), "RDT cannot take it back");
}

#[test]
fn what_others_ask_is_overheard() {
    let rdt = |code: u8, number: u8| vec![0x12, 0x34, 0, code, 0, 0, 0, number];
    let schunk = |command: u8| vec![0xff, 0xff, 1, 0, 1, 0, command];
    let cases: [(&str, Vec<Vec<u8>>, &str); 3] = [
        (
            RDT,
            [0, 2, 3, 0x41, 0x42, 0x77].map(|code| rdt(code, 0)).to_vec(),
            "ft-stop ft-start ft-start ft-latch-reset ft-bias-set",
        ),
        (
            "protocol = 'optoforce'\nrate_hz = 1000",
            vec![rdt(0x42, 255), rdt(0x42, 0), rdt(2, 0), rdt(0x82, 10), rdt(0x82, 0), vec![1, 2]],
            "ft-bias-set ft-bias-cleared ft-start ft-stop",
        ),
        (
            "protocol = 'schunk'",
            vec![[schunk(0x40), schunk(0x12)].concat(), schunk(0x13), schunk(0x41), schunk(0x30)],
            "ft-start ft-bias-set ft-bias-cleared ft-stop",
        ),
    ];
    for (text, requests, wanted) in cases {
        let (mut sensor, _) = pair(text);
        let mut events = Vec::new();
        requests.iter().for_each(|request| sensor.overhear(request, &mut events));
        assert_eq!(classes(&events), wanted, "{text}");
    }
    let beside = netft_tcp::Request::Reading { conditions: 0, bias: true, clear_latch: true }.encode();
    assert_eq!(classes(&netft_tcp::overhear(&beside)), "ft-bias-set ft-latch-reset");
    assert_eq!(netft_tcp::overhear(&netft_tcp::Request::Calibration.encode()), []);
}

#[test]
fn a_second_client_takes_the_stream_away() {
    let (_, mut device) = pair(RDT);
    let peers: [SocketAddr; 2] = ["127.0.0.1:1000", "127.0.0.1:2000"].map(|text| text.parse().unwrap());
    let start = super::bytes("1234 0002 00000000");
    let mut wire = Vec::new();
    device.receive_from(millis(0), Some(peers[0]), &start, &mut wire);
    device.sample([0.0; 3], [0.0; 3], &mut wire);
    device.receive_from(millis(0), Some(peers[1]), &super::bytes("1234 0041 00000000"), &mut wire);
    assert_eq!(device.client(), Some(peers[0]), "another command takes nothing away");
    device.receive_from(millis(0), Some(peers[1]), &start, &mut wire);
    device.sample([0.0; 3], [0.0; 3], &mut wire);
    assert_eq!(device.client(), Some(peers[1]));
    assert_eq!(wire[1][..8], super::bytes("00000001 0000000e"), "the packets begin anew, the device's clock goes on");
}

#[test]
fn a_number_of_samples_ends_and_a_latch_stays() {
    let (mut sensor, mut device) = pair(EVERY[1].1);
    let mut wire = Vec::new();
    // Six samples, four in a datagram.
    device.receive(millis(0), &super::bytes("1234 0003 00000006"), &mut wire);
    if let super::super::AnyDevice::Rdt(device) = &mut device {
        device.latch();
    }
    (0..10).for_each(|_| device.sample([0.0; 3], [0.0; 3], &mut wire));
    assert_eq!(wire.iter().map(Vec::len).collect::<Vec<_>>(), [144, 72]);
    assert_eq!(classes(&hear(&mut sensor, millis(0), &wire[0])), "ft-warning ft-sample ft-sample ft-sample ft-sample");
    wire.clear();
    device.receive(millis(0), &super::bytes("1234 0041 00000000"), &mut wire);
    device.receive(millis(0), &super::bytes("1234 0002 00000000"), &mut wire);
    device.sample([0.0; 3], [0.0; 3], &mut wire);
    assert_eq!(wire[0][8..12], [0; 4]);
}

#[test]
fn a_bota_is_configured_step_by_step() {
    let (mut sensor, mut device) = pair("protocol = 'bota'\nrate_hz = 1000\nconfigure = ['c,0,1,0,4', 'f,51,0,0,1']");
    let (mut out, mut said, mut events) = (Vec::new(), Vec::new(), Vec::new());
    sensor.start(&mut out);
    for ms in 0..10 {
        let mut wire = Vec::new();
        for request in out.drain(..) {
            device.receive(millis(ms), &request, &mut wire);
            said.push(String::from_utf8(request).unwrap());
        }
        device.sample([1.5, 0.0, 0.0], [0.0; 3], &mut wire);
        wire.iter().for_each(|piece| sensor.receive(millis(ms), piece, &mut events));
        sensor.tick(millis(ms), &mut out, &mut events);
    }
    assert_eq!(said, ["C", "c,0,1,0,4", "f,51,0,0,1", "R"]);
    assert_eq!(samples(&events).len(), 7);
    let mut wire = Vec::new();
    device.receive(millis(20), b"I", &mut wire);
    assert_eq!(classes(&hear(&mut sensor, millis(20), &wire.concat())), "ft-answer", "App Init");
}
