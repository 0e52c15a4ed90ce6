//! Live, on loopback: as the robots' PC, and between robots and PC.

use super::crash::unix_ns;
use super::wire::{bench, rdt, rob, sen};
use harness::cell::Cell;
use harness::recorder::{Devices, Peer, Proxy, Recorder, sensor_transport, session_record};
use harness::recording::{Kind, ReadOptions, Session, from_bytes};
use sim_core::effects::standard;
use sim_core::time::Nanos;
use std::cell::Cell as Counter;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

/// A socket of a test, with a generous end to every wait.
fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    socket
}

fn cell(listen: SocketAddr, sensor: SocketAddr) -> Cell {
    let mut cell = bench();
    cell.config.robots[0].listen = listen;
    cell.config.sensor.address = sensor;
    cell
}

pub fn any() -> SocketAddr {
    "127.0.0.1:0".parse().unwrap()
}

const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
const CYCLES: u64 = 50;
const BEGIN_NS: i64 = 1_700_000_000_000_000_000;

/// A clock that goes on by 0.1 ms whenever it is asked, until somebody says that all is over: no wait depends on real time.
pub fn clock(ends: &dyn Fn() -> bool) -> impl Fn() -> Nanos {
    let ticks = Counter::new(0_i64);
    move || {
        ticks.set(ticks.get() + 1);
        if ends() { Nanos(i64::MAX) } else { Nanos(BEGIN_NS + ticks.get() * 100_000) }
    }
}

pub fn session(bytes: &[u8]) -> Session {
    from_bytes("s.mcap", bytes, &ReadOptions::default()).unwrap()
}

fn text(buffer: &[u8]) -> String {
    String::from_utf8(buffer.to_vec()).unwrap()
}

#[test]
fn a_peer_answers_every_frame_with_nothing() {
    let sensor = socket();
    let cell = cell(any(), sensor.local_addr().unwrap());
    let mut devices = Devices::of(&cell, true).unwrap();
    let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
    let address = peer.addresses()[0];
    let record = session_record(&cell, &standard(), Kind::FreeFlight, "peer").unwrap();
    let robot = std::thread::spawn(move || {
        let (robot, stranger, mut buffer) = (socket(), socket(), [0; 2048]);
        let (length, client) = sensor.recv_from(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], [0x12, 0x34, 0, 2, 0, 0, 0, 0], "start, without end");
        for nth in 0..CYCLES {
            for fourth in 0..4 {
                let count = nth as u32 * 4 + fourth;
                sensor.send_to(&rdt(count + 1, 7 * count, [0.0, 0.0, 1.5]), client).unwrap();
            }
            let frame = rob(4_211_158_252 + 4 * nth, POSE, POSE);
            robot.send_to(&frame, address).unwrap();
            let length = robot.recv(&mut buffer).unwrap();
            let reply = text(&buffer[..length]);
            let zero = "<RKorr X=\"0.000000000\" Y=\"0.000000000\" Z=\"0.000000000\" A=\"0.000000000\" B=\"0.000000000\" \
                        C=\"0.000000000\"/>";
            assert_eq!(reply, format!("<Sen Type=\"ImFree\">{zero}<IPOC>{}</IPOC></Sen>", 4_211_158_252 + 4 * nth));
            if nth == 20 {
                // Asked again, it says the same again; somebody else is not answered.
                robot.send_to(&frame, address).unwrap();
                let length = robot.recv(&mut buffer).unwrap();
                assert_eq!(text(&buffer[..length]), reply);
                // What is no frame gets no answer: the next one is to the next frame.
                robot.send_to(b"hello", address).unwrap();
                stranger.send_to(&frame, address).unwrap();
            }
        }
        // The end: the sensor is told to stop.
        loop {
            let length = sensor.recv(&mut buffer).unwrap();
            if buffer[..length] == [0x12, 0x34, 0, 0, 0, 0, 0, 0] {
                return stranger;
            }
            assert_eq!(buffer[..4], [0x12, 0x34, 0, 2], "only starts come before the stop");
        }
    });
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    let frames = Counter::new(0);
    // Half a minute of such calls is far more than the exchange needs.
    let calls = Counter::new(0_u64);
    let ends = || {
        calls.set(calls.get() + 1);
        frames.get() >= CYCLES || calls.get() > 3_000_000
    };
    let now = clock(&ends);
    while !ends() {
        // In short stretches, so that what was recorded can be looked at in between.
        let until = Nanos(now().0 + 5_000_000);
        run_peer(&mut peer, &mut devices, &mut recorder, &now, until);
        frames.set(recorder.summary().robots[0].1);
    }
    drop(peer);
    let (_, summary) = recorder.finish().unwrap();
    let stranger = robot.join().unwrap();
    stranger.set_nonblocking(true).unwrap();
    assert!(stranger.recv(&mut [0; 16]).is_err(), "a stranger is not answered");
    assert_eq!((summary.robots[0].1, summary.robots[0].2), (CYCLES, CYCLES + 1));
    let seen = |source: &str, class: &str| summary.events.get(&(source.to_owned(), class.to_owned())).copied();
    assert_eq!(seen("chaser", "rsi-duplicate"), Some(1));
    assert_eq!(seen("chaser", "net-stranger"), Some(1));
    let session = session(&out);
    assert_eq!(session.measured.unwrap().value.len() as u64, CYCLES);
    let commanded = session.commanded.unwrap();
    assert!(commanded.value.iter().all(|pose| (pose.position_m[2] + 0.008).abs() < 1e-12), "where RSI was started");
    assert!(
        session
            .sensed
            .unwrap()
            .value
            .iter()
            .all(|wrench| wrench.force_n.map(f64::to_bits) == [0.0, 0.0, 1.5].map(f64::to_bits))
    );
}

/// A stranger spoke first, then the robot comes, and comes again from another port: each is heard once the one before is silent.
#[test]
fn a_robot_that_comes_from_another_port_is_heard_when_the_one_before_is_silent() {
    let sensor = socket();
    let cell = cell(any(), sensor.local_addr().unwrap());
    let mut devices = Devices::of(&cell, true).unwrap();
    let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
    let address = peer.addresses()[0];
    let record = session_record(&cell, &standard(), Kind::FreeFlight, "peer").unwrap();
    let robots = std::thread::spawn(move || {
        let (mut buffer, mut ipoc, mut ignored) = ([0; 2048], 1000, 0);
        for frames in [1, CYCLES, CYCLES] {
            let robot = socket();
            robot.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
            let mut answered = 0;
            // Half a minute, if nobody listens.
            for _ in 0..6000 {
                ipoc += 4;
                robot.send_to(&rob(ipoc, POSE, POSE), address).unwrap();
                match robot.recv(&mut buffer) {
                    Ok(_) => answered += 1,
                    Err(_) => ignored += 1,
                }
                if answered == frames {
                    break;
                }
            }
            assert_eq!(answered, frames, "a new port is heard");
        }
        ignored
    });
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    let ends = || robots.is_finished();
    // Silence is a matter of real time: the other side counts it too.
    let now = || Nanos(unix_ns());
    peer.run(&mut devices, &mut recorder, &now, &ends).unwrap();
    let ignored = robots.join().unwrap();
    let (_, summary) = recorder.finish().unwrap();
    let seen = |class: &str| summary.events.get(&("chaser".to_owned(), class.to_owned())).copied().unwrap_or(0);
    // Who was not answered in time was ignored; an answer may also have come late.
    assert!(
        ignored > 2 && seen("net-stranger") > 2 && seen("net-stranger") <= ignored,
        "{ignored} {:?}",
        summary.events
    );
    assert_eq!(seen("net-taken"), 2, "{:?}", summary.events);
    assert!(summary.robots[0].1 > 2 * CYCLES, "{}", summary.robots[0].1);
}

fn run_peer(
    peer: &mut Peer,
    devices: &mut Devices,
    recorder: &mut Recorder<&mut Vec<u8>>,
    now: &dyn Fn() -> Nanos,
    until: Nanos,
) {
    peer.run(devices, recorder, now, &|| now() >= until).unwrap();
}

#[test]
fn a_proxy_passes_every_byte_on_and_says_what_it_costs() {
    let (pc, sensor) = (socket(), socket());
    let cell = cell(pc.local_addr().unwrap(), sensor.local_addr().unwrap());
    let mut devices = Devices::of(&cell, false).unwrap();
    let mut proxy = Proxy::open(&cell, &devices, &[any()], Some(any())).unwrap();
    let (robot_side, sensor_side) = (proxy.addresses()[0], proxy.sensor_address().unwrap());
    let record = session_record(&cell, &standard(), Kind::FreeFlight, "proxy").unwrap();
    let others = std::thread::spawn(move || {
        let (robot, client, mut buffer) = (socket(), socket(), [0; 2048]);
        client.send_to(&[0x12, 0x34, 0, 2, 0, 0, 0, 0], sensor_side).unwrap();
        let (length, asked_by) = sensor.recv_from(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
        for nth in 0..CYCLES {
            // Blanks and an unknown element are nobody's business but theirs.
            let frame = text(&rob(1000 + 4 * nth, POSE, POSE)).replace("<Delay", "\n <Own Thing=\"1\" />\r\n<Delay");
            robot.send_to(frame.as_bytes(), robot_side).unwrap();
            let (length, proxy) = pc.recv_from(&mut buffer).unwrap();
            assert_eq!(text(&buffer[..length]), frame);
            let reply = sen(1000 + 4 * nth, 0.25 * nth as f64, 0.0);
            pc.send_to(&reply, proxy).unwrap();
            let length = robot.recv(&mut buffer).unwrap();
            assert_eq!(buffer[..length], reply);
            let sample = rdt(nth as u32 + 1, 7 * nth as u32, [0.0, 0.0, 2.0]);
            sensor.send_to(&sample, asked_by).unwrap();
            let length = client.recv(&mut buffer).unwrap();
            assert_eq!(buffer[..length], sample);
            if nth == 20 {
                client.send_to(&[0x12, 0x34, 0, 0x42, 0, 0, 0, 0], sensor_side).unwrap();
                let length = sensor.recv(&mut buffer).unwrap();
                assert_eq!(buffer[..length], [0x12, 0x34, 0, 0x42, 0, 0, 0, 0]);
            }
        }
    });
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    {
        let is_over = || others.is_finished();
        let now = clock(&is_over);
        proxy.run(&mut devices, &mut recorder, &now, &is_over).unwrap();
    }
    others.join().unwrap();
    let (_, summary) = recorder.finish().unwrap();
    assert_eq!((summary.robots[0].1, summary.robots[0].2, summary.samples), (CYCLES, CYCLES, CYCLES));
    let asked = |class: &str| summary.events.get(&("ft".to_owned(), class.to_owned())).copied();
    assert_eq!((asked("ft-start"), asked("ft-bias-set"), summary.biases), (Some(1), Some(1), 1));
    for latency in [&proxy.to_pc, &proxy.to_robot, &proxy.from_sensor] {
        let spread = latency.spread().unwrap();
        assert_eq!(spread.count, CYCLES);
        // The clock of the test goes on by 100 µs each time that it is asked.
        assert!(spread.median_us >= 100.0 && spread.most_us >= spread.p99_us, "{spread:?}");
    }
    let commanded = session(&out).commanded.unwrap();
    let last = commanded.value.last().unwrap().position_m[2];
    assert!((last - (-0.008 + 0.25e-3 * (CYCLES - 1) as f64)).abs() < 1e-12, "{last}");
}

#[test]
fn what_cannot_be_recorded_is_refused_before_a_file_is_made() {
    let taken = socket();
    let shell = crate::shell::Shell::new();
    let text = bench().source.text.replace("127.0.0.1:49152", &taken.local_addr().unwrap().to_string());
    for (name, text) in [
        ("cell.toml", text),
        ("models/bench.toml", bench().model.text),
        ("rsi/bench.xml", bench().rsi[0].text.replacen("HOLDON=\"1\"", "HOLDON=\"0\"", 1)),
    ] {
        std::fs::create_dir_all(shell.path(name).parent().unwrap()).unwrap();
        std::fs::write(shell.path(name), text).unwrap();
    }
    let record = ["record", "--cell", "DIR/cell.toml", "--kind", "impact", "-o", "DIR/s.mcap"];
    let ran = shell.run(&record);
    assert!(ran.exit == 2 && ran.err.contains("HOLDON"), "{}", ran.err);
    std::fs::write(shell.path("rsi/bench.xml"), &bench().rsi[0].text).unwrap();
    let ran = shell.run(&record);
    assert!(ran.exit == 2 && ran.err.contains("in use"), "{}", ran.err);
    let ran = shell.run(&[&record[..], &["--robot-side", "127.0.0.1:0"]].concat());
    assert!(ran.exit == 2 && ran.err.contains("--as proxy"), "{}", ran.err);
    let ran = shell.run(&[&record[..], &["--as", "proxy"]].concat());
    assert!(ran.exit == 2 && ran.err.contains("0 addresses for 1 robots"), "{}", ran.err);
    assert!(!shell.path("s.mcap").exists());
    std::fs::write(shell.path("s.mcap"), b"somebody's work").unwrap();
    let ran = shell.run(&[&record[..], &["--as", "tap", "--pcap", "-"]].concat());
    assert!(ran.exit == 2 && ran.err.contains("exists already"), "{}", ran.err);
    assert_eq!(shell.read("s.mcap"), "somebody's work");
}
