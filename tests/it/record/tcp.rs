//! Robots over TCP: as their PC and in between, against the virtual cell; links that close, come again, or lead nowhere.

use super::live::{any, clock, session};
use super::wire::rob;
use crate::cell::sockets::{PATIENCE, through};
use crate::cell::{cell, reference};
use harness::cell::Cell;
use harness::cell::run::{Options, run};
use harness::cell::wires::{Addresses, Pace, Wires};
use harness::recorder::{Devices, Peer, Proxy, Recorder, Summary, sensor_transport, session_record};
use harness::recording::Kind;
use sim_core::effects::standard;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

const CYCLES: u64 = 200;
const POSE: [f64; 6] = [0.0, 0.0, 992.0, 0.0, 0.0, 0.0];

fn free() -> SocketAddr {
    TcpListener::bind(any()).unwrap().local_addr().unwrap()
}

fn seen(summary: &Summary, class: &str) -> Option<u64> {
    summary.events.get(&("chaser".to_owned(), class.to_owned())).copied()
}

fn connected(to: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(to).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// A robot that comes again: a piece of a frame is lost with its connection, a second client is sent away.
fn comes_again(address: SocketAddr) {
    let frame = rob(9_000_000, POSE, POSE);
    connected(address).write_all(&frame[..100]).unwrap();
    let mut robot = connected(address);
    robot.write_all(&frame[..50]).unwrap();
    assert_eq!(connected(address).read(&mut [0; 16]).unwrap(), 0, "one robot at a time");
    robot.write_all(&frame[50..]).unwrap();
    let mut reply = Vec::new();
    while !reply.ends_with(b"</Sen>") {
        let mut buffer = [0; 1024];
        let length = robot.read(&mut buffer).unwrap();
        assert!(length > 0, "it is held");
        reply.extend_from_slice(&buffer[..length]);
    }
    let text = String::from_utf8(reply).unwrap();
    assert!(text.contains("<IPOC>9000000</IPOC>") && text.contains("Z=\"0.0000\""), "{text}");
}

#[test]
fn a_peer_holds_a_robot_that_connects_and_one_that_comes_again() {
    let address = free();
    let mut cell = cell("krc2", "");
    cell.config.robots[0].listen = address;
    let addresses = Addresses { robots: vec![address], sensor: any(), page: None };
    let mut wires = Wires::bind(&cell, &addresses, Pace::Virtual { patience: PATIENCE }, PATIENCE).unwrap();
    cell.config.sensor.address = wires.sensor();
    let mut devices = Devices::of(&cell, true).unwrap();
    let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
    let error = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap_err().to_string();
    assert!(error.contains("TCP port") && error.contains("in use"), "{error}");
    let record = session_record(&cell, &standard(), Kind::FreeFlight, "peer").unwrap();
    let virtual_cell: Cell = cell.clone();
    let robot = std::thread::spawn(move || {
        let ran = run(&virtual_cell, &standard(), &Options { duration_s: 0.8, keeps: true }, &mut wires).unwrap();
        drop(wires);
        comes_again(address);
        ran
    });
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    let is_over = || robot.is_finished();
    let now = clock(&is_over);
    peer.run(&mut devices, &mut recorder, &now, &is_over).unwrap();
    drop(now);
    let ran = robot.join().unwrap();
    assert_eq!((ran.cycles, ran.answered, ran.stops.len(), ran.left), (CYCLES, CYCLES, 0, false), "{:?}", ran.events);
    assert!(ran.events.is_empty(), "{:?}", ran.events);
    let (_, summary) = recorder.finish().unwrap();
    assert_eq!((summary.robots[0].1, summary.robots[0].2), (CYCLES + 1, CYCLES + 1), "{:?}", summary.events);
    assert_eq!((seen(&summary, "rsi-hello"), seen(&summary, "net-stranger")), (Some(1), Some(1)));
    assert_eq!(seen(&summary, "rsi-malformed"), None, "half a frame is gone with its connection");
    // The virtual cell, the robot that broke off, and perhaps the last one.
    assert!(seen(&summary, "net-closed").is_some_and(|count| count >= 2), "{:?}", summary.events);
    let commanded = session(&out).commanded.unwrap();
    assert_eq!(commanded.value.len() as u64, CYCLES + 1);
    assert!(commanded.value.iter().all(|pose| (pose.position_m[2] + 0.008).abs() < 1e-12), "where RSI was started");
}

#[test]
fn a_proxy_over_tcp_changes_no_bit_of_a_run() {
    let controller = free();
    let mut cell = cell("krc2", "");
    cell.config.robots[0].listen = controller;
    let mut devices = Devices::of(&cell, false).unwrap();
    let mut proxy = Proxy::open(&cell, &devices, &[any()], None).unwrap();
    let side = proxy.addresses()[0];
    let record = session_record(&cell, &standard(), Kind::Impact, "proxy").unwrap();
    let virtual_cell: Cell = cell.clone();
    let others = std::thread::spawn(move || {
        // The PC's program is not there yet: as without a proxy, the robot has nobody to speak to.
        assert_eq!(connected(side).read(&mut [0; 16]).unwrap(), 0);
        through(&virtual_cell, 0.8, &[side], vec![controller])
    });
    let mut out = Vec::new();
    let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
    let is_over = || others.is_finished();
    let now = clock(&is_over);
    proxy.run(&mut devices, &mut recorder, &now, &is_over).unwrap();
    drop(now);
    let there = others.join().unwrap();
    let here = reference(&cell, 0.8);
    assert_eq!((here.first_difference(&there), here.session == there.session), (None, true));
    let (_, summary) = recorder.finish().unwrap();
    assert_eq!((summary.robots[0].1, summary.robots[0].2), (CYCLES, CYCLES));
    assert_eq!((seen(&summary, "net-unreachable"), seen(&summary, "rsi-malformed")), (Some(1), None));
    assert!(seen(&summary, "net-closed").is_some(), "{:?}", summary.events);
    assert!(proxy.to_pc.spread().is_some() && proxy.to_robot.spread().is_some());
}
