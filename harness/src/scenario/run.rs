//! Runs a scenario: two texts in; a recording, verdicts and curves out.
//!
//! Nothing is drawn but from the scenario's seed, and no clock is asked: the same two texts give the same bytes.

use super::{Fault, Scenario, Source, axis, space};
use crate::error::Error;
use crate::files::sha256_hex;
use crate::model::{SpaceModel, place};
use crate::recording::{Kind, Luggage, Session, write_mcap_with};
use crate::report::{PlotGroup, XyPlot};
use sim_core::criterion::Verdict;
use sim_core::effect::Catalog;
use sim_core::space::{Axis, Space};
use sim_core::trace::{Bits, Fingerprint, Trace};
use std::collections::BTreeMap;

/// Name of the metadata record that makes a recording of ours repeatable.
pub const RECORD: &str = "dockhil.run";
/// Name of the attached scenario.
pub const SCENARIO_FILE: &str = "scenario.toml";
/// Name of the attached model.
pub const MODEL_FILE: &str = "model.toml";
/// A pose beyond this has left the hall: what is cut off there ran away.
pub(crate) const TRAVEL_MAX_M: f64 = 30.0;

/// What a run left behind.
#[derive(Debug, Clone)]
pub struct Ran {
    /// The scenario.
    pub scenario: Scenario,
    /// Name of its model.
    pub model: String,
    /// SHA-256 of the scenario's text and of the model's.
    pub sha256: [String; 2],
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
    /// What its criteria say, in their order.
    pub verdicts: Vec<Verdict>,
    /// Curves over time.
    pub plots: Vec<PlotGroup>,
    /// Force over penetration.
    pub loops: Vec<XyPlot>,
}

/// Runs a scenario.
///
/// # Errors
/// When the scenario or its model is wrong.
pub fn run(source: &Source, catalog: &Catalog<Axis>) -> Result<Ran, Error> {
    let is_space = SpaceModel::is_meant(&source.model_text);
    let mut ran = if is_space { space::run(source, catalog)? } else { axis::run(source, catalog)? };
    for (key, value) in &ran.scenario.session {
        if ran.session.believed.insert(key.clone(), value.clone()).is_some() {
            let span = place::of_key(&source.text, &format!("session.{key}"));
            return Err(Error::new(format!("session.{key} is written by the run itself"))
                .file(&source.file)
                .span(&source.text, span)
                .help("leave it out; the model says it"));
        }
    }
    ran.sha256 = [&source.text, &source.model_text].map(|text| sha256_hex(text.as_bytes()));
    Ok(ran)
}

/// What was done in a run.
pub(super) fn kind(touched: bool, moved: bool) -> Kind {
    match (touched, moved) {
        (true, _) => Kind::Impact,
        (false, true) => Kind::FreeFlight,
        (false, false) => Kind::Static,
    }
}

/// The faults without which a run leaves the same log.
pub(super) fn idle<S: Space>(faults: &[Fault], trace: &Trace<S>, run: impl Fn(&[Fault]) -> Trace<S>) -> Vec<String>
where
    S::Motion: Bits,
    S::Wrench: Bits,
{
    let idle = |nth: &usize| {
        let mut others = faults.to_vec();
        let fault = others.remove(*nth);
        let shifts_stamps = fault.attach().effect.stamp_offset_s() != 0.0;
        !shifts_stamps && log_print(trace) == log_print(&run(&others))
    };
    (0..faults.len()).filter(idle).map(|nth| faults[nth].chosen.kind.id.to_string()).collect()
}

/// A hash of the bits of what a log of this run would hold.
fn log_print<S: Space>(trace: &Trace<S>) -> Fingerprint
where
    S::Motion: Bits,
    S::Wrench: Bits,
{
    let mut print = Fingerprint::default();
    let motions = [&trace.commanded, &trace.measured, &trace.after];
    motions.into_iter().flatten().for_each(|motion| motion.take_into(&mut print));
    trace.sensed.iter().for_each(|reading| reading.take_into(&mut print));
    print
}

/// First and last penetration at a sample of the force sensor, in s.
pub(super) fn contact_s<S: Space>(trace: &Trace<S>, depth_m: impl Fn(&S::Touch) -> f64) -> Option<(f64, f64)> {
    let mut ticks = (0..trace.touch.len()).filter(|tick| depth_m(&trace.touch[*tick]) > 0.0);
    let first = ticks.next()?;
    let last = ticks.next_back().unwrap_or(first);
    Some((trace.sensor_time[first].seconds(), trace.sensor_time[last].seconds()))
}

/// The trace up to where a motion is not inside the hall or a reading is no number, and when that was.
pub(crate) fn cut<S: Space>(
    mut trace: Trace<S>,
    is_inside: impl Fn(&S::Motion) -> bool,
    is_number: impl Fn(&S::Wrench) -> bool,
) -> (Trace<S>, Option<f64>) {
    let stays = |tick: usize| [&trace.commanded, &trace.measured, &trace.after].iter().all(|all| is_inside(&all[tick]));
    let left = (0..trace.loop_time.len()).find(|tick| !stays(*tick)).map(|tick| trace.loop_time[tick]);
    let blind = trace.sensed.iter().position(|reading| !is_number(reading)).map(|tick| trace.sensor_time[tick]);
    let Some(end) = left.into_iter().chain(blind).min() else { return (trace, None) };
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
    pub fn answer(&self) -> serde_json::Value {
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
            "verdicts": self.verdicts,
            "outcome": super::judge::outcome(&self.verdicts),
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
