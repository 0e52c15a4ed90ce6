//! Steps in a command: where they are, what each one says, and how much of it another axis feels.

use super::axes::AxisSignal;
use crate::model::ROBOT_AXES;
use serde::Serialize;
use sim_core::identification::{Choice, Classical, StepTest, classical, fit_step};

/// Changes of a command closer than this are one step, which a controller may have rounded. Chosen: ten periods of 250 Hz and more.
const TOGETHER_S: f64 = 0.1;
/// The command must hold this long after a step: three periods of the slowest axis that is expected, 3 Hz, need a second; a third
/// of it still fits.
const HOLD_MIN_S: f64 = 0.3;
/// Of the time before a step, as much is kept.
const BEFORE_S: f64 = 0.2;
/// A step is this many standard deviations of the pose at rest, or it is not one to learn from: 5 % of it are then noise.
const NOISES_MIN: f64 = 20.0;
/// Part of the period over which a coupled motion is averaged: its peak loses at most 2 %.
const AVERAGED: f64 = 0.1;

/// One step and what it says.
#[derive(Debug, Clone, Serialize)]
pub struct Stepped {
    /// When the command changed, in s since the recording's first sample.
    pub at_s: f64,
    /// By how much, in m or rad.
    pub size: f64,
    /// First overshoot over the step, by the classical reading.
    pub overshoot: Option<f64>,
    /// Natural frequency by the classical reading.
    pub classical_frequency_hz: Option<f64>,
    /// Damping by the classical reading: of the decay, or of the overshoot.
    pub classical_damping: Option<f64>,
    /// What the other axes of its sort did.
    pub coupling: Vec<Coupling>,
    /// The fit.
    #[serde(skip)]
    pub choice: Choice,
}

/// What another axis did while one made a step.
#[derive(Debug, Clone, Serialize)]
pub struct Coupling {
    /// The other axis.
    pub axis: &'static str,
    /// Its largest excursion, in per cent of the step, without what noise adds to a largest value.
    pub percent: f64,
    /// Noise of that number.
    pub noise_percent: f64,
}

/// Every step of an axis that can be learned from. `all` are the six axes of the recording.
pub fn steps(all: &[AxisSignal; 6], axis: usize) -> Vec<Stepped> {
    let groups: Vec<Vec<Vec<(f64, f64)>>> = all.iter().map(|signal| grouped(&signal.changes())).collect();
    let begins = || groups.iter().flatten().filter_map(|group| Some(group.first()?.0));
    let ends = || groups.iter().flatten().filter_map(|group| Some(group.last()?.0));
    let mut found = Vec::new();
    for group in &groups[axis] {
        let (begin_s, end_s) = (group[0].0, group[group.len() - 1].0);
        // The window ends where any axis begins the next step, and begins where the last one was settled.
        let until_s = begins().filter(|other| *other > end_s).fold(f64::INFINITY, f64::min);
        let from_s = ends().filter(|other| *other < begin_s).map(|other| other + HOLD_MIN_S).fold(0.0, f64::max);
        let from_s = from_s.max(begin_s - BEFORE_S).min(begin_s);
        let held_s = until_s.min(all[axis].pose_s.last().copied().unwrap_or(0.0)) - end_s;
        let alone = (0..6).all(|other| {
            other == axis
                || groups[other].iter().flatten().all(|(time, _)| *time < begin_s - TOGETHER_S || *time > end_s)
        });
        if held_s >= HOLD_MIN_S && alone {
            found.extend(stepped(all, axis, group, (from_s, until_s)));
        }
    }
    found
}

/// Changes that belong together.
fn grouped(changes: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let mut groups: Vec<Vec<(f64, f64)>> = Vec::new();
    for change in changes {
        match groups.last_mut() {
            Some(group) if group.last().is_some_and(|last| change.0 - last.0 <= TOGETHER_S) => group.push(*change),
            _ => groups.push(vec![*change]),
        }
    }
    groups
}

fn stepped(all: &[AxisSignal; 6], axis: usize, changes: &[(f64, f64)], window: (f64, f64)) -> Option<Stepped> {
    let times = &all[axis].pose_s;
    let from = times.partition_point(|time| *time < window.0);
    let to = times.partition_point(|time| *time < window.1);
    let begin = times.partition_point(|time| *time < changes[0].0);
    let test = StepTest {
        changes: changes.to_vec(),
        time_s: times[from..to].to_vec(),
        pose: all[axis].pose[from..to].to_vec(),
    };
    let size = test.size();
    let (_, scatter) = level(&all[axis].pose[from..begin]);
    if size.abs() < NOISES_MIN * scatter {
        return None;
    }
    let choice = fit_step(&test)?;
    let read: Option<Classical> = classical(&test);
    let sort = axis / 3 * 3;
    let span_s = choice.way().lag.map_or(0.0, |(lag, _)| AVERAGED / lag.natural_frequency_hz);
    let others = (sort..sort + 3).filter(|other| *other != axis);
    let coupling = others.map(|other| {
        let (before, noise) = level(&all[other].pose[from..begin]);
        let (excursion, count) = excursion(&all[other].pose[begin..to], &times[begin..to], before, span_s);
        let percent = 100.0 * excursion / size.abs();
        let noise_percent = 100.0 * noise / (size.abs() * (count as f64).sqrt());
        Coupling { axis: ROBOT_AXES[other], percent, noise_percent }
    });
    Some(Stepped {
        at_s: changes[0].0,
        size,
        overshoot: read.map(|read| read.overshoot),
        classical_frequency_hz: read.and_then(|read| read.natural_frequency_hz),
        classical_damping: read.map(|read| read.damping_from_decay.unwrap_or(read.damping_from_overshoot)),
        coupling: coupling.collect(),
        choice,
    })
}

/// Mean and standard deviation.
fn level(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    (mean, square.sqrt())
}

/// Largest distance from the level before, of means over this span; and how many samples such a mean has.
///
/// The largest of many noisy means is too large. So one half of the samples says where it is, and the other half how large: the mean
/// of both ways round. Of noise alone that is nothing, and not three deviations.
fn excursion(values: &[f64], times: &[f64], before: f64, span_s: f64) -> (f64, usize) {
    let period_s = match times {
        [first, .., last] => (last - first) / (times.len() - 1) as f64,
        _ => return (0.0, 1),
    };
    let count = ((span_s / period_s).round() as usize).clamp(2, values.len());
    let half = |part: &[f64], first: usize| {
        let chosen = part.iter().skip(first).step_by(2);
        chosen.clone().sum::<f64>() / chosen.count() as f64 - before
    };
    let by = |says: usize| {
        let place = values.windows(count).max_by(|a, b| half(a, says).abs().total_cmp(&half(b, says).abs()));
        place.map_or(0.0, |part| half(part, 1 - says) * half(part, says).signum())
    };
    ((0.5 * (by(0) + by(1))).max(0.0), count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::rng::Streams;

    /// 200 axes of nothing but noise, and 200 that move by as much as it for a while: the mean of what is found is what there is.
    #[test]
    fn the_largest_of_noise_is_not_told_as_a_motion() {
        let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.004).collect();
        let mean = |moves: f64| {
            let one = |seed: u64| {
                let mut stream = Streams::new(seed).named("coupling");
                let moved = |i: usize| if (100..200).contains(&i) { moves } else { 0.0 };
                let values: Vec<f64> = (0..400).map(|i| moved(i) + stream.normal()).collect();
                excursion(&values, &times, 0.0, 0.1).0
            };
            (0..200).map(one).sum::<f64>() / 200.0
        };
        // A mean of 25 samples has 0.2, and what is cut off below 0 leaves 0.4 of that; the largest of such means would be 0.5.
        assert!(mean(0.0) < 0.12, "{}", mean(0.0));
        // Where noise pulls the place over an edge of the motion, some of it is missed.
        assert!((mean(1.0) - 1.0).abs() < 0.1, "{}", mean(1.0));
    }
}
