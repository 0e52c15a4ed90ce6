//! Two measurements of one docking, say facility against air-bearing table: no model stands between them.
//!
//! Both are taken through the same criteria, with the noise of the noisier one on both sides, so that thresholds are the same.
//! Signals are aligned at first contact for the plots; no number depends on that. Every offset that alignment hides is a finding:
//! the shift in time, the difference of approach speed, the place of the contact plane.
//!
//! | quantity | how |
//! |---|---|
//! | approach speed | average over 100 ms that end 20 ms before first contact |
//! | restitution, both definitions | average speed over 100 ms, 60 ms after release, over approach speed |
//! | contact time | first to last touch, each on the line through two crossings |
//! | peak force | largest mean over ±10 ms: 3e-4 low for a contact of 0.8 s |
//! | observed energy | `(m/2)(v₋² - v₊²)` with those average speeds; above 0 is absorbed |
//!
//! A difference is outside when it exceeds twice its standard uncertainty. The approach speed is what the operator set: its
//! difference is a finding and decides nothing. It shows in peak force (with v) and energy (with v²), and the findings say how much.

use super::limit::judged;
use super::observed::observation;
use super::result::{CompareVerdict, LimitResult, Verdict};
use super::{Limit, Outcome};
use crate::error::Error;
use crate::recording::{Grade, Session};
use serde::Serialize;
use sim_core::criterion::{
    Along, Contact, Estimate, Missing, Observation, ObservedAxis, Speeds, contact, contact_duration, speeds,
};
use sim_core::restitution::Release;

/// Half width of the mean whose largest value is the peak force.
const PEAK_HALF_S: f64 = 0.010;
/// What the curves show before contact and after it.
const MARGIN_S: f64 = 0.25;

/// Measurements against a reference.
#[derive(Debug, Clone, Serialize)]
pub struct Measurements {
    /// Version of this format.
    pub schema: u32,
    /// File name of the reference.
    pub reference: String,
    /// Integrity of the reference.
    pub reference_grade: Grade,
    /// The answer.
    pub verdict: CompareVerdict,
    /// Each recording against the reference.
    pub runs: Vec<RunAgainst>,
    /// What a reader must know, most important first; one sentence each.
    pub findings: Vec<String>,
    /// One result for each limit and each recording.
    pub limits: Vec<LimitResult>,
}

/// One recording against the reference.
#[derive(Debug, Clone, Serialize)]
pub struct RunAgainst {
    /// File name.
    pub file: String,
    /// Integrity of the file.
    pub grade: Grade,
    /// What follows from its quantities.
    pub verdict: Verdict,
    /// What alignment at first contact hides.
    pub alignment: Alignment,
    /// The quantities.
    pub quantities: Vec<Difference>,
    /// Curves for the report, time counted from first contact.
    pub curves: Curves,
}

/// What alignment at first contact hides. Each is this recording minus the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alignment {
    /// Time of first contact, in s after the first sample of each file.
    pub time_shift_s: f64,
    /// Approach speed, in m/s.
    pub velocity_offset_m_per_s: f64,
    /// Position at first contact, in m; absent where one of them has no pose.
    pub position_offset_m: Option<f64>,
}

/// One quantity of two measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Name; where a comparison with a model has the same quantity, the name that `--limit` takes.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// How it was had, or why it could not be had.
    pub about: String,
    /// From this recording.
    pub value: Option<f64>,
    /// Twice its standard deviation.
    pub value_uncertainty: Option<f64>,
    /// From the reference.
    pub reference: Option<f64>,
    /// Twice its standard deviation.
    pub reference_uncertainty: Option<f64>,
    /// This recording minus the reference.
    pub difference: Option<f64>,
    /// Twice the standard deviation of the difference.
    pub uncertainty: Option<f64>,
    /// What follows.
    pub verdict: Verdict,
}

/// Force and position of both, on this recording's clocks, time counted from first contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Curves {
    /// Times of the force samples, in s.
    pub force_time_s: Vec<f64>,
    /// Contact force, in N, positive resists.
    pub force_n: Vec<f64>,
    /// The reference's, at the same times after its own first contact.
    pub force_reference_n: Vec<Option<f64>>,
    /// Times of the poses, in s.
    pub pose_time_s: Vec<f64>,
    /// Position beyond that at first contact, in m.
    pub position_m: Vec<f64>,
    /// The reference's.
    pub position_reference_m: Vec<Option<f64>>,
    /// End of contact, in s.
    pub contact_s: f64,
}

/// One measurement with what was seen of it.
struct Seen {
    run: Observation<'static>,
    contact: Contact,
    /// By [`Release::ZeroForce`] and [`Release::ZeroDepth`].
    speeds: [Result<Speeds, Missing>; 2],
}

impl Seen {
    fn of(mut run: Observation<'static>, noise_n: Option<f64>, session: &Session) -> Result<Self, Error> {
        run.along[0].load_sd = noise_n;
        let along = &run.along[0];
        let none = |missing: Missing| {
            let help = "give recordings of one contact each, with approach and departure, force or velocity recorded";
            Error::new(missing.to_string()).file(&session.file).help(help)
        };
        let contact = contact(&run, along).map_err(none)?;
        let speeds = [Release::ZeroForce, Release::ZeroDepth].map(|release| speeds(&run, ObservedAxis::Z, release));
        Ok(Seen { run, contact, speeds })
    }

    fn along(&self) -> &Along<'static> {
        &self.run.along[0]
    }

    /// Position when contact began.
    fn plane_m(&self) -> Option<f64> {
        let positions = position(self.along())?;
        at(&self.run.loop_time, positions, self.contact.begin_s)
    }

    /// Speeds of free flight on either side: at d = 0 they are averages, whether something pulled before or not.
    fn flight(&self) -> Result<&Speeds, Missing> {
        let [zero_force, zero_depth] = &self.speeds;
        zero_depth.as_ref().or(zero_force.as_ref()).map_err(Clone::clone)
    }

    /// How the speed at f = 0 was had.
    fn zero_force_about(&self) -> Option<&str> {
        self.speeds[0].as_ref().ok().map(|speeds| speeds.about.as_str())
    }

    /// Every quantity, in the order of [`QUANTITIES`].
    fn values(&self) -> [Result<Estimate, Missing>; 7] {
        let of =
            |place: usize, part: fn(&Speeds) -> Estimate| self.speeds[place].as_ref().map(part).map_err(Clone::clone);
        let flight = |part: fn(&Speeds) -> Estimate| self.flight().map(part);
        let minus = |estimate: Estimate| Estimate { value: -estimate.value, ..estimate };
        [
            flight(|speeds| speeds.before),
            flight(|speeds| speeds.after).map(minus),
            of(0, |speeds| speeds.restitution),
            of(1, |speeds| speeds.restitution),
            contact_duration(&self.run, ObservedAxis::Z).map(|(duration, _)| duration),
            self.peak(),
            self.energy(),
        ]
    }

    /// Largest mean over ±10 ms.
    fn peak(&self) -> Result<Estimate, Missing> {
        let force = self.along().sensed.as_ref().ok_or_else(|| Missing("no reading of the sensor".into()))?;
        let half = (PEAK_HALF_S / self.run.sensor_tick_s()?).round() as usize;
        let count = 2 * half + 1;
        let means = force.windows(count).map(|window| window.iter().sum::<f64>() / count as f64);
        let value = means.max_by(f64::total_cmp).ok_or_else(|| Missing("fewer samples than ±10 ms".into()))?;
        Ok(Estimate { value, sd: self.along().load_sd.map(|sd| sd / (count as f64).sqrt()) })
    }

    /// `(m/2)(v₋² - v₊²)`.
    fn energy(&self) -> Result<Estimate, Missing> {
        let mass_kg = self.run.mass_kg.ok_or_else(|| Missing("the record does not say reduced_mass_kg".into()))?;
        let speeds = self.flight()?;
        let (before, after) = (speeds.before, speeds.after);
        // The noise that the loop felt is in the restitution, and in no speed that was recorded.
        let after_sd = speeds.restitution.sd.unwrap_or(0.0) * before.value;
        let part = |speed: f64, sd: f64| mass_kg * speed * sd;
        let sd = libm::hypot(part(before.value, before.sd.unwrap_or(0.0)), part(after.value, after_sd));
        let value = 0.5 * mass_kg * (before.value * before.value - after.value * after.value);
        Ok(Estimate { value, sd: Some(sd) })
    }
}

/// Place of the restitution at f = 0 in [`QUANTITIES`].
const ZERO_FORCE: usize = 2;

/// Name, unit, and how it was had.
const QUANTITIES: [(&str, &str, &str); 7] = [
    ("approach_speed_m_per_s", "m/s", "average over 100 ms that end 20 ms before first contact; decides nothing"),
    ("rebound_speed_m_per_s", "m/s", "average over 100 ms, 60 ms after d = 0, positive leaving; decides nothing"),
    (
        "restitution",
        "1",
        "release at f = 0: average speeds, or the speed at that instant where the net force pulls afterwards",
    ),
    ("restitution_zero_depth", "1", "average speeds, release at d = 0"),
    ("contact_time_s", "s", "from first to last touch: the line through crossings of the threshold and three times it"),
    ("peak_force_n", "N", "largest mean over ±10 ms, bias and weight taken out"),
    ("observed_energy_j", "J", "(m/2)(v₋² - v₊²) with the average speeds; above 0 is absorbed"),
];

/// Compares recordings with a reference.
///
/// # Errors
/// When a recording holds no whole contact, or a limit is on something that two measurements do not have in common.
pub fn compare_measurements(
    reference: &Session,
    sessions: &[Session],
    limits: &[Limit],
) -> Result<Measurements, Error> {
    limits.iter().try_for_each(known)?;
    let first = observation(reference)?;
    let mut runs = Vec::new();
    let mut findings = Vec::new();
    for session in sessions {
        let run = observation(session)?;
        let noise_n = match (first.along[0].load_sd, run.along[0].load_sd) {
            (Some(one), Some(other)) => Some(one.max(other)),
            _ => None,
        };
        let reference = Seen::of(first.clone(), noise_n, reference)?;
        let seen = Seen::of(run, noise_n, session)?;
        let one = against(&reference, &seen, session);
        findings.extend(super::measurement_words::findings(
            &one,
            [&reference.contact, &seen.contact],
            [reference.run.mass_kg, seen.run.mass_kg],
        ));
        runs.push(one);
    }
    findings.extend(std::iter::once(reference).chain(sessions).filter_map(super::measurement_words::no_bias));
    let limits: Vec<LimitResult> = runs.iter().flat_map(|run| limits.iter().map(|limit| held(limit, run))).collect();
    Ok(Measurements {
        schema: 1,
        reference: name(reference),
        reference_grade: reference.grade,
        verdict: verdict(&runs, &limits),
        runs,
        findings,
        limits,
    })
}

fn name(session: &Session) -> String {
    let file = &session.file;
    file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn known(limit: &Limit) -> Result<(), Error> {
    if QUANTITIES.iter().any(|(name, ..)| *name == limit.channel) {
        return Ok(());
    }
    let names: Vec<&str> = QUANTITIES.iter().map(|(name, ..)| *name).collect();
    Err(Error::new(format!("no quantity `{}` of two measurements to set a limit on", limit.channel))
        .place("--limit")
        .help(format!("quantities: {}", names.join(", "))))
}

fn against(reference: &Seen, seen: &Seen, session: &Session) -> RunAgainst {
    let mut values = seen.values();
    if let (Some(here), Some(there)) = (seen.zero_force_about(), reference.zero_force_about())
        && here != there
    {
        // One of them tells when the net force begins to pull, the other does not: two quantities of one name.
        let what = format!("taken otherwise than in the reference: {here}; there {there}");
        values[ZERO_FORCE] = Err(Missing(what));
    }
    let pairs = reference.values().into_iter().zip(values).zip(QUANTITIES);
    let quantities: Vec<Difference> =
        pairs.map(|((reference, value), quantity)| difference(quantity, reference, value)).collect();
    let deciding = quantities.iter().filter(|quantity| !quantity.about.ends_with("decides nothing"));
    let speed = |seen: &Seen| seen.flight().map_or(f64::NAN, |speeds| speeds.before.value);
    RunAgainst {
        file: name(session),
        grade: session.grade,
        verdict: deciding.map(|quantity| quantity.verdict).max().unwrap_or(Verdict::CannotSay),
        alignment: Alignment {
            time_shift_s: seen.contact.begin_s - reference.contact.begin_s,
            velocity_offset_m_per_s: speed(seen) - speed(reference),
            position_offset_m: seen.plane_m().zip(reference.plane_m()).map(|(here, there)| here - there),
        },
        quantities,
        curves: curves(reference, seen),
    }
}

fn difference(
    (name, unit, about): (&str, &str, &str),
    reference: Result<Estimate, Missing>,
    value: Result<Estimate, Missing>,
) -> Difference {
    let about = match (&value, &reference) {
        (Err(missing), _) => format!("cannot be had from this recording: {missing}"),
        (_, Err(missing)) => format!("cannot be had from the reference: {missing}"),
        _ => about.to_owned(),
    };
    let (value, reference) = (value.ok(), reference.ok());
    let twice = |estimate: Option<Estimate>| estimate.and_then(|estimate| estimate.sd).map(|sd| 2.0 * sd);
    let (value_uncertainty, reference_uncertainty) = (twice(value), twice(reference));
    let difference = value.zip(reference).map(|(value, reference)| value.value - reference.value);
    let uncertainty = value_uncertainty.zip(reference_uncertainty).map(|(one, other)| libm::hypot(one, other));
    let verdict = match (difference, uncertainty) {
        (Some(difference), Some(uncertainty)) if difference.abs() > uncertainty => Verdict::Outside,
        (Some(_), Some(_)) => Verdict::InsideNoise,
        _ => Verdict::CannotSay,
    };
    Difference {
        name: name.to_owned(),
        unit: unit.to_owned(),
        about,
        value: value.map(|value| value.value),
        value_uncertainty,
        reference: reference.map(|reference| reference.value),
        reference_uncertainty,
        difference,
        uncertainty,
        verdict,
    }
}

fn held(limit: &Limit, run: &RunAgainst) -> LimitResult {
    let quantity = run.quantities.iter().find(|quantity| quantity.name == limit.channel);
    let value = quantity.and_then(|quantity| quantity.difference).map(f64::abs);
    let uncertainty = quantity.and_then(|quantity| quantity.uncertainty);
    LimitResult {
        channel: limit.channel.clone(),
        limit: limit.value,
        value,
        uncertainty,
        unit: quantity.map_or_else(String::new, |quantity| quantity.unit.clone()),
        outcome: judged(value, uncertainty, limit.value),
        session: run.file.clone(),
    }
}

/// Limits decide where there are any; else whether the differences are outside their uncertainty.
fn verdict(runs: &[RunAgainst], limits: &[LimitResult]) -> CompareVerdict {
    let any = |outcome: Outcome| limits.iter().any(|limit| limit.outcome == outcome);
    match runs.iter().map(|run| run.verdict).max() {
        _ if any(Outcome::Fail) => CompareVerdict::Fail,
        _ if any(Outcome::Undecided) => CompareVerdict::Undecided,
        _ if !limits.is_empty() => CompareVerdict::Pass,
        Some(Verdict::InsideNoise) => CompareVerdict::InsideNoise,
        Some(Verdict::Outside) => CompareVerdict::Outside,
        _ => CompareVerdict::CannotSay,
    }
}

fn position<'a>(along: &'a Along<'static>) -> Option<&'a [f64]> {
    along.measured.as_deref().or(along.commanded.as_deref())
}

/// A column at a time, on the straight line between two samples; none outside.
fn at(time: &[sim_core::time::Nanos], values: &[f64], time_s: f64) -> Option<f64> {
    let next = time.partition_point(|stamp| stamp.seconds() < time_s);
    if next == 0 || next >= time.len().min(values.len()) {
        return None;
    }
    let (early, late) = (time[next - 1].seconds(), time[next].seconds());
    Some(values[next - 1] + (time_s - early) / (late - early) * (values[next] - values[next - 1]))
}

fn curves(reference: &Seen, seen: &Seen) -> Curves {
    let length_s = seen.contact.end_s - seen.contact.begin_s;
    let since = |time: &sim_core::time::Nanos| time.seconds() - seen.contact.begin_s;
    let shown = |time: &sim_core::time::Nanos| (-MARGIN_S..=length_s + MARGIN_S).contains(&since(time));
    let mut curves = Curves { contact_s: length_s, ..Curves::default() };
    if let (Some(force), Some(other)) = (&seen.along().sensed, &reference.along().sensed) {
        for (time, force) in seen.run.sensor_time.iter().zip(force.iter()).filter(|(time, _)| shown(time)) {
            let there = at(&reference.run.sensor_time, other, reference.contact.begin_s + since(time));
            curves.force_time_s.push(since(time));
            curves.force_n.push(*force);
            curves.force_reference_n.push(there);
        }
    }
    let positions = position(seen.along()).zip(position(reference.along()));
    if let (Some((here, there)), Some(plane), Some(other_plane)) = (positions, seen.plane_m(), reference.plane_m()) {
        for (time, here) in seen.run.loop_time.iter().zip(here).filter(|(time, _)| shown(time)) {
            let there = at(&reference.run.loop_time, there, reference.contact.begin_s + since(time));
            curves.pose_time_s.push(since(time));
            curves.position_m.push(here - plane);
            curves.position_reference_m.push(there.map(|there| there - other_plane));
        }
    }
    curves
}
