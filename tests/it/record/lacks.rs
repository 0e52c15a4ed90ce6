//! What a recording lacks is said, with what to do about it, and the exit code says that it cannot be used.

use super::import::{PC, ROBOT, SENSOR, SENSOR_CLIENT, capture, impact};
use super::wire::{Capture, files, rdt, rob, sen};
use crate::shell::{Ran, Shell};
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

const BEGIN_NS: i64 = 1_700_000_000_000_000_000;
const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];

/// Frames every so many ns, answered or not; readings of so many bytes, or none.
fn traffic(every_ns: i64, frames: u64, is_answered: bool, reading: Option<usize>) -> Capture {
    let mut capture = Capture::default();
    for nth in 0..frames {
        let at_ns = BEGIN_NS + nth as i64 * every_ns;
        capture.udp(at_ns, ROBOT, PC, &rob(1000 + 4 * nth, POSE, POSE));
        if is_answered {
            capture.udp(at_ns + every_ns / 10, PC, ROBOT, &sen(1000 + 4 * nth, 0.0, 0.0));
        }
        readings(&mut capture, at_ns, nth as u32, reading);
    }
    capture
}

fn readings(capture: &mut Capture, at_ns: i64, nth: u32, length: Option<usize>) {
    let Some(length) = length else { return };
    let mut bytes = rdt(nth + 1, 28 * nth, [0.0, 0.0, 1.0]);
    bytes.resize(length, 0);
    capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &bytes);
}

fn import(shell: &Shell, pcap: &[u8], more: &[&str]) -> Ran {
    std::fs::write(shell.path("c.pcap"), pcap).unwrap();
    let words =
        ["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "free-flight", "--force", "-o", "DIR/s.mcap"];
    let mut ran = shell.run(&[&words[..], more].concat());
    ran.err = flat(&ran.err);
    ran
}

/// A message without its line breaks.
fn flat(text: &str) -> String {
    text.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

#[test]
fn a_capture_that_cannot_be_used_says_why() {
    let shell = Shell::new();
    let ran = import(&shell, &traffic(4_000_000, 250, true, Some(36)).pcap(), &[]);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    let cases = [
        (traffic(4_000_000, 250, true, None), 2, "no packet from 127.0.0.1:49153, the address of the sensor"),
        (
            traffic(4_000_000, 250, true, Some(24)),
            2,
            "from 127.0.0.1:49153 came 250 of 24 bytes; the first is not a record",
        ),
        (traffic(4_000_000, 250, false, Some(36)), 0, ""),
    ];
    for (mut capture, exit, what) in cases {
        let ran = import(&shell, &capture.pcap(), &[]);
        if what.is_empty() {
            // One direction alone: nothing is commanded.
            assert!(ran.exit == 2 && ran.err.contains("no reply of the PC is in the capture"), "{}", ran.err);
            continue;
        }
        assert_eq!(ran.exit, exit, "{}", ran.err);
        assert!(ran.err.contains(what) && ran.err.contains("cannot use it"), "{}", ran.err);
        assert!(shell.path("s.mcap").exists(), "the robot's data are kept");
    }
    let mut alone = Capture::default();
    (0..500).for_each(|nth| readings(&mut alone, BEGIN_NS + i64::from(nth) * 4_000_000, nth, Some(36)));
    let ran = import(&shell, &alone.pcap(), &[]);
    assert!(ran.exit == 4 && ran.err.contains("500 readings of the sensor, but no packet to or from"), "{}", ran.err);
}

#[test]
fn a_capture_of_virtual_time_is_refused() {
    let shell = Shell::new();
    // Four seconds of the robot's clock in a tenth of one of the computer's.
    let ran = import(&shell, &traffic(100_000, 1000, true, Some(36)).pcap(), &[]);
    assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{}", ran.err);
    assert!(
        ran.err.contains("robot chaser: the robot's clock runs 40 times as fast as this computer's"),
        "{}",
        ran.err
    );
    assert!(ran.err.contains("dockhil cell --real-time"), "{}", ran.err);
    assert_eq!(shell.names(), ["c.pcap"]);
    // One that is slower is kept, and not trusted.
    let ran = import(&shell, &traffic(8_000_000, 500, true, Some(36)).pcap(), &[]);
    assert!(ran.exit == 2 && ran.err.contains("runs 0.50 times as fast"), "{}", ran.err);
    assert!(shell.path("s.mcap").exists());
}

#[test]
fn a_cut_capture_is_told_also_in_json() {
    let shell = Shell::new();
    let pcap = capture(&impact()).pcap();
    let ran = import(&shell, &pcap[..pcap.len() - 9], &["--json", "-"]);
    assert_eq!(ran.exit, 2, "{}", ran.err);
    assert!(ran.err.contains("the capture ends early: "), "{}", ran.err);
    let answer: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert!(answer["capture"]["ends_early"].as_str().is_some_and(|why| why.contains("ends")), "{answer}");
    let devices: Vec<&str> =
        answer["clocks"].as_array().unwrap().iter().filter_map(|one| one["device"].as_str()).collect();
    assert_eq!(devices, ["chaser", "ft"]);
}

#[test]
fn many_sessions_of_a_robot_are_one_line() {
    let shell = Shell::new();
    let mut capture = Capture::default();
    for nth in 0..600_u64 {
        let at_ns = BEGIN_NS + nth as i64 * 4_000_000;
        // Every fourth frame the stamp leaps by hours.
        capture.udp(at_ns, ROBOT, PC, &rob(1000 + 4 * nth + nth / 4 * 10_000_000, POSE, POSE));
        readings(&mut capture, at_ns, nth as u32, Some(36));
    }
    let ran = import(&shell, &capture.pcap(), &[]);
    assert!(ran.out.contains("150 RSI sessions"), "{}", ran.out);
    assert_eq!(ran.out.matches("clock of chaser").count(), 1, "{}", ran.out);
}

#[test]
fn what_holds_no_data_is_removed_and_the_capture_is_named() {
    let shell = Shell::new();
    let mut foreign = Capture::default();
    foreign.udp(BEGIN_NS, "10.0.0.1:500", "10.0.0.9:53", b"?");
    let tap =
        ["record", "--as", "tap", "--pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "impact", "-o", "DIR/s.mcap"];
    for (bytes, exit) in [(foreign.pcap(), 4), (b"not a capture".to_vec(), 2)] {
        std::fs::write(shell.path("c.pcap"), bytes).unwrap();
        let ran = shell.run(&tap);
        assert_eq!(ran.exit, exit, "{}", ran.err);
        assert!(ran.err.contains("DIR/c.pcap: ") && !ran.err.contains("s.mcap"), "{}", ran.err);
        assert_eq!(shell.names(), ["c.pcap"]);
    }
    // A peer that nobody spoke to.
    let port = |name: &str| format!("127.0.0.1:{}", if name == "a" { 0 } else { 1 });
    files(
        &shell,
        |text| text.replace("127.0.0.1:49152", &port("a")).replace("127.0.0.1:49153", &port("b")),
        |text| text,
    );
    let ran = shell.run(&[
        "record",
        "--cell",
        "DIR/cell.toml",
        "--kind",
        "impact",
        "--duration-s",
        "0.1",
        "-o",
        "DIR/t.mcap",
    ]);
    assert!(ran.exit == 4 && ran.err.contains("no frame of a robot came"), "{}", ran.err);
    assert!(!shell.path("t.mcap").exists());
    // What holds data stays until it is overwritten.
    std::fs::write(shell.path("c.pcap"), capture(&impact()).pcap()).unwrap();
    assert_eq!(shell.run(&tap).exit, 0);
    let ran = shell.run(&tap);
    assert!(ran.exit == 2 && ran.err.contains("exists already") && ran.err.contains("--force"), "{}", ran.err);
    assert_eq!(shell.run(&[&tap[..], &["--force"]].concat()).exit, 0);
    let onto = [
        "record",
        "--as",
        "tap",
        "--pcap",
        "DIR/c.pcap",
        "--cell",
        "bench",
        "--kind",
        "impact",
        "--force",
        "-o",
        "DIR/c.pcap",
    ];
    let ran = shell.run(&onto);
    assert!(ran.exit == 2 && ran.err.contains("is read by this command"), "{}", ran.err);
}

#[test]
fn what_does_not_go_together_is_refused_or_told() {
    let shell = Shell::new();
    let record = ["record", "--cell", "DIR/cell.toml", "--kind", "impact", "--duration-s", "0.1", "-o", "DIR/s.mcap"];
    let any = |text: String| text.replace("127.0.0.1:49152", "127.0.0.1:0");
    let cases: [(&str, &str, &str); 2] = [
        ("DEF_RIst", "DEF_AIPos", "SEND has no DEF_RIst"),
        ("<SENTYPE>", "<PROTOCOL>TCP</PROTOCOL><SENTYPE>", "says TCP, and only a KRC2 speaks it"),
    ];
    for (from, to, what) in cases {
        files(&shell, any, |text| text.replace(from, to));
        let ran = shell.run(&record);
        assert!(ran.exit == 2 && flat(&ran.err).contains(what), "{}", ran.err);
        assert!(!shell.path("s.mcap").exists());
    }
    // A virtual cell does not know the arm.
    files(&shell, |text| text.replace("\"RKorr\"", "\"AK\""), |text| text.replace("RKorr.X", "AK.A1"));
    let ran = shell.run(&["cell", "--cell", "DIR/cell.toml"]);
    let what = "corrections of axes cannot be used here: it receives AK, RKorr";
    assert!(ran.exit == 2 && flat(&ran.err).contains(what), "{}", ran.err);
    files(&shell, |text| text, |text| text);
    let ran = shell.run(&[&record[..], &["--as", "proxy", "--robot-side", "0.0.0.0:49152"]].concat());
    assert!(ran.exit == 2 && flat(&ran.err).contains("the proxy would send to itself"), "{}", ran.err);
    // The controller would send to the port of its own file.
    files(&shell, |text| text, |text| text.replace("49152", "49999").replace("DEF_Delay", "DEF_MACur"));
    std::fs::write(shell.path("c.pcap"), traffic(4_000_000, 250, true, Some(36)).pcap()).unwrap();
    let tap = [
        "record",
        "--as",
        "tap",
        "--pcap",
        "DIR/c.pcap",
        "--cell",
        "DIR/cell.toml",
        "--kind",
        "impact",
        "-o",
        "DIR/s.mcap",
    ];
    let ran = shell.run(&tap);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    for part in ["warning: robot chaser: ", "without DEF_Delay in SEND", "port 49999"] {
        assert!(ran.err.contains(part), "{part}: {}", ran.err);
    }
    let session = harness::recording::read(&shell.path("s.mcap"), &harness::recording::ReadOptions::default()).unwrap();
    assert!(session.believed["remark_2"].contains("port 49999"), "{:?}", session.believed);
}

/// The bench at free ports: the command's words, where the robot speaks to, and the sensor.
fn live(shell: &Shell) -> (SocketAddr, UdpSocket) {
    let listen = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
    let at = |text: String| {
        let text = text.replace("127.0.0.1:49152", &listen.to_string());
        text.replace("127.0.0.1:49153", &sensor.local_addr().unwrap().to_string())
    };
    files(shell, at, |text| text.replace("49152", &listen.port().to_string()));
    (listen, sensor)
}

/// A robot whose stamp goes on by so many ms, after so long; how many frames were answered.
fn robot(listen: SocketAddr, step_ms: u64, pause: Duration) -> u64 {
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    robot.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let (mut buffer, mut nth, mut silent) = ([0; 2048], 0, 0);
    // Nobody is there before the command runs, and nobody after it has ended.
    while silent < 200 && (nth == 0 || silent < 5) {
        robot.send_to(&rob(1000 + step_ms * nth, POSE, POSE), listen).unwrap();
        match robot.recv(&mut buffer) {
            Ok(_) => (nth, silent) = (nth + 1, 0),
            Err(_) => {
                // A closed port answers at once.
                std::thread::sleep(Duration::from_millis(20));
                silent += 1;
            }
        }
        std::thread::sleep(pause);
    }
    nth
}

/// It goes on at once when it has its answer, whatever time its stamp says, as a virtual cell does.
#[test]
fn a_peer_of_a_cell_in_virtual_time_ends_with_an_error() {
    let shell = Shell::new();
    let (listen, _sensor) = live(&shell);
    let robot = std::thread::spawn(move || robot(listen, 400, Duration::ZERO));
    let record = ["record", "--cell", "DIR/cell.toml", "--kind", "impact", "-o", "DIR/s.mcap"];
    let ran = shell.run(&[&record[..], &["--duration-s", "30"]].concat());
    let answered = robot.join().unwrap();
    assert!(answered > 5, "{answered}");
    let err = flat(&ran.err);
    assert!(ran.exit == 2 && err.contains("times as fast as this computer's"), "{err}");
    assert!(!shell.path("s.mcap").exists());
}

#[test]
fn a_sensor_that_says_nothing_is_an_error_and_the_robot_is_kept() {
    for length in [0, 24] {
        let shell = Shell::new();
        let (listen, sensor) = live(&shell);
        let at = sensor.local_addr().unwrap();
        let robot = std::thread::spawn(move || robot(listen, 4, Duration::from_millis(3)));
        // It answers each start with something, or not at all.
        let sensor = std::thread::spawn(move || {
            sensor.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
            let mut buffer = [0; 64];
            loop {
                let (_, client) = sensor.recv_from(&mut buffer).unwrap();
                if buffer[..4] == [0x12, 0x34, 0, 0] {
                    return;
                }
                if length > 0 {
                    sensor.send_to(&buffer[..length], client).unwrap();
                }
            }
        });
        let record = ["record", "--cell", "DIR/cell.toml", "--kind", "static", "-o", "DIR/s.mcap"];
        let ran = shell.run(&[&record[..], &["--duration-s", "1"]].concat());
        assert!(robot.join().unwrap() > 5);
        sensor.join().unwrap();
        let err = flat(&ran.err);
        let what = if length > 0 {
            format!("no reading of the sensor: from {at} came ")
        } else {
            format!("no reading of the sensor: nothing came from the sensor at {at}")
        };
        assert!(ran.exit == 2 && err.contains(&what), "{err}");
        assert!(length == 0 || err.contains("of 24 bytes") && err.contains("rdt has datagrams of 36 bytes"), "{err}");
        assert!(shell.path("s.mcap").exists());
    }
}
