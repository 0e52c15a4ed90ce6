//! A run with six axes.
//!
//! Its recording holds whole poses, twists and wrenches. The session record says `axes`, so that the commands that work along one
//! axis refuse it, and what an operator believes along the axis of approach, for who reads it elsewhere.

use super::page::{MM_PER_M, curve, over_time, panel};
use super::run::{Ran, TRAVEL_MAX_M, contact_s, cut, idle, kind};
use super::{Fault, Scenario, Source, acting};
use crate::error::Error;
use crate::files::sha256_hex;
use crate::model::{EffectModel, SpaceModel, place, turn, vector};
use crate::recording::{Grade, Pose, Series, Session, Twist, Wrench as Recorded};
use crate::report::{PlotGroup, Role};
use crate::simulate;
use nalgebra::Rotation3;
use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::criterion::{Criterion, Known, Observation};
use sim_core::effect::{Attached, Catalog, Rates};
use sim_core::force_sensor::{SensorNoise, WrenchNoise};
use sim_core::geometry::Geometry;
use sim_core::plant::{BodyMotion, TwoBody};
use sim_core::recorder::{LogChannel, stamped};
use sim_core::refusal::Refusal;
use sim_core::rng::Streams;
use sim_core::space::{Axis, Motion, Spatial, Wrench};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::collections::BTreeMap;

/// Rounding of a recorded torque, as the recorded cells have it.
const TORQUE_QUANTUM_N_M: f64 = 1e-4;

/// Runs a scenario whose model has six axes.
pub(super) fn run(source: &Source, catalog: &Catalog<Axis>) -> Result<Ran, Error> {
    let (scenario, model) = source.parse_space(catalog)?;
    let plant = plant(source, &scenario, &model)?;
    let mut faults = acting(&scenario.faults, catalog);
    let injected = faults.len();
    let own = model.effects.iter().filter(|effect| effect.enabled);
    let chosen = |effect: &EffectModel| catalog.get(&effect.id).map(|kind| Fault::always(effect.chosen(kind)));
    let own: Vec<Fault> = own.filter_map(chosen).collect();
    let run = |faults: &[Fault]| {
        let all: Vec<Attached<Spatial>> = own.iter().chain(faults).map(Fault::attach_along).collect();
        traced(&scenario, &model, plant, &all)
    };
    let trace = run(&faults);
    let idle = idle(&faults, &trace, run);
    let fingerprint = trace.fingerprint().hex();
    let (trace, ran_away_s) = cut(trace, is_inside, is_number);
    let contact_s = contact_s(&trace, |touch| touch.depth_m);
    faults.extend(own);
    let late_s: f64 = faults.iter().map(|fault| fault.attach().effect.stamp_offset_s()).sum();
    let session = written(&scenario, &model, &trace, late_s, contact_s.is_some());
    let known = known(&model);
    let cell = model.cell();
    // What the compensator makes of a reading: bias and weight out, turned into nozzle axes at the probe tip.
    let observation = Observation::of_spatial(&trace, &known, |reading, pose| {
        let attitude = cell.attitude(pose);
        cell.at_tip(&attitude, &(*reading - cell.unloaded(&attitude)))
    });
    let verdicts = scenario.criteria.iter().map(|criterion| criterion.judge(&observation)).collect();
    let plots = vec![forces(&scenario, &model, &trace, contact_s), motions(&scenario, &trace, contact_s)];
    faults.truncate(injected);
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
        loops: Vec::new(),
        scenario,
    })
}

/// The satellites, with the motion of the target that the scenario gives.
fn plant(source: &Source, scenario: &Scenario, model: &SpaceModel) -> Result<TwoBody, Error> {
    let start = &scenario.start;
    let target = BodyMotion {
        velocity_m_per_s: vector(start.target_velocity_m_per_s.unwrap_or_default()),
        rate_rad_per_s: vector(start.target_rate_rad_per_s.unwrap_or_default()),
        ..BodyMotion::default()
    };
    let plant = model.plant().and_then(|plant| plant.with_target(target));
    plant.map_err(|refusal| {
        let name = match refusal.name {
            "target.velocity_m_per_s" => "start.target_velocity_m_per_s",
            "target.rate_rad_per_s" => "start.target_rate_rad_per_s",
            name => name,
        };
        Error::new(Refusal { name, ..refusal }.to_string())
            .file(&source.file)
            .span(&source.text, place::of_key(&source.text, name))
            .help("a target that is fixed has no motion")
    })
}

fn traced(scenario: &Scenario, model: &SpaceModel, plant: TwoBody, effects: &[Attached<Spatial>]) -> Trace<Spatial> {
    match model.cone().expect("the model was checked") {
        Some(cone) => traced_on(scenario, model, plant, effects, cone),
        None => traced_on(scenario, model, plant, effects, model.plane()),
    }
}

fn traced_on<G: Geometry<Spatial>>(
    scenario: &Scenario,
    model: &SpaceModel,
    plant: TwoBody,
    effects: &[Attached<Spatial>],
    geometry: G,
) -> Trace<Spatial> {
    let rig = model.rig(geometry, plant);
    let timing = &model.timing;
    let sensor_period = Nanos::from_seconds(timing.sensor_period_s);
    let rates = Rates {
        physics_step: Nanos::from_seconds(timing.physics_step_s),
        loop_period: Nanos::from_seconds(timing.loop_period_s),
        loop_phase: Nanos(0),
        sensor_period,
        sensor_phase: sensor_period,
    };
    let start = &scenario.start;
    let first = Motion {
        position_m: vector(start.position_m.vector()),
        attitude: turn(start.turn_rad.unwrap_or_default()),
        velocity_m_per_s: vector(start.velocity_m_per_s.vector()),
        rate_rad_per_s: vector(start.rate_rad_per_s.unwrap_or_default()),
        ..Motion::default()
    };
    let until = scenario.until(rates.loop_period);
    let streams = Streams::new(scenario.seed);
    let start = Start { first, from: Nanos(0), until, noise: noise(model), streams };
    let mut trace = Trace::default();
    ClosedLoop::new(&rig, effects, rates).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

fn noise(model: &SpaceModel) -> WrenchNoise {
    let white = |white_n: f64, quantum_n: f64| SensorNoise { white_n, slow_n: 0.0, memory: 0.0, quantum_n };
    WrenchNoise {
        force: [white(model.sensor.white_sigma_n, simulate::FORCE_QUANTUM_N); 3],
        torque: [white(model.sensor.white_sigma_n_m, TORQUE_QUANTUM_N_M); 3],
    }
}

fn is_inside(motion: &Motion) -> bool {
    let numbers = motion.velocity_m_per_s.iter().chain(&motion.rate_rad_per_s).chain(&motion.attitude.coords);
    motion.position_m.norm() <= TRAVEL_MAX_M && numbers.into_iter().all(|number| number.is_finite())
}

fn is_number(reading: &Wrench) -> bool {
    reading.force_n.iter().chain(&reading.torque_n_m).all(|number| number.is_finite())
}

/// What is known of the run besides its columns.
fn known(model: &SpaceModel) -> Known {
    Known {
        mass_kg: Some(model.reduced_mass_kg()),
        bias: [0.0; 6],
        tool_weight_n: 0.0,
        force_sd_n: Some(model.sensor.white_sigma_n),
        torque_sd_n_m: Some(model.sensor.white_sigma_n_m),
        position_sd_m: Some(model.readout.position_sigma_m),
    }
}

/// The stage outside the loop: read-out noise, rounding, stamps, and what the operator believes.
fn written(scenario: &Scenario, model: &SpaceModel, trace: &Trace<Spatial>, late_s: f64, touched: bool) -> Session {
    let mut random = Streams::new(scenario.seed).named("recorder/position");
    let channel = LogChannel { sigma: model.readout.position_sigma_m, quantum: simulate::POSITION_QUANTUM_M };
    let pose = |motion: &Motion| Pose {
        position_m: motion.position_m.into(),
        orientation_xyzw: motion.attitude.coords.into(),
    };
    let reported: Vec<Pose> = trace
        .measured
        .iter()
        .map(|motion| Pose {
            position_m: pose(motion).position_m.map(|value| channel.written(value, &mut random)),
            ..pose(motion)
        })
        .collect();
    let twist = |motion: &Motion| Twist {
        linear_m_per_s: motion.velocity_m_per_s.into(),
        angular_rad_per_s: motion.rate_rad_per_s.into(),
    };
    let wrench = |reading: &Wrench| Recorded { force_n: reading.force_n.into(), torque_n_m: reading.torque_n_m.into() };
    let loop_ns: Vec<i64> = trace.loop_time.iter().map(|time| time.0).collect();
    let moved = scenario.start.velocity_m_per_s.vector().iter().any(|speed| *speed != 0.0);
    let kind = kind(touched, moved || scenario.start.rate_rad_per_s.is_some());
    // There is no file yet: what would be its bytes are the numbers that it would hold.
    let bytes: Vec<u8> = trace.sensed.iter().flat_map(|reading| reading.force_n.z.to_le_bytes()).collect();
    Session {
        file: format!("{}.simulated", scenario.name).into(),
        sha256: sha256_hex(&bytes),
        start_ns: scenario.start_ns(),
        kind,
        believed: believed(model, kind.id()),
        commanded: Some(Series { time_ns: loop_ns.clone(), value: trace.commanded.iter().map(pose).collect() }),
        measured: Some(Series { time_ns: loop_ns.clone(), value: reported }),
        twist: Some(Series { time_ns: loop_ns, value: trace.after.iter().map(twist).collect() }),
        sensed: Some(Series {
            time_ns: trace.sensor_time.iter().map(|time| stamped(*time, late_s).0).collect(),
            value: trace.sensed.iter().map(wrench).collect(),
        }),
        applied: None,
        grade: Grade::A,
        findings: Vec::new(),
    }
}

/// What an operator who thinks along the axis of approach believes.
fn believed(model: &SpaceModel, kind: &str) -> BTreeMap<String, String> {
    let (timing, software, sensor) = (&model.timing, &model.virtual_contact, &model.sensor);
    let numbers = [
        ("reduced_mass_kg", model.reduced_mass_kg()),
        ("device_stiffness_n_per_m", model.contact.stiffness_n_per_m),
        ("device_damping_n_s_per_m", model.contact.damping_n_s_per_m),
        ("virtual_stiffness_n_per_m", software.stiffness_n_per_m[2]),
        ("virtual_damping_n_s_per_m", software.damping_n_s_per_m[2]),
        ("dead_band_n", software.dead_band_n),
        ("command_delay_s", timing.command_delay_s),
        ("measurement_delay_s", timing.measurement_delay_s),
        ("loop_period_s", timing.loop_period_s),
        ("ft_period_s", timing.sensor_period_s),
        ("ft_force_sigma_n", sensor.white_sigma_n),
        ("position_sigma_m", model.readout.position_sigma_m),
        ("tool_mass_kg", sensor.tool_mass_kg),
    ];
    let mut record: BTreeMap<String, String> =
        numbers.into_iter().map(|(key, value)| (key.to_owned(), value.to_string())).collect();
    record.insert("ft_bias".into(), format!("{:?}", sensor.bias_n));
    record.insert("kind".into(), kind.to_owned());
    record.insert("axes".into(), "6".into());
    record
}

/// Forces and torques as the sensor feels them, without its reading at rest.
fn forces(scenario: &Scenario, model: &SpaceModel, trace: &Trace<Spatial>, contact_s: Option<(f64, f64)>) -> PlotGroup {
    let sensor_s: Vec<f64> = trace.sensor_time.iter().map(|time| time.seconds()).collect();
    let rest = model.cell().unloaded(&Rotation3::identity());
    let three = |of: &dyn Fn(&Wrench, usize) -> f64| {
        let roles = [("x", Role::Earlier), ("y", Role::Residual), ("z", Role::Measured)];
        let one = |(axis, (name, role)): (usize, (&str, Role))| {
            curve(name, role, trace.sensed.iter().map(move |reading| of(reading, axis)).collect::<Vec<_>>().into_iter())
        };
        roles.into_iter().enumerate().map(one).collect()
    };
    let force = three(&|reading, axis| rest.force_n[axis] - reading.force_n[axis]);
    let torque = three(&|reading, axis| rest.torque_n_m[axis] - reading.torque_n_m[axis]);
    let panels = vec![panel("force in N", sensor_s.clone(), force), panel("torque in N m", sensor_s, torque)];
    over_time(&format!("{}: what the sensor feels", scenario.name), panels, contact_s)
}

/// How the satellites move against each other.
fn motions(scenario: &Scenario, trace: &Trace<Spatial>, contact_s: Option<(f64, f64)>) -> PlotGroup {
    let loop_s: Vec<f64> = trace.loop_time.iter().map(|time| time.seconds()).collect();
    let roles = [("x", Role::Earlier), ("y", Role::Residual), ("z", Role::Model)];
    let three = |motions: &[Motion], of: &dyn Fn(&Motion, usize) -> f64| {
        let one = |(axis, (name, role)): (usize, (&str, Role))| {
            curve(name, role, motions.iter().map(|motion| of(motion, axis)).collect::<Vec<_>>().into_iter())
        };
        roles.into_iter().enumerate().map(one).collect::<Vec<_>>()
    };
    let net = |(axis, (name, role)): (usize, (&str, Role))| {
        curve(name, role, trace.feedback.iter().map(move |wrench| wrench.force_n[axis]))
    };
    let net: Vec<_> = roles.into_iter().enumerate().map(net).collect();
    let panels = vec![
        panel("felt and virtual force on the chaser in N", loop_s.clone(), net),
        panel(
            "commanded position in mm",
            loop_s.clone(),
            three(&trace.commanded, &|motion, axis| motion.position_m[axis] * MM_PER_M),
        ),
        panel(
            "velocity in mm/s",
            loop_s.clone(),
            three(&trace.after, &|motion, axis| motion.velocity_m_per_s[axis] * MM_PER_M),
        ),
        panel("rate in mrad/s", loop_s, three(&trace.after, &|motion, axis| motion.rate_rad_per_s[axis] * MM_PER_M)),
    ];
    PlotGroup {
        id: "motion".to_owned(),
        ..over_time(&format!("{}: how the satellites move", scenario.name), panels, contact_s)
    }
}
