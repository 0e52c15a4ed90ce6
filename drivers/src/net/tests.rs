//! Sockets on loopback. Waits end after ten seconds, with a message that says what was waited for.

use super::*;
use std::cell::Cell;
use std::net::TcpStream;

const ANY: &str = "127.0.0.1:0";
const GENEROUS: Duration = Duration::from_secs(10);

fn any() -> SocketAddr {
    ANY.parse().expect("an address")
}

/// A clock that counts how often it was asked: no test depends on real time.
fn ticking() -> impl Fn() -> Nanos {
    let asked = Cell::new(0);
    move || {
        asked.set(asked.get() + 1);
        Nanos(asked.get())
    }
}

/// Reads until there are `wanted` arrivals in all.
fn gather(endpoint: &mut Endpoint, valid: &mut dyn FnMut(&[u8]) -> bool, wanted: usize) -> Vec<Arrival> {
    let (clock, mut arrivals) = (ticking(), Vec::new());
    while arrivals.len() < wanted {
        let there = wait(&[&*endpoint], GENEROUS).expect("poll works");
        assert!(there[0], "{} of {wanted} arrivals after {GENEROUS:?}: {arrivals:?}", arrivals.len());
        endpoint.receive(&clock, valid, &mut arrivals).expect("a receive");
    }
    arrivals
}

fn client(to: &Endpoint) -> UdpSocket {
    let socket = UdpSocket::bind(ANY).expect("a free port");
    socket.connect(to.local()).expect("a way to loopback");
    socket.set_read_timeout(Some(GENEROUS)).expect("a time limit");
    socket
}

fn robot(bytes: &[u8]) -> bool {
    bytes.starts_with(b"<Rob")
}

#[test]
fn a_port_in_use_says_what_to_type() {
    let first = Endpoint::bind(any(), Lock::First).expect("a free port");
    let error = Endpoint::bind(first.local(), Lock::First).expect_err("the port is taken");
    let port = first.local().port();
    let expected =
        format!("UDP port {port} of 127.0.0.1 is in use; `ss -ulpn 'sport = :{port}'` names the program that has it");
    assert_eq!(error.to_string(), expected);

    let first = Listener::bind(any()).expect("a free port");
    let error = Listener::bind(first.local()).expect_err("the port is taken");
    assert!(error.to_string().starts_with("TCP port"), "{error}");
    assert!(error.to_string().contains("`ss -tlpn"), "{error}");

    // An address of the documentation, which no machine has.
    let error = Endpoint::bind("192.0.2.7:49152".parse().expect("an address"), Lock::First).expect_err("not ours");
    assert!(matches!(error, NetError::NotHere { .. }), "{error}");
}

#[test]
fn the_first_valid_sender_is_the_peer_and_others_are_counted() {
    let mut endpoint = Endpoint::bind(any(), Lock::First).expect("a free port");
    let (clock, mut arrivals) = (ticking(), Vec::new());
    let error = endpoint.send(&clock, b"<Sen/>", &mut arrivals).expect_err("nobody is there");
    assert!(matches!(error, NetError::NoPeer { .. }), "{error}");

    let (hostile, controller, second) = (client(&endpoint), client(&endpoint), client(&endpoint));
    hostile.send(b"GET / HTTP/1.1").expect("sent");
    controller.send(b"<Rob>1</Rob>").expect("sent");
    for _ in 0..3 {
        second.send(b"<Rob>2</Rob>").expect("sent");
    }
    hostile.send(b"<Rob>late</Rob>").expect("sent");
    controller.send(b"anything").expect("sent");
    let arrivals = gather(&mut endpoint, &mut robot, 5);
    let addresses = [&hostile, &controller, &second].map(|socket| socket.local_addr().expect("bound"));
    let expected = [
        Arrival::Invalid { at: Nanos(1), from: addresses[0], bytes: b"GET / HTTP/1.1".to_vec() },
        Arrival::Bytes { at: Nanos(2), from: addresses[1], bytes: b"<Rob>1</Rob>".to_vec() },
        Arrival::Stranger { at: Nanos(3), from: addresses[2], peer: addresses[1] },
        Arrival::Stranger { at: Nanos(6), from: addresses[0], peer: addresses[1] },
        Arrival::Bytes { at: Nanos(7), from: addresses[1], bytes: b"anything".to_vec() },
    ];
    assert_eq!(arrivals, expected);
    assert_eq!(endpoint.counts(), Counts { received: 2, strangers: 4, invalid: 1, ..Counts::default() });
    assert_eq!(endpoint.peer(), Some(addresses[1]));

    endpoint.send(&clock, b"<Sen/>", &mut Vec::new()).expect("sent");
    let mut answer = [0; 16];
    assert_eq!(controller.recv(&mut answer).expect("the answer goes to the peer"), 6);

    // After a restart the controller comes from another port.
    endpoint.forget();
    second.send(b"<Rob>3</Rob>").expect("sent");
    gather(&mut endpoint, &mut robot, 1);
    assert_eq!(endpoint.peer(), Some(addresses[2]));
}

#[test]
fn the_latest_valid_sender_takes_a_stream_away() {
    let mut sensor = Endpoint::bind(any(), Lock::Latest).expect("a free port");
    let (one, two) = (client(&sensor), client(&sensor));
    let start = |bytes: &[u8]| bytes == [0x12, 0x34, 0, 2, 0, 0, 0, 0];
    one.send(&[0x12, 0x34, 0, 2, 0, 0, 0, 0]).expect("sent");
    two.send(b"noise").expect("sent");
    two.send(&[0x12, 0x34, 0, 2, 0, 0, 0, 0]).expect("sent");
    let arrivals = gather(&mut sensor, &mut { start }, 4);
    let (one, two) = (one.local_addr().expect("bound"), two.local_addr().expect("bound"));
    assert_eq!(arrivals[1], Arrival::Stranger { at: Nanos(2), from: two, peer: one });
    assert_eq!(arrivals[2], Arrival::Taken { at: Nanos(3), from: one, by: two });
    assert_eq!(sensor.peer(), Some(two));
}

#[test]
fn a_fixed_peer_needs_no_datagram_first_and_no_valid_bytes() {
    let far = UdpSocket::bind(ANY).expect("a free port");
    let peer = far.local_addr().expect("bound");
    let mut endpoint = Endpoint::bind(any(), Lock::Only(peer)).expect("a free port");
    endpoint.send(&ticking(), b"start", &mut Vec::new()).expect("sent");
    client(&endpoint).send(b"sample").expect("sent");
    far.send_to(b"sample", endpoint.local()).expect("sent");
    let arrivals = gather(&mut endpoint, &mut |_| false, 2);
    assert!(matches!(arrivals[0], Arrival::Stranger { .. }), "{arrivals:?}");
    assert!(matches!(&arrivals[1], Arrival::Bytes { from, .. } if *from == peer), "{arrivals:?}");
    endpoint.forget();
    assert_eq!(endpoint.peer(), Some(peer));
}

#[test]
fn many_strangers_are_counted_and_few_reported() {
    let mut endpoint = Endpoint::bind(any(), Lock::First).expect("a free port");
    let controller = client(&endpoint);
    controller.send(b"<Rob/>").expect("sent");
    let strangers: Vec<UdpSocket> = (0..40).map(|_| client(&endpoint)).collect();
    for stranger in &strangers {
        stranger.send(b"<Rob/>").expect("sent");
    }
    controller.send(b"<Rob/>").expect("sent");
    let arrivals = gather(&mut endpoint, &mut robot, 2 + STRANGERS_REPORTED_MAX);
    assert_eq!(arrivals.len(), 2 + STRANGERS_REPORTED_MAX);
    assert_eq!(endpoint.counts().strangers, 40);
}

#[cfg(target_os = "linux")]
#[test]
fn an_unreachable_peer_is_an_event_and_the_port_lives_on() {
    let controller = UdpSocket::bind(ANY).expect("a free port");
    let peer = controller.local_addr().expect("bound");
    drop(controller);
    let mut endpoint = Endpoint::bind(any(), Lock::Only(peer)).expect("a free port");
    let clock = ticking();
    let mut arrivals = Vec::new();
    for _ in 0..100 {
        endpoint.send(&clock, b"<Sen/>", &mut arrivals).expect("not an error");
    }
    assert!(wait(&[&endpoint], GENEROUS).expect("poll works")[0], "the last message waits");
    endpoint.receive(&clock, &mut robot, &mut arrivals).expect("not an error");
    let unreachable =
        |arrival: &Arrival| matches!(arrival, Arrival::Unreachable { why: ErrorKind::ConnectionRefused, .. });
    assert!(!arrivals.is_empty() && arrivals.iter().all(unreachable), "{arrivals:?}");
    assert_eq!(endpoint.counts().sent, 100);
    assert!(endpoint.counts().unreachable >= arrivals.len() as u64);
    // No message is left behind, where it would take the place of datagrams.
    assert!(!wait(&[&endpoint], Duration::ZERO).expect("poll works")[0]);

    let back = UdpSocket::bind(peer).expect("the port is free again");
    back.send_to(b"<Rob/>", endpoint.local()).expect("sent");
    let arrivals = gather(&mut endpoint, &mut robot, 1);
    assert!(matches!(arrivals[0], Arrival::Bytes { .. }), "{arrivals:?}");
}

#[test]
fn the_longest_datagram_is_whole_and_a_longer_one_is_refused() {
    let mut endpoint = Endpoint::bind(any(), Lock::First).expect("a free port");
    let controller = client(&endpoint);
    let mut long = b"<Rob".to_vec();
    long.resize(PAYLOAD_BYTES_MAX, b' ');
    controller.send(&long).expect("sent");
    controller.send(b"").expect("sent");
    let arrivals = gather(&mut endpoint, &mut robot, 2);
    assert!(matches!(&arrivals[0], Arrival::Bytes { bytes, .. } if *bytes == long), "it is cut or changed");
    assert!(matches!(&arrivals[1], Arrival::Bytes { bytes, .. } if bytes.is_empty()), "an empty one is one");
    long.push(b' ');
    let error = endpoint.send(&ticking(), &long, &mut Vec::new()).expect_err("too long");
    assert_eq!(error.to_string(), "a datagram of 65508 bytes is longer than the 65507 bytes that UDP carries");
    assert!(endpoint.receive_buffer_bytes() >= RECEIVE_BUFFER_BYTES_MIN);
}

#[test]
fn a_wait_names_the_socket_and_ends() {
    let endpoint = Endpoint::bind(any(), Lock::First).expect("a free port");
    let other = Endpoint::bind(any(), Lock::First).expect("a free port");
    let listener = Listener::bind(any()).expect("a free port");
    let all: [&dyn AsFd; 3] = [&endpoint, &other, &listener];
    assert_eq!(wait(&all, Duration::from_micros(200)).expect("poll works"), [false; 3]);
    client(&other).send(b"<Rob/>").expect("sent");
    assert_eq!(wait(&all, GENEROUS).expect("poll works"), [false, true, false]);
    let _stream = TcpStream::connect(listener.local()).expect("a connection");
    assert!(wait(&all, GENEROUS).expect("poll works")[1]);
    assert!(wait(&[&listener], GENEROUS).expect("poll works")[0]);
}

fn accepted(listener: &mut Listener) -> Connection {
    assert!(wait(&[&*listener], GENEROUS).expect("poll works")[0], "nobody connects");
    listener.accept(false).expect("an accept").expect("a connection")
}

#[test]
fn one_connection_at_a_time_both_ways_until_it_closes() {
    let mut listener = Listener::bind(any()).expect("a free port");
    assert!(listener.accept(false).expect("an accept").is_none());
    let mut near = Connection::connect(listener.local(), GENEROUS).expect("a connection");
    let mut far = accepted(&mut listener);
    assert!(near.stream.nodelay().expect("an option") && far.stream.nodelay().expect("an option"));

    let mut second = TcpStream::connect(listener.local()).expect("the system takes it");
    second.set_read_timeout(Some(GENEROUS)).expect("a time limit");
    assert!(wait(&[&listener], GENEROUS).expect("poll works")[0]);
    assert!(listener.accept(true).expect("an accept").is_none());
    assert_eq!((listener.refused(), second.read(&mut [0; 8]).expect("the end")), (1, 0));
    assert_eq!(listener.last_refused(), second.local_addr().ok());

    let (clock, mut arrivals) = (ticking(), Vec::new());
    for _ in 0..3 {
        near.send(&clock, b"<Rob><IPOC>1</IPOC></Rob>", &mut arrivals).expect("sent");
    }
    let mut read = Vec::new();
    while read.len() < 75 {
        assert!(wait(&[&far], GENEROUS).expect("poll works")[0], "{} bytes came", read.len());
        far.receive(&clock, &mut arrivals).expect("a receive");
        for arrival in arrivals.drain(..) {
            let Arrival::Bytes { bytes, .. } = arrival else { panic!("{arrival:?}") };
            read.extend_from_slice(&bytes);
        }
    }
    assert_eq!(read, b"<Rob><IPOC>1</IPOC></Rob>".repeat(3));

    drop(near);
    assert!(wait(&[&far], GENEROUS).expect("poll works")[0]);
    far.receive(&clock, &mut arrivals).expect("not an error");
    assert!(matches!(arrivals[..], [Arrival::Closed { .. }]) && !far.is_open(), "{arrivals:?}");
    far.send(&clock, b"<Sen/>", &mut arrivals).expect("not an error");
    assert_eq!(arrivals.len(), 1, "it is reported once");
}

#[test]
fn what_nobody_reads_is_bounded() {
    let mut listener = Listener::bind(any()).expect("a free port");
    let _deaf = TcpStream::connect(listener.local()).expect("a connection");
    let mut connection = accepted(&mut listener);
    let (clock, mut arrivals) = (ticking(), Vec::new());
    // Far more than both systems' buffers hold.
    let error = (0..4096).find_map(|_| connection.send(&clock, &[b' '; 32_768], &mut arrivals).err());
    let error = error.expect("there is a limit").to_string();
    assert!(error.contains("the other side does not read"), "{error}");
    assert!(connection.outbox.len() <= OUTBOX_BYTES_MAX);
}

#[cfg(target_os = "linux")]
#[test]
fn a_port_that_refuses_still_sends_and_opens_again() {
    let (clock, mut arrivals) = (ticking(), Vec::new());
    let mut host = Endpoint::bind(any(), Lock::First).expect("a free port");
    let mut robot = Endpoint::bind(any(), Lock::Only(host.local())).expect("a free port");
    let exchange = |host: &mut Endpoint, robot: &mut Endpoint| {
        let mut arrivals = Vec::new();
        robot.send(&clock, b"<Rob/>", &mut arrivals).expect("sent");
        assert!(wait(&[&*host], GENEROUS).expect("poll works")[0]);
        host.receive(&clock, &mut |_| true, &mut arrivals).expect("a receive");
        host.send(&clock, b"<Sen/>", &mut arrivals).expect("sent");
        arrivals
    };
    robot.refuse().expect("it knows its peer");
    assert!(matches!(exchange(&mut host, &mut robot)[..], [Arrival::Bytes { .. }]));
    assert!(wait(&[&host], GENEROUS).expect("poll works")[0], "an error waits");
    host.receive(&clock, &mut |_| true, &mut arrivals).expect("not an error");
    assert!(matches!(arrivals[..], [Arrival::Unreachable { why: ErrorKind::ConnectionRefused, .. }]), "{arrivals:?}");
    let (local, lock) = (robot.local(), Lock::Only(host.local()));
    drop(robot);
    let mut robot = Endpoint::bind(local, lock).expect("nobody took it");
    exchange(&mut host, &mut robot);
    assert!(wait(&[&robot], GENEROUS).expect("poll works")[0], "the answer is here");
    assert!(Endpoint::bind(any(), Lock::First).expect("a free port").refuse().is_err(), "nobody to refuse");
}

/// Answers one request with `answer`, then closes or keeps the connection.
fn served(answer: &'static [u8], keep: bool) -> (SocketAddr, std::thread::JoinHandle<()>) {
    let server = TcpListener::bind(ANY).expect("a free port");
    let address = server.local_addr().expect("bound");
    let thread = std::thread::spawn(move || {
        let (mut stream, _) = server.accept().expect("a client");
        let mut request = Vec::new();
        let mut byte = [0];
        while !request.ends_with(b"\r\n\r\n") {
            stream.read_exact(&mut byte).expect("a request");
            request.push(byte[0]);
        }
        assert!(request.starts_with(b"GET /netftapi2.xml HTTP/1.0\r\nHost: 127.0.0.1:"), "{request:?}");
        stream.write_all(answer).expect("an answer");
        if keep {
            // Until the client has had enough.
            let _ = stream.read(&mut byte);
        }
    });
    (address, thread)
}

fn check_page(answer: &'static [u8], keep: bool, expected: Result<&str, &str>) {
    let (address, server) = served(answer, keep);
    let page = http_get(&ticking(), address, "/netftapi2.xml", GENEROUS);
    match (page, expected) {
        (Ok(page), Ok(expected)) => assert_eq!(page, expected),
        (Err(error), Err(part)) => {
            let error = error.to_string();
            assert!(error.starts_with(&format!("http://{address}/netftapi2.xml: ")), "{error}");
            assert!(error.contains(part), "{error:?} does not say {part:?}");
        }
        (page, expected) => panic!("{page:?}, expected {expected:?}"),
    }
    server.join().expect("the server saw what it should");
}

#[test]
fn a_page_comes_whole_or_says_why_not() {
    let whole = b"HTTP/1.0 200 OK\r\nContent-Length: 8\r\n\r\n<netft/>";
    check_page(whole, false, Ok("<netft/>"));
    check_page(whole, true, Ok("<netft/>"));
    check_page(b"HTTP/1.1 200 OK\r\n\r\n<netft/>", false, Ok("<netft/>"));
    check_page(b"HTTP/1.0 404 Not Found\r\n\r\n", false, Err("the server answers 404 Not Found"));
    check_page(b"HTTP/1.0 200 OK\r\nContent-Length: 80\r\n\r\n<netft", false, Err("after 6 bytes of 80"));
    check_page(b"HTTP/1.0 302 Found\r\n\r\n", false, Err("302, which is no page"));
    check_page(b"HTTP/1.0 200 OK\r\nContent-Len", false, Err("bytes of a head"));
}

#[test]
fn a_page_that_never_ends_has_a_limit_in_time() {
    // The wait is what is left of 5.5 s by a clock that the test moves: 0.5 s of real time at most.
    let (address, server) = served(b"HTTP/1.0 200 OK\r\nContent-Length: 80\r\n\r\n<netft", true);
    let ticks = ticking();
    let clock = || Nanos(ticks().0 * 200_000_000);
    let error = http_get(&clock, address, "/netftapi2.xml", Duration::from_secs(1)).expect_err("it never ends");
    assert!(error.to_string().contains("not whole after 1s"), "{error}");
    server.join().expect("the server saw what it should");

    // Nobody answers on this port.
    let port = UdpSocket::bind(ANY).expect("a free port").local_addr().expect("bound");
    let error = http_get(&ticking(), port, "/", GENEROUS).expect_err("nobody is there");
    assert!(error.to_string().contains("connect to"), "{error}");
}

#[test]
#[expect(clippy::disallowed_types, reason = "measures the sockets, and asserts nothing about time")]
fn a_thousand_round_trips_are_timed() {
    const TRIPS: u32 = 1000;
    let mut host = Endpoint::bind(any(), Lock::First).expect("a free port");
    let mut robot_side = Endpoint::bind(any(), Lock::Only(host.local())).expect("a free port");
    let begun = std::time::Instant::now();
    let clock = || Nanos(i64::try_from(begun.elapsed().as_nanos()).expect("a test is short"));
    let frame = [b'<'; 400];
    let mut arrivals = Vec::new();
    for _ in 0..TRIPS {
        robot_side.send(&clock, &frame, &mut arrivals).expect("sent");
        for endpoint in [&mut host, &mut robot_side] {
            while arrivals.is_empty() {
                assert!(wait(&[&*endpoint], GENEROUS).expect("poll works")[0], "a datagram is lost on loopback");
                endpoint.receive(&clock, &mut |_| true, &mut arrivals).expect("a receive");
            }
            assert_eq!(arrivals.len(), 1);
            arrivals.clear();
            if endpoint.lock == Lock::First {
                endpoint.send(&clock, &frame, &mut arrivals).expect("sent");
            }
        }
    }
    println!("{TRIPS} round trips of 400 bytes in one thread: {:.1} ms", clock().seconds() * 1e3);
    assert_eq!((host.counts().received, robot_side.counts().received), (u64::from(TRIPS), u64::from(TRIPS)));
}

/// A sensor that is asked elsewhere sends from a port that nobody was told, and after a restart from another one.
#[test]
fn a_machine_is_heard_from_any_of_its_ports() {
    let ours = Endpoint::bind(any(), Lock::Host("127.0.0.1".parse().expect("an address"))).expect("a free port");
    let (mut ours, one, two) = (ours, UdpSocket::bind(ANY).expect("free"), UdpSocket::bind(ANY).expect("free"));
    for socket in [&one, &two, &one] {
        socket.send_to(b"x", ours.local()).expect("sent");
    }
    let arrivals = gather(&mut ours, &mut |_| true, 3);
    assert!(arrivals.iter().all(|arrival| matches!(arrival, Arrival::Bytes { .. })), "{arrivals:?}");
    let other = "127.0.0.2".parse().expect("an address");
    let mut others = Endpoint::bind(any(), Lock::Host(other)).expect("a free port");
    one.send_to(b"x", others.local()).expect("sent");
    let arrivals = gather(&mut others, &mut |_| true, 1);
    assert!(matches!(arrivals[..], [Arrival::Stranger { peer, .. }] if peer.ip() == other), "{arrivals:?}");
    assert_eq!((others.counts().strangers, others.peer().map(|peer| peer.port())), (1, Some(0)));
}
