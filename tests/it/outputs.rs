//! Where the results of a command go, and what is said about it; numbers of odd size in words.

use crate::shell::{Shell, impact};
use serde_json::Value;

#[test]
fn one_result_at_most_goes_to_standard_output() {
    let shell = Shell::with_model();
    let chart = "timing.command_delay_s=0.004..0.04,virtual_contact.damping_n_s_per_m";
    let recording = impact();
    for args in [
        &["stability", "DIR/m.toml", "--chart", chart, "--sweep", "-", "--json", "-"][..],
        &["stability", "DIR/m.toml", "--chart", chart, "--sweep", "-", "--report", "-"],
        &["run", "bench-active", "--json", "-", "--report", "-"],
        &["compare", "--model", "DIR/m.toml", &recording, "--json", "-", "--report", "-"],
    ] {
        shell.refuses(
            args,
            "  × argument -: only one result can go to standard output\n  help: name a file for each of the others\n",
        );
    }
    let page = shell.run(&["stability", "DIR/m.toml", "--report", "-"]);
    assert!(page.out.starts_with("<!DOCTYPE html>") && page.out.trim_end().ends_with("</html>"), "the page alone");
}

/// One file under two spellings is one file, before it is there too.
#[test]
fn no_result_replaces_another() {
    let shell = Shell::with_model();
    std::fs::create_dir(shell.path("below")).unwrap();
    for args in [
        ["stability", "DIR/m.toml", "--json", "DIR/k.out", "--report", "DIR/./k.out"],
        ["stability", "DIR/m.toml", "--json", "DIR/below/../k.out", "--report", "DIR/k.out"],
        ["run", "bench-active", "-o", "DIR/k.out", "--json", "DIR/./k.out"],
    ] {
        let ran = shell.run(&args);
        assert!(ran.exit == 2 && ran.err.contains("is named for two results"), "{args:?}: {}", ran.err);
        assert!(!shell.path("k.out").exists());
    }
}

#[test]
fn what_was_written_is_said() {
    let shell = Shell::new();
    let ran = shell.run(&["run", "bench-active", "-o", "DIR/a.mcap", "--json", "DIR/a.json", "--report", "DIR/a.html"]);
    assert_eq!(ran.err, "DIR/a.mcap: written\nDIR/a.json: written\nDIR/a.html: written\n");
    // A time says its unit.
    let found: Value = serde_json::from_str(&shell.read("a.json")).unwrap();
    let verdicts = found["verdicts"].as_array().unwrap();
    assert!(verdicts.iter().any(|verdict| verdict["at_ns"].as_i64().is_some_and(|at_ns| at_ns > 0)), "{found}");
    assert!(verdicts.iter().all(|verdict| verdict.get("at").is_none()), "{found}");
}

/// Neither is helped by the advice to salvage, or by a copy alone.
#[test]
fn a_cut_recording_is_told_what_is_left_to_do() {
    let shell = Shell::new();
    let whole = std::fs::read(impact()).unwrap();
    for (length, says) in [(1000, "record it again"), (whole.len() / 2, "give the model, --model MODEL.toml")] {
        std::fs::write(shell.path("cut.mcap"), &whole[..length]).unwrap();
        let ran = shell.run(&["replay", "DIR/cut.mcap", "--salvage"]);
        assert!(ran.exit == 2 && ran.err.contains(says), "{}", ran.err);
    }
}

#[test]
fn a_folder_is_no_scenario() {
    let shell = Shell::new();
    let ran = shell.run(&["run", "DIR"]);
    assert!(ran.exit == 2 && ran.err.contains("DIR: is a folder, expected a scenario"), "{}", ran.err);
    assert!(ran.err.contains("dockhil run --list"), "{}", ran.err);
}

#[test]
fn a_loop_of_odd_numbers_is_warned_of_in_few_digits() {
    let shell = Shell::with_model();
    let text = shell.read("m.toml");
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).unwrap();
    for (key, value, says) in [
        ("stiffness_n_per_m", "0", "stiffness_n_per_m = 0 N/m is not above 0"),
        ("mass_kg", "1e-300", "cannot be told"),
    ] {
        shell.write("odd.toml", &text.replacen(line(key), &format!("{key} = {value}"), 1));
        let ran = shell.run(&["model", "check", "DIR/odd.toml"]);
        assert_eq!(ran.exit, 0, "{}", ran.err);
        assert!(
            ran.err.starts_with("warning: DIR/odd.toml: the stability of its loop cannot be told: "),
            "{}",
            ran.err
        );
        assert!(ran.err.contains(says) && ran.out.len() < 200, "{}{}", ran.out, ran.err);
    }
    assert!(shell.run(&["model", "check", "DIR/odd.toml"]).out.contains("docking cell, 1e-300 kg, "));
    assert_eq!(shell.run(&["model", "check", "DIR/m.toml"]).err, "");
}

#[test]
fn a_model_with_six_axes_is_told_what_takes_its_place() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "olev", "--extract", "DIR"]).exit, 0);
    let recording = impact();
    for command in [["calibrate", "ft"], ["identify", "robot"]] {
        let ran = shell.run(&[command[0], command[1], &recording, "--model", "DIR/models/olev.toml"]);
        assert!(ran.exit == 2 && ran.err.contains("name a model of the same cell along one axis"), "{}", ran.err);
    }
    let text = shell.read("models/olev.toml");
    let nozzle = text.rfind("interface_m = [").unwrap();
    shell.write("n.toml", &format!("{}interface_m = [0, inf, 0] # {}", &text[..nozzle], &text[nozzle..]));
    let ran = shell.run(&["model", "check", "DIR/n.toml"]);
    assert!(ran.exit == 2 && ran.err.contains("target: interface_m = inf m"), "{}", ran.err);
    assert!(ran.err.contains("│ interface_m = [0, inf, 0]"), "{}", ran.err);
}

#[cfg(unix)]
#[test]
fn a_link_is_followed_and_a_pipe_stays_a_pipe() {
    let shell = Shell::new();
    let json = ["stability", "--mass-kg", "60", "--stiffness-n-per-m", "1000", "--damping-n-s-per-m", "50", "--json"];
    shell.write("file", "{}");
    std::os::unix::fs::symlink(shell.path("file"), shell.path("link")).unwrap();
    assert_eq!(shell.run(&[&json[..], &["DIR/link"]].concat()).exit, 0);
    assert!(shell.path("link").is_symlink() && shell.read("file").contains("critical_delay_s"));
    let pipe = shell.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read_to_string(pipe).unwrap()
    });
    assert_eq!(shell.run(&[&json[..], &["DIR/pipe"]].concat()).exit, 0);
    assert!(reader.join().unwrap().contains("critical_delay_s"));
    assert!(!pipe.metadata().unwrap().is_file());
    // A device that is full is an error, and stays a device.
    if std::path::Path::new("/dev/full").exists() {
        let ran = shell.run(&[&json[..], &["/dev/full"]].concat());
        assert!(ran.exit == 2 && ran.err.contains("/dev/full: cannot write"), "{}", ran.err);
        assert!(!std::fs::metadata("/dev/full").unwrap().is_file());
    }
}
