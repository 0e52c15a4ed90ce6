//! The command as a shell would call it: what it prints, what it refuses, and how.

use crate::shell::{Shell, impact};
use harness::cli::{Console, Look, run};
use harness::model::Model;
use sim_core::effects::standard;
use std::io::Write;
use std::path::Path;

/// The nominal model with this line changed is refused with exactly this text.
fn check_mistake(line: &str, instead: &str, expected: &str) {
    let shell = Shell::with_model();
    let added = "\n[[effect]]\nid = \"command-delay\"\ndelay_s = 0.01\n";
    let text = shell.read("m.toml").lines().map(strip_comment).collect::<Vec<_>>().join("\n") + "\n" + added;
    assert!(text.contains(line), "{line} is in {text}");
    shell.write("m.toml", &text.replace(line, instead));
    shell.refuses(&["model", "check", "DIR/m.toml"], expected);
}

/// Comments hold the hash of the recording and the sentences of the schema, neither of which is tested here.
fn strip_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim_end()
}

#[test]
fn a_mistake_in_a_model_is_shown_at_its_place() {
    check_mistake(
        "\nmass_kg = 63.2",
        "\nmass = 63.2",
        "  × DIR/m.toml: line 11: unknown field `mass`, expected `mass_kg` or `integrator`
    ╭─[11:1]
 10 │ [plant]
 11 │ mass = 63.2
    · ──┬─
    ·   ╰── here
 12 │ 
    ╰────
  help: see the keys that are known with: dockhil model schema
",
    );
    check_mistake(
        "\nmass_kg = 63.2",
        "\nmass_kg = 0",
        "  × DIR/m.toml: line 11: plant.mass_kg = 0 is not above 0
    ╭─[11:1]
 10 │ [plant]
 11 │ mass_kg = 0
    · ─────┬─────
    ·      ╰── here
 12 │ 
    ╰────
  help: give a positive number in the unit of the key
",
    );
    check_mistake(
        "\nmass_kg = 63.2",
        "\nmass_kg = -63.2",
        "  × DIR/m.toml: line 11: plant.mass_kg = -63.2 is not above 0
    ╭─[11:1]
 10 │ [plant]
 11 │ mass_kg = -63.2
    · ───────┬───────
    ·        ╰── here
 12 │ 
    ╰────
  help: give a positive number in the unit of the key
",
    );
    check_mistake(
        "command-delay",
        "comand-delay",
        "  × DIR/m.toml: line 52: unknown effect comand-delay; did you mean command-delay?
    ╭─[52:1]
 51 │ [[effect]]
 52 │ id = \"comand-delay\"
    · ─────────┬─────────
    ·          ╰── here
 53 │ delay_s = 0.01
    ╰────
  help: see all of them with: dockhil effect list
",
    );
    check_mistake(
        "\ndelay_s = 0.01",
        "\ndelay_s = 16",
        "  × DIR/m.toml: line 53: command-delay.delay_s = 16 s is outside [-0.05, 0.2]
    ╭─[53:1]
 52 │ id = \"command-delay\"
 53 │ delay_s = 16
    · ──────┬─────
    ·       ╰── here
    ╰────
  help: give a value inside, or remove the effect
",
    );
    check_mistake(
        "\ndelay_s = 0.01",
        "",
        "  × DIR/m.toml: line 52: effect command-delay lacks its parameter delay_s
    ╭─[52:1]
 51 │ [[effect]]
 52 │ id = \"command-delay\"
    · ──────────┬─────────
    ·           ╰── here
    ╰────
  help: add delay_s = a number in s
",
    );
}

/// A number that no rig has is refused, whichever it is, before anything computes with it.
#[test]
fn every_number_of_a_model_is_checked() {
    for (line, instead, expected) in [
        ("mass_kg = 63.2", "mass_kg = nan", "plant.mass_kg = NaN is not above 0"),
        ("mass_kg = 63.2", "mass_kg = \"much\"", "invalid type: string \"much\", expected a number"),
        ("damping_n_s_per_m = 6.0", "damping_n_s_per_m = nan", "contact.damping_n_s_per_m = NaN is not a number"),
        ("bias_n = 2.1", "bias_n = inf", "sensor.bias_n = inf is above"),
        ("white_sigma_n = 0.08", "white_sigma_n = -0.08", "sensor.white_sigma_n = -0.08 is below 0"),
        ("physics_step_s = 0.001", "physics_step_s = 1e-10", "timing.physics_step_s = 1e-10 is below 0.000001"),
        ("physics_step_s = 0.001", "physics_step_s = 0.0007", "is not a whole number of physics steps of 0.0007 s"),
        ("measurement_delay_s = 0.016", "measurement_delay_s = 16", "timing.measurement_delay_s = 16 is above 10"),
        ("command_delay_s = 0.016", "command_delay_s = 0.001", "is shorter than one loop period, 0.004 s"),
        ("delay_s = 0.01\n", "delay_s = -0.05\n", "command-delay is -0.034000 s, below one loop period, 0.004 s"),
        ("schema = 1", "schema = 2", "schema = 2 is not 1, the only version there is"),
        (
            "id = \"command-delay\"",
            "id = \"asymmetric-damping\"",
            "effect asymmetric-damping cannot happen on this rig",
        ),
        ("delay_s = 0.01\n", "delay_ms = 16\n", "effect command-delay has no parameter delay_ms"),
        ("[[effect]]", "[[effect]]\nid = \"command-delay\"\ndelay_s = 0.0\n[[effect]]", "stands in the file twice"),
        ("[[effect]]", "[[effect", "unclosed array table, expected `]]`"),
    ] {
        let shell = Shell::with_model();
        let text = shell.read("m.toml") + "\n[[effect]]\nid = \"command-delay\"\ndelay_s = 0.01\n";
        let changed = text.replacen(line, instead, 1);
        assert_ne!(changed, text, "{line} is in the model");
        shell.write("m.toml", &changed);
        let ran = shell.run(&["model", "check", "DIR/m.toml"]);
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{instead}");
        assert!(ran.err.starts_with("  × DIR/m.toml: line ") && ran.err.contains(expected), "{instead}: {}", ran.err);
        assert!(ran.err.contains("── here") && ran.err.contains("  help: "), "{instead}: {}", ran.err);
    }
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    let shell = Shell::with_model();
    shell.write("text.mcap", "today we measured\n");
    shell.write("empty.mcap", "");
    shell.refuses(
        &["compare", "--model", "DIR/m.toml", "DIR/none.mcap"],
        "  × DIR/none.mcap: there is no such file\n  help: check the path; a recording is one .mcap or .csv file\n",
    );
    shell.refuses(
        &["compare", "--model", "DIR/m.toml", &impact(), "DIR/text.mcap"],
        "  × DIR/text.mcap: byte 0: is no mcap recording: it begins with `today we measure`, expected the mcap marker 89 4d 43 41 50
  help: name a recording; a table of numbers must end in .csv and needs [csv] in the map
",
    );
    shell.refuses(
        &["model", "init", "DIR/empty.mcap", "-o", "DIR/new.toml"],
        "  × DIR/empty.mcap: is empty (0 bytes)\n  help: the recorder wrote nothing, or the copy failed: copy it again\n",
    );
    let mut damaged = std::fs::read(impact()).unwrap();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    std::fs::File::create(shell.path("damaged.mcap")).unwrap().write_all(&damaged).unwrap();
    let ran = shell.run(&["model", "init", "DIR/damaged.mcap", "-o", "DIR/new.toml"]);
    assert_eq!(ran.exit, 2);
    assert!(ran.err.contains("--salvage") && !shell.path("new.toml").exists(), "{}", ran.err);
}

#[test]
fn what_could_not_be_written_later_is_refused_now() {
    let shell = Shell::with_model();
    let model = ["--model", "DIR/m.toml"];
    shell.refuses(
        &["compare", model[0], model[1], &impact(), "--json", "DIR/no/such.json"],
        "  × DIR/no/such.json: the folder DIR/no does not exist\n  help: make the folder, or name another file\n",
    );
    shell.refuses(
        &["compare", model[0], model[1], &impact(), "--report", "DIR"],
        "  × DIR: is a folder, expected a file to write\n  help: name a file in it\n",
    );
    let recording = impact();
    let sets = ["--learn", recording.as_str(), "--test", recording.as_str()];
    shell.refuses(
        &[&["diagnose"], &model[..], &sets, &["--write-model", "DIR/m.toml"]].concat(),
        "  × DIR/m.toml: exists already and was left as it is\n  help: name another file, or overwrite it with --force\n",
    );
    let ran = shell.run(&[&["diagnose"], &model[..], &sets].concat());
    assert!(ran.exit == 2 && ran.err.contains("this test recording is also learned from"), "{}", ran.err);
}

#[test]
fn the_nominal_model_of_a_recording_is_sound_and_explained() {
    let shell = Shell::with_model();
    let text = shell.read("m.toml");
    assert!(text.starts_with("# A model for dockhil. SI units"), "{text}");
    assert!(
        text.contains(
            "\n# The device in contact, or the bearing of a drive.\n[contact]\nstiffness_n_per_m = 1066.0  # "
        ),
        "{text}"
    );
    let from = harness::recording::read(Path::new(&impact()), &harness::recording::ReadOptions::default()).unwrap();
    let expected = harness::model::from_session(&from).unwrap();
    assert_eq!(Model::parse("m.toml", &text, &standard()).unwrap(), expected, "the text is the model");
    let again = shell.run(&["model", "init", &impact(), "-o", "DIR/m.toml"]);
    assert_eq!((again.exit, shell.read("m.toml")), (2, text.clone()), "an old file is left as it is");
    let forced = shell.run(&["model", "init", &impact(), "-o", "DIR/m.toml", "--force"]);
    assert_eq!((forced.exit, shell.read("m.toml")), (0, text));
    let checked = shell.run(&["model", "check", "DIR/m.toml"]);
    assert_eq!(
        (checked.exit, checked.out.as_str()),
        (0, "DIR/m.toml: docking cell, 63.2 kg, 1066 N/m, 6 N s/m, effects: 0 enabled of 0\n")
    );
    assert_eq!(shell.names(), ["m.toml"], "nothing else is left");
}

/// A model with effects, awkward numbers and awkward letters survives its own text.
#[test]
fn any_model_survives_its_text() {
    let shell = Shell::with_model();
    let mut model = Model::parse("m.toml", &shell.read("m.toml"), &standard()).unwrap();
    model.name = "a \"name\" # with\nletters".to_owned();
    model.plant.mass_kg = 1.0 / 3.0;
    model.contact.stiffness_n_per_m = 1e21;
    model.readout.position_sigma_m = 1e-7;
    for kind in standard().kinds().iter().filter(|kind| kind.rigs != sim_core::effect::Where::Drive) {
        let values = kind.params.iter().map(|param| (param.name.to_string(), param.starts[0] / 1.0)).collect();
        model.effects.push(harness::model::EffectModel {
            id: kind.id.to_string(),
            enabled: kind.id.len() % 2 == 0,
            source: "thesis, p. 18 ('nominal')".to_owned(),
            values,
        });
    }
    let text = model.text("a test").unwrap();
    assert_eq!(Model::parse("m.toml", &text, &standard()).unwrap(), model, "{text}");
}

#[test]
fn effects_are_added_changed_and_removed_in_place() {
    let shell = Shell::with_model();
    let before = shell.read("m.toml");
    let added = shell.run(&["effect", "add", "command-loss:probability_in=0.1", "force-lag", "--model", "DIR/m.toml"]);
    assert_eq!(added.exit, 0, "{}", added.err);
    let text = shell.read("m.toml");
    assert!(text.starts_with(&before), "the rest of the file keeps its bytes");
    let source = "given on the command line; probability_out only where a fit would start, neither measured nor fitted";
    let table = format!(
        "\n[[effect]]\nid = \"command-loss\"\nprobability_in = 0.1\nprobability_out = 0.9\nsource = \"{source}\"\n"
    );
    assert!(text.contains(&table), "{text}");
    assert!(text.contains("id = \"force-lag\""), "{text}");
    shell.write("m.toml", &text.replace("probability_out = 0.9", "probability_out = 0.9 # a guess"));
    let changed =
        ["effect", "add", "command-loss:probability_out=0.5", "--model", "DIR/m.toml", "--source", "data sheet"];
    let changed = shell.run(&changed);
    assert_eq!(changed.out, "DIR/m.toml: changed command-loss; probability_out = 0.5 (data sheet)\n");
    assert!(
        shell
            .read("m.toml")
            .contains("probability_in = 0.1\nprobability_out = 0.5 # a guess\nsource = \"data sheet\"\n")
    );
    shell.refuses(
        &["effect", "add", "command-loss", "--model", "DIR/m.toml"],
        "  × DIR/m.toml: effect command-loss is in the model already, and no value was given
  help: give values, as command-loss:param=value, or fit it: dockhil effect fit command-loss --model DIR/m.toml --learn RECORDING…
",
    );
    let listed = shell.run(&["effect", "list", "--model", "DIR/m.toml"]).out;
    assert!(listed.contains("* command-loss ") && listed.contains("probability_out [0.01, 1] 1 = 0.5\n"), "{listed}");
    for id in ["command-loss", "force-lag"] {
        assert_eq!(shell.run(&["effect", "remove", id, "--model", "DIR/m.toml"]).exit, 0);
    }
    assert_eq!(shell.read("m.toml"), before);
    shell.refuses(
        &["effect", "remove", "force-lag", "--model", "DIR/m.toml"],
        "  × DIR/m.toml: effect force-lag is not in the model; it has none
  help: add it with: dockhil effect add force-lag --model DIR/m.toml
",
    );
    shell.refuses(
        &["effect", "add", "force-lag", "force-bais", "--model", "DIR/m.toml"],
        "  × argument \"force-bais\": unknown effect force-bais; did you mean force-bias?
  help: see all of them with: dockhil effect list
",
    );
    shell.refuses(
        &["effect", "add", "command-delay:delay_s=16", "--model", "DIR/m.toml"],
        "  × argument \"command-delay:delay_s=16\": delay_s = 16 s is outside [-0.05, 0.2]\n  help: give a value inside\n",
    );
    shell.refuses(
        &["effect", "add", "asymmetric-damping", "--model", "DIR/m.toml"],
        "  × DIR/m.toml: after this change: effect asymmetric-damping cannot happen on this rig
  help: see the rigs of each effect with: dockhil effect list
",
    );
}

#[test]
fn a_fit_says_what_it_moved_and_what_it_doubts() {
    let shell = Shell::with_model();
    let rest = fixtures::session("cell-a", "static.mcap").display().to_string();
    let fitted = shell.run(&["effect", "add", "coulomb-friction", "--model", "DIR/m.toml", "--fit", &rest]);
    assert_eq!(fitted.exit, 0, "{}", fitted.err);
    assert!(fitted.out.contains("doubtful: force_n cannot be told from 0 in these recordings"), "{}", fitted.out);
    assert!(fitted.out.contains("moved along: contact.stiffness_n_per_m from"), "{}", fitted.out);
    assert!(shell.read("m.toml").contains("; doubtful: force_n"), "the model remembers the doubt");
}

#[test]
fn the_list_of_effects_is_the_catalogue() {
    let shell = Shell::new();
    let json = shell.run(&["effect", "list", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    let ids: Vec<&str> =
        value["effects"].as_array().unwrap().iter().map(|entry| entry["id"].as_str().unwrap()).collect();
    let catalog = standard();
    assert_eq!(ids, catalog.kinds().iter().map(|kind| kind.id.as_ref()).collect::<Vec<_>>());
    let text = shell.run(&["effect", "list"]).out;
    for kind in catalog.kinds() {
        let params = kind.params.iter().map(|param| param.name.as_ref());
        for word in [kind.id.as_ref(), kind.about.as_ref()].into_iter().chain(params) {
            assert!(text.contains(word), "{word}");
        }
        let sheet = shell.run(&["effect", "show", &kind.id]);
        assert!(sheet.exit == 0 && sheet.out.contains(kind.experiment.as_ref()), "{}", sheet.out);
    }
}

#[test]
fn the_schema_is_current() {
    let all = [
        ("model-1.json", &["model", "schema"][..]),
        ("map-1.json", &["model", "schema", "--map"]),
        ("model-space-1.json", &["model", "schema", "--space"]),
        ("scenario-1.json", &["run", "--schema"]),
        ("cell-1.json", &["cell", "--schema"]),
    ];
    for (name, args) in all {
        let committed = std::fs::read_to_string(fixtures::folder().join("schemas").join(name)).unwrap();
        let again = format!("cargo run -- {} > fixtures/schemas/{name}", args.join(" "));
        let printed = Shell::new().run(args).out;
        let differ = printed.lines().zip(committed.lines()).find(|(new, old)| new != old);
        assert!(printed == committed, "first difference (printed, committed): {differ:?}; write it again: {again}");
    }
}

#[test]
fn effects_that_cannot_be_edited_are_refused() {
    let shell = Shell::with_model();
    let text = format!("effect = [{{ id = \"command-delay\", delay_s = 0.01 }}]\n{}", shell.read("m.toml"));
    shell.write("m.toml", &text);
    assert_eq!(shell.run(&["model", "check", "DIR/m.toml"]).exit, 0, "it is a sound model");
    shell.refuses(
        &["effect", "add", "force-lag", "--model", "DIR/m.toml"],
        "  × DIR/m.toml: key effect: the effects stand in one list, which cannot be edited here
  help: write each of them as a table of its own: [[effect]]
",
    );
}

#[test]
fn usage_is_two_and_help_is_zero() {
    let shell = Shell::new();
    for args in [&["--help"][..], &["diagnose", "--help"], &["--version"]] {
        let ran = shell.run(args);
        assert!((ran.exit, ran.err.as_str()) == (0, "") && !ran.out.is_empty(), "{args:?}");
    }
    for (args, expected) in [
        (&["comprae"][..], "a similar subcommand exists: 'compare'"),
        (&["compare"], "--model <MODEL.toml>"),
        (
            &["compare", "--model", "m", "s", "--limit", "force_z_n=-1"],
            "force_z_n = -1 is not a finite number from 0 up",
        ),
        (&["diagnose", "--model", "m", "--learn", "a"], "--test <RECORDING>..."),
        (&[], "Usage: dockhil <COMMAND>"),
    ] {
        let ran = shell.run(args);
        assert!((ran.exit, ran.out.as_str()) == (2, "") && ran.err.contains(expected), "{args:?}: {}", ran.err);
    }
}

/// A reader that has gone, as `head` does.
struct Gone(std::io::ErrorKind);

impl Write for Gone {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(self.0.into())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Err(self.0.into())
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error_and_a_full_disk_is() {
    for (kind, expected) in [(std::io::ErrorKind::BrokenPipe, 0), (std::io::ErrorKind::StorageFull, 2)] {
        let mut err = Vec::new();
        let exit = run(
            ["dockhil", "effect", "list"],
            &standard(),
            &mut Console::new(&mut Gone(kind), &mut err, Look::default()),
        );
        assert_eq!((exit, err.is_empty()), (expected, expected == 0), "{}", String::from_utf8_lossy(&err));
    }
}

#[test]
fn colours_are_only_for_those_who_see_them() {
    let ran = |colour| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let look = Look { colour, terminal: false };
        run(["dockhil", "model", "check", "/no/such"], &standard(), &mut Console::new(&mut out, &mut err, look));
        String::from_utf8(err).unwrap()
    };
    assert!(ran(true).contains('\u{1b}') && !ran(false).contains('\u{1b}'));
}
