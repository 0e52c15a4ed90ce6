//! Replays: what stays, what changes and from which sample on, and what is refused.

use crate::shell::Shell;
use fixtures::session;
use harness::recording::{Luggage, RawMessage, ReadOptions, Session, Sink, read, read_records, rewrite};
use serde_json::Value;
use std::io::Cursor;
use std::path::Path;

const TOPICS: [&str; 4] = ["/robot/pose_command", "/robot/pose_measured", "/satellite/relative_twist", "/ft/wrench"];

/// Every message of a recording: topic, counter, times and bytes.
#[derive(Default)]
struct Messages(Vec<(String, u32, u64, u64, Vec<u8>)>);

impl Sink for Messages {
    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), harness::error::Error> {
        let topic = message.topic.to_owned();
        let times = (message.log_time_ns, message.publish_time_ns);
        self.0.push((topic, message.sequence, times.0, times.1, message.data.to_vec()));
        Ok(())
    }
}

fn messages(path: &Path) -> Messages {
    let mut all = Messages::default();
    read_records(path, &mut Cursor::new(std::fs::read(path).unwrap()), &mut all).unwrap();
    all
}

/// How many messages of each topic differ, and nothing but their bytes.
fn differing(one: &Path, other: &Path) -> Vec<usize> {
    let (one, other) = (messages(one), messages(other));
    assert_eq!(one.0.len(), other.0.len());
    let mut counts = vec![0; TOPICS.len()];
    for (a, b) in one.0.iter().zip(&other.0) {
        assert_eq!((&a.0, a.1, a.2, a.3), (&b.0, b.1, b.2, b.3), "topic, counter and times stay");
        let place = TOPICS.iter().position(|topic| *topic == a.0).unwrap();
        counts[place] += usize::from(a.4 != b.4);
    }
    counts
}

/// A shell with the nominal model of the first set.
fn cell() -> (Shell, String) {
    let shell = Shell::new();
    let impact = session("cell-a", "learn_03.mcap").display().to_string();
    assert_eq!(shell.run(&["model", "init", &impact, "-o", "DIR/m.toml"]).exit, 0);
    (shell, impact)
}

fn json(shell: &Shell) -> Value {
    serde_json::from_str(&shell.read("r.json")).unwrap()
}

/// Replays, expects this exit code, and returns the streams by topic.
fn replayed(shell: &Shell, args: &[&str], exit: u8) -> Vec<Value> {
    let ran = shell.run(&[&["replay"], args, &["--json", "DIR/r.json"]].concat());
    assert_eq!(ran.exit, exit, "{args:?}: {}{}", ran.out, ran.err);
    let streams = json(shell)["streams"].as_array().unwrap().clone();
    TOPICS.iter().map(|topic| streams.iter().find(|stream| stream["topic"] == *topic).unwrap().clone()).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

#[test]
fn the_software_block_of_a_foreign_recording_keeps_every_byte() {
    let (shell, impact) = cell();
    let args = [&impact, "--model", "DIR/m.toml", "--clamp", "sensed", "-o", "DIR/o.mcap"];
    let streams = replayed(&shell, &args, 0);
    assert_eq!(differing(Path::new(&impact), &shell.path("o.mcap")), [0, 0, 0, 0]);
    for (place, made) in [(0, true), (1, false), (2, true), (3, false)] {
        assert_eq!(streams[place]["made"], made, "{}", streams[place]);
        assert_eq!(streams[place]["first"], Value::Null, "{}", streams[place]);
    }
    // A simulator that shares no code wrote the commands: 500 sums of numbers near 10 mm agree to rounding.
    assert!(number(&streams[0]["largest"]) < 1e-15 && number(&streams[2]["largest"]) < 1e-15, "{streams:?}");
}

#[test]
fn a_run_of_ours_is_replayed_to_the_last_bit() {
    for name in ["bench-hardware", "planar", "air-bearing-table"] {
        let shell = Shell::new();
        assert_eq!(shell.run(&["run", name, "-o", "DIR/a.mcap"]).exit, 0);
        let streams = replayed(&shell, &["DIR/a.mcap", "-o", "DIR/o.mcap"], 0);
        assert_eq!(differing(&shell.path("a.mcap"), &shell.path("o.mcap")), [0, 0, 0, 0], "{name}");
        for stream in &streams {
            assert!(stream["made"] == true && stream["kept"] == stream["samples"], "{name}: {stream}");
        }
        assert_eq!(json(&shell)["diverged"], Value::Null);
        replayed(&shell, &["DIR/a.mcap", "--clamp", "sensed"], 0);
    }
}

#[test]
fn a_run_of_ours_with_faults_is_replayed_with_them() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "bench-hardware", "--extract", "DIR"]).exit, 0);
    let fault = "\n[[effect]]\nid = \"command-jitter\"\nsigma_s = 0.001\nfrom_s = 0.2\n\n[[criterion]]";
    let catalog = sim_core::effects::standard();
    let jitter = &catalog.get("command-jitter").unwrap().params[0].name;
    let text = shell.read("bench-hardware.toml").replacen("[[criterion]]", &fault.replace("sigma_s", jitter), 1);
    shell.write("bench-hardware.toml", &text);
    let ran = shell.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/a.mcap"]);
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    replayed(&shell, &["DIR/a.mcap"], 0);
    assert_eq!(json(&shell)["faults"].as_array().unwrap().len(), 1);
    // The model alone does not hold the fault: what then differs is no divergence.
    let model = "DIR/models/bench-hardware.toml";
    let streams = replayed(&shell, &["DIR/a.mcap", "--model", model], 0);
    assert_eq!(json(&shell)["faults"].as_array().unwrap().len(), 0);
    assert!(number(&streams[1]["first"]["time_s"]) >= 0.2, "{}", streams[1]);
    assert_eq!(json(&shell)["diverged"], Value::Null);
}

#[test]
fn a_run_of_ours_that_was_changed_diverges_at_the_changed_sample() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "bench-hardware", "-o", "DIR/a.mcap"]).exit, 0);
    let bytes = std::fs::read(shell.path("a.mcap")).unwrap();
    let mut out = Cursor::new(Vec::new());
    let mut changed = |message: &harness::recording::Stamped<'_>| {
        (message.topic == "/ft/wrench" && message.index == 700).then(|| {
            let mut numbers = message.numbers.clone();
            numbers[2] = f64::from_bits(numbers[2].to_bits() ^ 1);
            numbers
        })
    };
    let copied = rewrite(&bytes, &mut changed, &Luggage::default(), &[], &mut out).unwrap();
    assert_eq!(copied.replaced, 1);
    std::fs::write(shell.path("b.mcap"), out.into_inner()).unwrap();
    let streams = replayed(&shell, &["DIR/b.mcap"], 5);
    assert_eq!(streams[3]["first"]["sample"], 700, "one unit in the last place of one force");
    assert_eq!(json(&shell)["diverged"]["sample"], 700);
    let ran = shell.run(&["replay", "DIR/b.mcap"]);
    assert!(ran.out.lines().last().unwrap().starts_with("✗ diverged"), "{}", ran.out);
    assert!(ran.out.contains("First difference from the recording: /ft/wrench, sample 700"), "{}", ran.out);
}

#[test]
fn with_the_command_clamped_only_what_lies_behind_it_changes() {
    let (shell, impact) = cell();
    let fault = "command-delay:delay_s=0.008";
    let args =
        [&impact, "--model", "DIR/m.toml", "--clamp", "commanded", "--with", fault, "-o", "DIR/o.mcap", "--force"];
    let streams = replayed(&shell, &args, 0);
    let counts = differing(Path::new(&impact), &shell.path("o.mcap"));
    assert_eq!((counts[0], counts[2]), (0, 0), "command and satellites are the recording's");
    let samples = |place: usize| number(&streams[place]["samples"]) as usize;
    // The model has no noise: now and then a recorded sample, rounded to a whole mN, hits its very number.
    assert!(counts[1] == samples(1) && 100 * counts[3] > 99 * samples(3), "{counts:?}");
    // 8 ms at 42.5 mm/s are 0.34 mm, from the first sample on.
    let first = &streams[1]["first_by_faults"];
    let change = number(&first["new"]) - number(&first["old"]);
    assert!(first["sample"] == 0 && (change + 0.008 * 0.0425).abs() < 1e-5, "{first}");
    assert_eq!(streams[0]["first_by_faults"], Value::Null);
}

#[test]
fn with_nothing_clamped_the_satellites_react() {
    let (shell, impact) = cell();
    let energy = |args: &[&str]| {
        let streams = replayed(&shell, &[&[impact.as_str(), "--model", "DIR/m.toml"], args].concat(), 0);
        let verdicts = &json(&shell)["verdicts"];
        (number(&verdicts[0]["value"]), number(&verdicts[1]["value"]), streams)
    };
    let (plain_j, plain_e, _) = energy(&[]);
    let (late_j, late_e, streams) = energy(&["--with", "command-delay:delay_s=0.008", "-o", "DIR/o.mcap"]);
    assert!(late_j < plain_j && late_e > plain_e, "delay takes damping: {plain_j} {late_j}, {plain_e} {late_e}");
    // reference/PHYSICS.md, section 1.5: a millisecond on the stiffness path is worth 0.0065 of ln e.
    let found = libm::log(late_e / plain_e) / 8.0;
    assert!((found - 0.0065).abs() < 0.001, "{found} for each ms");
    assert!(number(&streams[0]["first_by_faults"]["time_s"]) > 0.3, "the command waits for contact: {}", streams[0]);
    let again = read(&shell.path("o.mcap"), &ReadOptions::default()).unwrap();
    assert_eq!(again.believed.get("kind").unwrap(), "impact");
    assert_eq!(again.commanded.unwrap().value.len(), number(&streams[0]["samples"]) as usize);
}

#[test]
fn a_seed_draws_the_noise_and_the_same_seed_draws_the_same() {
    let (shell, impact) = cell();
    let run = |seed: &str, out: &str| {
        replayed(&shell, &[&impact, "--model", "DIR/m.toml", "--seed", seed, "-o", out], 0);
        std::fs::read(shell.path(out.trim_start_matches("DIR/"))).unwrap()
    };
    let (one, again, other) = (run("1", "DIR/1.mcap"), run("1", "DIR/2.mcap"), run("2", "DIR/3.mcap"));
    assert!(one == again && one != other);
}

#[test]
fn the_criteria_are_those_that_are_asked_for() {
    let (shell, impact) = cell();
    assert_eq!(shell.run(&["run", "bench-active", "--extract", "DIR"]).exit, 0);
    let args = [&impact, "--model", "DIR/m.toml", "--criteria", "DIR/bench-active.toml"];
    replayed(&shell, &args, 1);
    let verdicts = json(&shell)["verdicts"].clone();
    assert_eq!((verdicts.as_array().unwrap().len(), &verdicts[0]["outcome"]), (1, &Value::from("fail")));
}

#[test]
fn a_fault_that_never_acted_is_an_error_of_the_replay() {
    let (shell, impact) = cell();
    let before = shell.names();
    let fault = "end-stop:depth_m=0.05,stiffness_n_per_m=1000";
    let args = ["replay", &impact, "--model", "DIR/m.toml", "--with", fault, "-o", "DIR/o.mcap"];
    let ran = shell.run(&args);
    assert_eq!((ran.exit, ran.out.as_str()), (6, ""), "{}", ran.err);
    assert!(ran.err.contains("learn_03.mcap: --with: the fault end-stop did nothing"), "{}", ran.err);
    assert_eq!(shell.names(), before, "nothing is written");
}

/// Replays with these arguments, and expects every one of `words` in the error, exit code 2, and no file.
fn refuses(shell: &Shell, args: &[&str], words: &[&str]) {
    let before = shell.names();
    let ran = shell.run(&[&["replay"], args, &["--json", "DIR/r.json"]].concat());
    assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{args:?}: {}", ran.err);
    let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in words.iter().chain(&["help:"]) {
        assert!(said.contains(word), "{args:?} says {word:?}: {said}");
    }
    assert_eq!(shell.names(), before, "{args:?}: nothing is written");
}

#[test]
fn wrong_replays_are_refused_with_place_and_help() {
    let (shell, impact) = cell();
    let model = ["--model", "DIR/m.toml"];
    let with = |args: &[&'static str]| [&[impact.as_str()], &model[..], args].concat();
    for (args, words) in [
        (&["--with", "force-bais:force_n=0.3"][..], &["argument \"force-bais", "did you mean force-bias?"][..]),
        (&["--with", "force-bias"], &["effect force-bias lacks its parameter force_n", "a number in N"]),
        (&["--with", "command-delay:delay_s=16"], &["delay_s = 16 s is outside"]),
        (
            &["--with", "command-delay:delay_s=-0.05"],
            &["--with command-delay:", "is -0.034000 s, below one loop period"],
        ),
        (
            &["--with", "clock-offset:offset_s=0.01"],
            &["clock-offset acts on the recorder, whose stamps a replay does not"],
        ),
        (&["--with", "force-bias:force=3"], &["effect force-bias has no parameter force"]),
        (&["--with", "force-bias:force_n=1", "--with", "force-bias:force_n=2"], &["force-bias is put in twice"]),
        (&["--clamp", "sensed", "--with", "force-bias:force_n=0.3"], &["acts on the wire sensed", "--clamp sensed"]),
        (&["--clamp", "achieved", "--with", "command-delay:delay_s=0.008"], &["acts on the wire received", "clamped"]),
        (&["--criteria", "DIR/none.toml"], &["none.toml", "cannot read the criteria"]),
        (&["--criteria", "DIR/m.toml"], &["m.toml: line", "unknown field"]),
        (&["-o", "DIR/m.toml", "--force"], &["m.toml", "would be overwritten"]),
    ] {
        refuses(&shell, &with(args), words);
    }
    refuses(&shell, &[&impact], &["learn_03.mcap", "does not hold its model", "dockhil model init"]);
    refuses(&shell, &["DIR/m.toml", "--model", "DIR/m.toml"], &["m.toml", "no mcap recording"]);
    let excite = session("cell-a", "excite.mcap").display().to_string();
    refuses(&shell, &[&excite, "--model", "DIR/m.toml"], &["free flight with the loop open", "--clamp commanded"]);
    let own = Shell::new();
    assert_eq!(own.run(&["run", "planar", "-o", "DIR/a.mcap"]).exit, 0);
    refuses(&own, &["DIR/a.mcap", "--seed", "1"], &["a.mcap", "has a seed of its own"]);
}

#[test]
fn a_damaged_recording_says_its_grade_in_every_answer() {
    let (shell, impact) = cell();
    let bytes = std::fs::read(&impact).unwrap();
    std::fs::write(shell.path("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    // One of several chunks.
    assert_eq!(shell.run(&["run", "bench-hardware", "-o", "DIR/a.mcap"]).exit, 0);
    let mut flipped = std::fs::read(shell.path("a.mcap")).unwrap();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    std::fs::write(shell.path("flipped.mcap"), flipped).unwrap();
    for (file, grade) in [("DIR/cut.mcap", "B"), ("DIR/flipped.mcap", "C")] {
        let args = ["replay", file, "--salvage", "--clamp", "commanded", "--model", "DIR/m.toml"];
        let ran = shell.run(&[&args[..], &["--json", "DIR/r.json"]].concat());
        assert_ne!(ran.exit, 2, "{file}: {}", ran.err);
        assert_eq!(json(&shell)["recording"]["grade"], grade);
        assert!(ran.out.contains(&format!("The recording has grade {grade}: ")), "{}", ran.out);
        assert!(ran.out.lines().last().unwrap().ends_with(&format!("(grade {grade})")), "{}", ran.out);
    }
    std::fs::remove_file(shell.path("r.json")).unwrap();
    refuses(&shell, &["DIR/cut.mcap"], &["cut.mcap: is cut off", "--model MODEL.toml"]);
    refuses(&shell, &["DIR/flipped.mcap", "--salvage"], &["flipped.mcap: is damaged", "--model MODEL.toml"]);
}

#[test]
fn a_replay_of_a_replay_has_its_model_and_says_what_it_is() {
    let (shell, impact) = cell();
    let fault = "command-delay:delay_s=0.008";
    replayed(&shell, &[&impact, "--model", "DIR/m.toml", "--with", fault, "-o", "DIR/o.mcap"], 0);
    let own = Shell::new();
    assert_eq!(own.run(&["run", "planar", "-o", "DIR/a.mcap"]).exit, 0);
    // 8 ms more make the contact give energy: its criterion fails.
    replayed(&own, &["DIR/a.mcap", "--with", fault, "-o", "DIR/o.mcap"], 1);
    for (shell, model) in [
        (&shell, shell.read("m.toml")),
        (
            &own,
            fixtures::SCENARIO_MODELS.iter().find(|file| file.name == "models/planar.toml").unwrap().text.to_owned(),
        ),
    ] {
        let attached = harness::recording::luggage(&std::fs::read(shell.path("o.mcap")).unwrap()).unwrap().files;
        let models: Vec<_> = attached.iter().filter(|(name, _)| name == "model.toml").collect();
        assert!(models.len() == 1 && models[0].1 == model.as_bytes(), "the model that was used, once");
        let ran = shell.run(&["replay", "DIR/o.mcap", "--with", fault]);
        assert_ne!(ran.exit, 2, "{}", ran.err);
        let said = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
        let words = "The recording is itself a replay: clamp nothing, put in: command-delay (delay_s = 0.008 s).";
        assert!(said.contains(words), "{said}");
    }
}

/// A recording of ours whose attached model is not the one that its record names.
#[test]
fn a_recording_of_ours_with_another_model_in_it_is_refused() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "planar", "-o", "DIR/a.mcap"]).exit, 0);
    let bytes = std::fs::read(shell.path("a.mcap")).unwrap();
    let added = Luggage { files: vec![("model.toml".into(), b"schema = 1\n".to_vec())], ..Luggage::default() };
    let mut out = Cursor::new(Vec::new());
    rewrite(&bytes, &mut |_| None, &added, &[], &mut out).unwrap();
    std::fs::write(shell.path("b.mcap"), out.into_inner()).unwrap();
    assert_eq!(differing(&shell.path("a.mcap"), &shell.path("b.mcap")), [0, 0, 0, 0]);
    let words = ["b.mcap", "metadata record dockhil.run", "model.toml is not the one that the record names"];
    refuses(&shell, &["DIR/b.mcap"], &words);
}

/// A copy reads as its original does.
#[test]
fn a_copy_of_a_foreign_recording_reads_the_same() {
    let path = session("cell-b", "learn_02.mcap");
    let bytes = std::fs::read(&path).unwrap();
    let mut out = Cursor::new(Vec::new());
    rewrite(&bytes, &mut |_| None, &Luggage::default(), &[], &mut out).unwrap();
    let read = |bytes: &[u8]| harness::recording::from_bytes("x.mcap", bytes, &ReadOptions::default()).unwrap();
    let (one, other) = (read(&bytes), read(&out.into_inner()));
    // What the files protect by checksums is not the same: ours has one for the data section.
    let signals = |session: Session| Session { sha256: String::new(), findings: Vec::new(), ..session };
    assert_eq!(signals(one), signals(other));
}
