//! How a recording ends: by a signal, in all three ways of taking part; and its help, which says what may move before it begins.

use super::crash::drive;
use super::import::{capture, impact};
use super::wire::{files, sen};
use crate::shell::Shell;
use harness::cli::{Console, Look, run};
use harness::recording::{Grade, ReadOptions, Session, read};
use sim_core::effects::standard;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Holds the command line of the child, a word a line; without it the child's test does nothing else than look.
const WORDS: &str = "DOCKHIL_TEST_WORDS";

#[test]
fn the_help_says_what_may_move() {
    let ran = Shell::new().run(&["record", "--help"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    for line in ["What goes to the robot, and what may move:", "To be sure before a robot is involved:", "AXISCORR"] {
        assert!(ran.out.contains(line), "{line}: {}", ran.out);
    }
}

/// The command, as a process that can be sent a signal.
#[test]
fn as_a_child_it_is_the_command() {
    let Ok(words) = std::env::var(WORDS) else {
        println!("skipped: it runs as the child of a test that ends it");
        return;
    };
    let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
    let words = std::iter::once("dockhil").chain(words.lines());
    let code = run(words, &standard(), &mut Console::new(&mut out, &mut err, Look::default()));
    std::process::exit(i32::from(code));
}

/// The test that is the command.
const CHILD: [&str; 3] = ["--exact", "record::ends::as_a_child_it_is_the_command", "--nocapture"];

fn child(words: &[&str]) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(CHILD)
        .env(WORDS, words.join("\n"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until the command waits for robots: from then on it takes signals.
fn ready(child: &mut Child) -> BufReader<std::process::ChildStderr> {
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("waiting for robots") {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "it ended before it waited");
    }
    lines
}

/// Sends a signal, and gives what was printed.
fn end(child: &mut Child, signal: &str) -> String {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let mut out = String::new();
    child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(0), "{out}");
    out
}

/// The session, which has its end.
fn whole(shell: &Shell) -> Session {
    assert!(std::fs::read(shell.path("s.mcap")).unwrap().ends_with(mcap::MAGIC));
    read(&shell.path("s.mcap"), &ReadOptions::default()).unwrap()
}

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    socket
}

/// A port that was free a moment ago.
fn free() -> SocketAddr {
    socket().local_addr().unwrap()
}

/// The bench with these addresses.
fn cell(shell: &Shell, listen: SocketAddr, sensor: SocketAddr) {
    let at = |text: String| {
        text.replace("127.0.0.1:49152", &listen.to_string()).replace("127.0.0.1:49153", &sensor.to_string())
    };
    files(shell, at, |text| text.replace("49152", &listen.port().to_string()));
}

fn path(shell: &Shell, name: &str) -> String {
    shell.path(name).display().to_string()
}

#[test]
fn a_peer_that_is_interrupted_finishes_its_file() {
    // A terminal that goes away hangs up.
    ["-INT", "-HUP"].into_iter().for_each(interrupted);
}

fn interrupted(signal: &str) {
    let (shell, listen, sensor) = (Shell::new(), free(), socket());
    cell(&shell, listen, sensor.local_addr().unwrap());
    let (toml, output) = (path(&shell, "cell.toml"), path(&shell, "s.mcap"));
    let mut child = child(&["record", "--cell", &toml, "--kind", "free-flight", "-o", &output]);
    let _err = ready(&mut child);
    let (_, frames) = drive(listen.port(), &sensor, 300_000_000);
    let out = end(&mut child, signal);
    assert!(out.contains(&format!("chaser: {frames} frames, {frames} replies")), "{out}");
    assert_eq!(whole(&shell).measured.unwrap().value.len(), frames);
}

#[test]
fn a_proxy_that_is_terminated_finishes_its_file() {
    let (shell, side, sensor_side, pc, sensor) = (Shell::new(), free(), free(), socket(), socket());
    cell(&shell, pc.local_addr().unwrap(), sensor.local_addr().unwrap());
    let (toml, output) = (path(&shell, "cell.toml"), path(&shell, "s.mcap"));
    let (side_text, sensor_text) = (side.to_string(), sensor_side.to_string());
    let sides = ["--as", "proxy", "--robot-side", &side_text, "--sensor-side", &sensor_text];
    let words = ["record", "--cell", &toml, "--kind", "free-flight", "-o", &output];
    let mut child = child(&[&words[..], &sides].concat());
    let _err = ready(&mut child);
    let answering = std::thread::spawn(move || {
        pc.send_to(&[0x12, 0x34, 0, 2, 0, 0, 0, 0], sensor_side).unwrap();
        let mut buffer = [0; 2048];
        loop {
            let (length, from) = pc.recv_from(&mut buffer).unwrap();
            let text = String::from_utf8_lossy(&buffer[..length]).into_owned();
            if text == "over" {
                return;
            }
            // Readings come here too.
            let Some((_, rest)) = text.split_once("<IPOC>") else { continue };
            let ipoc = rest.split_once('<').unwrap().0.parse().unwrap();
            pc.send_to(&sen(ipoc, 0.0, 0.0), from).unwrap();
        }
    });
    let (_, frames) = drive(side.port(), &sensor, 300_000_000);
    let out = end(&mut child, "-TERM");
    let listen = std::fs::read_to_string(shell.path("cell.toml")).unwrap();
    let pc_at = listen.lines().find_map(|line| line.strip_prefix("listen = ")).unwrap().trim_matches('"').to_owned();
    socket().send_to(b"over", pc_at).unwrap();
    answering.join().unwrap();
    assert!(out.contains(&format!("chaser: {frames} frames, {frames} replies")), "{out}");
    assert!(out.contains("latency robot to PC: least "), "{out}");
    assert_eq!(whole(&shell).commanded.unwrap().value.len(), frames);
}

#[test]
fn a_tap_whose_pipe_stays_open_finishes_its_file() {
    let (shell, truth) = (Shell::new(), impact());
    let output = path(&shell, "s.mcap");
    let typed = ["record", "--as", "tap", "--pcap", "-", "--cell", "bench", "--kind", "impact", "-o", &output];
    let mut child = child(&typed);
    let mut pipe = child.stdin.take().unwrap();
    let bytes = capture(&truth).pcap();
    // A pipe holds 64 KiB, and the program reads as many at once: when half of all is written, much of it was taken.
    assert!(bytes.len() > 4 * 65_536);
    pipe.write_all(&bytes[..bytes.len() / 2]).unwrap();
    let out = end(&mut child, "-INT");
    drop(pipe);
    assert!(out.contains("chaser: "), "{out}");
    let session = whole(&shell);
    assert_eq!(session.grade, Grade::A, "{:?}", session.findings);
    let frames = session.measured.unwrap().value.len();
    assert!(frames > 20 && frames < truth.measured.unwrap().value.len(), "{frames}");
}

#[test]
fn a_limit_on_the_length_of_files_is_an_error_with_words() {
    let shell = Shell::new();
    let (pcap, output) = (path(&shell, "c.pcap"), path(&shell, "s.mcap"));
    std::fs::write(&pcap, capture(&impact()).pcap()).unwrap();
    let words = ["record", "--as", "tap", "--pcap", &pcap, "--cell", "bench", "--kind", "impact", "-o", &output];
    // Blocks of 512 or 1024 bytes, as the shell has it.
    let ran = Command::new("sh")
        .args(["-c", "ulimit -f 16; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args(CHILD)
        .env(WORDS, words.join("\n"))
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{:?} {err}", ran.status);
    assert!(err.contains("File too large") && err.contains("ulimit -f"), "{err}");
}
