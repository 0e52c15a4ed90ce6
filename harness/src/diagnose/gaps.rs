//! What a recording lacks and what of it could be judged, in numbers and in words.

use super::software::{Balance, FELT_N};
use super::stretches::sample_of;
use crate::case::{Case, Settled};
use crate::missing::Has;
use serde::Serialize;

/// Least share of the cycles in which a force acts that must be judged. Chosen: half.
pub const JUDGED_MIN: f64 = 0.5;
/// Times that are named one by one.
const NAMED_MAX: usize = 3;

/// What a recording lacks, and what could be judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gaps {
    /// Cycles of the recording.
    pub cycles: usize,
    /// Cycles before the first command: what the robot was told then is not recorded.
    pub before_first: usize,
    /// Times of cycles without a command, in s.
    pub without_command_s: Vec<f64>,
    /// Times of cycles whose command is the one before again, and should not be, in s.
    pub repeated_s: Vec<f64>,
    /// Times of cycles with a command and without a reported pose, in s.
    pub without_pose_s: Vec<f64>,
    /// Times of cycles whose reading is missing, came late, or came first after a gap, in s.
    pub without_reading_s: Vec<f64>,
    /// Times of commands that the robot did not get in time, in s.
    pub unheard_s: Vec<f64>,
    /// Times at which the software did something else soon after a gap, in s.
    pub resumed_s: Vec<f64>,
    /// Cycles that could not be judged.
    pub left_out: usize,
    /// Share of the cycles in which a force acts that were judged.
    pub judged_share: f64,
}

impl Gaps {
    /// What is missing in the recording, and how much was judged; none where nobody needed it.
    pub(super) fn of(case: &Case, felt: &[Balance], judged: &[bool]) -> Option<Gaps> {
        let time_s = |tick: usize| case.loop_time_s(tick);
        let ticks = 0..case.commanded.len();
        let nothing = |all: &[Has], at: usize| all.get(at) == Some(&Has::Nothing);
        let command = |tick: &usize| nothing(&case.missing.command, *tick);
        let recorded = |tick: &usize| case.commanded_known[*tick];
        let pose = |tick: &usize| nothing(&case.missing.pose, *tick) && !command(tick);
        let has = |sample: usize| case.missing.reading.get(sample).copied().unwrap_or(Has::Sample);
        let reading = |tick: &usize| sample_of(case, *tick).is_some_and(|sample| has(sample) != Has::Sample);
        let acts: Vec<bool> = felt.iter().map(|balance| balance.felt_n.abs() > 2.0 * FELT_N).collect();
        let all = acts.iter().filter(|acts| **acts).count();
        let shown = acts.iter().zip(judged).filter(|(acts, judged)| **acts && **judged).count();
        let Settled { unheard, resumed, .. } = &case.settled;
        let gaps = Gaps {
            cycles: case.commanded.len(),
            before_first: case.missing.before,
            without_command_s: ticks.clone().filter(|tick| command(tick) && !recorded(tick)).map(time_s).collect(),
            repeated_s: ticks.clone().filter(|tick| command(tick) && recorded(tick)).map(time_s).collect(),
            without_pose_s: ticks.clone().filter(pose).map(time_s).collect(),
            without_reading_s: ticks.filter(reading).map(time_s).collect(),
            unheard_s: unheard.iter().map(|tick| time_s(*tick)).collect(),
            resumed_s: resumed.iter().map(|tick| time_s(*tick)).collect(),
            left_out: judged.iter().filter(|judged| !**judged).count(),
            judged_share: if all == 0 { 1.0 } else { shown as f64 / all as f64 },
        };
        (!gaps.is_none()).then_some(gaps)
    }

    /// Whether enough is left to judge the software.
    pub fn is_enough(&self) -> bool {
        self.judged_share >= JUDGED_MIN
    }

    /// What is missing, and what came of it, in words.
    pub fn words(&self) -> String {
        let of = |times: &[f64], what: &str| {
            (!times.is_empty()).then(|| format!("{} of {} cycles {what} ({})", times.len(), self.cycles, at(times)))
        };
        let before = (self.before_first > 0).then(|| format!("{} cycles before the first command", self.before_first));
        let parts = [
            before,
            of(&self.without_command_s, "without a command"),
            of(&self.repeated_s, "whose command is the one before again"),
            of(&self.without_pose_s, "without a reported pose"),
            of(&self.without_reading_s, "without a reading that is surely its own"),
            of(&self.unheard_s, "whose command did not reach the robot in time"),
            of(&self.resumed_s, "soon after a gap in which the software did what the recording does not explain"),
        ];
        let missing = parts.into_iter().flatten().collect::<Vec<String>>().join(", ");
        if !self.is_enough() {
            return format!(
                "{missing}: too little is left to judge the software, {:.0} % of the cycles in which a force acts, and at least {:.0} % are needed",
                100.0 * self.judged_share,
                100.0 * JUDGED_MIN
            );
        }
        match self.left_out {
            0 => format!("{missing}: with that, and not without, the commands follow"),
            left_out => {
                format!("{missing}: the software was judged on the stretches between, {left_out} cycles left out")
            }
        }
    }

    /// Whether the software had all that it needed, and the robot too.
    fn is_none(&self) -> bool {
        let all =
            [&self.without_command_s, &self.without_pose_s, &self.without_reading_s, &self.unheard_s, &self.resumed_s];
        self.left_out == 0 && all.iter().all(|times| times.is_empty())
    }
}

fn at(times: &[f64]) -> String {
    let named: Vec<String> = times.iter().take(NAMED_MAX).map(|time_s| format!("{time_s:.3} s")).collect();
    match times.len() - named.len() {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}
