//! Sensors that are asked elsewhere than they send from, their pages, and their zero.

use super::live::{any, clock, session};
use super::wire::{Capture, bench, files, rdt, rob};
use crate::shell::{Ran, Shell};
use harness::cell::{Cell, CellConfig};
use harness::recorder::{Devices, Peer, Recorder, sensor_transport, session_record};
use harness::recording::Kind;
use sim_core::effects::standard;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::Duration;

const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];
const CYCLES: u64 = 40;
const GENEROUS: Duration = Duration::from_secs(20);

/// A message of a SCHUNK.
fn message(counter: u16, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0xff, 0xff];
    bytes.extend(counter.to_le_bytes());
    bytes.extend((body.len() as u16).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// A sample of it that is ready.
fn sample(counter: u16, force_z_n: f32) -> Vec<u8> {
    let mut body = vec![0, 1, 0, 0, 0];
    body.extend([0.0, 0.0, force_z_n, 0.0, 0.0, 0.0].into_iter().flat_map(f32::to_le_bytes));
    message(counter, &body)
}

/// The bench with a SCHUNK at this address, which sends to any port.
fn schunk(address: SocketAddr) -> Cell {
    let mut cell = bench();
    let (head, _) = cell.source.text.split_once("[sensor]").unwrap();
    let sensor = format!("[sensor]\nprotocol = \"schunk\"\naddress = \"{address}\"\nsamples_port = 0\n");
    cell.config = CellConfig::parse("cell.toml", &format!("{head}{sensor}")).unwrap();
    cell.config.robots[0].listen = any();
    cell
}

#[test]
fn a_schunk_is_asked_over_tcp_and_sends_datagrams() {
    let port = TcpListener::bind(any()).unwrap();
    let cell = schunk(port.local_addr().unwrap());
    let mut devices = Devices::of(&cell, true).unwrap();
    let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
    let (robot_side, samples) = (peer.addresses()[0], peer.samples().unwrap());
    let others = std::thread::spawn(move || {
        let (mut commands, _) = port.accept().unwrap();
        commands.set_read_timeout(Some(GENEROUS)).unwrap();
        let mut request = [0; 7];
        commands.read_exact(&mut request).unwrap();
        assert_eq!((request[..2].to_vec(), request[6]), (vec![0xff, 0xff], 0x40), "start");
        commands.write_all(&message(1, &[0x40, 0])).unwrap();
        // From a port that nobody was told.
        let (sensor, robot) = (UdpSocket::bind(any()).unwrap(), UdpSocket::bind(any()).unwrap());
        robot.set_read_timeout(Some(GENEROUS)).unwrap();
        let mut buffer = [0; 2048];
        for nth in 0..CYCLES {
            for fourth in 0..4 {
                sensor.send_to(&sample(65_500_u16.wrapping_add(4 * nth as u16 + fourth), 1.5), samples).unwrap();
            }
            robot.send_to(&rob(1000 + 4 * nth, POSE, POSE), robot_side).unwrap();
            robot.recv(&mut buffer).unwrap();
        }
        // The end: the sensor is told to stop, where it was told to start.
        let mut rest = Vec::new();
        commands.read_to_end(&mut rest).unwrap();
        assert_eq!(rest.last(), Some(&0x41), "{rest:?}");
    });
    let record = session_record(&cell, &standard(), Kind::Static, "peer").unwrap();
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    {
        let calls = std::cell::Cell::new(0_u64);
        let heard = std::cell::Cell::new(0_u64);
        let ends = || {
            calls.set(calls.get() + 1);
            heard.get() >= CYCLES || calls.get() > 3_000_000 || others.is_finished()
        };
        let now = clock(&ends);
        while !ends() {
            let until = now().0.saturating_add(5_000_000);
            peer.run(&mut devices, &mut recorder, &now, &|| now().0 >= until).unwrap();
            heard.set(recorder.summary().robots[0].1);
        }
    }
    drop(peer);
    others.join().unwrap();
    let (_, summary) = recorder.finish().unwrap();
    assert_eq!(summary.samples, 4 * CYCLES, "{:?}", summary.events);
    let answered = summary.events.get(&("ft".to_owned(), "ft-answer".to_owned()));
    assert_eq!(answered, Some(&1), "{:?}", summary.events);
    let sensed = session(&out).sensed.unwrap();
    assert!(sensed.value.iter().all(|wrench| wrench.force_n.map(f64::to_bits) == [0.0, 0.0, 1.5].map(f64::to_bits)));
}

#[test]
fn a_capture_of_a_schunk_has_its_samples_on_a_port_of_their_own() {
    let shell = Shell::new();
    let sensor = "[sensor]\nprotocol = \"schunk\"\naddress = \"10.0.0.7:82\"\n";
    let text = |text: String| format!("{}{sensor}", text.split_once("[sensor]").unwrap().0);
    files(&shell, text, |text| text);
    let mut capture = Capture::default();
    for nth in 0..100_u64 {
        let at_ns = 1_700_000_000_000_000_000 + nth as i64 * 4_000_000;
        capture.udp(at_ns, super::import::ROBOT, super::import::PC, &rob(1000 + 4 * nth, POSE, POSE));
        capture.udp(at_ns, super::import::PC, super::import::ROBOT, &super::wire::sen(1000 + 4 * nth, 0.0, 0.0));
        capture.udp(at_ns, "10.0.0.7:50123", "10.0.0.1:54843", &sample(4 * nth as u16, 2.0));
        capture.udp(at_ns, "10.0.0.8:50123", "10.0.0.1:54843", &sample(4 * nth as u16, 2.0));
    }
    capture.tcp(1_700_000_000_100_000_000, "10.0.0.1:40000", "10.0.0.7:82", &message(1, &[0x12]));
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let words = ["import", "pcap", "DIR/c.pcap", "--cell", "DIR/cell.toml", "--kind", "static", "-o", "DIR/s.mcap"];
    let ran = shell.run(&words);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    assert!(ran.out.contains("ft: 100 samples") && ran.out.contains("1 × ft-bias-set (ft)"), "{}", ran.out);
    let proxy = ["record", "--as", "proxy", "--robot-side", "127.0.0.1:0", "--sensor-side", "127.0.0.1:0"];
    let ran = shell.run(&[&proxy[..], &["--cell", "DIR/cell.toml", "--kind", "static", "-o", "DIR/t.mcap"]].concat());
    assert!(ran.exit == 2 && ran.err.contains("the sensor is asked over TCP"), "{}", ran.err);
    let own = |text: String| text.replace("protocol = \"rdt\"", "protocol = \"rdt\"\nsamples_port = 7");
    files(&shell, own, |text| text);
    let ran = shell.run(&words);
    assert!(ran.exit == 2 && ran.err.contains("means nothing to the protocol rdt"), "{}", ran.err);
}

/// The bench at free ports, its sensor said to have a page there: where the robot speaks to, and the sensor.
fn at(shell: &Shell, sensor: SocketAddr, page: Option<SocketAddr>) -> SocketAddr {
    let listen = UdpSocket::bind(any()).unwrap().local_addr().unwrap();
    let text = |text: String| {
        let text = text.replace("127.0.0.1:49152", &listen.to_string()).replace("127.0.0.1:49153", &sensor.to_string());
        page.map_or(text.clone(), |page| format!("{text}page = \"{page}\"\n"))
    };
    files(shell, text, |text| text.replace("49152", &listen.port().to_string()));
    listen
}

fn recorded(shell: &Shell, more: &[&str]) -> Ran {
    let words = ["record", "--cell", "DIR/cell.toml", "--kind", "static", "--force", "-o", "DIR/s.mcap"];
    let mut ran = shell.run(&[&words[..], more].concat());
    ran.err = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    ran
}

/// The page of another sensor; how often it was asked for.
fn other_page(times: usize) -> (SocketAddr, std::thread::JoinHandle<()>) {
    let mut other = bench();
    other.config.sensor.protocol.insert("counts_per_n".to_owned(), 500_000.into());
    let page = other.sensor().unwrap().page().unwrap();
    let server = TcpListener::bind(any()).unwrap();
    let address = server.local_addr().unwrap();
    let serving = std::thread::spawn(move || {
        for _ in 0..times {
            let (mut caller, _) = server.accept().unwrap();
            let mut request = [0; 1024];
            assert!(caller.read(&mut request).unwrap() > 0);
            let head = format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n", page.len());
            caller.write_all(format!("{head}{page}").as_bytes()).unwrap();
        }
    });
    (address, serving)
}

#[test]
fn a_sensor_whose_page_says_something_else_is_not_recorded() {
    let shell = Shell::new();
    let sensor = UdpSocket::bind(any()).unwrap();
    let (page, serving) = other_page(2);
    at(&shell, sensor.local_addr().unwrap(), Some(page));
    let proxy = ["--as", "proxy", "--robot-side", "127.0.0.1:0", "--sensor-side", "127.0.0.1:0"];
    for way in [&["--as", "peer"][..], &proxy] {
        let ran = recorded(&shell, way);
        let what = format!("counts_per_n = 1000000, and the page of the sensor at {page} says 500000");
        assert!(ran.exit == 2 && ran.err.contains(&what), "{}", ran.err);
        assert!(!shell.path("s.mcap").exists());
    }
    serving.join().unwrap();
    sensor.set_nonblocking(true).unwrap();
    assert!(sensor.recv(&mut [0; 8]).is_err(), "the sensor was asked nothing");
    // Who takes no part asks nobody: there is no server any more.
    let mut capture = super::import::capture(&super::import::impact());
    std::fs::write(shell.path("c.pcap"), capture.pcap()).unwrap();
    let (at_pc, at_sensor) = (|text: String| text, super::import::SENSOR);
    files(&shell, |text| format!("{text}page = \"{page}\"\n").replace("127.0.0.1:49153", at_sensor), at_pc);
    let ran = recorded(&shell, &["--as", "tap", "--pcap", "DIR/c.pcap"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
}

#[test]
fn a_zero_is_set_before_the_recording_where_that_was_asked_for() {
    let shell = Shell::new();
    let sensor = UdpSocket::bind(any()).unwrap();
    sensor.set_read_timeout(Some(GENEROUS)).unwrap();
    at(&shell, sensor.local_addr().unwrap(), None);
    let sensor = std::thread::spawn(move || {
        let (mut buffer, mut codes) = ([0; 64], Vec::new());
        loop {
            let (_, client) = sensor.recv_from(&mut buffer).unwrap();
            codes.push(buffer[3]);
            match buffer[3] {
                2 => drop(sensor.send_to(&rdt(1, 7, [0.0, 0.0, 1.0]), client).unwrap()),
                0 => return codes,
                _ => {}
            }
        }
    });
    let ran = recorded(&shell, &["--bias", "--duration-s", "0.3"]);
    let codes = sensor.join().unwrap();
    assert_eq!(codes[..2], [0x42, 2], "the zero, then the start: {codes:?}");
    assert_eq!(codes.iter().filter(|code| **code == 0x42).count(), 1);
    assert!(ran.out.contains("1 × ft-bias-set (ft)") && !ran.err.contains("warning"), "{}{}", ran.out, ran.err);
    for (text, more, what) in [
        ("protocol = \"robotiq\"\naddress = \"127.0.0.1:9\"\n", &[][..], "cannot set a bias"),
        (
            "protocol = \"robotiq\"\naddress = \"127.0.0.1:9\"\n",
            &["--as", "tap", "--pcap", "-"],
            "--bias is for --as peer",
        ),
    ] {
        files(&shell, |cell| format!("{}[sensor]\n{text}", cell.split_once("[sensor]").unwrap().0), |text| text);
        let ran = recorded(&shell, &[&["--bias"], more].concat());
        assert!(ran.exit == 2 && ran.err.contains(what), "{}", ran.err);
    }
}
