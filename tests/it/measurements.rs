//! Two measurements against each other: equal ones, one with more damping, a table without velocities, and the command.

use crate::shell::{Shell, impact};
use harness::compare::{CompareVerdict, Difference, Limit, Measurements, Verdict, compare_measurements, exit_code_of};
use harness::model::{Chosen, Model, Repeatability, from_session};
use harness::recording::{ReadOptions, Session, read, write_mcap};
use harness::simulate::{Run, Task, cell};
use sim_core::effects::standard;

const RESTITUTION: &str = "restitution";

/// The cell of a recording, in which every run repeats every other.
fn model() -> Model {
    let session = read(&fixtures::session("cell-a", "learn_01.mcap"), &ReadOptions::default()).unwrap();
    let repeatability =
        Repeatability { stiffness_ratio: 0.0, damping_ratio: 0.0, force_offset_n: 0.0, approach_speed_ratio: 0.0 };
    Model { repeatability, ..from_session(&session).unwrap() }
}

fn measured(model: &Model, name: &'static str, speed_m_per_s: f64, distance_m: f64, effects: &[Chosen]) -> Session {
    let task = Task::Impact { speed_m_per_s, mass_ratio: 1.0, distance_m };
    cell(model, effects, &[Run { name, task }], 5).remove(0)
}

fn against(reference: &Session, session: &Session, limits: &[&str]) -> Measurements {
    let limits: Vec<Limit> = limits.iter().map(|limit| Limit::parse(limit).unwrap()).collect();
    compare_measurements(reference, std::slice::from_ref(session), &limits).unwrap()
}

fn quantity<'a>(answer: &'a Measurements, name: &str) -> &'a Difference {
    answer.runs[0].quantities.iter().find(|quantity| quantity.name == name).unwrap()
}

fn finds(answer: &Measurements, text: &str) -> bool {
    answer.findings.iter().any(|finding| finding.contains(text))
}

#[test]
fn what_repeats_agrees_and_the_offset_in_time_is_stated() {
    let model = model();
    let reference = measured(&model, "reference", 0.03, 0.006, &[]);
    let again = measured(&model, "again", 0.03, 0.009, &[]);
    let answer = against(&reference, &again, &[]);
    assert_eq!(answer.verdict, CompareVerdict::InsideNoise, "{:#?}", answer.runs[0].quantities);
    let alignment = answer.runs[0].alignment;
    // 3 mm more at 30 mm/s are 0.1 s; either onset is known to what the noise over the slope of the force allows.
    let duration = quantity(&answer, "contact_time_s");
    let known_to = duration.uncertainty.unwrap();
    assert!((alignment.time_shift_s - 0.1).abs() < known_to, "{alignment:?} ±{known_to}");
    assert!(
        finds(&answer, "aligned at first contact, +0.") && finds(&answer, "velocity offset"),
        "{:?}",
        answer.findings
    );
    assert!(alignment.velocity_offset_m_per_s.abs() < 1e-12, "{alignment:?}");
}

#[test]
fn more_damping_is_outside_and_limits_decide() {
    let model = model();
    let reference = measured(&model, "reference", 0.03, 0.008, &[]);
    let mut damped = model.clone();
    damped.contact.damping_n_s_per_m += 40.0;
    let other = measured(&damped, "damped", 0.03, 0.008, &[]);
    let answer = against(&reference, &other, &[]);
    assert_eq!((answer.verdict, exit_code_of(answer.verdict)), (CompareVerdict::Outside, 1));
    for name in [RESTITUTION, "restitution_zero_depth", "observed_energy_j"] {
        assert_eq!(quantity(&answer, name).verdict, Verdict::Outside, "{:?}", quantity(&answer, name));
    }
    assert!(quantity(&answer, RESTITUTION).difference.unwrap() < 0.0, "damping takes restitution");
    assert!(quantity(&answer, "observed_energy_j").difference.unwrap() > 0.0, "and absorbs energy");
    let difference = quantity(&answer, RESTITUTION).difference.unwrap().abs();
    let uncertainty = quantity(&answer, RESTITUTION).uncertainty.unwrap();
    for (limit, verdict) in [
        (difference + 1.1 * uncertainty, CompareVerdict::Pass),
        (difference, CompareVerdict::Undecided),
        (difference - 1.1 * uncertainty, CompareVerdict::Fail),
    ] {
        let answer = against(&reference, &other, &[&format!("restitution={limit}")]);
        assert_eq!(answer.verdict, verdict, "{:?}", answer.limits);
    }
    let refused = compare_measurements(&reference, &[other], &[Limit::parse("force_z_n=1").unwrap()]).unwrap_err();
    assert!(refused.what.contains("no quantity `force_z_n` of two measurements"), "{refused}");
}

#[test]
fn an_effect_of_the_catalogue_is_seen_between_two_measurements() {
    let model = model();
    let reference = measured(&model, "reference", 0.03, 0.008, &[]);
    let catalogue = standard();
    let delay = Chosen { values: vec![0.008], ..Chosen::at_start(catalogue.get("command-delay").unwrap()) };
    let answer = against(&reference, &measured(&model, "late", 0.03, 0.008, &[delay]), &[]);
    // Eight more milliseconds create energy: reference/PHYSICS.md, section 8, no. 1.
    let restitution = quantity(&answer, RESTITUTION);
    assert!(restitution.verdict == Verdict::Outside && restitution.difference.unwrap() > 0.0, "{restitution:?}");
}

#[test]
fn a_faster_approach_is_a_finding_and_its_effect_is_told() {
    let model = model();
    let reference = measured(&model, "reference", 0.030, 0.008, &[]);
    let answer = against(&reference, &measured(&model, "faster", 0.033, 0.008, &[]), &[]);
    let offset = answer.runs[0].alignment.velocity_offset_m_per_s;
    assert!((offset - 0.003).abs() < 1e-9, "{offset}");
    // A tenth more speed: a tenth more force, a fifth more energy.
    assert!(finds(&answer, "+3.000 mm/s") && finds(&answer, "+10.0 %") && finds(&answer, "+21.0 %"), "{answer:?}");
    assert_eq!(quantity(&answer, "peak_force_n").verdict, Verdict::Outside);
}

#[test]
fn a_table_without_velocities_and_mass_is_compared_as_far_as_it_goes() {
    let model = model();
    let reference = measured(&model, "reference", 0.03, 0.008, &[]);
    let mut table = measured(&model, "table", 0.03, 0.008, &[]);
    (table.twist, table.commanded) = (None, None);
    for key in ["reduced_mass_kg", "ft_force_sigma_n", "ft_force_slow_sigma_n", "position_sigma_m"] {
        table.believed.remove(key).unwrap();
    }
    let answer = against(&reference, &table, &[]);
    assert_eq!(
        (answer.verdict, exit_code_of(answer.verdict)),
        (CompareVerdict::CannotSay, 3),
        "{:#?}",
        answer.runs[0].quantities
    );
    assert!(finds(&answer, "not both records say reduced_mass_kg"), "{:?}", answer.findings);
    let restitution = quantity(&answer, "restitution_zero_depth");
    assert!(restitution.verdict == Verdict::InsideNoise && restitution.uncertainty.unwrap() > 0.0, "{restitution:?}");
    // The cell's virtual damper pulls before d = 0. A table does not tell when: the same name would be two quantities.
    let restitution = quantity(&answer, RESTITUTION);
    assert!(
        restitution.verdict == Verdict::CannotSay && restitution.about.contains("taken otherwise"),
        "{restitution:?}"
    );
    assert_eq!(quantity(&answer, "observed_energy_j").difference, None);
    assert!(!finds(&answer, "ft_bias"));
    table.believed.remove("ft_bias").unwrap();
    assert!(finds(&against(&reference, &table, &[]), "table.simulated: the record says no ft_bias"));
    table.sensed = None;
    let error = compare_measurements(&reference, &[table], &[]).unwrap_err();
    assert!(error.help.is_some() && error.file.is_some(), "{error}");
}

#[test]
fn the_command_compares_two_recordings() {
    let shell = Shell::with_model();
    let other = fixtures::session("cell-a", "learn_04.mcap").display().to_string();
    let reference = fixtures::session("cell-a", "learn_02.mcap").display().to_string();
    let ran =
        shell.run(&["compare", "--reference", &reference, &other, "--json", "DIR/a.json", "--report", "DIR/a.html"]);
    let json: serde_json::Value = serde_json::from_str(&shell.read("a.json")).unwrap();
    let verdict = json["verdict"].as_str().unwrap();
    let exit = match verdict {
        "inside-noise" => 0,
        "outside" => 1,
        other => panic!("{other}"),
    };
    assert_eq!(ran.exit, exit, "{}{}", ran.out, ran.err);
    // Words of a text wrap anywhere.
    let out = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(out.contains("velocity offset") && out.contains("learn_02.mcap"), "{}", ran.out);
    assert_eq!(json["runs"][0]["quantities"].as_array().unwrap().len(), 7);
    let page = shell.read("a.html");
    for text in ["position beyond first contact", "aligned at first contact", "learn_04.mcap and learn_02.mcap"] {
        assert!(page.contains(text), "{text}");
    }
    let limited = shell.run(&["compare", "--reference", &reference, &other, "--limit", "restitution=0.5"]);
    assert_eq!(limited.exit, 0, "{}{}", limited.out, limited.err);
    let same = shell.run(&["compare", "--reference", &other, &other]);
    assert!(same.exit == 2 && same.err.contains("would count twice"), "{}", same.err);
    let both = shell.run(&["compare", "--reference", &other, "--model", "DIR/m.toml", &impact()]);
    assert!(both.exit == 2 && both.err.contains("cannot be used with"), "{}", both.err);
    let alone = shell.run(&["compare", "--model", "DIR/m.toml", "--reference-map", "x.toml", &impact()]);
    assert!(alone.exit == 2 && alone.err.contains("'--reference-map"), "{}", alone.err);
}

#[test]
fn a_measurement_that_was_written_and_read_again_agrees_with_itself() {
    let shell = Shell::new();
    let session = measured(&model(), "reference", 0.03, 0.008, &[]);
    let path = shell.path("again.mcap");
    write_mcap(&session, std::fs::File::create(&path).unwrap()).unwrap();
    let again = read(&path, &ReadOptions::default()).unwrap();
    let answer = against(&session, &again, &[]);
    // Every number of a recording survives its file: forces and positions are doubles.
    for quantity in &answer.runs[0].quantities {
        assert!(quantity.difference.unwrap().abs() < 1e-12, "{quantity:?}");
    }
    assert!(answer.runs[0].alignment.time_shift_s.abs() < 1e-9, "stamps are whole nanoseconds");
}
