//! Recordings: sound, damaged, cut off, and everything that is no recording.

mod damaged;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use harness::error::Error;
use harness::recording::{
    Grade, Kind, Map, Pose, RawMessage, ReadOptions, Series, Session, Severity, Sink, Wrench, from_bytes, read,
    read_records, write_mcap,
};

/// The folder with the data that stays outside the project; says aloud when a test cannot run without it.
fn shared(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DOCKHIL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let path = root.join(below);
    if !path.exists() {
        println!("SKIPPED: {} is missing; set DOCKHIL_SHARED", path.display());
        return None;
    }
    Some(path)
}

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|end| end == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn salvage() -> ReadOptions {
    ReadOptions { salvage: true, ..ReadOptions::default() }
}

/// A cell of one second: commands and read-outs at 250 Hz, forces at 1 kHz with a noise that never repeats.
fn cell(seconds: usize) -> Session {
    let pose = |i: i64| {
        let wobble = f64::from(i32::try_from(i * 7919 % 41).unwrap() - 20) * 1e-6;
        Pose { position_m: [0.0, wobble, i as f64 * 1e-4 + wobble], orientation_xyzw: [0.0, 0.0, 0.0, 1.0] }
    };
    let wrench = |i: i64| {
        let wobble = f64::from(i32::try_from(i * 7919 % 83).unwrap() - 41) * 1e-3;
        Wrench { force_n: [wobble, -73.5, wobble * 2.0], torque_n_m: [0.1, wobble, 0.0] }
    };
    let times = |count: usize, period_ns: i64| (0..count as i64).map(|i| i * period_ns).collect::<Vec<_>>();
    let poses =
        Series { time_ns: times(seconds * 250, 4_000_000), value: (0..seconds as i64 * 250).map(pose).collect() };
    Session {
        file: PathBuf::from("cell.mcap"),
        sha256: String::new(),
        start_ns: 1_770_000_000_000_000_000,
        kind: Kind::Static,
        believed: BTreeMap::from([("reduced_mass_kg".to_owned(), "63.2".to_owned())]),
        commanded: Some(poses.clone()),
        measured: Some(poses),
        twist: None,
        sensed: Some(Series {
            time_ns: times(seconds * 1000, 1_000_000),
            value: (0..seconds as i64 * 1000).map(wrench).collect(),
        }),
        applied: None,
        grade: Grade::A,
        findings: Vec::new(),
    }
}

fn bytes(session: &Session) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write_mcap(session, &mut out).unwrap();
    out.into_inner()
}

/// Everything that a reader of the session can see, apart from where it came from.
fn content(session: &Session) -> String {
    let Session { start_ns, kind, commanded, measured, twist, sensed, applied, .. } = session;
    format!("{start_ns} {kind:?} {commanded:?} {measured:?} {twist:?} {sensed:?} {applied:?}")
}

fn samples(session: &Session) -> usize {
    session.sensed.as_ref().map_or(0, |series| series.value.len())
        + session.measured.as_ref().map_or(0, |series| series.value.len())
        + session.commanded.as_ref().map_or(0, |series| series.value.len())
}

#[test]
fn hidden_effect_recordings_read_with_grade_a() {
    let Some(folder) = shared("data/hidden-effect/dev") else { return };
    let files = files(&folder, "mcap");
    assert_eq!(files.len(), 77, "seven sets of eleven recordings");
    for file in &files {
        let session = read(file, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(session.grade, Grade::A, "{}: {:?}", file.display(), session.findings);
        assert!(session.findings.iter().all(|finding| finding.severity == Severity::Note), "{:?}", session.findings);
        let poses = session.commanded.as_ref().unwrap().value.len();
        assert_eq!(session.measured.as_ref().unwrap().value.len(), poses);
        assert_eq!(session.sensed.as_ref().unwrap().value.len(), 4 * poses);
        assert_eq!(session.twist.is_some(), session.kind == Kind::Impact, "{}", file.display());
        assert_eq!(session.believed_vec("tool_com_m").unwrap().len(), 3);
    }
}

#[test]
fn d0_static_holds_what_its_readme_says() {
    let Some(file) = shared("data/hidden-effect/dev/d0/static.mcap") else { return };
    let session = read(&file, &ReadOptions::default()).unwrap();
    assert_eq!(session.kind, Kind::Static);
    assert_eq!(session.start_ns, 1_770_000_000_000_000_000);
    assert_eq!(session.end_ns(), 4_000_000_000, "message_end_time of the statistics, by the Python reader of mcap");
    assert_eq!(samples(&session), 6000, "message_count of the statistics, by the Python reader of mcap");
    assert!((session.believed_f64("reduced_mass_kg").unwrap() - 63.2).abs() < 1e-12);
    let missing = session.believed_f64("mass").unwrap_err();
    assert!(missing.to_string().contains("does not say `mass`; it has"), "{missing}");
}

#[test]
fn what_is_written_reads_back_bit_for_bit_and_is_the_same_twice() {
    let written = cell(2);
    let first = bytes(&written);
    assert_eq!(first, bytes(&written));
    let back = from_bytes("cell.mcap", &first, &ReadOptions::default()).unwrap();
    assert_eq!(content(&back), content(&written));
    assert_eq!(back.grade, Grade::A);
    assert_eq!(back.findings, [], "a file of ours has every checksum and one clock");
    assert_eq!(back.believed["reduced_mass_kg"], "63.2");
    let mut drive = cell(1);
    drive.kind = Kind::Drive;
    drive.applied = Some(Series { time_ns: vec![0, 1_000_000], value: vec![1.5, -2.5] });
    let back = from_bytes("drive.mcap", &bytes(&drive), &ReadOptions::default()).unwrap();
    assert_eq!(content(&back), content(&drive));
}

struct Count(u64);
impl Sink for Count {
    fn message(&mut self, _: &RawMessage<'_>) -> Result<(), Error> {
        self.0 += 1;
        Ok(())
    }
}

#[test]
fn the_conformance_suite_of_mcap_reads_without_an_error() {
    let Some(folder) = shared("data/mcap-conformance") else { return };
    let files = files(&folder, "mcap");
    assert_eq!(files.len(), 416);
    for file in &files {
        let mut count = Count(0);
        let tally = read_records(file, &mut std::fs::File::open(file).unwrap(), &mut count)
            .unwrap_or_else(|error| panic!("{error}"));
        let name = file.file_name().unwrap().to_string_lossy();
        let expected = if name.starts_with("Ten") { 10 } else { u64::from(name.contains("Message")) };
        assert_eq!((tally.messages, count.0), (expected, expected), "{name}");
    }
}

#[test]
fn recordings_of_rosbag2_open_and_say_which_topics_are_missing() {
    let Some(folder) = shared("data/protocols/rosbag2_mcap") else { return };
    for file in files(&folder, "mcap") {
        let mut count = Count(0);
        read_records(&file, &mut std::fs::File::open(&file).unwrap(), &mut count)
            .unwrap_or_else(|error| panic!("{error}"));
        let refusal = read(&file, &ReadOptions::default()).unwrap_err();
        assert!(
            refusal
                .to_string()
                .contains("topic /ft/wrench (sensed, geometry_msgs/msg/WrenchStamped) is missing; the recording has"),
            "{refusal}"
        );
    }
}

#[test]
fn the_drive_axis_reads_from_its_table() {
    let Some(file) = shared("data/real/emps/DATA_EMPS.csv") else { return };
    let map = Map::parse("emps.toml", include_str!("../../fixtures/maps/emps.toml")).unwrap();
    let session = read(&file, &ReadOptions { map, salvage: false }).unwrap();
    assert_eq!((session.kind, session.grade), (Kind::Drive, Grade::A), "{:?}", session.findings);
    let measured = session.measured.unwrap();
    assert_eq!((measured.time_ns[0], measured.time_ns[1]), (0, 1_000_024));
    assert!((measured.value[1].position_m[2] - 1.43e-5).abs() < 1e-18);
    assert!((session.applied.unwrap().value[0] - 35.1507 * 2.538628089).abs() < 1e-12);
    println!("{} samples; {:?}", measured.value.len(), session.findings);
}

/// One wrong thing about a recording, and what must be said about it.
fn check_refusal(name: &str, bytes: &[u8], expected: &str) {
    let error = from_bytes(name, bytes, &ReadOptions::default()).expect_err(expected);
    assert!(error.to_string().starts_with(&format!("{name}: ")), "{error}");
    assert!(error.to_string().contains(expected), "{error}\nexpected: {expected}");
    assert!(error.help.is_some(), "{error}");
}

/// A recording whose wrench topic holds one message of the given type, encoding and body.
fn with_wrench(type_name: &str, encoding: &str, body: &[u8]) -> Vec<u8> {
    let mut writer = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema(type_name, "ros2msg", b"x").unwrap();
    let channel_id = writer.add_channel(schema, "/ft/wrench", encoding, &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, body).unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn every_bad_file_is_an_error_with_place_and_help() {
    check_refusal("empty.mcap", b"", "is empty (0 bytes)");
    check_refusal(
        "notes.mcap",
        b"today we measured",
        "byte 0: is no mcap recording: it begins with `today we measure`",
    );
    check_refusal("old.bag", b"#ROSBAG V2.0\n", "is a bag of ROS 1");
    check_refusal("start.mcap", b"\x89MCA", "is cut off at byte 4, inside the start marker");
    let type_name = "geometry_msgs/msg/WrenchStamped";
    check_refusal(
        "type.mcap",
        &with_wrench("sensor_msgs/msg/Imu", "cdr", &[]),
        "topic /ft/wrench: the messages are of type `sensor_msgs/msg/Imu`, expected",
    );
    check_refusal(
        "json.mcap",
        &with_wrench(type_name, "json", b"{}"),
        "topic /ft/wrench: the messages are encoded as `json`, only `cdr` is read",
    );
    check_refusal(
        "short.mcap",
        &with_wrench(type_name, "cdr", &[0, 1, 0, 0, 1, 2]),
        "topic /ft/wrench, message 0, t = 0.000000 s after its first: the message of 6 bytes is too short",
    );
    check_refusal("xcdr2.mcap", &with_wrench(type_name, "cdr", &[0, 7, 0, 0]), "encapsulation 00 07 is not plain cdr");
    let mut lacking = cell(1);
    lacking.sensed = None;
    check_refusal(
        "lacking.mcap",
        &bytes(&lacking),
        "topic /ft/wrench (sensed, geometry_msgs/msg/WrenchStamped) is missing; the recording has /robot/pose_command (geometry_msgs/msg/PoseStamped, 250 messages), /robot/pose_measured",
    );
    let mut nan = cell(1);
    nan.sensed.as_mut().unwrap().value[417].force_n[1] = f64::NAN;
    check_refusal(
        "nan.mcap",
        &bytes(&nan),
        "topic /ft/wrench, message 417, t = 0.417000 s after its first: wrench.force.y is NaN, expected a finite number",
    );
    let mut flipped = bytes(&cell(1));
    flipped[2000] ^= 1;
    check_refusal("flipped.mcap", &flipped, "byte ");
    let missing = read(Path::new("/no/such.mcap"), &ReadOptions::default()).unwrap_err();
    assert_eq!(missing.to_string(), "/no/such.mcap: there is no such file");
}

#[test]
fn a_bad_table_names_line_and_column() {
    let map = Map::parse("m.toml", "kind = \"drive\"\n[csv]\ntime = \"t\"\nmeasured = \"q\"\n").unwrap();
    let options = ReadOptions { map, salvage: false };
    let refuse = |text: &str| from_bytes("a.csv", text.as_bytes(), &options).unwrap_err().to_string();
    assert_eq!(refuse("t,q\n0,1\n1,NaN\n"), "a.csv: line 3: column `q` is `NaN`, expected a finite number");
    assert_eq!(refuse("t,q\n0,1\n1\n"), "a.csv: line 3: 1 columns, the first line has 2");
    assert_eq!(refuse("t,p\n0,1\n"), "a.csv: line 1: column `q` is missing; the table has t, p");
    assert_eq!(refuse("t,q\n"), "a.csv: column `q` has no sample");
    check_refusal("a.csv", b"t,q\n0,1\n", "is a table, and the map has no [csv]");
}

#[test]
fn a_bad_map_points_at_the_mistake() {
    let refuse = |text: &str| Map::parse("m.toml", text).unwrap_err();
    let typo = refuse("schema = 1\n[sensor]\nforce_sing = \"on-probe\"\n");
    assert!(typo.to_string().starts_with("m.toml: line 3: unknown field `force_sing`"), "{typo}");
    assert_eq!(typo.source_text.unwrap().span, 20..30);
    assert!(refuse("clock = \"sun\"").to_string().contains("expected one of `header`, `log`, `publish`"));
    assert!(
        refuse("[sensor]\nrotation_to_nozzle_xyzw = [0, 0, 0, 2]")
            .to_string()
            .starts_with("m.toml: line 2: rotation_to_nozzle_xyzw has length 2")
    );
    assert!(refuse("schema = 2").to_string().contains("schema = 2 is not known"));
}

#[test]
fn conventions_turn_a_reading_to_the_nozzle() {
    let mut turned = cell(1);
    let text =
        "[sensor]\nrotation_to_nozzle_euler_zyx_deg = [90, 0, 0]\nforce_sign = \"on-target\"\nforce_unit = \"kN\"\n";
    let options = ReadOptions { map: Map::parse("m.toml", text).unwrap(), salvage: false };
    turned.sensed.as_mut().unwrap().value[0].force_n = [1.0, 2.0, 3.0];
    let read = from_bytes("turned.mcap", &bytes(&turned), &options).unwrap();
    let force_n = read.sensed.unwrap().value[0].force_n;
    // A quarter turn about z sends x to y and y to -x; then the reaction, in newton. Rounding of three products of 1e3.
    for (value, expected) in force_n.iter().zip([2000.0, -1000.0, -3000.0]) {
        assert!((value - expected).abs() < 1e-11, "{force_n:?}");
    }
}

/// Writes the messages of a recording again, with other clocks and another encoding of schemas.
struct Rewrite {
    writer: mcap::Writer<Cursor<Vec<u8>>>,
    schema_encoding: &'static str,
    shift_ns: fn(&str, u64) -> u64,
}

impl Sink for Rewrite {
    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), Error> {
        let schema = self.writer.add_schema(message.type_name, self.schema_encoding, b"x").unwrap();
        let channel_id = self.writer.add_channel(schema, message.topic, "cdr", &BTreeMap::new()).unwrap();
        let log_time = (self.shift_ns)(message.topic, message.log_time_ns);
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, message.data).unwrap();
        Ok(())
    }
}

/// The messages of a recording and nothing else.
pub fn messages_alone(whole: &[u8], schema_encoding: &'static str, shift_ns: fn(&str, u64) -> u64) -> Vec<u8> {
    let writer = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let mut sink = Rewrite { writer, schema_encoding, shift_ns };
    read_records(Path::new("cell.mcap"), &mut Cursor::new(whole), &mut sink).unwrap();
    sink.writer.finish().unwrap();
    sink.writer.into_inner().into_inner()
}

fn rewritten(schema_encoding: &'static str, shift_ns: fn(&str, u64) -> u64, map: &str) -> Result<Session, Error> {
    let map = Map::parse("m.toml", map).unwrap();
    let again = messages_alone(&bytes(&cell(1)), schema_encoding, shift_ns);
    from_bytes("again.mcap", &again, &ReadOptions { map, salvage: false })
}

#[test]
fn several_clocks_are_told_apart() {
    let said =
        |session: &Session| session.findings.iter().map(|finding| finding.what.clone()).collect::<Vec<_>>().join("\n");
    let constant = rewritten("ros2idl", |_, time| time + 2_500_000, "kind = \"static\"").unwrap();
    assert_eq!(constant.grade, Grade::A);
    assert_eq!(said(&constant), ["log_time - header.stamp is 2.500000 ms throughout"; 3].join("\n"));
    let varying = rewritten("ros2msg", |_, time| time + time / 1_000_000 % 7 * 1000, "kind = \"static\"").unwrap();
    assert!(
        said(&varying).contains("log_time - header.stamp varies from 0.000000 ms to 0.006000 ms"),
        "{}",
        said(&varying)
    );
    let map = "kind = \"static\"\nclock = \"log\"\n[believed]\nreduced_mass_kg = 63.2\ntool_com_m = [0.0, 0.11]";
    let other = rewritten(
        "ros2msg",
        |topic, time| if topic == "/ft/wrench" { time - 1_769_000_000_000_000_000 } else { time },
        map,
    )
    .unwrap();
    assert!(said(&other).contains("overlap with no other topic"), "{}", said(&other));
    assert_eq!(other.believed_vec("tool_com_m").unwrap(), [0.0, 0.11]);
    let one = rewritten(
        "ros2msg",
        |topic, time| if topic == "/ft/wrench" { time - 1_769_000_000_000_000_000 } else { time },
        &format!("{map}\n[clock_of]\nsensed = \"header\""),
    )
    .unwrap();
    assert!(!said(&one).contains("overlap"), "{}", said(&one));
}

#[test]
fn what_nobody_says_is_asked_for() {
    let silent = rewritten("ros2msg", |_, time| time, "").unwrap_err();
    assert_eq!(
        silent.to_string(),
        "again.mcap: metadata record `session`: nothing says what was recorded, expected one of static, free-flight, impact, drive"
    );
    assert!(silent.help.as_ref().is_some_and(|help| help.contains("kind = \"")), "{silent:?}");
    let odd = rewritten("flatbuffer", |_, time| time, "kind = \"static\"").unwrap();
    assert!(
        odd.findings.iter().any(|finding| finding.what.contains("schema is encoded as `flatbuffer`")),
        "{:?}",
        odd.findings
    );
}

/// Reads a cell after `change` and returns grade and findings of warning or worse, one a line.
fn judged(change: impl FnOnce(&mut Session)) -> (Grade, String) {
    let mut session = cell(1);
    change(&mut session);
    let read = from_bytes("judged.mcap", &bytes(&session), &ReadOptions::default()).unwrap();
    let worth = read.findings.iter().filter(|finding| finding.severity > Severity::Note);
    (read.grade, worth.map(|finding| format!("{} @ {:?}: {}\n", finding.topic, finding.at_ns, finding.what)).collect())
}

#[test]
fn gaps_duplicates_disorder_and_stale_values_are_found() {
    let gap = judged(|session| {
        let sensed = session.sensed.as_mut().unwrap();
        sensed.time_ns.drain(500..503);
        sensed.value.drain(500..503);
    });
    assert_eq!(
        gap,
        (
            Grade::D,
            "/ft/wrench @ Some(499000000): a gap of 4.000 ms, nominal period 1.000 ms: 3 samples missing\n".to_owned()
        )
    );
    let twice = judged(|session| {
        let sensed = session.sensed.as_mut().unwrap();
        sensed.time_ns.insert(100, sensed.time_ns[99]);
        sensed.value.insert(100, sensed.value[99]);
    });
    assert_eq!(
        twice,
        (
            Grade::D,
            "/ft/wrench @ Some(99000000): 1 of 1001 samples have the time of the one before, first sample 100\n"
                .to_owned()
        )
    );
    let swapped = judged(|session| session.sensed.as_mut().unwrap().time_ns.swap(10, 11));
    assert_eq!(
        swapped,
        (
            Grade::D,
            "/ft/wrench @ Some(10000000): 1 of 1000 samples are earlier than the one before, first sample 11\n"
                .to_owned()
        )
    );
    let stale = judged(|session| {
        let sensed = session.sensed.as_mut().unwrap();
        let held = sensed.value[300];
        sensed.value[300..320].fill(held);
    });
    assert_eq!(stale, (Grade::D, "/ft/wrench @ Some(300000000): 20 identical samples in a row (19.000 ms), at most 10 are explained by noise\n".to_owned()));
    assert_eq!(judged(|_| ()), (Grade::A, String::new()));
}
