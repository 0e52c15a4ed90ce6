//! Is anything left? Block means of the whitened residuals, in multiples of their own noise, by phase and channel.
//!
//! Over a block of n whitened samples, `(mean √n)²` has mean 1 when only noise is left; Q is its average over blocks, and the
//! misfit is √Q. Single samples would hide a small lasting force under the noise; blocks of 40 ms show it.

use super::problem::{Problem, Run, Scratch, Trial};
use crate::case::Case;
use crate::recording::Kind;
use serde::Serialize;

/// Length of a block: a few periods of the loop, a twentieth of a contact.
pub const BLOCK_S: f64 = 0.040;
/// Block statistic above which something is left …
pub const Q_MAX: f64 = 1.35;
/// … and as seldom as a normal value beyond this many standard deviations: a few blocks scatter by themselves.
const Q_SIGMA: f64 = 4.0;
/// Half length of the windows around first and last contact.
const EDGE_S: f64 = 0.060;

/// Where in a run: the phases of an impact, or all of a run without contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Before contact.
    Approach,
    /// The first 60 ms of contact.
    Onset,
    /// Going in.
    Compression,
    /// Coming out.
    Expansion,
    /// The last 60 ms of contact and the 60 ms after.
    Release,
    /// After contact.
    Retreat,
    /// A run without contact: moving.
    FreeFlight,
    /// A run without contact: at rest.
    Rest,
}

impl Phase {
    /// All of them, in order of time.
    pub const ALL: [Phase; 8] = [
        Phase::Approach,
        Phase::Onset,
        Phase::Compression,
        Phase::Expansion,
        Phase::Release,
        Phase::Retreat,
        Phase::FreeFlight,
        Phase::Rest,
    ];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Approach => "approach",
            Phase::Onset => "onset",
            Phase::Compression => "compression",
            Phase::Expansion => "expansion",
            Phase::Release => "release",
            Phase::Retreat => "retreat",
            Phase::FreeFlight => "free flight",
            Phase::Rest => "rest",
        }
    }

    /// Whether the interfaces touch.
    pub fn in_contact(self) -> bool {
        matches!(self, Phase::Onset | Phase::Compression | Phase::Expansion | Phase::Release)
    }
}

/// When the interfaces touch, by the nominal path: first contact, deepest point, last contact, in s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contact {
    /// First contact.
    pub first_s: f64,
    /// Deepest penetration.
    pub deepest_s: f64,
    /// Last contact.
    pub last_s: f64,
}

impl Contact {
    /// From the path of a run; `None` if it never penetrates.
    pub fn of(run: &Run) -> Option<Self> {
        let step_s = run.case.rates.physics_step.seconds();
        let path = &run.nominal_path().achieved;
        let inside = |motion: &sim_core::space::AxisMotion| motion.position_m > 0.0;
        let first = path.iter().position(inside)?;
        let last = path.iter().rposition(inside)?;
        let deepest = (first..=last).max_by(|&a, &b| path[a].position_m.total_cmp(&path[b].position_m))?;
        let s = |index: usize| index as f64 * step_s;
        Some(Contact { first_s: s(first), deepest_s: s(deepest), last_s: s(last) })
    }

    /// The phase at a time.
    pub fn phase(&self, time_s: f64) -> Phase {
        let onset_end = self.first_s + EDGE_S;
        let release = self.last_s - EDGE_S;
        if time_s < self.first_s {
            Phase::Approach
        } else if time_s < onset_end.min(self.deepest_s) {
            Phase::Onset
        } else if time_s < self.deepest_s {
            Phase::Compression
        } else if time_s < release {
            Phase::Expansion
        } else if time_s < self.last_s + EDGE_S {
            Phase::Release
        } else {
            Phase::Retreat
        }
    }
}

/// The channel of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Channel {
    /// Force along the axis.
    #[serde(rename = "force_z_n")]
    Force,
    /// Reported position along the axis.
    #[serde(rename = "measured_z_m")]
    Position,
}

/// Block statistics of one run.
#[derive(Debug, Clone)]
pub struct Block {
    /// Where it lies.
    pub phase: Phase,
    /// Of which channel.
    pub channel: Channel,
    /// `(mean √n)²`.
    pub chi2: f64,
}

/// The phase of every time of a run.
pub fn phase_of(run: &Run, case: &Case) -> impl Fn(f64) -> Phase {
    let contact = Contact::of(run);
    let kind = case.kind;
    move |time_s| match contact {
        Some(contact) if kind == Kind::Impact => contact.phase(time_s),
        _ if kind == Kind::Static => Phase::Rest,
        _ => Phase::FreeFlight,
    }
}

/// Blocks of all residuals of a run.
pub fn blocks(problem: &Problem, run: usize, residuals: &[f64]) -> Vec<Block> {
    let here = &problem.runs[run];
    let case = &here.case;
    let phase = phase_of(here, case);
    let force = problem.force_count(run).min(residuals.len());
    let mut out = Vec::new();
    let mut add = |channel, values: &[f64], period_s: f64, time_of: &dyn Fn(usize) -> f64| {
        let length = (libm::round(BLOCK_S / period_s) as usize).max(1);
        for (index, block) in values.chunks_exact(length).enumerate() {
            let sum: f64 = block.iter().sum();
            let middle = time_of(index * length + length / 2);
            out.push(Block { phase: phase(middle), channel, chi2: sum * sum / length as f64 });
        }
    };
    add(Channel::Force, &residuals[..force], case.rates.sensor_period.seconds(), &|tick| case.sensor_time_s(tick));
    add(Channel::Position, &residuals[force..], case.rates.loop_period.seconds(), &|tick| case.loop_time_s(tick));
    out
}

/// Average of block statistics, and how many there are.
pub fn average(blocks: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, count) = blocks.fold((0.0, 0), |(sum, count), chi2| (sum + chi2, count + 1));
    (if count == 0 { 1.0 } else { sum / count as f64 }, count)
}

/// All blocks of all runs under a trial.
pub fn all_blocks(problem: &Problem, trial: &Trial, nuisances: &[super::problem::Nuisance]) -> Vec<Vec<Block>> {
    let mut scratch = Scratch::default();
    (0..problem.runs.len())
        .map(|run| blocks(problem, run, &problem.residuals(run, trial, &nuisances[run], &mut scratch)))
        .collect()
}

/// Where something is left, with its misfit.
pub fn remainder(problem: &Problem, blocks: &[Vec<Block>]) -> Option<(String, f64)> {
    let kinds: Vec<Kind> = problem.runs.iter().map(|run| run.case.kind).collect();
    let mut worst: Option<(String, f64)> = None;
    let mut look = |words: &str, chosen: &dyn Fn(usize, &Block) -> bool| {
        let blocks = blocks.iter().enumerate().flat_map(|(run, blocks)| blocks.iter().map(move |block| (run, block)));
        let (q, n) = average(blocks.filter(|(run, block)| chosen(*run, block)).map(|(_, block)| block.chi2));
        let limit = Q_MAX.max(mean_square_limit(n));
        if n > 0 && q > limit && worst.as_ref().is_none_or(|(_, other)| q > *other) {
            worst = Some((words.to_string(), q));
        }
    };
    for (channel, name) in [(Channel::Force, "force"), (Channel::Position, "reported pose")] {
        for phase in Phase::ALL {
            look(&format!("the {name} in {}", phase.name()), &|_, block| {
                block.channel == channel && block.phase == phase
            });
        }
        look(&format!("the {name} in contact"), &|_, block| block.channel == channel && block.phase.in_contact());
        look(&format!("the {name}"), &|run, block| block.channel == channel && kinds[run] == Kind::Impact);
    }
    worst
}

/// The mean of `n` squares of normal values that is as rare as one beyond [`Q_SIGMA`] (Wilson and Hilferty: its cube root is normal).
fn mean_square_limit(n: usize) -> f64 {
    let spread = 2.0 / (9.0 * n.max(1) as f64);
    let root = 1.0 - spread + Q_SIGMA * libm::sqrt(spread);
    root * root * root
}

#[cfg(test)]
mod tests {
    use super::mean_square_limit;

    /// Of an even number of squares it is known how often their mean is beyond a value.
    #[test]
    fn the_limit_is_passed_as_seldom_as_four_standard_deviations() {
        for half in [1, 4, 20, 100] {
            let x = f64::from(half) * mean_square_limit(2 * half as usize);
            let mut term = libm::exp(-x);
            let mut beyond = term;
            for k in 1..half {
                term *= x / f64::from(k);
                beyond += term;
            }
            assert!((1.5e-5..4e-5).contains(&beyond), "{half}: {beyond}");
        }
    }
}
