//! Confusion matrix: each effect of the catalogue is hidden in a simulated cell, and looked for.
//!
//! Truth and model share code here. That every fault which can be injected can be diagnosed is all that this shows; whether the
//! physics is right is judged in `hidden.rs`, on recordings that are not ours.
//!
//! The whole matrix takes minutes: `DOCKHIL_FULL=1 cargo test -p dockhil-tests -- --nocapture confusion` prints it.

use harness::diagnose::answer::{Diagnosis, Verdict};
use harness::diagnose::search::Rules;
use harness::diagnose::{Request, diagnose};
use harness::model::{Chosen, Model, from_session};
use harness::recording::{ReadOptions, read};
use harness::simulate::{self, Run, Task};
use sim_core::effects::standard;

/// Most effects that the group may leave open.
const GROUP_MAX: usize = 3;
/// Repeats every run.
const SEED: u64 = 4_104;

/// Hidden one at a time, far above the noise: values in the order of the effect's parameters.
const HIDDEN: [(&str, &[f64]); 6] = [
    ("stiffness-hardening", &[9e6]),
    ("coulomb-friction", &[0.55, 0.001]),
    ("force-lag", &[14.0, 2.0]),
    ("command-delay", &[0.008]),
    ("tool-inertia", &[6.5]),
    ("contact-preload", &[0.8]),
];

/// The others that can be told apart on such a cell, for the whole matrix.
const REST: [(&str, &[f64]); 13] = [
    ("clock-offset", &[0.003]),
    ("command-jitter", &[0.002]),
    ("command-loss", &[0.03, 0.9]),
    ("contact-gap", &[0.0006]),
    ("end-stop", &[0.005, 2e3]),
    ("force-bias", &[0.3]),
    ("force-bias-drift", &[0.18]),
    ("force-delay", &[0.006]),
    ("hunt-crossley", &[4e3]),
    ("hysteresis", &[0.6, 0.0015]),
    ("maxwell-branch", &[500.0, 0.15]),
    ("measurement-delay", &[0.008]),
    ("robot-second-order", &[10.0, 0.5]),
];

/// Shorter than a real session, so that all of them are diagnosed within a minute.
const LEARN: [Run; 4] = [
    short("learn_01", 0.014, 1.0),
    short("learn_02", 0.026, 1.0),
    short("learn_03", 0.042, 1.0),
    short("learn_04", 0.026, 1.6),
];
const AUX: [Run; 2] = [
    Run { name: "static", task: Task::Rest { duration_s: 3.0 } },
    Run { name: "excite", task: Task::Excite { duration_s: 4.0 } },
];
const TEST: [Run; 1] = [short("test_05", 0.034, 1.0)];

const fn short(name: &'static str, speed_m_per_s: f64, mass_ratio: f64) -> Run {
    Run { name, task: Task::Impact { speed_m_per_s, mass_ratio, distance_m: 0.006 } }
}

/// The cell of the set `cell-c`, as its operator describes it; the parts that the catalogue can spoil are ours.
fn cell() -> Model {
    let session = read(&fixtures::session("cell-c", "learn_01.mcap"), &ReadOptions::default()).unwrap();
    from_session(&session).unwrap()
}

fn diagnosed(model: &Model, hidden: &[Chosen]) -> Diagnosis {
    let [learn, aux, test] = [&LEARN[..], &AUX, &TEST].map(|plan| simulate::cell(model, hidden, plan, SEED));
    let catalog = standard();
    let rules = Rules::default();
    let request = Request { model, catalog: &catalog, learn: &learn, aux: &aux, test: &test, rules, progress: &|_| {} };
    diagnose(&request).unwrap_or_else(|error| panic!("{error:?}")).diagnosis
}

fn chosen(id: &str, values: &[f64]) -> Chosen {
    Chosen { kind: standard().get(id).unwrap().clone(), values: values.to_vec() }
}

/// One row of the matrix.
fn row(id: &str, diagnosis: &Diagnosis) -> String {
    let groups: Vec<String> = diagnosis.groups.iter().map(|group| group.effects.join(" = ")).collect();
    format!("{id:<20} → {:<17} {}", diagnosis.verdict.id(), groups.join(" + "))
}

#[test]
fn confusion_of_our_own_simulations_where_truth_and_model_share_code() {
    let model = cell();
    let nothing = diagnosed(&model, &[]);
    println!("{}", row("nothing", &nothing));
    assert!(nothing.groups.is_empty(), "claimed on a cell that lacks nothing (seed {SEED}): {:?}", nothing.groups);
    assert_eq!(nothing.verdict, Verdict::NothingMissing, "{:?}", nothing.sentences);
    let mut wrong = Vec::new();
    for (id, values) in HIDDEN {
        let diagnosis = diagnosed(&model, &[chosen(id, values)]);
        let row = row(id, &diagnosis);
        println!("{row}");
        let right = match diagnosis.groups.as_slice() {
            [group] => group.effects.len() <= GROUP_MAX && group.effects[0] == id,
            _ => false,
        };
        if !right {
            wrong.push(row);
        }
    }
    assert!(wrong.is_empty(), "seed {SEED}:\n{}", wrong.join("\n"));
    if std::env::var_os("DOCKHIL_FULL").is_some() {
        for (id, values) in REST {
            println!("{}", row(id, &diagnosed(&model, &[chosen(id, values)])));
        }
    } else {
        eprintln!("skipped: the other {} rows of the matrix; set DOCKHIL_FULL=1 to print them", REST.len());
    }
}
