//! The same over loopback sockets. Times are printed, and nothing depends on them.

use super::{cell, reference};
use crate::shell::Shell;
use drivers::rsi::Transport;
use harness::cell::clock::WallClock;
use harness::cell::controller::{Command, Controller, Reference, Seen, Task};
use harness::cell::on_wire::OnWire;
use harness::cell::page_reader::check_page;
use harness::cell::run::{Options, Ran, run};
use harness::cell::serve::Served;
use harness::cell::wires::{Addresses, Pace, Wires};
use harness::cell::{Cell, CellConfig};
use sim_core::effects::standard;
use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The longest wait: a machine that is busy is no failure.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A port of each robot that nobody has now.
pub fn free(cell: &Cell) -> Vec<SocketAddr> {
    let port = |nth: usize| match cell.ethernet(nth).unwrap().protocol {
        Transport::Udp => UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap(),
        Transport::Tcp => TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap(),
    };
    (0..cell.config.robots.len()).map(port).collect()
}

/// A run with the reference controller in a thread of its own, behind sockets.
fn looped(cell: &Cell, duration_s: f64) -> Ran {
    let robots = free(cell);
    through(cell, duration_s, &robots.clone(), robots)
}

/// The same where the robots send to `called`, and the controller is bound to `bound`.
pub fn through(cell: &Cell, duration_s: f64, called: &[SocketAddr], bound: Vec<SocketAddr>) -> Ran {
    heard(cell, duration_s, called, bound).0
}

/// The same, and what the controller's side has heard, by class.
pub fn heard(
    cell: &Cell,
    duration_s: f64,
    called: &[SocketAddr],
    bound: Vec<SocketAddr>,
) -> (Ran, BTreeMap<String, u64>) {
    let sensor = "127.0.0.1:0".parse().unwrap();
    let addresses = Addresses { robots: called.to_vec(), sensor, page: cell.config.sensor.page };
    let mut wires = Wires::bind(cell, &addresses, Pace::Virtual { patience: PATIENCE }, PATIENCE).unwrap();
    let addresses = Addresses { robots: bound, sensor: wires.sensor(), page: wires.page() };
    let model = cell.model(&standard()).unwrap();
    std::thread::scope(|scope| {
        let controller = scope.spawn(|| {
            let reference = Reference::new(&model, cell.first().unwrap(), Task::Dock);
            let mut events = BTreeMap::new();
            if let Some(page) = addresses.page {
                check_page(cell, page, &mut events).unwrap();
            }
            let mut on_wire = OnWire::new(cell, reference).unwrap();
            let mut served = Served::bind(cell, &addresses).unwrap();
            let answered = served.serve(&mut on_wire, PATIENCE, Duration::from_millis(500), &|| false).unwrap();
            events.append(&mut on_wire.events);
            (answered, events)
        });
        let clock = WallClock::new();
        let ran = run(cell, &standard(), &Options { duration_s, keeps: true }, &mut wires).unwrap();
        eprintln!("{} cycles over loopback in {:.0} ms", ran.cycles, clock.now().seconds() * 1e3);
        // Over TCP a controller hears that the robots have left. A datagram to a port that is closed would be an event of its own.
        let is_tcp = |nth| cell.ethernet(nth).unwrap().protocol == Transport::Tcp;
        let kept = (!(0..cell.config.robots.len()).any(is_tcp)).then_some(wires);
        let (answered, events) = controller.join().unwrap();
        drop(kept);
        assert!(answered >= ran.answered);
        (ran, events)
    })
}

#[test]
fn over_loopback_a_run_is_the_same_to_the_last_bit() {
    for (name, fault) in [
        ("bench", ""),
        ("pair", ""),
        ("krc2", ""),
        ("bench", "[[fault]]\nid = \"truncate\"\non = \"rsi-frame\"\nbytes = 30\nat = 20\n"),
        ("bench", "[[fault]]\nid = \"drop\"\non = \"rsi-frame\"\nat = \"first-contact\"\nfor = 5\n"),
        ("bench", "[[fault]]\nid = \"drop\"\non = \"rsi-reply\"\nat = 30\nfor = 200\n"),
    ] {
        let cell = cell(name, fault);
        let (here, there) = (reference(&cell, 0.8), looped(&cell, 0.8));
        assert_eq!(here.session, there.session, "{name} {fault}");
        assert_eq!(
            (here.cycles, here.answered, &here.stops),
            (there.cycles, there.answered, &there.stops),
            "{name} {fault}"
        );
    }
}

/// The bench with another sensor.
fn with_sensor(table: &str, fault: &str) -> Cell {
    let mut cell = cell("bench", "");
    let (head, _) = cell.source.text.split_once("[sensor]").unwrap();
    let address = "address = \"127.0.0.1:49153\"";
    cell.source.text = format!("{head}[sensor]\n{address}\n{table}\n{fault}");
    cell.config = CellConfig::parse("cell.toml", &cell.source.text).unwrap();
    cell
}

/// Commands over TCP and samples as datagrams (SCHUNK): the same run. Over a stream: how many samples a cycle sees is the network's
/// business, and every cycle has its answer.
#[test]
fn sensors_that_are_asked_over_tcp_are_read() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let split = with_sensor(&format!("protocol = \"schunk\"\nsamples_port = {port}"), "");
    let (here, there) = (reference(&split, 0.8), looped(&split, 0.8));
    assert!(here.session.sensed.as_ref().unwrap().value.len() > 700);
    assert_eq!(here.session, there.session);
    let stream = with_sensor("protocol = \"bota\"\nrate_hz = 1000", "");
    let robots = free(&stream);
    let (ran, events) = heard(&stream, 0.8, &robots.clone(), robots);
    assert_eq!((ran.cycles, ran.answered), (200, 200), "{events:?}");
    assert!(ran.stops.is_empty() && !events.contains_key("ft-malformed"), "{events:?}");
    // What another socket would do at the sensor's port.
    let stolen =
        with_sensor("protocol = \"bota\"\nrate_hz = 1000", "[[fault]]\nid = \"second-client\"\non = \"ft\"\nat = 9\n");
    let addresses = Addresses { robots: free(&stolen), sensor: "127.0.0.1:0".parse().unwrap(), page: None };
    let mut wires = Wires::bind(&stolen, &addresses, Pace::Virtual { patience: PATIENCE }, PATIENCE).unwrap();
    let error = run(&stolen, &standard(), &Options { duration_s: 0.8, keeps: true }, &mut wires)
        .map(drop)
        .unwrap_err()
        .to_string();
    assert!(error.contains("second-client on ft needs a sensor that is asked by datagrams"), "{error}");
}

#[test]
fn a_thousand_cycles_over_loopback_are_answered() {
    let cell = cell("bench", "");
    let clock = WallClock::new();
    let here = reference(&cell, 4.0);
    eprintln!("{} cycles in process in {:.0} ms", here.cycles, clock.now().seconds() * 1e3);
    let there = looped(&cell, 4.0);
    assert_eq!((there.cycles, there.answered), (1000, 1000));
    assert_eq!(here.session, there.session);
}

/// Counts its cycles.
struct Counting(Arc<AtomicU64>);

impl Controller for Counting {
    fn cycle(&mut self, seen: &Seen<'_>) -> Command {
        self.0.fetch_add(1, Ordering::Relaxed);
        Command { pose: seen.pose, twist: None }
    }
}

/// A computer that was stopped finds the frames of a second in its socket: it answers the newest, and makes one step.
#[test]
fn after_a_stall_the_newest_frame_alone_is_answered() {
    let cell = cell("bench", "");
    let cycles = Arc::new(AtomicU64::new(0));
    let addresses = Addresses { robots: free(&cell), sensor: free(&cell)[0], page: None };
    let mut on_wire = OnWire::new(&cell, Counting(cycles.clone())).unwrap();
    let mut served = Served::bind(&cell, &addresses).unwrap();
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    for frame in 0..50 {
        let pose = "X=\"0\" Y=\"0\" Z=\"992\" A=\"0\" B=\"0\" C=\"0\"";
        let text =
            format!("<Rob Type=\"KUKA\"><RIst {pose}/><RSol {pose}/><Delay D=\"0\"/><IPOC>{}</IPOC></Rob>", 4 * frame);
        robot.send_to(text.as_bytes(), addresses.robots[0]).unwrap();
    }
    assert_eq!(served.serve(&mut on_wire, PATIENCE, Duration::from_millis(100), &|| false).unwrap(), 1);
    let mut answer = [0; 2048];
    let length = robot.recv(&mut answer).unwrap();
    let answer = std::str::from_utf8(&answer[..length]).unwrap();
    assert!(answer.contains("<IPOC>196</IPOC>"), "{answer}");
    robot.set_nonblocking(true).unwrap();
    assert!(robot.recv(&mut [0; 16]).is_err(), "one answer");
    assert_eq!((cycles.load(Ordering::Relaxed), on_wire.events.get("rsi-unanswered")), (1, Some(&49)));
}

#[test]
fn a_controller_that_does_not_come_or_ends_is_said() {
    let shell = Shell::new();
    let test = |controller: &str| {
        shell.run(&[
            "test",
            "--cell",
            "bench",
            "--wait",
            "1",
            "--controller",
            &format!("{controller} # {{rsi}} {{ft}}"),
        ])
    };
    for (controller, what) in [
        ("./there-is-no-such-program", "cannot start"),
        ("sh -c 'echo I am broken; exit 7'", "ended before it asked"),
        ("sh -c 'exec sleep 1000'", "nobody asked the sensor"),
    ] {
        let ran = test(controller);
        assert!(ran.exit == 2 && ran.err.contains(what), "{controller}: {} {}", ran.exit, ran.err);
    }
    assert!(test("sh -c 'echo I am broken; exit 7'").err.contains("I am broken"));
    let unknown = shell.run(&["test", "--cell", "no-such-cell", "--controller", "reference"]);
    assert!(unknown.exit == 2 && unknown.err.contains("one of: bench, krc2, pair"), "{}", unknown.err);
}
