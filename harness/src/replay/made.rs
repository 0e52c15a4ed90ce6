//! What the model makes of a recording, stream by stream, at the ticks of the recording.

use super::{Clamp, Own, Request};
use crate::blocks::{self, Cell};
use crate::case::Case;
use crate::clamp;
use crate::error::Error;
use crate::model::Chosen;
use crate::recording::{Kind, Role, Session};
use crate::scenario::Fault;
use crate::scenario::axis::{traced, within_the_hall};
use crate::simulate::{self, Label};
use sim_core::closed_loop::{Clamps, Start};
use sim_core::effect::Attached;
use sim_core::force_sensor::SensorNoise;
use sim_core::rng::Streams;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// One run of the model on the clocks of a recording.
#[derive(Debug, Clone)]
pub struct Made {
    /// Every wire.
    pub trace: Trace<Axis>,
    /// Commanded position at each tick of the loop, in m.
    pub commanded_m: Vec<f64>,
    /// Velocity of the satellites after each tick, in m/s.
    pub twist_m_per_s: Vec<f64>,
    /// Reported position at each tick of the loop, in m.
    pub measured_m: Vec<f64>,
    /// Reading of the force sensor at each of its ticks, in N.
    pub sensed_n: Vec<f64>,
    /// When a pose left the hall, in s.
    pub ran_away_s: Option<f64>,
}

impl Made {
    /// The values of a stream.
    pub fn of(&self, role: Role) -> &[f64] {
        match role {
            Role::Commanded => &self.commanded_m,
            Role::Twist => &self.twist_m_per_s,
            Role::Measured => &self.measured_m,
            Role::Sensed | Role::Applied => &self.sensed_n,
        }
    }

    /// Whether two runs made the same of the streams that this clamp lets the model make.
    pub fn is_same(&self, other: &Made, clamp: Clamp) -> bool {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let roles = [Role::Commanded, Role::Twist, Role::Measured, Role::Sensed];
        roles.into_iter().filter(|role| clamp.makes(*role)).all(|role| bits(self.of(role)) == bits(other.of(role)))
    }
}

/// Runs the model with these faults.
pub(super) fn made(request: &Request<'_>, case: &Case, faults: &[Fault]) -> Result<Made, Error> {
    match (request.own, request.clamp) {
        (Some(own), Clamp::Nothing) => again(request, own, faults),
        (None, Clamp::Nothing) if case.kind == Kind::FreeFlight => {
            Err(Error::new("was recorded in free flight with the loop open: the satellites did not react")
                .file(&request.session.file)
                .help("clamp the command to the recording: --clamp commanded"))
        }
        _ => Ok(replayed(request, case, faults)),
    }
}

/// The same run again: start, seed and length are those of the recording's own scenario.
fn again(request: &Request<'_>, own: &Own, faults: &[Fault]) -> Result<Made, Error> {
    let (scenario, _) = own.source.parse(request.catalog)?;
    let (trace, ran_away_s) = within_the_hall(traced(&scenario, request.model, faults, request.catalog));
    let streams = Streams::new(scenario.seed);
    Ok(logged(request, trace, &streams, late_s(request, faults), request.model.plant.mass_kg, ran_away_s))
}

fn late_s(request: &Request<'_>, faults: &[Fault]) -> f64 {
    let chosen = request.model.chosen(request.catalog);
    let all = chosen.iter().chain(faults.iter().map(|fault| &fault.chosen));
    all.map(|chosen| chosen.attach().effect.stamp_offset_s()).sum()
}

/// With the recorder's stage, as the run that made the recording had it.
fn logged(
    request: &Request<'_>,
    trace: Trace<Axis>,
    streams: &Streams,
    late_s: f64,
    mass_kg: f64,
    ran_away_s: Option<f64>,
) -> Made {
    let label = Label { name: "replay", kind: Kind::Impact, start_ns: request.session.start_ns };
    let session = simulate::written(request.model, &label, mass_kg, &trace, late_s, streams);
    let series = |of: &dyn Fn(&Session) -> Option<Vec<f64>>| of(&session).unwrap_or_default();
    Made {
        commanded_m: series(&|session| Some(along(&session.commanded.as_ref()?.value, |pose| pose.position_m[2]))),
        twist_m_per_s: trace.after.iter().map(|motion| motion.velocity_m_per_s).collect(),
        measured_m: series(&|session| Some(along(&session.measured.as_ref()?.value, |pose| pose.position_m[2]))),
        sensed_n: series(&|session| Some(along(&session.sensed.as_ref()?.value, |wrench| wrench.force_n[2]))),
        trace,
        ran_away_s,
    }
}

fn along<T>(values: &[T], of: fn(&T) -> f64) -> Vec<f64> {
    values.iter().map(of).collect()
}

/// From the recorded first motion on, clamped where asked.
fn replayed(request: &Request<'_>, case: &Case, faults: &[Fault]) -> Made {
    let model = request.model;
    let taking_part = |chosen: &&Chosen| !request.clamp.silences_effect(chosen);
    let own = model.chosen(request.catalog);
    let attached: Vec<Attached<Axis>> =
        own.iter().filter(taking_part).map(Chosen::attach).chain(faults.iter().map(Fault::attach)).collect();
    // Without a seed there is no noise; effects that are random then draw from one that the recording's bytes decide.
    let (noise, seed) = match request.seed {
        Some(seed) => (simulate::noise(model), seed),
        None => (SensorNoise::NONE, seed_of(&request.session.sha256)),
    };
    let streams = Streams::new(seed);
    let start = Start { first: case.first, from: Nanos(0), until: case.until, noise, streams };
    let path = (request.clamp == Clamp::Achieved).then(|| clamp::Clamp::Achieved.path(model, case));
    let clamps = Clamps {
        commanded: matches!(request.clamp, Clamp::Commanded | Clamp::Achieved).then_some(case.commanded.as_slice()),
        achieved: path.as_ref().map(|path| path.achieved.as_slice()),
        sensed: (request.clamp == Clamp::Sensed).then_some(case.sensed_n.value.as_slice()),
        ..Clamps::default()
    };
    let mut trace = Trace::default();
    Cell::of(model, case.mass_kg).run(&attached, case.rates, &start, &clamps, Columns::LOG, &mut trace);
    let late_s = late_s(request, faults);
    let (mut trace, ran_away_s) = within_the_hall(trace);
    if request.seed.is_some() {
        recorded_satellites(request.clamp, case, &mut trace);
        return logged(request, trace, &streams, late_s, case.mass_kg, ran_away_s);
    }
    let sensed_n = blocks::stamped(&trace.sensed, late_s / case.rates.sensor_period.seconds());
    recorded_satellites(request.clamp, case, &mut trace);
    Made {
        commanded_m: trace.commanded.iter().map(|motion| motion.position_m).collect(),
        twist_m_per_s: trace.after.iter().map(|motion| motion.velocity_m_per_s).collect(),
        measured_m: trace.measured.iter().map(|motion| motion.position_m).collect(),
        sensed_n,
        trace,
        ran_away_s,
    }
}

/// Where the command is clamped, what moved are the recorded satellites: the trace tells their motion and not the one that the
/// model's force would have given them.
fn recorded_satellites(clamp: Clamp, case: &Case, trace: &mut Trace<Axis>) {
    if !matches!(clamp, Clamp::Commanded | Clamp::Achieved) {
        return;
    }
    for (motion, velocity) in trace.after.iter_mut().zip(&case.after_m_per_s.value) {
        motion.velocity_m_per_s = *velocity;
    }
}

/// A seed that the recording decides: the same file gives the same replay.
fn seed_of(sha256: &str) -> u64 {
    u64::from_str_radix(sha256.get(..16).unwrap_or_default(), 16).unwrap_or_default()
}
