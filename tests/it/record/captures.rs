//! What is wrong with a capture is named, and what others ask the sensor for is kept.

use super::import::{PC, ROBOT, SENSOR, SENSOR_CLIENT};
use super::wire::{Capture, rdt, rob, sen};
use crate::shell::{Ran, Shell};

const BEGIN_NS: i64 = 1_700_000_000_000_000_000;
const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];

/// A second of traffic that begins there.
fn second(begin_ns: i64, first: u64) -> Capture {
    let mut capture = Capture::default();
    for nth in first..first + 250 {
        let at_ns = begin_ns + (nth - first) as i64 * 4_000_000;
        capture.udp(at_ns, ROBOT, PC, &rob(1000 + 4 * nth, POSE, POSE));
        capture.udp(at_ns + 400_000, PC, ROBOT, &sen(1000 + 4 * nth, 0.0, 0.0));
        capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &rdt(nth as u32 + 1, 28 * nth as u32, [0.0, 0.0, 1.0]));
    }
    capture
}

fn import(shell: &Shell, pcap: &[u8]) -> Ran {
    std::fs::write(shell.path("c.pcap"), pcap).unwrap();
    let words =
        ["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "free-flight", "--force", "-o", "DIR/s.mcap"];
    let mut ran = shell.run(&words);
    ran.err = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    ran
}

#[test]
fn a_capture_whose_times_go_back_ends_there() {
    let shell = Shell::new();
    let before = second(BEGIN_NS, 0).pcap();
    let after = second(BEGIN_NS - 3_600_000_000_000, 250).pcap();
    // The second file without its header.
    let ran = import(&shell, &[&before, &after[24..]].concat());
    assert_eq!(ran.exit, 2, "{}", ran.err);
    let what = "the times of the capture go back by 3600.996 s, 0.996 s after its beginning";
    assert!(ran.err.contains(what) && !ran.err.contains("times as fast"), "{}", ran.err);
    assert!(ran.out.contains("chaser: 250 frames, 250 replies"), "what came before is kept: {}", ran.out);
}

#[test]
fn a_capture_of_one_direction_says_which() {
    let shell = Shell::new();
    let mut capture = Capture::default();
    for nth in 0..1000_u64 {
        capture.udp(BEGIN_NS + nth as i64 * 4_000_000, PC, ROBOT, &sen(1000 + 4 * nth, 0.0, 0.0));
    }
    let ran = import(&shell, &capture.pcap());
    let what = "of the cell the capture has 1000 replies of the PC to the robots, and nothing that its robots";
    assert!(ran.exit == 2 && ran.err.contains(what) && ran.err.contains("both directions"), "{}", ran.err);
}

#[test]
fn packets_that_cannot_be_read_are_the_reason() {
    let shell = Shell::new();
    let mut capture = second(BEGIN_NS, 0);
    let ran = import(&shell, &capture.pcap_of(60));
    let what = "no packet of the capture can be used; 750 packets of which the capture kept only the beginning";
    assert!(ran.exit == 2 && ran.err.contains(what) && !ran.err.contains("correct `listen`"), "{}", ran.err);
    // A sensor's records are short enough, and a robot's documents are not.
    let ran = import(&shell, &capture.pcap_of(96));
    let what = "; 500 packets of which the capture kept only the beginning; capture with a snapshot length of 0";
    assert!(ran.exit == 4 && ran.err.contains(what), "{}", ran.err);
    capture.fragment();
    let ran = import(&shell, &capture.pcap());
    let what = "no packet of the capture can be used; 750 IP fragments, which are not put together";
    assert!(ran.exit == 2 && ran.err.contains(what), "{}", ran.err);
}

#[test]
fn what_the_sensor_is_asked_for_is_recorded() {
    let shell = Shell::new();
    let mut capture = second(BEGIN_NS, 0);
    let ask = |command: u8| [0x12, 0x34, 0, command, 0, 0, 0, 0];
    for (at_ns, command) in
        [(-2_000_000, 0x42), (-1_000_000, 2), (500_000_000, 0x41), (600_000_000, 0x42), (999_000_000, 0)]
    {
        capture.udp(BEGIN_NS + at_ns, SENSOR_CLIENT, SENSOR, &ask(command));
    }
    // READFT that sets the bias, on the connection beside.
    let mut request = [0; 20];
    request[19] = 1;
    capture.tcp(BEGIN_NS + 700_000_000, SENSOR_CLIENT, "127.0.0.1:49151", &request);
    let ran = import(&shell, &capture.pcap());
    assert_eq!(ran.exit, 0, "{}", ran.err);
    for event in ["3 × ft-bias-set (ft)", "1 × ft-latch-reset (ft)", "1 × ft-start (ft)", "1 × ft-stop (ft)"] {
        assert!(ran.out.contains(event), "{event}: {}", ran.out);
    }
    // One was before the first reading.
    assert!(ran.err.contains("warning: the sensor's zero was moved while it was recorded, 2 ×"), "{}", ran.err);
}
