//! A controller that shares nothing with this code, in Python straight from the protocol's pages, against the virtual cell.
//!
//! Without Python the tests are skipped, and say so. The short form has 1,000 cycles, `DOCKHIL_FULL=1` has 10,000. The clients
//! that others have published run where `tests/foreign/third_party.sh` has installed them and says so in `DOCKHIL_THIRD_PARTY`.

use crate::shell::Shell;
use harness::cell::run::{Options, Ran, run};
use harness::cell::wires::{Addresses, Pace, Wires};
use harness::cell::{Cell, process::Started};
use serde_json::Value;
use sim_core::effects::standard;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// How long a Python that starts on a loaded machine may take, and how long an answer.
const GENEROUS: Duration = Duration::from_secs(60);

fn cycles() -> u64 {
    if std::env::var("DOCKHIL_FULL").is_ok_and(|value| value == "1") { 10_000 } else { 1000 }
}

/// Whether the test can run; says so if not.
fn has_python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        println!("skipped: python3 is missing");
    }
    found
}

fn script(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("foreign").join(name).display().to_string()
}

/// A port of loopback that was free a moment ago: the program must bind it before the cell can know it.
fn free() -> SocketAddr {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    socket.local_addr().expect("it is bound")
}

fn wires(robot: SocketAddr) -> Wires {
    let addresses = Addresses { robots: vec![robot], sensor: "127.0.0.1:0".parse().unwrap(), page: None };
    let cell = Cell::find(Path::new("bench")).unwrap();
    Wires::bind(&cell, &addresses, Pace::Virtual { patience: GENEROUS }, GENEROUS).expect("free ports")
}

fn start(words: &[&str]) -> Started {
    let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
    Started::start(&words).expect("python3 starts")
}

fn ran(wires: &mut Wires, cycles: u64) -> Ran {
    let cell = Cell::find(Path::new("bench")).expect("a cell of the program");
    let options = Options { duration_s: cycles as f64 * cell.config.time.cycle_s, keeps: true };
    run(&cell, &standard(), &options, wires).expect("the wires hold")
}

/// The summary in the last line of what a client printed.
fn summary(client: Started) -> Value {
    let ended = client.stop(GENEROUS);
    let line = ended.output.lines().last().unwrap_or_default().to_owned();
    assert_eq!((ended.code, ended.was_stopped), (Some(0), false), "{}", ended.output);
    serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {}", ended.output))
}

/// The cell begins when the sensor is asked, and a frame to a port that nobody has bound yet would end it. The kernel's own table
/// is read, since a datagram to find out would be a frame to the client.
fn until_bound(robot: SocketAddr) {
    let port = format!(":{:04X}", robot.port());
    for _ in 0..3000 {
        let table = std::fs::read_to_string("/proc/net/udp").expect("Linux lists its UDP ports");
        if table.lines().filter_map(|line| line.split_whitespace().nth(1)).any(|local| local.ends_with(&port)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("nobody has bound {robot} within a minute");
}

fn controlled(arguments: &[&str]) -> (Ran, Value) {
    let robot = free();
    let mut wires = wires(robot);
    let (rsi, ft, count) = (robot.to_string(), wires.sensor().to_string(), cycles().to_string());
    let script = script("controller.py");
    let mut words = vec!["python3", &script, "--rsi", &rsi, "--ft", &ft, "--cycles", &count];
    words.extend_from_slice(arguments);
    wires.watch(start(&words));
    let ran = ran(&mut wires, cycles());
    let client = wires.release().expect("it was watched");
    (ran, summary(client))
}

/// What both sides say of the exchange.
fn check_exchange(ran: &Ran, rsi: &Value) {
    let cycles = cycles();
    assert_eq!((ran.cycles, ran.answered), (cycles, cycles));
    assert_eq!(ran.stops, []);
    for (name, expected) in [("cycles", cycles), ("gaps", 0), ("duplicates", 0), ("malformed", 0), ("late", 0)] {
        assert_eq!(rsi[name], expected, "{name}: {rsi}");
    }
    let first = rsi["first_ipoc"].as_u64().unwrap();
    assert_eq!((rsi["step_ms"].as_u64(), rsi["last_ipoc"].as_u64()), (Some(4), Some(first + 4 * (cycles - 1))));
}

#[test]
fn a_controller_in_python_runs_the_virtual_cell() {
    if !has_python() {
        return;
    }
    let (ran, said) = controlled(&[]);
    println!("zero correction: {said}");
    check_exchange(&ran, &said["rsi"]);
    let ft = &said["ft"];
    for name in ["gaps", "duplicates", "out_of_order", "malformed", "stalled", "status_errors"] {
        assert_eq!(ft[name], 0, "{name}: {ft}");
    }
    // Four readings between two frames: the sensor runs at 1 kHz, and the first frame is at time zero.
    assert_eq!(ft["samples"], 4 * (cycles() - 1), "{ft}");
    assert_eq!(ft["first_sequence"], 1, "{ft}");
}

#[test]
fn a_controller_in_python_is_deterministic_and_feels_the_contact() {
    if !has_python() {
        return;
    }
    // The contact plane is 8 mm away: a sine of 9 mm goes 1 mm into it, four times in a thousand cycles.
    let arguments = ["--sine-mm", "9", "--yield-mm-per-n", "0.001"];
    let (ran, said) = controlled(&arguments);
    println!("sine: {said}");
    check_exchange(&ran, &said["rsi"]);
    let low = said["ft"]["force_n_min"][2].as_f64().unwrap();
    let high = said["ft"]["force_n_max"][2].as_f64().unwrap();
    assert!(low.abs().max(high.abs()) > 1.0, "it felt nothing: [{low}, {high}] N");
    let (again, said_again) = controlled(&arguments);
    assert_eq!(ran.first_difference(&again), None);
    assert_eq!(said["digest"], said_again["digest"]);
}

#[test]
fn two_clients_in_python_share_the_virtual_cell() {
    if !has_python() {
        return;
    }
    let robot = free();
    let mut wires = wires(robot);
    let (count, sensor) = (cycles().to_string(), wires.sensor().to_string());
    let rsi = start(&["python3", &script("rsi_client.py"), &robot.to_string(), &count]);
    until_bound(robot);
    // It is slower than a cell in virtual time, and may lose readings; it reads on until half of them have come.
    let half = (2 * cycles()).to_string();
    let ft = start(&["python3", &script("rdt_client.py"), &sensor, &half]);
    wires.watch(rsi);
    let ran = ran(&mut wires, cycles());
    let rsi = summary(wires.release().expect("it was watched"));
    println!("rsi: {rsi}");
    check_exchange(&ran, &rsi);
    let ended = ft.stop(GENEROUS);
    println!("rdt: {}", ended.output);
    let ft: Value = serde_json::from_str(ended.output.lines().last().unwrap_or_default()).unwrap();
    let [samples, gaps, last] = ["samples", "gaps", "last_sequence"].map(|name| ft[name].as_u64().unwrap());
    assert_eq!(samples + gaps, last, "each reading came or is missing: {ft}");
    assert_eq!((ft["malformed"].as_u64(), ft["duplicates"].as_u64()), (Some(0), Some(0)));
}

/// RSIPI answers the robot, and `sensor` reads the force; both unchanged, as published.
fn check_third_party(python: &str, library: &str, sensor: &str) {
    const CYCLES: u64 = 10_000;
    let robot = free();
    let addresses = Addresses { robots: vec![robot], sensor: sensor.parse().unwrap(), page: None };
    let cell = Cell::find(Path::new("bench")).unwrap();
    let mut wires = Wires::bind(&cell, &addresses, Pace::Virtual { patience: GENEROUS }, GENEROUS).expect("free ports");
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("rsi.xml");
    std::fs::write(&config, cell.rsi[0].text.replace(">49152<", &format!(">{}<", robot.port()))).unwrap();
    let (runner, count) = (script("third_party.py"), CYCLES.to_string());
    let rsi = start(&[python, &runner, "rsipi", &config.display().to_string(), &count]);
    until_bound(robot);
    let ft = start(&[python, &runner, library, &wires.sensor().to_string(), &(2 * CYCLES).to_string()]);
    wires.watch(rsi);
    let ran = ran(&mut wires, CYCLES);
    let rsi = summary(wires.release().expect("it was watched"));
    let ft = summary(ft);
    println!("{rsi}\n{ft}");
    assert_eq!((ran.cycles, ran.answered, ran.stops.len()), (CYCLES, CYCLES, 0), "{:?}", ran.events);
    assert_eq!(ran.events.get("controller-late"), None, "{:?}", ran.events);
    assert_eq!((rsi["cycles"].as_u64(), rsi["gaps"].as_u64()), (Some(CYCLES), Some(0)));
    assert!(ft["samples"].as_u64().unwrap() >= 2 * CYCLES, "{ft}");
}

#[test]
fn published_clients_run_the_virtual_cell() {
    let Ok(python) = std::env::var("DOCKHIL_THIRD_PARTY") else {
        println!("skipped: no published client is installed; tests/foreign/third_party.sh does it");
        return;
    };
    check_third_party(&python, "pynetft", "127.0.0.1:0");
    // NetFT knows one port only.
    check_third_party(&python, "netft", "127.0.0.49:49152");
}

/// A program that is another one the second time: what is told and kept is the first run, and the cycle that differs.
#[test]
fn of_two_runs_that_differ_the_first_is_kept() {
    if !has_python() {
        return;
    }
    let shell = Shell::new();
    let client =
        |more: &str| format!("exec python3 {} --rsi \"$1\" --ft \"$2\" --cycles 500{more}", script("controller.py"));
    let text =
        format!("if [ -e \"$0.again\" ]; then\n{}\nfi\ntouch \"$0.again\"\n{}\n", client(" --sine-mm 0.5"), client(""));
    shell.write("fickle.sh", &text);
    let command = ["--controller", "sh DIR/fickle.sh {rsi} {ft}", "--patience", "60000", "--wait", "60"];
    let fixed = ["test", "--cell", "bench", "--twice", "-o", "DIR/first.mcap"];
    let ran = shell.run(&[&fixed[..], &command].concat());
    assert_eq!(ran.exit, 5, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("two runs of the controller differ, first in cycle "), "{}", ran.err);
    assert!(ran.out.contains("500 of 500 cycles") && ran.out.contains("fail: two runs of the"), "{}", ran.out);
    assert!(shell.path("first.mcap").exists());
}
