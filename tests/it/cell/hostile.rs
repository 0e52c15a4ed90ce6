//! Hostile peers, two clients, ports in use and the configuration for another sensor, by command, on loopback: each a clear error,
//! or an event that is counted.

use super::cell;
use crate::shell::{Ran, Shell};
use harness::cli::{Console, Look, controller};
use sim_core::effects::standard;
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::time::Duration;

/// A port that nobody has now.
fn free() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

/// A cell in a folder, on ports of its own.
struct Bench {
    shell: Shell,
    robot: SocketAddr,
    sensor: SocketAddr,
    page: Option<SocketAddr>,
    text: String,
}

impl Bench {
    fn new(added: &str) -> Self {
        let shell = Shell::new();
        for file in fixtures::CELL_FILES.iter().filter(|file| file.name.contains('/')) {
            std::fs::create_dir_all(shell.path(file.name).parent().unwrap()).unwrap();
            shell.write(file.name, file.text);
        }
        let (robot, sensor) = (free(), free());
        let text = cell("bench", added).source.text;
        let text = text.replace("127.0.0.1:49152", &robot.to_string()).replace("127.0.0.1:49153", &sensor.to_string());
        shell.write("cell.toml", &text);
        Bench { shell, robot, sensor, page: None, text }
    }

    /// The cell by its command, and beside it the controller by its own.
    fn run(&self, more: &[&str]) -> (Ran, Ran) {
        let cell = ["cell", "--cell", "DIR/cell.toml", "--duration", "0.4", "--patience", "60000"];
        std::thread::scope(|scope| {
            let controller = scope.spawn(|| self.controller("cell.toml", more));
            let ran = self.shell.run(&cell);
            (ran, controller.join().unwrap())
        })
    }

    /// With a page of the sensor; `other.toml` is for another one.
    fn with_page(added: &str) -> Self {
        let mut bench = Bench::new(added);
        let page = free();
        bench.page = Some(page);
        bench.text = bench.text.replace("[sensor]\n", &format!("[sensor]\npage = \"{page}\"\n"));
        bench.shell.write("cell.toml", &bench.text);
        let other = bench.text.replace("counts_per_n = 1000000", "counts_per_n = 500000");
        bench.shell.write("other.toml", &other);
        bench
    }

    fn controller(&self, cell: &str, more: &[&str]) -> Ran {
        let is_there = |page: &SocketAddr| TcpStream::connect(page).is_ok();
        let mut looks = 0;
        while self.page.as_ref().is_some_and(|page| !is_there(page)) {
            looks += 1;
            assert!(looks < 3000, "the cell does not serve its page");
            std::thread::sleep(Duration::from_millis(20));
        }
        let cell = self.shell.path(cell).display().to_string();
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let silence = if more.contains(&"--silence") { &[][..] } else { &["--silence", "500"] };
        let args = [&["dockhil-controller", "--cell", &cell], silence, more].concat();
        let exit = controller(args, &standard(), &mut Console::new(&mut out, &mut err, Look::default()));
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Ran { exit, out: text(out), err: text(err) }
    }
}

/// The exit code, and all that was said.
fn said(ran: &Ran) -> String {
    format!("exit {}\n{}{}", ran.exit, ran.out, ran.err)
}

fn check(ran: &Ran, exit: u8, parts: &[&str]) {
    let text = said(ran).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(ran.exit == exit && parts.iter().all(|part| text.contains(part)), "{parts:?}\n{}", said(ran));
}

/// The line with the hash of all that was exchanged.
fn exchange(ran: &Ran) -> &str {
    ran.out.lines().find(|line| line.trim_start().starts_with("exchange ")).expect("a run tells its exchange")
}

#[test]
fn a_stranger_is_counted_and_changes_nothing() {
    let calm = Bench::new("").run(&[]);
    check(&calm.0, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
    check(&calm.1, 0, &["100 frames answered"]);
    let fault = "[[fault]]\nid = \"foreign-peer\"\non = \"rsi-frame\"\nat = 50\nfor = 3\n";
    let (cell, computer) = Bench::new(fault).run(&[]);
    check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
    check(&computer, 0, &["100 frames answered", "net-stranger: 1"]);
    assert_eq!(exchange(&cell), exchange(&calm.0), "the exchange is the same to the last bit");
    let fault = "[[fault]]\nid = \"foreign-peer\"\non = \"rsi-reply\"\nat = 50\nfor = 3\n";
    let (cell, computer) = Bench::new(fault).run(&[]);
    check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered", "cell-stranger 1"]);
    assert!(!computer.out.contains("net-stranger"), "{}", said(&computer));
    assert_eq!(exchange(&cell), exchange(&calm.0));
}

/// Who comes before the robot takes the link: the robot is then the stranger, has no answers and stops.
#[test]
fn a_stranger_that_comes_first_takes_the_link_and_the_robot_stops() {
    let bench = Bench::new("[[fault]]\nid = \"foreign-peer\"\non = \"rsi-frame\"\nat = 0\n");
    let fewer = bench.text.replace("limit = 100", "limit = 3");
    bench.shell.write("cell.toml", &fewer);
    let (cell, computer) = std::thread::scope(|scope| {
        let computer = scope.spawn(|| bench.controller("cell.toml", &[]));
        let cell = ["cell", "--cell", "DIR/cell.toml", "--duration", "0.4", "--patience", "100"];
        (bench.shell.run(&cell), computer.join().unwrap())
    });
    check(&cell, 1, &["0 answered", "cell-stranger-answered 1", "chaser: RSI stopped", "RSITimeout"]);
    check(&computer, 0, &["1 frames answered", "net-stranger: 1"]);
}

/// Whatever comes from anywhere before and beside the cell: the computer names it, and does its work.
#[test]
fn garbage_from_strangers_does_not_take_the_link() {
    let bench = Bench::new("");
    let (stop, is_over) = std::sync::mpsc::channel::<()>();
    let robot = bench.robot;
    let garbage = std::thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let wait = Duration::from_millis(1);
        while is_over.recv_timeout(wait) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
            for bytes in [&b""[..], b"\0\xff\xfe", b"<Sen Type=\"X\"></Sen>", &[b'<'; 9000]] {
                // Before the controller is there, this port is closed.
                let _ = socket.send_to(bytes, robot);
            }
        }
    });
    let (cell, computer) = bench.run(&[]);
    drop(stop);
    garbage.join().unwrap();
    check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
    check(&computer, 0, &["100 frames answered"]);
    let named = computer.out.contains("net-invalid") || computer.out.contains("net-stranger");
    assert!(named, "{}", said(&computer));
}

#[test]
fn a_second_client_takes_the_stream_and_the_computer_takes_it_back() {
    let fault = "[[fault]]\nid = \"second-client\"\non = \"ft\"\nat = 150\nfor = 40\n";
    let (cell, computer) = Bench::new(fault).run(&[]);
    check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
    check(&computer, 0, &["100 frames answered", "ft-stale", "ft-start-resent"]);
}

#[test]
fn a_port_in_use_is_said_with_its_number() {
    let bench = Bench::new("");
    let _robot = UdpSocket::bind(bench.robot).unwrap();
    let port = bench.robot.port().to_string();
    check(&bench.controller("cell.toml", &[]), 2, &["UDP port", &port, "is in use", "ss -ulpn", "help:"]);
    let _sensor = UdpSocket::bind(bench.sensor).unwrap();
    let port = bench.sensor.port().to_string();
    check(&bench.shell.run(&["cell", "--cell", "DIR/cell.toml"]), 2, &["UDP port", &port, "is in use", "help:"]);
}

#[test]
fn the_configuration_for_another_sensor_is_refused_before_anything_moves() {
    let bench = Bench::with_page("");
    check(&bench.run(&[]).1, 0, &["100 frames answered"]);
    std::thread::scope(|scope| {
        let cell = scope.spawn(|| bench.shell.run(&["cell", "--cell", "DIR/cell.toml", "--wait", "8"]));
        let refused = bench.controller("other.toml", &[]);
        let parts = ["other.toml", "counts_per_n = 500000, and the page of the sensor at 127.0.0.1:", "says 1000000"];
        check(&refused, 2, &[&parts[..], &["this is the configuration for another sensor", "help: give"]].concat());
        check(&cell.join().unwrap(), 2, &["nobody asked the sensor"]);
    });
}

#[test]
fn a_page_that_does_not_come_is_asked_for_again_and_given_up() {
    for (fault, why) in [
        ("id = \"http-not-found\"\non = \"http\"\nat = 0\nfor = 3", "the server answers 404 Not Found"),
        ("id = \"http-half-page\"\non = \"http\"\nat = 0\nfor = 3", "only a part came"),
    ] {
        let bench = Bench::with_page(&format!("[[fault]]\n{fault}\n"));
        std::thread::scope(|scope| {
            let cell = scope.spawn(|| bench.shell.run(&["cell", "--cell", "DIR/cell.toml", "--wait", "8"]));
            let refused = bench.controller("cell.toml", &[]);
            check(&refused, 2, &["net-page: 3", "the sensor's page cannot be read, 3 tries", why, "help: correct"]);
            check(&cell.join().unwrap(), 2, &["nobody asked the sensor"]);
        });
        // Once is not for ever.
        let bench = Bench::with_page(&format!("[[fault]]\n{}\n", fault.replace("for = 3", "for = 1")));
        let (cell, computer) = bench.run(&[]);
        check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
        check(&computer, 0, &["100 frames answered", "net-page: 1"]);
    }
}

#[test]
fn what_the_cell_cannot_do_is_refused_at_its_line() {
    let refused = |fault: &str, parts: &[&str]| {
        let bench = Bench::new(&format!("[[fault]]\n{fault}\n"));
        let line = bench.text.lines().position(|line| line == "[[fault]]").unwrap() + 2;
        let ran = bench.shell.run(&["test", "--controller", "reference", "--cell", "DIR/cell.toml"]);
        check(&ran, 2, &[&[&format!("cell.toml: line {line}:")[..], "help:"], parts].concat());
    };
    for row in drivers::fault::TABLE.iter() {
        use drivers::fault::Needs;
        if matches!(row.needs, Needs::ForeignSocket | Needs::ClosedPort | Needs::SecondClient) {
            let fault = format!("id = \"{}\"\non = \"{}\"\nat = 3", row.id, row.on.id());
            refused(&fault, &["needs sockets, and the reference inside has none", "--controller 'dockhil-controller"]);
        }
    }
    refused("id = \"http-not-found\"\non = \"http\"\nat = 0", &["has no page", "add page ="]);
    refused(
        "id = \"ipoc-crossing\"\non = \"rsi-frame\"\nwraps = true\nat = \"first-contact\"",
        &["cannot wait for an event", "give the number of that cycle"],
    );
}

#[test]
fn an_unknown_key_of_the_sensor_is_shown_where_it_stands() {
    let bench = Bench::new("");
    let text = bench.text.replace("rate_hz = 1000", "rate_hs = 1000");
    let line = text.lines().position(|line| line.starts_with("rate_hs")).unwrap() + 1;
    bench.shell.write("cell.toml", &text);
    let ran = bench.shell.run(&["test", "--controller", "reference", "--cell", "DIR/cell.toml"]);
    check(&ran, 2, &[&format!("cell.toml: line {line}: sensor: unknown field `rate_hs`"), "`rate_hz`"]);
}

#[test]
fn a_fault_of_the_network_that_did_nothing_is_an_error_of_the_run() {
    let bench = Bench::new("[[fault]]\nid = \"foreign-peer\"\non = \"rsi-frame\"\nat = 4000\n");
    let (cell, _) = bench.run(&[]);
    check(&cell, 6, &["foreign-peer on rsi-frame did nothing"]);
}

/// A controller that answers so many frames, each so many times, and goes.
fn answers_and_goes(robot: SocketAddr, sensor: SocketAddr, frames: usize, times: usize) {
    let link = UdpSocket::bind(robot).unwrap();
    let reader = UdpSocket::bind("127.0.0.1:0").unwrap();
    // RDT: header, start, without end. The cell may not be there yet: then the request is lost.
    let start = [0x12, 0x34, 0, 2, 0, 0, 0, 0];
    let mut buffer = [0; 4096];
    link.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    let mut answered = 0;
    while answered < frames {
        if answered == 0 {
            let _ = reader.send_to(&start, sensor);
        }
        let Ok((length, from)) = link.recv_from(&mut buffer) else { continue };
        let text = std::str::from_utf8(&buffer[..length]).unwrap();
        let ipoc = text.split("<IPOC>").nth(1).and_then(|rest| rest.split('<').next()).unwrap();
        let zero = "<RKorr X=\"0\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\"/>";
        for _ in 0..times {
            link.send_to(format!("<Sen Type=\"ImFree\">{zero}<IPOC>{ipoc}</IPOC></Sen>").as_bytes(), from).unwrap();
        }
        answered += 1;
    }
}

#[test]
fn a_controller_that_leaves_early_is_no_pass_and_what_was_until_then_is_saved() {
    let bench = Bench::new("");
    let sentype = bench.shell.read("rsi/bench.xml");
    assert!(sentype.contains("<SENTYPE>ImFree</SENTYPE>"), "{sentype}");
    let args = ["cell", "--cell", "DIR/cell.toml", "--duration", "1", "-o", "DIR/s.mcap", "--json", "DIR/r.json"];
    let ran = std::thread::scope(|scope| {
        scope.spawn(|| answers_and_goes(bench.robot, bench.sensor, 30, 1));
        bench.shell.run(&args)
    });
    check(&ran, 1, &["the controller left in cycle 31 of 250"]);
    let told: serde_json::Value = serde_json::from_str(&bench.shell.read("r.json")).unwrap();
    assert_eq!((&told["left_early"], &told["planned"], &told["answered"]), (&true.into(), &250.into(), &30.into()));
    check(&bench.shell.run(&["model", "init", "DIR/s.mcap", "-o", "DIR/of_s.toml"]), 0, &["written"]);
}

/// When a second answer comes is chance: the run is the same all the same.
#[test]
fn a_controller_that_answers_twice_makes_the_run_of_one_that_answers_once() {
    let exchanges = [1, 2, 3].map(|times| {
        let bench = Bench::new("");
        let args = ["cell", "--cell", "DIR/cell.toml", "--duration", "0.4", "--patience", "60000"];
        let ran = std::thread::scope(|scope| {
            scope.spawn(|| answers_and_goes(bench.robot, bench.sensor, 100, times));
            bench.shell.run(&args)
        });
        check(&ran, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
        assert_eq!(ran.out.contains("cell-spare-answer"), times > 1, "{}", said(&ran));
        assert!(!ran.out.contains("controller-"), "{}", said(&ran));
        exchange(&ran).to_owned()
    });
    assert!(exchanges.iter().all(|exchange| *exchange == exchanges[0]), "{exchanges:?}");
}

#[test]
fn what_a_cell_does_not_have_is_no_address() {
    let bench = Bench::new("");
    let args = ["test", "--cell", "DIR/cell.toml", "--controller"];
    for key in ["{rsi2}", "{page}"] {
        let ran = bench.shell.run(&[&args[..], &[&format!("./any {{rsi}} {key}")]].concat());
        check(&ran, 2, &["asks for what this cell does not have", "{rsi2}"]);
    }
}

#[test]
fn a_run_says_what_each_fault_did_and_what_the_driver_saw() {
    let bench = Bench::new("[[fault]]\nid = \"drop\"\non = \"ft\"\nat = 100\nfor = 3\n");
    let args = ["test", "--cell", "DIR/cell.toml", "--controller", "reference"];
    let ran = bench.shell.run(&args);
    check(&ran, 0, &["✓ drop on ft 3 100", "driver ft-gap 1", "✓ pass: "]);
    let ran = bench.shell.run(&[&args[..], &["--report", "DIR/page.html", "-o", "DIR/s.mcap"]].concat());
    check(&ran, 0, &["page.html: written"]);
    let page = bench.shell.read("page.html");
    for part in [
        "drop on ft",
        "ft-gap",
        "reported position in mm",
        "commanded position in mm",
        "reading of the sensor in N",
        "s.mcap",
    ] {
        assert!(page.contains(part), "the page does not have {part:?}");
    }
    let twice = bench.shell.run(&[&args[..], &["--report", "DIR/s", "-o", "DIR/s"]].concat());
    check(&twice, 2, &["is named for two results"]);
    let ran = bench.shell.run(&[&args[..], &["--json", "-"]].concat());
    let told: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!((&told["faults"][0]["acted"], &told["driver_events"]["ft-gap"]), (&3.into(), &1.into()), "{told}");
    let refused = bench.shell.run(&[&args[..], &["--real-time"]].concat());
    check(&refused, 2, &["--real-time needs a program"]);
}

#[test]
fn a_controller_that_nobody_comes_to_has_nothing_to_run() {
    let bench = Bench::new("");
    check(&bench.controller("cell.toml", &["--wait", "1"]), 4, &["no frame of a robot came in 1 s", "--wait"]);
    check(&bench.controller("cell.toml", &["--silence", "0"]), 2, &["0 is not in 1.."]);
    let fast = ["a start with 1e30 m/s is outside [-10, 10]", "argument --velocity"];
    check(&bench.controller("cell.toml", &["--velocity", "1e30"]), 2, &fast);
    let args = ["test", "--cell", "DIR/cell.toml", "--controller", "reference", "--velocity", "1e30"];
    check(&bench.shell.run(&args), 2, &fast);
}

#[test]
fn a_robot_that_does_not_tell_its_pose_is_refused() {
    let bench = Bench::new("");
    let xml = bench.shell.read("rsi/bench.xml");
    assert!(xml.contains("DEF_RIst"));
    bench.shell.write("rsi/bench.xml", &xml.replace("DEF_RIst", "DEF_AIPos"));
    let args = ["test", "--cell", "DIR/cell.toml", "--controller", "reference"];
    check(&bench.shell.run(&args), 2, &["rsi/bench.xml: SEND has no DEF_RIst", "add DEF_RIst"]);
}

#[test]
fn faults_are_listed_and_a_cell_is_extracted_to_be_changed() {
    let shell = Shell::new();
    let list = shell.run(&["cell", "--list-faults"]);
    assert!(list.exit == 0 && list.out.contains("\nduplicate: "), "{}{}", list.out, list.err);
    let ran = shell.run(&["cell", "--cell", "pair", "--extract", "DIR/mine"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    let text = shell.read("mine/pair.toml");
    shell.write("mine/pair.toml", &format!("{text}\n[[fault]]\nid = \"dorp\"\non = \"ft\"\nat = 1\n"));
    let args = ["test", "--cell", "DIR/mine/pair.toml", "--controller", "reference", "--duration", "0.1"];
    check(&shell.run(&args), 2, &["no fault and no effect is called \"dorp\"; did you mean drop?", "--list-faults"]);
    shell.write("mine/pair.toml", &text);
    check(&shell.run(&args), 0, &["25 of 25 cycles of 4 ms ran, 25 answered"]);
    let again = shell.run(&["cell", "--cell", "pair", "--extract", "DIR/mine"]);
    check(&again, 2, &["exists already"]);
}

/// What is no request takes no stream away.
#[test]
fn noise_at_the_sensors_port_takes_nothing() {
    let calm = Bench::new("").run(&[]).0;
    let bench = Bench::new("");
    let (cell, _) = std::thread::scope(|scope| {
        let noise = scope.spawn(|| {
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            for _ in 0..50 {
                let _ = socket.send_to(b"noise that is no request of any kind", bench.sensor);
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        let ran = bench.run(&[]);
        noise.join().unwrap();
        ran
    });
    check(&cell, 0, &["100 of 100 cycles of 4 ms ran, 100 answered"]);
    assert_eq!(exchange(&cell), exchange(&calm), "the exchange is the same to the last bit");
}

/// A result replaces an older result, and nothing else.
#[test]
fn a_result_replaces_no_file_that_is_none() {
    let bench = Bench::new("");
    let args = ["test", "--cell", "DIR/cell.toml", "--controller", "reference", "--duration", "0.1"];
    for (flag, file) in [("--json", "cell.toml"), ("--report", "rsi/bench.xml"), ("--json", "models/bench.toml")] {
        let before = bench.shell.read(file);
        let ran = bench.shell.run(&[&args[..], &[flag, &format!("DIR/{file}")]].concat());
        check(&ran, 2, &["is read by this command"]);
        assert_eq!(bench.shell.read(file), before);
    }
    bench.shell.write("work.txt", "mine");
    let ran = bench.shell.run(&[&args[..], &["--json", "DIR/work.txt"]].concat());
    check(&ran, 2, &["work.txt: exists already, is no result of this program"]);
    assert_eq!(bench.shell.read("work.txt"), "mine");
    for _ in 0..2 {
        let both = ["--json", "DIR/r.json", "--report", "DIR/r.html"];
        check(&bench.shell.run(&[&args[..], &both].concat()), 0, &["r.json: written", "r.html: written"]);
    }
}
