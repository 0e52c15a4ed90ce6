//! Each thing that a device can be made to do wrong, and as what the host sees it.

use super::super::{AnyDevice, AnySensor, Device, Disturbance, Event, Sensor};
use super::{EVERY, JR3, SRI, classes, millis, pair, samples};

/// The classes, other than samples, of a stream that is disturbed after 100 samples; and the number of samples.
fn check(text: &str, disturbance: Disturbance) -> (String, usize) {
    let (mut sensor, mut device) = started(text);
    let mut events = Vec::new();
    run(&mut sensor, &mut device, 0..100, &mut events);
    device.disturb(disturbance).unwrap();
    run(&mut sensor, &mut device, 100..150, &mut events);
    let rest: Vec<Event> = events.iter().filter(|event| event.class() != "ft-sample").cloned().collect();
    (classes(&rest), samples(&events).len())
}

fn started(text: &str) -> (AnySensor, AnyDevice) {
    let (mut sensor, mut device) = pair(text);
    let mut out = Vec::new();
    sensor.start(&mut out);
    out.iter().for_each(|request| device.receive(millis(0), request, &mut Vec::new()));
    (sensor, device)
}

fn run(sensor: &mut AnySensor, device: &mut AnyDevice, cycles: std::ops::Range<i64>, events: &mut Vec<Event>) {
    for ms in cycles {
        let mut wire = Vec::new();
        device.sample([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], &mut wire);
        wire.iter().for_each(|piece| sensor.receive(millis(ms), piece, events));
    }
}

#[test]
fn rdt_says_each_by_its_class() {
    let rdt = EVERY[0].1;
    let said = |disturbance| check(rdt, disturbance);
    let some = |classes: &str, samples| (classes.to_string(), samples);
    assert_eq!(said(Disturbance::Status(Some(0x8002_0000))), some("ft-saturated", 150));
    assert_eq!(said(Disturbance::Status(Some(0x8001_0000))), some("ft-warning", 150));
    assert_eq!(said(Disturbance::Status(Some(0xc000_0000))), some("ft-error", 150));
    assert_eq!(said(Disturbance::Counts(Some([i32::MAX, i32::MIN, 0, 0, 0, 0]))), some("ft-saturated", 150));
    assert_eq!(said(Disturbance::Sequence(1)), some("ft-out-of-order ft-restart", 149));
    assert_eq!(said(Disturbance::Sequence(105)), some("ft-gap", 150));
    assert_eq!(said(Disturbance::Sequence(100)), some("ft-duplicate", 149));
    assert_eq!(said(Disturbance::Stall(true)), some("ft-stalled", 150));
    assert_eq!(said(Disturbance::Clock(0)), some("ft-clock-back ft-clock-restart", 150));
    // Nothing in a record says what a count is worth: it is a step of the force, until the page is read again.
    assert_eq!(said(Disturbance::Scale { counts_per_n: 5e5, counts_per_n_m: 1e6 }), some("", 150));
}

#[test]
fn the_status_comes_back() {
    let (mut sensor, mut device) = started(EVERY[0].1);
    let mut events = Vec::new();
    run(&mut sensor, &mut device, 0..5, &mut events);
    device.disturb(Disturbance::Status(Some(0x8002_0000))).unwrap();
    run(&mut sensor, &mut device, 5..10, &mut events);
    device.disturb(Disturbance::Status(None)).unwrap();
    device.disturb(Disturbance::Stall(true)).unwrap();
    run(&mut sensor, &mut device, 10..15, &mut events);
    device.disturb(Disturbance::Stall(false)).unwrap();
    run(&mut sensor, &mut device, 15..20, &mut events);
    let rest: Vec<Event> = events.iter().filter(|event| event.class() != "ft-sample").cloned().collect();
    assert_eq!(classes(&rest), "ft-saturated ft-stalled ft-good ft-moving");
    assert!(rest.contains(&Event::Moving { samples: 5 }));
}

#[test]
#[expect(clippy::float_cmp, reason = "proves that bits are equal")]
fn a_changed_scale_is_a_step_of_the_force() {
    let (mut sensor, mut device) = started(EVERY[0].1);
    let mut events = Vec::new();
    run(&mut sensor, &mut device, 0..1, &mut events);
    device.disturb(Disturbance::Scale { counts_per_n: 5e5, counts_per_n_m: 1e6 }).unwrap();
    run(&mut sensor, &mut device, 1..2, &mut events);
    let got = samples(&events);
    assert_eq!((got[0].force_n, got[1].force_n), ([1.0, 2.0, 3.0], [0.5, 1.0, 1.5]));
    assert_eq!(got[0].torque_n_m, got[1].torque_n_m);
}

#[test]
fn the_others_say_theirs() {
    let some = |classes: &str, samples| (classes.to_string(), samples);
    let (schunk, bota, robotiq) = ("protocol = 'schunk'", "protocol = 'bota'\nrate_hz = 1000", "protocol = 'robotiq'");
    let optoforce = "protocol = 'optoforce'\nrate_hz = 1000";
    assert_eq!(check(optoforce, Disturbance::Status(Some(0x10))), some("ft-saturated", 150));
    assert_eq!(check(optoforce, Disturbance::Clock(0x8000)), some("", 150));
    assert_eq!(check(schunk, Disturbance::Status(Some(0x11))), some("ft-saturated", 150));
    assert_eq!(check(schunk, Disturbance::Sequence(110)), some("ft-gap", 150));
    assert_eq!(check(schunk, Disturbance::Stall(true)).1, 101, "its packet counter is its clock");
    assert_eq!(check(bota, Disturbance::Status(Some(4))), some("ft-error", 150));
    assert_eq!(check(bota, Disturbance::Clock(0)), some("ft-clock-back ft-clock-restart", 150));
    let limits = [i32::MAX, 0, 0, 0, 0, 0];
    assert_eq!(check(robotiq, Disturbance::Counts(Some(limits))), some("ft-saturated", 150));
    assert_eq!(check(SRI, Disturbance::Sequence(200)), some("ft-gap", 150));
    assert_eq!(check(JR3, Disturbance::Counts(Some(limits))), some("ft-saturated", 150));
}

#[test]
fn what_a_protocol_lacks_is_refused() {
    let refused = |text: &str, disturbance| pair(text).1.disturb(disturbance).expect_err("it has none").to_string();
    let scale = Disturbance::Scale { counts_per_n: 1.0, counts_per_n_m: 1.0 };
    assert_eq!(
        refused("protocol = 'robotiq'", Disturbance::Status(Some(1))),
        "this sensor's protocol cannot send a status: it has none"
    );
    for (text, disturbance) in [
        ("protocol = 'robotiq'", Disturbance::Sequence(1)),
        ("protocol = 'schunk'", scale),
        ("protocol = 'schunk'", Disturbance::Counts(None)),
        ("protocol = 'bota'\nrate_hz = 1000", Disturbance::Sequence(1)),
        (JR3, Disturbance::Status(None)),
        (JR3, Disturbance::Clock(1)),
        (JR3, Disturbance::DeafStarts(1)),
        (EVERY[0].1, Disturbance::Scale { counts_per_n: 0.0, counts_per_n_m: 1.0 }),
    ] {
        refused(text, disturbance);
    }
}

#[test]
fn a_float_that_is_no_number_is_no_sample() {
    let (mut sensor, _) = pair("protocol = 'schunk'");
    let packet = super::bytes("ffff 0700 1d00 00 01000000 0000c07f 000010c0 00001c41 0000003e 000080bd 0000003f");
    assert_eq!(classes(&super::hear(&mut sensor, millis(0), &packet)), "ft-malformed");
    assert_eq!(sensor.tally().malformed().collect::<Vec<_>>(), [("not-finite", 1)]);
}
