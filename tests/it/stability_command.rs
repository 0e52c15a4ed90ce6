//! `dockhil stability`: an operator's questions, as a shell would ask them.

use super::shell::Shell;
use serde_json::Value;
use sim_core::stability::exact::{critical_delay, damping_interval};

fn json(shell: &Shell, args: &[&str]) -> (u8, Value) {
    let args: Vec<&str> = ["stability"].iter().chain(args).chain(&["--json", "-"]).copied().collect();
    let ran = shell.run(&args);
    let value = serde_json::from_str(&ran.out).unwrap_or_else(|error| panic!("{args:?}: {error}: {}", ran.err));
    (ran.exit, value)
}

const NUMBERS: [&str; 6] = ["--mass-kg", "60", "--stiffness-n-per-m", "1000", "--damping-n-s-per-m", "50"];

#[test]
fn three_numbers_give_the_critical_dead_time() {
    let (exit, value) = json(&Shell::new(), &NUMBERS);
    // reference/PHYSICS.md, section 1.5: 49.309 ms, five digits.
    assert!((value["critical_delay_s"].as_f64().unwrap() - 0.049_309).abs() < 5e-7, "{value:#}");
    assert_eq!((exit, &value["stable"]), (0, &Value::Null), "no delay was given, so nothing is unstable");
}

#[test]
fn a_delay_decides_the_exit_code() {
    let shell = Shell::new();
    for (delay, exit, stable) in [("0.049", 0, true), ("0.0496", 1, false)] {
        let args: Vec<&str> = NUMBERS.iter().copied().chain(["--delay-s", delay]).collect();
        let (found, value) = json(&shell, &args);
        assert_eq!((found, value["stable"].as_bool()), (exit, Some(stable)), "{delay}: {value:#}");
        let growth = value["growth_per_s"].as_f64().unwrap();
        assert_eq!(growth < 0.0, stable, "the rightmost root agrees with the closed form: {growth}");
    }
}

#[test]
fn a_cell_is_judged_as_its_computers_run_it() {
    let shell = Shell::with_model();
    let (exit, value) = json(&shell, &["DIR/m.toml"]);
    assert_eq!((exit, value["stable"].as_bool()), (0, Some(true)), "{value:#}");
    // Correction 4: 19.38 N s/m with the stiffness in hardware and the command before the step. 6 of it are real here, and real
    // damping is not read back late, which is worth the difference of second order.
    let edge = value["sampled"]["virtual_damping"]["low_n_s_per_m"].as_f64().unwrap() + 6.0;
    assert!((edge - 19.38).abs() < 0.1, "{edge}");
    let budget: f64 =
        value["budget"].as_array().unwrap().iter().map(|line| line["contribution_s"].as_f64().unwrap()).sum();
    assert!((budget - value["delay_s"].as_f64().unwrap()).abs() < 1e-15, "the lines add up");
    // The edge of the margin is an edge: a little before it the loop decays, a little behind it grows.
    let margin = value["delay_margin"]["distance"].as_f64().unwrap();
    for (share, stable) in [(0.999, true), (1.001, false)] {
        let delay = format!("command-delay:delay_s={}", margin * share);
        assert_eq!(shell.run(&["effect", "add", &delay, "--model", "DIR/m.toml"]).exit, 0);
        let (_, moved) = json(&shell, &["DIR/m.toml"]);
        assert_eq!(moved["stable"].as_bool(), Some(stable), "{delay}: {moved:#}");
    }
}

#[test]
fn a_tool_as_heavy_as_the_satellites_is_unstable_whatever_the_damping() {
    let shell = Shell::with_model();
    assert_eq!(shell.run(&["effect", "add", "tool-inertia:mass_kg=64", "--model", "DIR/m.toml"]).exit, 0);
    let ran = shell.run(&["stability", "DIR/m.toml"]);
    assert_eq!(ran.exit, 1, "{}", ran.err);
    assert!(ran.out.contains("unstable in free flight"), "{}", ran.out);
    for helpless in ["To make it stable", "closed form it may be", "restitution"] {
        assert!(!ran.out.contains(helpless), "no damping and no contact helps: {}", ran.out);
    }
}

/// What is merely unstable is answered: too much damping, a stiff contact that the delay outlasts, no damping at all.
#[test]
fn an_unstable_loop_is_answered_however_far_it_is_from_the_edge() {
    let shell = Shell::new();
    for (stiffness, damping, delay) in [("1000", "5000", "0.06"), ("1000", "8000", "0.032"), ("1e6", "500", "0.032")] {
        let args = ["--mass-kg", "60", "--stiffness-n-per-m", stiffness, "--damping-n-s-per-m", damping];
        let (exit, value) = json(&shell, &[&args[..], &["--delay-s", delay]].concat());
        assert_eq!((exit, value["stable"].as_bool()), (1, Some(false)), "{value:#}");
        assert!(value["one_sided"].is_null(), "longer than the contact: {value:#}");
        assert!(value["growth_per_s"].as_f64().is_none_or(|growth| growth > 0.0), "{value:#}");
    }
    let bare = shell.run(&["stability", "--mass-kg", "60", "--stiffness-n-per-m", "1000", "--damping-n-s-per-m", "0"]);
    assert_eq!(bare.exit, 1, "{}", bare.err);
    assert!(bare.out.contains("without positive damping") && !bare.out.contains("tool"), "{}", bare.out);
}

/// A model may push apart, too, along one axis and in six.
#[test]
fn a_model_with_a_negative_stiffness_is_answered() {
    let shell = Shell::with_model();
    let text = shell.read("m.toml");
    let at = text.find("stiffness_n_per_m = ").unwrap();
    let end = at + text[at..].find('\n').unwrap();
    shell.write("n.toml", &format!("{}stiffness_n_per_m = -500.0{}", &text[..at], &text[end..]));
    let ran = shell.run(&["stability", "DIR/n.toml"]);
    assert_eq!(ran.exit, 1, "{}", ran.err);
    assert!(ran.out.contains("The stiffness is negative"), "{}", ran.out);
    let model = fixtures::folder().join("scenarios/models/planar-bodies.toml");
    let text = std::fs::read_to_string(model).unwrap();
    let stiffness = |value: &str| {
        let mut table: toml::Table = text.parse().unwrap();
        table["contact"]["stiffness_n_per_m"] = toml::Value::Float(value.parse().unwrap());
        shell.write("space.toml", &toml::to_string(&table).unwrap());
        shell.run(&["stability", "DIR/space.toml"])
    };
    for value in ["-500", "1e9"] {
        let ran = stiffness(value);
        assert_eq!(ran.exit, 1, "{value}: {} {}", ran.out, ran.err);
        assert!(ran.out.contains("unstable"), "{value}: {}", ran.out);
    }
}

#[test]
fn a_negative_stiffness_is_answered_and_not_refused() {
    let shell = Shell::new();
    let args = ["--mass-kg", "60", "--stiffness-n-per-m", "-159", "--damping-n-s-per-m", "50", "--delay-s", "0.016"];
    let (exit, value) = json(&shell, &args);
    assert_eq!((exit, value["stable"].as_bool()), (1, Some(false)), "{value:#}");
    // Slow motion: m s² + b s + k = 0 has the positive root (-b + √(b² - 4 m k)) / 2m; a delay of 16 ms hardly moves it.
    let root = (-50.0 + libm::sqrt(2500.0 + 4.0 * 60.0 * 159.0)) / 120.0;
    assert!((value["growth_per_s"].as_f64().unwrap() / root - 1.0).abs() < 0.05, "{value:#} {root}");
    assert!(shell.run(&[&["stability"][..], &args].concat()).out.contains("The stiffness is negative"));
}

#[test]
fn a_cell_with_six_axes_is_told_by_its_roots() {
    let model = |name: &str| fixtures::folder().join("scenarios/models").join(name).display().to_string();
    let shell = Shell::new();
    let (exit, planar) = json(&shell, &[&model("planar-bodies.toml")]);
    assert_eq!((exit, planar["stable"].as_bool()), (0, Some(true)), "{planar:#}");
    // reference/PHYSICS.md, section 3.1: 15.6 kg with its lever arms, three digits. By the closed form of one delay the margin is
    // what the critical dead time leaves of 16 ms and half a tick of 4 ms.
    let mass = planar["reduced_mass_kg"].as_f64().unwrap();
    assert!((mass - 15.6).abs() < 0.05, "{mass}");
    let text = std::fs::read_to_string(model("planar-bodies.toml")).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let contact = |key: &str| table["contact"][key].as_float().unwrap();
    let edge = critical_delay(mass, contact("stiffness_n_per_m"), contact("damping_n_s_per_m")).unwrap();
    let margin = planar["delay_margin"]["distance"].as_f64().unwrap();
    // The search halves down to 10 µs.
    assert!((margin - (edge.delay_s - 0.018)).abs() < 2e-5, "{margin} {edge:?}");
    // Against the wall of a cone the lever arms make the contact light: less margin than along the axis.
    let (_, wall) = json(&shell, &[&model("olev.toml")]);
    assert!(wall["reduced_mass_kg"].as_f64().unwrap() < 20.0 && wall["free_directions"] == 5, "{wall:#}");
    let (_, damped) = json(&shell, &[&model("olev-damped.toml")]);
    assert_eq!(damped["free_directions"], 3, "two axes more are damped: {damped:#}");
    let wrong = shell.run(&["stability", &model("olev.toml"), "--chart", "a,b", "--report", "DIR/r.html"]);
    assert!(wrong.exit == 2 && wrong.err.contains("unknown parameter a"), "{}", wrong.err);
    // Left of the margin it is stable, right of it it is not.
    let edge_s = 0.016 + margin;
    let chart = format!("timing.command_delay_s={}..{},contact.damping_n_s_per_m=69..71", edge_s - 1e-3, edge_s + 1e-3);
    let swept = shell.run(&["stability", &model("planar-bodies.toml"), "--chart", &chart, "--sweep", "-"]);
    assert_eq!(swept.exit, 0, "{}", swept.err);
    let at_70 = |row: &&str| row.split(',').nth(1) == Some("70");
    let stable: Vec<&str> = swept.out.lines().filter(at_70).map(|row| row.rsplit(',').next().unwrap()).collect();
    assert_eq!((stable.len(), stable.first(), stable.last()), (41, Some(&"1"), Some(&"0")), "{}", swept.out);
    // The middle is the edge to 10 µs, of steps of 50 µs: it may fall on either side.
    let count = stable.iter().filter(|told| **told == "1").count();
    assert!(count == 20 || count == 21, "{stable:?}");
}

#[test]
fn a_cell_with_six_axes_has_a_budget_and_margins_of_damping() {
    let shell = Shell::new();
    let text = std::fs::read_to_string(fixtures::folder().join("scenarios/models/planar-bodies.toml")).unwrap();
    assert_eq!(text.matches("damping_n_s_per_m = 70.0").count(), 1, "{text}");
    let told = |damping: f64| {
        shell.write("m.toml", &text.replace("damping_n_s_per_m = 70.0", &format!("damping_n_s_per_m = {damping:?}")));
        let (_, value) = json(&shell, &["DIR/m.toml"]);
        (value, shell.run(&["stability", "DIR/m.toml"]).out)
    };
    let distance = |value: &Value, side: &str| value[side]["distance"].as_f64().unwrap();
    // Along its normal the planar case is one delay: the closed form tells both edges. The search halves a step 2^10 times.
    let (value, _) = told(70.0);
    let (mass, delay_s) = (value["reduced_mass_kg"].as_f64().unwrap(), value["delay_s"].as_f64().unwrap());
    assert!((delay_s - 0.018).abs() < 1e-12, "{value:#}");
    let edges = damping_interval(mass, 3000.0, delay_s).unwrap().unwrap();
    let (low, high) = (distance(&value, "damping_margin_low"), distance(&value, "damping_margin_high"));
    assert!((70.0 - low - edges.low_n_s_per_m).abs() < 0.02, "{low} {edges:?}");
    assert!((70.0 + high - edges.high_n_s_per_m).abs() < 0.2, "{high} {edges:?}");
    let lines = value["budget"].as_array().unwrap();
    let sum = |key: &str| lines.iter().map(|line| line[key].as_f64().unwrap()).sum::<f64>();
    assert!((sum("contribution_s") - delay_s).abs() < 1e-12);
    assert!((sum("damping_n_s_per_m") - edges.low_n_s_per_m).abs() < 1e-9, "{value:#}");
    let (few, words) = told(20.0);
    assert!((distance(&few, "damping_margin_low") - (20.0 - edges.low_n_s_per_m)).abs() < 0.05, "{few:#}");
    assert!(
        words.contains("of damping along the normal are missing") && words.contains("To make it stable"),
        "{words}"
    );
    let (many, words) = told(2000.0);
    assert!((distance(&many, "damping_margin_high") - (edges.high_n_s_per_m - 2000.0)).abs() < 0.3, "{many:#}");
    assert!(words.contains("of damping along the normal are too much"), "{words}");
}

#[test]
fn a_chart_is_drawn_and_swept() {
    let shell = Shell::with_model();
    let chart = "timing.command_delay_s=0.004..0.04,virtual_contact.damping_n_s_per_m";
    let args = ["stability", "DIR/m.toml", "--chart", chart, "--sweep", "DIR/s.csv", "--report", "DIR/r.html"];
    let ran = shell.run(&args);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    let page = shell.read("r.html");
    assert!(page.contains("Where it is stable") && page.contains(r#"class="point""#), "the operating point is drawn");
    let sweep = shell.read("s.csv");
    assert!(sweep.starts_with("timing.command_delay_s,virtual_contact.damping_n_s_per_m,growth_per_s,stable\n"));
    for line in sweep.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(cells[2] < 0.0, cells[3] > 0.5, "{line}");
    }
}

#[test]
fn what_cannot_be_told_is_not_called_unstable() {
    let shell = Shell::with_model();
    // A command delay below one period of the loop is no loop that can run.
    let chart = "timing.command_delay_s=0.0..0.04,virtual_contact.damping_n_s_per_m";
    let ran = shell.run(&["stability", "DIR/m.toml", "--chart", chart, "--sweep", "-", "--report", "DIR/r.html"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    assert!(ran.out.lines().nth(1).unwrap().ends_with(",,"), "{}", ran.out);
    assert!(shell.read("r.html").contains("cannot be told"));
}

#[test]
fn the_edges_are_answered() {
    let shell = Shell::new();
    let ask = |damping: &str, delay: Option<&str>| {
        let mut args =
            vec!["stability", "--mass-kg", "60", "--stiffness-n-per-m", "1000", "--damping-n-s-per-m", damping];
        args.extend(delay.into_iter().flat_map(|delay| ["--delay-s", delay]));
        let ran = shell.run(&args);
        (ran.exit, ran.out + &ran.err)
    };
    for (damping, delay, exit, says) in [
        ("-5", None, 1, "unstable at any dead time"),
        ("0", None, 1, "unstable at any dead time"),
        ("0", Some("0"), 1, "neither grows nor decays"),
        ("-5", Some("0.016"), 1, "unstable"),
        ("6000", Some("0.016"), 1, "too much"),
    ] {
        let (found, out) = ask(damping, delay);
        assert!(
            found == exit && out.contains(says) && !out.contains("not finite"),
            "{damping} {delay:?}: {found} {out}"
        );
    }
}

#[test]
fn questions_without_meaning_are_refused() {
    let shell = Shell::with_model();
    for (args, says) in [
        (
            &["stability", "--mass-kg", "0", "--stiffness-n-per-m", "1", "--damping-n-s-per-m", "1"][..],
            "is not above 0",
        ),
        (
            &["stability", "--mass-kg", "nan", "--stiffness-n-per-m", "1", "--damping-n-s-per-m", "1"],
            "not a finite number",
        ),
        (&["stability", "--mass-kg", "1"], "--stiffness-n-per-m"),
        (&["stability"], "MODEL.toml"),
        (
            &["stability", "--mass-kg", "1e-300", "--stiffness-n-per-m", "1e300", "--damping-n-s-per-m", "1"],
            "of one order",
        ),
        (
            &["stability", "DIR/m.toml", "--chart", "plant.mass_kg=-10..10,timing.command_delay_s", "--sweep", "-"],
            "below 0, where it has no meaning",
        ),
        (&["stability", "DIR/none.toml"], "cannot read the model"),
        (&["stability", "DIR/m.toml", "--chart", "a,b", "--report", "DIR/r.html"], "unknown parameter a"),
        (&["stability", "DIR/m.toml", "--chart", "plant.mass_kg,timing.command_delay_s"], "needs a page"),
        (&["stability", "DIR/m.toml", "--json", "DIR/m.toml"], "would be overwritten"),
    ] {
        let ran = shell.run(args);
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{args:?}");
        assert!(ran.err.contains(says), "{args:?}: {}", ran.err);
    }
    assert!(!shell.names().iter().any(|name| name == "r.html"), "nothing is left behind");
}

/// A text without its lines.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The nominal model with other lines at its end, or in place of some.
fn changed(shell: &Shell, from: &str, to: &str, more: &str) {
    let text = shell.read("m.toml");
    assert!(text.contains(from), "{from}: {text}");
    shell.write("n.toml", &(text.replacen(from, to, 1) + more));
}

#[test]
fn a_virtual_part_on_the_commanded_pose_is_late_by_the_held_force_alone() {
    let shell = Shell::new();
    let facility = std::fs::read_to_string(fixtures::folder().join("scenarios/models/facility.toml")).unwrap();
    let stiff = "stiffness_n_per_m = 1066.0\npose = \"commanded\"\narchitecture = \"pure-software\"\n";
    shell.write("m.toml", &facility.replace("[virtual_contact]\n", &format!("[virtual_contact]\n{stiff}")));
    let (exit, value) = json(&shell, &["DIR/m.toml"]);
    assert_eq!(exit, 0, "{value:#}");
    // Half a tick of 4 ms, by the exact hold: the sampled edge is k T/2, and one of the lines of the budget is all of it.
    let sampled = value["sampled"]["virtual_damping"]["low_n_s_per_m"].as_f64().unwrap();
    let closed = value["damping_interval"]["low_n_s_per_m"].as_f64().unwrap();
    assert!((value["delay_s"].as_f64().unwrap() - 0.002).abs() < 1e-12, "{value:#}");
    assert!((sampled / 2.132 - 1.0).abs() < 0.01 && (closed / sampled - 1.0).abs() < 0.02, "{sampled} {closed}");
    let worst = value["budget"]
        .as_array()
        .unwrap()
        .iter()
        .max_by(|a, b| a["contribution_s"].as_f64().unwrap().total_cmp(&b["contribution_s"].as_f64().unwrap()));
    assert_eq!(worst.unwrap()["name"], "force held for one tick");
    assert!(value["one_sided"].is_null(), "a virtual part pulls: {value:#}");
}

#[test]
fn what_may_turn_the_answer_round_leaves_it_undecided() {
    let shell = Shell::with_model();
    let (_, plain) = json(&shell, &["DIR/m.toml"]);
    changed(&shell, "", "", "\n[compensation]\nmethod = \"phase-lead\"\ndelay_s = 0.018\n");
    let (exit, value) = json(&shell, &["DIR/n.toml"]);
    assert_eq!((exit, &value["undecided_by"]), (3, &serde_json::json!(["compensation"])), "{value:#}");
    let said = shell.run(&["stability", "DIR/n.toml"]).out;
    assert!(said.contains("undecided; without compensation: stable; margin"), "{said}");
    // Virtual damping is linear, and in the prediction: 10 N s/m of it on the command count like as much damping.
    changed(
        &shell,
        "",
        "",
        "\n[compensation]\nmethod = \"virtual-damping\"\nstiffness_n_per_m = 1000.0\ndelay_s = 0.01\n",
    );
    let (exit, value) = json(&shell, &["DIR/n.toml"]);
    assert_eq!((exit, &value["undecided_by"]), (0, &serde_json::json!([])), "{value:#}");
    let low = |value: &Value| value["sampled"]["virtual_damping"]["low_n_s_per_m"].as_f64().unwrap();
    assert!((low(&plain) - low(&value) - 10.0).abs() < 0.5, "{} {}", low(&plain), low(&value));
    let faulted = shell.run(&["effect", "add", "coulomb-friction:force_n=0.5", "--model", "DIR/m.toml"]);
    assert_eq!(faulted.exit, 0, "{}", faulted.err);
    let ran = shell.run(&["stability", "DIR/m.toml"]);
    assert!(ran.exit == 3 && ran.out.contains("undecided; without coulomb-friction: "), "{}", ran.out);
}

#[test]
fn the_nearer_edge_of_the_damping_is_told() {
    let shell = Shell::new();
    let args = ["--mass-kg", "60", "--stiffness-n-per-m", "1000", "--damping-n-s-per-m", "5883", "--delay-s", "0.016"];
    let (exit, value) = json(&shell, &args);
    let high = damping_interval(60.0, 1000.0, 0.016).unwrap().unwrap().high_n_s_per_m;
    assert_eq!(exit, 0);
    assert!((value["damping_margin_high"]["distance"].as_f64().unwrap() - (high - 5883.0)).abs() < 1e-6);
    let said = words(&shell.run(&[&["stability"][..], &args].concat()).out);
    assert!(said.contains("0.9785 N s/m (0.017 % of the edge) more damping"), "{said}");
    // An impact loses energy between two dampings, and this one is above both.
    let one_sided = &value["one_sided"];
    let edge = |key: &str| one_sided[key].as_f64().unwrap();
    assert!(edge("restitution") > 1.0 && edge("neutral_damping_high_n_s_per_m") < 5883.0, "{one_sided}");
    assert!(edge("neutral_damping_n_s_per_m") < 17.0 && said.contains("it loses energy between"), "{said}");
}

#[test]
fn every_stable_cell_has_a_margin_of_delay_and_of_damping() {
    let shell = Shell::new();
    let model = |name: &str| fixtures::folder().join("scenarios/models").join(name).display().to_string();
    let (_, planar) = json(&shell, &[&model("planar.toml")]);
    // All the damping is in the device: 70 against the 55.2 of the closed form, which is good to some 2 %.
    let edge = 70.0 - planar["damping_margin_low"]["distance"].as_f64().unwrap();
    assert!((edge / planar["damping_interval"]["low_n_s_per_m"].as_f64().unwrap() - 1.0).abs() < 0.02, "{edge}");
    let (_, table) = json(&shell, &[&model("air-bearing.toml")]);
    assert!(table["delay_margin"].is_null(), "{table:#}");
    let searched_ms = 1e3 * table["delay_searched_s"].as_f64().unwrap();
    let said = words(&shell.run(&["stability", &model("air-bearing.toml")]).out);
    assert!(searched_ms > 1.0 && said.contains(&format!("margin more than {searched_ms:.2} ms of delay")), "{said}");
}

/// Motion that is slow against the delay, and stiffness out of proportion: with steps that follow the delay each would take hours.
#[test]
fn what_is_out_of_proportion_is_answered() {
    let shell = Shell::new();
    let text = |name: &str| std::fs::read_to_string(fixtures::folder().join("scenarios/models").join(name)).unwrap();
    shell.write("slow.toml", &text("air-bearing.toml").replace("mass_kg = 63.2", "mass_kg = 1e5"));
    shell.write("stiff.toml", &text("planar-bodies.toml").replace("= 3000.0", "= 1e12"));
    let flags = |mass, stiffness, delay| {
        ["--mass-kg", mass, "--stiffness-n-per-m", stiffness, "--damping-n-s-per-m", "50", "--delay-s", delay]
    };
    let cases: [&[&str]; 5] = [
        &flags("60", "1000", "1e-5"),
        &flags("60", "1000", "1e-9"),
        &flags("1e6", "1", "0.016"),
        &["DIR/slow.toml"],
        &["DIR/stiff.toml"],
    ];
    for args in cases {
        let ran = shell.run(&[&["stability"], args].concat());
        assert!(ran.exit <= 1, "{args:?}: {}", ran.err);
    }
}

#[test]
fn a_damper_without_a_spring_is_answered() {
    let shell = Shell::new();
    let ask = |delay: &str| {
        json(&shell, &["--mass-kg", "60", "--stiffness-n-per-m", "0", "--damping-n-s-per-m", "50", "--delay-s", delay])
    };
    // m s + b e^(-hs): a quarter turn at ω = b/m.
    let edge_s = std::f64::consts::FRAC_PI_2 * 60.0 / 50.0;
    let (exit, value) = ask(&format!("{}", edge_s * 0.99));
    assert_eq!((exit, value["stable"].as_bool()), (0, Some(true)), "{value:#}");
    assert!((value["critical_delay_s"].as_f64().unwrap() - edge_s).abs() < 1e-12);
    assert!(value["growth_per_s"].as_f64().unwrap() < 0.0, "the rightmost root agrees: {value:#}");
    let (exit, value) = ask(&format!("{}", edge_s * 1.01));
    assert!(exit == 1 && value["growth_per_s"].as_f64().unwrap() > 0.0, "{value:#}");
}
