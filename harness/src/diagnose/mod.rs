//! What is missing in a model: compare it block by block with recordings, find the effect, prove it on recordings that no fit
//! has seen.
//!
//! ```text
//! sessions → examine (is each what it says?) → noise → search (docking | drive) → verdict → answer
//! ```
//!
//! Nothing here looks at a test recording before the set of effects is settled.

pub mod answer;
mod docking;
mod drive;
pub mod examine;
pub mod fit;
pub mod gaps;
mod jitter;
pub mod noise;
pub mod nuisance;
mod paths;
pub mod problem;
pub mod quality;
pub mod random;
pub mod refit;
mod rules;
pub mod score;
pub mod search;
pub mod settle;
pub mod software;
mod stretches;
mod verdict;

use crate::error::Error;
use crate::model::{Chosen, Model, RigKind};
use crate::recording::{Kind, Session};
use answer::{Curves, Diagnosis, Ladder};
use search::Rules;
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// What is asked.
pub struct Request<'a> {
    /// The model as it stands.
    pub model: &'a Model,
    /// The effects that are known.
    pub catalog: &'a Catalog<Axis>,
    /// Recordings that effects are learned from.
    pub learn: &'a [Session],
    /// Recordings without contact that help: at rest, in free flight.
    pub aux: &'a [Session],
    /// Recordings for the final score, and nothing else.
    pub test: &'a [Session],
    /// Rules of acceptance.
    pub rules: Rules,
    /// Told what is being done.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

/// The answer, and what a report needs beside it.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// Measured and modelled signals.
    pub curves: Vec<Curves>,
    /// Nominal, + effect 1, + effect 2 … on the test recordings.
    pub ladder: Ladder,
    /// The effects that were found, with their values.
    pub found: Vec<Chosen>,
    /// Base values as fitted.
    pub base: crate::blocks::Base,
}

/// Finds what is missing.
pub fn diagnose(request: &Request<'_>) -> Result<Outcome, Error> {
    check(request)?;
    match request.model.rig {
        RigKind::Docking => docking::diagnose(request),
        RigKind::Drive => drive::diagnose(request),
    }
}

/// Refuses a request that cannot be answered whatever the recordings hold.
fn check(request: &Request<'_>) -> Result<(), Error> {
    for test in request.test {
        let seen = request.learn.iter().chain(request.aux).find(|session| session.sha256 == test.sha256);
        if let Some(seen) = seen {
            let what = format!("this test recording is also learned from, as {}", seen.file.display());
            return Err(Error::new(what).file(&test.file).help(
                "a test recording may be used for nothing else: take it out of --learn and --aux, or out of --test",
            ));
        }
    }
    let first = request.learn.first().ok_or_else(|| {
        Error::new("there is no recording to learn from").help("name at least one: --learn RECORDING.mcap …")
    })?;
    if request.test.is_empty() {
        return Err(Error::new("there is no test recording")
            .help("name at least one that is used for nothing else: --test RECORDING.mcap …"));
    }
    let wanted = match request.model.rig {
        RigKind::Docking => Kind::Impact,
        RigKind::Drive => Kind::Drive,
    };
    if let Some(other) = request.test.iter().find(|session| session.kind != wanted) {
        let what = format!("this test recording is of kind {}, not {}", other.kind.id(), wanted.id());
        return Err(Error::new(what)
            .file(&other.file)
            .help("a model is scored on recordings of the kind that it is learned from: others belong to --aux"));
    }
    if !request.learn.iter().any(|session| session.kind == wanted) {
        let what = format!("none of the {} learning recordings is of kind {}", request.learn.len(), wanted.id());
        return Err(Error::new(what)
            .file(&first.file)
            .place(format!("kind {}", first.kind.id()))
            .help("give recordings of that kind to --learn; recordings at rest and in free flight belong to --aux"));
    }
    Ok(())
}
