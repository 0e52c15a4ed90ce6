//! Each fault ends the run as a real cell would, and one that did nothing is an error of the run.

use super::{cell, reference};
use crate::shell::Shell;

fn check(fault: &str, cycles: u64, event: &str, stop: &str) {
    let ran = reference(&cell("bench", &format!("[[fault]]\n{fault}\n")), 0.8);
    assert!(ran.idle().is_empty(), "{fault}: {:?} did nothing", ran.idle());
    assert_eq!(ran.cycles, cycles, "{fault}");
    assert!(event.is_empty() || ran.events.contains_key(event), "{fault}: {:?}", ran.events);
    let stops: Vec<&str> = ran.stops.iter().map(|(_, why)| why.as_str()).collect();
    assert_eq!(stops.len(), usize::from(!stop.is_empty()), "{fault}: {stops:?}");
    assert!(stops.iter().all(|why| why.contains(stop)), "{fault}: {stops:?}");
}

#[test]
fn a_fault_on_the_wire_does_what_it_does_to_a_real_cell() {
    check("id = \"drop\"\non = \"rsi-reply\"\nat = 20\nfor = 150", 121, "controller-late", "RSITimeout");
    check("id = \"drop\"\non = \"rsi-reply\"\nat = 20", 200, "controller-late", "");
    check("id = \"ipoc-step\"\non = \"rsi-reply\"\nstep = 4\nat = 20", 200, "controller-wrong-ipoc", "");
    check("id = \"wrong-type\"\non = \"rsi-reply\"\nat = 20\nfor = 150", 121, "controller-wrong-type", "RSITimeout");
    check("id = \"nan\"\non = \"rsi-reply\"\nat = 20", 21, "controller-bad-reply", "RSIBad");
    check("id = \"decimal-comma\"\non = \"rsi-reply\"\nat = 20", 21, "controller-bad-reply", "RSIBad");
    check("id = \"drop\"\non = \"rsi-frame\"\nat = 20\nfor = 3", 200, "controller-late", "");
    check("id = \"truncate\"\non = \"rsi-frame\"\nbytes = 30\nat = 20", 200, "controller-late", "");
    check("id = \"ipoc-crossing\"\non = \"rsi-frame\"\nwraps = true\nat = 20", 200, "", "");
    check("id = \"drop\"\non = \"ft\"\nat = \"first-contact\"\nfor = 8", 200, "", "");
    check("id = \"status-word\"\non = \"ft\"\nstatus = 2147614720\nat = 20", 200, "", "");
}

#[test]
fn readings_that_are_lost_are_missing_in_the_recording() {
    let whole = reference(&cell("bench", ""), 0.8).session.sensed.unwrap();
    let fault = "[[fault]]\nid = \"drop\"\non = \"ft\"\nat = 100\nfor = 7\n";
    let lost = reference(&cell("bench", fault), 0.8).session.sensed.unwrap();
    assert_eq!(whole.time_ns.len() - lost.time_ns.len(), 7);
    // Sample 0 is taken at 1 ms.
    assert!(lost.time_ns.contains(&100_000_000) && !lost.time_ns.contains(&101_000_000));
}

#[test]
fn a_fault_that_did_nothing_is_an_error_of_the_run() {
    let shell = Shell::new();
    let run = |fault: &str| {
        shell.write("cell.toml", &format!("{}\n[[fault]]\n{fault}\n", cell("bench", "").source.text));
        for file in fixtures::CELL_FILES.iter().filter(|file| file.name.contains('/')) {
            std::fs::create_dir_all(shell.path(file.name).parent().unwrap()).unwrap();
            shell.write(file.name, file.text);
        }
        shell.run(&["test", "--controller", "reference", "--cell", "DIR/cell.toml", "--duration", "0.4"])
    };
    let idle = run("id = \"drop\"\non = \"ft\"\nat = 100000");
    assert!(idle.exit == 6 && idle.err.contains("drop on ft did nothing"), "{} {}", idle.exit, idle.err);
    let idle = run("id = \"command-loss\"\nprobability_in = 0.0\nprobability_out = 0.5");
    assert!(idle.exit == 6 && idle.err.contains("command-loss did nothing"), "{} {}", idle.exit, idle.err);
    assert_eq!(run("id = \"command-delay\"\ndelay_s = 0.004").exit, 0);
    // Nobody feels a delay of commands that rest, or a spring that nobody touches.
    for effect in ["command-delay\"\ndelay_s = 0.004", "stiffness-hardening\"\ncubic_n_per_m3 = 1e6"] {
        run(&format!("id = \"{effect}"));
        let resting = ["test", "--controller", "reference", "--task", "rest", "--velocity", "0", "--position", "-0.01"];
        let ran = shell.run(&[&resting[..], &["--cell", "DIR/cell.toml", "--duration", "0.4"]].concat());
        assert!(ran.exit == 6 && ran.err.contains("did nothing"), "{effect}: {} {}", ran.exit, ran.err);
    }
    assert_eq!(run("id = \"drop\"\non = \"rsi-reply\"\nat = 1\nfor = 150").exit, 0, "0.4 s end before the robot stops");
    assert_eq!(run("id = \"nan\"\non = \"rsi-reply\"\nat = 1").exit, 1);
    for wrong in
        ["id = \"no-such-fault\"", "id = \"drop\"\non = \"nowhere\"\nat = 1", "id = \"command-delay\"\ndelay_s = 99"]
    {
        let ran = run(wrong);
        assert!(ran.exit == 2 && ran.err.contains("cell.toml: line 3"), "{wrong}: {} {}", ran.exit, ran.err);
    }
}
