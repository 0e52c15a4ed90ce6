//! Replay: a recorded session run through a model, clamped where asked and free elsewhere, with faults put in.
//!
//! What the model makes takes the place of what was recorded; every other message keeps its bytes. Two comparisons are made: with
//! the recording, which shows what the model and the faults change, and with the same replay without the faults, which shows what
//! the faults alone change, to the last bit.
//!
//! A recording of ours carries its scenario, its model and its seed. Replayed with nothing clamped and nothing put in it must be
//! the same to the last bit: if it is not, the replay diverged.
//!
//! Not replayed: the attitude, which is neither compared nor replaced; rigs without satellites.

mod change;
mod clamp;
mod made;
mod own;
pub mod page;

pub use change::{First, Stream};
pub use clamp::Clamp;
pub use made::Made;
pub use own::{Earlier, Own};

use crate::case::Case;
use crate::error::Error;
use crate::model::{Model, RigKind};
use crate::recording::{Copied, Luggage, Map, Role, Session, Stamped, clock_of, rewrite};
use crate::scenario::Fault;
use crate::scenario::run::RECORD;
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// Name of the metadata record that says how a replay was made.
pub const REPLAY_RECORD: &str = "dockhil.replay";

/// What is replayed, and how.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The recording.
    pub session: &'a Session,
    /// How it is read.
    pub map: &'a Map,
    /// The model.
    pub model: &'a Model,
    /// Effects that are known.
    pub catalog: &'a Catalog<Axis>,
    /// What the recording was made from, if it is one of ours.
    pub own: Option<&'a Own>,
    /// What the recording was made with, if it is itself a replay.
    pub earlier: Option<&'a Earlier>,
    /// What is taken from the recording.
    pub clamp: Clamp,
    /// Faults that are put in.
    pub faults: &'a [Fault],
    /// How many of them were asked for; the rest was in the recording's own scenario.
    pub injected: usize,
    /// Whether it must be the recording again.
    pub must_be_same: bool,
    /// Seed of sensor noise, for recordings that are not ours; none is no noise.
    pub seed: Option<u64>,
}

impl Request<'_> {
    /// Whether it is the run that made the recording, done again.
    fn is_again(&self) -> bool {
        self.own.is_some() && self.clamp == Clamp::Nothing
    }
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Replayed {
    /// The recording on the clocks of the model.
    pub case: Case,
    /// What the model made.
    pub made: Made,
    /// The same without the injected faults; absent if there are none.
    pub plain: Option<Made>,
    /// Stream by stream, what changed.
    pub streams: Vec<Stream>,
    /// Ids of injected faults without which the replay would be the same.
    pub idle: Vec<String>,
}

/// Replays a recording.
///
/// # Errors
/// When the recording is none of a docking cell, or a fault acts on a clamped wire.
pub fn replay(request: &Request<'_>) -> Result<Replayed, Error> {
    if request.model.rig != RigKind::Docking {
        return Err(Error::new("the model is a drive, and a replay needs satellites")
            .file(&request.session.file)
            .help("compare a drive's recording instead: dockhil compare"));
    }
    let (own, injected) = request.faults.split_at(request.faults.len() - request.injected);
    request.clamp.check(injected)?;
    let case = Case::of(request.session, request.model)?;
    let made = made::made(request, &case, request.faults)?;
    let plain = (!injected.is_empty()).then(|| made::made(request, &case, own)).transpose()?;
    let mut idle = Vec::new();
    for nth in own.len()..request.faults.len() {
        let mut others = request.faults.to_vec();
        let fault = others.remove(nth);
        if made.is_same(&made::made(request, &case, &others)?, request.clamp) {
            idle.push(fault.chosen.kind.id.to_string());
        }
    }
    let streams = change::streams(request, &case, &made, plain.as_ref());
    Ok(Replayed { case, made, plain, streams, idle })
}

impl Replayed {
    /// The first difference of a replay that must be the same and is not: one of ours, with its own model, nothing put in, and
    /// either nothing clamped or the force.
    pub fn diverged(&self, request: &Request<'_>) -> Option<First> {
        request.must_be_same.then(|| self.first().map(|(_, first)| first)).flatten()
    }

    /// The first sample of any stream that differs from the recording.
    pub fn first(&self) -> Option<(&Stream, First)> {
        let all = self.streams.iter().filter_map(|stream| Some((stream, stream.first?)));
        all.min_by(|(_, one), (_, other)| one.time_s.total_cmp(&other.time_s))
    }

    /// The recording with what the model made in it; `added` says how, and holds the model.
    ///
    /// # Errors
    /// When the recording has other axes or units than ours, or is no whole file.
    pub fn mcap(&self, request: &Request<'_>, bytes: &[u8], added: &Luggage) -> Result<(Vec<u8>, Copied), Error> {
        let map = request.map;
        let usual = Map::default();
        if map.sensor != usual.sensor || map.axis != usual.axis {
            return Err(Error::new(
                "the map turns axes, signs or units, and a replay is written in the recording's own",
            )
            .file(&request.session.file)
            .help("leave -o out: the numbers are printed and in --json"));
        }
        let roles: Vec<(Role, String)> = change::ROLES
            .iter()
            .filter_map(|(role, ..)| {
                let topics = &map.topics;
                let topic = match role {
                    Role::Commanded => &topics.commanded,
                    Role::Measured => &topics.measured,
                    Role::Twist => &topics.twist,
                    Role::Sensed | Role::Applied => &topics.sensed,
                };
                topic.clone().map(|topic| (*role, topic))
            })
            .collect();
        let session = request.session;
        let start_ns = session.start_ns + session.commanded.as_ref().and_then(|all| all.time_ns.first()).unwrap_or(&0);
        let mut replace = |message: &Stamped<'_>| {
            let (role, _) = roles.iter().find(|(_, topic)| topic == message.topic)?;
            let time_ns = message.time_ns(clock_of(map, *role))?;
            // The third number of a pose, a twist and a wrench is the one along the axis.
            let sample = change::Sample { role: *role, index: message.index, time_ns: time_ns - start_ns };
            let old = *message.numbers.get(2)?;
            let new = change::replacement(request, &self.case, &self.made, sample, old)?;
            let mut numbers = message.numbers.clone();
            numbers[2] = new;
            Some(numbers)
        };
        let mut out = std::io::Cursor::new(Vec::new());
        let copied =
            rewrite(bytes, &mut replace, added, &[RECORD], &mut out).map_err(|error| error.file(&session.file))?;
        Ok((out.into_inner(), copied))
    }
}
