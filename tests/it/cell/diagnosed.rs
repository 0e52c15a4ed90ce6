//! A recording of the virtual cell goes through `compare` and `diagnose` as it is.

use super::cell;
use crate::shell::{Ran, Shell};

/// N/m³; the start of a fit is a third of it.
pub const HIDDEN: &str = "[[fault]]\nid = \"stiffness-hardening\"\ncubic_n_per_m3 = 9e6\n";

pub fn folder(cell_text: &str) -> Shell {
    let shell = Shell::new();
    for file in fixtures::CELL_FILES.iter().filter(|file| file.name.contains('/')) {
        std::fs::create_dir_all(shell.path(file.name).parent().unwrap()).unwrap();
        shell.write(file.name, file.text);
    }
    shell.write("cell.toml", cell_text);
    shell
}

fn record(shell: &Shell, name: &str, more: &[&str]) {
    let output = format!("DIR/{name}.mcap");
    let fixed = ["test", "--controller", "reference", "--cell", "DIR/cell.toml", "-o", &output];
    let ran = shell.run(&[&fixed, more].concat());
    assert_eq!(ran.exit, 0, "{name}: {}{}", ran.out, ran.err);
}

fn found(ran: &Ran) -> &str {
    ran.out.split("WHAT IS MISSING").nth(1).unwrap_or_else(|| panic!("{}{}", ran.out, ran.err))
}

#[test]
fn the_injected_effect_is_named() {
    let shell = folder(&cell("bench", HIDDEN).source.text);
    let speeds = ["0.014", "0.026", "0.042", "0.026"];
    for (nth, speed) in speeds.iter().enumerate() {
        record(&shell, &format!("learn_{nth}"), &["--velocity", speed, "--seed", &format!("{nth}")]);
    }
    record(&shell, "test_5", &["--velocity", "0.036", "--seed", "5"]);
    // What is at rest or in free flight touches nothing, so that the effect would be one that did nothing.
    shell.write("cell.toml", &cell("bench", "").source.text);
    let far = ["--velocity", "0", "--position=-0.15", "--duration", "4"];
    record(&shell, "static", &[&far[..], &["--task", "rest", "--seed", "6"]].concat());
    record(&shell, "excite", &[&far[..], &["--task", "excite", "--seed", "7"]].concat());
    let learn: Vec<String> = (0..speeds.len()).map(|nth| format!("DIR/learn_{nth}.mcap")).collect();
    let learn: Vec<&str> = learn.iter().map(String::as_str).collect();
    let model = ["--model", "DIR/models/bench.toml"];
    let compared = shell.run(&[&["compare"], &model[..], &learn].concat());
    assert!(compared.out.contains("force, compression"), "{}{}", compared.out, compared.err);
    // Texts are wrapped.
    let text = compared.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("gives the recorded commands to") && !text.contains("misses the recorded"), "{text}");
    let others = ["--aux", "DIR/static.mcap", "DIR/excite.mcap", "--test", "DIR/test_5.mcap"];
    let written = ["--write-model", "DIR/found.toml"];
    let diagnosed = shell.run(&[&["diagnose"], &model[..], &["--learn"], &learn, &others, &written].concat());
    assert_eq!(diagnosed.exit, 0, "{}{}", diagnosed.out, diagnosed.err);
    assert!(found(&diagnosed).contains("stiffness-hardening"), "{}", diagnosed.out);
    let text = shell.read("found.toml");
    let effects: Vec<&str> = text.lines().filter(|line| line.starts_with("id = ")).collect();
    assert_eq!(effects, ["id = \"stiffness-hardening\""], "{text}");
}

/// With the four digits of a real controller the software block closes to what they allow, and nobody is blamed for them.
#[test]
fn rounded_commands_are_nobodys_fault() {
    let shell = folder(&cell("bench", "").source.text.replace("decimals = 9", "decimals = 4"));
    record(&shell, "impact", &["--velocity", "0.03517"]);
    let ran = shell.run(&["compare", "--model", "DIR/models/bench.toml", "DIR/impact.mcap"]);
    let text = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!text.contains("misses the recorded"), "{}{}", ran.out, ran.err);
    assert!(text.contains("and their rounding allows"), "{}", ran.out);
}

/// Impacts of a cell with this fault at four speeds, the last for testing, and what is said of them.
pub fn diagnosed(fault: &str) -> Ran {
    let shell = folder(&cell("bench", fault).source.text);
    for (nth, speed) in ["0.025", "0.030", "0.035", "0.040"].iter().enumerate() {
        record(&shell, &format!("r{nth}"), &["--velocity", speed, "--seed", &format!("{nth}")]);
    }
    let learn = ["--learn", "DIR/r0.mcap", "DIR/r1.mcap", "DIR/r2.mcap", "--test", "DIR/r3.mcap"];
    shell.run(&[&["diagnose", "--model", "DIR/models/bench.toml"][..], &learn].concat())
}

/// A stop at the depth of the gap, in a device without stiffness, would be the same force: but then the stiffness of the model
/// would be wrong too.
#[test]
fn a_gap_is_no_stop_in_a_device_without_stiffness() {
    let ran = diagnosed("[[fault]]\nid = \"contact-gap\"\ngap_m = 0.001\n");
    assert!(ran.out.contains("explained: contact-gap"), "{}{}", ran.out, ran.err);
}

/// In impacts alone a sensor that reads too much is a stiffer device: both are said, with the experiment that tells.
#[test]
fn a_scale_of_the_sensor_is_told_beside_the_wrong_stiffness() {
    let ran = diagnosed("[[fault]]\nid = \"force-scale\"\nscale_ratio = 1.2\n");
    assert!(ran.out.contains("wrong parameter: stiffness (or force-scale)"), "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("hang a known weight") || ran.out.contains("hang a\n  known weight"), "{}", ran.out);
}
