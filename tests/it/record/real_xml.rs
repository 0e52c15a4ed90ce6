//! Real Ethernet configurations, which correct axes: a recorder answers all of them with nothing.

use super::wire::bench;
use drivers::rsi::{Controller, EthernetConfig, Family, Settings};
use harness::recorder::{COMMANDED, Devices, Peer, Recorder, sensor_transport, session_record};
use harness::recording::Kind;
use sim_core::effects::standard;
use sim_core::time::Nanos;
use std::cell::Cell as Counter;
use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::time::Duration;

const FILES: [&str; 6] = [
    "fzi/ros_rsi_ethernet.xml",
    "kroshu/rsi_ethernet.xml",
    "kroshu/rsi_ext_axis_ethernet.xml",
    "kroshu/rsi_gpio_ethernet.xml",
    "kuka_experimental/KR_C2_ros_rsi_ethernet.xml",
    "kuka_experimental/KR_C4_ros_rsi_ethernet.xml",
];
const CYCLES: u64 = 100;
const POSE: [f64; 6] = [500.0, 0.0, 992.0, 0.0, 90.0, 0.0];

fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("DOCKHIL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let folder = shared.join("data/protocols/kuka_rsi_config");
    if !folder.exists() {
        println!("skipped: {} is missing; set DOCKHIL_SHARED", folder.display());
        return None;
    }
    Some(folder)
}

/// A controller with this configuration; its target at the end, and why it stopped.
fn robot(xml: &str, family: Family, address: SocketAddr) -> ([f64; 6], Option<String>) {
    let mut controller = Controller::new(Settings::new(EthernetConfig::parse(xml).unwrap(), family), POSE, [0.0; 6]);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let (mut buffer, mut events) = ([0; 4096], Vec::new());
    for _ in 0..CYCLES {
        socket.send_to(&controller.frame(&POSE, &[0.0; 6]), address).unwrap();
        let length = socket.recv(&mut buffer).unwrap();
        controller.cycle(Some(&buffer[..length]), &mut events);
    }
    (controller.target_mm_deg(), controller.stopped().map(|stop| format!("{stop:?}")))
}

#[test]
fn robots_that_are_set_up_for_ros_are_recorded() {
    let Some(folder) = folder() else { return };
    for file in FILES {
        let xml = std::fs::read_to_string(folder.join(file)).unwrap();
        let family = if file.contains("KR_C2") { Family::Krc2 } else { Family::Krc4 };
        let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut cell = bench();
        cell.config.robots[0].listen = "127.0.0.1:0".parse().unwrap();
        cell.config.robots[0].correction = "AK".to_owned();
        cell.config.sensor.address = sensor.local_addr().unwrap();
        cell.rsi[0].text = xml.clone();
        let mut devices = Devices::of(&cell, true).unwrap();
        let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
        let address = peer.addresses()[0];
        let other = std::thread::spawn(move || robot(&xml, family, address));
        let record = session_record(&cell, &standard(), Kind::Static, "peer").unwrap();
        let mut out = Vec::new();
        let mut recorder = Recorder::create(&mut out, &cell.config, &record, None).unwrap();
        // Each look at the clock is a twentieth of a millisecond.
        let looks = Counter::new(0_i64);
        let now = || {
            looks.set(looks.get() + 1);
            Nanos(1_700_000_000_000_000_000 + looks.get() * 50_000)
        };
        peer.run(&mut devices, &mut recorder, &now, &|| other.is_finished()).unwrap();
        let (target, stopped) = other.join().unwrap();
        assert_eq!(stopped, None, "{file}");
        assert_eq!(target.map(f64::to_bits), POSE.map(f64::to_bits), "{file}: nothing moves");
        let (_, summary) = recorder.finish().unwrap();
        assert_eq!((summary.robots[0].1, summary.robots[0].2), (CYCLES, CYCLES), "{file}");
        // Zero for every axis is the pose of the start.
        assert_eq!(summary.poses, [CYCLES, CYCLES], "{file}: {:?}", summary.events);
        let messages = mcap::MessageStream::new(&out).unwrap().map(Result::unwrap);
        let commanded = messages.filter(|message| message.channel.topic == COMMANDED);
        assert_eq!(commanded.count() as u64, CYCLES, "{file}");
    }
}
