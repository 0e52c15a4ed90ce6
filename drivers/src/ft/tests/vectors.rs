//! Every vector of reference/PROTOCOLS.md, sections 2 and 3, byte by byte and both ways.

use super::super::rdt::{self, Command, Record};
use super::super::{Device, Disturbance, Event, Health, Sensor};
use super::{JR3, SRI, bytes, classes, hear, millis, pair, samples};

const RDT: &str = "protocol = 'rdt'\nrate_hz = 1000\ncounts_per_n = 1e6\ncounts_per_n_m = 1e6";
const RDT_RECORD: &str = "00000001 00001234 00000000 00bebc20 ffce68b0 05d86044 0001e848 ffffffff 00000000";
const RDT_WRAP: &str = "ffffffff fffffffe 80020000 7fffffff 80000000 00000000 00000000 00000000 00000000";
const SCHUNK: &str = "ffff 0700 1d00 00 01000000 0000c03f 000010c0 00001c41 0000003e 000080bd 0000003f";
const BOTA: &str = "aa 0000 0000c03f 000010c0 00001c41 0000003e 000080bd 0000003f 40420f00 0000cc41 842a";
const ROBOTIQ: &str = "204e d204 c9fd c522 0c00 deff 3800 1218";
/// The wrench of the vectors of SCHUNK and Bota.
const FLOATS: ([f64; 3], [f64; 3]) = ([1.5, -2.25, 9.75], [0.125, -0.0625, 0.5]);

#[test]
fn requests_of_rdt() {
    for (command, number, wanted) in [
        (Command::Start, 0, "12 34 00 02 00 00 00 00"),
        (Command::StartBuffered, 0, "12 34 00 03 00 00 00 00"),
        (Command::StartMultiUnit, 0, "12 34 00 04 00 00 00 00"),
        (Command::Stop, 0, "12 34 00 00 00 00 00 00"),
        // A known driver wrote the low half of the number twice.
        (Command::Start, 100_000, "12 34 00 02 00 01 86 a0"),
        (Command::Bias, 0, "12 34 00 42 00 00 00 00"),
        (Command::ResetLatch, 0, "12 34 00 41 00 00 00 00"),
    ] {
        let request = rdt::request(command.code(), number);
        assert_eq!(request, bytes(wanted), "{command:?}");
        assert_eq!(rdt::parse_request(&request), Some((command.code(), number)));
    }
    assert_eq!(rdt::parse_request(&bytes("12 35 00 02 00 00 00 00")), None);
    assert_eq!(rdt::parse_request(&bytes("12 34 00 02 00 00 00")), None);
}

#[test]
fn requests_of_the_others() {
    let check = |settings: &str, wanted: &[&str]| {
        let mut out = Vec::new();
        pair(settings).0.start(&mut out);
        assert_eq!(out, wanted.iter().map(|hex| bytes(hex)).collect::<Vec<_>>(), "{settings}");
    };
    check("protocol = 'optoforce'\nrate_hz = 1000", &["1234 0082 00000001", "1234 0002 00000000"]);
    check(
        "protocol = 'optoforce'\nrate_hz = 100\nfilter = 4",
        &["1234 0082 0000000a", "1234 0081 00000004", "1234 0002 00000000"],
    );
    check("protocol = 'schunk'", &["ffff 0100 0100 40"]);
    check("protocol = 'bota'\nrate_hz = 1000", &["52"]);
    check("protocol = 'bota'\nrate_hz = 1000\nconfigure = ['f,51,0,0,1']", &["43"]);
    check("protocol = 'robotiq'", &["09 10 019a 0001 02 0200 cdca"]);
    check(SRI, &["41542b4753440d0a"]);
    check(JR3, &[]);
    let (mut sensor, _) = pair("protocol = 'optoforce'\nrate_hz = 1000");
    let (mut out, mut events) = (Vec::new(), Vec::new());
    sensor.bias(true, &mut out, &mut events).unwrap();
    sensor.bias(false, &mut out, &mut events).unwrap();
    assert_eq!(out, [bytes("12 34 00 42 00 00 00 ff"), bytes("12 34 00 42 00 00 00 00")]);
    let (mut sensor, _) = pair("protocol = 'schunk'");
    let mut out = Vec::new();
    sensor.stop(&mut out);
    sensor.bias(true, &mut out, &mut events).unwrap();
    sensor.bias(false, &mut out, &mut events).unwrap();
    assert_eq!(out, [bytes("ffff 0100 0100 41"), bytes("ffff 0200 0100 12"), bytes("ffff 0300 0100 13")]);
    let (mut sensor, _) = pair("protocol = 'robotiq'");
    let mut out = Vec::new();
    sensor.stop(&mut out);
    assert_eq!(out, [vec![0xff; 50]]);
    assert!(sensor.bias(true, &mut out, &mut events).is_err());
}

#[test]
fn the_record_of_rdt() {
    let (mut sensor, _) = pair(RDT);
    let [sample] = samples(&hear(&mut sensor, millis(3), &bytes(RDT_RECORD)))[..] else { panic!("one sample") };
    assert_eq!((sample.force_n, sample.torque_n_m), ([12.5, -3.25, 98.0665], [0.125, -0.000001, 0.0]));
    assert_eq!((sample.received, sample.status, sample.sequence), (millis(3), 0, Some(1)));
    assert_eq!(sample.device_s, Some(4660.0 / 7000.0));
    let record = Record::decode(&bytes(RDT_RECORD)).unwrap();
    let mut again = Vec::new();
    record.encode(&mut again);
    assert_eq!(again, bytes(RDT_RECORD));
}

#[test]
fn the_record_of_rdt_from_its_device() {
    let (_, mut device) = pair(RDT);
    let mut out = Vec::new();
    device.receive(millis(0), &bytes("12 34 00 02 00 00 00 00"), &mut out);
    // Seven ticks pass in each sample.
    device.disturb(Disturbance::Clock(4660 - 7)).unwrap();
    device.sample([12.5, -3.25, 98.0665], [0.125, -0.000001, 0.0], &mut out);
    assert_eq!(out, [bytes(RDT_RECORD)]);
    out.clear();
    device.disturb(Disturbance::Sequence(0xffff_ffff)).unwrap();
    device.disturb(Disturbance::Clock(0xffff_fffe - 7)).unwrap();
    device.sample([3000.0, -3000.0, 0.0], [0.0; 3], &mut out);
    assert_eq!(out, [bytes(RDT_WRAP)], "a load beyond the range saturates, and the status says so");
    device.sample([0.0; 3], [0.0; 3], &mut out);
    assert_eq!(out[1][..8], bytes("00000000 00000005"), "both counters wrap");
}

#[test]
fn wrap_and_saturation_of_rdt() {
    let (mut sensor, _) = pair(RDT);
    let events = hear(&mut sensor, millis(0), &bytes(RDT_WRAP));
    let [Event::Status { status: 0x8002_0000, health: Health::Saturated, text }, Event::Sample(sample)] = &events[..]
    else {
        panic!("{events:?}")
    };
    assert_eq!(text, "error, transducer saturation or A/D");
    assert_eq!((sample.force_n[0], sample.force_n[1]), (2147.483647, -2147.483648));
    let mut next = bytes(RDT_WRAP);
    next[..12].copy_from_slice(&bytes("00000000 00000005 80020000"));
    let [sample] = samples(&hear(&mut sensor, millis(1), &next))[..] else { panic!("one sample") };
    assert_eq!(sample.sequence, Some(1 << 32));
    assert_eq!(sample.device_s, Some(((1_u64 << 32) + 5) as f64 / 7000.0));
}

#[test]
fn the_packet_of_schunk() {
    let (mut sensor, mut device) = pair("protocol = 'schunk'");
    let [sample] = samples(&hear(&mut sensor, millis(0), &bytes(SCHUNK)))[..] else { panic!("one sample") };
    assert_eq!(((sample.force_n, sample.torque_n_m), sample.status), (FLOATS, 1));
    assert_eq!((sample.sequence, sample.device_s), (Some(7), Some(0.007)));
    let mut out = Vec::new();
    device.receive(millis(0), &bytes("ffff 0100 0100 40"), &mut out);
    assert_eq!(out, [bytes("ffff 0100 0200 40 00")]);
    assert_eq!(classes(&hear(&mut sensor, millis(0), &out[0])), "ft-answer");
    device.disturb(Disturbance::Sequence(7)).unwrap();
    device.sample(FLOATS.0, FLOATS.1, &mut out);
    assert_eq!(out[1], bytes(SCHUNK));
    device.receive(millis(0), &bytes("ffff 0900 0100 77 ffff 0a00 0200 41 01"), &mut out);
    assert_eq!(out[2..], [bytes("ffff 0900 0200 77 01"), bytes("ffff 0a00 0200 41 03")]);
    assert_eq!(classes(&hear(&mut sensor, millis(0), &out[2])), "ft-refused");
}

#[test]
fn the_record_of_bota_in_pieces() {
    let (mut sensor, mut device) = pair("protocol = 'bota'\nrate_hz = 1000");
    let whole = bytes(BOTA);
    for cut in 0..whole.len() {
        let mut events = hear(&mut sensor, millis(0), &whole[..cut]);
        events.extend(hear(&mut sensor, millis(0), &whole[cut..]));
        let [sample] = samples(&events)[..] else { panic!("one sample, cut at {cut}: {events:?}") };
        assert_eq!(((sample.force_n, sample.torque_n_m), sample.status, sample.sequence), (FLOATS, 0, None));
        assert_eq!(sample.device_s, Some(1.0));
    }
    let mut out = Vec::new();
    device.receive(millis(0), b"R", &mut out);
    device.disturb(Disturbance::Clock(999_000)).unwrap();
    device.sample(FLOATS.0, FLOATS.1, &mut out);
    assert_eq!(out, [whole]);
}

#[test]
fn the_record_of_robotiq_in_pieces() {
    let (mut sensor, mut device) = pair("protocol = 'robotiq'");
    let whole = bytes(ROBOTIQ);
    for cut in 0..whole.len() {
        let mut events = hear(&mut sensor, millis(0), &whole[..cut]);
        events.extend(hear(&mut sensor, millis(0), &whole[cut..]));
        let [sample] = samples(&events)[..] else { panic!("one sample, cut at {cut}: {events:?}") };
        assert_eq!((sample.force_n, sample.torque_n_m), ([12.34, -5.67, 89.01], [0.012, -0.034, 0.056]));
    }
    let mut out = Vec::new();
    device.receive(millis(0), &bytes("09 10 019a 0001 02 0200 cdca"), &mut out);
    device.sample([12.34, -5.67, 89.01], [0.012, -0.034, 0.056], &mut out);
    assert_eq!(out, [bytes("09 10 019a 0001 2152"), whole]);
    assert_eq!(classes(&hear(&mut sensor, millis(0), &out.concat())), "ft-answer ft-sample");
    device.receive(millis(0), &[0xff; 49], &mut out);
    assert!(device.streams());
    device.receive(millis(0), &[0xff], &mut out);
    assert!(!device.streams(), "the fiftieth stops it");
}

#[test]
fn an_optoforce_counts_otherwise() {
    let (mut sensor, mut device) = pair("protocol = 'optoforce'\nrate_hz = 1000");
    let mut out = Vec::new();
    sensor.start(&mut out);
    let requests = std::mem::take(&mut out);
    requests.iter().for_each(|request| device.receive(millis(0), request, &mut out));
    device.sample([1.5, -2.25, 9.75], [0.125, -0.0625, 0.5], &mut out);
    let wanted = "00000001 00000001 00000000 00003a98 ffffa81c 00017cdc 000030d4 ffffe796 0000c350";
    assert_eq!(out, [bytes(wanted)]);
    let [sample] = samples(&hear(&mut sensor, millis(0), &out[0]))[..] else { panic!("one sample") };
    assert_eq!(((sample.force_n, sample.torque_n_m), sample.device_s), (FLOATS, Some(0.001)));
}

#[test]
fn frames_of_sri_and_a_wrapper_of_a_jr3() {
    let (mut sensor, mut device) = pair(SRI);
    let mut out = Vec::new();
    device.receive(millis(0), b"AT+GSD\r\n", &mut out);
    device.sample(FLOATS.0, FLOATS.1, &mut out);
    // Sum of the 24 bytes of data, modulo 256: 0xe6.
    let wanted = "aa55001b 0100 0000c03f 000010c0 00001c41 0000003e 000080bd 0000003f e6";
    assert_eq!(out, [bytes(wanted)]);
    let [sample] = samples(&hear(&mut sensor, millis(0), &out[0]))[..] else { panic!("one sample") };
    assert_eq!(((sample.force_n, sample.torque_n_m), sample.sequence), (FLOATS, Some(1)));

    let (mut sensor, mut device) = pair(JR3);
    let mut out = Vec::new();
    device.sample([100.0, -50.0, 400.0], [10.0, -5.0, 0.0], &mut out);
    assert_eq!(out, [bytes("09 1000 f800 2000 1000 f800 0000 0001")]);
    let [sample] = samples(&hear(&mut sensor, millis(0), &out[0]))[..] else { panic!("one sample") };
    assert_eq!((sample.force_n, sample.torque_n_m), ([100.0, -50.0, 400.0], [10.0, -5.0, 0.0]));
}
