//! Scenarios: what is inside the program, what a run leaves behind, what is refused.

use crate::shell::Shell;
use harness::recording::{Kind, ReadOptions, from_bytes, luggage, read};
use serde_json::Value;

/// Every scenario inside the program, and the exit code that its own criteria give it.
const INSIDE: [(&str, u8); 12] = [
    ("air-bearing-facility", 0),
    ("air-bearing-table", 0),
    ("bench-active", 0),
    ("bench-hardware", 0),
    ("bench-passive", 0),
    ("facility", 0),
    ("facility-at-rest", 0),
    ("olev", 0),
    ("olev-damped", 0),
    ("planar", 0),
    ("planar-bodies", 0),
    ("tumbling-target", 0),
];

fn json(shell: &Shell, name: &str) -> Value {
    serde_json::from_str(&shell.read(name)).unwrap()
}

/// A shell with a scenario and its model as files, the first line that has `line` replaced by `instead`.
fn changed(name: &str, line: &str, instead: &str) -> Shell {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", name, "--extract", "DIR"]).exit, 0);
    let text = shell.read(&format!("{name}.toml"));
    assert!(text.contains(line), "{line} is in {text}");
    shell.write(&format!("{name}.toml"), &text.replacen(line, instead, 1));
    shell
}

#[test]
fn every_scenario_inside_the_program_runs_and_gives_what_it_says() {
    let shell = Shell::new();
    let listed: Vec<String> = shell.run(&["run", "--list"]).out.lines().map(str::to_owned).collect();
    assert_eq!(listed.len(), INSIDE.len());
    for (line, (name, exit)) in listed.iter().zip(INSIDE) {
        assert!(line.starts_with(&format!("{name} ")) && line.len() > name.len() + 10, "{line}");
        let ran = shell.run(&["run", name]);
        assert_eq!(ran.exit, exit, "{name}: {}{}", ran.out, ran.err);
        assert_eq!(ran.err, "", "{name}");
    }
}

#[test]
fn the_scenarios_inside_are_the_folder() {
    let names = |folder: &str| -> Vec<String> {
        let entries = std::fs::read_dir(fixtures::folder().join(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| name.ends_with(".toml")).collect();
        // By the name without its ending, as they are listed.
        names.sort_by(|one, other| one.trim_end_matches(".toml").cmp(other.trim_end_matches(".toml")));
        names
    };
    let inside: Vec<String> = fixtures::SCENARIOS.iter().map(|text| text.name.to_owned()).collect();
    assert_eq!(inside, names("scenarios"));
    let models: Vec<String> = fixtures::SCENARIO_MODELS.iter().map(|text| text.name.to_owned()).collect();
    let there: Vec<String> = names("scenarios/models").iter().map(|name| format!("models/{name}")).collect();
    assert_eq!(models, there);
}

#[test]
fn a_limit_says_which_side_of_it_is_the_good_one() {
    let out = Shell::new().run(&["run", "facility"]).out;
    for limit in ["at least 500.0 ms", "at most 15.00 N", "at most 1.000", "at least 0 mJ"] {
        assert!(out.contains(limit), "{limit}: {out}");
    }
}

#[test]
fn two_runs_of_a_scenario_are_the_same_to_the_byte() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "bench-hardware", "-o", "DIR/a.mcap"]).exit, 0);
    assert_eq!(shell.run(&["run", "bench-hardware", "--extract", "DIR"]).exit, 0);
    assert_eq!(shell.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/b.mcap"]).exit, 0);
    let bytes = |name: &str| std::fs::read(shell.path(name)).unwrap();
    assert!(bytes("a.mcap") == bytes("b.mcap"), "inside the program or as a file, it is the same run");
    let other = changed("bench-hardware", "seed = 20140401", "seed = 20140402");
    assert_eq!(other.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/b.mcap"]).exit, 0);
    assert!(std::fs::read(other.path("b.mcap")).unwrap() != bytes("a.mcap"), "another seed is another run");
}

#[test]
fn a_recording_carries_what_makes_it_again() {
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "planar", "-o", "DIR/a.mcap", "--json", "DIR/a.json"]).exit, 0);
    let bytes = std::fs::read(shell.path("a.mcap")).unwrap();
    let carried = luggage(&bytes).unwrap();
    let (_, record) = carried.metadata.iter().find(|(name, _)| name == "dockhil.run").unwrap();
    let answer = json(&shell, "a.json");
    for key in ["fingerprint", "scenario_sha256", "model_sha256", "version", "scenario"] {
        assert_eq!(Value::from(record[key].as_str()), answer[key], "{key}");
    }
    assert_eq!(record["seed"], "20140501");
    let text = |name: &str| {
        let (_, bytes) = carried.files.iter().find(|(file, _)| file == name).unwrap();
        String::from_utf8(bytes.clone()).unwrap()
    };
    let planar = fixtures::SCENARIOS.iter().find(|file| file.name == "planar.toml").unwrap();
    assert_eq!(text("scenario.toml"), planar.text);
    assert!(text("model.toml").contains("name = \"planar\""));
    let session = from_bytes("a.mcap", &bytes, &ReadOptions::default()).unwrap();
    assert_eq!(session.kind, Kind::Impact);
    assert_eq!(session.start_ns, 946_684_800_000_000_000, "the date is the scenario's, never the clock's");
}

/// The recorded cells are compared by the same command; here truth and model share code, so the model is right but for noise.
#[test]
fn a_recording_of_a_run_goes_through_compare_with_no_further_step() {
    for name in ["facility", "bench-passive", "planar"] {
        let shell = Shell::new();
        assert_eq!(shell.run(&["run", name, "-o", "DIR/a.mcap"]).exit, 0, "{name}");
        assert_eq!(shell.run(&["model", "init", "DIR/a.mcap", "-o", "DIR/m.toml"]).exit, 0, "{name}");
        let ran = shell.run(&["compare", "--model", "DIR/m.toml", "DIR/a.mcap", "--json", "DIR/c.json"]);
        assert_eq!(ran.exit, 0, "{name}: {}{}", ran.out, ran.err);
        let closure = &json(&shell, "c.json")["sessions"][0]["software"]["closure_m"];
        assert!(closure.as_f64().unwrap() < 1e-9, "{name}: our own software closes: {closure}");
    }
}

#[test]
fn a_model_with_a_law_and_a_compensation_goes_the_whole_way() {
    let parts = "[plant]\nintegrator = \"semi-implicit\"";
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "bench-hardware", "--extract", "DIR"]).exit, 0);
    let model = shell.read("models/bench-hardware.toml").replacen("[plant]", parts, 1).replacen(
        "[contact]",
        "[compensation]\nmethod = \"phase-lead\"\ndelay_s = 0.012\n\n[contact]\nrelease = \"zero-depth\"\n\
         law = { kind = \"hunt-crossley\", exponent = 1.5, depth_m = 0.005 }",
        1,
    );
    shell.write("models/bench-hardware.toml", &model.replace("damping_n_s_per_m = 0.0", "damping_n_s_per_m = 30.0"));
    let ran = shell.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/a.mcap"]);
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    assert_eq!(shell.run(&["model", "init", "DIR/a.mcap", "-o", "DIR/m.toml"]).exit, 0);
    let nominal = shell.read("m.toml");
    for word in ["semi-implicit", "phase-lead", "hunt-crossley", "zero-depth"] {
        assert!(nominal.contains(word), "{word}: {nominal}");
    }
    let ran = shell.run(&["compare", "--model", "DIR/m.toml", "DIR/a.mcap", "--json", "DIR/c.json"]);
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    let compared = json(&shell, "c.json");
    assert_eq!(compared["verdict"], "inside-noise");
    // The same recording, told of no parts: the software is another one, and that is found.
    shell.write("plain.toml", &nominal.replace("method = \"phase-lead\"\ndelay_s = 0.012", "method = \"none\""));
    let ran = shell.run(&["compare", "--model", "DIR/plain.toml", "DIR/a.mcap", "--json", "DIR/c.json"]);
    assert_eq!(ran.exit, 1, "{}{}", ran.out, ran.err);
    assert!(json(&shell, "c.json")["sessions"][0]["software"]["closure_m"].as_f64().unwrap() > 1e-6);
}

/// Writes the runs of a small campaign with this fault in each, and returns their names.
fn campaign(shell: &Shell, fault: &str) -> Vec<String> {
    assert_eq!(shell.run(&["run", "bench-hardware", "--extract", "DIR"]).exit, 0);
    let text = shell.read("bench-hardware.toml");
    let text = text.split("[[criterion]]").next().unwrap();
    let runs = [("slow", 0.014, 1), ("middle", 0.026, 2), ("fast", 0.042, 3), ("again", 0.026, 4), ("test", 0.034, 5)];
    let mut names = Vec::new();
    for (nth, (name, speed, seed)) in runs.into_iter().enumerate() {
        let text = text
            .replace("velocity_m_per_s = 0.035", &format!("velocity_m_per_s = {speed}"))
            .replace("seed = 20140401", &format!("seed = {seed}\nepoch_s = {}", 946_684_800 + 600 * nth))
            .replace("duration_s = 1.8", "duration_s = 2.2");
        shell.write(&format!("{name}.toml"), &format!("{text}\n{fault}"));
        let ran = shell.run(&["run", &format!("DIR/{name}.toml"), "-o", &format!("DIR/{name}.mcap")]);
        assert_eq!(ran.exit, 0, "{name}: {}{}", ran.out, ran.err);
        names.push(format!("DIR/{name}.mcap"));
    }
    let rest = text.replace("velocity_m_per_s = 0.035", "velocity_m_per_s = 0.0").replace("-0.008", "-0.1");
    shell.write("rest.toml", &rest.replace("duration_s = 1.8", "duration_s = 4.0"));
    assert_eq!(shell.run(&["run", "DIR/rest.toml", "-o", "DIR/rest.mcap"]).exit, 0);
    names
}

#[test]
fn a_fault_of_a_scenario_is_named_by_the_diagnosis_where_truth_and_model_share_code() {
    let shell = Shell::new();
    let fault = "[[effect]]\nid = \"stiffness-hardening\"\ncubic_n_per_m3 = 9e6\n";
    let runs = campaign(&shell, fault);
    assert_eq!(shell.run(&["model", "init", &runs[0], "-o", "DIR/m.toml"]).exit, 0);
    assert!(!shell.read("m.toml").contains("stiffness-hardening"), "the operator believes nothing of it");
    let line = ["diagnose", "--model", "DIR/m.toml", "--aux", "DIR/rest.mcap", "--json", "DIR/d.json", "--learn"];
    let learn: Vec<&str> = runs[..4].iter().map(String::as_str).collect();
    let ran = shell.run(&[&line[..], &learn, &["--test", &runs[4]]].concat());
    let found = json(&shell, "d.json");
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    assert!(found["groups"].to_string().contains("stiffness-hardening"), "{found:#}");
}

#[test]
fn a_fault_acts_from_its_beginning_to_its_end_and_not_before() {
    let forces = |fault: &str| -> Vec<f64> {
        let shell = changed("facility-at-rest", "[start]", &format!("[start]{fault}"));
        let text = shell.read("facility-at-rest.toml").replace(&format!("[start]{fault}"), "[start]");
        shell.write("facility-at-rest.toml", &format!("{text}\n{fault}"));
        let ran = shell.run(&["run", "DIR/facility-at-rest.toml", "-o", "DIR/a.mcap"]);
        assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
        let session = read(&shell.path("a.mcap"), &ReadOptions::default()).unwrap();
        session.sensed.unwrap().value.iter().map(|wrench| wrench.force_n[2]).collect()
    };
    let plain = forces("");
    let with = forces("\n[[effect]]\nid = \"force-bias\"\nforce_n = 0.3\nfrom_s = 1.5\nuntil_s = 2.5\n");
    let differ: Vec<usize> = (0..plain.len()).filter(|&i| plain[i].to_bits() != with[i].to_bits()).collect();
    // Sample n is taken at (n + 1) ms.
    assert_eq!((differ[0], *differ.last().unwrap(), differ.len()), (1499, 2498, 1000));
    for i in differ {
        // Each reading is rounded to a whole mN.
        assert!((with[i] - plain[i] - 0.3).abs() < 1e-3, "sample {i}");
    }
}

#[test]
fn a_fault_that_does_nothing_is_an_error_of_the_run() {
    // As far away as an end stop can be: nothing gets there.
    let catalog = sim_core::effects::standard();
    let params = &catalog.get("end-stop").unwrap().params;
    let table: String = params.iter().map(|param| format!("{} = {:?}\n", param.name, param.upper)).collect();
    let shell =
        changed("bench-hardware", "[[criterion]]", &format!("[[effect]]\nid = \"end-stop\"\n{table}[[criterion]]"));
    let before = shell.names();
    let ran = shell.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/a.mcap", "--json", "DIR/a.json"]);
    assert_eq!((ran.exit, ran.out.as_str()), (6, ""), "{}", ran.err);
    assert!(ran.err.contains("the fault end-stop did nothing") && ran.err.contains("help:"), "{}", ran.err);
    assert_eq!(shell.names(), before, "nothing is written");
}

#[test]
fn a_loop_that_runs_away_ends_there_and_its_recording_is_sound() {
    let shell = changed("bench-active", "duration_s = 1.8", "duration_s = 30.0");
    let model = shell.read("models/bench-active.toml");
    // 3 MN s/m behind 32 ms: b_hi is near 3 kN s/m (reference/PHYSICS.md, section 1.5). One tick of the first touch kicks the
    // satellites out at meters per second.
    shell.write("models/bench-active.toml", &model.replace("damping_n_s_per_m = 20.0", "damping_n_s_per_m = 3e6"));
    let ran = shell.run(&["run", "DIR/bench-active.toml", "-o", "DIR/a.mcap", "--json", "DIR/a.json"]);
    let answer = json(&shell, "a.json");
    assert!(answer["ran_away_s"].as_f64().is_some_and(|at_s| at_s < 30.0), "{answer}");
    assert!(ran.out.contains("ran away"), "{}", ran.out);
    let session = read(&shell.path("a.mcap"), &ReadOptions::default()).unwrap();
    assert!(session.commanded.unwrap().value.iter().all(|pose| pose.position_m[2].abs() <= 30.0));
}

#[test]
fn a_run_with_six_axes_leaves_whole_poses_and_wrenches_and_repeats_to_the_byte() {
    let shell = Shell::new();
    for out in ["DIR/a.mcap", "DIR/b.mcap"] {
        assert_eq!(shell.run(&["run", "olev-damped", "-o", out, "--json", "DIR/a.json", "--force"]).exit, 0);
    }
    let bytes = |name: &str| std::fs::read(shell.path(name)).unwrap();
    assert!(bytes("a.mcap") == bytes("b.mcap"));
    let session = read(&shell.path("a.mcap"), &ReadOptions::default()).unwrap();
    assert_eq!((session.kind, session.believed["axes"].as_str()), (Kind::Impact, "6"));
    let commanded = session.commanded.unwrap().value;
    let sensed = session.sensed.unwrap().value;
    let moves =
        |axis: usize| commanded.iter().any(|pose| (pose.position_m[axis] - commanded[0].position_m[axis]).abs() > 1e-4);
    assert!(moves(0) && moves(1) && moves(2), "the probe is pushed aside");
    // Five standard deviations of the noise.
    let pushes = |axis: usize| sensed.iter().any(|wrench| wrench.force_n[axis].abs() > 0.4);
    assert!(pushes(0) && pushes(1) && pushes(2), "the wall pushes across and along");
    assert!(commanded.iter().any(|pose| pose.orientation_xyzw[2].abs() > 1e-3), "the probe rolls");
}

/// 1/15.6 = 2/50 + 2 (0.155)²/2 (reference/PHYSICS.md, section 3.1): two bodies with lever arms are the point of that mass, as
/// long as they have hardly turned.
#[test]
fn two_bodies_with_lever_arms_rebound_as_their_reduced_mass() {
    let shell = Shell::new();
    let rebound = |name: &str| {
        assert_eq!(shell.run(&["run", name, "--json", "DIR/a.json", "-o", "DIR/a.mcap", "--force"]).exit, 0);
        let answer = json(&shell, "a.json");
        let restitution = &answer["verdicts"][1];
        let (first, last) = (&answer["contact_s"][0], &answer["contact_s"][1]);
        let duration_s = last.as_f64().unwrap() - first.as_f64().unwrap();
        (restitution["value"].as_f64().unwrap(), restitution["uncertainty"].as_f64().unwrap(), duration_s)
    };
    let (one, one_u, one_s) = rebound("planar");
    let (six, six_u, six_s) = rebound("planar-bodies");
    let session = read(&shell.path("a.mcap"), &ReadOptions::default()).unwrap();
    assert!((session.believed_f64("reduced_mass_kg").unwrap() - 1.0 / (2.0 / 50.0 + 0.155 * 0.155)).abs() < 1e-12);
    // Two samples of the sensor for each edge.
    assert!((one_s - six_s).abs() <= 0.004, "{one_s} s, {six_s} s");
    // The bodies part at a point that swings: the mean speed of the 100 ms that begin 60 ms after release has the curvature
    // of that swing in it, (ω r ω) t with ω = 0.155 × 2 × 15.6 kg × 0.035 m/s / 2 kg m² = 0.085 rad/s each, r = 0.3 m and t =
    // 0.11 s: 0.24 mm/s each, of 35 mm/s, for two bodies.
    let swing = 2.0 * 0.085 * 0.085 * 0.3 * 0.11 / 0.035;
    assert!((one - six).abs() < one_u + six_u + swing, "{one} ± {one_u}, {six} ± {six_u}, swing {swing}");
}

#[test]
fn wrong_models_with_six_axes_are_refused_at_their_place() {
    for (line, instead, words) in [
        ("mass_kg = 90.0", "mass_kg = -90.0", &["chaser: mass_kg = -90 kg is not above 0"][..]),
        ("inertia_kg_m2 = [12.0, 12.0, 8.0]", "inertia_kg_m2 = [1.0, 1.0, 8.0]", &["chaser: inertia_kg_m2"]),
        ("throat_radius_m = 0.015", "throat_radius_m = 0.5", &["geometry: throat_radius_m = 0.5 m"]),
        ("half_angle_deg = 30.0", "half_angle_deg = 95.0", &["geometry: half_angle_deg = 95 deg"]),
        ("kind = \"cone\"", "kind = \"egg\"", &["unknown variant `egg`"]),
        ("friction = 0.1", "friction = -0.1", &["contact: friction = -0.1"]),
        ("command_delay_s = 0.016", "command_delay_s = 0.001", &["is shorter than one loop period"]),
        ("dead_band_n = 0.5", "dead_band = 0.5", &["unknown field `dead_band`"]),
        ("rig = \"docking-space\"", "rig = \"docking\"", &["unknown field `chaser`"]),
        ("rig = \"docking-space\"", "rig = \"dcking\"", &["`docking`, `docking-space` or `drive`", "── here"]),
        (
            "interface_m = [",
            "interface_m = [nan, 0.0, 0.5] # [",
            &["chaser: interface_m = NaN m", "│ interface_m = [nan"],
        ),
    ] {
        let shell = Shell::new();
        assert_eq!(shell.run(&["run", "olev", "--extract", "DIR"]).exit, 0);
        let text = shell.read("models/olev.toml");
        assert!(text.contains(line), "{line}");
        shell.write("models/olev.toml", &text.replacen(line, instead, 1));
        let ran = shell.run(&["run", "DIR/olev.toml", "-o", "DIR/a.mcap"]);
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{instead}: {}", ran.err);
        let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in words.iter().chain(&["olev.toml: line", "help:"]) {
            assert!(said.contains(word), "{instead} says {word:?}: {said}");
        }
    }
    let shell = Shell::new();
    assert_eq!(shell.run(&["run", "olev", "-o", "DIR/a.mcap"]).exit, 0);
    shell
        .write("m.toml", fixtures::SCENARIO_MODELS.iter().find(|file| file.name == "models/planar.toml").unwrap().text);
    for line in [
        "replay DIR/a.mcap",
        "replay DIR/a.mcap --model DIR/m.toml",
        "model init DIR/a.mcap -o DIR/n.toml",
        "compare --model DIR/m.toml DIR/a.mcap",
        "compare --reference DIR/a.mcap DIR/a.mcap",
        "diagnose --model DIR/m.toml --learn DIR/a.mcap --test DIR/a.mcap",
    ] {
        let ran = shell.run(&line.split(' ').collect::<Vec<_>>());
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{line}: {}", ran.err);
        assert!(ran.err.contains("was recorded with 6 axes") && ran.err.contains("dockhil run"), "{line}: {}", ran.err);
    }
    assert_eq!(shell.run(&["run", "olev", "--extract", "DIR"]).exit, 0);
    let ran = shell.run(&["model", "check", "DIR/models/olev.toml"]);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    let ran = shell.run(&["compare", "--model", "DIR/models/olev.toml", "DIR/a.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("the model has six axes"), "{}", ran.err);
}

/// Runs a scenario with one line changed, and expects every one of `words` in the error, exit code 2, and no file.
fn refuses(name: &str, line: &str, instead: &str, words: &[&str]) {
    let shell = changed(name, line, instead);
    let before = shell.names();
    let ran = shell.run(&["run", &format!("DIR/{name}.toml"), "-o", "DIR/a.mcap", "--report", "DIR/r.html"]);
    assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{instead}: {}", ran.err);
    let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in words.iter().chain(&["help:", "× DIR/"]) {
        assert!(said.contains(word), "{instead} says {word:?}: {said}");
    }
    assert_eq!(shell.names(), before, "{instead}: nothing is written");
}

#[test]
fn wrong_scenarios_are_refused_with_file_place_value_and_limit() {
    let wrong = [
        ("seed = 20140401\n", "", &["bench-hardware.toml", "missing field `seed`"][..]),
        ("seed = 20140401", "sede = 20140401", &["line 7", "unknown field `sede`", "── here"]),
        ("duration_s = 1.8", "duration_s = -1.8", &["line 8", "duration_s = -1.8 s is outside (0, 3600]"]),
        ("duration_s = 1.8", "duration_s = 0.01", &["duration_s = 0.01 s is below 0.08 s, 20 ticks"]),
        (
            "duration_s = 1.8",
            "duration_s = 1.8003",
            &["line 8", "duration_s = 1.8003 s is no whole number of ticks", "give 1.8 or 1.804 s"],
        ),
        ("velocity_m_per_s = 0.035", "velocity_m_per_s = 35.0", &["velocity_m_per_s = 35 m/s is outside [-10, 10]"]),
        ("position_m = -0.008", "position_m = [0, 0, -0.008]", &["start.position_m has three parts", "one axis"]),
        ("position_m = -0.008", "position_m = \"near\"", &["line 12", "expected one number along the axis"]),
        ("schema = 1", "schema = 3", &["line 1", "schema = 3 is not 1"]),
        ("models/bench-hardware.toml", "models/bench.toml", &["models/bench.toml", "cannot read the model"]),
        ("at_most = 1.0", "at_most = nan", &["criterion 2 (restitution)", "at_most = NaN", "is not a finite number"]),
        (
            "at_most_n = 15.0",
            "at_most = 15.0",
            &["line 25", "criterion 3 (peak-force): unknown field `at_most`", "at_most = 15.0"],
        ),
        ("at_most_n = 15.0", "", &["line 24", "criterion 3 (peak-force): missing field `at_most_n`"]),
        ("at_most = 1.0", "release = \"never\"", &["line 21", "criterion 2 (restitution): unknown variant `never`"]),
        ("at_most = 1.0", "at_most = \"one\"", &["line 21", "criterion 2 (restitution): ", "expected a number"]),
        ("id = \"peak-force\"\n", "", &["line 23", "criterion 3 (without an id): missing field `id`"]),
        ("id = \"restitution\"", "id = \"restitusion\"", &["unknown variant `restitusion`"]),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"force-bais\"\nforce_n = 0.3\n[[criterion]]",
            &["did you mean force-bias?"],
        ),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"force-bias\"\nforce_n = 0.3\nfrom_s = 3.0\n[[criterion]]",
            &["force-bias.from_s = 3 s is outside [0, 1.8]"],
        ),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"command-delay\"\ndelay_s = 16\n[[criterion]]",
            &["command-delay.delay_s = 16 s is outside"],
        ),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"command-delay\"\ndelay_s = -0.0125\n[[criterion]]",
            &["line 17", "command-delay is 0.003500 s, below one loop period, 0.004 s"],
        ),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"measurement-delay\"\ndelay_s = -0.0165\n[[criterion]]",
            &["measurement-delay is -0.000500 s, below 0"],
        ),
        (
            "[[criterion]]",
            "[[effect]]\nid = \"clock-offset\"\noffset_s = 0.005\nfrom_s = 1.0\n[[criterion]]",
            &["clock-offset shifts every stamp"],
        ),
        (
            "[[criterion]]",
            "[session]\nft_bias = \"0\"\n[[criterion]]",
            &["session.ft_bias is written by the run itself"],
        ),
    ];
    for (line, instead, words) in wrong {
        refuses("bench-hardware", line, instead, words);
    }
}

#[test]
fn names_and_files_that_are_not_there_are_refused() {
    let shell = Shell::new();
    shell.refuses(
        &["run", "bench", "-o", "DIR/a.mcap"],
        "  × argument SCENARIO: there is no scenario \"bench\" inside the program, and no such file
  help: give a file that ends in .toml, or one of: air-bearing-facility, air-bearing-table, bench-active, bench-hardware, bench-passive, facility, facility-at-rest, olev, olev-damped, planar, planar-bodies, tumbling-target
",
    );
    let ran = shell.run(&["run", "DIR/none.toml"]);
    assert!(ran.exit == 2 && ran.err.contains("cannot read the scenario"), "{}", ran.err);
    shell.write("a.mcap", "somebody's work");
    let ran = shell.run(&["run", "planar", "-o", "DIR/a.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("exists already"), "{}", ran.err);
    assert_eq!(shell.read("a.mcap"), "somebody's work");
    let ran = shell.run(&["run", "planar", "-o", "DIR/b.mcap", "--json", "DIR/b.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("named for two results"), "{}", ran.err);
    let ran = shell.run(&["run", "planar", "-o", "-"]);
    assert!(ran.exit == 2 && ran.err.contains("-: stands for standard output"), "{}", ran.err);
    for (option, file) in [("-o", "DIR/b.mcap"), ("--json", "DIR/b.json"), ("--report", "DIR/b.html")] {
        let ran = shell.run(&["run", "planar", "--extract", "DIR", option, file]);
        assert!(ran.exit == 2 && ran.err.contains("cannot be used with"), "{option}: {}", ran.err);
    }
    assert_eq!(shell.names(), ["a.mcap"], "nothing is written");
    assert_eq!(shell.run(&["run"]).exit, 2);
}

#[test]
fn wrong_parts_of_a_model_are_refused_at_their_place() {
    for (line, instead, words) in [
        (
            "[contact]",
            "[contact]\nlaw = { kind = \"hertz\", exponent = -1.5, depth_m = 0.005 }",
            &["contact.law: exponent = -1.5"][..],
        ),
        ("[contact]", "[contact]\nlaw = { kind = \"hertz\", exponent = 1.5 }", &["missing field `depth_m`"]),
        ("[contact]", "[contact]\nlaw = { kind = \"rubber\" }", &["unknown variant `rubber`"]),
        (
            "[contact]",
            "[contact]\nlaw = { kind = \"table\", rows = [[0.002, 1.0], [0.001, 0.8]] }",
            &["is not above the row before"],
        ),
        ("[contact]", "[contact]\nrelease = \"never\"", &["unknown variant `never`"]),
        ("[plant]", "[plant]\nintegrator = \"euler\"", &["unknown variant `euler`"]),
        (
            "[plant]",
            "[compensation]\nmethod = \"phase-lead\"\ndelay_s = -0.01\n[plant]",
            &["compensation: delay_s = -0.01 s is below 0"],
        ),
        ("[plant]", "[compensation]\nmethod = \"phase-lead\"\ndelay = 0.01\n[plant]", &["unknown field `delay`"]),
        ("[virtual_contact]", "[virtual_contact]\npose = \"guessed\"", &["unknown variant `guessed`"]),
    ] {
        let shell = Shell::new();
        assert_eq!(shell.run(&["run", "bench-hardware", "--extract", "DIR"]).exit, 0);
        let text = shell.read("models/bench-hardware.toml");
        shell.write("models/bench-hardware.toml", &text.replacen(line, instead, 1));
        let ran = shell.run(&["run", "DIR/bench-hardware.toml", "-o", "DIR/a.mcap"]);
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{instead}: {}", ran.err);
        let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in words.iter().chain(&["bench-hardware.toml: line", "help:"]) {
            assert!(said.contains(word), "{instead} says {word:?}: {said}");
        }
    }
}
