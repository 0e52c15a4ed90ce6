//! Every effect of the catalogue, hidden in the virtual cell, is named from its recordings, with the four digits that a real wire has.
//!
//! The cell and the model share code: this shows that nothing between cell, wire, recording and diagnosis gets in the way. That an
//! effect is found where truth comes from elsewhere is shown on the recordings of the hidden effects.

use super::cell;
use super::diagnosed::folder;
use rayon::prelude::*;
use sim_core::effect::Where;
use sim_core::effects::standard;

/// An effect, its size, and what is said at the end.
const HIDDEN: [(&str, &str, &str); 23] = [
    ("", "", "nothing missing"),
    ("clock-offset", "offset_s = 0.004", "explained: clock-offset"),
    ("command-delay", "delay_s = 0.006", "explained: command-delay"),
    ("command-jitter", "sigma_s = 0.0015", "explained: command-jitter"),
    ("command-loss", "probability_in = 0.02\nprobability_out = 0.5", "explained: command-loss"),
    ("contact-gap", "gap_m = 0.001", "explained: contact-gap (or end-stop)"),
    ("contact-preload", "force_n = 3", "explained: contact-preload"),
    ("coulomb-friction", "force_n = 1.5", "explained: coulomb-friction"),
    ("end-stop", "depth_m = 0.006\nstiffness_n_per_m = 5000", "explained: end-stop"),
    ("force-bias", "force_n = 1.5", "explained: force-bias"),
    ("force-bias-drift", "rate_n_per_s = 0.5", "explained: force-bias-drift"),
    ("force-delay", "delay_s = 0.006", "explained: force-delay"),
    ("force-lag", "corner_frequency_hz = 20\norder = 1", "explained: force-lag"),
    ("force-scale", "scale_ratio = 1.2", "explained: force-scale"),
    ("hunt-crossley", "damping_n_s_per_m2 = 15000", "explained: hunt-crossley"),
    ("hysteresis", "force_n = 2\nlength_m = 0.001", "explained: hysteresis"),
    ("maxwell-branch", "stiffness_n_per_m = 500\nrelaxation_time_s = 0.05", "explained: maxwell-branch"),
    ("measurement-delay", "delay_s = 0.008", "explained: measurement-delay"),
    ("robot-second-order", "natural_frequency_hz = 12\ndamping_ratio = 0.6", "explained: robot-second-order"),
    ("stiffness-hardening", "cubic_n_per_m3 = 9e6", "explained: stiffness-hardening"),
    ("stiffness-power-law", "exponent = 1.2", "explained: stiffness-power-law"),
    ("tool-inertia", "mass_kg = 2", "explained: tool-inertia"),
    ("tool-weight", "mass_kg = -2", "explained: tool-weight"),
];

/// The last line of a diagnosis of a whole campaign: impacts at four speeds, rest, excitation, and two impacts for testing.
fn last_line(id: &str, size: &str, seed: u32) -> String {
    let coarse = cell("bench", "").source.text.replace("decimals = 9", "decimals = 4");
    let shell = folder(&coarse);
    let fault = if id.is_empty() { String::new() } else { format!("\n[[fault]]\nid = \"{id}\"\n{size}\n") };
    shell.write("hidden.toml", &format!("{coarse}{fault}"));
    let record = |name: &str, nth: u32, more: &[&str]| {
        let (output, seed) = (format!("DIR/{name}.mcap"), (100 * seed + nth).to_string());
        let run = |cell: &str| {
            let fixed =
                ["test", "--controller", "reference", "--cell", cell, "-o", &output, "--force", "--seed", &seed];
            shell.run(&[&fixed, more].concat())
        };
        let ran = run("DIR/hidden.toml");
        // What is at rest or touches nothing does not show every effect: then the effect is one that did nothing.
        let ran = if ran.exit == 6 { run("DIR/cell.toml") } else { ran };
        assert_eq!(ran.exit, 0, "{id}, {name}: {}{}", ran.out, ran.err);
    };
    for (nth, speed) in ["0.014", "0.026", "0.042", "0.026", "0.036", "0.02"].iter().enumerate() {
        record(&format!("impact_{nth}"), nth as u32, &["--velocity", speed]);
    }
    let far = ["--velocity", "0", "--position=-0.15", "--duration", "4"];
    record("static", 20, &[&far[..], &["--task", "rest"]].concat());
    record("excite", 21, &[&far[..], &["--task", "excite"]].concat());
    let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|nth| format!("DIR/impact_{nth}.mcap"));
    let learn = ["diagnose", "--model", "DIR/models/bench.toml", "--learn", &a, &b, &c, &d];
    let ran = shell.run(&[&learn[..], &["--aux", "DIR/static.mcap", "DIR/excite.mcap", "--test", &e, &f]].concat());
    ran.out.trim_end().lines().last().unwrap_or(&ran.err).to_owned()
}

#[test]
fn each_effect_of_the_catalogue_is_named_on_a_wire_with_four_digits() {
    let listed: Vec<&str> = HIDDEN.iter().map(|(id, ..)| *id).filter(|id| !id.is_empty()).collect();
    let catalog = standard();
    let docking = catalog.kinds().iter().filter(|kind| !matches!(kind.rigs, Where::Drive));
    assert_eq!(docking.map(|kind| kind.id.to_string()).collect::<Vec<_>>(), listed);
    let said: Vec<String> = HIDDEN.par_iter().map(|(id, size, _)| last_line(id, size, 1)).collect();
    let wrong: Vec<String> = HIDDEN
        .iter()
        .zip(&said)
        .filter(|((_, _, wanted), said)| said.split_once(' ').is_none_or(|(_, words)| !words.starts_with(wanted)))
        .map(|((id, _, wanted), said)| format!("{id}: {said:?}, not {wanted:?}"))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Clean recordings whose noise happens to be high in one phase, a packet that is lost where another was drawn, a delay that looks like
/// a lost answer: seeds at which something else was said once.
#[test]
fn noise_is_nothing_and_chance_is_not_counted_twice() {
    for (id, size, seed, wanted) in [
        ("", "", 2, "nothing missing"),
        ("", "", 25, "nothing missing"),
        (HIDDEN[4].0, HIDDEN[4].1, 3, "explained: command-loss"),
        (HIDDEN[4].0, HIDDEN[4].1, 4, "explained: command-loss"),
        (HIDDEN[2].0, HIDDEN[2].1, 2, "explained: command-delay"),
        ("clock-offset", "offset_s = 0.02", 2, "explained: clock-offset"),
        ("force-scale", "scale_ratio = 0.9", 2, "explained: force-scale"),
        ("force-bias", "force_n = -1.5", 2, "explained: force-bias"),
    ] {
        let said = last_line(id, size, seed);
        assert!(said.starts_with(&format!("✓ {wanted}")), "{id}, seed {seed}: {said}");
    }
}

/// A slow robot behind a slow link, losses behind a slow link: each imitates the other, and both are named.
#[test]
fn two_that_imitate_each_other_are_both_named() {
    for (other, values) in [
        ("robot-second-order", "natural_frequency_hz = 15\ndamping_ratio = 0.8"),
        ("command-loss", "probability_in = 0.02\nprobability_out = 0.5"),
    ] {
        let both = format!("delay_s = 0.006\n\n[[fault]]\nid = \"{other}\"\n{values}");
        let said = last_line("command-delay", &both, 2);
        assert!(said.starts_with("✓ explained: ") && said.matches(" + ").count() == 1, "{said}");
        assert!(said.contains("command-delay") && said.contains(other), "{said}");
    }
}
