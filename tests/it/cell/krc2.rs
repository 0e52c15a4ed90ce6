//! A KRC2 over TCP: whatever the network does to its stream, the run is the one in process; and who is not there, or talks
//! nonsense, is named.

use super::sockets::{PATIENCE, heard, through};
use super::{cell, reference};
use crate::shell::Shell;
use harness::cell::run::{Options, Ran, run};
use harness::cell::serve::Served;
use harness::cell::wires::{Addresses, Pace, Wires};
use harness::cell::{Cell, CellConfig};
use sim_core::effects::standard;
use sim_core::rng::Streams;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::thread::JoinHandle;
use std::time::Duration;

/// The cell inside the program, or with a length before each document instead of full buffers.
fn krc2(has_length: bool, fault: &str) -> Cell {
    let mut cell = cell("krc2", fault);
    if has_length {
        cell.rsi[0].text = cell.rsi[0].text.replace("<PROTCOLLENGTH>Off", "<PROTCOLLENGTH>On");
        cell.config.robots[0].frame_bytes = 0;
    }
    cell
}

fn check(here: &Ran, there: &Ran, what: &str) {
    assert_eq!(here.first_difference(there), None, "{what}");
    assert_eq!(here.session, there.session, "{what}");
    assert_eq!((here.cycles, here.answered, &here.stops), (there.cycles, there.answered, &there.stops), "{what}");
}

/// Carries bytes one way, in pieces that have nothing to do with documents. Of what comes first, it waits for two.
fn carry(mut from: TcpStream, mut to: TcpStream, name: &str, first: usize) {
    let mut lengths = Streams::new(6008).named(name);
    let (mut buffer, mut waiting) = (vec![0; 65_536], Vec::new());
    while let Ok(length @ 1..) = from.read(&mut buffer) {
        waiting.extend_from_slice(&buffer[..length]);
        if waiting.windows(6).filter(|part| *part == b"</Rob>").count() < first {
            continue;
        }
        if first > 0 {
            return forward(from, to, &waiting, name);
        }
        while !waiting.is_empty() {
            // Between one byte and more than a buffer of the controller.
            let piece = (1.0 + lengths.uniform() * 3000.0) as usize;
            if to.write_all(&waiting[..piece.min(waiting.len())]).is_err() {
                return;
            }
            waiting.drain(..piece.min(waiting.len()));
            std::thread::yield_now();
        }
    }
    // The end is passed on.
    let _ = to.shutdown(Shutdown::Both);
}

/// What has waited goes in one piece; what follows is cut.
fn forward(from: TcpStream, mut to: TcpStream, waiting: &[u8], name: &str) {
    if to.write_all(waiting).is_ok() {
        carry(from, to, name, 0);
    }
}

/// Stands between robot and controller; its address.
fn relay(controller: SocketAddr) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let (robot, _) = listener.accept().unwrap();
        let pc = TcpStream::connect(controller).unwrap();
        for stream in [&robot, &pc] {
            stream.set_nodelay(true).unwrap();
        }
        let (back, forth) = (pc.try_clone().unwrap(), robot.try_clone().unwrap());
        std::thread::spawn(move || carry(back, forth, "to the robot", 0));
        // The greeting and the first frame come in one piece.
        carry(robot, pc, "from the robot", 2);
    });
    address
}

fn free() -> SocketAddr {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

#[test]
fn a_thousand_cycles_over_tcp_are_those_in_process() {
    for has_length in [false, true] {
        let cell = krc2(has_length, "");
        let here = reference(&cell, 4.0);
        assert_eq!((here.cycles, here.answered, here.stops.len(), here.events.len()), (1000, 1000, 0, 0));
        let address = free();
        check(&here, &through(&cell, 4.0, &[address], vec![address]), "as it is sent");
    }
}

#[test]
fn how_a_stream_is_cut_changes_nothing() {
    for has_length in [false, true] {
        let cell = krc2(has_length, "");
        let here = reference(&cell, 1.2);
        for _ in 0..3 {
            let address = free();
            check(&here, &through(&cell, 1.2, &[relay(address)], vec![address]), "cut");
        }
    }
}

#[test]
fn a_fault_on_a_stream_does_what_it_does_in_process() {
    for has_length in [false, true] {
        for fault in [
            "id = \"two-documents\"\non = \"rsi-frame\"\nat = 20",
            "id = \"truncate\"\non = \"rsi-frame\"\nbytes = 300\nat = 20",
            "id = \"drop\"\non = \"rsi-frame\"\nat = \"first-contact\"\nfor = 5",
            "id = \"drop\"\non = \"rsi-reply\"\nat = 30\nfor = 200",
        ] {
            let cell = krc2(has_length, &format!("[[fault]]\n{fault}\n"));
            let (here, address) = (reference(&cell, 0.8), free());
            let there = through(&cell, 0.8, &[address], vec![address]);
            assert!(here.idle().is_empty(), "{fault}");
            check(&here, &there, fault);
        }
    }
}

/// A run whose link is cut after so many bytes from the robot, and with a client before and one beside the robot.
fn disturbed(controller: SocketAddr, bytes: usize) -> (SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let thread = std::thread::spawn(move || {
        let (mut robot, _) = listener.accept().unwrap();
        // Somebody took the wrong port: it is told nothing, and leaves.
        let mut browser = TcpStream::connect(controller).unwrap();
        browser.write_all(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n").unwrap();
        browser.shutdown(Shutdown::Write).unwrap();
        assert_eq!(browser.read(&mut [0; 64]).unwrap(), 0, "no answer");
        let mut pc = TcpStream::connect(controller).unwrap();
        let (mut back, mut forth) = (pc.try_clone().unwrap(), robot.try_clone().unwrap());
        std::thread::spawn(move || std::io::copy(&mut back, &mut forth));
        let (mut buffer, mut carried, mut second) = ([0; 4096], 0, None);
        while let Ok(length @ 1..) = robot.read(&mut buffer) {
            pc.write_all(&buffer[..length]).unwrap();
            carried += length;
            if second.is_none() {
                second = Some(std::thread::spawn(move || {
                    let mut second = TcpStream::connect(controller).unwrap();
                    // It is closed at once.
                    assert!(matches!(second.read(&mut [0; 64]), Ok(0) | Err(_)));
                }));
            }
            if carried >= bytes {
                break;
            }
        }
        second.unwrap().join().unwrap();
        for stream in [robot, pc] {
            let _ = stream.shutdown(Shutdown::Both);
        }
    });
    (address, thread)
}

#[test]
fn strangers_change_nothing_and_a_link_that_closes_ends_the_run() {
    let cell = krc2(false, "");
    let (here, controller) = (reference(&cell, 0.8), free());
    let (address, thread) = disturbed(controller, usize::MAX);
    let (there, events) = heard(&cell, 0.8, &[address], vec![controller]);
    thread.join().unwrap();
    check(&here, &there, "strangers");
    let seen = |class: &str| events.get(class).copied();
    assert_eq!((seen("rsi-malformed"), seen("net-stranger")), (Some(1), Some(1)), "{events:?}");
    assert_eq!(seen("net-closed"), Some(2), "the stranger, and in the end the robot: {events:?}");
    assert!(!there.left);

    // 2048 bytes a frame, and a short greeting.
    let controller = free();
    let (address, thread) = disturbed(controller, 2048 * 50);
    let (cut, _) = heard(&cell, 0.8, &[address], vec![controller]);
    thread.join().unwrap();
    assert!(cut.left && (49..52).contains(&cut.cycles), "{} cycles", cut.cycles);
    assert_eq!(cut.prints[..40], here.prints[..40]);
}

/// A controller that asks the sensor for its stream, and then does this.
fn odd_controller(cell: &Cell, ready: Duration, act: impl FnOnce(SocketAddr) + Send) -> Result<Ran, String> {
    let robot = free();
    let addresses = Addresses { robots: vec![robot], sensor: "127.0.0.1:0".parse().unwrap(), page: None };
    let mut wires = Wires::bind(cell, &addresses, Pace::Virtual { patience: PATIENCE }, ready).unwrap();
    let client = UdpSocket::bind("127.0.0.1:0").unwrap();
    client.send_to(&[0x12, 0x34, 0, 2, 0, 0, 0, 0], wires.sensor()).unwrap();
    std::thread::scope(|scope| {
        scope.spawn(move || act(robot));
        let ran = run(cell, &standard(), &Options { duration_s: 0.8, keeps: true }, &mut wires);
        // The controller ends when the robot leaves.
        drop(wires);
        ran.map_err(|error| error.to_string())
    })
}

#[test]
fn who_is_not_there_or_talks_nonsense_is_named() {
    let cell = krc2(false, "");
    let nobody = odd_controller(&cell, Duration::from_millis(200), |_| ()).unwrap_err();
    assert!(nobody.contains("nobody listens at 127.0.0.1:") && nobody.contains("for chaser"), "{nobody}");
    assert!(nobody.contains("refused"), "{nobody}");

    // It comes late, and is waited for; what it says is no answer.
    for nonsense in ["HTTP/1.1 400 Bad Request\r\n\r\n", "<Sen Type=\"CoRob\"><IPOC></Sen>"] {
        let ran = odd_controller(&cell, PATIENCE, |robot| {
            std::thread::sleep(Duration::from_millis(100));
            let (mut stream, _) = TcpListener::bind(robot).unwrap().accept().unwrap();
            let (mut buffer, mut heard) = ([0; 4096], Vec::new());
            // An answer to nothing is none.
            while !heard.windows(4).any(|part| part == b"RIst") {
                let length = stream.read(&mut buffer).unwrap();
                heard.extend_from_slice(&buffer[..length]);
            }
            stream.write_all(nonsense.as_bytes()).unwrap();
            while let Ok(1..) = stream.read(&mut [0; 4096]) {}
        });
        let ran = ran.unwrap();
        let [(robot, why)] = &ran.stops[..] else { panic!("{:?}", ran.stops) };
        assert!(robot == "chaser" && why.contains("execution error"), "{why}");
        assert_eq!((ran.cycles, ran.events.get("controller-bad-reply")), (1, Some(&1)), "{:?}", ran.events);
    }

    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let addresses =
        Addresses { robots: vec![taken.local_addr().unwrap()], sensor: "127.0.0.1:9".parse().unwrap(), page: None };
    let error = Served::bind(&cell, &addresses).map(drop).unwrap_err();
    assert!(error.to_string().contains("TCP port") && error.to_string().contains("is in use"), "{error}");
    assert!(error.to_string().contains("robot chaser"), "{error}");
}

#[test]
fn what_cannot_go_together_is_refused_at_its_line() {
    let refused = |from: &str, to: &str, length: &str| {
        let mut cell = cell("krc2", "");
        assert!(cell.source.text.contains(from), "{from}");
        cell.source.text = cell.source.text.replace(from, to);
        cell.config = CellConfig::parse("krc2", &cell.source.text).unwrap();
        cell.rsi[0].text = cell.rsi[0].text.replace("<PROTCOLLENGTH>Off", length);
        cell.driven(0).unwrap_err().to_string()
    };
    let krc4 = refused("family = \"krc2\"", "family = \"krc4\"", "<PROTCOLLENGTH>Off");
    assert!(krc4.contains("krc2.toml: line 19: rsi/krc2.xml says TCP, and only a KRC2 speaks it"), "{krc4}");
    let padded = refused("family = \"krc2\"", "family = \"krc2\"", "<PROTCOLLENGTH>On");
    assert!(padded.contains("line 22: frame_bytes = 2048, and rsi/krc2.xml says PROTCOLLENGTH On"), "{padded}");
}

/// The program that is told its address, as a user starts it.
#[test]
fn the_command_line_tells_a_program_a_port_of_the_right_kind() {
    let shell = Shell::new();
    let ran = shell.run(&["test", "--cell", "krc2", "--controller", "reference", "--duration", "0.8"]);
    assert!(ran.exit == 0 && ran.out.contains("200 of 200 cycles of 4 ms ran, 200 answered"), "{}{}", ran.out, ran.err);
    let nobody = "sh -c 'exec sleep 1000' # {rsi} {ft}";
    let ran = shell.run(&["test", "--cell", "krc2", "--wait", "1", "--controller", nobody]);
    assert!(ran.exit == 2 && ran.err.contains("nobody asked the sensor"), "{}", ran.err);
}
