//! What a step of the closed loop costs, beside what somebody would write by hand for it, and what one evaluation of the force
//! block costs: a fit does thousands of these.

mod bare;
mod cells;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use harness::blocks::{self, Base};
use harness::case::Case;
use harness::model::{self, Chosen};
use harness::recording::{ReadOptions, read};
use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::effect::{Attached, kind_along};
use sim_core::effects::standard;
use sim_core::force_sensor::SensorNoise;
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion, Spatial};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::hint::black_box;

/// A second of impact, at the physics step of the recorded cell.
const DURATION: Nanos = Nanos(1_000_000_000);

fn case() -> (model::Model, Case) {
    let file = fixtures::session("cell-a", "learn_01.mcap");
    let session = read(&file, &ReadOptions::default()).expect("a recording of ours is sound");
    let model = model::from_session(&session).expect("its record describes the cell");
    let case = Case::of(&session, &model).expect("it has every channel");
    (model, case)
}

fn closed_loop(criterion: &mut Criterion) {
    let (model, case) = case();
    let rig = blocks::docking_rig(&model, &Base::of(&model), case.mass_kg);
    let start = Start {
        first: AxisMotion::moving(-0.005, 0.035),
        from: Nanos(0),
        until: DURATION,
        noise: SensorNoise::NONE,
        streams: Streams::new(7),
    };
    let mut group = criterion.benchmark_group("closed loop, one step");
    group.throughput(Throughput::Elements((DURATION.0 / case.rates.physics_step.0) as u64));
    let some = ["stiffness-hardening", "coulomb-friction", "force-lag"];
    for (name, ids) in [("nominal", &some[..0]), ("three effects", &some[..])] {
        let catalog = standard();
        let kinds = ids.iter().map(|id| catalog.get(id).expect("an effect of the catalogue"));
        let effects: Vec<Attached<Axis>> = kinds.map(|kind| Chosen::at_start(kind).attach()).collect();
        let closed_loop = ClosedLoop::new(&rig, &effects, case.rates);
        let mut trace = Trace::default();
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                trace.clear();
                closed_loop.run(black_box(&start), &Clamps::default(), Columns::LOG, &mut trace);
                trace.sensed.len()
            });
        });
    }
    group.finish();
}

/// At a 1 ms step, every wire of the facility: alone, and with noise, a trace and two effects.
fn beside_bare(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one step of 1 ms");
    group.throughput(Throughput::Elements(cells::STEPS as u64));
    group.bench_function("one axis, by hand", |bencher| bencher.iter(|| bare::axis(black_box(cells::STEPS))));
    group.bench_function("six axes, by hand", |bencher| bencher.iter(|| bare::space(black_box(cells::STEPS))));
    let catalog = standard();
    for (name, columns, noisy, ids) in [
        ("alone", cells::NOTHING, false, &[][..]),
        ("everything", Columns::LOG, true, &["coulomb-friction", "force-lag"]),
    ] {
        let kinds: Vec<_> = ids.iter().map(|id| catalog.get(id).expect("an effect of the catalogue")).collect();
        let (one, six) = (cells::one_axis(), cells::six_axes());
        let along: Vec<Attached<Axis>> = kinds.iter().map(|kind| cells::started(kind)).collect();
        let space: Vec<Attached<Spatial>> = kinds.iter().map(|kind| cells::started(&kind_along(kind))).collect();
        let (one_start, six_start) = (cells::start_one(noisy), cells::start_six(noisy));
        group.bench_function(format!("one axis, {name}"), |bencher| {
            let looped = ClosedLoop::new(&one, &along, cells::RATES);
            let mut trace = Trace::default();
            bencher.iter(|| {
                trace.clear();
                looped.run(black_box(&one_start), &Clamps::default(), columns, &mut trace);
                trace.sensed.len()
            });
        });
        group.bench_function(format!("six axes, {name}"), |bencher| {
            let looped = ClosedLoop::new(&six, &space, cells::RATES);
            let mut trace = Trace::default();
            bencher.iter(|| {
                trace.clear();
                looped.run(black_box(&six_start), &Clamps::default(), columns, &mut trace);
                trace.sensed.len()
            });
        });
    }
    group.finish();
}

fn force_block(criterion: &mut Criterion) {
    let (model, case) = case();
    let path = blocks::path(&model, &case, &[], None);
    let base = Base::of(&model);
    let hardening = Chosen::at_start(standard().get("stiffness-hardening").expect("an effect of the catalogue"));
    let mut group = criterion.benchmark_group("force block, one evaluation of one recording");
    group.throughput(Throughput::Elements(case.sensed_n.value.len() as u64));
    let mut trace = Trace::default();
    for (name, effects) in [("nominal", vec![]), ("hardening", vec![hardening])] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| blocks::force(&model, &case, black_box(&path), &base, &effects, &mut trace));
        });
    }
    group.finish();
}

criterion_group!(benches, beside_bare, closed_loop, force_block);
criterion_main!(benches);
