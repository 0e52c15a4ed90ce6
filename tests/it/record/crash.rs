//! A recorder that is killed, and one whose disk is full.

use super::wire::{bench, rdt, rob};
use harness::cell::Cell;
use harness::recorder::{
    COMMANDED, Devices, MEASURED, Peer, Recorder, SENSOR_RAW, robot_raw, sensor_transport, session_record,
};
use harness::recording::{Clock, Grade, Kind, LiveWriter, Map, Pose, ReadOptions, Times, Wrench, read};
use sim_core::effects::standard;
use sim_core::rng::Streams;
use sim_core::time::Nanos;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Names the file that the child of the kill test writes; without it the child's test does nothing else than look.
const FILE: &str = "DOCKHIL_TEST_RECORD";
const SENSOR: &str = "DOCKHIL_TEST_SENSOR";
/// What may be lost.
const LOST_NS_MAX: i64 = 300_000_000;

pub fn unix_ns() -> i64 {
    #[expect(clippy::disallowed_types, reason = "what is lost is counted in real time")]
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
    since.as_nanos() as i64
}

fn cell(sensor: &str) -> Cell {
    let mut cell = bench();
    cell.config.robots[0].listen = "127.0.0.1:0".parse().unwrap();
    cell.config.sensor.address = sensor.parse().unwrap();
    cell
}

/// The recorder that the kill test starts as a process of its own, from this same program.
#[test]
fn as_a_child_it_records_until_it_is_killed() {
    let (Ok(file), Ok(sensor)) = (std::env::var(FILE), std::env::var(SENSOR)) else {
        println!("skipped: it runs as the child of a_killed_recorder_loses_at_most_0_3_s");
        return;
    };
    let cell = cell(&sensor);
    let mut devices = Devices::of(&cell, true).unwrap();
    let record = session_record(&cell, &standard(), Kind::FreeFlight, "peer").unwrap();
    let mut peer = Peer::open(&cell, &devices, sensor_transport(&cell).unwrap()).unwrap();
    let out = File::create_new(file).unwrap();
    let mut recorder = Recorder::create(out, &cell.config, &record, None).unwrap();
    println!("\nlistening {}", peer.addresses()[0]);
    std::io::stdout().flush().unwrap();
    let clock = || Nanos(unix_ns());
    let end = unix_ns() + 60_000_000_000;
    peer.run(&mut devices, &mut recorder, &clock, &|| unix_ns() >= end).unwrap();
}

/// Sends frames and samples for this long; the time at which the last frame was answered, and how many were.
pub fn drive(port: u16, sensor: &UdpSocket, lasts_ns: i64) -> (i64, usize) {
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    robot.connect(("127.0.0.1", port)).unwrap();
    robot.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut buffer = [0; 2048];
    // The start command says where the samples go.
    let (_, client) = sensor.recv_from(&mut buffer).unwrap();
    let (begun, mut nth, mut answered) = (unix_ns(), 0, 0);
    while unix_ns() - begun < lasts_ns {
        let pose = [0.0, 0.0, 992.0 + nth as f64 * 1e-3, 0.0, 0.0, 0.0];
        robot.send(&rob(1000 + 4 * nth as u64, pose, [0.0; 6])).unwrap();
        for fourth in 0..4 {
            let count = 4 * nth as u32 + fourth;
            sensor.send_to(&rdt(count + 1, 7 * count, [0.0, 0.0, f64::from(count)]), client).unwrap();
        }
        let length = robot.recv(&mut buffer).unwrap();
        answered = unix_ns();
        let reply = String::from_utf8_lossy(&buffer[..length]).into_owned();
        assert!(reply.contains(&format!("<IPOC>{}</IPOC>", 1000 + 4 * nth)), "{reply}");
        nth += 1;
        std::thread::sleep(Duration::from_millis(4));
    }
    (answered, nth)
}

#[test]
fn a_killed_recorder_loses_at_most_0_3_s() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Streams::new(11).named("kill");
    for run in 0..5 {
        let file = folder.path().join(format!("{run}.mcap"));
        let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
        sensor.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "record::crash::as_a_child_it_records_until_it_is_killed", "--nocapture"])
            .env(FILE, &file)
            .env(SENSOR, sensor.local_addr().unwrap().to_string())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let port = lines.find_map(|line| line.ok()?.strip_prefix("listening 127.0.0.1:")?.parse::<u16>().ok());
        let lasts_ns = 500_000_000 + (random.uniform() * 700e6) as i64;
        let (answered, frames) = drive(port.unwrap(), &sensor, lasts_ns);
        // SIGKILL: nothing of the program runs after it.
        child.kill().unwrap();
        child.wait().unwrap();
        // By the times of receipt: this robot counts 4 ms for what takes it longer.
        let map = Map { clock: Clock::Log, ..Map::default() };
        let session = read(&file, &ReadOptions { map, salvage: false }).unwrap();
        let measured = session.measured.unwrap();
        let last_ns = session.start_ns + measured.time_ns.last().unwrap();
        let lost_ns = answered - last_ns;
        assert!(lost_ns <= LOST_NS_MAX, "run {run}: {:.3} s are lost", lost_ns as f64 * 1e-9);
        assert!(measured.value.len() <= frames && session.sensed.unwrap().value.len() <= 4 * frames);
        assert!(matches!(session.grade, Grade::B | Grade::D), "{:?}", session.grade);
        println!("run {run}: {} of {frames} frames, {:.3} s lost", measured.value.len(), lost_ns as f64 * 1e-9);
    }
}

/// A disk with room for so many bytes.
struct Disk {
    bytes: Vec<u8>,
    room: usize,
}

impl Write for &mut Disk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let taken = bytes.len().min(self.room - self.bytes.len());
        self.bytes.extend(&bytes[..taken]);
        if taken == 0 && !bytes.is_empty() {
            return Err(std::io::ErrorKind::StorageFull.into());
        }
        Ok(taken)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Two seconds of poses and wrenches; the error that ended them.
fn record(out: impl Write) -> Result<(), String> {
    let session = [("kind".to_owned(), "free-flight".to_owned())].into();
    let words = |error: harness::error::Error| format!("{error}; {}", error.help.clone().unwrap_or_default());
    let mut live = LiveWriter::create(out, &session).map_err(words)?;
    for nth in 0..2000_i64 {
        let at_ns = 1_700_000_000_000_000_000 + nth * 1_000_000;
        let times = Times { received_ns: at_ns, stamp_ns: at_ns };
        let part = nth as f64 * 1.1e-7;
        live.wrench("/ft/wrench", times, &Wrench { force_n: [libm::sin(part), 0.0, part], torque_n_m: [0.0; 3] })
            .map_err(words)?;
        if nth % 4 == 0 {
            let pose = Pose { position_m: [0.0, 0.0, part], orientation_xyzw: [0.0, 0.0, 0.0, 1.0] };
            live.pose(COMMANDED, times, &pose).and_then(|()| live.pose(MEASURED, times, &pose)).map_err(words)?;
        }
    }
    live.finish().map(|_| ()).map_err(words)
}

#[test]
fn a_full_disk_is_an_error_and_what_it_took_is_readable() {
    let mut whole = Disk { bytes: Vec::new(), room: usize::MAX };
    record(&mut whole).unwrap();
    let length = whole.bytes.len();
    for part in [30, 50, 70, 95] {
        let mut disk = Disk { bytes: Vec::new(), room: length * part / 100 };
        let error = record(&mut disk).unwrap_err();
        assert!(error.starts_with("writing failed after ") && error.contains("make room on the disk"), "{error}");
        let session = harness::recording::from_bytes("s.mcap", &disk.bytes, &ReadOptions::default()).unwrap();
        assert_eq!(session.grade, Grade::B);
        let samples = session.sensed.unwrap().value.len();
        // Chunks are alike, so that their share is that of the bytes; a chunk is 5 % and the summary a few.
        assert!(samples * 100 >= 2000 * (part - 10), "{samples} of 2000 at {part} %");
    }
    for room in [0, 10, 200] {
        let error = record(&mut Disk { bytes: Vec::new(), room }).unwrap_err();
        assert!(error.starts_with("writing failed after "), "{error}");
    }
}

#[test]
fn the_device_that_is_always_full_is_an_error() {
    if !Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let error = record(File::options().write(true).open("/dev/full").unwrap()).unwrap_err();
    assert!(error.starts_with("writing failed after 0 bytes: No space left on device"), "{error}");
}

#[test]
fn a_live_recording_that_ends_well_has_its_summary() {
    let mut disk = Disk { bytes: Vec::new(), room: usize::MAX };
    record(&mut disk).unwrap();
    let session = harness::recording::from_bytes("s.mcap", &disk.bytes, &ReadOptions::default()).unwrap();
    assert_eq!((session.grade, session.sensed.unwrap().value.len()), (Grade::A, 2000));
    assert!(disk.bytes.ends_with(mcap::MAGIC));
}

/// Half an hour of chunks with a message on each of five topics. What grows with the time is the summary alone: it holds an entry
/// for each chunk, however much is in it.
#[test]
fn what_a_long_recording_keeps_in_memory_is_its_index() {
    let (session, mut out) = (std::collections::BTreeMap::new(), std::io::sink());
    let mut live = LiveWriter::create(&mut out, &session).unwrap();
    let topics = [SENSOR_RAW, robot_raw("/rsi/chaser")];
    let pose = Pose { position_m: [0.0; 3], orientation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let wrench = Wrench { force_n: [0.0; 3], torque_n_m: [0.0; 3] };
    let memory = allocation_counter::measure(|| {
        for nth in 0..18_000_i64 {
            let at_ns = 1_700_000_000_000_000_000 + nth * 100_000_000;
            let times = Times { received_ns: at_ns, stamp_ns: at_ns };
            live.wrench("/ft/wrench", times, &wrench).unwrap();
            live.pose(COMMANDED, times, &pose).and_then(|()| live.pose(MEASURED, times, &pose)).unwrap();
            topics.iter().for_each(|topic| live.json(topic, times, &serde_json::json!({})).unwrap());
            live.tick(at_ns + 100_000_000).unwrap();
        }
    });
    let megabytes_per_hour = 2.0 * memory.bytes_current as f64 / 1e6;
    eprintln!("{megabytes_per_hour:.1} MB kept for an hour, at most {:.1} MB", 2.0 * memory.bytes_max as f64 / 1e6);
    assert!(megabytes_per_hour < 40.0, "{megabytes_per_hour} MB for an hour");
}
