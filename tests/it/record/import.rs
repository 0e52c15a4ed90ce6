//! Captures become sessions: the same numbers at the same times as what was on the wire.

use super::wire::{Capture, bench, rdt, rob, sen};
use crate::shell::Shell;
use harness::model::Model;
use harness::recording::{Pose, ReadOptions, Session, read};
use harness::simulate::{self, LEARN};
use sim_core::effects::standard;
use sim_core::rng::Streams;

pub const ROBOT: &str = "127.0.0.1:60000";
pub const PC: &str = "127.0.0.1:49152";
pub const SENSOR: &str = "127.0.0.1:49153";
pub const SENSOR_CLIENT: &str = "127.0.0.1:60001";
/// Least delays of the two wires, and how much jitter comes on top.
const ROBOT_NS: i64 = 200_000;
const SENSOR_NS: i64 = 90_000;
const JITTER_NS: f64 = 600_000.0;

/// An impact of the bench's model.
pub fn impact() -> Session {
    let cell = bench();
    let model = Model::parse("m.toml", &cell.model.text, &standard()).unwrap();
    simulate::cell(&model, &[], &LEARN[..1], 7).remove(0)
}

/// The tool in BASE, in mm and deg: BASE stands at -1.2 m and the tip 0.2 m before the tool, both along z.
fn tool(pose: &Pose) -> [f64; 6] {
    let [x, _, _, w] = pose.orientation_xyzw;
    let c_deg = 2.0 * libm::atan2(x, w).to_degrees();
    [0.0, 0.0, (pose.position_m[2] + 1.0) * 1e3, 0.0, 0.0, c_deg]
}

/// Its traffic.
pub fn capture(session: &Session) -> Capture {
    let mut capture = Capture::default();
    let mut jitter = Streams::new(3).named("jitter");
    let mut late = |least_ns: i64, nth: usize| {
        // Every hundredth packet is as fast as can be.
        let more = if nth % 100 == 50 { 0.0 } else { jitter.uniform() * JITTER_NS };
        least_ns + more as i64
    };
    let (commanded, measured) = (session.commanded.as_ref().unwrap(), session.measured.as_ref().unwrap());
    let start = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
    for (nth, (time_ns, pose)) in measured.time_ns.iter().zip(&measured.value).enumerate() {
        let ipoc = 4_294_967_000 + 4 * nth as u64;
        let at_ns = session.start_ns + time_ns + late(ROBOT_NS, nth);
        capture.udp(at_ns, ROBOT, PC, &rob(ipoc % (1 << 32), tool(pose), start));
        let [_, _, z_mm, _, _, c_deg] = tool(&commanded.value[nth]);
        capture.udp(at_ns + 150_000, PC, ROBOT, &sen(ipoc % (1 << 32), z_mm - 992.0, c_deg));
    }
    let sensed = session.sensed.as_ref().unwrap();
    for (nth, (time_ns, wrench)) in sensed.time_ns.iter().zip(&sensed.value).enumerate() {
        let at_ns = session.start_ns + time_ns + late(SENSOR_NS, nth);
        let nth = nth as u32;
        let sample = (u32::MAX - 3000).wrapping_add(7 * nth);
        capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &rdt(nth + 1, sample, wrench.force_n));
    }
    capture
}

fn import(shell: &Shell, capture: &mut Capture, name: &str) -> Session {
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let output = format!("DIR/{name}");
    let ran = shell.run(&["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "impact", "-o", &output]);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    read(&shell.path(name), &ReadOptions::default()).unwrap()
}

#[test]
fn a_capture_gives_the_session_that_was_on_the_wire() {
    let (shell, truth) = (Shell::new(), impact());
    let session = import(&shell, &mut capture(&truth), "s.mcap");
    for (series, truth) in [(&session.measured, &truth.measured), (&session.commanded, &truth.commanded)] {
        let (series, truth) = (series.as_ref().unwrap(), truth.as_ref().unwrap());
        assert_eq!(series.value.len(), truth.value.len());
        for (pose, truth) in series.value.iter().zip(&truth.value) {
            // Nine decimals of a millimetre, once in RIst, twice in a command.
            assert!((pose.position_m[2] - truth.position_m[2]).abs() < 2e-12, "{pose:?} {truth:?}");
            assert!(pose.position_m[..2].iter().all(|across| across.abs() < 1e-15));
        }
        // The reconstructed times are those of the controller's clock, to the rounding of one line.
        let off = |nth: usize| session.start_ns + series.time_ns[nth] - truth.time_ns[nth];
        let delays: Vec<i64> = (0..truth.time_ns.len()).map(|nth| off(nth) - off(0)).collect();
        assert!(delays.iter().all(|delay| delay.abs() <= 1), "{:?}", delays.iter().max());
    }
    let (sensed, wanted) = (session.sensed.as_ref().unwrap(), truth.sensed.as_ref().unwrap());
    assert_eq!(sensed.value.len(), wanted.value.len());
    for (wrench, truth) in sensed.value.iter().zip(&wanted.value) {
        // Half a count of a millionth of a newton.
        assert!((0..3).all(|axis| (wrench.force_n[axis] - truth.force_n[axis]).abs() <= 0.5001e-6), "{wrench:?}");
    }
    // Of both wires the least delay remains: it cannot be told from an offset.
    let offset = |recorded: i64, true_ns: i64| session.start_ns + recorded - truth.start_ns - true_ns;
    let robot_ns = offset(session.measured.as_ref().unwrap().time_ns[0], truth.measured.as_ref().unwrap().time_ns[0]);
    assert!((robot_ns - ROBOT_NS).abs() <= 1, "{robot_ns}");
    let sensor_ns = offset(sensed.time_ns[0], wanted.time_ns[0]);
    assert!((sensor_ns - SENSOR_NS).abs() <= 1, "{sensor_ns}");
    assert_eq!(session.believed.get("cell").map(String::as_str), Some("bench"));
    // Nine decimals of a millimetre: the step to which the bench's commands are rounded.
    let quantum_m: f64 = session.believed["command_quantum_m"].parse().unwrap();
    assert!((quantum_m - 1e-12).abs() < 1e-27, "{quantum_m}");
}

#[test]
fn an_imported_session_is_compared_with_no_extra_step() {
    let (shell, truth) = (Shell::new(), impact());
    import(&shell, &mut capture(&truth), "s.mcap");
    let made = shell.run(&["model", "init", "DIR/s.mcap", "-o", "DIR/m.toml"]);
    assert_eq!((made.exit, made.err.as_str()), (0, ""));
    let ran = shell.run(&["compare", "--model", "DIR/m.toml", "DIR/s.mcap"]);
    assert!(ran.exit < 2, "{}{}", ran.out, ran.err);
}

#[test]
fn what_is_in_the_way_is_said() {
    let (shell, truth) = (Shell::new(), impact());
    let mut capture = capture(&truth);
    // A second controller would be one more; a browser is none of the cell's business.
    capture.udp(truth.start_ns, "10.0.0.1:500", "10.0.0.9:53", b"?");
    capture.udp(truth.start_ns + 5_000_000, ROBOT, PC, b"<Rob Type=\"KUKA\"><RIst X=\"1,5\"");
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let typed = ["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "impact", "-o", "DIR/s.mcap"];
    let ran = shell.run(&typed);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    assert!(ran.out.contains("1 × rsi-malformed (chaser)"), "{}", ran.out);
    assert!(ran.out.contains("rsi-wrap"), "the stamp passed 2^32: {}", ran.out);
    // A second time it would be replaced.
    let again = shell.run(&typed);
    assert_eq!(again.exit, 2);
    assert!(again.err.contains("exists already"), "{}", again.err);
    assert_eq!(shell.names(), ["c.pcap", "s.mcap"]);
    let mut foreign = Capture::default();
    foreign.udp(truth.start_ns, "10.0.0.1:500", "10.0.0.9:53", b"?");
    std::fs::write(shell.path("c.pcap"), foreign.pcap()).unwrap();
    let ran = shell.run(&["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "impact", "-o", "DIR/t.mcap"]);
    assert_eq!(ran.exit, 2);
    let what = "DIR/c.pcap: no packet of the capture belongs to the cell; it has 1 packet UDP to 10.0.0.9:53";
    assert!(ran.err.replace("\n  │ ", " ").contains(what), "{}", ran.err);
    std::fs::write(shell.path("c.pcap"), b"not a capture").unwrap();
    let ran = shell.run(&["import", "pcap", "DIR/c.pcap", "--cell", "bench", "--kind", "impact", "-o", "DIR/t.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("neither pcap nor pcapng"), "{}", ran.err);
    assert_eq!(shell.names(), ["c.pcap", "s.mcap"], "nothing is left beside");
}

#[test]
fn a_tap_reads_the_same_capture_as_it_comes() {
    let (shell, truth) = (Shell::new(), impact());
    std::fs::write(shell.path("c.pcap"), capture(&truth).pcap()).unwrap();
    let ran = shell.run(&[
        "record",
        "--as",
        "tap",
        "--pcap",
        "DIR/c.pcap",
        "--cell",
        "bench",
        "--kind",
        "impact",
        "-o",
        "DIR/t.mcap",
    ]);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    let session = read(&shell.path("t.mcap"), &ReadOptions::default()).unwrap();
    let (measured, truth) = (session.measured.as_ref().unwrap(), truth.measured.as_ref().unwrap());
    assert_eq!(measured.value.len(), truth.value.len());
    // Times are made from what is known by then: late by some jitter at first, exact once the fastest packet has come.
    let late = |nth: usize| session.start_ns + measured.time_ns[nth] - truth.time_ns[nth];
    let last = measured.value.len() - 1;
    assert!((0..last).all(|nth| late(nth) - late(last) <= JITTER_NS as i64));
    assert!((51..last).all(|nth| (late(nth) - late(last)).abs() <= 1), "the fast packet is the 50th");
}

/// Two robots with clocks of their own; the one with the nozzle moves at 0.1 m/s along z, the one with the probe stands.
#[test]
fn two_robots_are_put_together_at_the_times_of_the_probe() {
    let shell = Shell::new();
    let text = bench().source.text;
    let second = "\n[[robot]]\nname = \"target\"\ncarries = \"nozzle\"\nrsi = \"rsi/target.xml\"\nlisten = \"127.0.0.1:49154\"\n\
                  rail = { axis = \"E1\", direction = [0.0, 0.0, 1.0] }\n";
    for (name, text) in [
        ("cell.toml", format!("{text}{second}")),
        ("models/bench.toml", bench().model.text),
        ("rsi/bench.xml", bench().rsi[0].text.clone()),
        ("rsi/target.xml", bench().rsi[0].text.replace("49152", "49154")),
    ] {
        let path = shell.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let start_ns = 1_700_000_000_000_000_000;
    let mut capture = Capture::default();
    let still = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
    for nth in 0..500_u64 {
        let tick_ns = start_ns + nth as i64 * 4_000_000;
        capture.udp(tick_ns, ROBOT, PC, &rob(1000 + 4 * nth, still, still));
        capture.udp(tick_ns + 100_000, PC, ROBOT, &sen(1000 + 4 * nth, 0.0, 0.0));
        // 1.3 ms later; 0.1 m/s is 0.4 mm in a cycle: half of it by the robot, half by its rail.
        let half_mm = 0.2 * nth as f64;
        let frame = String::from_utf8(rob(77 + 4 * nth, [0.0, 0.0, half_mm, 0.0, 0.0, 0.0], [0.0; 6])).unwrap();
        let rail = format!("<EIPos E1=\"{half_mm:.6}\" E2=\"0\" E3=\"0\" E4=\"0\" E5=\"0\" E6=\"0\"/><Delay");
        capture.udp(
            tick_ns + 1_300_000,
            "127.0.0.1:60002",
            "127.0.0.1:49154",
            frame.replace("<Delay", &rail).as_bytes(),
        );
        for fourth in 0..4_u32 {
            let count = nth as u32 * 4 + fourth;
            let at_ns = tick_ns + i64::from(fourth) * 1_000_000;
            capture.udp(at_ns, SENSOR, SENSOR_CLIENT, &rdt(count + 1, 7 * count, [0.0, 0.0, 1.0]));
        }
    }
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let ran = shell.run(&[
        "import",
        "pcap",
        "DIR/c.pcap",
        "--cell",
        "DIR/cell.toml",
        "--kind",
        "free-flight",
        "-o",
        "DIR/s.mcap",
    ]);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    let session = read(&shell.path("s.mcap"), &ReadOptions::default()).unwrap();
    let measured = session.measured.unwrap();
    // The first sample comes before the other robot's first.
    assert_eq!(measured.value.len(), 499);
    for (time_ns, pose) in measured.time_ns.iter().zip(&measured.value) {
        let since_s = (session.start_ns + time_ns - start_ns) as f64 * 1e-9;
        let nozzle_m = 0.1 * (since_s - 0.0013);
        // Nanoseconds at 0.1 m/s, and nine decimals of a millimetre.
        assert!((pose.position_m[2] - (-0.008 - nozzle_m)).abs() < 1e-9, "{since_s} {pose:?}");
    }
    // Nobody corrects the target: it is commanded to be where it is, and the chaser stands as it is told.
    let commanded = session.commanded.unwrap();
    assert_eq!(commanded.time_ns, measured.time_ns);
    for (told, seen) in commanded.value.iter().zip(&measured.value) {
        assert!((told.position_m[2] - seen.position_m[2]).abs() < 1e-12, "{told:?} {seen:?}");
    }
}
