//! The comparison as one function from model and recordings to values.

use super::clamped::{self, Known};
use super::limit::{self, Limit, Outcome};
use super::quantity;
use super::result::{CompareVerdict, Comparison, LimitResult, SessionComparison, Verdict};
use super::session::{self, Compared, Shared};
use super::words::{self, Rank};
use crate::blocks::Base;
use crate::case::Case;
use crate::clamp::Clamp;
use crate::diagnose::noise::Noise;
use crate::diagnose::problem::{Problem, Trial};
use crate::diagnose::random::with_packets;
use crate::diagnose::settle;
use crate::error::Error;
use crate::model::{Model, RigKind};
use crate::recording::{Kind, Session};
use rayon::prelude::*;
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// How many free runs, and from which seed. There is no default seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeRun {
    /// How many runs make a band.
    pub samples: usize,
    /// Where their randomness comes from.
    pub seed: u64,
}

impl FreeRun {
    /// Runs that make a band of 95 % without leaning on its two outermost ones alone.
    pub const SAMPLES: usize = 40;
}

/// What is compared with what.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The model.
    pub model: &'a Model,
    /// Effects that are known.
    pub catalog: &'a Catalog<Axis>,
    /// Recordings, one or more; the first one at rest, if there is one, gives the noise.
    pub sessions: &'a [Session],
    /// Limits of the user; none is a question, not a test.
    pub limits: &'a [Limit],
    /// Free runs.
    pub free_run: FreeRun,
    /// The recorded wire that the blocks start from.
    pub clamp: Clamp,
}

/// Weight of a position where nobody says how noisy it is: no verdict follows from it.
const POSITION_SIGMA_UNKNOWN_M: f64 = 1e-6;

/// Compares a model with recordings.
///
/// # Errors
/// When a limit names no channel, no recording can be compared, or the noise of a docking cell is not known.
pub fn compare(request: Request<'_>) -> Result<Comparison, Error> {
    request.limits.iter().try_for_each(Limit::check)?;
    let model = request.model;
    let at_rest = request.sessions.iter().find(|session| session.kind == Kind::Static);
    let at_rest = at_rest.map(|session| Case::of(session, model)).transpose()?;
    let compared = request.sessions.iter().filter(|session| session.kind != Kind::Static);
    let effects = model.chosen(request.catalog);
    let case = |session| Ok(without_prehistory(settle::settled(Case::of(session, model)?, model, &effects), model));
    let cases: Vec<Case> = compared.map(case).collect::<Result<_, Error>>()?;
    check_cases(model, &cases)?;
    let all: Vec<Case> = at_rest.iter().chain(&cases).cloned().collect();
    let noise = Noise::learn(&all, model);
    let known = noise_is_known(model, &noise)?;
    let mut inner = noise;
    if !known {
        inner.position_floor_m = POSITION_SIGMA_UNKNOWN_M;
    }
    let trial = Trial { base: Base::of(model), effects };
    request.clamp.check(&trial.effects)?;
    let problem = match model.rig {
        RigKind::Docking if request.clamp == Clamp::Commanded => {
            with_packets(Problem::docking(model, cases, inner), &trial)
        }
        RigKind::Docking => Problem::docking(model, cases, inner).clamped(request.clamp),
        RigKind::Drive => Problem::drive(model, &cases, 1, inner),
    };
    let shared = Shared {
        problem: &problem,
        trial: &trial,
        catalog: request.catalog,
        noise: quantity::sensor_noise(&noise),
        known: known.then(|| Known::from_rest(at_rest.as_ref())),
        free_run: request.free_run,
    };
    let indices = 0..problem.runs.len();
    let all: Vec<Compared> = indices.into_par_iter().map(|index| session::compared(&shared, index)).collect();
    Ok(assembled(&request, noise, at_rest.as_ref(), known, all))
}

/// Leaves out what answers to commands from before the recording began. An impact comes in on a straight line and has none; a
/// free flight may have been turning.
fn without_prehistory(mut case: Case, model: &Model) -> Case {
    if case.kind == Kind::FreeFlight {
        let until_s =
            model.timing.command_delay_s + model.timing.measurement_delay_s + 2.0 * model.timing.loop_period_s;
        let early = |first_s: f64, period_s: f64| libm::ceil((until_s - first_s) / period_s).max(0.0) as usize;
        let poses = early(case.loop_time_s(0), case.rates.loop_period.seconds());
        let forces = early(case.sensor_time_s(0), case.rates.sensor_period.seconds());
        case.measured_m.known.iter_mut().take(poses).for_each(|known| *known = false);
        case.sensed_n.known.iter_mut().take(forces).for_each(|known| *known = false);
    }
    case
}

fn assembled(
    request: &Request<'_>,
    noise: Noise,
    at_rest: Option<&Case>,
    known: bool,
    all: Vec<Compared>,
) -> Comparison {
    let heat = if known { clamped::heat(all.iter().flat_map(|one| one.blocks.iter())) } else { Vec::new() };
    let mut ranked: Vec<(Rank, String)> = all.iter().flat_map(|one| one.findings.iter().cloned()).collect();
    ranked.extend(at_rest.and_then(|case| words::drift(case, &noise)).map(|text| (Rank::Noise, text)));
    if !noise.learned {
        let text = "the noise is the model's declared one: no recording at rest was given";
        ranked.push((Rank::Noise, text.into()));
    }
    // Stable: within a rank the recordings keep their order.
    ranked.sort_by_key(|(rank, _)| *rank);
    let mut findings: Vec<String> = ranked.into_iter().map(|(_, text)| text).collect();
    let sessions: Vec<SessionComparison> = all.into_iter().map(|one| one.session).collect();
    let limits: Vec<LimitResult> =
        sessions.iter().flat_map(|session| request.limits.iter().filter_map(|limit| held(limit, session))).collect();
    let verdict = verdict(request, &sessions, &limits);
    if verdict == CompareVerdict::Undecided && limits.iter().all(|limit| limit.outcome == Outcome::Pass) {
        let open = if sessions.iter().all(|session| session.software.closes()) {
            "cannot be judged"
        } else {
            "does not close"
        };
        let text = format!("every limit holds, but the software block {open}: nothing passes before that is settled");
        findings.insert(0, text);
    }
    Comparison { schema: 1, model: request.model.name.clone(), noise, verdict, sessions, heat, findings, limits }
}

fn check_cases(model: &Model, cases: &[Case]) -> Result<(), Error> {
    if cases.is_empty() {
        return Err(Error::new("no recording to compare: a recording at rest gives the noise and nothing else")
            .help("add a recording of an impact"));
    }
    if model.rig == RigKind::Docking && !cases.iter().any(Case::is_impact) {
        let kinds: Vec<String> = cases.iter().map(|case| format!("{} ({})", case.name, case.kind.id())).collect();
        return Err(Error::new(format!("no recording with contact among {}", kinds.join(", "))).help(
            "add a recording of an impact; if one of these is an impact, say kind = impact in its session record or in the map",
        ));
    }
    Ok(())
}

/// Whether residuals can be put in multiples of their noise. A docking cell must say.
fn noise_is_known(model: &Model, noise: &Noise) -> Result<bool, Error> {
    let is_known = |floor: f64| floor.is_finite() && floor > 0.0;
    if model.rig == RigKind::Drive {
        return Ok(is_known(noise.position_floor_m));
    }
    let missing = |what: &str, key: &str| {
        Err(Error::new(format!("the noise of the {what} is not known: no recording at rest, and {key} is 0"))
            .help(format!("add a recording at rest (4 s are enough), or set {key} in the model")))
    };
    if !(is_known(noise.force_floor_n) && is_known(noise.innovation_n)) {
        return missing("force", "sensor.white_sigma_n");
    }
    if !is_known(noise.position_floor_m) {
        return missing("reported position", "readout.position_sigma_m");
    }
    Ok(true)
}

/// A limit against one recording; `None` where it does not apply: a contact limit on a free flight.
fn held(limit: &Limit, session: &SessionComparison) -> Option<LimitResult> {
    let quantity = session.quantities.iter().find(|quantity| quantity.name == limit.channel);
    let block = session.blocks.iter().find(|block| block.channel == limit.channel);
    let (value, uncertainty) = match (quantity, block) {
        (Some(quantity), _) => (quantity.difference.map(f64::abs), quantity.uncertainty),
        (None, Some(block)) if block.rms_contact.is_some() => (block.rms_contact, block.rms_contact_uncertainty),
        // An impact that was not found to touch leaves the limit undecided; a free flight has nothing to hold against it.
        _ if session.kind == Kind::FreeFlight => return None,
        _ => (None, None),
    };
    Some(LimitResult {
        channel: limit.channel.clone(),
        limit: limit.value,
        value,
        uncertainty,
        unit: limit::unit_of(&limit.channel).unwrap_or_default().into(),
        outcome: limit::judged(value, uncertainty, limit.value),
        session: session.file.clone(),
    })
}

fn verdict(request: &Request<'_>, sessions: &[SessionComparison], limits: &[LimitResult]) -> CompareVerdict {
    if request.limits.is_empty() {
        return match sessions.iter().map(|session| session.verdict).max() {
            Some(Verdict::InsideNoise) => CompareVerdict::InsideNoise,
            Some(Verdict::Outside) => CompareVerdict::Outside,
            _ => CompareVerdict::CannotSay,
        };
    }
    let any = |outcome: Outcome| limits.iter().any(|limit| limit.outcome == outcome);
    if any(Outcome::Fail) {
        CompareVerdict::Fail
    } else if limits.is_empty()
        || any(Outcome::Undecided)
        || !sessions.iter().all(|one| one.software.closes() && one.software.is_judged())
    {
        CompareVerdict::Undecided
    } else {
        CompareVerdict::Pass
    }
}

/// The exit code of `dockhil compare`: 0 inside or pass, 1 outside or fail, 3 cannot say or undecided.
pub fn exit_code(comparison: &Comparison) -> u8 {
    exit_code_of(comparison.verdict)
}

/// The same of the verdict alone.
pub fn exit_code_of(verdict: CompareVerdict) -> u8 {
    match verdict {
        CompareVerdict::InsideNoise | CompareVerdict::Pass => 0,
        CompareVerdict::Outside | CompareVerdict::Fail => 1,
        CompareVerdict::CannotSay | CompareVerdict::Undecided => 3,
    }
}
