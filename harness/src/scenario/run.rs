//! Runs a scenario: two texts in; a trace, a recording and what it is made from out.
//!
//! Nothing is drawn but from the scenario's seed, and no clock is asked: the same two texts give the same bytes.

use super::{Fault, Scenario, Source, acting};
use crate::blocks::Cell;
use crate::error::Error;
use crate::files::sha256_hex;
use crate::model::{Chosen, Model, place};
use crate::recording::{Kind, Luggage, Session, write_mcap_with};
use crate::simulate::{self, Label};
use sim_core::closed_loop::{Clamps, Start};
use sim_core::criterion::Verdict;
use sim_core::effect::{Attached, Catalog};
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::collections::BTreeMap;

/// Name of the metadata record that makes a recording of ours repeatable.
pub const RECORD: &str = "dockhil.run";
/// Name of the attached scenario.
pub const SCENARIO_FILE: &str = "scenario.toml";
/// Name of the attached model.
pub const MODEL_FILE: &str = "model.toml";
/// A pose beyond this has left the hall: what is cut off there ran away.
const TRAVEL_MAX_M: f64 = 30.0;

/// What a run left behind.
#[derive(Debug, Clone)]
pub struct Ran {
    /// The scenario.
    pub scenario: Scenario,
    /// Its model.
    pub model: Model,
    /// SHA-256 of the scenario's text and of the model's.
    pub sha256: [String; 2],
    /// Every wire, tick by tick.
    pub trace: Trace<Axis>,
    /// What the recorder made of it.
    pub session: Session,
    /// Hash of the bits of the trace.
    pub fingerprint: String,
    /// First and last penetration, in s.
    pub contact_s: Option<(f64, f64)>,
    /// When a pose left the hall or ceased to be a number, in s: the run ends there.
    pub ran_away_s: Option<f64>,
    /// The faults that were put in, in words.
    pub faults: Vec<String>,
    /// Ids of the faults without which the log would be the same.
    pub idle: Vec<String>,
}

/// Runs a scenario.
///
/// # Errors
/// When the scenario or its model is wrong.
pub fn run(source: &Source, catalog: &Catalog<Axis>) -> Result<Ran, Error> {
    let (scenario, model) = source.parse(catalog)?;
    let faults = acting(&scenario.faults, catalog);
    let trace = traced(&scenario, &model, &faults, catalog);
    let idle = idle(&scenario, &model, &faults, &trace, catalog);
    let words = faults.iter().map(Fault::words).collect();
    let fingerprint = trace.fingerprint().hex();
    let (trace, ran_away_s) = within_the_hall(trace);
    let contact_s = contact_s(&trace);
    let mut session = recorded(&scenario, &model, &faults, &trace, contact_s.is_some(), catalog);
    for (key, value) in &scenario.session {
        if session.believed.insert(key.clone(), value.clone()).is_some() {
            let span = place::of_key(&source.text, &format!("session.{key}"));
            return Err(Error::new(format!("session.{key} is written by the run itself"))
                .file(&source.file)
                .span(&source.text, span)
                .help("leave it out; the model says it"));
        }
    }
    let sha256 = [&source.text, &source.model_text].map(|text| sha256_hex(text.as_bytes()));
    Ok(Ran { scenario, model, sha256, trace, session, fingerprint, contact_s, ran_away_s, faults: words, idle })
}

/// The run itself, with these faults beside the effects of the model.
pub fn traced(scenario: &Scenario, model: &Model, faults: &[Fault], catalog: &Catalog<Axis>) -> Trace<Axis> {
    let effects = model.chosen(catalog);
    let attached: Vec<Attached<Axis>> =
        effects.iter().map(Chosen::attach).chain(faults.iter().map(Fault::attach)).collect();
    let rates = simulate::rates(model);
    let ticks = libm::floor(scenario.duration_s / rates.loop_period.seconds() + 1e-6) as i64;
    let start = Start {
        first: AxisMotion::moving(scenario.start.position_m.along(), scenario.start.velocity_m_per_s.along()),
        from: Nanos(0),
        until: Nanos(ticks * rates.loop_period.0),
        noise: simulate::noise(model),
        streams: Streams::new(scenario.seed),
    };
    let mut trace = Trace::default();
    Cell::of(model, model.plant.mass_kg).run(&attached, rates, &start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

/// The recording of a run, as its recorder would write it.
fn recorded(
    scenario: &Scenario,
    model: &Model,
    faults: &[Fault],
    trace: &Trace<Axis>,
    touched: bool,
    catalog: &Catalog<Axis>,
) -> Session {
    let chosen = model.chosen(catalog);
    let late_s = chosen.iter().chain(faults.iter().map(|fault| &fault.chosen));
    let late_s: f64 = late_s.map(|chosen| chosen.attach().effect.stamp_offset_s()).sum();
    let moved = scenario.start.velocity_m_per_s.along() != 0.0;
    let kind = match (touched, moved) {
        (true, _) => Kind::Impact,
        (false, true) => Kind::FreeFlight,
        (false, false) => Kind::Static,
    };
    // The date is below 2^31 s, which the scenario's check has made sure of.
    let start_ns = scenario.epoch_s as i64 * 1_000_000_000;
    let label = Label { name: &scenario.name, kind, start_ns };
    simulate::written(model, &label, model.plant.mass_kg, trace, late_s, &Streams::new(scenario.seed))
}

/// The faults that changed nothing that a log would hold.
fn idle(
    scenario: &Scenario,
    model: &Model,
    faults: &[Fault],
    trace: &Trace<Axis>,
    catalog: &Catalog<Axis>,
) -> Vec<String> {
    let idle = |nth: &usize| {
        let others: Vec<Fault> =
            faults.iter().enumerate().filter(|(other, _)| other != nth).map(|(_, fault)| fault.clone()).collect();
        let shifts_stamps = faults[*nth].chosen.attach().effect.stamp_offset_s() != 0.0;
        !shifts_stamps && same_log(trace, &traced(scenario, model, &others, catalog))
    };
    (0..faults.len()).filter(idle).map(|nth| faults[nth].chosen.kind.id.to_string()).collect()
}

/// Whether two runs leave the same log, to the last bit.
pub fn same_log(one: &Trace<Axis>, other: &Trace<Axis>) -> bool {
    let bits = |motion: &AxisMotion| [motion.position_m.to_bits(), motion.velocity_m_per_s.to_bits()];
    let motions = |trace: &Trace<Axis>| -> Vec<[u64; 2]> {
        trace.commanded.iter().chain(&trace.measured).chain(&trace.after).map(bits).collect()
    };
    let forces = |trace: &Trace<Axis>| -> Vec<u64> { trace.sensed.iter().map(|force| force.to_bits()).collect() };
    motions(one) == motions(other) && forces(one) == forces(other)
}

/// First and last penetration at a sample of the force sensor, in s.
pub fn contact_s(trace: &Trace<Axis>) -> Option<(f64, f64)> {
    let inside = |tick: &usize| trace.touch[*tick].depth_m > 0.0;
    let mut ticks = (0..trace.touch.len()).filter(inside);
    let first = ticks.next()?;
    let last = ticks.next_back().unwrap_or(first);
    Some((trace.sensor_time[first].seconds(), trace.sensor_time[last].seconds()))
}

/// The trace up to where a pose leaves the hall or a number ceases to be one, and when that was.
pub(crate) fn within_the_hall(mut trace: Trace<Axis>) -> (Trace<Axis>, Option<f64>) {
    let stays = |motion: &AxisMotion| motion.position_m.is_finite() && motion.position_m.abs() <= TRAVEL_MAX_M;
    let left = (0..trace.loop_time.len()).find(|&tick| {
        !(stays(&trace.commanded[tick])
            && stays(&trace.measured[tick])
            && trace.after[tick].velocity_m_per_s.is_finite())
    });
    let left_at = left.map(|tick| trace.loop_time[tick]);
    let blind = trace.sensed.iter().position(|reading| !reading.is_finite()).map(|tick| trace.sensor_time[tick]);
    let Some(end) = left_at.into_iter().chain(blind).min() else { return (trace, None) };
    let ticks = trace.loop_time.partition_point(|time| *time < end);
    let samples = trace.sensor_time.partition_point(|time| *time < end);
    trace.loop_time.truncate(ticks);
    trace.commanded.truncate(ticks);
    trace.received.truncate(ticks);
    trace.measured.truncate(ticks);
    trace.after.truncate(ticks);
    trace.feedback.truncate(ticks);
    trace.sensor_time.truncate(samples);
    trace.sensed.truncate(samples);
    trace.interface.truncate(samples);
    trace.touch.truncate(samples);
    (trace, Some(end.seconds()))
}

impl Ran {
    /// Everything that is not a signal, for JSON.
    pub fn answer(&self, verdicts: &[Verdict]) -> serde_json::Value {
        let [scenario_sha256, model_sha256] = &self.sha256;
        serde_json::json!({
            "schema": 1,
            "scenario": self.scenario.name,
            "version": env!("CARGO_PKG_VERSION"),
            "seed": self.scenario.seed,
            "scenario_sha256": scenario_sha256,
            "model_sha256": model_sha256,
            "fingerprint": self.fingerprint,
            "kind": self.session.kind,
            "contact_s": self.contact_s,
            "ran_away_s": self.ran_away_s,
            "faults": self.faults,
            "verdicts": verdicts,
            "outcome": super::judge::outcome(verdicts),
        })
    }

    /// The recording as a file, with scenario, model and fingerprint in it.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn mcap(&self, source: &Source) -> Result<Vec<u8>, Error> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        write_mcap_with(&self.session, &self.luggage(source), &mut bytes)?;
        Ok(bytes.into_inner())
    }

    fn luggage(&self, source: &Source) -> Luggage {
        let [scenario_sha256, model_sha256] = &self.sha256;
        let record: BTreeMap<String, String> = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scenario", self.scenario.name.clone()),
            ("seed", self.scenario.seed.to_string()),
            ("fingerprint", self.fingerprint.clone()),
            ("scenario_sha256", scenario_sha256.clone()),
            ("model_sha256", model_sha256.clone()),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
        let file = |name: &str, text: &str| (name.to_owned(), text.as_bytes().to_vec());
        Luggage {
            metadata: vec![(RECORD.to_owned(), record)],
            files: vec![file(SCENARIO_FILE, &source.text), file(MODEL_FILE, &source.model_text)],
        }
    }
}
