//! A run along one axis.

use super::page::{MM_PER_M, curve, over_time, panel};
use super::run::{Ran, TRAVEL_MAX_M, contact_s, cut, idle, kind};
use super::{Fault, Scenario, Source, acting, judge};
use crate::blocks::Cell;
use crate::error::Error;
use crate::model::{Chosen, Model};
use crate::report::{PlotGroup, Role, XyCurve, XyPlot};
use crate::simulate::{self, Label};
use sim_core::closed_loop::{Clamps, Start};
use sim_core::effect::{Attached, Catalog};
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// Runs a scenario whose model has one axis.
pub(super) fn run(source: &Source, catalog: &Catalog<Axis>) -> Result<Ran, Error> {
    let (scenario, model) = source.parse(catalog)?;
    let faults = acting(&scenario.faults, catalog);
    let trace = traced(&scenario, &model, &faults, catalog);
    let idle = idle(&faults, &trace, |others| traced(&scenario, &model, others, catalog));
    let fingerprint = trace.fingerprint().hex();
    let (trace, ran_away_s) = within_the_hall(trace);
    let contact_s = contact_s(&trace, |touch| touch.depth_m);
    let chosen = model.chosen(catalog);
    let late_s = chosen.iter().chain(faults.iter().map(|fault| &fault.chosen));
    let late_s: f64 = late_s.map(|chosen| chosen.attach().effect.stamp_offset_s()).sum();
    let moved = scenario.start.velocity_m_per_s.along() != 0.0;
    let label = Label { name: &scenario.name, kind: kind(contact_s.is_some(), moved), start_ns: scenario.start_ns() };
    let streams = Streams::new(scenario.seed);
    let session = simulate::written(&model, &label, model.plant.mass_kg, &trace, late_s, &streams);
    let verdicts = judge::judged(&scenario.criteria, &trace, &judge::known(&model, model.plant.mass_kg));
    let (plots, loops) =
        (vec![signals(&scenario, &model, &trace, contact_s)], force_over_depth(&scenario, &trace, contact_s));
    Ok(Ran {
        model: model.name,
        sha256: Default::default(),
        session,
        fingerprint,
        contact_s,
        ran_away_s,
        faults: faults.iter().map(Fault::words).collect(),
        idle,
        verdicts,
        plots,
        loops: loops.into_iter().collect(),
        scenario,
    })
}

/// The run itself, with these faults beside the effects of the model.
pub(crate) fn traced(scenario: &Scenario, model: &Model, faults: &[Fault], catalog: &Catalog<Axis>) -> Trace<Axis> {
    let effects = model.chosen(catalog);
    let attached: Vec<Attached<Axis>> =
        effects.iter().map(Chosen::attach).chain(faults.iter().map(Fault::attach)).collect();
    let rates = simulate::rates(model);
    let start = Start {
        first: AxisMotion::moving(scenario.start.position_m.along(), scenario.start.velocity_m_per_s.along()),
        from: Nanos(0),
        until: scenario.until(rates.loop_period),
        noise: simulate::noise(model),
        streams: Streams::new(scenario.seed),
    };
    let mut trace = Trace::default();
    Cell::of(model, model.plant.mass_kg).run(&attached, rates, &start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

/// The trace up to where the loop ran away.
pub(crate) fn within_the_hall(trace: Trace<Axis>) -> (Trace<Axis>, Option<f64>) {
    let is_inside = |motion: &AxisMotion| {
        motion.position_m.is_finite() && motion.position_m.abs() <= TRAVEL_MAX_M && motion.velocity_m_per_s.is_finite()
    };
    cut(trace, is_inside, |reading: &f64| reading.is_finite())
}

fn signals(scenario: &Scenario, model: &Model, trace: &Trace<Axis>, contact_s: Option<(f64, f64)>) -> PlotGroup {
    let loop_s: Vec<f64> = trace.loop_time.iter().map(|time| time.seconds()).collect();
    let sensor_s: Vec<f64> = trace.sensor_time.iter().map(|time| time.seconds()).collect();
    let bias_n = model.sensor.bias_n;
    let position =
        |motions: &[AxisMotion]| -> Vec<f64> { motions.iter().map(|motion| motion.position_m * MM_PER_M).collect() };
    let force = vec![
        curve("felt by the sensor", Role::Measured, trace.sensed.iter().map(|reading| bias_n - reading)),
        curve("at the interface", Role::Model, trace.interface.iter().copied()),
    ];
    let net = vec![curve("felt and virtual together", Role::Model, trace.feedback.iter().copied())];
    let path = vec![
        curve("commanded", Role::Model, position(&trace.commanded).into_iter()),
        curve("reported", Role::Measured, position(&trace.measured).into_iter()),
    ];
    let speed = trace.after.iter().map(|motion| motion.velocity_m_per_s * MM_PER_M);
    let panels = vec![
        panel("force in N", sensor_s, force),
        panel("force on the satellites in N", loop_s.clone(), net),
        panel("position in mm", loop_s.clone(), path),
        panel("velocity in mm/s", loop_s, vec![curve("satellites", Role::Model, speed)]),
    ];
    over_time(&scenario.name, panels, contact_s)
}

fn force_over_depth(scenario: &Scenario, trace: &Trace<Axis>, contact_s: Option<(f64, f64)>) -> Option<XyPlot> {
    let (first_s, last_s) = contact_s?;
    let inside = |tick: &usize| (first_s..=last_s).contains(&trace.sensor_time[*tick].seconds());
    let ticks: Vec<usize> = (0..trace.sensor_time.len()).filter(inside).collect();
    Some(XyPlot {
        title: scenario.name.clone(),
        x_label: "penetration in mm".to_owned(),
        y_label: "force in N".to_owned(),
        curves: vec![XyCurve {
            label: "at the interface".to_owned(),
            role: Role::Model,
            x: ticks.iter().map(|tick| trace.touch[*tick].depth_m * MM_PER_M).collect(),
            y: ticks.iter().map(|tick| trace.interface[*tick]).collect(),
        }],
    })
}
