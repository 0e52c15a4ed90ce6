//! What a comparison says, as plain values that go to text, JSON and the report page alike.

use super::agreement::Agreement;
use super::limit::Outcome;
use crate::diagnose::noise::Noise;
use crate::diagnose::quality::Phase;
use crate::diagnose::software::Software;
use crate::recording::{Grade, Kind};
use serde::Serialize;

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CompareVerdict {
    /// No limit given: software closes and every block is at its noise.
    InsideNoise,
    /// No limit given: the software does not close, or a block is above its noise.
    Outside,
    /// No limit given: the noise is not known.
    CannotSay,
    /// Every limit holds, uncertainty included.
    Pass,
    /// A limit is exceeded, uncertainty included.
    Fail,
    /// A limit lies within the uncertainty, or a number could not be had.
    Undecided,
}

/// The same of one number, without a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The difference is no larger than its uncertainty.
    InsideNoise,
    /// The number is missing, or smaller than its own uncertainty.
    CannotSay,
    /// The difference is larger than its uncertainty.
    Outside,
}

/// A model against recordings.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Version of this format.
    pub schema: u32,
    /// Name of the model.
    pub model: String,
    /// The noise that everything is measured by.
    pub noise: Noise,
    /// The answer.
    pub verdict: CompareVerdict,
    /// Each recording but the one at rest.
    pub sessions: Vec<SessionComparison>,
    /// Misfit by channel and phase, over all recordings.
    pub heat: Vec<HeatRow>,
    /// What a reader must know, most important first; one sentence each.
    pub findings: Vec<String>,
    /// One result for each limit and each recording that it applies to.
    pub limits: Vec<LimitResult>,
}

/// A model against one recording.
#[derive(Debug, Clone, Serialize)]
pub struct SessionComparison {
    /// File name.
    pub file: String,
    /// Integrity of the file.
    pub grade: Grade,
    /// What was done.
    pub kind: Kind,
    /// Software and blocks together.
    pub verdict: Verdict,
    /// The software block.
    pub software: Software,
    /// The software block in a sentence.
    pub software_sentence: String,
    /// What was fitted of this recording alone, within the declared repeatability.
    pub fitted: Vec<Fitted>,
    /// Blocks with clamped inputs.
    pub blocks: Vec<Block>,
    /// Quantities of interest, measured against the free run; empty without contact.
    pub quantities: Vec<Quantity>,
    /// How the free run went; absent without contact.
    pub free_run: Option<FreeRunSummary>,
    /// Shift of the force that would fit best; reported, never applied.
    pub shift_force: Option<Shift>,
    /// Shift of the reported pose that would fit best; reported, never applied.
    pub shift_pose: Option<Shift>,
    /// Misfit by channel and phase.
    pub heat: Vec<HeatRow>,
    /// Curves for the report.
    pub signals: Signals,
}

/// A number that was fitted of one recording alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fitted {
    /// What it is.
    pub name: String,
    /// Unit; `1` for a ratio.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Its declared standard deviation from run to run, in the same unit; absent where it is free.
    pub declared: Option<f64>,
}

/// One block with its inputs clamped to the recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    /// What goes in and what comes out.
    pub block: String,
    /// Channel of the residual.
    pub channel: String,
    /// Root mean square of the residual over the recording, in `unit`.
    pub rms: f64,
    /// The same with nothing fitted of this recording.
    pub rms_unfitted: f64,
    /// Root mean square over the contact and 20 ms on either side (a drive: the whole recording), in `unit`.
    pub rms_contact: Option<f64>,
    /// Twice the standard deviation of [`Block::rms_contact`] from the noise, in `unit`.
    pub rms_contact_uncertainty: Option<f64>,
    /// Fit, magnitude and phase over the same window; of the force, with known bias and weight taken out.
    pub agreement: Option<Agreement>,
    /// Standard deviation of the channel at rest, in `unit`; 0 where it is not known.
    pub noise_floor: f64,
    /// Unit of the numbers above.
    pub unit: String,
    /// Misfit √Q in multiples of the noise, over blocks of 40 ms; absent where the noise is not known.
    pub misfit: Option<f64>,
    /// Misfit above which noise alone is not believed (3 sigma for this number of blocks and for what the
    /// recording at rest tells of the noise, and at least √1.35).
    pub misfit_limit: f64,
    /// Phases whose own misfit noise alone would not reach (4 sigma for their number of blocks).
    pub phases_outside: Vec<Phase>,
    /// What follows.
    pub verdict: Verdict,
}

/// A quantity of interest: `difference ± uncertainty` (V&V 20).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Name; the same that `--limit` takes.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// How it was had from either side.
    pub about: String,
    /// From the recording.
    pub measured: Option<f64>,
    /// Mean of the free runs.
    pub model: Option<f64>,
    /// Model minus measured.
    pub difference: Option<f64>,
    /// Twice the validation uncertainty, `2 √(u_data² + u_input² + u_numerical²)`.
    pub uncertainty: Option<f64>,
    /// Standard deviation of the measured value from sensor noise in the record alone.
    pub u_data: f64,
    /// Standard deviation of the model's value from declared repeatability and from noise that went through the loop.
    pub u_input: f64,
    /// Change of the model's value when the physics step is halved.
    pub u_numerical: f64,
    /// What follows; shown, gates nothing.
    pub verdict: Verdict,
}

/// How the free runs of one recording went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeRunSummary {
    /// Runs that were made.
    pub samples: usize,
    /// Runs that left 1 m or became infinite; they are in no band.
    pub diverged: usize,
    /// Seed of the run.
    pub seed: u64,
    /// Largest distance between the recorded command and the median of the free runs, in m.
    pub command_error_m: Option<f64>,
    /// Half width of the 95 % band of the free runs' command at that instant, in m.
    pub command_band_m: Option<f64>,
}

/// A shift in time that would fit best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shift {
    /// Measurement later than the model by this much, in ms.
    pub shift_ms: f64,
    /// Its standard deviation, in ms, widened by the misfit.
    pub sd_ms: f64,
    /// By how much it would lower chi².
    pub gain: f64,
    /// Which share of the chi² above its expectation that is.
    pub share_of_excess: f64,
    /// Whether it is more than two standard deviations and 25 of chi², and leaves little above the noise: else something that
    /// is no shift is imitated.
    pub finding: bool,
}

/// Misfit of one channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeatRow {
    /// Channel.
    pub channel: String,
    /// One cell for each phase that occurs, in order of time.
    pub cells: Vec<HeatCell>,
}

/// Misfit of one channel in one phase.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeatCell {
    /// Phase.
    pub phase: Phase,
    /// √Q in multiples of the noise.
    pub misfit: f64,
    /// On how many blocks of 40 ms it rests.
    pub blocks: usize,
}

/// A limit of the user against one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitResult {
    /// Channel or quantity.
    pub channel: String,
    /// The limit, in `unit`.
    pub limit: f64,
    /// What it is compared with: RMSE of a channel, absolute difference of a quantity, in `unit`.
    pub value: Option<f64>,
    /// Uncertainty of that value (2 u), in `unit`.
    pub uncertainty: Option<f64>,
    /// Unit.
    pub unit: String,
    /// `value + 2u ≤ limit` passes, `value - 2u > limit` fails, else undecided.
    pub outcome: Outcome,
    /// File name of the recording.
    pub session: String,
}

/// Curves for the report. Forces are contact forces: bias and weight taken out, positive resists penetration.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Signals {
    /// Times of the force samples, in s.
    pub force_time_s: Vec<f64>,
    /// Measured contact force, in N; a gap where no sample was recorded.
    pub force_measured_n: Vec<Option<f64>>,
    /// Contact force of the force block, in N.
    pub force_model_n: Vec<f64>,
    /// Measured minus model, in N.
    pub force_residual_n: Vec<Option<f64>>,
    /// Two standard deviations of the sensor at rest, in N.
    pub force_band_n: f64,
    /// Penetration of the model's path at the force samples, in m.
    pub depth_m: Vec<f64>,
    /// Median contact force of the free runs, in N; empty without contact.
    pub free_median_n: Vec<f64>,
    /// 2.5 % of the free runs lie below it, in N.
    pub free_low_n: Vec<f64>,
    /// 2.5 % of the free runs lie above it, in N.
    pub free_high_n: Vec<f64>,
    /// Times of the pose samples, in s.
    pub pose_time_s: Vec<f64>,
    /// Reported position, in m.
    pub pose_measured_m: Vec<Option<f64>>,
    /// Position of the path block, in m.
    pub pose_model_m: Vec<f64>,
    /// Measured minus model, in m.
    pub pose_residual_m: Vec<Option<f64>>,
    /// Two standard deviations of the reported position, in m.
    pub pose_band_m: f64,
    /// First and last contact by the model's path, in s.
    pub contact_s: Option<(f64, f64)>,
}
