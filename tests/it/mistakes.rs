//! Wrong inputs of `dockhil diagnose` and `compare`: each is refused with file, place and help, exit code 2, and nothing is left
//! half written.

use crate::shell::{Shell, impact};
use fixtures::session;
use harness::recording::{Kind, ReadOptions, Session, read, write_mcap};

/// A recording of the first set, changed and written to `name`.
fn changed(shell: &Shell, from: &str, name: &str, change: impl FnOnce(&mut Session)) -> String {
    let mut recording = read(&session("cell-a", from), &ReadOptions::default()).unwrap();
    change(&mut recording);
    let mut bytes = std::io::Cursor::new(Vec::new());
    write_mcap(&recording, &mut bytes).unwrap();
    std::fs::write(shell.path(name), bytes.into_inner()).unwrap();
    format!("DIR/{name}")
}

/// Diagnoses with these lists, and expects every one of `words` in the error.
fn refuses(shell: &Shell, learn: &[&str], test: &[&str], words: &[&str]) {
    let before = shell.names();
    let head = ["diagnose", "--model", "DIR/m.toml", "--json", "DIR/d.json", "--report", "DIR/r.html"];
    let tail = ["--write-model", "DIR/found.toml"];
    let args = [head.as_slice(), &tail, &["--learn"], learn, &["--test"], test].concat();
    refuses_line(shell, &args, words);
    assert_eq!(shell.names(), before, "nothing is written");
}

fn refuses_line(shell: &Shell, args: &[&str], words: &[&str]) {
    let ran = shell.run(args);
    assert_eq!(ran.exit, 2, "{args:?}: {}", ran.err);
    assert_eq!(ran.out, "", "data only on success");
    // The terminal's lines are wrapped: only words are compared.
    let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in words.iter().chain(&["help:"]) {
        assert!(said.contains(word), "{args:?} says {word:?}: {said}");
    }
}

fn test_recording() -> String {
    session("cell-a", "test_07.mcap").display().to_string()
}

#[test]
fn recordings_that_cannot_answer_are_refused() {
    let shell = Shell::with_model();
    let (good, test) = (impact(), test_recording());
    refuses(&shell, &[&good], &[&good], &["learn_01.mcap", "this test recording is also learned from", "--test"]);
    let quiet = changed(&shell, "static.mcap", "quiet.mcap", |recording| {
        recording.kind = Kind::Impact;
        recording.believed.insert("kind".into(), "impact".into());
    });
    refuses(&shell, &[&quiet], &[&test], &["quiet.mcap", "no contact in any impact recording", "1.5 N"]);
    let mute = changed(&shell, "learn_02.mcap", "mute.mcap", |recording| recording.sensed = None);
    refuses(&shell, &[&mute], &[&test], &["mute.mcap", "/ft/wrench"]);
    let broken = changed(&shell, "learn_02.mcap", "nan.mcap", |recording| {
        recording.sensed.as_mut().unwrap().value[700].force_n[2] = f64::NAN;
    });
    refuses(&shell, &[&broken], &[&test], &["nan.mcap", "/ft/wrench", "NaN"]);
    for mass in ["0", "-63.2"] {
        let light = changed(&shell, "learn_02.mcap", "light.mcap", |recording| {
            recording.believed.insert("reduced_mass_kg".into(), mass.into());
        });
        refuses(&shell, &[&light], &[&test], &["light.mcap", "session", &format!("reduced_mass_kg = {mass} kg")]);
    }
    refuses(
        &shell,
        &[&session("cell-a", "static.mcap").display().to_string()],
        &[&test],
        &["is of kind impact", "--aux"],
    );
}

#[test]
fn files_that_are_no_recordings_are_refused() {
    let shell = Shell::with_model();
    let test = test_recording();
    shell.write("empty.mcap", "");
    shell.write("text.mcap", "time,force\n0,1\n");
    let mut bytes = std::fs::read(session("cell-a", "learn_02.mcap")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(shell.path("flipped.mcap"), bytes).unwrap();
    refuses(&shell, &["DIR/empty.mcap"], &[&test], &["empty.mcap", "empty"]);
    refuses(&shell, &["DIR/text.mcap"], &[&test], &["text.mcap", "byte 0", "no mcap recording"]);
    refuses(&shell, &["DIR/absent.mcap"], &[&test], &["absent.mcap"]);
    refuses(&shell, &["DIR/flipped.mcap"], &[&test], &["flipped.mcap", "--salvage"]);
}

#[test]
fn an_effect_on_a_clamped_wire_is_an_error_and_no_silence() {
    let shell = Shell::with_model();
    let recording = impact();
    let add = ["effect", "add", "command-delay:delay_s=0.008", "--model", "DIR/m.toml"];
    assert_eq!(shell.run(&add).exit, 0);
    let words = ["effect command-delay acts on the wire received", "clamped", "--clamp achieved", "--clamp commanded"];
    refuses_line(&shell, &["compare", "--model", "DIR/m.toml", "--clamp", "achieved", &recording], &words);
}

#[test]
fn unknown_effects_and_keys_are_refused() {
    let shell = Shell::with_model();
    let before = shell.read("m.toml");
    let add = ["effect", "add", "stifness-hardening", "--model", "DIR/m.toml"];
    refuses_line(&shell, &add, &["unknown effect", "did you mean stiffness-hardening"]);
    assert_eq!(shell.read("m.toml"), before);
    shell.write("m.toml", &before.replace("mass_kg", "mas_kg"));
    refuses_line(&shell, &["compare", "--model", "DIR/m.toml", &impact()], &["m.toml", "mas_kg"]);
}

#[test]
fn a_result_never_replaces_what_is_read() {
    let shell = Shell::with_model();
    let copy = changed(&shell, "learn_02.mcap", "copy.mcap", |_| ());
    let bytes = std::fs::read(shell.path("copy.mcap")).unwrap();
    let compare = ["compare", "--model", "DIR/m.toml", copy.as_str()];
    refuses_line(
        &shell,
        &[&compare[..], &["--json", "DIR/copy.mcap"]].concat(),
        &["copy.mcap", "would be overwritten"],
    );
    refuses_line(&shell, &[&compare[..], &["--report", "DIR/m.toml"]].concat(), &["m.toml", "would be overwritten"]);
    refuses_line(&shell, &["model", "init", &copy, "-o", "DIR/copy.mcap", "--force"], &["would be overwritten"]);
    let twice = [&compare[..], &["--json", "DIR/a", "--report", "DIR/a"]].concat();
    refuses_line(&shell, &twice, &["named for two results"]);
    assert!(std::fs::read(shell.path("copy.mcap")).unwrap() == bytes, "the recording is as it was");
}

#[test]
fn a_recording_counts_once_and_a_test_has_contact() {
    let shell = Shell::with_model();
    let (good, test) = (impact(), test_recording());
    refuses(&shell, &[&good, &good], &[&test], &["learn_01.mcap", "it would count twice"]);
    let rest = session("cell-a", "static.mcap").display().to_string();
    refuses(&shell, &[&good], &[&rest], &["static.mcap", "kind static, not impact", "--aux"]);
    for (samples, why) in [("1", "no spread"), ("-1", "no spread"), ("1000000000", "do not fit into memory")] {
        let words = ["--samples", &format!("{samples} is outside [2, 10000]"), why];
        refuses_line(&shell, &["compare", "--model", "DIR/m.toml", &good, "--samples", samples], &words);
    }
    let ran = shell.run(&["compare", "--model", "DIR/m.toml", &good, "--seed", "-1"]);
    assert!(ran.exit == 2 && ran.err.contains("a seed is a whole number from 0 to"), "{}", ran.err);
}

#[test]
fn a_test_recording_of_another_rig_contradicts_the_answer() {
    let shell = Shell::new();
    let of = |set: &str, names: &[&str]| -> Vec<String> {
        fixtures::sessions(set, names).iter().map(|path| path.display().to_string()).collect()
    };
    let learn = of("cell-c", &fixtures::LEARN[..3]);
    let (rest, other) = (of("cell-c", &["static.mcap"]), of("cell-b", &["test_07.mcap"]));
    assert_eq!(shell.run(&["model", "init", &learn[0], "-o", "DIR/m.toml"]).exit, 0);
    let strings = |list: &[String]| list.to_vec();
    let words = |text: &str| text.split(' ').map(str::to_string).collect::<Vec<_>>();
    let line = [
        words("diagnose --model DIR/m.toml --learn"),
        strings(&learn),
        words("--aux"),
        strings(&rest),
        words("--test"),
        strings(&other),
    ]
    .concat();
    let ran = shell.run(&line.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(ran.exit, 3, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("above their noise"), "{}", ran.out);
}
