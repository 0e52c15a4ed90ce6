//! The same bits again: on one thread and on two, run after run; and one last digit is found at its tick.

use harness::case::Case;
use harness::diagnose::search::Rules;
use harness::diagnose::software::{Difference, closure_m, first_difference, recompute};
use harness::diagnose::{Request, diagnose};
use harness::model::{Chosen, Model, from_session};
use harness::recording::{ReadOptions, Session, from_bytes};
use harness::simulate::{self, Run, Task};
use sim_core::effect::Catalog;
use sim_core::effects::standard;
use sim_core::signals::Wire;
use sim_core::space::Axis;

/// A set of recordings that is inside the program.
fn embedded(name: &str) -> Session {
    let recording = fixtures::DEMO.iter().find(|recording| recording.name == name).unwrap();
    from_bytes(recording.name, recording.bytes, &ReadOptions::default()).unwrap()
}

fn impact() -> (Model, Case) {
    let session = embedded("learn_03.mcap");
    let model = from_session(&session).unwrap();
    let case = Case::of(&session, &model).unwrap();
    (model, case)
}

/// Few candidates: threads are looked at here, not the ranking.
fn few() -> Catalog<Axis> {
    let ids = ["command-delay", "coulomb-friction", "force-lag", "stiffness-hardening"];
    Catalog::of(ids.iter().map(|id| standard().get(id).unwrap().clone()).collect())
}

#[test]
fn a_diagnosis_is_the_same_on_one_thread_and_on_two() {
    let short = |name, speed_m_per_s, mass_ratio| Run {
        name,
        task: Task::Impact { speed_m_per_s, mass_ratio, distance_m: 0.005 },
    };
    let (model, _) = impact();
    let catalog = few();
    let hidden = [Chosen { kind: catalog.get("coulomb-friction").unwrap().clone(), values: vec![0.5, 0.001] }];
    let plan = [short("learn_01", 0.020, 1.0), short("learn_02", 0.035, 1.0), short("learn_03", 0.028, 1.6)];
    let learn = simulate::cell(&model, &hidden, &plan, 11);
    let aux = simulate::cell(&model, &hidden, &[Run { name: "static", task: Task::Rest { duration_s: 2.0 } }], 11);
    let test = simulate::cell(&model, &hidden, &[short("test_04", 0.030, 1.0)], 11);
    let rules = Rules::default();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let request = Request {
            model: &model,
            catalog: &catalog,
            learn: &learn,
            aux: &aux,
            test: &test,
            rules,
            progress: &|_| {},
        };
        pool.install(|| serde_json::to_string(&diagnose(&request).unwrap().diagnosis).unwrap())
    };
    let (one, two) = (on(1), on(2));
    assert!(one.contains("coulomb-friction") && one == two, "one thread:\n{one}\ntwo:\n{two}");
}

#[test]
fn a_simulated_cell_is_the_same_twice_whatever_else_is_in_the_plan() {
    let (model, _) = impact();
    let effects: Vec<Chosen> = ["command-loss", "command-jitter", "hysteresis"]
        .map(|id| Chosen::at_start(standard().get(id).unwrap()))
        .to_vec();
    let all = simulate::cell(&model, &effects, &simulate::LEARN, 5);
    assert_eq!(all, simulate::cell(&model, &effects, &simulate::LEARN, 5));
    let alone = simulate::cell(&model, &effects, &simulate::LEARN[3..4], 5);
    assert_eq!((&alone[0].sensed, &alone[0].measured), (&all[3].sensed, &all[3].measured));
    assert_ne!(alone[0].sensed, simulate::cell(&model, &effects, &simulate::LEARN[3..4], 6)[0].sensed);
}

#[test]
fn a_simulated_recording_says_what_its_cell_was() {
    let (model, _) = impact();
    let session = &simulate::cell(&model, &[], &simulate::LEARN[2..3], 5)[0];
    assert_eq!(from_session(session).unwrap(), model);
    let case = Case::of(session, &model).unwrap();
    let commanded: Vec<f64> = case.commanded.iter().map(|motion| motion.position_m).collect();
    assert!(recompute(&model, &case, &[]).commanded_m == commanded, "our own commands, to the bit");
}

/// The net force that our software makes of the embedded impact: equal bits with and without optimisation, on every machine.
#[test]
fn the_replay_of_an_embedded_recording_keeps_its_bits() {
    let (model, case) = impact();
    let print = || {
        let again = recompute(&model, &case, &[]);
        let mut print = sim_core::trace::Fingerprint::default();
        again.commanded_m.iter().chain(&again.net_n).for_each(|value| print.take(*value));
        print.hex()
    };
    assert_eq!(print(), print());
    assert_eq!(print(), "89327d6cfe7715ce4a8561ded23d3192");
}

/// The sample that a tick of the loop uses: the newest one at or before it.
fn sample_of(case: &Case, tick: usize) -> usize {
    let now_ns = tick as i64 * case.rates.loop_period.0 - case.rates.sensor_phase.0;
    (now_ns / case.rates.sensor_period.0) as usize
}

/// A copy in which one sample of the force is changed.
fn with_sample(case: &Case, sample: usize, reading_n: f64) -> Case {
    let mut changed = case.clone();
    changed.sensed_n.value[sample] = reading_n;
    changed
}

#[test]
fn one_unit_in_the_last_place_of_a_force_is_found_at_its_tick() {
    let (model, case) = impact();
    assert!(closure_m(&model, &case, &[]).0 < 1e-9, "it is our software");
    let net_n = recompute(&model, &case, &[]).net_n;
    // Reading, felt and net force between 4 and 8 N, where all of them end at the same digit. The bias, 2.1 N, has one digit more:
    // their sum is a tie, and rounding to even swallows one of the two neighbours of a reading, never both.
    let inside = |force_n: f64| (4.1..7.9).contains(&force_n);
    let felt_n = |tick: usize| model.sensor.bias_n - case.sensed_n.value[sample_of(&case, tick)];
    let fits = |tick: &usize| {
        inside(-case.sensed_n.value[sample_of(&case, *tick)]) && inside(felt_n(*tick)) && inside(net_n[*tick])
    };
    let ticks: Vec<usize> = (1..net_n.len()).filter(fits).collect();
    assert!(ticks.len() > 3, "{ticks:?}");
    for tick in ticks {
        let sample = sample_of(&case, tick);
        let reading_n = case.sensed_n.value[sample];
        let neighbours = [reading_n.next_down(), reading_n.next_up()]
            .map(|neighbour_n| first_difference(&model, &case, &with_sample(&case, sample, neighbour_n), &[]));
        assert!(neighbours.iter().any(Option::is_some), "tick {tick}");
        for found in neighbours.into_iter().flatten() {
            assert_eq!((found.tick, found.wire), (tick, Wire::Feedback), "{found:?}");
            assert!((found.one - found.other).abs() < 2e-15, "{found:?}");
        }
        // Three of four samples lie between the ticks of the loop, and no tick uses them.
        let unused = with_sample(&case, sample + 1, case.sensed_n.value[sample + 1] + 1.0);
        assert_eq!(first_difference(&model, &case, &unused, &[]), None);
    }
}

/// The last digit that a recording holds is 1 mN: it moves the very next command.
#[test]
fn the_last_digit_of_a_recorded_force_is_found_in_the_next_command() {
    let (model, case) = impact();
    let net_n = recompute(&model, &case, &[]).net_n;
    let tick = (1..net_n.len()).find(|&tick| net_n[tick] > 3.0).unwrap();
    let sample = sample_of(&case, tick);
    let changed = with_sample(&case, sample, case.sensed_n.value[sample] - 1e-3);
    let Some(Difference { tick: at, wire: Wire::Feedback, one, other }) =
        first_difference(&model, &case, &changed, &[])
    else {
        panic!("the net force differs first");
    };
    assert_eq!(at, tick);
    assert!((other - one - 1e-3).abs() < 1e-12, "{one} {other}");
    let (here, there) = (recompute(&model, &case, &[]).commanded_m, recompute(&model, &changed, &[]).commanded_m);
    let first = here.iter().zip(&there).position(|(a, b)| a.to_bits() != b.to_bits());
    assert_eq!(first, Some(tick + 1));
}
