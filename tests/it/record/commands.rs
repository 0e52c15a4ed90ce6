//! What a robot was told is what its controller took; and all that it says is kept.

use super::import::{PC, ROBOT, SENSOR, SENSOR_CLIENT};
use super::wire::{Capture, files, rdt, rob, sen};
use crate::shell::{Ran, Shell};
use harness::recording::{ReadOptions, Session, read};
use serde_json::Value;

const BEGIN_NS: i64 = 1_700_000_000_000_000_000;
const CYCLE_NS: i64 = 4_000_000;
const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
/// The last one has no fault: no frame would say so.
const FRAMES: u64 = 101;
/// Where the probe is at the start.
const START_M: f64 = -0.008;

/// What is the matter with every second reply.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Fault {
    None,
    /// It comes after the next frame.
    Late,
    /// It comes in time for the capture, and too late for the controller.
    Refused,
    /// Its type is not that of the configuration.
    Type,
}

/// Frames and replies; every second reply has that fault, and the controller counts it, where it tells.
fn exchange(fault: Fault, counts: bool, z_mm: impl Fn(u64) -> f64) -> Capture {
    let (mut capture, mut delay) = (Capture::default(), 0);
    for nth in 0..FRAMES {
        let (at_ns, ipoc) = (BEGIN_NS + nth as i64 * CYCLE_NS, 1000 + 4 * nth);
        let field = if counts { format!("D=\"{delay}\"") } else { "E=\"0\"".to_owned() };
        let frame = String::from_utf8(rob(ipoc, POSE, POSE)).unwrap().replace("D=\"0\"", &field);
        capture.udp(at_ns, ROBOT, PC, frame.as_bytes());
        let is_bad = nth % 2 == 1 && fault != Fault::None;
        delay += u64::from(is_bad);
        let mut reply = sen(ipoc, z_mm(nth), 0.0);
        if is_bad && fault == Fault::Type {
            reply = String::from_utf8(reply).unwrap().replace("ImFree", "Imfree").into_bytes();
        }
        let after_ns = if is_bad && fault == Fault::Late { 5_000_000 } else { 500_000 };
        capture.udp(at_ns + after_ns, PC, ROBOT, &reply);
        capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &rdt(nth as u32 + 1, 28 * nth as u32, [0.0, 0.0, 1.0]));
    }
    capture
}

/// Imported with this mode of corrections.
fn imported(capture: &mut Capture, mode: &str) -> (Ran, Session, Vec<u8>) {
    let shell = Shell::new();
    files(&shell, |text| text.replace("\"absolute\"", &format!("\"{mode}\"")), |text| text);
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let cell = ["--cell", "DIR/cell.toml", "--kind", "free-flight", "-o", "DIR/s.mcap"];
    let ran = shell.run(&[&["import", "pcap", "DIR/c.pcap"], &cell[..]].concat());
    let bytes = std::fs::read(shell.path("s.mcap")).unwrap();
    (ran, read(&shell.path("s.mcap"), &ReadOptions::default()).unwrap(), bytes)
}

fn commanded_m(session: &Session) -> Vec<f64> {
    session.commanded.as_ref().unwrap().value.iter().map(|pose| pose.position_m[2]).collect()
}

/// 0.1 mm in each reply, of which the controller takes every second one: 5.1 mm, and not 10.1.
#[test]
fn a_step_that_the_controller_dropped_is_not_added() {
    for (fault, counts, class, times) in [
        (Fault::Late, true, "50 × reply-late (chaser)", FRAMES),
        // Without the count, nothing is known of a tick whose reply came too late.
        (Fault::Late, false, "50 × reply-late (chaser)", FRAMES.div_ceil(2)),
        (Fault::Refused, true, "50 × rsi-late (chaser)", FRAMES),
        (Fault::Type, true, "50 × reply-type (chaser)", FRAMES),
        (Fault::Type, false, "50 × reply-type (chaser)", FRAMES),
    ] {
        let (ran, session, _) = imported(&mut exchange(fault, counts, |_| 0.1), "relative");
        assert!(ran.out.contains(class), "{fault:?}: {}", ran.out);
        let commanded = commanded_m(&session);
        let came_mm = (commanded.last().unwrap() - START_M) * 1e3;
        assert!((came_mm - 5.1).abs() < 1e-9, "{fault:?} {counts}: {came_mm} mm");
        assert_eq!(commanded.len() as u64, times, "{fault:?} {counts}");
    }
    let (_, session, _) = imported(&mut exchange(Fault::None, true, |_| 0.1), "relative");
    let commanded = commanded_m(&session);
    assert_eq!(commanded.len() as u64, FRAMES);
    assert!((commanded[100] - START_M - 10.1e-3).abs() < 1e-12, "{}", commanded[100]);
}

#[test]
fn a_reply_that_the_controller_dropped_is_no_pose() {
    for fault in [Fault::Type, Fault::Refused] {
        let wild = |nth: u64| if nth % 2 == 1 { 100.0 } else { nth as f64 * 0.1 };
        let (_, session, _) = imported(&mut exchange(fault, true, wild), "absolute");
        let commanded = commanded_m(&session);
        assert_eq!(commanded.len() as u64, FRAMES, "{fault:?}");
        for (nth, pose) in commanded.into_iter().enumerate() {
            let held = START_M + (nth - nth % 2) as f64 * 0.1e-3;
            assert!((pose - held).abs() < 1e-12, "{fault:?} {nth}: {pose}, not {held}");
        }
    }
}

/// All messages of a topic.
fn messages(mcap: &[u8], topic: &str) -> Vec<Value> {
    let all = mcap::MessageStream::new(mcap).unwrap().map(Result::unwrap);
    all.filter(|message| message.channel.topic == topic)
        .map(|message| serde_json::from_slice(&message.data).unwrap())
        .collect()
}

#[test]
fn what_is_not_understood_is_kept_as_it_came() {
    let more = "<GPIO 01=\"1\" 02=\"0\"/><MACur A1=\"0.1143\"/><BMode>3</BMode><GPIO 01=\"2\"/><Delay";
    let mut capture = Capture::default();
    for nth in 0..10 {
        let at_ns = BEGIN_NS + nth as i64 * CYCLE_NS;
        let frame = String::from_utf8(rob(1000 + 4 * nth, POSE, POSE)).unwrap().replace("<Delay", more);
        capture.udp(at_ns, ROBOT, PC, frame.as_bytes());
        let reply = String::from_utf8(sen(1000 + 4 * nth, 0.0, 0.0)).unwrap();
        let reply = reply.replace("<IPOC", "<AKorr A1=\"0.25\"/><EStr>hold</EStr><IPOC");
        capture.udp(at_ns + 500_000, PC, ROBOT, reply.as_bytes());
        capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &rdt(nth as u32 + 1, 28 * nth as u32, [0.0, 0.0, 1.0]));
    }
    // A reply to no frame.
    capture.udp(BEGIN_NS + 10 * CYCLE_NS, PC, ROBOT, &sen(7016, 0.0, 0.0));
    let (_, _, bytes) = imported(&mut capture, "absolute");
    let raw = messages(&bytes, "/rsi/chaser");
    let elements = |nth: usize| raw[nth]["elements"].clone();
    let wanted = serde_json::json!({
        "GPIO.01": "1", "GPIO.02": "0", "GPIO.01#2": "2", "MACur.A1": "0.1143", "BMode": "3",
        "RSol.X": "0.000000000", "RSol.Y": "0.000000000", "RSol.Z": "992.000000000",
        "RSol.A": "0.000000000", "RSol.B": "0.000000000", "RSol.C": "0.000000000",
    });
    assert_eq!(elements(0), wanted);
    assert_eq!(elements(1), serde_json::json!({ "AKorr.A1": "0.25", "EStr": "hold" }));
    assert_eq!((&raw[1]["type"], &raw[1]["ipoc"]), (&"ImFree".into(), &1000.into()));
    let event = &messages(&bytes, "/cell/event");
    let text = event.iter().find(|event| event["class"] == "reply-unmatched").unwrap()["text"].as_str().unwrap();
    assert_eq!(text, "the reply with IPOC 7016 commands nothing");
}

#[test]
fn a_comma_in_a_pose_is_not_said_to_be_no_pose() {
    let mut capture = Capture::default();
    for nth in 0..50 {
        let at_ns = BEGIN_NS + nth as i64 * CYCLE_NS;
        let frame = String::from_utf8(rob(1000 + 4 * nth, POSE, POSE)).unwrap().replace("Z=\"992.", "Z=\"992,");
        capture.udp(at_ns, ROBOT, PC, frame.as_bytes());
        capture.udp(at_ns + 500_000, PC, ROBOT, &sen(1000 + 4 * nth, 0.0, 0.0));
    }
    let shell = Shell::new();
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let ran =
        shell.run(&["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "free-flight", "-o", "DIR/s.mcap"]);
    let err = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    assert!(ran.exit == 2 && err.contains("RIst of the frames is no six numbers"), "{err}");
    for class in ["50 × pose-unreadable (chaser)", "50 × command-without-pose (chaser)"] {
        assert!(ran.out.contains(class), "{class}: {}", ran.out);
    }
    assert!(!ran.out.contains("absent"), "{}", ran.out);
}
