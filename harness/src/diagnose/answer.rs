//! The answer, as it is written to JSON. The format carries a version; fields are added, never changed.

use super::noise::Noise;
use super::quality::{Channel, Phase};
use super::software::Software;
use crate::recording::{Grade, Kind};
use serde::Serialize;
use std::collections::BTreeMap;

/// What a diagnosis may say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The model reaches the noise; the sizes that could not have been seen are listed.
    NothingMissing,
    /// The named effects take the model to the noise.
    Explained,
    /// The named effects are there, and something else is too.
    PartlyExplained,
    /// Something is missing, and no effect of the catalogue explains it.
    NoneOfThese,
    /// No effect is missing: a base value is wrong.
    WrongParameter,
    /// Something changes from session to session by more than is declared.
    VariesBetweenSessions,
    /// A recording is not what it says it is.
    RecordingDefect,
    /// These recordings cannot answer.
    Undecided,
}

impl Verdict {
    /// Whether the diagnosis could answer: exit code 0, else 3.
    pub fn answers(self) -> bool {
        matches!(self, Verdict::NothingMissing | Verdict::Explained | Verdict::WrongParameter)
    }

    /// As it stands in JSON.
    pub fn id(self) -> &'static str {
        match self {
            Verdict::NothingMissing => "nothing-missing",
            Verdict::Explained => "explained",
            Verdict::PartlyExplained => "partly-explained",
            Verdict::NoneOfThese => "none-of-these",
            Verdict::WrongParameter => "wrong-parameter",
            Verdict::VariesBetweenSessions => "varies-between-sessions",
            Verdict::RecordingDefect => "recording-defect",
            Verdict::Undecided => "undecided",
        }
    }
}

/// A fitted value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Value, in the unit of its key.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// One thing that is missing, and everything that could be it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Effects that tell the recordings equally well: the fitted one, then the others, best first.
    pub effects: Vec<String>,
    /// The same as sets: an alternative may consist of several effects.
    pub alternatives: Vec<Vec<String>>,
    /// Parameters of the best one.
    pub parameters: BTreeMap<String, BTreeMap<String, Estimate>>,
    /// By how much twice the log density of recordings that a fit has not seen rises with it.
    pub held_out_gain: f64,
    /// Why, in a sentence.
    pub reason: String,
    /// The experiment that would split the tie, or isolate the effect.
    pub splitting_experiment: String,
}

/// A base value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaseParameter {
    /// As the model has it.
    pub nominal: f64,
    /// As the recordings have it.
    pub fitted: f64,
    /// Standard deviation of the fitted value.
    pub sd: f64,
    /// Whether it is off by more than its uncertainty and the declared repeatability.
    pub wrong: bool,
    /// The effects that these recordings cannot tell from a wrong value.
    pub looks_like: Vec<String>,
}

/// A recording, and what was found in it.
#[derive(Debug, Clone, Serialize)]
pub struct SessionNote {
    /// File name.
    pub file: String,
    /// What it was used for.
    pub role: &'static str,
    /// What was done.
    pub kind: Kind,
    /// Integrity.
    pub grade: Grade,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Whether it differs from the others, or is not what it says.
    pub odd: bool,
    /// Why, and whatever else was found.
    pub notes: Vec<String>,
    /// The software block.
    pub software: Option<Software>,
    /// Offset in N, and logarithms of stiffness and damping against the shared ones.
    pub nuisance: Option<[f64; 3]>,
}

/// Error on recordings that were used for nothing else, one channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TestScore {
    /// Of the model as it was given: root mean square.
    pub before: f64,
    /// Of the model with what was found.
    pub after: f64,
    /// Of a recording at rest.
    pub noise_floor: f64,
    /// Unit of the three.
    pub unit: &'static str,
}

/// One cell of the map: phase × channel, in multiples of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    /// Phase.
    pub phase: Phase,
    /// Channel.
    pub channel: Channel,
    /// Misfit of the model as it was given; 1 is noise.
    pub before: f64,
    /// Misfit with what was found.
    pub after: f64,
    /// How many blocks of 40 ms it holds.
    pub blocks: usize,
}

/// One row of a ranking.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rank {
    /// In which step of the search.
    pub step: usize,
    /// Effect.
    pub effect: String,
    /// Gain of the fit on all learning recordings, in -2 ln p.
    pub gain: f64,
    /// Gain on recordings that were left out; `None` if it did not get that far.
    pub held_out_gain: Option<f64>,
    /// In how many of them it gains.
    pub wins: usize,
    /// How many were left out, each in turn.
    pub of: usize,
    /// Whether it was added.
    pub accepted: bool,
}

/// The whole answer.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// Version of this format.
    pub schema: u32,
    /// The answer in a word.
    pub verdict: Verdict,
    /// The answer in sentences.
    pub sentences: Vec<String>,
    /// What is missing, most important first.
    pub groups: Vec<Group>,
    /// Base values.
    pub base_parameters: BTreeMap<String, BaseParameter>,
    /// For each effect that was not found, the size that these recordings would have shown. A frequency is the highest one.
    pub not_visible_below: BTreeMap<String, BTreeMap<String, f64>>,
    /// Recordings.
    pub sessions: Vec<SessionNote>,
    /// √Q of the model as it was given; 1 is noise.
    pub misfit_before: f64,
    /// √Q with what was found.
    pub misfit_after: f64,
    /// Error on the test recordings, commands clamped; only offset and stiffness, inside the declared repeatability, are fitted
    /// for each of them.
    pub test: BTreeMap<&'static str, TestScore>,
    /// Where it fails.
    pub map: Vec<Cell>,
    /// How the effects were ranked.
    pub ranking: Vec<Rank>,
    /// Noise.
    pub noise: Noise,
    /// Declared and found scatter between sessions: offset in N, stiffness and damping relative.
    pub scatter: [[f64; 2]; 3],
}

/// What was measured and what the models say, of one recording with its commands clamped: for pictures, not for JSON.
#[derive(Debug, Clone)]
pub struct Curves {
    /// File name.
    pub file: String,
    /// What it was used for: `learn`, `aux` or `test`.
    pub role: &'static str,
    /// First and last contact, s.
    pub contact_s: Option<(f64, f64)>,
    /// Times of the force samples, s.
    pub sensor_time_s: Vec<f64>,
    /// Reading along the axis without the declared bias and weight, sign turned: positive resists penetration, N.
    pub force_measured_n: Vec<f64>,
    /// The same from the model as it was given.
    pub force_before_n: Vec<f64>,
    /// The same from the model with what was found.
    pub force_after_n: Vec<f64>,
    /// Penetration of the nominal contact plane at the times of the force samples, by the found model, m.
    pub depth_m: Vec<f64>,
    /// Times of the pose samples, s.
    pub loop_time_s: Vec<f64>,
    /// Reported position, m.
    pub position_measured_m: Vec<f64>,
    /// The same from the model as it was given.
    pub position_before_m: Vec<f64>,
    /// The same from the model with what was found.
    pub position_after_m: Vec<f64>,
}

/// Nominal, + effect 1, + effect 2 … on recordings that no fit has seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ladder {
    /// Version of this format.
    pub schema: u32,
    /// Channels.
    pub channels: BTreeMap<&'static str, LadderChannel>,
    /// Recordings, in the order of every `per_session`.
    pub sessions: Vec<String>,
}

/// One channel of a ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderChannel {
    /// Unit.
    pub unit: &'static str,
    /// Root mean square of a recording at rest.
    pub noise_floor: f64,
    /// Steps, from the nominal model on.
    pub steps: Vec<LadderStep>,
}

/// One step of a ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderStep {
    /// `nominal`, or `+ effect`.
    pub label: String,
    /// Root mean square over all test recordings.
    pub rms: f64,
    /// What lies above the noise floor: √(rms² - floor²).
    pub excess: f64,
    /// Root mean square of each recording.
    pub per_session: Vec<f64>,
}
